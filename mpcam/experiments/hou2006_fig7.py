"""Hou et al. 2006, Fig. 7: many objects that move around a shiny teapot, with and without each acceleration."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.comparison import timing
from mpcam.comparison.motion import moving_frame
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.decomposition.decompose import decompose
from mpcam.effects.reflection import Reflection
from mpcam.effects.shadows import shadow_maps
from mpcam.experiments import hou2006_paper as paper
from mpcam.experiments.common import WARMUP, WRONG, machine, measured, mismatch, rounds, wrong_pixels
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.hou2006_teapot import TeapotScene, teapot
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.rendering.methods import prepare

RESOLUTION = {100: 64, 256: 40, 512: 28}
"""Pixels along the short sides by the number of camera triangles: about 205,000 in all. The paper does not say."""
MANY = 20_000
BOUNDS = {"tight": 5, "triangle": 3}
"""Timed rounds by bound; without acceleration a frame of bounding triangles takes about a second."""
CULLING = {"none": (), "objects": ("objects",), "triangles": ("triangles",), "both": ("objects", "triangles")}
MOMENTS = 8
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    sizes = [(400, 100), (800, 100)] if quick else [*paper.FIG_7, *((MANY, number) for number in RESOLUTION)]
    number = {bound: rounds(repeats, quick, usual) for bound, usual in BOUNDS.items()}
    full = sum(1 + WARMUP + number[bound] for bound in BOUNDS)
    few = sum(size == MANY for size, _ in sizes)
    per_row = 1 + len(CULLING) * full + (1 + WARMUP + number["tight"])
    per_many = 1 + 2 * (1 + WARMUP + number["tight"])
    steps = StepCounter(progress, 1 + (len(sizes) - few) * per_row + few * per_many + 1)
    eye = TeapotScene(40).scene.camera
    shape = teapot(24 if quick else 96)
    cams = {
        count: decompose(shape, eye, count, resolution=RESOLUTION[count] // (4 if quick else 1))
        for count in dict.fromkeys(count for _, count in sizes)
    }
    steps.done("camera triangles")
    rows = [_row(triangles, cams[count], count, number, steps) for triangles, count in sizes]
    slopes = _slopes(rows)
    report = Report(
        name="hou2006-fig7",
        title="Many moving objects around a teapot",
        subject="Hou et al. 2006, Fig. 7 · frames with and without each acceleration",
        reading=_reading(rows, slopes),
        parts=(_speed_table(rows), _plot(rows), _gallery(cams, quick), _time_table(rows), _slope_table(slopes)),
        scene={
            "paper": paper.PAPER,
            "teapot": f"a mesh of {shape.triangle_count:,} triangles with normals, with spout, handle and knob",
            "objects": "20 triangles each; every one swings, turns and bobs at its own pace",
            "camera triangles": ", ".join(f"{n}: {one.count} of {one.resolution} pixels" for n, one in cams.items()),
        },
        machine=machine(),
        measured=measured(
            number["tight"],
            frame="new vertices, then first hits of all pixels of the atlas",
            bounds=f"of the bounding triangles {number['triangle']} timed rounds",
            acceleration="objects: clusters of triangles; triangles: each by itself; held against groups of pixels "
            "(tight) or camera triangles (triangle) before any pixel is tested",
            speed_up="time without any / time with both",
            raytrace="Mitsuba with Embree: the tree rebuilt, and the same rays",
            wrong=WRONG,
        ),
        left_out=() if quick else (f"bounding triangles and frames without acceleration at {MANY:,} triangles",),
        quick=quick,
    )
    steps.done("done")
    return report


def _row(
    triangles: int, cams: CameraTriangles, wanted: int, number: dict[str, int], steps: StepCounter
) -> dict[str, Any]:
    """One number of scene and of camera triangles: counts, then times."""
    whole = TeapotScene(triangles)
    mesh = whole.scene.mesh
    positions = [whole.vertices(0.1 * moment) for moment in range(MOMENTS)]
    what = f"{triangles:,} × {wanted}"
    hits = prepare(cams, mesh).frame()
    row: dict[str, Any] = {
        "scene_triangles": mesh.triangle_count,
        "camera_triangles": cams.count,
        "paper_camera_triangles": wanted,
        "tight_overdraw": hits.stats.overdraw,
        "wrong_percent": 100 * mismatch(hits, prepare(cams, mesh, "raytrace").frame()) / hits.triangle.size,
    }
    steps.done(what)

    def timed(calls: dict[str, Callable[[], object]], count: int) -> None:
        times = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done(what))
        row.update({f"{name}_ms": 1e3 * time.median for name, time in times.items()})

    for bound in BOUNDS if triangles != MANY else ("tight",):
        calls = {
            f"{bound}_{name}": moving_frame(prepare(cams, mesh, bound=bound, culling=culling), positions)
            for name, culling in CULLING.items()
            if triangles != MANY or name == "both"
        }
        if bound == "tight":
            calls["raytrace"] = moving_frame(prepare(cams, mesh, "raytrace"), positions)
        timed(calls, number[bound])
        if f"{bound}_none_ms" in row:
            row[f"{bound}_speedup"] = row[f"{bound}_none_ms"] / row[f"{bound}_both_ms"]
    row["ratio"] = row["tight_both_ms"] / row["raytrace_ms"]
    if (triangles, wanted) in paper.FIG_7:
        without, with_both = paper.FIG_7[triangles, wanted]
        row |= {"paper_none_fps": without, "paper_both_fps": with_both, "paper_speedup": with_both / without}
    return row


def _slopes(rows: Rows) -> Rows:
    """How times grow: slopes of log time against log camera x scene triangles, and against each of the two."""
    found = []
    kinds = {"tight, both": "tight_both_ms", "tight, none": "tight_none_ms"}
    kinds |= {"triangle, both": "triangle_both_ms", "triangle, none": "triangle_none_ms", "Mitsuba": "raytrace_ms"}
    kinds |= {"paper, both": "paper_both_fps", "paper, none": "paper_none_fps"}
    for name, key in kinds.items():
        row: dict[str, Any] = dict.fromkeys(("pairs", "scene", "camera", "all_pairs", "all_scene", "all_camera"))
        for start in ("", "all_"):
            kept = [r for r in rows if key in r and (start or r["scene_triangles"] != MANY)]
            if start and not any(r["scene_triangles"] == MANY for r in kept):
                continue
            scene, camera = (np.log([r[n] for r in kept]) for n in ("scene_triangles", "paper_camera_triangles"))
            times = np.log([1e3 / r[key] if key.endswith("fps") else r[key] for r in kept])
            if len(kept) > 1:
                row[f"{start}pairs"] = float(np.polyfit(scene + camera, times, 1)[0])
            if len(set(camera)) > 1:
                table = np.stack([scene, camera, np.ones_like(scene)], axis=1)
                by = np.linalg.lstsq(table, times, rcond=None)[0]
                row[f"{start}scene"], row[f"{start}camera"] = float(by[0]), float(by[1])
        found.append({"what": name} | row)
    return found


_FIRST = (
    Column("scene_triangles", "Scene triangles"),
    Column("camera_triangles", "Ours", "", "", "Camera triangles"),
    Column("paper_camera_triangles", "Paper", "", "", "Camera triangles", paper=True, brief=False),
)


def _speed_table(rows: Rows) -> Table:
    help = "Time without any acceleration / time with both."
    columns = (
        *_FIRST,
        Column("tight_speedup", "Tight", "×", help, "Speed-up"),
        Column("triangle_speedup", "Triangle", "×", help, "Speed-up"),
        Column("paper_speedup", "Paper", "×", help, "Speed-up", paper=True),
        Column("tight_both_ms", "Tight, both", "ms", "Median, moving frame.", "Frame"),
        Column("raytrace_ms", "Mitsuba", "ms", "Median, tree rebuilt and rays traced.", "Frame"),
        Column("ratio", "Ratio", "", "Tight, both / Mitsuba.", "Frame"),
        Column("tight_overdraw", "Overdraw", "", "Pixels tested for each one rendered, tight bound."),
        Column("wrong_percent", "Wrong", "%", "Share of the pixels that differ from first hits in Mitsuba."),
    )
    return Table("speedup", "What acceleration is worth", columns, tuple(rows), paper.CARD)


def _time_table(rows: Rows) -> Table:
    columns = [*_FIRST]
    for bound in BOUNDS:
        columns += [Column(f"{bound}_{name}_ms", name.capitalize(), "ms", "Median.", bound) for name in CULLING]
    for name, title in (("none", "None"), ("both", "Both")):
        columns.append(Column(f"paper_{name}_fps", title, "1/s", "", "Paper", paper=True, brief=False))
    return Table("times", "Moving frames by bound and acceleration", tuple(columns), tuple(rows), paper.CARD)


def _slope_table(slopes: Rows) -> Table:
    columns = [Column("what", "Frames")]
    for start, group in (("", "The paper's sizes"), ("all_", f"And {MANY:,} triangles")):
        columns.append(Column(f"{start}pairs", "Pairs", "", "Against camera × scene triangles.", group))
        columns.append(Column(f"{start}scene", "Scene", "", "Against scene triangles, in a fit of both.", group))
        columns.append(Column(f"{start}camera", "Camera", "", "Against camera triangles, in a fit of both.", group))
    note = "Slopes of times, all logarithmic: 1 is in proportion, 0 is no growth, below 0 more of them take less time."
    return Table("slopes", "Growth with camera × scene triangles", tuple(columns), tuple(slopes), note)


def _plot(rows: Rows) -> Plot:
    counts = list(dict.fromkeys(row["paper_camera_triangles"] for row in rows))

    def draw(figure: Any, theme: Any) -> None:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, bound in zip(panels, BOUNDS, strict=True):
            for number, count in enumerate(counts):
                for name, style in (("both", "-"), ("none", "--")):
                    kept = [r for r in rows if r["paper_camera_triangles"] == count and f"{bound}_{name}_ms" in r]
                    at = [[r[key] for r in kept] for key in ("scene_triangles", f"{bound}_{name}_ms")]
                    look = {"color": theme.palette[number], "linestyle": style, "marker": "o", "ms": 4.5}
                    axes.plot(*at, label=f"{count} camera triangles, {name}", **look)
            traced = sorted((r["scene_triangles"], r["raytrace_ms"]) for r in rows)
            axes.plot(*zip(*traced, strict=True), "s", color=theme.soft, ms=4, label="Mitsuba")
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_title(f"bound {bound}")
            axes.set_xlabel("scene triangles")
            axes.grid()
        panels[0].set_ylabel("moving frame (ms)")
        plain_ticks(panels[0].yaxis)
        for axes in panels:
            plain_ticks(axes.xaxis)
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)

    caption = "Time of a moving frame against scene triangles, with both accelerations and without any."
    return Plot("growth", caption, "Curves of time against scene triangles, by bound and acceleration", draw)


def _gallery(cams: dict[int, CameraTriangles], quick: bool) -> Gallery:
    """The teapot through camera triangles, and by rays of the true surface."""
    pictures = []
    sizes: Sequence[int] = (400,) if quick else (800, MANY)
    for triangles in sizes:
        whole = TeapotScene(triangles)
        scene = whole.scene
        maps = shadow_maps(scene, 256 if quick else 2048)
        chosen = cams if triangles == sizes[0] else {max(cams): cams[max(cams)]}
        for one in () if quick else chosen.values():
            image = Reflection(scene, cams=one, shadows=maps).image()
            title = f"{triangles:,} scene triangles, {one.count} camera triangles"
            pictures.append(Picture(f"teapot-{triangles}-{one.count}", title, image))
        true = Reflection(scene, method="raytrace", shadows=maps).image()
        pictures.append(
            Picture(f"teapot-{triangles}-truth", f"{triangles:,} scene triangles, rays of the true surface", true)
        )
    return Gallery("The scene", tuple(pictures))


def _reading(rows: Rows, slopes: Rows) -> str:
    """The finding, from the figures themselves."""
    kept = [row for row in rows if "tight_speedup" in row]

    def between(name: str) -> str:
        values = [row[name] for row in kept if name in row]
        return f"{min(values):.1f} to {max(values):.1f}" if values else "no figures"

    growth, won = slopes[0], sum(row["ratio"] < 1 for row in rows)
    grown = (
        f"With both and the tight bound the time grows with the power {growth['pairs']:.2f} of camera × scene triangles"
    )
    if growth["all_pairs"] is not None:
        grown += f" at the paper's sizes, and {growth['all_pairs']:.2f} up to {MANY:,} scene triangles"
    return (
        f"Leaving objects and triangles out early makes frames {between('tight_speedup')} times as fast with the tight "
        f"bound and {between('triangle_speedup')} times with bounding triangles (paper: {between('paper_speedup')}). "
        "Bounding triangles gain less where their pixels, which no culling takes away, cost more than the triangles. "
        f"{grown}: more camera triangles are smaller ones, which bound better. Rebuilding a tree and tracing the same "
        f"rays takes longer in {won} of {len(rows)} rows. {paper.CARD} {paper.STAND_IN} "
        f"{wrong_pixels(max(row['wrong_percent'] for row in rows))}"
    )
