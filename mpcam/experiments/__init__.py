"""Experiments of the papers, run again: each measures, sets its figures beside the paper's and writes a page.

`mpcam experiment NAME` runs one; from Python, `run(NAME)`.
"""

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from mpcam.errors import InputError
from mpcam.experiments.catalog import EXPERIMENTS

if TYPE_CHECKING:
    from mpcam.comparison.progress import Progress
    from mpcam.experiments.results import Report


def run(
    name: str,
    *,
    repeats: int | None = None,
    quick: bool = False,
    output: str | Path | None = None,
    progress: "Progress | None" = None,
) -> "Report":
    """Run an experiment and return what it found.

    name: one of EXPERIMENTS. repeats: timed rounds, in place of the experiment's own number. quick: small images and
    scenes and few rounds, to see that everything works; the figures mean little. output: a folder for tables (CSV,
    JSON), plots, pictures and the page; written whole or not at all. progress: called as progress(done, total, what).
    Raises InputError for unknown names, for repeats below 1, and for an unusable folder.
    """
    if name not in EXPERIMENTS:
        raise InputError(f"experiment {name!r}: allowed are {', '.join(EXPERIMENTS)}")
    if repeats is not None and repeats < 1:
        raise InputError(f"repeats={repeats}: at least 1 timed round is needed")
    if output is not None:
        from mpcam.comparison.output import check_output

        check_output(output)
    report = import_module(f"mpcam.experiments.{EXPERIMENTS[name].module}").run(repeats, quick, progress)
    if output is not None:
        from mpcam.experiments.output import write

        write(report, output)
    return report
