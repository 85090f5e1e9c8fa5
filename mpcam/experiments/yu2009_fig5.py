"""Yu et al. 2009, Fig. 5: a cross-slit camera over solids, by two passes of several patches and by ray tracing."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras.general_linear import GeneralLinear
from mpcam.comparison import timing
from mpcam.comparison.metrics import display
from mpcam.comparison.motion import moving_frame, moving_vertices
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.experiments import yu2009_paper as paper
from mpcam.experiments.common import WARMUP, WRONG, machine, measured, rounds
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.experiments.yu2009_measures import errors
from mpcam.experiments.yu2009_scenes import BOX, CYLINDER, SPHERE, solids_scene
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import shade

LEVELS = (0, 1, 2, 3)
ROUNDS = 15
Rows = list[dict[str, Any]]


def cross_slit(width: int, height: int) -> GeneralLinear:
    """Two slits at right angles to each other, at 45 degrees to the horizon, 12 apart, looking down at the ground."""
    pitch = np.radians(38.0)
    across, ahead = np.array([1.0, 0, 0]), np.array([0, np.cos(pitch), -np.sin(pitch)])
    up = np.cross(across, ahead)
    place = np.array([0.0, -11.0, 8.0])
    first = (place + 6 * ahead, across + up)
    second = (place - 6 * ahead, across - up)
    return GeneralLinear.cross_slit(width, height, first, second, place + 13.6 * ahead, 13.4)


def cases() -> dict[str, tuple[str, dict[str, Any]]]:
    """Method and settings by label; ray tracing, the truth, comes first."""
    found: dict[str, tuple[str, dict[str, Any]]] = {"Mitsuba": ("raytrace", {})}
    found |= {f"two passes, {n} × {n}": ("two_pass", {"patch": n}) for n in paper.PATCHES}
    found |= {"invert": ("invert", {})}
    return found | {f"vertices, level {n}": ("vertex", {"level": n}) for n in LEVELS}


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    width, height = (160, 120) if quick else paper.SIZE
    count = rounds(repeats, quick, ROUNDS)
    scene, camera, known = solids_scene(), cross_slit(width, height), cases()
    mesh = scene.mesh
    steps = StepCounter(progress, len(known) + 2 * len(known) * (1 + WARMUP + count) + 1)
    rows, pictures = [], []
    seen: list[tuple[Any, np.ndarray]] = []  # by ray tracing
    calls: dict[str, Callable[[], object]] = {}
    moving = moving_vertices(mesh)
    for label, (method, settings) in known.items():
        still = prepare(camera, mesh, method, **settings)
        hits = still.frame()
        image = shade(hits, scene, "light")
        seen = seen or [(hits, image)]
        truth, true_image = seen[0]
        row = {"method": label, "family": method} | errors(hits, truth, image, true_image)
        rows.append(row | {"ground_percent": _on_ground(image, true_image, truth)})
        pictures.append(Picture(label.replace(" × ", "-").replace(", ", "-").replace(" ", "-").lower(), label, image))
        calls[f"still {label}"] = still.frame
        calls[f"moving {label}"] = moving_frame(prepare(camera, mesh, method, **settings), moving)
        steps.done(label)
    times = timing.measure(calls, count, WARMUP, on_call=steps.done)
    for row in rows:
        for kind in ("still", "moving"):
            row[f"{kind}_ms"] = 1e3 * times[f"{kind} {row['method']}"].median
            row[f"{kind}_ratio"] = times[f"{kind} {row['method']}"].median / times[f"{kind} Mitsuba"].median
    report = Report(
        name="yu2009-fig5",
        title="A cross-slit camera by two passes",
        subject="Yu et al. 2009, Fig. 5 · patches of 5, 10 and 20 samples against ray tracing",
        reading=_reading(rows),
        parts=(_table(rows), _plot(rows), Gallery("The view by each method", tuple(pictures))),
        scene={
            "paper": paper.PAPER,
            "solids": f"spheres of {SPHERE} triangles, cylinders of {CYLINDER}, boxes of {BOX}, on a ground of 2; "
            f"{mesh.triangle_count:,} in all",
            "camera": f"{width} × {height} pixels; slits at right angles to each other, 12 apart",
        },
        machine=machine(),
        measured=measured(
            count,
            still="first hits of a frame when all building is done",
            moving="new vertices, everything rebuilt that depends on them, then the frame",
            wrong=WRONG,
            holes="uncovered pixels in patches of such that hold no pixel where ray tracing hits nothing",
            rmse="of the lit picture against that of ray tracing, sRGB, white is 1",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _on_ground(image: np.ndarray, true_image: np.ndarray, truth: Any) -> float:
    """Share of the squared error of a picture on the ground, the scene's first two triangles; NaN without error."""
    square = np.square(display(image) - display(true_image)).sum(axis=-1)
    ground = (truth.triangle >= 0) & (truth.triangle < 2)
    return 100 * float(square[ground].sum() / square.sum()) if square.any() else float("nan")


def _table(rows: Rows) -> Table:
    columns = (
        Column("method", "Method"),
        Column("wrong_percent", "Wrong", "%", "Share of the pixels that differ from first hits in Mitsuba."),
        Column("outline_percent", "Outline", "%", "Share of the pixels that hit or miss wrongly."),
        Column("holes", "Holes", "px", "Uncovered pixels inside closed outlines."),
        Column("depth_median", "Median", "", "Relative error of depth.", "Depth"),
        Column("depth_p999", "99.9 %", "", "Relative error of depth.", "Depth"),
        Column("rmse", "RMSE", "", "Of the picture, sRGB from 0 to 1."),
        Column("ground_percent", "On ground", "%", "Share of the squared error of the picture on the ground."),
        Column("still_ms", "Still", "ms", "Median.", "Frame"),
        Column("moving_ms", "Moving", "ms", "Median.", "Frame"),
        Column("still_ratio", "Still", "", "Time / time of Mitsuba.", "Ratio"),
        Column("moving_ratio", "Moving", "", "Time / time of Mitsuba, tree rebuilt.", "Ratio"),
    )
    return Table("methods", "Error and time by method", columns, tuple(rows), paper.CARD)


def _plot(rows: Rows) -> Plot:
    families = {"two_pass": "two passes", "vertex": "vertices", "invert": "invert", "raytrace": "Mitsuba"}

    def draw(figure: Any, theme: Any) -> None:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, kind in zip(panels, ("still", "moving"), strict=True):
            for number, (family, name) in enumerate(families.items()):
                kept = [row for row in rows if row["family"] == family]
                at = [[row[key] for row in kept] for key in (f"{kind}_ms", "rmse")]
                axes.plot(*at, "o-" if len(kept) > 1 else "s", color=theme.palette[number], ms=5, label=name)
                aside = (4, 4) if family == "two_pass" else (-10, -10)
                for row in kept if len(kept) > 1 else ():
                    text = row["method"].split()[-1]
                    place = (row[f"{kind}_ms"], row["rmse"])
                    axes.annotate(text, place, aside, textcoords="offset points", color=theme.soft, fontsize=8)
            axes.set_yscale("symlog", linthresh=1e-3)
            axes.set_xlim(left=0)
            axes.set_ylim(-1e-4, 0.5)
            axes.set_title(kind)
            axes.set_xlabel("frame (ms)")
            axes.grid()
        panels[0].set_ylabel("RMSE of the picture")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4)

    caption = (
        "Error of the picture against time, logarithmic above 0.001; numbers beside marks are the samples along a side "
        "of a patch, or the level to which edges are split."
    )
    return Plot("error", caption, "Error against time of all methods, for still and for moving frames", draw)


def _reading(rows: Rows) -> str:
    patches = [row for row in rows if row["family"] == "two_pass"]
    vertices = [row for row in rows if row["family"] == "vertex"]
    (invert,) = (row for row in rows if row["family"] == "invert")
    holes = sum(row["holes"] for row in patches)
    falls = " to ".join(f"{row['rmse']:.2g}" for row in (patches[0], patches[-1]))
    wrong = " to ".join(f"{row['wrong_percent']:.2g}" for row in (patches[0], patches[-1]))
    split, level = paper.PATCHES[0] - 1, vertices[2]
    least, most = (f"{row['moving_ratio']:.2g}" for row in (patches[0], patches[-1]))
    ground, gained = min(row["ground_percent"] for row in patches), f"{invert['moving_ratio']:.2g}"
    return (
        f"With {paper.PATCHES[0]} to {paper.PATCHES[-1]} samples along a side of a triangle the picture's error falls "
        f"from {falls}, and wrong pixels from {wrong} %; at least {ground:.1f} % of the squared error is on the "
        "ground, where the paper sees it, too: its two triangles are the largest. "
        f"{'No' if holes == 0 else holes} pixels stay uncovered inside closed outlines. Inverting per pixel has "
        f"{invert['wrong_percent']:.2g} % wrong pixels and takes {gained} of the time of rebuilding a tree and "
        f"tracing; two passes take {least} to {most}. Projected vertices with edges split into {split} have an "
        f"error of {level['rmse']:.2g}, beside {patches[0]['rmse']:.2g} of a patch of {split + 1} samples: the same "
        f"small triangles. {paper.STAND_IN} {paper.CARD}"
    )
