"""What an eye sees of a reflector: the points that camera triangles are for."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.checks import three_numbers
from mpcam.decomposition.reflector import Reflector, pixel_hits
from mpcam.errors import InputError

SAMPLES = 60_000
"""Points of the surface that tell what an eye sees, where it is a point."""
SLACK = 2e-3
"""Part of the radius that a point may lie behind the reflector's outline and still count."""
_MOST = 1 << 20


@dataclass(frozen=True, eq=False)
class SeenPoints:
    """Points (N, 3) of a reflector that an eye (3,) sees, with their unit normals (N, 3) and faces (N,).

    whole: the points are all that matter (a camera's pixels), not samples of what is seen.
    """

    eye: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    face: np.ndarray
    whole: bool = False


def eye_point(eye: Any) -> np.ndarray:
    """The point (3,) that rays leave from: the eye itself, or a camera's center. Raises InputError for others."""
    if isinstance(eye, Camera):
        if eye.ray_geometry != "central":
            raise InputError(
                f"the eye is a {type(eye).__name__}, whose rays have no common center: give a point (3,), or a camera "
                "with one"
            )
        return np.asarray(eye.eye, np.float64)
    return three_numbers("eye", eye, ", or a camera")


def view_of(reflector: Reflector, eye: Any) -> SeenPoints:
    """All that an eye sees of a reflector, a little more rather than less: for a camera its pixels, else many points.

    Raises InputError for an eye that sees nothing or lies on the reflector.
    """
    point = eye_point(eye)
    _check_off(reflector, point)
    if isinstance(eye, Camera):
        points, normals, face = _through_pixels(reflector, eye, _MOST)
        what = "no pixel of the camera sees the reflector: turn it, or move it"
    else:
        face, second, third = surface_samples(reflector, SAMPLES)
        keep = reflector.sees(point, on_mesh(reflector, face, second, third), SLACK)
        points, normals = reflector.at(face[keep], second[keep], third[keep])
        face = face[keep]
        what = f"the eye at {np.round(point, 6).tolist()} sees nothing of the reflector: give another point"
    if len(face) == 0:
        raise InputError(what)
    return SeenPoints(point, points, normals, face, isinstance(eye, Camera))


def seen_samples(reflector: Reflector, eye: Any, count: int) -> SeenPoints:
    """About `count` points that an eye surely sees: even over a camera's pixels, else over the surface's area."""
    point = eye_point(eye)
    _check_off(reflector, point)
    if isinstance(eye, Camera):
        points, normals, face = _through_pixels(reflector, eye, _MOST)
        pick = np.unique(np.linspace(0, max(len(face) - 1, 0), min(count, len(face))).astype(int))
        points, normals, face = points[pick], normals[pick], face[pick]
    else:
        wanted = count
        for _ in range(4):
            face, second, third = surface_samples(reflector, wanted)
            points, normals = reflector.at(face, second, third)
            way = point - points
            # Where shading and flat normals disagree about the side, at the outline, no ray is the true one.
            sure = (way * normals).sum(1) * (way * reflector.face_normals[face]).sum(1) > 0
            keep = np.flatnonzero(reflector.sees(point, on_mesh(reflector, face, second, third)) & sure)
            if len(keep) >= 0.9 * count or wanted >= 50 * count:
                break
            wanted = min(int(1.1 * wanted * count / max(len(keep), 1)) + 1, 50 * count)
        keep = keep[np.unique(np.linspace(0, max(len(keep) - 1, 0), min(count, len(keep))).astype(int))]
        points, normals, face = points[keep], normals[keep], face[keep]
    if len(face) == 0:
        raise InputError("the eye sees nothing of the reflector: give another point or camera")
    return SeenPoints(point, points, normals, face)


def surface_samples(reflector: Reflector, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Faces (N,) and weights 2 and 3 (N,) of points that lie evenly over the area; always the same ones."""
    total = np.cumsum(reflector.areas)
    place = (np.arange(count) + 0.5) / count
    face = np.minimum(np.searchsorted(total, place * total[-1], side="right"), len(total) - 1)
    # Two irrational steps, over the plastic number: even whatever part of them falls on a face.
    step = np.arange(1, count + 1)
    x, y = (0.5 + step * 0.7548776662466927) % 1.0, (0.5 + step * 0.5698402909980532) % 1.0
    root = np.sqrt(x)
    return face, root * (1.0 - y), root * y


def _through_pixels(reflector: Reflector, camera: Camera, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (N, 3), normals (N, 3) and faces (N,) that pixels see; of every n-th where there are more than `most`."""
    found = pixel_hits(camera, reflector)
    step = -(-camera.width * camera.height // most)
    hit = np.flatnonzero(found.hit[::step]) * step
    points, normals, along = found.points[hit], found.normals[hit], found.along[hit]
    face = reflector.trace(points - found.distance[hit, None] * along, along)[0]
    beside = face < 0  # the outline of the mesh lies within that of the surface
    face[beside] = reflector.closest(points[beside], normals[beside])[0]
    return points, normals, face


def on_mesh(reflector: Reflector, face: np.ndarray, second: np.ndarray, third: np.ndarray) -> np.ndarray:
    """Points of the mesh itself: analytic ones may lie a little behind the mesh that is traced."""
    weights = np.stack([1.0 - second - third, second, third], axis=1)[..., None]
    return (weights * reflector.vertices[reflector.faces[face]]).sum(axis=1)


def _check_off(reflector: Reflector, point: np.ndarray) -> None:
    """See that an eye does not lie on the reflector."""
    if reflector.radius == 0:
        return
    way = point - reflector.center
    face, second, third = reflector.closest(point[None], way[None] if way.any() else np.ones((1, 3)))
    gap = np.linalg.norm(on_mesh(reflector, face, second, third) - point)
    if gap <= 1e-6 * reflector.radius:
        raise InputError(f"the eye at {np.round(point, 6).tolist()} lies on the reflector: move it away")
