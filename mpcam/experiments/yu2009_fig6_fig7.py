"""Yu et al. 2009, Figs. 6 and 7: a cow and a teapot from all sides, by number of pieces, and a top view."""

from collections.abc import Callable
from typing import Any

from mpcam.cameras.general_linears import GeneralLinears
from mpcam.comparison import timing
from mpcam.comparison.motion import moving_frame, moving_vertices
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.experiments import yu2009_paper as paper
from mpcam.experiments import yu2009_views as views
from mpcam.experiments.common import WARMUP, WRONG, machine, measured, rounds
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.experiments.yu2009_measures import errors, seam
from mpcam.experiments.yu2009_scenes import cow_scene, teapot_scene
from mpcam.rendering.methods import prepare, rasterize
from mpcam.rendering.shade import shade
from mpcam.scene.scene import Scene

PIECES = (8, 16, 36, 72)
SHOWN = 36
PATCH = 10
ROUNDS = 9
METHODS: dict[str, dict[str, Any]] = {"invert": {}, "two_pass": {"patch": PATCH}, "raytrace": {}}
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    size = (120, 90) if quick else paper.SIZE
    count = rounds(repeats, quick, ROUNDS)
    scenes = {"cow": cow_scene(), "teapot": teapot_scene(16 if quick else 76)}
    pieces = {"cow": (3,), "teapot": (3, 6)} if quick else dict.fromkeys(_PANORAMAS, PIECES)
    shown = 3 if quick else SHOWN
    cameras = {(name, n): make(*size, n) for name, make in _PANORAMAS.items() for n in pieces[name]}
    cameras["teapot from above", 0] = views.teapot_top(*size, 4 if quick else 18)
    per_case = 2 * len(METHODS) * (1 + WARMUP + count)
    steps = StepCounter(progress, len(cameras) * (1 + per_case) + 1)
    rows, pictures = [], []
    for (name, number), camera in cameras.items():
        scene = scenes[name.split()[0]]
        row, image = _row(name, camera, scene, count, steps)
        rows.append(row)
        if number in (0, shown):
            title = f"{name}, {camera.count} pieces"
            pictures.append(Picture(title.replace(", ", "-").replace(" ", "-"), title, image))
    for name, eye in (("cow", views.cow_eye(*size)), ("teapot", views.teapot_eye(*size))):
        image = shade(rasterize(eye, scenes[name]), scenes[name], "light")
        pictures.append(Picture(f"{name}-pinhole", f"{name}, a pinhole", image))
    report = Report(
        name="yu2009-fig6-fig7",
        title="Things from all sides",
        subject="Yu et al. 2009, Figs. 6 and 7 · panoramas of piecewise cross-slit cameras",
        reading=_reading(rows),
        parts=(_table(rows), _plot(rows), Gallery("The views", tuple(pictures)), _seam_table(rows)),
        scene={
            "paper": paper.PAPER,
            "cow": f"{scenes['cow'].mesh.triangle_count:,} triangles, from all around: 360 degrees",
            "teapot": f"{scenes['teapot'].mesh.triangle_count:,} triangles, from 270 degrees, and from above by a grid "
            "of rays, straight down in the middle and the farther out the more from outside",
            "pixels": f"{size[0]} × {size[1]}",
        },
        machine=machine(),
        measured=measured(
            count,
            still="first hits of a frame when all building is done",
            moving="new vertices, everything rebuilt that depends on them, then the frame",
            two_passes=f"{PATCH} × {PATCH} samples a triangle",
            wrong=WRONG,
            seams="rays 1e-9 pixels left and right of all borders between columns, at 33 heights",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


_PANORAMAS: dict[str, Callable[[int, int, int], GeneralLinears]] = {
    "cow": views.cow_around,
    "teapot": views.teapot_around,
}


def _row(name: str, camera: GeneralLinears, scene: Scene, count: int, steps: StepCounter) -> tuple[dict[str, Any], Any]:
    """Errors, seams and times of a view, and its picture by inverting."""
    mesh, what = scene.mesh, f"{name}, {camera.count}"
    still = {method: prepare(camera, mesh, method, **settings) for method, settings in METHODS.items()}
    hits = {method: prepared.frame() for method, prepared in still.items()}
    jump = seam(camera)
    row: dict[str, Any] = {"view": name, "pieces": camera.count, "seam_degrees": jump["degrees"]}
    row |= {"seam_units": jump["units"], "triangles": mesh.triangle_count}
    for method in ("invert", "two_pass"):
        row |= {f"{method}_{key}": value for key, value in errors(hits[method], hits["raytrace"]).items()}
    image = shade(hits["invert"], scene, "light")
    steps.done(what)
    positions = moving_vertices(mesh)
    calls: dict[str, Callable[[], object]] = {f"{method}_still": one.frame for method, one in still.items()}
    for method, settings in METHODS.items():
        calls[f"{method}_moving"] = moving_frame(prepare(camera, mesh, method, **settings), positions)
    times = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done(what))
    row |= {f"{label}_ms": 1e3 * time.median for label, time in times.items()}
    for method in ("invert", "two_pass"):
        row[f"{method}_ratio"] = row[f"{method}_moving_ms"] / row["raytrace_moving_ms"]
    row["fps"] = 1e3 / row["two_pass_moving_ms"]
    row["paper_fps"] = paper.FPS[name.split()[0]]
    return row, image


def _table(rows: Rows) -> Table:
    columns = [Column("view", "View"), Column("pieces", "Pieces")]
    for method, title in (("invert", "Invert"), ("two_pass", "Two passes")):
        help = "Share of the pixels that differ from first hits in Mitsuba."
        columns.append(Column(f"{method}_wrong_percent", "Wrong", "%", help, title))
        columns.append(Column(f"{method}_still_ms", "Still", "ms", "Median.", title))
        columns.append(Column(f"{method}_moving_ms", "Moving", "ms", "Median.", title))
        columns.append(Column(f"{method}_ratio", "Ratio", "", "Moving / moving in Mitsuba.", title))
    columns.append(
        Column("two_pass_holes", "Holes", "px", "Uncovered pixels inside outlines.", "Two passes", brief=False)
    )
    columns.append(Column("raytrace_still_ms", "Still", "ms", "Median.", "Mitsuba"))
    columns.append(Column("raytrace_moving_ms", "Moving", "ms", "Median, tree rebuilt.", "Mitsuba"))
    columns.append(Column("fps", "Ours", "1/s", "By two passes, moving.", "Frames", brief=False))
    columns.append(Column("paper_fps", "Paper", "1/s", "", "Frames", paper=True))
    return Table("views", "Error and time by number of pieces", tuple(columns), tuple(rows), paper.CARD)


def _seam_table(rows: Rows) -> Table:
    columns = (
        Column("view", "View"),
        Column("pieces", "Pieces"),
        Column("seam_degrees", "Directions", "°", "Largest angle between rays on both sides of a border.", "Seam"),
        Column("seam_units", "Origins", "m", "Largest distance of the ray on the right from that on the left.", "Seam"),
    )
    note = "Rays 1e-9 pixels left and right of each border; what is left is the way of the rays over that distance."
    return Table("seams", "Seams between columns", columns, tuple(rows), note)


def _plot(rows: Rows) -> Plot:
    styles = {"invert": "-", "two_pass": "--", "raytrace": ":"}
    names = {"invert": "invert", "two_pass": "two passes", "raytrace": "Mitsuba"}

    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        for number, view in enumerate(_PANORAMAS):
            kept = [row for row in rows if row["view"] == view]
            for method, style in styles.items():
                at = [[row[key] for row in kept] for key in ("pieces", f"{method}_moving_ms")]
                look = {"color": theme.palette[number], "linestyle": style, "marker": "o", "ms": 4.5}
                axes.plot(*at, label=f"{view}, {names[method]}", **look)
        axes.set_ylim(bottom=0)
        axes.set_xlabel("pieces")
        axes.set_ylabel("moving frame (ms)")
        axes.grid()
        figure.legend(loc="outside lower center", ncols=3)

    caption = "Time of a moving frame of the panoramas against the number of cross-slit cameras in them."
    return Plot("pieces", caption, "Curves of time against pieces, by view and method", draw)


def _reading(rows: Rows) -> str:
    wrong = {method: max(row[f"{method}_wrong_percent"] for row in rows) for method in ("invert", "two_pass")}
    panoramas = [row for row in rows if row["view"] in _PANORAMAS]
    seams = max(row["seam_degrees"] for row in rows)

    def span(name: str) -> str:
        values = [row[name] for row in panoramas]
        return f"{min(values):.2g} to {max(values):.2g}"

    top = rows[-1]
    holes = sum(row["two_pass_holes"] for row in rows)
    kept = {view: [row["two_pass_moving_ms"] for row in rows if row["view"] == view] for view in _PANORAMAS}
    grown = [f"{times[-1] / times[0]:.2g} ({view})" for view, times in kept.items()]
    return (
        f"Head and tail, spout and handle are seen in one picture. At borders of pieces rays turn by at most "
        f"{seams:.1g} degrees, so no seam is to be seen. Inverting differs from ray tracing in at most "
        f"{wrong['invert']:.2g} % of the pixels, two passes in at most {wrong['two_pass']:.2g} %, with "
        f"{holes or 'no'} uncovered pixels inside outlines. A moving panorama takes {span('invert_ratio')} of "
        f"rebuilding a tree and tracing by inverting, and {span('two_pass_ratio')} by two passes. From the fewest to "
        f"the most pieces two passes take {' and '.join(grown)} times as long. The view from above has "
        f"{top['pieces']} pieces; there inverting takes {top['invert_ratio']:.2g}, two passes "
        f"{top['two_pass_ratio']:.2g}. {paper.STAND_IN} {paper.CARD}"
    )
