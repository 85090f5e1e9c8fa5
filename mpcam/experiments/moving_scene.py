"""Rasterizing against rebuilding a tree and tracing: whole frames of moving and still scenes by number of triangles."""

from typing import Any

import numpy as np

from mpcam.cameras.radial import Radial
from mpcam.comparison.driver import compare
from mpcam.comparison.progress import Progress
from mpcam.experiments.common import machine, measured, rounds
from mpcam.experiments.figures import plain_ticks
from mpcam.experiments.results import Column, Plot, Report, Table
from mpcam.geometry.builtin import builtin_mesh
from mpcam.geometry.mesh import Mesh
from mpcam.scene.builtin import builtin_scene
from mpcam.scene.scene import Scene

LEVELS, BUILT_IN, SIZE, ROUNDS = (80, 1280, 20480, 327680), ("facade", "temple", "characters", "patio"), 512, 31
METHODS = ("invert", "raytrace")


def wavy_sphere(triangles: int, size: int = SIZE) -> Scene:
    """A closed surface around a paraboloid camera, whose distance varies between 0.8 and 1.2."""
    sphere = builtin_mesh("sphere", triangles=triangles)
    scale = 1 + 0.2 * np.sin(5 * sphere.vertices[:, :1])
    mesh = Mesh(sphere.vertices * scale, sphere.faces, name=f"sphere {sphere.triangle_count}")
    return Scene((mesh,), camera=Radial.paraboloid(size, size), name=mesh.name)


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    size, count = (32 if quick else SIZE), rounds(repeats, quick, ROUNDS)
    scenes = [wavy_sphere(triangles, size) for triangles in (LEVELS[:2] if quick else LEVELS)]
    scenes += [builtin_scene(name, size, size) for name in (BUILT_IN[:1] if quick else BUILT_IN)]
    rows = []
    for number, scene in enumerate(scenes):
        table = compare(scene, METHODS, repeats=count, progress=_part(progress, number, len(scenes), scene.name))
        ours, theirs = (table.row(method) for method in METHODS)
        row: dict[str, Any] = {
            "scene": scene.name,
            "triangles": scene.mesh.triangle_count,
            "invert_still_ms": ours.still_ms,
            "invert_moving_ms": ours.moving_ms,
            "raytrace_still_ms": theirs.still_ms,
            "raytrace_moving_ms": theirs.moving_ms,
            "still_ratio": ours.still_ms / theirs.still_ms,
            "moving_ratio": ours.moving_ms / theirs.moving_ms,
            "overdraw": ours.overdraw,
            "wrong_percent": 100 * (ours.hit_mismatch + ours.triangle_mismatch),
        }
        rows.append(row)
    return Report(
        name="moving-scene",
        title="Moving and still scenes",
        subject=f"Rasterizing against rebuilding a tree and tracing · {size} × {size} pixels, paraboloid",
        reading=_reading(rows),
        parts=(_table(tuple(rows)), _plot(rows)),
        scene={
            "spheres": "closed wavy surfaces around the camera, at several levels of detail",
            "others": "the built-in scenes",
        },
        machine=machine(),
        measured=measured(
            count,
            still="first hits of a frame when all building is done",
            moving="new vertices, everything rebuilt that depends on them, then the frame",
            ratio="time of invert / time of raytrace; below 1 rasterizing wins",
            raytrace="Mitsuba with Embree: a tree over the triangles, the same rays and the same float32 vertices",
        ),
        quick=quick,
    )


def _part(progress: Progress | None, number: int, of: int, name: str) -> Progress | None:
    """The progress of one comparison among several."""
    if progress is None:
        return None
    return lambda done, total, what: progress(number * total + done, of * total, f"{name}: {what}")


def _table(rows: tuple[dict[str, Any], ...]) -> Table:
    columns = [Column("scene", "Scene"), Column("triangles", "Triangles")]
    for method in METHODS:
        columns.append(Column(f"{method}_still_ms", "Still", "ms", "Median.", method))
        columns.append(Column(f"{method}_moving_ms", "Moving", "ms", "Median.", method))
    columns.append(Column("still_ratio", "Still", "", "invert / raytrace; below 1 rasterizing wins.", "Ratio"))
    columns.append(Column("moving_ratio", "Moving", "", "invert / raytrace; below 1 rasterizing wins.", "Ratio"))
    columns.append(Column("overdraw", "Tests per hit", "", "Tests of a pixel divided by tests that hit; 1 is ideal."))
    columns.append(Column("wrong_percent", "Wrong", "%", "Share of the pixels that differ from first hits in Mitsuba."))
    return Table("moving_scene", "Whole frames", tuple(columns), rows)


def _plot(rows: list[dict[str, Any]]) -> Plot:
    def draw(figure: Any, theme: Any) -> None:
        axes = figure.subplots()
        places = np.arange(len(rows))
        for number, (name, label) in enumerate((("still_ratio", "still"), ("moving_ratio", "moving"))):
            at = places + 0.2 * (2 * number - 1)
            axes.bar(at, [row[name] for row in rows], 0.36, color=theme.palette[number], label=label)
        axes.set_yscale("log")
        plain_ticks(axes.yaxis)
        axes.axhline(1, color=theme.ink, linewidth=1)
        axes.set_xticks(places, [f"{row['scene']}".replace("sphere ", "sphere\n") for row in rows])
        axes.set_ylabel("invert / raytrace")
        axes.grid(axis="y")
        figure.legend(loc="outside upper right", ncols=2)

    caption = (
        "Time of rasterizing divided by time of ray tracing, on a scale of powers of ten; below 1 rasterizing wins."
    )
    alt = "Bars of the ratio of the two times for each scene, still and moving"
    return Plot("ratios", caption, alt, draw, height=3.6)


def _reading(rows: list[dict[str, Any]]) -> str:
    won = {name: sum(row[f"{name}_ratio"] < 1 for row in rows) for name in ("still", "moving")}
    return (
        f"Rasterizing takes less time in {won['moving']} of {len(rows)} scenes that move and in {won['still']} of "
        f"{len(rows)} that stand still. Rebuilding the tree is what ray tracing pays for motion. Both ran interleaved "
        "on the same processor, so the ratios hold for it; another builder of trees or a graphics card may give others."
    )
