"""Yu et al. 2009, Fig. 1: a cross-slit strip along a city of 15,000 triangles, against a tree rebuilt and traced."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras.pinhole import Pinhole
from mpcam.comparison import timing
from mpcam.comparison.metrics import flip_map
from mpcam.comparison.motion import moving_frame, moving_vertices
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.effects.shadows import shadow_maps
from mpcam.experiments import yu2009_paper_mirrors as paper
from mpcam.experiments.common import WARMUP, WRONG, machine, measured, mismatch, rounds, wrong_pixels
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.experiments.yu2009_city import HEIGHT, PATH, city_scene, strip_camera
from mpcam.math.pose import look_at
from mpcam.rendering.methods import prepare, rasterize
from mpcam.rendering.shade import shade
from mpcam.scene.scene import Scene

ROUNDS = 21
METHODS: dict[str, tuple[str, dict[str, Any]]] = {
    "invert": ("invert", {}),
    "two_pass, patch 5": ("two_pass", {"patch": 5}),
    "two_pass, patch 10": ("two_pass", {"patch": 10}),
    "vertex": ("vertex", {}),
    "vertex, level 2": ("vertex", {"level": 2}),
}
KINDS = ("moving", "still", "aimed")
PLACES = (-16.0, -8.0, 0.0, 8.0, 16.0)
"""Along the street, where the camera that travels stands."""
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count = rounds(repeats, quick, ROUNDS)
    methods = dict(list(METHODS.items())[:2]) if quick else METHODS
    width, height = (128, 40) if quick else (1024, 320)
    steps = StepCounter(progress, 2 + len(methods) * (1 + 6 * (1 + WARMUP + count)) + 1)
    scene = city_scene(width=width, height=height)
    maps = () if quick else shadow_maps(scene, 4096)
    steps.done("the city")
    true_hits = prepare(scene.camera, scene.mesh, "raytrace").frame()
    true_image = shade(true_hits, scene, "light", maps)
    rows, images = [], {}
    for label, (method, given) in methods.items():
        ready = prepare(scene.camera, scene.mesh, method, **given)
        hits = ready.frame()
        images[label] = shade(hits, scene, "light", maps)
        row: dict[str, Any] = {"method": label, "overdraw": None}
        row["overdraw"] = hits.stats.overdraw if method == "invert" else None
        row["wrong_percent"] = 100 * mismatch(hits, true_hits) / (width * height)
        row["flip"] = float(flip_map(images[label], true_image).mean())
        steps.done(label)
        rows.append(row | _times(scene, method, given, count, lambda _, label=label: steps.done(label)))
    pictures = _pictures(scene, images, true_image, maps, quick)
    steps.done("pictures")
    report = Report(
        name="yu2009-fig1",
        title="A strip along a city street",
        subject=f"Yu et al. 2009, Fig. 1 · {scene.mesh.triangle_count:,} triangles, {width} × {height} pixels",
        reading=_reading(rows),
        parts=(pictures, _table(rows), _plot(rows)),
        scene={
            "paper": paper.PAPER,
            "city": f"a street of houses, towers behind, trees and cars: {scene.mesh.triangle_count:,} triangles",
            "camera": "cross-slit: one slit along the street, one upright and far behind it",
        },
        machine=machine(),
        measured=measured(
            count,
            pairs="each method runs with Mitsuba alone, in turn, so that drifts of the machine fall on both alike",
            moving="all vertices new, everything rebuilt that depends on them, then first hits of all pixels",
            still="first hits when all building is done",
            aimed="the camera elsewhere along the street, then first hits; nothing of the scene is made again",
            ratio="median time of the method / median time of Mitsuba in the same rounds",
            raytrace="Mitsuba with Embree: a tree over the triangles, rebuilt for moving frames, and the same rays",
            wrong=WRONG,
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _times(
    scene: Scene, method: str, given: dict[str, Any], count: int, on_call: Callable[[str], None]
) -> dict[str, Any]:
    """Moving, still and aimed frames of a method and of Mitsuba, pair by pair."""
    mesh, camera = scene.mesh, scene.camera
    positions, found = moving_vertices(mesh), {}
    for kind in KINDS:
        calls: dict[str, Callable[[], object]] = {}
        for name, one, more in (("ours", method, given), ("trace", "raytrace", {})):
            ready = prepare(camera, mesh, one, **more)
            if kind == "moving":
                calls[name] = moving_frame(ready, positions)
            else:
                calls[name] = ready.frame if kind == "still" else travelling(ready, camera.width, camera.height)
        times = timing.measure(calls, count, WARMUP, on_call=on_call)
        ours, trace = times["ours"], times["trace"]
        found |= {f"{kind}_ms": 1e3 * ours.median, f"{kind}_trace_ms": 1e3 * trace.median}
        found |= {f"{kind}_ratio": ours.median / trace.median, f"{kind}_spread": 1e3 * ours.spread}
    return found | {"moving_fps": 1e3 / found["moving_ms"]}


def travelling(ready: Any, width: int, height: int) -> Callable[[], object]:
    """A frame that starts with the camera at the next place along the street."""
    cameras, count = [strip_camera(x, width, height) for x in PLACES], 0

    def frame() -> object:
        nonlocal count
        count += 1
        ready.aim(cameras[count % len(cameras)])
        return ready.frame()

    return frame


def _pictures(scene: Scene, images: dict[str, np.ndarray], truth: np.ndarray, maps: Any, quick: bool) -> Gallery:
    """The strip by each method, the camera elsewhere, and what a pinhole sees."""
    width, height = scene.camera.width, scene.camera.height
    shown = [
        Picture("strip", "Cross-slit, invert", images["invert"]),
        Picture("strip-truth", "Cross-slit, Mitsuba", truth),
    ]
    names = {"two_pass, patch 5": "strip-patch-5", "vertex": "strip-vertex"}
    shown += [Picture(name, f"Cross-slit, {label}", images[label]) for label, name in names.items() if label in images]
    ready = prepare(scene.camera, scene.mesh)
    for x in () if quick else (PLACES[0], PLACES[-1]):
        ready.aim(strip_camera(x, width, height))
        side = "left" if x > 0 else "right"
        shown.append(
            Picture(
                f"strip-{side}", f"The camera {abs(x):g} m to the {side}", shade(ready.frame(), scene, "light", maps)
            )
        )
    eye = look_at((0.0, PATH, HEIGHT), (0.0, 0.0, 11.6), (0.0, 0.0, 1.0))
    pinhole = Pinhole.from_fov(width, height, np.radians(118.0), camera_from_world=eye)
    image = shade(rasterize(pinhole, scene.mesh), scene, "light", maps)
    shown.append(Picture("pinhole", "A pinhole in the middle of the same path", image))
    return Gallery("The strip", tuple(shown))


def _table(rows: Rows) -> Table:
    columns = [Column("method", "Method")]
    for kind in KINDS:
        group = kind.capitalize()
        columns += [
            Column(f"{kind}_ms", "Ours", "ms", "Median.", group),
            Column(f"{kind}_spread", "Spread", "ms", "Middle half of the rounds.", group, brief=False),
            Column(f"{kind}_trace_ms", "Mitsuba", "ms", "Median in the same rounds.", group),
            Column(f"{kind}_ratio", "Ratio", "", "Ours / Mitsuba; below 1 the method wins.", group),
        ]
    columns += [
        Column("moving_fps", "Frames", "1/s", "Moving.", brief=False),
        Column("wrong_percent", "Wrong", "%", "Share of the pixels that differ from first hits in Mitsuba."),
        Column("flip", "FLIP", "", "Mean, of the shaded picture; 0 is Mitsuba's.", brief=False),
        Column("overdraw", "Overdraw", "", "Pixels tested for each one rendered.", brief=False),
    ]
    note = f"The paper draws its city by two passes at {paper.FIG_1_FPS:g} frames per second. {paper.CARD}"
    return Table("strip", "Frames", tuple(columns), tuple(rows), note)


def _plot(rows: Rows) -> Plot:
    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        places = np.arange(len(rows))
        for number, kind in enumerate(KINDS):
            values = [row[f"{kind}_ratio"] for row in rows]
            bars = axes.bar(places + 0.27 * (number - 1), values, 0.25, color=theme.palette[number], label=kind)
            axes.bar_label(bars, fmt="%.2g", fontsize=8, color=theme.ink)
        axes.axhline(1, color=theme.ink, linewidth=1)
        axes.axhline(0.5, color=theme.soft, linewidth=1, linestyle="--")
        axes.set_xticks(places, [row["method"].replace(", ", "\n") for row in rows])
        axes.set_ylabel("time / Mitsuba's")
        axes.grid(axis="y")
        figure.legend(loc="outside upper right", ncols=3)

    caption = (
        "Time of a frame over Mitsuba's in the same rounds; below 1 a method wins. Dashed: half of Mitsuba's time."
    )
    return Plot("ratios", caption, "Bars of the ratio by method, for moving, still and aimed frames", draw, height=3.8)


def _reading(rows: Rows) -> str:
    """The finding, from the figures themselves."""
    ours, others = rows[0], rows[1:]
    met = "met" if ours["moving_ratio"] <= 0.5 else "missed"
    rest = "; ".join(
        f"{row['method']}: {row['moving_ms']:.3g} ms, {row['moving_ratio']:.2g} of Mitsuba's, "
        f"{row['wrong_percent']:.2g} % wrong"
        for row in others
    )
    frames = f"{ours['moving_fps']:.3g} frames per second; the paper {paper.FIG_1_FPS:g}"
    return (
        f"With all vertices moving, invert takes {ours['moving_ms']:.3g} ms ({frames}) against "
        f"{ours['moving_trace_ms']:.3g} ms for rebuilding a tree and tracing: {ours['moving_ratio']:.2f} of the time, "
        f"where at most 0.5 was wanted, which is {met}. {rest}. Of a still frame invert takes "
        f"{ours['still_ratio']:.2f} of Mitsuba's time, whose tree is then there, and where the camera travels "
        "along the still street, "
        f"{ours['aimed_ratio']:.2f}. Pixels of invert: {wrong_pixels(ours['wrong_percent'])} {paper.CARD} "
        f"{paper.STAND_IN}"
    )
