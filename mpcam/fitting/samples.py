"""True rays that a fit goes by, and others that it never sees: even over an eye's pixels, or over the surface."""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.border import Border
from mpcam.decomposition.ray_error import vertex_normals
from mpcam.decomposition.reflector import Reflector, pixel_hits
from mpcam.decomposition.shooting import Locator, Place
from mpcam.decomposition.views import SeenPoints, eye_point, seen_samples
from mpcam.errors import InputError

HELD_OUT = 5
"""One pixel in so many is kept for the test."""
_STRIP = 0.2
"""Part of a triangle's longest edge that the reflector's border may lie beyond the triangle's."""


class Split(NamedTuple):
    """What is fitted, and what tests the fit."""

    fitted: SeenPoints
    held_out: SeenPoints


def split_samples(reflector: Reflector, eye: Any, count: int, test: int, seed: int) -> Split:
    """About `count` points to fit and `test` others, always the same for a seed.

    With a camera: in its pixels that see the reflector and those beside them, at places within each that a seed
    shifts; every fifth pixel is held out whole. With a point: even over the surface that it sees. Raises InputError for
    an eye that sees nothing.
    """
    if not isinstance(eye, Camera):
        return _over_the_surface(reflector, eye, count, test, seed)
    pixels = _pixels_around(pixel_hits(eye, reflector).hit.reshape(eye.height, eye.width))
    held = (pixels[:, 0] + 2 * pixels[:, 1]) % HELD_OUT == 0
    parts = []
    for chosen, wanted in ((pixels[~held], count), (pixels[held], test)):
        parts.append(_through(reflector, eye, chosen if len(chosen) else pixels, wanted, seed))
    if not all(len(part.points) for part in parts):
        raise InputError("the eye sees nothing of the reflector: give another point or camera")
    return Split(*parts)


def held_by(cams: CameraTriangles, reflector: Reflector, view: SeenPoints) -> tuple[SeenPoints, Place]:
    """Those of the points that camera triangles in the world are there for, and where they lie in them.

    `decompose` leaves triangles out that hold no pixel's center. What is seen of them between the centers has no ray,
    and the nearest one is far off: a few such points would outweigh all others. Points beyond a border that is the
    reflector's own count, at the nearest place.
    """
    found = Locator(cams.vertices, vertex_normals(cams, reflector), cams.faces).locate(view.points, view.normals)
    kept, rows = found.inside.copy(), np.flatnonzero(~found.inside)
    border = Border(reflector) if len(rows) else None
    if border is not None and border.count:
        corners = cams.vertices[cams.faces[found.face[rows], :3]]
        longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
        kept[rows] = border.nearest(view.points[rows])[0] <= _STRIP * longest
    if not kept.any():
        return view, found
    points = SeenPoints(view.eye, view.points[kept], view.normals[kept], view.face[kept], view.whole)
    return points, Place(found.face[kept], found.second[kept], found.third[kept], found.inside[kept])


def _pixels_around(hit: np.ndarray) -> np.ndarray:
    """(P, 2) columns and rows of pixels that see the reflector, and of their neighbors: its outline is in between."""
    near = np.pad(hit, 1)
    near = near[1:-1, 1:-1] | near[:-2, 1:-1] | near[2:, 1:-1] | near[1:-1, :-2] | near[1:-1, 2:]
    row, column = np.nonzero(near)
    return np.stack([column, row], axis=1)


def _through(reflector: Reflector, eye: Camera, pixels: np.ndarray, count: int, seed: int) -> SeenPoints:
    """Up to `count` points that places within pixels see, each pixel as often as the others."""
    if not len(pixels):
        return SeenPoints(eye_point(eye), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.int32))
    shift = np.random.default_rng(seed).random(2)
    step = np.arange(count)
    # Two irrational steps, over the plastic number: even over the square of each pixel too.
    inner = (shift + np.stack([step * 0.7548776662466927, step * 0.5698402909980532], axis=1)) % 1.0
    ray = eye.ray(pixels[(step * len(pixels)) // count] + inner)
    valid = np.asarray(ray.valid)
    found = reflector.first_hits(ray.origin, np.where(valid[:, None], ray.direction, (0.0, 0.0, 1.0)))
    good = found.hit & valid
    points, normals = found.points[good], found.normals[good]
    return SeenPoints(eye_point(eye), points, normals, np.zeros(len(points), np.int32))


def _over_the_surface(reflector: Reflector, eye: Any, count: int, test: int, seed: int) -> Split:
    view = seen_samples(reflector, eye, count + test)
    chosen = np.random.default_rng(seed).permutation(len(view.points))
    part = max(len(chosen) * test // (count + test), 1)
    held, kept = np.sort(chosen[:part]), np.sort(chosen[part:])
    if not len(kept):
        held = kept = chosen
    return Split(*(SeenPoints(view.eye, view.points[i], view.normals[i], view.face[i]) for i in (kept, held)))
