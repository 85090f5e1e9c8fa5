"""How far the image of a point jumps where it crosses from one camera triangle to its neighbor."""

from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles

ALONG = (0.2, 0.4, 0.6, 0.8)
"""Places on each common edge."""
_STEPS, _STEP = 30, 1e-6
_FORWARD = 0.05
"""Least part of a ray's direction in its neighbor's at the same point: beside it, they leave to other sides."""


def seam_jumps(cams: CameraTriangles, eye: Camera, distance: float) -> np.ndarray:
    """(N,) pixels of the eye's picture by which images of points jump at common edges of camera triangles.

    At places on each common edge the ray of one side is followed for a distance (scene units), to a point whose image
    on that side is this very place. The jump is how far from it the other side, continued beyond the edge, has its
    image of the point, as the eye sees both. NaN where the other side has none nearby. Cameras in the world frame.
    """
    one, other, ends = _common_edges(cams.faces)
    if not len(one):
        return np.zeros(0)
    part = np.tile(np.array(ALONG), len(one))
    one, other, ends = (np.repeat(table, len(ALONG), axis=0) for table in (one, other, ends))
    mine, theirs = (_weights(cams.faces[face], ends, part) for face in (one, other))
    start, along, _ = cams.ray_at(one, *mine)
    point = np.asarray(start) + distance * _unit(np.asarray(along))
    pixel = _seen(eye, np.asarray(start))
    found, good = _image(cams, other, theirs, point, distance)
    forward = (_unit(np.asarray(cams.ray_at(other, *theirs)[1])) * _unit(np.asarray(along))).sum(axis=0)
    jump = np.linalg.norm(_seen(eye, np.asarray(cams.ray_at(other, *found)[0])) - pixel, axis=1)
    return np.where(good & (forward > _FORWARD), jump, np.nan)


def _common_edges(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Both triangles of each edge that has two, and its ends (E, 2)."""
    edges = np.sort(faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    owner = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    edges, owner = edges[order], owner[order]
    same = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    return owner[same], owner[same + 1], edges[same]


def _weights(corners: np.ndarray, ends: np.ndarray, part: np.ndarray) -> np.ndarray:
    """(2, N) weights of corners 2 and 3 of triangles (N, 3) at places between two of their corners."""
    first, second = ends[:, :1], ends[:, 1:]
    weights = np.where(corners == first, 1 - part[:, None], 0.0) + np.where(corners == second, part[:, None], 0.0)
    return weights[:, 1:].T


def _image(
    cams: CameraTriangles, face: np.ndarray, weights: np.ndarray, point: np.ndarray, reach: float
) -> tuple[np.ndarray, np.ndarray]:
    """Weights (2, N) of the ray of each camera triangle, or its continuation, that meets a point; by Newton steps."""
    weights = np.array(weights)

    def missed(w: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        start, along, _ = (np.asarray(part) for part in cams.ray_at(face, *w))
        return start + t * along - point, along

    t = reach / np.linalg.norm(np.asarray(cams.ray_at(face, *weights)[1]), axis=0)
    with np.errstate(all="ignore"):
        for _ in range(_STEPS):
            error, along = missed(weights, t)
            sides = [missed(weights + _STEP * unit, t)[0] - error for unit in np.eye(2)[:, :, None]]
            matrix = np.stack([sides[0] / _STEP, sides[1] / _STEP, along], axis=-1).transpose(1, 0, 2)
            step = -(np.linalg.pinv(matrix) @ error.T[:, :, None])[:, :, 0].T
            weights, t = weights + step[:2], t + step[2]
        error = np.linalg.norm(missed(weights, t)[0], axis=0)
    return weights, (error < 1e-6 * reach) & (t > 0) & (np.abs(weights) < 5).all(axis=0)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (3, N) of length 1."""
    return vectors / np.linalg.norm(vectors, axis=0)


def _seen(eye: Camera, points: np.ndarray) -> np.ndarray:
    """Pixels (N, 2) of points (3, N)."""
    seen: Any = eye.project(points.T)
    return np.asarray(seen.pixel).reshape(len(points.T), -1, 2)[:, 0]
