"""Gascuel et al. 2008, Fig. 9: the pixels that each bound has tested, on the characters."""

from typing import Any

import numpy as np

from mpcam.cameras.change import projected
from mpcam.comparison import timing
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.experiments.common import (
    CARD,
    PAPER,
    RENDERED,
    STAND_IN,
    WARMUP,
    WRONG,
    known_bounds,
    machine,
    measured,
    mismatch,
    rounds,
    wrong_pixels,
)
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.gascuel2008_paper import TABLE_3
from mpcam.experiments.pixel_counts import SQUARE, counts, local_corners
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.math.srgb import linear_from_srgb
from mpcam.pictures.render import render
from mpcam.rendering.methods import prepare, rasterize
from mpcam.scene.builtin import builtin_scene

SIZE, TRIANGLES, QUICK_TRIANGLES, ROUNDS = 512, 177_000, 25_000, 21
WANTED = ("triangle", "quad", "tight")


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    size, count = (256 if quick else SIZE), rounds(repeats, quick, ROUNDS)
    scene = builtin_scene("characters", size, size, triangles=QUICK_TRIANGLES if quick else TRIANGLES)
    camera, mesh = scene.camera, scene.mesh
    bounds, left_out = known_bounds(WANTED)
    steps = StepCounter(progress, len(bounds) * (2 + WARMUP + count) + 3)

    truth = rasterize(camera, mesh, "raytrace")
    prepared = {bound: prepare(camera, mesh, bound=bound) for bound in bounds}
    hits = {bound: one.frame() for bound, one in prepared.items()}
    steps.done("truth")
    corners = local_corners(camera, mesh)
    tested, found = {}, {}
    for bound in bounds:
        tested[bound], found[bound] = counts(camera, corners, bound)
        steps.done(f"counting pixels, {bound}")
    wasted = {bound: tested[bound] - found[bound] for bound in bounds}
    calls = {bound: one.frame for bound, one in prepared.items()}
    times = timing.measure(calls, count, WARMUP, on_call=steps.done)
    rows = []
    for bound in bounds:
        stats = hits[bound].stats
        theirs = TABLE_3.get(("characters", TRIANGLES, "paraboloid", bound))
        row: dict[str, Any] = {
            "bound": bound,
            "covered_k": stats.tests / 1e3,
            "region_k": int(tested[bound].sum()) / 1e3,
            "rendered_k": stats.rendered / 1e3,
            "plain_k": int(found[bound].sum()) / 1e3,
            "most": int(tested[bound].max()),
            "overdraw_percent": 100 * (stats.overdraw - 1),
            "overdraw_paper_percent": theirs.overdraw if theirs else None,
            "frame_ms": 1e3 * times[bound].median,
            "frame_paper_ms": theirs.total if theirs else None,
            "wrong_percent": 100 * mismatch(hits[bound], truth) / truth.triangle.size,
        }
        rows.append(row)
    linear = render(projected(camera, "pinhole"), scene)
    colors = render(camera, scene)
    steps.done("pictures")
    report = Report(
        name="gascuel2008-fig9",
        title="The pixels that each bound tests",
        subject=f"Gascuel et al. 2008, Fig. 9 · characters, {mesh.triangle_count:,} triangles · {size} × {size} pixels",
        reading=_reading(rows),
        parts=(
            _gallery(linear, colors, {bound: accessed(hits[bound], wasted, bound) for bound in bounds}, rows),
            _table(tuple(rows)),
            _plot(tested, found[bounds[-1]]),
        ),
        scene={"paper": PAPER, "scene": f"characters, {mesh.triangle_count:,} triangles (paper: Characters, 177 K)"},
        machine=machine(),
        measured=measured(
            count,
            covered="what the rasterizer counts of itself: tests of a pixel against a triangle",
            in_bounds="what the pictures show: pixels in the bounds of all triangles, counted apart in float64; with "
            f"the tight bound large triangles by squares of {SQUARE} × {SQUARE} pixels that they cover in part. The "
            "rasterizer also widens bounds by what rounding may amount to",
            rendered=f"{RENDERED}; plain: the same counted apart in float64",
            frame="first hits of the whole image, not shaded; the paper's times are those of shaded frames",
            wrong=WRONG,
        ),
        left_out=left_out,
        quick=quick,
    )
    steps.done("done")
    return report


def accessed(hits: Any, wasted: dict[str, np.ndarray], bound: str) -> np.ndarray:
    """The paper's false colors: red and green are the weights of the hit, blue how many tests were in vain.

    Blue goes by the logarithm, on one scale for all bounds.
    """
    most = max(float(np.percentile(count, 99.9)) for count in wasted.values())
    blue = np.clip(np.log1p(wasted[bound]) / np.log1p(max(most, 1.0)), 0, 1)
    weights = np.where(hits.mask[..., None], hits.barycentric, 0)
    return linear_from_srgb(np.dstack([weights, blue])).astype(np.float32)


def _gallery(linear: Any, colors: Any, images: dict[str, np.ndarray], rows: list[dict[str, Any]]) -> Gallery:
    names = {"triangle": "Triangle bounding", "quad": "Quad bounding", "tight": "Tight bounding"}
    pictures = [Picture("linear", "Linear projection", linear), Picture("paraboloid", "Paraboloid projection", colors)]
    for bound, image in images.items():
        row = next(row for row in rows if row["bound"] == bound)
        theirs = row["overdraw_paper_percent"]
        paper = f" (paper: {theirs:.0f} %)" if theirs else ""
        caption = f"{names[bound]}: {row['overdraw_percent']:,.0f} % overdraw{paper}"
        pictures.append(Picture(f"accessed-{bound}", caption, image))
    note = (
        "Red and green: barycentric weights of the hit. Blue: tests in vain, by the logarithm of their number, on one "
        "scale for all bounds."
    )
    return Gallery("Pixels accessed", tuple(pictures), note)


def _table(rows: tuple[dict[str, Any], ...]) -> Table:
    columns = (
        Column("bound", "Bound"),
        Column("covered_k", "Covered", "K", "Tests that the rasterizer counts."),
        Column("region_k", "In bounds", "K", "Pixels in the bounds of all triangles, counted apart."),
        Column("rendered_k", "Rendered", "K", "Tests that hit, as the rasterizer counts."),
        Column("plain_k", "Plain count", "K", "Tests that hit, counted apart in float64.", brief=False),
        Column("most", "Most at a pixel", "", "Bounds that hold the pixel which is in most of them."),
        Column("overdraw_percent", "Ours", "%", "Covered / rendered - 1.", "Overdraw"),
        Column("overdraw_paper_percent", "Paper", "%", "", "Overdraw", paper=True),
        Column("frame_ms", "Ours", "ms", "First hits of a frame.", "Frame"),
        Column("frame_paper_ms", "Paper", "ms", "A shaded frame.", "Frame", paper=True),
        Column("wrong_percent", "Wrong", "%", "Share of the pixels that differ from first hits in Mitsuba."),
    )
    return Table("bounds", "Work of each bound", columns, rows, CARD)


def _plot(tested: dict[str, np.ndarray], rendered: np.ndarray) -> Plot:
    """How many pixels are tested at least n times."""

    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        for number, (name, image) in enumerate((*tested.items(), ("hits", rendered))):
            values = np.sort(image.ravel())[::-1]
            share = 100 * np.arange(1, len(values) + 1) / len(values)
            dashed = name == "hits"
            style: dict[str, Any] = {
                "color": theme.soft if dashed else theme.palette[number],
                "ls": "--" * dashed or "-",
            }
            axes.plot(share, np.where(values > 0, values, np.nan), label=name, **style)
        axes.set_yscale("log")
        plain_ticks(axes.yaxis)
        axes.set_xlabel("share of the pixels that are in so many bounds or more (%)")
        axes.set_ylabel("bounds that hold the pixel")
        axes.grid()
        figure.legend(loc="outside upper right", ncols=len(tested) + 1)

    caption = (
        "In how many bounds a pixel is, from the busiest to the idlest; dashed: how many triangles it really sees."
    )
    alt = "Curves of the number of triangles' bounds that hold a pixel, for each kind of bound"
    return Plot("pixels", caption, alt, draw, height=3.6)


def _reading(rows: list[dict[str, Any]]) -> str:
    parts = []
    for row in rows:
        theirs = row["overdraw_paper_percent"]
        paper = f" (paper: {theirs:.0f} %)" if theirs else ""
        parts.append(f"{row['bound']} {row['overdraw_percent']:,.0f} %{paper}")
    wrong = max(row["wrong_percent"] for row in rows)
    return (
        f"Overdraw, the pixels tested in vain for each one rendered: {', '.join(parts)}. These are counts of work, so "
        f"they compare directly, but for the scene: {STAND_IN[0].lower() + STAND_IN[1:]} {CARD} {wrong_pixels(wrong)}"
    )
