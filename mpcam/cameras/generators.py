"""Directions whose cones hold the rays of a camera triangle, and what bounds images follow on its plane.

Every ray of the triangle runs along a positive combination of its generators. Where they all leave on one side of the
camera plane, the image of a scene triangle lies in the convex hull of its corners, projected along each generator (Hou
et al. 2006, section 2.1; where directions are mixed in sign, that fails, so the whole triangle is the bound).
"""

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

LEAST = 1e-3
"""Generators that leave at a smaller sine to the camera plane bound nothing."""


@dataclass(frozen=True, eq=False)
class PlaneBounds:
    """Bounds of images on the planes of F camera triangles, in pixels along their short sides, (0, 0) at corner 1.

    maps (F, 3, 4): a point (x, y, z, 1) of the camera frame to u, v and the height above the plane. slopes (F, K, 2):
    what to subtract from (u, v) per height, for each generator. state (F,): 1 or -1, the side of the plane that rays
    leave on, 0 where generators bound nothing. lines (F, 3, 2): outward normals of the sides of the paper's bounding
    triangle, unit length; they span the plane.
    """

    maps: np.ndarray
    slopes: np.ndarray
    state: np.ndarray
    lines: np.ndarray


def plane_bounds(camera: Any) -> PlaneBounds:
    """The bounds of a CameraTriangles, in float64."""
    (a, _), (b, _), (c, _) = (tuple(np.asarray(x).T for x in camera.node(i)) for i in range(3))
    last = np.broadcast_to(np.asarray(camera.resolution), (camera.count,))[:, None] - 1.0
    right, down = (b - a) / last, (c - a) / last
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    flat = length[:, 0] <= 1e-12 * np.maximum(np.abs(b - a).max(1), np.abs(c - a).max(1)) ** 2
    normal = normal / np.where(length > 0, length, 1.0)
    frame = np.stack(
        [right, down, np.where(flat[:, None], 1.0, normal)], -1
    )  # columns: one pixel each, one unit of height
    frame[flat] = np.eye(3)
    inverse = np.linalg.inv(frame)
    maps = np.concatenate([inverse, -(inverse @ a[:, :, None])], -1)
    vectors, known = generators(camera)  # (F, K, 3)
    local = np.einsum("fij,fkj->fki", inverse, vectors)
    height = local[..., 2] / np.maximum(np.linalg.norm(vectors, axis=-1), 1e-300)
    usable = known & ~flat & ((height > LEAST).all(1) | (height < -LEAST).all(1))
    steep = np.where(usable[:, None], local[..., 2], 1.0)
    state = np.where(usable, np.sign(local[:, 0, 2]), 0.0)
    return PlaneBounds(maps, local[..., :2] / steep[..., None], state, _lines(camera, right, down, normal, flat))


def generators(camera: Any) -> tuple[np.ndarray, np.ndarray]:
    """Generators (F, K, 3) of the rays of each camera triangle, and where there are any (F,).

    Direct: the three rays. Reflection: the ten control vectors of the direction, a cubic polynomial of the weights.
    Refraction: incident direction + s normal at each corner, for the least and the greatest s in the triangle.
    """
    corners = [tuple(np.asarray(x).T for x in camera.node(i)) for i in range(3)]
    if camera.directions is not None:
        return np.stack([along for _, along in corners], 1), np.ones(camera.count, bool)
    normals = [along for _, along in corners]
    incident = [place - np.asarray(camera.eye) for place, _ in corners]
    if camera.index is None:
        found = []
        for triple in itertools.combinations_with_replacement(range(3), 3):
            total = sum(
                _dot(normals[i], normals[j]) * incident[k] - 2.0 * _dot(incident[k], normals[i]) * normals[j]
                for i, j, k in itertools.permutations(triple)
            )
            found.append(total / 6.0)
        return np.stack(found, 1), np.ones(camera.count, bool)
    low, high, known = _refraction_range(incident, normals, float(camera.index))
    ends = [incident[i] + s[:, None] * normals[i] for i in range(3) for s in (low, high)]
    return np.stack(ends, 1), known


def _refraction_range(incident: list[np.ndarray], normals: list[np.ndarray], index: float) -> Any:
    """Least and greatest s with which incident + s normal runs along the refracted ray, and where that is known.

    With unit i, n (towards the eye) and eta = 1 / index, s = gamma |I| / (eta |N|), gamma = eta cos - sqrt(1 - eta^2
    (1 - cos^2)), which is monotone in the cosine. Bounds of I . N, N . N and I . I come from quadratic control values.
    """

    def quadratic(x: list[np.ndarray], y: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        values = np.stack(
            [
                0.5 * (_dot(x[i], y[j]) + _dot(x[j], y[i]))[:, 0]
                for i, j in itertools.combinations_with_replacement(range(3), 2)
            ]
        )
        return values.min(0), values.max(0)

    across, normal, along = quadratic(incident, normals), quadratic(normals, normals), quadratic(incident, incident)
    away = across[0] > 0  # normals that point away from the eye
    known = (away | (across[1] < 0)) & (normal[0] > 0) & (along[0] > 0)
    safe = [np.where(known, values, 1.0) for values in (*normal, *along)]
    nearest = np.where(away, across[0], -across[1])
    farthest = np.where(away, across[1], -across[0])
    cosine = [
        np.clip(np.where(known, nearest, 1.0) / np.sqrt(safe[1] * safe[3]), 0.0, 1.0),
        np.clip(np.where(known, farthest, 1.0) / np.sqrt(safe[0] * safe[2]), 0.0, 1.0),
    ]
    eta = 1.0 / index
    under = 1.0 - eta * eta * (1.0 - cosine[0] ** 2)
    known = known & (under > 0)
    gamma = [eta * c - np.sqrt(np.maximum(0.0, 1.0 - eta * eta * (1.0 - c * c))) for c in cosine]
    ratios = [np.sqrt(safe[2] / safe[1]) / eta, np.sqrt(safe[3] / safe[0]) / eta]
    products = np.stack([g * r for g in gamma for r in ratios])
    low, high = products.min(0), products.max(0)
    return np.where(away, -high, low), np.where(away, -low, high), known


def _lines(camera: Any, right: np.ndarray, down: np.ndarray, normal: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """Outward normals of the paper's bounding triangle: along the rays' parts in the plane, with the sign that closes
    it.

    The paper leaves the signs out: the half-planes bound a triangle only if some positive combination of the outward
    normals vanishes. Where two rays' parts are nearly parallel, the sides of the camera triangle take their place.
    """
    parts = []
    for i in range(3):
        place, along = (np.asarray(x).T for x in camera.node(i))
        ray = np.asarray(camera.bend(place.T, along.T)[0]).T
        ray = ray / np.maximum(np.linalg.norm(ray, axis=1, keepdims=True), 1e-300)
        inside = ray - _dot(ray, normal) * normal
        # The same line in pixels: its normal's inner products with the pixel's two sides.
        line = np.stack([_dot(inside, right)[:, 0], _dot(inside, down)[:, 0]], -1)
        parts.append(line / np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-300))
    turns = np.stack(
        [_turn(parts[(i + 1) % 3], parts[(i + 2) % 3]) for i in range(3)], 1
    )  # sum of turns[i] parts[i] is 0
    sides = np.array([[1.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]) / np.array([[np.sqrt(2.0)], [1.0], [1.0]])
    poor = (np.abs(turns).min(1) < 0.05) | flat
    signed = np.stack(parts, 1) * np.sign(turns)[..., None]
    return np.where(poor[:, None, None], sides, signed)


def _dot(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (x * y).sum(-1, keepdims=True)


def _turn(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]
