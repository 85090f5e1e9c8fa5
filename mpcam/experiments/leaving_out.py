"""What each part of the rasterizer is worth: frames without it against frames with all of them.

The expected ratios stand in the table beside the measured ones; they were written down before the first run.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from mpcam.comparison import timing
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.inner_loop import measure_loop
from mpcam.experiments.moving_scene import wavy_sphere
from mpcam.experiments.results import Column, Report, Table
from mpcam.rendering.invert import Inverted
from mpcam.scene.builtin import builtin_scene
from mpcam.scene.scene import Scene

ROUNDS = 21
LESS = {"triangle numbers (depth alone)": "depth", "depths too (coverage alone)": "coverage"}
SPHERE, BUILT_IN, SIZE = 20480, ("facade", "patio"), 512
ALL = "all parts"
EXPECTED: dict[str, tuple[float, float, float]] = {
    "walk of small triangles": (1.5, 1.1, 3.0),
    "lists of blocks": (1.2, 10.0, 3.0),
    "lines of the outlines": (1.3, 1.1, 1.05),
    "edge tests of blocks and parts": (1.0, 1.1, 1.0),
    "projection kept per vertex": (1.2, 1.05, 1.6),
    "hidden triangles dropped first": (1.1, 1.0, 1.3),
    "frozen kernels": (10.0, 15.0, 4.0),
    "triangle numbers (depth alone)": (0.95, 0.95, 0.95),
    "depths too (coverage alone)": (0.85, 0.85, 0.9),
    "back faces (cull='back')": (0.6, 0.8, 0.8),
}
"""Time without / time with, on the three scenes."""

WHY = {
    "walk of small triangles": "a few pixels cost less than a list",
    "lists of blocks": "one lane would walk a street's ground",
    "lines of the outlines": "half of a box is outside the triangle",
    "edge tests of blocks and parts": "edges bend, and some have no lines",
    "projection kept per vertex": "six triangles share a vertex",
    "hidden triangles dropped first": "half of a room lies behind a view",
    "frozen kernels": "recording takes Python's time",
    "triangle numbers (depth alone)": "32 bits a pixel instead of 64",
    "depths too (coverage alone)": "no atomics; full blocks end early",
    "back faces (cull='back')": "half of a closed surface",
}


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count, size = rounds(repeats, quick, ROUNDS), 48 if quick else SIZE
    scenes = [wavy_sphere(80 if quick else SPHERE, size)]
    scenes += [builtin_scene(name, size, size) for name in (BUILT_IN[:1] if quick else BUILT_IN)]
    names = [ALL, *EXPECTED]
    steps = StepCounter(progress, len(scenes) * len(names) * (1 + WARMUP + count) + 1)
    times: dict[str, dict[str, float]] = {}
    for scene in scenes:
        calls = {name: _frame(scene, name) for name in names}
        found = timing.measure(
            calls, count, WARMUP, on_call=lambda name, scene=scene: steps.done(f"{scene.name}: {name}")
        )
        times[scene.name] = {name: time.median for name, time in found.items()}
    rows = []
    for name in EXPECTED:
        row: dict[str, Any] = {"part": name, "why": WHY[name]}
        for number, medians in enumerate(times.values()):
            row |= {f"expected_{number}": EXPECTED[name][number], f"ratio_{number}": medians[name] / medians[ALL]}
        rows.append(row)
    loop = measure_loop(8 if quick else 64, size, count)
    steps.done("inner loop")
    return Report(
        name="leaving-out",
        title="What each part is worth",
        subject=f"Frames of the rasterizer without one of its parts · {size} × {size} pixels, paraboloid",
        reading=_reading(rows, [scene.name for scene in scenes], loop),
        parts=(_table(tuple(rows), list(times)), _loop_table(loop)),
        scene={scene.name: f"{scene.mesh.triangle_count:,} triangles" for scene in scenes},
        machine=machine(),
        measured=measured(
            count,
            ratio="time without the part / time with all; above 1 the part pays",
            expected="written down before the first run",
            frame="vertices to the camera, triangles, lists, pixels; without decoding",
        ),
        quick=quick,
    )


def _frame(scene: Scene, without: str) -> Callable[[], object]:
    """A frame of a scene without a part."""
    import drjit as dr

    from mpcam.backend import types
    from mpcam.cameras.outline import without_lines
    from mpcam.rendering import outlines
    from mpcam.rendering.z_buffer import kernel_test
    from mpcam_kernels.pipeline import SMALL, Pipeline
    from mpcam_kernels.regions import PixelOutline

    def boxes(camera: Any, rows: list[list[Any]]) -> list[PixelOutline]:
        return [PixelOutline(*without_lines(outline)) for outline in outlines.tight(camera, rows)]  # pyright: ignore[reportArgumentType]

    def from_positions(camera: Any, rows: list[list[Any]]) -> list[PixelOutline]:
        views = [camera.local_vertex_view(row[0].xyz) for row in rows]
        four = type(rows[0][0])
        places = [four(*row[0].xyz, lens.place) for row, lens in zip(rows, views, strict=True)]
        more = [four(lens.s, lens.p, lens.q, 0) for lens in views]
        return outlines.tight(camera, [list(pair) for pair in zip(places, more, strict=True)])

    test = kernel_test("ray_triangle")
    all_blocks = SimpleNamespace(**{**vars(test), "may_hit": lambda *_: True})
    per_triangle, edges = without == "projection kept per vertex", without == "edge tests of blocks and parts"
    kernels = Pipeline(
        types(),
        boxes if without == "lines of the outlines" else from_positions if per_triangle else outlines.tight,
        outlines.hidden_never if per_triangle or without.startswith("hidden") else outlines.hidden_by_view,
        all_blocks if edges else test,
        (scene.camera.width, scene.camera.height),
        output={"triangle numbers (depth alone)": "depth", "depths too (coverage alone)": "coverage"}.get(
            without, "hits"
        ),
        cull="back" if without.startswith("back") else "none",
        small={"walk of small triangles": 0, "lists of blocks": 1 << 30}.get(without, SMALL),
    )
    if without == "frozen kernels":
        kernels.thaw()
    prepared = Inverted(scene.camera, scene.mesh, "quad" if per_triangle else "tight")

    def frame() -> None:
        rows = prepared.place(prepared.vertices)
        keys, _ = kernels.frame(prepared.device_camera.on_device, rows, prepared.faces, prepared.samples)
        dr.eval(keys)

    return frame


def _table(rows: tuple[dict[str, Any], ...], scenes: list[str]) -> Table:
    columns = [Column("part", "Left out")]
    for number, name in enumerate(scenes):
        columns.append(Column(f"expected_{number}", "Expected", "×", "Written down before the first run.", name))
        columns.append(Column(f"ratio_{number}", "Measured", "×", "Time without / time with all parts.", name))
    return Table("parts", "Time without a part", (*columns, Column("why", "Why it is there", brief=False)), rows)


def _loop_table(loop: dict[str, float]) -> Table:
    columns = (
        Column("loop_rate", "Loop over lists", "10⁹ tests/s", "Pixel pass of long lists."),
        Column(
            "unrolled_rate",
            "Unrolled",
            "10⁹ tests/s",
            "The same arithmetic on numbers in the code: no loop, no gathers.",
        ),
        Column("share", "Share", "", "Of the unrolled rate that the loop reaches."),
    )
    return Table("inner_loop", "The inner loop against the same arithmetic unrolled", columns, (loop,))


def _reading(rows: list[dict[str, Any]], scenes: list[str], loop: dict[str, float]) -> str:
    share = 100 * loop["share"]
    worth = [row["part"] for row in rows[:-3] if max(row[f"ratio_{k}"] for k in range(len(scenes))) > 1.05]
    return (
        f"Of {len(rows) - 3} parts of a frame, {len(worth)} pay by more than 5 % on one of the scenes at least. The "
        f"last three rows are what a scene may not need. The inner loop tests {share:.0f} % as many pixels "
        "a second as the same arithmetic without a loop or a gather, which is as fast as this machine does it."
    )
