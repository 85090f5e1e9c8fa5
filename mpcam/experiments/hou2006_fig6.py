"""Hou et al. 2006, Figs. 1 and 6: quality of a mirror against tessellation, beside other methods and ray tracing."""

from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.comparison import timing
from mpcam.comparison.metrics import flip_map, image_rmse, psnr
from mpcam.comparison.mirrors import FINE
from mpcam.comparison.motion import moving_frame, moving_vertices
from mpcam.comparison.pareto import pareto_front
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.decomposition.decompose import decompose
from mpcam.decomposition.ray_error import ray_error
from mpcam.effects.reflection import Reflection
from mpcam.effects.shadows import shadow_maps
from mpcam.experiments import hou2006_paper as paper
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.hou2006_fig6_pages import (
    MirrorPicture,
    error_plot,
    gallery,
    quality_table,
    slope_table,
    time_plot,
)
from mpcam.experiments.hou2006_scenes import SHAPES, reflection_scene, smaller
from mpcam.experiments.results import Report
from mpcam.rendering.registry import METHODS
from mpcam.scene.scene import Scene

ROUNDS = 7
SIZES = (64, 128, 256, 512, 1024)
"""Pixels along a side of each of the two views of an environment map."""
LEVELS = ((26, 128), (52, 90), (104, 64), (208, 45), (416, 32), (1664, 16))
"""Camera triangles and their resolution: about as many pixels in all."""


def tessellations(scene: Scene, quick: bool) -> list[CameraTriangles]:
    """Camera triangles for the scene's mirror, from few to many."""
    assert scene.mirror is not None
    surface, shrink = scene.mirror.surface, 4 if quick else 1
    return [decompose(surface, scene.camera, number, resolution=side // shrink) for number, side in _levels(quick)]


def _levels(quick: bool) -> tuple[tuple[int, int], ...]:
    return LEVELS[:5:2] if quick else LEVELS


def _halvings(quick: bool) -> tuple[int, ...]:
    levels = METHODS["vertex"].values
    return levels[:3:2] if quick else levels


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count = rounds(repeats, quick, ROUNDS)
    sizes = SIZES[:3:2] if quick else SIZES
    number = 1 + len(sizes) + len(_halvings(quick)) + len(_levels(quick))
    steps = StepCounter(progress, len(SHAPES) * (1 + number * (1 + 2 * (1 + WARMUP + count))) + 1)
    rows: list[dict[str, Any]] = []
    shown: dict[str, list[MirrorPicture]] = {}
    for shape in SHAPES:
        scene = reflection_scene(shape)
        scene = smaller(scene) if quick else scene
        shown[shape] = _shown(shape, scene, sizes, quick, steps)
        _time(shown[shape], scene, count, steps)
        rows += [one.row for one in shown[shape]]
    slopes = [_slope(shape, [one.row for one in shown[shape]]) for shape in SHAPES]
    report = Report(
        name="hou2006-fig6",
        title="Mirrors: quality against tessellation",
        subject="Hou et al. 2006, Figs. 1 and 6 · 108 triangles before convex, concave and mixed mirrors",
        reading=_reading(rows, slopes),
        parts=(
            time_plot(rows),
            gallery(shown["mixed"], "mixed", "The mixed mirror: Figs. 1 and 6"),
            quality_table(rows),
            error_plot(rows),
            slope_table(slopes),
            gallery(shown["convex"], "convex", "The convex mirror"),
            gallery(shown["concave"], "concave", "The concave mirror"),
        ),
        scene={
            "paper": paper.PAPER,
            "mirrors": "a wavy panel (mixed), a dome (convex) and a bowl (concave), all with exact normals",
            "picture": f"{scene.camera.width} x {scene.camera.height} pixels, shaded, with the scene beside the mirror",
            "light": "one sun with a shadow map, ambient light, sky where rays miss everything",
        },
        machine=machine(),
        measured=measured(
            count,
            truth="Mitsuba: rays from the exact points and normals of the surface, the same shading",
            FLIP_and_PSNR="over the pixels of the mirror; LDR-FLIP, mean; PSNR in sRGB",
            ray_error="rms distance of rays from the true ones where they are two radii of the mirror away from it",
            slope="of ray error against the length of edges, both logarithmic: 2 is what linear interpolation gives",
            still="a whole shaded picture, scene beside the mirror included, when all building is done",
            moving="the same from new vertices on; the shadow map stays",
            vertices=f"their images by {FINE} camera triangles with rays at the corners, edges halved `level` times",
            environment="two views of so many pixels from the middle of the mirror, drawn anew in every frame",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _shown(shape: str, scene: Scene, sizes: tuple[int, ...], quick: bool, steps: StepCounter) -> list[MirrorPicture]:
    """The mirror by every method, the truth first."""
    assert scene.mirror is not None
    maps = shadow_maps(scene, 256 if quick else 2048)
    truth = Reflection(scene, method="raytrace", shadows=maps)
    image = truth.image()
    mask = truth.mask & (np.asarray(truth.direct.frame().depth) > truth.rays.distance.reshape(truth.mask.shape))
    start = {"mirror": shape}
    first = start | {"method": "ray tracing", "setting": "", "flip": 0.0, "psnr": float("inf")}
    found = [MirrorPicture(first, image, truth)]
    steps.done(f"{shape}, truth")

    def add(picture: Reflection, **row: Any) -> None:
        ours = picture.image()
        rmse = image_rmse(ours[mask], image[mask])
        errors = {"flip": float(flip_map(ours, image)[mask].mean()), "psnr": psnr(rmse)}
        found.append(MirrorPicture(start | row | errors, ours, picture))
        steps.done(f"{shape}, {row['setting']}")

    for size in sizes:
        picture = Reflection(scene, method="environment", size=size, shadows=maps)
        add(picture, method="environment map", setting=f"2 × {size}²", pixels_k=2e-3 * size * size)
    for level in _halvings(quick):
        picture = Reflection(scene, method="vertex", level=level, triangles=FINE, shadows=maps)
        add(picture, method="vertices", setting=f"level {level}")
    all_cams = tessellations(scene, quick)
    steps.done(f"{shape}, camera triangles")
    for cams in all_cams:
        missed = ray_error(cams, scene.mirror.surface, scene.camera)
        side = int(np.max(cams.resolution))
        add(
            Reflection(scene, cams=cams, shadows=maps),
            method="camera triangles",
            setting=f"{cams.count} × {side}²/2",
            camera_triangles=cams.count,
            pixels_k=cams.count * side * (side + 1) / 2e3,
            edge=edge_length(cams),
            ray_rms=missed.rms,
            ray_p95=missed.p95,
            angle_mrad=missed.angle_rms,
        )
    return found


def edge_length(cams: CameraTriangles) -> float:
    """Root mean square length of the edges, scene units."""
    corners = cams.vertices[cams.faces]
    return float(np.sqrt(np.square(corners - np.roll(corners, 1, axis=1)).sum(axis=-1).mean()))


def _time(shown: list[MirrorPicture], scene: Scene, count: int, steps: StepCounter) -> None:
    """Put the times of still and moving pictures into the rows, and which rows are on the front."""
    calls = {f"{i} still": one.picture.frame for i, one in enumerate(shown)}
    mirror = shown[0].row["mirror"]
    still = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done(f"{mirror}, still"))
    positions = moving_vertices(scene.mesh)
    calls = {
        f"{i} moving": moving_frame(one.picture, positions, normals=scene.mesh.normals, shadows=one.picture.shadows)
        for i, one in enumerate(shown)
    }
    moving = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done(f"{mirror}, moving"))
    for i, one in enumerate(shown):
        one.row["still_ms"], one.row["moving_ms"] = 1e3 * still[f"{i} still"].median, 1e3 * moving[f"{i} moving"].median
    for kind in ("still", "moving"):
        times = [one.row[f"{kind}_ms"] for one in shown]
        front = pareto_front([one.row["flip"] for one in shown], times)
        for one, on in zip(shown, front, strict=True):
            one.row[f"{kind}_front"] = "yes" if on else ""


def _slope(shape: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """How the ray error falls with the length of edges, over all levels and over the finest three."""
    kept = [row for row in rows if "edge" in row]
    edge, error = (np.log([row[name] for row in kept]) for name in ("edge", "ray_rms"))
    return {
        "mirror": shape,
        "slope": float(np.polyfit(edge, error, 1)[0]),
        "fine_slope": float(np.polyfit(edge[-3:], error[-3:], 1)[0]),
        "coarse_rms": kept[0]["ray_rms"],
        "fine_rms": kept[-1]["ray_rms"],
        "levels": len(kept),
    }


def _reading(rows: list[dict[str, Any]], slopes: list[dict[str, Any]]) -> str:
    """The finding, from the figures themselves."""
    parts = []
    for slope in slopes:
        mine = [row for row in rows if row["mirror"] == slope["mirror"]]
        cams = [row for row in mine if "edge" in row]
        around, vertices = (
            min(row["flip"] for row in mine if row["method"] == method) for method in ("environment map", "vertices")
        )
        parts.append(
            f"{slope['mirror']}: FLIP {cams[0]['flip']:.3f} with {cams[0]['camera_triangles']} and "
            f"{cams[-1]['flip']:.3f} with {cams[-1]['camera_triangles']} camera triangles, {around:.3f} with the "
            f"best environment map, {vertices:.3f} with vertices and straight edges at best; ray error falls with the "
            f"edge's power of {slope['slope']:.2f}"
        )
    wins = sum(row["moving_front"] == "yes" for row in rows if row["method"] == "camera triangles")
    tried = sum(row["method"] == "camera triangles" for row in rows)
    return (
        f"Over the mirror's pixels, {'; '.join(parts)}. Of {tried} rows with camera triangles {wins} are on the front "
        "of error against time in scenes that move, where no row is better in both. Beyond some tessellation the "
        "pixels of the atlas, not the rays, limit a picture, and it levels off as the paper says of its Fig. 6. "
        f"{paper.STAND_IN}"
    )
