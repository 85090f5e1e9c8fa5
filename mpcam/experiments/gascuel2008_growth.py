"""How time and memory grow with the triangles and with the pixels, for rasterizing and for ray tracing."""

from collections.abc import Callable
from typing import Any

from mpcam.comparison import timing
from mpcam.comparison.motion import moving_frame, moving_vertices
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.experiments.common import CARD, PAPER, STAND_IN, WARMUP, machine, measured, rounds
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.gascuel2008_paper import GROWTH
from mpcam.experiments.moving_scene import METHODS, wavy_sphere
from mpcam.experiments.peak_memory import peak_megabytes
from mpcam.experiments.results import Column, Plot, Report, Table, as_number
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import shade_device
from mpcam.scene.builtin import builtin_scene

TRIANGLES = (80, 320, 1280, 5120, 20480, 81920, 327680, 1310720)
SIDES = (128, 256, 512, 1024, 2048, 4096)
FIXED_TRIANGLES, FIXED_SIDE, ROUNDS = 20480, 512, 7
PAPER_SCENES = (("facade", 600), ("facade", 2800), ("facade", 4900), ("patio", 560_000))
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count = rounds(repeats, quick, ROUNDS)
    triangles, sides = (TRIANGLES[:3:2], (32, 64)) if quick else (TRIANGLES, SIDES)
    fixed_triangles, fixed_side = (80, 32) if quick else (FIXED_TRIANGLES, FIXED_SIDE)
    scenes = PAPER_SCENES[:2] if quick else PAPER_SCENES
    each = len(METHODS) * (1 + 2 * (1 + WARMUP + count))
    steps = StepCounter(progress, (len(triangles) + len(sides)) * each + len(scenes) * (2 + WARMUP + count))

    known: dict[tuple[int, int], dict[str, Any]] = {}
    left_out: list[str] = []

    def point(triangles: int, side: int) -> dict[str, Any]:
        if (triangles, side) in known:
            steps.skip(each)
        else:
            known[triangles, side] = _measured(triangles, side, count, steps, left_out)
        return known[triangles, side]

    by_triangles = [point(number, fixed_side) for number in triangles]
    by_pixels = [point(fixed_triangles, side) for side in sides]
    ours = _paper_scenes(scenes, fixed_side, count, steps)
    return Report(
        name="gascuel2008-growth",
        title="Growth with triangles and pixels",
        subject="After Gascuel et al. 2008, section 5 · a closed surface around a paraboloid camera",
        reading=_reading(by_triangles, by_pixels),
        parts=(
            _plot("times", "Time of a frame", "ms", by_triangles, by_pixels),
            _table("triangles", f"By triangles, {fixed_side} × {fixed_side} pixels", by_triangles),
            _table("pixels", f"By pixels, {fixed_triangles:,} triangles", by_pixels),
            _plot("memory", "Peak memory of the process", "MB", by_triangles, by_pixels),
            _paper_table(ours),
        ),
        scene={
            "paper": PAPER,
            "scene": "a sphere around the camera whose radius varies between 0.8 and 1.2; every pixel sees it once",
        },
        machine=machine(),
        measured=measured(
            count,
            still="first hits of a frame when all building is done",
            moving="new vertices, everything rebuilt that depends on them, then the frame",
            methods="invert: this rasterizer. raytrace: Mitsuba with Embree, the same rays",
            peak_memory="largest resident memory of a process of its own, which loads the mesh, prepares and renders "
            "three still and three moving frames; Python, libraries and compiled kernels included",
        ),
        left_out=tuple(left_out),
        quick=quick,
    )


def _measured(triangles: int, side: int, count: int, steps: StepCounter, left_out: list[str]) -> dict[str, Any]:
    """Times and peak memory at one number of triangles and one size of image; what fails goes to `left_out`."""
    scene = wavy_sphere(triangles, side)
    positions = moving_vertices(scene.mesh)
    calls: dict[str, Callable[[], object]] = {}
    for method in METHODS:
        prepared = prepare(scene.camera, scene.mesh, method)
        calls[f"{method}_still"] = prepared.frame
        # An object of its own: the still one must not be rebuilt.
        calls[f"{method}_moving"] = moving_frame(prepare(scene.camera, scene.mesh, method), positions)
    what = f"{triangles:,} triangles, {side} pixels"
    times = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done(what))
    row: dict[str, Any] = {"triangles": triangles, "side": side, "megapixels": side * side / 1e6}
    row |= {f"{name}_ms": 1e3 * time.median for name, time in times.items()}
    for method in METHODS:
        try:
            row[f"{method}_mb"] = peak_megabytes(scene.mesh, method, side)
        except RuntimeError as error:  # times are worth keeping all the same
            left_out.append(f"memory of {method}, {what}: {str(error).rstrip('.')}")
        steps.done(f"{what}, memory")
    return row


def _paper_scenes(scenes: tuple[tuple[str, int], ...], side: int, count: int, steps: StepCounter) -> Rows:
    """Shaded frames at the paper's four numbers of triangles."""
    calls: dict[str, Callable[[], object]] = {}
    rows: Rows = []
    for name, triangles in scenes:
        scene = builtin_scene(name, side, side, triangles=triangles)
        prepared = prepare(scene.camera, scene.mesh)
        calls[f"{triangles}"] = lambda prepared=prepared, scene=scene: shade_device(prepared.frame(), scene, "light")
        paper = GROWTH[triangles]
        row: dict[str, Any] = {"scene": name, "triangles": scene.mesh.triangle_count, "total_paper_ms": paper}
        rows.append(row | {"paper_ratio": paper / GROWTH[2800]})
        steps.done(name)
    times = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done("the paper's sizes"))
    for row, time in zip(rows, times.values(), strict=True):
        row |= {"total_ms": 1e3 * time.median, "ratio": time.median / times["2800"].median}
    return rows


def _table(name: str, title: str, rows: Rows) -> Table:
    columns = [Column("triangles", "Triangles"), Column("side", "Side", "pixels")]
    for method in METHODS:
        columns.append(Column(f"{method}_still_ms", "Still", "ms", "Median.", method))
        columns.append(Column(f"{method}_moving_ms", "Moving", "ms", "Median.", method))
        columns.append(Column(f"{method}_mb", "Peak memory", "MB", "Of a process of its own.", method))
    columns = [columns[1], columns[0], *columns[2:]] if name == "pixels" else columns
    return Table(name, title, tuple(columns), tuple(rows))


def _paper_table(rows: Rows) -> Table:
    columns = (
        Column("triangles", "Triangles"),
        Column("scene", "Scene"),
        Column("total_ms", "Ours", "ms", "Shaded frame, bound tight.", "Whole frame"),
        Column("total_paper_ms", "Paper", "ms", "Table 3, bound quad, with shadows.", "Whole frame", paper=True),
        Column("ratio", "Ours", "×", "Against the facade of 2,800 triangles.", "To 2,800 triangles"),
        Column("paper_ratio", "Paper", "×", "Against the facade of 2,800 triangles.", "To 2,800 triangles", paper=True),
    )
    return Table("paper", "The paper's four sizes, paraboloid", columns, tuple(rows), f"{CARD} {STAND_IN}")


def _plot(name: str, title: str, unit: str, by_triangles: Rows, by_pixels: Rows) -> Plot:
    kinds = ("still", "moving") if unit == "ms" else ("",)

    def draw(figure: Any, theme: Any) -> None:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, rows, key, label in (
            (panels[0], by_triangles, "triangles", "triangles"),
            (panels[1], by_pixels, "megapixels", "megapixels"),
        ):
            for index, method in enumerate(METHODS):
                for kind in kinds:
                    column = "_".join(part for part in (method, kind, unit.lower()) if part)
                    style = "-" if kind != "still" else "--"
                    values = [as_number(row.get(column)) for row in rows]
                    line = {"color": theme.palette[index], "marker": "o" if index == 0 else "s", "linestyle": style}
                    axes.plot([as_number(row[key]) for row in rows], values, ms=4.5, label=f"{method} {kind}", **line)
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlabel(label)
            axes.grid()
        plain_ticks(panels[0].yaxis)
        plain_ticks(panels[1].xaxis)
        panels[0].set_ylabel(f"{title.lower()} ({unit})")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)

    caption = f"{title} by triangles (left) and by pixels (right), on scales of powers of ten."
    return Plot(name, caption, f"Curves of {title.lower()} against triangles and against pixels, by method", draw)


def _reading(by_triangles: Rows, by_pixels: Rows) -> str:
    def grows(rows: Rows, name: str) -> str:
        return f"{as_number(rows[-1][name]) / as_number(rows[0][name]):,.1f}"

    low, high = by_triangles[0], by_triangles[-1]
    return (
        f"From {low['triangles']:,} to {high['triangles']:,} triangles a moving frame takes "
        f"{grows(by_triangles, 'invert_moving_ms')} times as long by rasterizing and "
        f"{grows(by_triangles, 'raytrace_moving_ms')} times by rebuilding a tree and tracing; a still one "
        f"{grows(by_triangles, 'invert_still_ms')} and {grows(by_triangles, 'raytrace_still_ms')} times. From "
        f"{by_pixels[0]['side']} to {by_pixels[-1]['side']} pixels a side a still frame takes "
        f"{grows(by_pixels, 'invert_still_ms')} and {grows(by_pixels, 'raytrace_still_ms')} times as long. This is a "
        "surface without hidden parts: where much lies hidden, a tree saves more. Times hold for this machine; how "
        "they grow holds wider."
    )
