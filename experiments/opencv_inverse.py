"""Where OpenCV's inverse of calibrated lenses goes wrong: its rays and ours against 50 digits, by angle.

    python experiments/opencv_inverse.py [--step 0.25] [--output out/opencv_inverse]

Nine lenses, of which "narrow" and "TUM-VI" are real and the others made to be difficult. Of each, pixels at every
`step` degrees from the axis in four azimuths, as far as the image or the lens reaches, and pixels beyond the rim where
the lens folds, which have no ray. OpenCV's answers are those of `cv2.fisheye.undistortPoints` and
`cv2.omnidir.undistortPoints` with their default settings, in float64.

Needs OpenCV (`pip install "mpcam[test]"`). Writes samples.csv, summary.csv, opencv_inverse.png and index.html, and
prints the summary. opencv_inverse_sweep.py beside it says what is truth and what counts as an error.
"""

import argparse
import base64
import csv
import html
import math
from collections.abc import Callable
from dataclasses import asdict, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

import cv2
import matplotlib
import numpy as np
from matplotlib.figure import Figure
from opencv_inverse_sweep import KINDS, LENSES, TOLERANCE, Answer, Sample, Summary, run

import mpcam
from mpcam.io.atomic import atomic_path

# Tables


def write_csv(path: Path, rows: list[dict[str, Any]]) -> None:
    """A table with a line per row; what is None or NaN stays empty."""
    with atomic_path(path) as temporary, open(temporary, "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(rows[0])
        for row in rows:
            writer.writerow([_cell(value) for value in row.values()])


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.12g}"
    return value


def flat(sample: Sample) -> dict[str, Any]:
    """A sample as a row of samples.csv."""
    row = {field.name: getattr(sample, field.name) for field in fields(Sample)}
    for who in ("opencv", "ours"):
        answer = row.pop(who) or Answer("")
        row |= {f"{who}_{key}": value for key, value in asdict(answer).items()}
    return row


def _number(value: float | None) -> str:
    if value is None:
        return "\u2013"
    return f"{value:.1g}" if value < 1 else f"{value:.0f}"


def _first(row: Summary) -> str:
    if row.opencv_unflagged is None:
        return "\u2013"
    return "nowhere" if row.opencv_first is None else f"{row.opencv_first:.1f}\u00b0"


def _share(count: int | None, total: int) -> str:
    return "\u2013" if count is None or not total else f"{count:,} of {total:,}"


def _percent(value: float | None) -> str:
    return "\u2013" if value is None else f"{value:.1f} %"


COLUMNS: dict[str, tuple[str, Callable[[Summary], str]]] = {
    "Lens": ("", lambda row: row.lens),
    "Field of view": ("", lambda row: f"{row.field_of_view:.0f}\u00b0"),
    "Worst error": ("OpenCV, px", lambda row: _number(row.opencv_worst_px)),
    "Worst error ": ("mpcam, px", lambda row: _number(row.ours_worst_px)),
    f"First off by {TOLERANCE} px": ("OpenCV, from the axis", _first),
    "Wrong, not flagged": ("OpenCV, of pixels with a ray", lambda row: _share(row.opencv_unflagged, row.with_ray)),
    "No answer": ("OpenCV, of pixels with a ray", lambda row: _share(row.opencv_missed, row.with_ray)),
    "Answers without a ray": ("OpenCV, beyond the rim", lambda row: _share(row.opencv_invented, row.without_ray)),
    "Wrong, not flagged ": ("OpenCV, of the image", lambda row: _percent(row.opencv_image_percent)),
    "Wrong, missed": ("mpcam", lambda row: f"{row.ours_unflagged + row.ours_invented}, {row.ours_missed}"),
}
"""Title -> line below it, and the text of a cell."""


def print_table(summaries: list[Summary]) -> None:
    lines = [list(COLUMNS), [below for below, _ in COLUMNS.values()]]
    lines += [[text(row) for _, text in COLUMNS.values()] for row in summaries]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        cells = [f"{cell:>{width}}" for cell, width in zip(line[1:], widths[1:], strict=True)]
        print("  ".join([f"{line[0]:{widths[0]}}", *cells]))


# The plot

SMALLEST = 1e-16  # pixels; smaller errors are shown there
THEIRS, OURS, INK, WEAK, FAINT = "#c2560b", "#0b62c4", "#1c1e21", "#5c6166", "#ecece7"


def draw(samples: list[Sample], path: Path) -> None:
    """Write a PNG with one panel per lens: the largest error in pixels over the azimuths, against the angle."""
    names = list(dict.fromkeys(sample.lens for sample in samples))
    style: Any = {"font.size": 9, "axes.edgecolor": WEAK, "text.color": INK, "axes.labelcolor": INK}
    with matplotlib.rc_context(matplotlib.rcParamsDefault | style):
        figure = Figure(figsize=(10, 8.8), dpi=100, layout="constrained")
        panels = figure.subplots(-(-len(names) // 3), 3, sharex=True, sharey=True, squeeze=False).ravel()
        for axes, name in zip(panels, names, strict=False):
            _panel(axes, name, [sample for sample in samples if sample.lens == name and math.isfinite(sample.angle)])
        for axes in panels[len(names) :]:
            axes.set_visible(False)
        figure.supxlabel("angle from the axis, degrees", fontsize=10)
        figure.supylabel("largest error over the azimuths, pixels", fontsize=10)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=5, frameon=False)
        with atomic_path(path) as temporary:
            figure.savefig(temporary)


def _panel(axes: Any, name: str, samples: list[Sample]) -> None:
    end = max(sample.angle for sample in samples)
    axes.set_title(f"{name}\n", loc="left", fontsize=10, fontweight="bold")
    axes.text(0, 1.02, _formula(name), transform=axes.transAxes, fontsize=8, color=WEAK)
    axes.set_yscale("log")
    axes.set(xlim=(0, 150), ylim=(SMALLEST / 4, 1e6), xticks=range(0, 151, 30), yticks=10.0 ** np.arange(-16, 5, 4))
    axes.minorticks_off()
    axes.grid(True, color=FAINT, linewidth=0.8)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.axvspan(end, 150, color=FAINT, linewidth=0)
    axes.axvline(90, color=WEAK, linewidth=0.8, linestyle=":")
    axes.axhline(TOLERANCE, color=WEAK, linewidth=0.8, linestyle="--", label=f"{TOLERANCE} pixel")
    theirs = [sample for sample in samples if sample.opencv]
    mirrored = [sample for sample in theirs if sample.opencv and sample.opencv.kind == "mirrored"]
    others = [sample for sample in theirs if sample.opencv and sample.opencv.kind != "mirrored"]
    missed = [sample.angle for sample in theirs if sample.opencv and sample.opencv.kind == "missed"]
    axes.plot(*_largest(others, "opencv"), ".", color=THEIRS, markersize=3, label="OpenCV")
    axes.plot(*_largest(mirrored, "opencv"), "x", color=THEIRS, markersize=4, markevery=6, label="OpenCV, mirrored")
    axes.plot(missed, np.full(len(missed), 1e5), "|", color=THEIRS, markersize=7, label="OpenCV, no answer")
    axes.plot(*_largest(samples, "ours"), ".", color=OURS, markersize=3, label="mpcam")
    if not theirs:
        axes.text(60, 1e-5, "not in OpenCV", color=WEAK, ha="center")


def _formula(name: str) -> str:
    lens = LENSES[name]
    if isinstance(lens, mpcam.KannalaBrandt):
        text = "k = " + ", ".join(f"{k:.2g}" for k in lens.k)
    else:
        text = f"xi = {lens.xi:.2g}, alpha = {lens.alpha:.2g}"
    return text.replace("-", "\u2212")


def _largest(samples: list[Sample], who: str) -> tuple[list[float], list[float]]:
    """Angles and, over the azimuths, the largest error at each."""
    worst: dict[float, float] = {}
    for sample in samples:
        answer = getattr(sample, who)
        if answer is not None and not math.isnan(answer.px):
            angle = round(sample.angle, 6)
            worst[angle] = max(worst.get(angle, SMALLEST), answer.px)
    return list(worst), list(worst.values())


# The page

STYLE = """
thead th { padding: 8px 10px; white-space: normal; text-align: right; font-size: 13px; }
thead th small { display: block; color: var(--soft); font-weight: 400; font-size: 12px; }
main img { width: 100%; margin-top: 14px; border: 1px solid var(--line); border-radius: 10px; }
"""
PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<header class="page-head">
<h1>{title}</h1>
<p class="subject">OpenCV {opencv}, mpcam {mpcam}, {count} pixels of {lenses} lenses</p>
</header>
<main>
<section>
<div class="table-box" tabindex="0"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>
<p class="help">Pixels: at equal steps of the angle, in four azimuths. Of the image: on a regular grid.</p>
</section>
<section>
<h2>Error against angle</h2>
<p class="help">Dotted: 90 degrees from the axis. Shaded: beyond the image or the lens.</p>
<img src="data:image/png;base64,{picture}" alt="Error in pixels against the angle from the axis, a panel per lens">
</section>
<section>
<h2>What is counted</h2>
<p class="help">The truth is the inverse of the published formula at 50 digits. The error of an answer is the distance
of its image, by that formula, from the pixel it was asked for. An error above {tolerance} pixel is wrong, of which
samples.csv tells three kinds.</p>
<dl class="facts">{kinds}</dl>
</section>
</main>
</body>
</html>
"""


def page(samples: list[Sample], summaries: list[Summary], picture: bytes) -> str:
    """The HTML page, which needs nothing else, in the style of the report of `mpcam compare`. picture: a PNG."""
    escape = html.escape
    head = "".join(f"<th>{escape(title)}<small>{escape(below)}</small></th>" for title, (below, _) in COLUMNS.items())
    cells = [[f"<td>{escape(text(row))}</td>" for _, text in COLUMNS.values()] for row in summaries]
    return PAGE.format(
        title="Where OpenCV's inverse of calibrated lenses goes wrong",
        style=(files("mpcam.comparison") / "page" / "style.css").read_text(encoding="utf-8") + STYLE,
        opencv=escape(cv2.__version__),
        mpcam=escape(mpcam.__version__),
        count=f"{len(samples):,}",
        lenses=len(summaries),
        head=head,
        body="".join(f"<tr>{''.join(row)}</tr>" for row in cells),
        picture=base64.b64encode(picture).decode("ascii"),
        tolerance=TOLERANCE,
        kinds="".join(f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in KINDS.items()),
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--step", type=float, default=0.25, help="degrees between the angles")
    parser.add_argument("--output", type=Path, default=Path("out/opencv_inverse"))
    options = parser.parse_args()
    samples, summaries = run(options.step)
    options.output.mkdir(parents=True, exist_ok=True)
    write_csv(options.output / "samples.csv", [flat(sample) for sample in samples])
    write_csv(options.output / "summary.csv", [asdict(summary) for summary in summaries])
    picture = options.output / "opencv_inverse.png"
    draw(samples, picture)
    with atomic_path(options.output / "index.html") as path:
        path.write_text(page(samples, summaries, picture.read_bytes()), encoding="utf-8")
    print_table(summaries)
    print(f"written: {options.output / 'index.html'}")


if __name__ == "__main__":
    main()
