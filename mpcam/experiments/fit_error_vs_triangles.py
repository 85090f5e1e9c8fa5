"""Rays of camera triangles against how many there are: uniform, simplified and fitted ones, on eight reflectors."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.pinhole import Pinhole
from mpcam.comparison import timing
from mpcam.comparison.numbers import format_number
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.decomposition.decompose import MOST, decompose
from mpcam.decomposition.ray_error import ray_error
from mpcam.decomposition.reflector import reflector_of
from mpcam.effects.reflection import Reflection
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.results import Column, Plot, Report, Table
from mpcam.fitting.fit import fit
from mpcam.geometry.builtin import builtin_mesh
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface
from mpcam.math.pose import look_at
from mpcam.scene.builtin import builtin_scene
from mpcam.scene.mirror import Mirror
from mpcam.scene.scene import Scene

ROUNDS = 9
COUNTS = (16, 32, 64, 104, 256, 512, 1024, 2048)
TIMED = 104
"""Camera triangles whose frames are timed."""
EYE = (3.0, 1.0, 2.5)
NEAR, FAR = 0.5, 20.0
UNIFORM, SIMPLIFIED, FITTED = "uniform", "simplified", "fitted"
Rows = list[dict[str, Any]]


def reflectors(quick: bool) -> dict[str, Mesh | Surface]:
    """Surfaces by formula, and meshes that fill a ball of radius 1 about the origin."""
    found: dict[str, Mesh | Surface] = {"sphere": Surface.sphere()}
    if quick:
        return found
    found |= {
        "wave": Surface.wave(),
        "ellipsoid": Surface.ellipsoid((1.0, 0.5, 0.3)),
        "torus": Surface.torus(),
        "bowl": Surface.paraboloid(),
        "saddle": Surface.saddle(),
    }
    for name in ("teapot", "knot"):
        whole = reflector_of(builtin_mesh(name))
        place = np.diag([1.0 / whole.radius] * 3 + [1.0])
        place[:3, 3] = -whole.center / whole.radius
        found[name] = builtin_mesh(name).transformed(place)
    return found


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count = rounds(repeats, quick, ROUNDS)
    counts, compared = ((12, 32), 32) if quick else (COUNTS, TIMED)
    size, iterations = ((96, 72), 4) if quick else ((400, 300), 30)
    focal = 0.94 * size[0]
    eye = Pinhole(*size, focal, focal, 0.5 * size[0], 0.5 * size[1], camera_from_world=look_at(EYE, (0.0, 0.0, 0.0)))
    chosen = reflectors(quick)
    steps = StepCounter(progress, len(chosen) * (len(counts) * 3 + 3 * (1 + WARMUP + count)) + 1)
    rows: Rows = []
    for name, reflector in chosen.items():
        mine, timed = [], {}
        for many in counts:
            for kind, make in _kinds(reflector, eye, many, iterations).items():
                row, cams = _row(name, kind, reflector, eye, make)
                mine.append(row)
                if many == compared and cams is not None:
                    timed[kind] = cams
                steps.done(f"{name}: {many:,} {kind}")
        _time(mine, timed, reflector, eye, count, steps)
        rows += mine
    report = Report(
        name="fit-error-vs-triangles",
        title="Rays against the number of camera triangles",
        subject=f"{len(chosen)} reflectors · {counts[0]} to {counts[-1]:,} camera triangles · {size[0]} × {size[1]}",
        reading=_reading(rows, compared),
        parts=(_plot(rows), _table(rows)),
        scene={
            "reflectors": "in a ball of radius 1 about the origin; teapot and knot are meshes with smooth normals",
            "eye": f"at {EYE[0]:g}, {EYE[1]:g}, {EYE[2]:g}, looking at the origin",
            "frame": "a facade seen in the reflector, by camera triangles with 64 pixels along their short sides",
        },
        machine=machine(),
        measured=measured(
            count,
            uniform="a regular grid of the surface's parameters, cut down to what the eye sees; none of meshes",
            simplified="mpcam.decompose",
            fitted="mpcam.fit of those",
            angle="root mean square between rays and the true ones, on pixels that were not fitted",
            near_and_far="root mean square distance to the true rays, half a radius and 20 radii away, over that of "
            "the simplified ones",
            made_in="decomposition and fit, one call, with what is compiled on the way",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


Make = Callable[[], CameraTriangles]


def _kinds(reflector: Mesh | Surface, eye: Camera, many: int, iterations: int) -> dict[str, Make | None]:
    def fitted() -> CameraTriangles:
        start = decompose(reflector, eye, many)
        return fit(start, reflector=reflector, eye=eye, iterations=iterations).camera

    return {
        UNIFORM: (lambda: uniform(reflector, eye, many)) if isinstance(reflector, Surface) else None,
        SIMPLIFIED: lambda: decompose(reflector, eye, many),
        FITTED: fitted,
    }


def uniform(surface: Surface, eye: Camera, many: int) -> CameraTriangles:
    """Camera triangles on a regular grid of a surface, about so many of which the eye sees."""
    wanted, best = many, None
    for _ in range(6):
        cams = decompose(surface.mesh(wanted), eye, MOST)
        if cams.count <= many and (best is None or cams.count > best.count):
            best = cams
        if 0.8 * many < cams.count <= many:
            break
        wanted = max(round(wanted * 0.95 * many / cams.count), 2)
    return cams if best is None else best


def _row(
    name: str, kind: str, reflector: Mesh | Surface, eye: Camera, make: Make | None
) -> tuple[dict[str, Any], CameraTriangles | None]:
    row: dict[str, Any] = {"reflector": name, "kind": kind}
    if make is None:
        return row, None
    start = time.perf_counter()
    cams = make()
    row |= {"triangles": cams.count, "seconds": time.perf_counter() - start}
    radius = reflector_of(reflector).radius
    found = ray_error(cams, reflector, eye)
    row |= {"angle": found.angle_rms, "rms": found.rms, "p95": found.p95, "max": found.max, "missed": found.missed}
    for label, distance in (("near", NEAR), ("far", FAR)):
        row[label] = ray_error(cams, reflector, eye, distance=distance * radius).rms
    return row, cams


def _time(
    rows: Rows,
    timed: dict[str, CameraTriangles],
    reflector: Mesh | Surface,
    eye: Camera,
    count: int,
    steps: StepCounter,
) -> None:
    """Frames of TIMED camera triangles of each kind, side by side."""
    around = builtin_scene("facade", eye.width, eye.height, triangles=4_800)
    scene = Scene(around.meshes, eye, around.lights, around.ambient, around.background, mirror=Mirror(reflector))
    calls = {kind: Reflection(scene, cams=cams).frame for kind, cams in timed.items()}
    found = timing.measure(calls, count, WARMUP, on_call=steps.done)
    for kind, cams in timed.items():
        row = next(row for row in rows if row["kind"] == kind and row.get("triangles") == cams.count)
        row["frame_ms"], row["frame_spread"] = 1e3 * found[kind].median, 1e3 * found[kind].spread
    for _ in range((3 - len(timed)) * (1 + WARMUP + count)):
        steps.done("no uniform ones of a mesh")


def _gains(rows: Rows, many: int) -> dict[str, float]:
    """How many times nearer fitted rays are, by reflector, of about so many camera triangles."""
    found = {}
    for name in dict.fromkeys(row["reflector"] for row in rows):
        mine = {
            kind: min(
                (row for row in rows if row["reflector"] == name and row["kind"] == kind),
                key=lambda row: abs(np.log(row["triangles"] / many)),
            )
            for kind in (SIMPLIFIED, FITTED)
        }
        found[name] = mine[SIMPLIFIED]["rms"] / mine[FITTED]["rms"]
    return found


def _reading(rows: Rows, many: int) -> str:
    gains = ", ".join(f"{name} {format_number(gain, 2)}" for name, gain in _gains(rows, many).items())
    missed = sum(row.get("missed", 0) for row in rows if row["kind"] == FITTED)
    return (
        f"At {many} camera triangles, fitted rays are so many times nearer to the true ones than simplified ones: "
        f"{gains}. All curves fall about as one over the number. Rays that fitted camera triangles miss: {missed:,}."
    )


def _plot(rows: Rows) -> Plot:
    names = list(dict.fromkeys(row["reflector"] for row in rows))

    def draw(figure: Any, theme: Any) -> None:
        columns = min(len(names), 4)
        panels = np.ravel(figure.subplots(-(-len(names) // columns), columns, squeeze=False))
        for axes, name in zip(panels, names, strict=False):
            for number, kind in enumerate((UNIFORM, SIMPLIFIED, FITTED)):
                mine = [row for row in rows if row["reflector"] == name and row["kind"] == kind and "angle" in row]
                x, y = [row["triangles"] for row in mine], [row["angle"] for row in mine]
                label = kind if name == names[0] else None
                axes.loglog(x, y, "o-", markersize=3, color=theme.palette[number], label=label)
            axes.set_title(name, fontsize=9)
            axes.grid()
        for axes in panels[len(names) :]:
            axes.set_visible(False)
        figure.supxlabel("camera triangles")
        figure.supylabel("angle to the true rays, mrad")
        figure.legend(loc="outside right upper")

    return Plot(
        "angles", "Root mean square angles of rays, by reflector.", "Curves of angles by number", draw, height=5.5
    )


def _table(rows: Rows) -> Table:
    columns = (
        Column("reflector", "Reflector"),
        Column("kind", "Kind"),
        Column("triangles", "Triangles", "", "Camera triangles that the eye sees."),
        Column("angle", "Angle", "mrad", "Root mean square."),
        Column("rms", "Root mean square", "", "Scene units, two radii away.", group="Distance"),
        Column("p95", "95 % below", "", "", group="Distance", brief=False),
        Column("max", "Worst", "", "", group="Distance", brief=False),
        Column("near", "Near", "", "Half a radius away.", group="Distance", brief=False),
        Column("far", "Far", "", "20 radii away.", group="Distance", brief=False),
        Column("missed", "Missed", "", "Rays that they do not have.", brief=False),
        Column("seconds", "Made in", "s"),
        Column("frame_ms", "Frame", "ms", f"Median, of about {TIMED} camera triangles.", group="Frame"),
        Column("frame_spread", "Spread", "ms", "Interquartile range.", group="Frame"),
    )
    shown = tuple(row for row in rows if "triangles" in row)
    return Table("errors", "Errors of rays", columns, shown)
