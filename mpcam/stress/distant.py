"""Narrow views of the unit sphere from far away, where rounding of the eye's place is large against the scene.

The truth is in closed form: a ray that passes nearer to the center than every triangle's plane hits the mesh, and one
that passes outside of the sphere through the corners does not. Pixels between are near an edge, and either is right.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends
from mpcam.cameras.types import Ray
from mpcam.math.pose import look_at
from mpcam.stress.report import Case, StressRow

DISTANCES = (100.0, 300.0, 1000.0)
"""Of the eye from the center of the scene, in half-extents of the scene."""

WIDTHS = (1.2, 0.3, 0.05)
"""Half of what the image shows at the center of the scene, in half-extents: more than all of it, and parts."""

SIZE, TRIANGLES = 256, 20480

APART = "a face far away"
PLACE = (448262.0, 5411933.0, 118.0)
"""Map coordinates, as surveys have them: float32 tells them apart to half a unit."""
FACES = (
    ((0.0, 0.0, 0.0),) * 3,
    ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
    ((1e9, 0.0, 1e9), (0.0, 1e9, 1e9), (1e9, 1e9, 0.0)),
)
"""Corners of faces of no area, of usual size, and huge."""

Factory = Callable[[float, float], Camera]
"""Of a distance and a half width: a camera that far away, with an image that shows about that much to each side."""


def pose(distance: float) -> np.ndarray:
    """camera_from_world of an eye that looks at the origin from so far, along no axis."""
    return look_at(eye=distance * np.array([0.6, 0.64, 0.48]), target=(0, 0, 0))


def focal_length(distance: float, width: float) -> float:
    """Pixels per unit of the tangent for an image of SIZE pixels that shows `width` to each side."""
    return 0.5 * SIZE * distance / width


def distant_cases(factory: Factory) -> list[Case]:
    """One case for each distance, over all widths, at any orientation; for every camera that can be rasterized."""
    cases: list[Case] = [(f"distant eyes, {d:g}", partial(_rows, factory, d)) for d in DISTANCES]
    return [*cases, (APART, partial(_apart, factory))]


def _rows(factory: Factory, distance: float) -> list[StressRow]:
    counts = np.sum([distant(factory(distance, width), distance) for width in WIDTHS], axis=0)
    pixels, missed, invented = map(int, counts)
    return [StressRow("distant", f"distant eyes, {distance:g}", "float32", pixels, float("nan"), missed, invented)]


def _apart(factory: Factory) -> list[StressRow]:
    """The scene at map coordinates, with one more face that is far away and out of view."""
    camera, counts = factory(10.0, WIDTHS[0]), np.zeros(3, int)
    pose = np.array(camera.camera_from_world, np.float64)
    pose[:3, 3] -= pose[:3, :3] @ np.array(PLACE)
    there = camera.with_pose(pose)
    for corners in FACES:
        counts += distant(there, 10.0, PLACE, corners)
    return [StressRow("distant", APART, "float32", int(counts[0]), float("nan"), int(counts[1]), int(counts[2]))]


def distant(
    camera: Camera,
    distance: float,
    place: tuple[float, float, float] = (0.0, 0.0, 0.0),
    face: tuple[tuple[float, float, float], ...] = (),
) -> tuple[int, int, int]:
    """Pixels that are sure, missed, and invented or at a wrong depth; by `invert`, of the unit sphere's mesh.

    place: of its middle. face: the corners of one more face in the world, out of view.
    """
    from mpcam.geometry.builtin import builtin_mesh
    from mpcam.geometry.mesh import Mesh
    from mpcam.rendering.methods import rasterize

    mesh = builtin_mesh("sphere", triangles=TRIANGLES)
    a, b, c = np.moveaxis(np.asarray(mesh.corners), 1, 0)
    normals = np.cross(b - a, c - a)
    inner = float(np.min(np.abs((normals * a).sum(1)) / np.linalg.norm(normals, axis=1)))
    outer = float(np.linalg.norm(mesh.vertices, axis=1).max())
    slack = 1e-6 * distance  # what float32 makes of points so far away

    there = Mesh(mesh.vertices + place, mesh.faces)
    if face:
        there = Mesh.concatenate([there, Mesh(face, [(0, 1, 2)])])
    hits = rasterize(camera, there)
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    found, depth = np.asarray(hits.triangle) >= 0, np.asarray(hits.depth, np.float64)
    inside, off, outside = np.zeros(u.shape, bool), np.zeros(u.shape, bool), np.ones(u.shape, bool)
    for ray, start, end in _pieces(camera, np.stack([u, v], -1)):
        origin, direction = np.asarray(ray.origin) - place, np.asarray(ray.direction)
        nearest = -(origin * direction).sum(-1)
        passing = np.linalg.norm(origin + nearest[..., None] * direction, axis=-1)
        half = np.sqrt(np.maximum(outer**2 - passing**2, 0)), np.sqrt(np.maximum(inner**2 - passing**2, 0))
        length = end - start
        # The first hit is sure where the piece reaches it, from outside, and nothing is where it stays outside.
        through = ray.valid & (passing < inner - slack) & (nearest > half[0] + slack) & (nearest - half[1] < length)
        closest = np.clip(nearest, 0, np.where(ray.valid, length, 0))
        away = np.linalg.norm(origin + closest[..., None] * direction, axis=-1)
        first = through & outside  # no piece before it came near
        near, far = (start + nearest - part for part in half)
        off |= found & first & ((depth < near - slack) | (depth > far + slack))
        inside, outside = inside | through, outside & (~ray.valid | (away > outer + slack))
    return int((inside | outside).sum()), int((inside & ~found).sum()), int((outside & found).sum() + off.sum())


def _pieces(camera: Camera, pixel: np.ndarray) -> list[tuple[Ray, np.ndarray, np.ndarray]]:
    """The straight pieces of the rays of pixels, in order, with the lengths at which they start and end."""
    if not isinstance(camera, Bends):
        ray = camera.ray(pixel)
        return [(ray, np.zeros(ray.valid.shape), np.full(ray.valid.shape, np.inf))]
    given = camera.ray_pieces(pixel)
    along = range(np.shape(given.start)[-1])
    rays = [Ray(given.origin[..., k, :], given.direction[..., k, :], given.valid[..., k]) for k in along]
    return [(ray, given.start[..., k], given.end[..., k]) for k, ray in enumerate(rays)]
