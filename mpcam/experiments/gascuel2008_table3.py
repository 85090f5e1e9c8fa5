"""Gascuel et al. 2008, Table 3 and Fig. 7: how many pixels each bound tests, and what each step of a frame costs."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.change import projected, resized
from mpcam.comparison import timing
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.effects.shadows import ShadowMap, shadow_maps
from mpcam.experiments import gascuel2008_paper as paper
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
from mpcam.experiments.gascuel2008_table3_pages import gallery, overdraw_plot, overdraw_table, steps_plot, steps_table
from mpcam.experiments.results import Report
from mpcam.rendering.methods import prepare, rasterize
from mpcam.rendering.shade import shade_device
from mpcam.scene.builtin import builtin_scene
from mpcam.scene.scene import Scene

SIZE, TINY, ROUNDS = 512, 8, 9
PROJECTIONS = {
    "linear": "pinhole",
    "cosine sphere": "cosine_sphere",
    "paraboloid": "paraboloid",
    "fisheye 1": "equisolid",
    "fisheye 2": "equidistant",
}
"""The paper's projections by mpcam's names; the fisheye 1 is Lambert's projection too."""
ALL, FEW = ("triangle", "quad", "tight"), ("quad", "tight")
MODES = ("tiny", "hits", "color", "texture", "light", "shadows", "map")
SHADOW_SIZE = 1024


@dataclass(frozen=True)
class Choice:
    """A row to be: scene, triangles, the paper's projection, and bound ("" for the linear view)."""

    scene: str
    triangles: int
    projection: str
    bound: str = ""


def plan(quick: bool) -> list[Choice]:
    """The rows; a linear view goes before each scene's others, which are compared with it."""
    scenes = [("facade", 2800, tuple(PROJECTIONS)[1:], ALL), ("facade", 600, ("paraboloid",), FEW)]
    scenes += [("facade", 4900, ("paraboloid",), FEW), ("temple", 4000, ("paraboloid",), FEW)]
    scenes += [("patio", 560_000, ("paraboloid",), FEW), ("characters", 177_000, ("paraboloid",), ALL)]
    if quick:
        scenes = [("facade", 2800, ("paraboloid",), ALL)]
    chosen = []
    for scene, triangles, projections, bounds in scenes:
        chosen.append(Choice(scene, triangles, "linear"))
        known, _ = known_bounds(bounds)
        chosen += [Choice(scene, triangles, name, bound) for name in projections for bound in known]
    return chosen


class PreparedRow:
    """A row made ready: what it renders with, and what is counted. maps: the shadow maps of the scene's lights."""

    def __init__(self, choice: Choice, scene: Scene, size: int, maps: tuple[ShadowMap, ...]):
        self.choice, self.scene, self.maps = choice, scene, maps
        self.camera = projected(resized(scene.camera, size, size), PROJECTIONS[choice.projection])
        bound = choice.bound or "tight"
        self.prepared = prepare(self.camera, scene.mesh, bound=bound)
        self.tiny = prepare(resized(self.camera, TINY, TINY), scene.mesh, bound=bound)

    def calls(self) -> dict[str, Callable[[], object]]:
        """The frame by what is done of it, from hardly any pixels to everything, and the shadow maps by themselves."""
        calls: dict[str, Callable[[], object]] = {"tiny": self.tiny.frame, "hits": self.prepared.frame}
        for shading in ("color", "texture", "light"):
            calls[shading] = lambda shading=shading: shade_device(self.prepared.frame(), self.scene, shading)
        calls["shadows"] = lambda: shade_device(self.prepared.frame(), self.scene, "light", self.maps)
        views = [prepare(c, self.scene.mesh, output="depth") for one in self.maps for c in one.cameras]
        calls["map"] = lambda: [view.frame() for view in views]
        return calls

    def row(self, truth: Any) -> dict[str, Any]:
        """What needs no clock."""
        hits = self.prepared.frame()
        choice, stats = self.choice, hits.stats
        row: dict[str, Any] = {
            "view": f"{choice.projection} {choice.bound}".strip(),
            "scene": choice.scene,
            "triangles": self.scene.mesh.triangle_count,
            "covered_k": stats.tests / 1e3,
            "rendered_k": stats.rendered / 1e3,
            "overdraw_percent": 100 * (stats.overdraw - 1),
            "wrong_percent": 100 * mismatch(hits, truth) / hits.triangle.size,
        }
        theirs = paper.TABLE_3.get((choice.scene, choice.triangles, choice.projection, choice.bound))
        if theirs is not None:
            numbers = theirs._asdict()
            row |= {"covered_paper_k": numbers.pop("covered"), "rendered_paper_k": numbers.pop("rendered")}
            row |= {f"{name}_paper_percent": numbers.pop(name) for name in ("overdraw", "ratio")}
            row |= {f"{name}_paper_ms": value for name, value in numbers.items()}
        return row


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    size, count = (256 if quick else SIZE), rounds(repeats, quick, ROUNDS)
    choices = plan(quick)
    steps = StepCounter(progress, len(choices) * (1 + len(MODES) * (1 + WARMUP + count)) + 1)

    scenes: dict[tuple[str, int], Scene] = {}
    maps: dict[tuple[str, int], tuple[ShadowMap, ...]] = {}
    truths: dict[Any, Any] = {}
    cases: list[PreparedRow] = []
    rows: list[dict[str, Any]] = []
    for choice in choices:
        key = (choice.scene, choice.triangles)
        if key not in scenes:
            scenes[key] = builtin_scene(choice.scene, size, size, triangles=choice.triangles)
            maps[key] = shadow_maps(scenes[key], SHADOW_SIZE)
        case = PreparedRow(choice, scenes[key], size, maps[key])
        view = (*key, choice.projection)
        if view not in truths:
            truths[view] = rasterize(case.camera, scenes[key].mesh, "raytrace")
        cases.append(case)
        rows.append(case.row(truths[view]))
        steps.done(f"{choice.scene} {choice.projection} {choice.bound}")

    calls = {(i, mode): call for i, case in enumerate(cases) for mode, call in case.calls().items()}
    times = timing.measure(
        {f"{i} {mode}": call for (i, mode), call in calls.items()},
        count,
        WARMUP,
        stages={f"{i} hits": case.prepared.stages for i, case in enumerate(cases)},
        on_call=lambda label: steps.done(f"{label.split()[1]}, {cases[int(label.split()[0])].choice.scene}"),
    )
    linear = float("nan")
    for i, (case, row) in enumerate(zip(cases, rows, strict=True)):
        row |= costs({mode: times[f"{i} {mode}"] for mode in MODES})
        if case.choice.projection == "linear":
            linear = row["total_ms"]
        row["ratio_percent"] = 100 * row["total_ms"] / linear
    report = Report(
        name="gascuel2008-table3",
        title="Overdraw, and the cost of each step",
        subject=f"Gascuel et al. 2008, Table 3 and Figs. 7 and 8 · {size} × {size} pixels",
        reading=_reading(rows),
        parts=(
            overdraw_table(rows),
            overdraw_plot(rows),
            steps_table(rows),
            steps_plot(rows),
            gallery(scenes),
        ),
        scene={
            "paper": PAPER,
            "scenes": ", ".join(f"{name} {scene.mesh.triangle_count:,}" for (name, _), scene in scenes.items()),
            "light": f"one sun with a shadow map of {SHADOW_SIZE} texels along a side, ambient light, textures",
            "fisheyes": "1 is the equisolid projection (Lambert's too), 2 the equidistant one",
            "linear": "a pinhole of 90 degrees with the same pixels, drawn by the same rasterizer",
        },
        machine=machine(),
        measured=measured(
            count,
            steps="each cost is the difference of two runs, one of which leaves the step out, as in the paper; so "
            "small ones may come out below 0",
            vertex="bringing the vertices to the camera frame, as the rasterizer reports it",
            geometry=f"a frame of {TINY} x {TINY} pixels, less the vertices: all work that goes by the triangle",
            raycasting="first hits of the whole image, less that frame: all work that goes by the pixel",
            interpolation="weights of the corners and plain colors, less the first hits; the paper has no such column",
            texturing_and_lighting="shading by texture less plain colors, by light less texture",
            shadow="shading with shadows less without, and a new depth map from the light",
            covered="tests of a pixel against a triangle",
            rendered=RENDERED,
            overdraw="covered / rendered - 1",
            ratio="to the total of the linear view of the same scene",
            wrong=WRONG,
        ),
        left_out=known_bounds(ALL)[1],
        quick=quick,
    )
    steps.done("done")
    return report


def costs(times: dict[str, Any]) -> dict[str, Any]:
    """Milliseconds of each step from the medians of the runs, and their sum, the whole frame."""
    median = {mode: 1e3 * time.median for mode, time in times.items()}
    vertex = 1e3 * times["hits"].stages.get("vertices", float("nan"))
    return {
        "vertex_ms": vertex,
        "geometry_ms": median["tiny"] - np.nan_to_num(vertex),
        "raycasting_ms": median["hits"] - median["tiny"],
        "interpolation_ms": median["color"] - median["hits"],
        "texturing_ms": median["texture"] - median["color"],
        "lighting_ms": median["light"] - median["texture"],
        "shadow_ms": median["shadows"] - median["light"] + median["map"],
        "total_ms": median["shadows"] + median["map"],
    }


def _reading(rows: list[dict[str, Any]]) -> str:
    """The finding, from the figures themselves."""
    first = {row["view"]: row for row in reversed(rows)}
    parts = []
    for projection, name in (("paraboloid", "the paraboloid"), ("fisheye 1", "the first fisheye")):
        if f"{projection} quad" in first:
            quad, tight = first[f"{projection} quad"], first[f"{projection} tight"]
            parts.append(
                f"{quad['overdraw_percent']:,.0f} % for {name} (paper: {quad['overdraw_paper_percent']:,.0f} %), the "
                f"tight bound {tight['overdraw_percent']:,.0f} %"
            )
    wrong = max(row["wrong_percent"] for row in rows)
    return (
        f"Overdraw counts work and compares directly: on facade the box of the quads has {'; '.join(parts)}. It "
        f"depends on the scene as well as on the bound. {CARD} {STAND_IN} {wrong_pixels(wrong)}"
    )
