"""One row per case of a stress run, tables of them, and how cases are run one after the other."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

from mpcam.comparison.progress import Progress
from mpcam.errors import InputError

LIMIT = 16.0
"""Largest error that passes, in units of eps times the condition number."""

EPS = {"float64": 2.0**-52, "float32": 2.0**-23}


@dataclass(frozen=True)
class StressRow:
    """What one case of one camera came to.

    camera: which of the model's cameras. count: inputs tried. worst: largest error in units of eps times the condition
    number (NaN where none is measured). missed: inputs with a true answer that came back invalid, or parts of the truth
    that a bound left out. invented: inputs without a true answer that came back valid.
    """

    camera: str
    case: str
    precision: str
    count: int
    worst: float
    missed: int
    invented: int

    def good(self, limit: float = LIMIT) -> bool:
        """Nothing missed, nothing invented, and the error within the limit."""
        return self.missed == 0 and self.invented == 0 and not self.worst > limit


Case = tuple[str, Callable[[], list[StressRow]]]
"""What to tell while it runs, and what gives the rows."""


def run_cases(cases: Sequence[Case], progress: Progress | None = None) -> list[StressRow]:
    """Rows of all cases, in order."""
    rows = []
    for number, (what, case) in enumerate(cases):
        if progress:
            progress(number, len(cases), what)
        rows += case()
    if progress:
        progress(len(cases), len(cases), "done")
    return rows


def check_counts(**counts: int) -> None:
    """Raises InputError for numbers below 1."""
    for name, count in counts.items():
        if count < 1:
            raise InputError(f"stress: {name}={count}: at least 1 is needed")


def as_dicts(model: str, rows: Sequence[StressRow]) -> list[dict[str, Any]]:
    """Rows for JSON; an error that was not measured is None."""
    return [{"model": model} | asdict(row) | {"worst": None if row.worst != row.worst else row.worst} for row in rows]


def joined(rows: Sequence[StressRow], groups: Callable[[StressRow], str]) -> list[StressRow]:
    """One row for each group and precision: counts added up, and the largest error with the camera that has it."""
    found: dict[tuple[str, str], list[StressRow]] = {}
    for row in rows:
        found.setdefault((groups(row), row.precision), []).append(row)
    return [_sum(case, several) for (case, _), several in found.items()]


def _sum(case: str, rows: list[StressRow]) -> StressRow:
    worst = max(rows, key=lambda row: row.worst if row.worst == row.worst else -1.0)
    count, missed, invented = (sum(getattr(row, name) for row in rows) for name in ("count", "missed", "invented"))
    return replace(worst, case=case, count=count, missed=missed, invented=invented)


def case_of(row: StressRow) -> str:
    """Groups the same case of all cameras."""
    return row.case


def kind_of(row: StressRow) -> str:
    """Groups what comes before the first comma of a case: images, rays, bounds."""
    return row.case.partition(",")[0]


def print_rows(title: str, rows: Sequence[StressRow], limit: float, console: Any) -> None:
    """A table on a terminal, failures in red."""
    from rich.table import Table

    table = Table(box=None, padding=(0, 1), title=title, title_justify="left", title_style="bold")
    for name in ("case", "precision"):
        table.add_column(name)
    for name in ("inputs", "missed", "invented", "error / eps cond"):
        table.add_column(name, justify="right")
    table.add_column("largest with")
    for row in rows:
        measured = row.worst == row.worst
        counts = (f"{row.count:,}", f"{row.missed:,}", f"{row.invented:,}", f"{row.worst:.2g}" if measured else "")
        cells = (row.case, row.precision, *counts, row.camera if row.worst > 0 or not row.good(limit) else "")
        table.add_row(*cells, style=None if row.good(limit) else "bold red")
    console.print(table)
