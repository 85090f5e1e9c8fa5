"""Rosen et al. 2011, Figs. 2, 12, 13 and 20: cars and barrels as relief textures, against tracing their triangles."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.comparison import timing
from mpcam.comparison.metrics import flip_map
from mpcam.comparison.progress import Progress, StepCounter
from mpcam.effects.relief import Relief
from mpcam.effects.relief_instances import ReliefInstances
from mpcam.effects.relief_picture import ReliefPicture
from mpcam.effects.shadows import shadow_maps
from mpcam.experiments.common import WARMUP, machine, measured, rounds
from mpcam.experiments.instance_tracing import InstanceTracing
from mpcam.experiments.results import Report
from mpcam.experiments.rosen2011_relief_pages import PAPER, pictures_of, plot_of, reading_of, table_of
from mpcam.experiments.rosen2011_relief_scene import ReliefScene, relief_scene
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import shade
from mpcam.scene.scene import DirectionalLight

ROUNDS = 9
PAPER_FPS = {("cars", 1): 219.0, ("cars", 10): 51.0, ("cars", 20): 26.0, ("cars", 40): 14.0}
PAPER_FPS |= {("barrels", 60): 18.0, ("small cars", 160): 46.0}
"""With shadow maps, 640 x 480 pixels, textures of 512 x 512 (section 7.2)."""
KINDS: dict[str, dict[str, Any]] = {
    "single pole": {"camera": "single_pole"},
    "conventional": {"camera": "orthographic"},
    "conventional, 2 layers": {"camera": "orthographic", "layers": 2},
    "conventional, 4 layers": {"camera": "orthographic", "layers": 4},
}
SHADOWS = 2048
Rows = list[dict[str, Any]]


def run(repeats: int | None = None, quick: bool = False, progress: Progress | None = None) -> Report:
    """Run the experiment; see `mpcam.experiments.run`."""
    count = rounds(repeats, quick, ROUNDS)
    scenes = [("cars", 2)] if quick else list(PAPER_FPS)
    kinds = dict(list(KINDS.items())[:2]) if quick else KINDS
    width, height, size, texels = (96, 72, 64, 256) if quick else (640, 480, 512, SHADOWS)
    calls = 8 * (1 + WARMUP + count)
    steps = StepCounter(progress, len(scenes) * (1 + len(kinds) + calls) + 1)
    rows: Rows = []
    shown: dict[str, Any] = {}
    for kind, many in scenes:
        made = relief_scene(kind, 4_000 if quick and kind != "barrels" else None, many, width, height)
        whole = made.whole()
        truth = prepare(whole.camera, whole.mesh, "raytrace").frame()
        picture = shade(truth, whole, "light", shadow_maps(whole, texels))
        steps.done(f"{many} {kind}")
        last = {kind: number for kind, number in scenes}[kind] == many
        if last:
            shown[kind] = {"truth": picture, "scene": made}
        for name, given in kinds.items():
            instances = _instances(made, size, given)
            row = {"scene": kind, "count": many, "relief": name, "triangles": many * made.tile.triangle_count}
            found = _errors(made, instances, truth, picture, texels)
            if last:
                shown[kind][name] = found.pop("image"), instances
            found.pop("image", None)
            rows.append(row | found)
            steps.done(f"{many} {kind}, {name}")
        first = next(row for row in rows if (row["scene"], row["count"]) == (kind, many))
        first |= _times(made, size, texels, count, steps.done) | {"paper_fps": PAPER_FPS.get((kind, many))}
    report = Report(
        name="rosen2011-relief",
        title="Relief textures by cameras that are not pinholes",
        subject=f"Rosen et al. 2011, Figs. 2, 12, 13 and 20 · {width} × {height} pixels, textures of {size} × {size}",
        reading=reading_of(rows),
        parts=(*pictures_of(shown), *table_of(rows), plot_of(rows)),
        scene={
            "paper": PAPER,
            "cars": "12,000 triangles each, of eight colors by one relief whose yellow is replaced; half as large in "
            "the third scene",
            "barrels": "4,900 triangles each, with staves and hoops as texture",
            "ground": "a gentle swell of 1,200 triangles, rasterized; the copies stand upright on it",
        },
        machine=machine(),
        measured=measured(
            count,
            seen="first hits of all pixels, on the ground and on reliefs; of the rivals on all triangles",
            moving="every copy elsewhere, then first hits; one rival has all vertices new and its tree rebuilt, the "
            "other, of instances, all matrices new",
            frame="copies elsewhere, a shadow map of 2048 pixels anew, first hits, colors and light; of the rival "
            "moved instances, first hits and one shadow ray a pixel, without shading",
            still="the same without motion",
            mismatch="pixels that show a copy and should not, or the other way, or another copy",
            rms="of the lit picture with shadows against that of the triangles, linear RGB",
        ),
        quick=quick,
    )
    steps.done("done")
    return report


def _instances(made: ReliefScene, size: int, given: dict[str, Any]) -> ReliefInstances:
    relief = Relief.render(made.tile, size=size, box=made.box, key=None if made.colors is None else made.keyed, **given)
    return relief.instances(made.matrices, made.colors)


def _errors(
    made: ReliefScene, instances: ReliefInstances, truth: Any, picture: np.ndarray, texels: int
) -> dict[str, Any]:
    """What a relief's picture has wrong, and its steps and size."""
    scene = replace(made.scene, reliefs=instances)
    view = ReliefPicture(scene, shadows=shadow_maps(scene, texels))
    image, (_, hits) = view.image(), view.seen()
    ground = made.scene.mesh.triangle_count
    true = np.where(truth.triangle >= ground, (truth.triangle - ground) // made.tile.triangle_count, -1)
    covered = max(int((true >= 0).sum()), 1)
    return {
        "image": image,
        "mismatch": 100 * float((hits.instance != true).mean()),
        "missing": 100 * float(((true >= 0) & (hits.instance != true)).sum()) / covered,
        "rms": float(np.sqrt(((image - picture) ** 2).mean())),
        "flip": float(flip_map(image, picture).mean()),
        "steps": float(hits.steps[hits.steps > 0].mean()) if (hits.steps > 0).any() else 0.0,
        "megabytes": instances.relief.bytes / 2**20,
    }


def _times(made: ReliefScene, size: int, texels: int, count: int, on_call: Callable[[str], None]) -> dict[str, Any]:
    """Medians of frames by the single-pole relief and by both rivals, all in one shuffled order."""
    instances = _instances(made, size, KINDS["single pole"])
    scene = replace(made.scene, reliefs=instances)
    view, lit = ReliefPicture(scene), ReliefPicture(scene, shadow_size=texels)
    whole = made.whole()
    flat = prepare(whole.camera, whole.mesh, "raytrace")
    copies = InstanceTracing(made.scene.camera, made.scene.mesh, made.tile, made.matrices)
    places = [made.matrices, _shifted(made.matrices)]
    vertices = [_vertices(made, matrices) for matrices in places]
    sun, turn = made.scene.lights[0], {"number": 0}
    assert isinstance(sun, DirectionalLight)

    def moved(values: Any) -> Any:
        turn["number"] += 1
        return values[turn["number"] % 2]

    def ours_moving(frame: Callable[[], object]) -> object:
        instances.update(moved(places))
        return frame()

    def flat_moving() -> object:
        flat.update(moved(vertices))
        return flat.frame()

    def copies_moving() -> object:
        copies.place(moved(places))
        return copies.frame()

    def copies_lit() -> object:
        copies.place(moved(places))
        return copies.lit(sun)

    calls: dict[str, Callable[[], object]] = {
        "still": view.seen,
        "still_flat": flat.frame,
        "still_copies": copies.frame,
        "moving": lambda: ours_moving(view.seen),
        "moving_flat": flat_moving,
        "moving_copies": copies_moving,
        "frame": lambda: ours_moving(lit.frame),
        "frame_copies": copies_lit,
    }
    times = timing.measure(calls, count, WARMUP, on_call=on_call)
    found = {f"{name}_ms": 1e3 * one.median for name, one in times.items()}
    return found | {"fps": 1e3 / found["frame_ms"]}


def _shifted(matrices: np.ndarray) -> np.ndarray:
    """All copies a little ahead."""
    found = matrices.copy()
    found[:, :3, 3] += 0.05 * matrices[:, :3, 0]
    return found


def _vertices(made: ReliefScene, matrices: np.ndarray) -> np.ndarray:
    """(V, 3) of the ground and all copies as one mesh."""
    tile = made.tile.vertices
    placed = np.einsum("nij,vj->nvi", matrices[:, :3, :3], tile) + matrices[:, None, :3, 3]
    return np.concatenate([made.scene.mesh.vertices, placed.reshape(-1, 3)])
