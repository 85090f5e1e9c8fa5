"""Bounds of camera triangles: every pixel that a triangle covers must be tested, whatever the rays.

The oracle tests every pixel against every triangle, without any bound; what counts are the pairs that hit.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mpcam.backend import types
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.triangle_nodes import EDGES
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.general import GeneralRasterizer
from mpcam.rendering.registry import RAY_BOUNDS as BOUNDS
from mpcam.stress.report import StressRow

SIDE, FACES, TRIANGLES = 20, 10, 2000
"""Pixels along the short sides of a camera triangle, camera triangles of a camera, and scene triangles before it."""
KINDS = (
    *("positive", "mixed signs", "grazing", "parallel", "concurrent", "mirror", "lens", "tiny triangles", "needles"),
    *("curved", "curved mirror", "curved lens"),
)


def bound_rows(kind: str, pairs: int) -> list[StressRow]:
    """One row per bound; pairs: of a camera triangle and a scene triangle, about. Curved ones have one bound."""
    missed, tried = dict.fromkeys(("tight",) if kind.startswith("curved") else BOUNDS, 0), 0
    for camera, mesh in scenes(kind, max(1, pairs // (FACES * TRIANGLES))):
        true = pairs_that_hit(camera, mesh)
        tried += camera.count * mesh.triangle_count
        for bound in missed:
            missed[bound] += abs(true - GeneralRasterizer(camera, mesh, bound).frame().stats.rendered)
    return [
        StressRow("random", f"bounds, {bound}, {kind}", "float32", tried, float("nan"), count, 0)
        for bound, count in missed.items()
    ]


def scenes(kind: str, rounds: int, seed: int = 0) -> Iterator[tuple[CameraTriangles, Mesh]]:
    """Random camera triangles of a kind, with triangles of all sizes around them, most of them on their rays."""
    rng = np.random.default_rng([seed, KINDS.index(kind)])
    faces = np.arange(3 * FACES).reshape(FACES, 3)
    for _ in range(rounds):
        center = rng.normal(size=(FACES, 1, 3))
        corners = center + 10 ** rng.uniform(-1, 0.3, (FACES, 1, 1)) * rng.normal(size=(FACES, 3, 3))
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, None]
        normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        vertices = corners.reshape(-1, 3)
        if kind.startswith("curved"):
            camera = _curved(kind, rng, corners, normal)
        elif kind in ("mirror", "lens"):
            bulge = normal + rng.uniform(0, 0.8, (FACES, 1, 1)) * rng.normal(size=(FACES, 3, 3))
            index = None if kind == "mirror" else rng.uniform(0.6, 1.7)
            camera = CameraTriangles(
                vertices, faces, normals=bulge.reshape(-1, 3), eye=4 * rng.normal(size=3), index=index, resolution=SIDE
            )
        else:
            camera = CameraTriangles(
                vertices, faces, directions=_directions(kind, rng, corners, normal), resolution=SIDE
            )
        yield camera, _triangles(kind, rng, camera)


def _curved(kind: str, rng: np.random.Generator, corners: np.ndarray, normal: np.ndarray) -> CameraTriangles:
    """Camera triangles of degree 2, from nearly flat to folded over."""
    bent = 10 ** rng.uniform(-2, 0, (FACES, 1, 1))
    edges = np.linalg.norm(corners - corners[:, [1, 2, 0]], axis=-1).mean(axis=1)[:, None, None]
    middle = corners[:, EDGES].mean(axis=2) + 0.3 * bent * edges * rng.normal(size=(FACES, 3, 3))
    vertices = np.concatenate([corners, middle], axis=1).reshape(-1, 3)
    values = (normal + bent * rng.normal(size=(FACES, 6, 3))).reshape(-1, 3)
    given: dict[str, Any] = {"directions": values}
    if kind != "curved":
        given = {"normals": values, "eye": 4 * rng.normal(size=3)}
        given["index"] = rng.uniform(0.6, 1.7) if kind == "curved lens" else None
    faces = np.arange(6 * FACES).reshape(FACES, 6)
    return CameraTriangles(vertices, faces, **given, degree=2, resolution=SIDE)


def _directions(kind: str, rng: np.random.Generator, corners: np.ndarray, normal: np.ndarray) -> np.ndarray:
    spread = rng.normal(size=corners.shape)
    if kind == "mixed signs":
        return spread.reshape(-1, 3)
    if kind == "parallel":
        return (normal + 0.5 * rng.normal(size=normal.shape) + 0 * spread).reshape(-1, 3)
    if kind == "concurrent":
        goal = corners.mean(axis=1, keepdims=True) + rng.uniform(0.3, 3, (FACES, 1, 1)) * normal
        return (goal - corners).reshape(-1, 3)
    inside = spread - (spread * normal).sum(-1, keepdims=True) * normal
    height = 1e-3 if kind == "grazing" else 1.0
    return (inside + height * rng.uniform(0.2, 1, (FACES, 3, 1)) * normal).reshape(-1, 3)


def _triangles(kind: str, rng: np.random.Generator, camera: CameraTriangles) -> Mesh:
    """Triangles around points on rays of the camera, to both sides of it."""
    second, third = rng.uniform(0, 1, (2, TRIANGLES))
    over = second + third > 1
    second, third = np.where(over, 1 - second, second), np.where(over, 1 - third, third)
    origin, along, _ = camera.ray_at(rng.integers(0, camera.count, TRIANGLES), second, third)
    along = along / np.maximum(np.linalg.norm(along, axis=0), 1e-12)
    center = (origin + rng.uniform(-0.5, 4, TRIANGLES) * along).T[:, None]
    low, high = (-4, -1.5) if kind == "tiny triangles" else (-2, 0.5)
    size = 10 ** rng.uniform(low, high, (TRIANGLES, 1, 1)) * rng.normal(size=(TRIANGLES, 3, 3))
    if kind == "needles":
        size[:, 2] = size[:, 1] * (1 + 1e-3 * rng.normal(size=(TRIANGLES, 1)))
    return Mesh((center + size).reshape(-1, 3), np.arange(3 * TRIANGLES).reshape(-1, 3))


def pairs_that_hit(camera: CameraTriangles, mesh: Mesh) -> int:
    """How many pairs of a pixel and a triangle hit: each tested against each, by the kernels' own test."""
    import drjit as dr

    from mpcam_kernels import plucker
    from mpcam_kernels.poses import placed

    t = types()
    prepared = GeneralRasterizer(camera, mesh)
    rays, vertices, faces = prepared.rays.blocks.rays, prepared.vertices, prepared.faces
    slot = dr.arange(t.UInt, dr.width(rays.rows.flat) // 8)
    each = rays.at(t, slot)

    def step(number: Any, hits: Any) -> tuple[Any, Any]:
        corners = [dr.gather(t.UInt, faces, number * 3 + k) for k in range(3)]
        points = (placed(t, prepared.pose, dr.gather(t.Array3f, vertices, corner)) for corner in corners)
        shape = plucker.setup(*points)
        covered = plucker.inside(shape, each) & shape.usable
        return number + 1, hits + dr.select(covered, t.UInt(1), 0)

    count = mesh.triangle_count
    start = t.UInt(0) + slot * 0, t.UInt(0) + slot * 0
    _, hits = dr.while_loop(start, lambda number, hits: number < count, step)
    total: Any = dr.sum(t.UInt64(hits))
    return int(total[0])
