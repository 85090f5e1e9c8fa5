"""Yu et al. 2009, Fig. 10: mirrors by the number of cameras and of scene triangles, and what one more camera costs."""

import dataclasses
import warnings
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.comparison import timing
from mpcam.comparison.motion import moving_frame, moving_vertices
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.decomposition.decompose import decompose
from mpcam.experiments import yu2009_paper_mirrors as paper
from mpcam.experiments.common import WARMUP, WRONG, machine, measured, mismatch, rounds, wrong_pixels
from mpcam.experiments.hou2006_scenes import smaller
from mpcam.experiments.results import Report
from mpcam.experiments.yu2009_butterfly import CENTER, EYE, RADIUS, TRIANGLES, butterfly_scene
from mpcam.experiments.yu2009_fig10_pages import cameras_table, curve_plot, curve_table, fit_table, scenes_table
from mpcam.geometry.surfaces import Surface
from mpcam.math.pose import look_at
from mpcam.rendering.methods import prepare
from mpcam.scene.scene import Scene

COUNTS = (126, 360, 640, 960, 2_000, 5_000, 10_000)
SIDES = (32, 128, 512)
MOST_PIXELS = 17_000_000
"""Of an atlas: the paper's largest images, of 512 pixels, would have up to 84 million for 640 cameras."""
SCENES, CAMERAS, IMAGE = (550, 1_100, 2_200), 480, 256
PATCHES = (6, 10)
CURVE, PIXELS = (126, 240, 480, 960, 2_000, 5_000, 10_000), 600_000
ROUNDS = {"tables": 3, "curve": 31, "curve_two_pass": 3}
MOST_BY_TWO_PASSES = 2_000
"""Cameras in the tables; the curve has more."""
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    number = {name: rounds(repeats, quick, usual) for name, usual in ROUNDS.items()}
    scene = smaller(butterfly_scene()) if quick else butterfly_scene()
    sizes = [(n, side) for n in COUNTS for side in SIDES if n * side * (side + 1) // 2 <= MOST_PIXELS]
    sizes = [(150, 8)] if quick else sizes
    of_scenes = [(n, patch) for n in (SCENES[:1] if quick else SCENES) for patch in PATCHES[: 1 if quick else 2]]
    curve = (20, 80) if quick else CURVE
    per = 1 + WARMUP + number["tables"]
    total = len(sizes) * (1 + 2 * per) + len(of_scenes) * (1 + 2 * per)
    total += len(curve) * (2 + 2 * (1 + WARMUP + number["curve"]) + (1 + WARMUP + number["curve_two_pass"])) + 1
    steps = StepCounter(progress, total)
    found = {n: sphere_of(scene, n) for n in dict.fromkeys(n for n, _ in sizes)}
    by_cameras = [
        _row(scene, with_side(found[n], side), paper.FIG_8_PATCH, number["tables"], steps)
        | {"wanted": n, "image": side, "paper_fps": paper.FIG_10_CAMERAS.get((n, side))}
        for n, side in sizes
    ]
    fixed, by_scene = with_side(found[150] if quick else sphere_of(scene, CAMERAS), 8 if quick else IMAGE), []
    for triangles, patch in of_scenes:
        row = _row(butterfly_scene(triangles), fixed, patch, number["tables"], steps)
        by_scene.append(row | {"patch": patch, "paper_fps": paper.FIG_10_SCENES[triangles, patch]})
    costs = _curve(scene, [cap_of(n, quick) for n in curve], 20_000 if quick else PIXELS, number, steps)
    fits = [fit for method in ("invert", "raytrace", "two_pass") for fit in _fits(method, costs)]
    report = Report(
        name="yu2009-fig10",
        title="Mirrors: the cost of many cameras",
        subject="Yu et al. 2009, Fig. 10 · general linear cameras on a mirror sphere among butterflies",
        reading=_reading(by_cameras, by_scene, costs, fits),
        parts=(
            curve_plot(costs, fits),
            fit_table(fits),
            curve_table(costs),
            cameras_table(by_cameras),
            scenes_table(by_scene),
        ),
        scene={
            "paper": paper.PAPER,
            "scene": f"butterflies and flowers on a meadow, {TRIANGLES:,} triangles, or as many as the row says",
            "sphere": "camera triangles that the eye sees, each a general linear camera in its own plane; those at "
            "grazing incidence, whose rays do not all leave on one side, are none, and are left out",
            "cap": "for the cost of one more camera: the part of the sphere that faces the eye, as a paraboloid, so "
            "that no camera is left out, and the same rays are sampled by few and by many",
        },
        machine=machine(),
        measured=measured(
            number["tables"],
            frame="new vertices, then first hits of all pixels of the atlas",
            curve=f"{number['curve']} timed rounds, of two_pass {number['curve_two_pass']}",
            image="pixels along the short sides of a camera triangle, which is half of such a square; the paper's "
            "images are whole squares",
            fit="time = fixed + per camera × cameras, by least squares of relative errors",
            raytrace="Mitsuba with Embree: the tree rebuilt, and the same rays",
            wrong=WRONG,
        ),
        left_out=()
        if quick
        else (
            f"atlases of more than {MOST_PIXELS / 1e6:.0f} million pixels: images of 512 pixels for 360 and 640 "
            "cameras (47 and 84 million), which the paper has, and of 128 for 5,000 and more",
            f"two_pass with more than {MOST_BY_TWO_PASSES:,} cameras in the tables; the curve has it",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def sphere_of(scene: Scene, count: int) -> CameraTriangles:
    """About so many general linear cameras on the scene's sphere, less those at grazing incidence."""
    assert scene.mirror is not None
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=".*left out: their rays")
        return decompose(scene.mirror.surface, scene.camera, count, mode="general_linear")


def cap_of(count: int, quick: bool = False) -> CameraTriangles:
    """About so many general linear cameras on a paraboloid in place of the part of the sphere that faces the eye."""
    frame = np.linalg.inv(look_at(CENTER, EYE))  # its z axis points to the eye
    frame[:3, 3] = CENTER + RADIUS * frame[:3, 2]
    cap = Surface.paraboloid(0.75 * RADIUS, -0.3 * RADIUS).transformed(frame)
    return decompose(cap.mesh(2_000) if quick else cap, EYE, count, mode="general_linear")


def with_side(cams: CameraTriangles, side: int) -> CameraTriangles:
    """The same with so many pixels along the short sides of each."""
    return dataclasses.replace(cams, resolution=side)


def pixels_of(cams: CameraTriangles) -> int:
    """Pixels of all camera triangles."""
    side = int(np.max(cams.resolution))
    return cams.count * side * (side + 1) // 2


def _row(scene: Scene, cams: CameraTriangles, patch: int, count: int, steps: StepCounter) -> dict[str, Any]:
    """Moving frames of one number of cameras and scene triangles."""
    mesh = scene.mesh
    what = f"{mesh.triangle_count:,} × {cams.count:,}"
    truth = prepare(cams, mesh, "raytrace").frame()
    row: dict[str, Any] = {
        "scene_triangles": mesh.triangle_count,
        "cameras": cams.count,
        "pixels_k": pixels_of(cams) / 1e3,
    }
    ready = {"invert": prepare(cams, mesh)}
    if cams.count <= MOST_BY_TWO_PASSES:
        ready["two_pass"] = prepare(cams, mesh, "two_pass", patch=patch)
    else:
        steps.skip(1 + WARMUP + count)
    for name, one in ready.items():
        row[f"{name}_wrong"] = 100 * mismatch(one.frame(), truth) / pixels_of(cams)
    steps.done(what)
    positions = moving_vertices(mesh)
    calls = {name: moving_frame(one, positions) for name, one in ready.items()}
    times = timing.measure(calls, count, WARMUP, on_call=lambda _: steps.done(what))
    for name, time in times.items():
        row |= {f"{name}_ms": 1e3 * time.median, f"{name}_fps": 1 / time.median}
    return row


def _curve(scene: Scene, caps: list[CameraTriangles], pixels: int, number: dict[str, int], steps: StepCounter) -> Rows:
    """Moving frames against the number of cameras, scene and pixels in all the same."""
    positions, rows, fast, slow = moving_vertices(scene.mesh), [], {}, {}
    for cams in caps:
        cams = with_side(cams, max(2, round(np.sqrt(2 * pixels / cams.count + 0.25) - 0.5)))
        hits = prepare(cams, scene.mesh).frame()
        row = {"cameras": cams.count, "side": int(np.max(cams.resolution)), "pixels_k": pixels_of(cams) / 1e3}
        rows.append(row | {"tests_k": hits.stats.tests / 1e3})
        steps.done(f"cap, {cams.count:,}")
        for name in ("invert", "raytrace"):
            fast[name, cams.count] = moving_frame(prepare(cams, scene.mesh, name), positions)
        slow["two_pass", cams.count] = moving_frame(
            prepare(cams, scene.mesh, "two_pass", patch=paper.FIG_8_PATCH), positions
        )
        steps.done(f"cap, {cams.count:,}")
    for calls, name in ((fast, "curve"), (slow, "curve_two_pass")):
        times = timing.measure(calls, number[name], WARMUP, on_call=lambda _: steps.done("the curve"))
        for (method, cameras), time in times.items():
            row = next(row for row in rows if row["cameras"] == cameras)
            row[f"{method}_ms"], row[f"{method}_spread"] = 1e3 * time.median, 1e3 * time.spread
    return rows


def _fits(method: str, rows: Rows) -> Rows:
    """time = fixed + per camera x cameras, up to the paper's 960 cameras and over all."""
    found = []
    last = max(row["cameras"] for row in rows)
    for most in dict.fromkeys((min(paper.FIG_8_CAMERAS, last), last)):
        kept = [row for row in rows if row["cameras"] <= 1.03 * most]
        if len(kept) < 2:
            continue
        cameras, times = (np.array([row[key] for row in kept], float) for key in ("cameras", f"{method}_ms"))
        table = np.stack([1 / times, cameras / times], axis=1)
        fixed, each = np.linalg.lstsq(table, np.ones(len(kept)), rcond=None)[0]
        found.append(
            {
                "method": method,
                "up_to": int(cameras.max()),
                "fixed_ms": float(fixed),
                "per_camera_us": float(1e3 * each),
                "share": float(each * paper.FIG_8_CAMERAS / fixed) if fixed > 0 else float("inf"),
                "measured": float(times[-1] / times[0] - 1),
            }
        )
    return found


def _reading(by_cameras: Rows, by_scene: Rows, costs: Rows, fits: Rows) -> str:
    """The finding, from the figures themselves."""
    ours, all_ours = (fits[0], next(fit for fit in reversed(fits) if fit["method"] == "invert"))
    two, first, last = next(fit for fit in fits if fit["method"] == "two_pass"), costs[0], costs[-1]
    known = [row for row in by_cameras if row["paper_fps"] is not None]
    text = ""
    if known:
        faster = [row["invert_fps"] / row["paper_fps"] for row in known]
        slower = [row["two_pass_fps"] / row["paper_fps"] for row in known]
        text = (
            f" At the paper's sizes invert makes {min(faster):.2g} to {max(faster):.2g} times its frames per second, "
            f"two_pass {min(slower):.2g} to {max(slower):.2g} times."
        )
    growth = by_scene[-1]["invert_ms"] / by_scene[0]["invert_ms"]
    return (
        f"With scene and pixels fixed, a frame by invert takes {first['invert_ms']:.3g} ms for {first['cameras']:,} "
        f"cameras and {last['invert_ms']:.3g} ms for {last['cameras']:,}. A fit up to {ours['up_to']:,} cameras gives "
        f"{ours['fixed_ms']:.3g} ms and {ours['per_camera_us']:.2g} µs for each camera, which is "
        f"{100 * ours['share']:.3g} % of the fixed work at {paper.FIG_8_CAMERAS} (wanted: at most 10 %); a fit over "
        f"all, {100 * all_ours['share']:.3g} %. All cameras share one launch, so there is no switching between them; "
        f"pixels tested rise from {first['tests_k']:,.0f} to {last['tests_k']:,.0f} thousand. two_pass "
        "takes each triangle again "
        f"for each camera that may show it, as the paper does: {two['per_camera_us']:.3g} µs for each camera, and "
        f"{last['two_pass_ms'] / first['two_pass_ms']:.3g} times the time for {last['cameras']:,}. From "
        f"{by_scene[0]['scene_triangles']:,} to {by_scene[-1]['scene_triangles']:,} scene triangles invert takes "
        f"{growth:.2g} times the time.{text} {paper.CARD} {paper.STAND_IN} Pixels of invert: "
        f"{wrong_pixels(max(row['invert_wrong'] for row in (*by_cameras, *by_scene)))}"
    )
