"""Yu et al. 2009, Fig. 8: a mirror sphere of 960 general linear cameras among butterflies, beside other rays."""

import warnings
from typing import Any, cast

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.comparison import timing
from mpcam.comparison.metrics import flip_map, image_rmse, psnr
from mpcam.comparison.motion import moving_frame, moving_vertices
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.decomposition.continuous import continuous
from mpcam.decomposition.decompose import MODES, decompose, directions_at_vertices, in_own_planes
from mpcam.decomposition.ray_error import ray_error
from mpcam.decomposition.reflector import reflector_of
from mpcam.effects.reflection import Reflection
from mpcam.effects.shadows import shadow_maps
from mpcam.experiments import yu2009_paper_mirrors as paper
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.hou2006_scenes import smaller
from mpcam.experiments.results import Report
from mpcam.experiments.yu2009_butterfly import RADIUS, TRIANGLES, butterfly_scene
from mpcam.experiments.yu2009_fig8_pages import (
    SpherePicture,
    closeups,
    error_table,
    gallery,
    seam_plot,
    time_table,
)
from mpcam.experiments.yu2009_seams import seam_jumps
from mpcam.rendering.methods import prepare
from mpcam.scene.scene import Scene

RESOLUTION, ROUNDS = 48, 9
MIDDLE = 0.85
"""Part of the sphere's picture, in radii, that counts as its middle."""
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count = rounds(repeats, quick, ROUNDS)
    steps = StepCounter(progress, 2 + len(MODES) + 11 * (1 + WARMUP + count) + (2 + 4) * (1 + WARMUP + count))
    scene = smaller(butterfly_scene()) if quick else butterfly_scene()
    shown = pictures(scene, 150 if quick else paper.FIG_8_CAMERAS, 8 if quick else RESOLUTION, quick, steps)
    _time_pictures(shown, scene, count, steps)
    hits = _time_hits(shown, scene, count, steps)
    steps.skip(steps.total - steps.count - 1)
    rows = [one.row for one in shown]
    report = Report(
        name="yu2009-fig8",
        title="A mirror sphere among butterflies",
        subject=f"Yu et al. 2009, Fig. 8 · {rows[1]['asked']} camera triangles, {TRIANGLES:,} scene triangles",
        reading=_reading(rows, hits),
        parts=(gallery(shown), error_table(rows), seam_plot(shown), closeups(shown), time_table(hits)),
        scene={
            "paper": paper.PAPER,
            "scene": f"butterflies and flowers on a meadow around a sphere, {TRIANGLES:,} triangles",
            "picture": f"{scene.camera.width} x {scene.camera.height} pixels, shaded, the scene beside the sphere too",
            "camera triangles": "those that the eye sees; for general linear cameras less those at grazing incidence",
        },
        machine=machine(),
        measured=measured(
            count,
            truth="Mitsuba: rays from the exact points and normals of the sphere, the same shading",
            FLIP_and_PSNR="over the pixels of the sphere that nothing hides; LDR-FLIP, mean; PSNR in sRGB",
            middle=f"the same within {MIDDLE} of the sphere's radius in the picture, away from the rim",
            ray_error="distance of rays from the true ones where they are two radii of the sphere away from it",
            seam="a ray of one side at a common edge is followed for two radii; the jump is how far off the other "
            "side, continued, shows the point where it ends, in pixels of the picture; at four places on each edge",
            still="a whole shaded picture when all building is done",
            moving="the same from new vertices on; the shadow map stays",
            hits="first hits of all pixels of the atlas of the general linear cameras, without shading",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def pictures(scene: Scene, number: int, side: int, quick: bool, steps: StepCounter) -> list[SpherePicture]:
    """The truth, then the sphere with each kind of rays, then general linear cameras in two passes."""
    assert scene.mirror is not None
    maps = () if quick else shadow_maps(scene, 2048)
    truth = Reflection(scene, method="raytrace", shadows=maps)
    image = truth.image()
    mask = truth.mask & (np.asarray(truth.direct.frame().depth) > truth.rays.distance.reshape(truth.mask.shape))
    middle = mask & _middle(truth.mask)
    steps.done("truth")
    found = [SpherePicture({"rays": "truth", "method": "raytrace", "flip": 0.0}, image, truth, np.zeros(0))]

    def add(row: dict[str, Any], picture: Reflection, jumps: np.ndarray) -> None:
        ours = picture.image()
        difference = flip_map(ours, image)
        row |= {"flip": float(difference[mask].mean()), "psnr": psnr(image_rmse(ours[mask], image[mask]))}
        row |= {"flip_middle": float(difference[middle].mean())}
        found.append(SpherePicture(row, ours, picture, jumps))

    made = cameras(scene, number, side)
    for mode, cams in made.items():
        left_out = made["normals"].count - cams.count
        missed = ray_error(cams, scene.mirror.surface, scene.camera)
        jumps = seam_jumps(cams, scene.camera, 2 * RADIUS)
        row = {"rays": mode, "method": "invert", "asked": number, "cameras": cams.count, "left_out": left_out}
        row |= {"ray_rms": missed.rms, "ray_median": missed.median, "ray_p95": missed.p95, "ray_max": missed.max}
        row |= {"angle_mrad": missed.angle_rms, **_seams(jumps)}
        add(row, Reflection(scene, cams=cams, shadows=maps), jumps)
        steps.done(mode)
    first = found[1]
    picture = Reflection(scene, cams=cast(CameraTriangles, first.picture.cams), shadows=maps)
    part: Any = picture.part
    part.prepared = prepare(part.cams, scene.mesh, "two_pass", patch=paper.FIG_8_PATCH)
    kept = {name: value for name, value in first.row.items() if not name.startswith(("ray_", "seam_", "angle"))}
    add(kept | {"method": "two_pass"}, picture, np.zeros(0))
    return found


def cameras(scene: Scene, number: int, side: int) -> dict[str, CameraTriangles]:
    """Camera triangles of the scene's sphere by the kind of rays between their corners, from one decomposition."""
    assert scene.mirror is not None
    bent = decompose(scene.mirror.surface, scene.camera, number, resolution=side)
    direct = directions_at_vertices(bent)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*left out: their rays")
        linear = in_own_planes(direct)
    return {
        "general_linear": linear,
        "directions": direct,
        "continuous": continuous(bent, direct, reflector_of(scene.mirror.surface), scene.camera),
        "normals": bent,
    }


def _middle(mask: np.ndarray) -> np.ndarray:
    """The middle of a disc."""
    y, x = np.nonzero(mask)
    row, column = np.indices(mask.shape)
    center, radius = (y.mean(), x.mean()), np.sqrt(len(x) / np.pi)
    return np.hypot(row - center[0], column - center[1]) < MIDDLE * radius


def _seams(jumps: np.ndarray) -> dict[str, Any]:
    known = jumps[np.isfinite(jumps)]
    return {
        "seam_median": float(np.median(known)),
        "seam_p95": float(np.percentile(known, 95)),
        "seam_max": float(known.max()),
        "seam_above": 100 * float((known > 0.5).mean()),
        "seam_places": len(known),
        "seam_lost": len(jumps) - len(known),
    }


def _time_pictures(shown: list[SpherePicture], scene: Scene, count: int, steps: StepCounter) -> None:
    """Put the times of still and moving pictures into the rows."""
    still = {str(i): one.picture.frame for i, one in enumerate(shown)}
    times = timing.measure(still, count, WARMUP, on_call=lambda _: steps.done("still"))
    positions = moving_vertices(scene.mesh)
    calls = {
        str(i): moving_frame(one.picture, positions, normals=scene.mesh.normals, shadows=one.picture.shadows)
        for i, one in enumerate(shown)
    }
    moving = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done("moving"))
    for i, one in enumerate(shown):
        one.row["still_ms"], one.row["moving_ms"] = 1e3 * times[str(i)].median, 1e3 * moving[str(i)].median


def _time_hits(shown: list[SpherePicture], scene: Scene, count: int, steps: StepCounter) -> Rows:
    """First hits of the general linear cameras alone, by each method."""
    cams, mesh = shown[1].picture.cams, scene.mesh
    assert cams is not None
    settings: dict[str, tuple[str, dict[str, Any]]] = {
        "invert": ("invert", {}),
        f"two_pass, patch {paper.FIG_8_PATCH}": ("two_pass", {"patch": paper.FIG_8_PATCH}),
        "raytrace": ("raytrace", {}),
    }
    positions, calls = moving_vertices(mesh), {}
    for label, (method, given) in settings.items():
        calls[f"{label} still"] = prepare(cams, mesh, method, **given).frame
        calls[f"{label} moving"] = moving_frame(prepare(cams, mesh, method, **given), positions)
    times = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done("first hits"))
    rows: Rows = []
    for label in settings:
        row: dict[str, Any] = {"method": label}
        row |= {f"{kind}_ms": 1e3 * times[f"{label} {kind}"].median for kind in ("still", "moving")}
        rows.append(row | {"moving_fps": 1e3 / row["moving_ms"], "paper_fps": None})
    rows[1]["paper_fps"] = paper.FIG_8_FPS
    return rows


def _reading(rows: Rows, hits: Rows) -> str:
    """The finding, from the figures themselves."""
    by = {row["rays"]: row for row in rows if row["method"] == "invert"}
    linear, two = by["general_linear"], rows[-1]
    rest = ", ".join(f"{name} {row['flip']:.3f}" for name, row in by.items() if name != "general_linear")
    rays = ", ".join(f"{1e3 * row['ray_rms']:.3g} mm with {name}" for name, row in by.items())
    others = max(row["seam_max"] for name, row in by.items() if name != "general_linear")
    return (
        f"{linear['left_out']} of {linear['left_out'] + linear['cameras']} camera triangles, at grazing incidence, are "
        "no general linear cameras in their own plane, and are left out: the paper does not speak of them. FLIP over "
        f"the sphere is {linear['flip']:.3f} with general linear cameras ({linear['flip_middle']:.3f} in its middle), "
        f"against {rest}. Rays, two radii away, miss the true ones by {rays} (root mean square). At seams the image of "
        f"a point jumps by {linear['seam_median']:.2g} pixels in the median and {linear['seam_max']:.2g} at most, more "
        f"than half a pixel at {linear['seam_above']:.2g} % of the places; with the others by no more than "
        f"{others:.1g}, which is rounding. First hits of a moving frame take {hits[0]['moving_ms']:.3g} ms by invert, "
        f"{hits[1]['moving_ms']:.3g} ms by the paper's two passes and {hits[2]['moving_ms']:.3g} ms by rebuilding a "
        f"tree and tracing; FLIP of two_pass is {two['flip']:.3f}. {paper.CARD} {paper.STAND_IN}"
    )
