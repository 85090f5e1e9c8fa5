"""Gascuel et al. 2008, Table 2: six faces of a cube against two paraboloids, five of a hemicube against one view."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.change import projected, resized
from mpcam.comparison import timing
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.experiments.common import (
    CARD,
    PAPER,
    STAND_IN,
    WARMUP,
    WRONG,
    machine,
    measured,
    mismatch,
    rounds,
    wrong_pixels,
)
from mpcam.experiments.gascuel2008_paper import TABLE_2
from mpcam.experiments.results import Column, Gallery, Picture, Plot, Report, Table
from mpcam.rendering.cubemap import face_cameras
from mpcam.rendering.methods import prepare, rasterize
from mpcam.rendering.shade import shade, shade_device
from mpcam.scene.builtin import builtin_scene
from mpcam.scene.scene import Scene

TRIANGLES, SIZES, ROUNDS = 1900, (512, 16), 21
OUTPUTS = ("color", "depth", "coverage")
CUBE, HEMICUBE, PARABOLOIDS = "6 cube faces", "5 hemicube faces", "2 paraboloids"
PARABOLOID, SPHERE, LAMBERT = "1 paraboloid", "1 cosine sphere", "1 Lambert"
REFERENCE = {PARABOLOIDS: CUBE, PARABOLOID: HEMICUBE, SPHERE: HEMICUBE, LAMBERT: HEMICUBE}
"""What a set of views takes the place of."""


@dataclass(frozen=True)
class ViewSet:
    """One set of views with one output, ready to be run."""

    size: int
    views: str
    output: str
    prepared: tuple[Any, ...]
    scene: Scene

    def run(self) -> None:
        """One frame of each view; for color, all its pixels shaded."""
        for view in self.prepared:
            frame = view.frame()
            if self.output == "color":
                shade_device(frame, self.scene, "light")


def view_sets(scene: Scene, size: int) -> dict[str, tuple[Any, ...]]:
    """The cameras of each set of views, from one eye; the second paraboloid looks backwards."""
    front = resized(scene.camera, size, size)
    about = np.diag([-1.0, 1.0, -1.0, 1.0])
    return {
        CUBE: tuple(face_cameras(front, size, half=False)),
        PARABOLOIDS: (front, front.with_pose(about @ np.asarray(front.camera_from_world))),
        HEMICUBE: tuple(face_cameras(front, size, half=True)),
        PARABOLOID: (front,),
        SPHERE: (projected(front, "cosine_sphere"),),
        LAMBERT: (projected(front, "equisolid"),),
    }


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    sizes, count = (SIZES[1:] if quick else SIZES), rounds(repeats, quick, ROUNDS)
    scene = builtin_scene("facade", sizes[0], sizes[0], triangles=TRIANGLES)
    sets = {size: view_sets(scene, size) for size in sizes}
    number = sum(len(views) for views in sets.values())
    steps = StepCounter(progress, number * (len(OUTPUTS) * (2 + WARMUP + count) + 1) + 1)

    cases, wrong = [], {}
    for size, views in sets.items():
        for name, cameras in views.items():
            truths = [rasterize(camera, scene.mesh, "raytrace") for camera in cameras]
            pixels = sum(camera.width * camera.height for camera in cameras)
            steps.done("truth")
            for output in OUTPUTS:
                kind = "hits" if output == "color" else output
                prepared = tuple(prepare(camera, scene.mesh, output=kind) for camera in cameras)
                cases.append(ViewSet(size, name, output, prepared, scene))
                off = sum(mismatch(view.frame(), truth) for view, truth in zip(prepared, truths, strict=True))
                wrong[size, name, output] = 100 * off / pixels
                steps.done(f"{name} {size}")
    calls: dict[str, Callable[[], object]] = {f"{c.size} {c.views} {c.output}": c.run for c in cases}
    times = timing.measure(calls, count, WARMUP, on_call=steps.done)
    milliseconds = {
        (case.size, case.views, case.output): 1e3 * time.median
        for case, time in zip(cases, times.values(), strict=True)
    }
    speeds = _speed_table(sets, milliseconds, wrong)
    report = Report(
        name="gascuel2008-table2",
        title="Cube and hemicube against non-linear projections",
        subject=f"Gascuel et al. 2008, Table 2 · facade, {scene.mesh.triangle_count:,} triangles",
        reading=_reading(speeds, wrong),
        parts=(speeds, _plot(speeds, sizes), _gallery(scene, sets[sizes[0]]), _time_table(sets, milliseconds)),
        scene={
            "paper": PAPER,
            "scene": f"facade, {scene.mesh.triangle_count:,} triangles (paper: Facade, 1,900)",
            "views": "from one eye; the cube's faces are pinholes of 90 degrees, the hemicube's side faces half of "
            "that, as in the paper (512² + 4 × 512 × 256 pixels)",
        },
        machine=machine(),
        measured=measured(
            count,
            color="first hits of every view, all their pixels shaded: texture and Lambert's law, one sun, no shadows",
            depth_and_coverage="frames that hold nothing else: output='depth' and output='coverage'",
            all_views="the same rasterizer (invert, bound tight) draws the faces and the non-linear views; nothing is "
            "resampled, which a cube map used as one picture would need besides",
            wrong=WRONG,
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _speed_table(sets: dict[int, Any], milliseconds: dict[Any, float], wrong: dict[Any, float]) -> Table:
    rows = []
    for size, views in sets.items():
        for name, reference in REFERENCE.items():
            row: dict[str, Any] = {"views": name, "size": size, "instead_of": reference}
            for number, output in enumerate(OUTPUTS):
                row[f"{output}_ratio"] = milliseconds[size, reference, output] / milliseconds[size, name, output]
                if (size, name) in TABLE_2:
                    row[f"{output}_paper_ratio"] = TABLE_2[size, reference][number] / TABLE_2[size, name][number]
            ours, theirs = (sum(c.width * c.height for c in views[key]) for key in (name, reference))
            row["pixel_ratio"] = theirs / ours
            row["wrong_percent"] = max(wrong[size, key, output] for key in (name, reference) for output in OUTPUTS)
            rows.append(row)
    columns = [
        Column("views", "Views"),
        Column("size", "Side", "pixels"),
        Column("instead_of", "Instead of", brief=False),
    ]
    for output, title in _titles():
        columns.append(Column(f"{output}_ratio", "Ours", "×", "Time of the cube's faces / time of these views.", title))
        columns.append(
            Column(f"{output}_paper_ratio", "Paper", "×", "The same of the paper's times.", title, paper=True)
        )
    columns.append(
        Column("pixel_ratio", "Fewer pixels", "×", "Pixels of the cube's faces / pixels of these views.", brief=False)
    )
    columns.append(Column("wrong_percent", "Wrong", "%", "The worst of three outputs of both, against Mitsuba."))
    note = "How many times faster than the faces of the cube; above 1 the non-linear views win."
    return Table("ratios", "How many times faster than a cube", tuple(columns), tuple(rows), note)


def _time_table(sets: dict[int, Any], milliseconds: dict[Any, float]) -> Table:
    rows = []
    for size, views in sets.items():
        for name, cameras in views.items():
            row: dict[str, Any] = {"views": name, "size": size}
            row["kilopixels"] = sum(camera.width * camera.height for camera in cameras) / 1e3
            row |= {f"{output}_ms": milliseconds[size, name, output] for output in OUTPUTS}
            paper = TABLE_2.get((size, name), ())
            row |= {f"{output}_paper_ms": value for output, value in zip(OUTPUTS, paper, strict=False)}
            rows.append(row)
    columns = [Column("views", "Views"), Column("size", "Side", "pixels"), Column("kilopixels", "Pixels", "thousands")]
    for output, title in _titles():
        columns.append(Column(f"{output}_ms", "Ours", "ms", "Median time of all views of the set.", title))
        columns.append(Column(f"{output}_paper_ms", "Paper", "ms", "On a graphics card of 2007.", title, paper=True))
    return Table("times", "Times behind the ratios", tuple(columns), tuple(rows), CARD)


def _titles() -> Iterable[tuple[str, str]]:
    return zip(OUTPUTS, ("Color", "Depth", "Coverage"), strict=True)


def _reading(table: Table, wrong: dict[Any, float]) -> str:
    """The finding, from the figures themselves."""
    ratios = [row[f"{output}_ratio"] for row in table.rows for output in OUTPUTS]
    won = sum(ratio > 1 for ratio in ratios)
    return (
        f"In {won} of {len(ratios)} cases the non-linear views take less time than the faces of the cube; the factors "
        f"go from {min(ratios):.1f} to {max(ratios):.1f}. {CARD} Here one rasterizer draws both sides, so a factor "
        "says how much work the faces are, not how fast a card's own circuits for linear views would be. "
        f"{wrong_pixels(max(wrong.values()))} {STAND_IN}"
    )


def _plot(table: Table, sizes: tuple[int, ...]) -> Plot:
    def draw(figure: Any, theme: Any) -> None:
        panels = figure.subplots(1, len(sizes), sharey=True, squeeze=False)[0]
        for axes, size in zip(panels, sizes, strict=True):
            rows = [row for row in table.rows if row["size"] == size]
            places = np.arange(len(rows))
            for number, (output, title) in enumerate(_titles()):
                at, color = places + 0.27 * (number - 1), theme.palette[number]
                axes.bar(at, [row[f"{output}_ratio"] for row in rows], 0.24, color=color, label=title)
                paper = [row.get(f"{output}_paper_ratio", np.nan) for row in rows]
                axes.plot(at, paper, "D", color=theme.ink, ms=5, label="paper" if number == 2 else None)
            axes.axhline(1, color=theme.soft, linewidth=1)
            axes.set_title(f"{size} × {size} pixels")
            axes.set_xticks(places, [str(row["views"]).replace(" ", "\n", 1) for row in rows])
            axes.grid(axis="y")
        panels[0].set_ylabel("times faster than the cube's faces")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=4)

    caption = (
        "Two paraboloids against the six faces of a cube, one view against the five of a hemicube. Diamonds: the paper."
    )
    return Plot("ratios", caption, "Bars of how many times faster than a cube each set of views is, by output", draw)


def _gallery(scene: Scene, views: dict[str, tuple[Any, ...]]) -> Gallery:
    """The paper's Fig. 10: a hemicube unfolded, and a paraboloid."""

    def image(camera: Any) -> np.ndarray:
        return shade(rasterize(camera, scene.mesh), scene, "light")

    pictures = (
        Picture(
            "hemicube",
            "Hemicube: one whole face and four halves, unfolded",
            unfolded([image(c) for c in views[HEMICUBE]]),
        ),
        *(
            Picture(key.split()[-1].lower(), key[2:3].upper() + key[3:], image(views[key][0]))
            for key in (PARABOLOID, SPHERE, LAMBERT)
        ),
    )
    return Gallery("The views", pictures, "The same half of the surroundings in each (the paper's Fig. 10).")


def unfolded(faces: list[np.ndarray]) -> np.ndarray:
    """The five faces of `face_cameras(half=True)` around the front one, corners black."""
    size = len(faces[0])
    side = faces[1].shape[1]
    whole = np.zeros((size + 2 * side, size + 2 * side, 3), np.float32)
    middle, end = slice(side, side + size), slice(side + size, None)
    for face, rows, columns in zip(
        faces,
        (middle, middle, middle, end, slice(side)),
        (middle, end, slice(side), middle, middle),
        strict=True,
    ):
        whole[rows, columns] = face
    return whole
