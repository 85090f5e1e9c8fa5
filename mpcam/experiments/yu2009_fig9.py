"""Yu et al. 2009, Fig. 9: a still cow turns its head, by two cross-slit cameras of which one turns on a hinge."""

from functools import partial
from typing import Any

import numpy as np

from mpcam.comparison import timing
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.experiments import yu2009_paper as paper
from mpcam.experiments.common import WARMUP, WRONG, machine, measured, rounds, wrong_pixels
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.experiments.yu2009_measures import errors, seam, seam_pixels
from mpcam.experiments.yu2009_scenes import cow_scene
from mpcam.experiments.yu2009_views import hinged
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import shade

FRAMES = 32
MIDDLE, SWING = 36.0, 24.0
"""Degrees of the second path out of the line of the first: from 12, away from the face, to 60, toward it."""
PATCH = 10
ROUNDS = 9
DEPTHS = (1.0, 2.1, 2.35)
"""How far from the path seams are looked at, in scene units: on the near side of the cow."""
METHODS: dict[str, dict[str, Any]] = {"invert": {}, "two_pass": {"patch": PATCH}, "raytrace": {}}
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    width, height = (120, 90) if quick else paper.SIZE
    frames, count = (4 if quick else FRAMES), rounds(repeats, quick, ROUNDS)
    angles = MIDDLE - SWING * np.cos(2 * np.pi * np.arange(frames) / frames)
    scene = cow_scene()
    mesh = scene.mesh
    cameras = [hinged(width, height, float(angle)) for angle in angles]
    timed = 2 * len(METHODS) * (1 + WARMUP + count)
    steps = StepCounter(progress, frames + timed + 1)
    prepared = {method: prepare(cameras[0], mesh, method, **settings) for method, settings in METHODS.items()}
    rows, images = [], []
    for angle, camera in zip(angles, cameras, strict=True):
        hits = {}
        for method, one in prepared.items():
            one.aim(camera)
            hits[method] = one.frame()
        jump = seam(camera)
        row: dict[str, Any] = {"angle": float(angle), "seam_degrees": jump["degrees"], "seam_units": jump["units"]}
        row["seam_pixels"] = seam_pixels(camera, DEPTHS)
        for method in ("invert", "two_pass"):
            row |= {f"{method}_{key}": value for key, value in errors(hits[method], hits["raytrace"]).items()}
        rows.append(row)
        images.append(shade(hits["invert"], scene, "light"))
        steps.done(f"{angle:.0f} degrees")
    times = _times((width, height), mesh, count, steps)
    chosen = sorted({0, frames // 4, frames // 2})
    stills = [Picture(f"turned-{k}", f"turned by {angles[k]:.0f} degrees", images[k]) for k in chosen]
    film = Picture("film", f"{frames} frames of the turning", images[frames // 4], tuple(images))
    report = Report(
        name="yu2009-fig9",
        title="A still cow turns its head",
        subject="Yu et al. 2009, Fig. 9 · two cross-slit cameras, of which one turns on a hinge",
        reading=_reading(rows, times),
        parts=(
            _time_table(times),
            Gallery("The turning", (film, *stills), "The cow stands still: only the second camera turns."),
            _plot(rows),
            _frame_table(rows),
        ),
        scene={
            "paper": paper.PAPER,
            "cow": f"{mesh.triangle_count:,} triangles",
            "cameras": "the first sees body and tail from the side; the second begins at the end of the first, and its "
            "path turns about that end. Both slits stand upright behind it, in line with the hinge",
            "pixels": f"{width} × {height}",
        },
        machine=machine(),
        measured=measured(
            count,
            aimed="a frame of the next camera: `aim`, then first hits; nothing of the scene is made again",
            anew="everything prepared for the next camera, then first hits",
            two_passes=f"{PATCH} × {PATCH} samples a triangle",
            wrong=WRONG,
            seam="rays 1e-9 pixels left and right of the hinge; pixels: where the second camera shows points that the "
            f"first shows at the hinge, {', '.join(f'{depth:g}' for depth in DEPTHS)} from the path",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _times(size: tuple[int, int], mesh: Mesh, count: int, steps: StepCounter) -> Rows:
    """Medians of a frame of the next camera by method: aimed, and prepared anew. Each call has a camera of its own,
    made before it, so that nothing that is kept of a camera helps the next call."""
    random = np.random.default_rng(9)
    prepared = {
        method: prepare(hinged(*size, MIDDLE), mesh, method, **settings) for method, settings in METHODS.items()
    }
    following: list[Any] = [None]

    def turn() -> None:
        following[0] = hinged(*size, random.uniform(MIDDLE - SWING, MIDDLE + SWING))

    def aimed(method: str) -> object:
        prepared[method].aim(following[0])
        return prepared[method].frame()

    def anew(method: str) -> object:
        return prepare(following[0], mesh, method, **METHODS[method]).frame()

    ways = {"aim": aimed, "anew": anew}
    calls: dict[str, Any] = {f"{m} {way}": partial(call, m) for way, call in ways.items() for m in METHODS}
    found = timing.measure(calls, count, WARMUP, before=dict.fromkeys(calls, turn), on_call=steps.done)
    names = {"invert": "invert", "two_pass": f"two passes, {PATCH} × {PATCH}", "raytrace": "Mitsuba"}
    rows = []
    for method, name in names.items():
        aim, new = (1e3 * found[f"{method} {kind}"].median for kind in ("aim", "anew"))
        ratio = aim / (1e3 * found["raytrace aim"].median)
        rows.append({"method": name, "aim_ms": aim, "anew_ms": new, "gain": new / aim, "ratio": ratio})
    return rows


def _time_table(rows: Rows) -> Table:
    columns = (
        Column("method", "Method"),
        Column("aim_ms", "Aimed", "ms", "Median of a frame of the next camera.", "Frame"),
        Column("anew_ms", "Anew", "ms", "Median of a frame with everything prepared for it.", "Frame"),
        Column("gain", "Gain", "×", "Anew / aimed."),
        Column("ratio", "Ratio", "", "Aimed / aimed in Mitsuba, whose tree stays."),
    )
    return Table("times", "A frame of a camera that turns", columns, tuple(rows), paper.CARD)


def _frame_table(rows: Rows) -> Table:
    help = "Share of the pixels that differ from first hits in Mitsuba."
    columns = (
        Column("angle", "Turned", "°"),
        Column("invert_wrong_percent", "Invert", "%", help, "Wrong"),
        Column("two_pass_wrong_percent", "Two passes", "%", help, "Wrong"),
        Column("two_pass_holes", "Holes", "px", "Uncovered pixels inside outlines, two passes."),
        Column("seam_degrees", "Directions", "°", "Angle between rays on both sides.", "Seam"),
        Column("seam_units", "Origins", "m", "Distance of the ray on the right from that on the left.", "Seam"),
        Column("seam_pixels", "Image", "px", "Between the images of a point in both cameras.", "Seam"),
    )
    return Table("frames", "Frame by frame", columns, tuple(rows))


def _plot(rows: Rows) -> Plot:
    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        for number, (method, name) in enumerate((("invert", "invert"), ("two_pass", "two passes"))):
            at = [[row[key] for row in rows] for key in ("angle", f"{method}_wrong_percent")]
            axes.plot(*at, "o", color=theme.palette[number], ms=4.5, label=name)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("turned (degrees)")
        axes.set_ylabel("wrong pixels (%)")
        axes.grid()
        figure.legend(loc="outside lower center", ncols=2)

    caption = "Share of the pixels of a frame that differ from ray tracing, against the angle of the second camera."
    return Plot("wrong", caption, "Wrong pixels against the angle of turning", draw, height=3.2)


def _reading(rows: Rows, times: Rows) -> str:
    worst = {key: max(row[key] for row in rows) for key in ("invert_wrong_percent", "two_pass_wrong_percent")}
    pixels, degrees = (max(row[key] for row in rows) for key in ("seam_pixels", "seam_degrees"))
    invert, two_pass, _ = times

    def both(key: str) -> str:
        return f"{invert[key]:.3g} by inverting and {two_pass[key]:.3g} by two passes"

    return (
        "The head turns while the cow stands still, and the picture has no seam: at the hinge both cameras show a "
        f"point at most {pixels:.1g} pixels apart, and rays turn by {degrees:.1g} degrees. Milliseconds of a frame of "
        f"the next camera: {both('aim_ms')}. In times of ray tracing, which keeps its tree, too: {both('ratio')}. "
        f"Preparing everything anew, in times of aiming: {both('gain')}. Inverting: "
        f"{wrong_pixels(worst['invert_wrong_percent'])} Two passes: "
        f"{wrong_pixels(worst['two_pass_wrong_percent'])} {paper.STAND_IN}"
    )
