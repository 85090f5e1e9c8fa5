"""Normal shooting: which point of the true surface belongs to which of the camera triangles (Sander et al. 2000).

Forward, a ray along the interpolated normal meets the fine surface. Backward, a fine point X = p(w) + c N(w) is found
by Newton's method in the triangle where it is looked for; where a weight comes out negative, the neighbor across that
edge is next. The weights outside of a triangle say where to go, and c = 0 is near the root wanted, so that no other
root of the cubic needs to be found and told apart; and a walk of a step or two from the nearest sample of the camera
triangles serves however coarse or fine either surface is, where a fine face may straddle many camera triangles.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from mpcam.cameras.triangle_nodes import mixed, sides, weights
from mpcam.decomposition.reflector import Reflector

INSIDE = 1e-9
"""Weights so little below zero count as zero."""
_STEPS = 12
_SAMPLES = 30_000
_CANDIDATES = 24


@dataclass(frozen=True)
class Shot:
    """Points of the true surface: face (N,), weights second and third (N,), points (N, 3), unit normals (N, 3)."""

    face: np.ndarray
    second: np.ndarray
    third: np.ndarray
    points: np.ndarray
    normals: np.ndarray


def shoot(reflector: Reflector, points: np.ndarray, normals: np.ndarray) -> Shot:
    """The true surface beside points (N, 3), along normals (N, 3): the nearest hit either way that faces the same way.

    Where neither ray meets such a face, the closest point on that side takes its place (Sander et al. 2000).
    """
    count, size = len(points), reflector.radius or 1.0
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    best = np.full(count, np.inf)
    face, second, third = np.full(count, -1), np.zeros(count), np.zeros(count)
    for side in (1.0, -1.0):
        way, behind = side * unit, np.full(count, -1e-4 * size)  # a little back: the point may lie on the surface
        left = np.arange(count)
        for _ in range(4):  # through faces that look the other way
            hit, distance, w2, w3 = reflector.trace(points[left] + behind[left, None] * way[left], way[left])
            place = behind[left] + distance
            met = (hit >= 0) & (np.abs(place) < best[left])
            facing = met.copy()
            facing[met] = (_shading(reflector, hit[met], w2[met], w3[met]) * unit[left[met]]).sum(1) > 0
            rows = left[facing]
            best[rows], face[rows] = np.abs(place[facing]), hit[facing]
            second[rows], third[rows] = w2[facing], w3[facing]
            wrong = met & ~facing
            behind[left[wrong]] = place[wrong] + 1e-5 * size
            left = left[wrong]
            if len(left) == 0:
                break
    missed, along = np.flatnonzero(face < 0), unit
    if len(missed):
        along = unit.copy()
        face[missed], second[missed], third[missed] = reflector.closest(points[missed], unit[missed])
        along[missed] = _shading(reflector, face[missed], second[missed], third[missed])
    found, true_normals = reflector.at(face, second, third, along)
    return Shot(face, second, third, found, true_normals)


def _shading(reflector: Reflector, face: np.ndarray, second: np.ndarray, third: np.ndarray) -> np.ndarray:
    weights = np.stack([1.0 - second - third, second, third], axis=1)[..., None]
    return (weights * reflector.normals[reflector.faces[face]]).sum(axis=1)


@dataclass(frozen=True)
class Place:
    """Where points lie in camera triangles: face (N,), weights second and third (N,), inside (N,).

    Points beyond the border of an open mesh have the nearest place on it, and inside is False.
    """

    face: np.ndarray
    second: np.ndarray
    third: np.ndarray
    inside: np.ndarray


class Locator:
    """Finds the camera triangle and the weights of points of the true surface: the inverse of `shoot`.

    vertices (V, 3), normals (V, 3), faces (F, 3), or (F, 6) for degree 2: the camera triangles.
    """

    def __init__(self, vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray):
        self.vertices, self.faces = np.asarray(vertices, np.float64), np.asarray(faces)
        self.normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        used = self.vertices[self.faces].reshape(-1, 3)
        self.center, self.size = used.mean(axis=0), float(np.ptp(used, axis=0).max()) or 1.0
        self.neighbors = neighbors(self.faces[:, :3])
        side = int(np.clip(np.sqrt(_SAMPLES / len(faces)), 2, 40))
        i, j = (v.ravel() for v in np.meshgrid(np.arange(side), np.arange(side), indexing="ij"))
        # Centers of the upright and of the reversed cells of a triangular grid.
        upright, reversed_ = i + j < side, i + j < side - 1
        second = np.concatenate([i[upright] + 1 / 3, i[reversed_] + 2 / 3]) / side
        third = np.concatenate([j[upright] + 1 / 3, j[reversed_] + 2 / 3]) / side
        parts = np.stack(weights(second, third, self.faces.shape[1]), axis=1)
        places = np.einsum("kc,fcx->fkx", parts, self.vertices[self.faces]).reshape(-1, 3)
        ways = np.einsum("kc,fcx->fkx", parts, self.normals[self.faces]).reshape(-1, 3)
        self._owner = np.repeat(np.arange(len(faces)), len(parts))
        self._tree = KDTree(self._features(places, ways))

    def _features(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Places, and sides that they look to, so that the other face of a thin sheet is far."""
        length = np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
        return np.concatenate([(points - self.center) / self.size, 0.25 * normals / length], axis=1)

    def locate(self, points: np.ndarray, normals: np.ndarray) -> Place:
        """Camera triangles and weights of points (N, 3) with true normals (N, 3)."""
        count = len(points)
        features = self._features(points, normals)
        face = self._owner[self._tree.query(features)[1]] if count else np.zeros(0, np.int64)
        second, third, inside = np.zeros(count), np.zeros(count), np.zeros(count, bool)
        left = np.arange(count)
        for _ in range(_STEPS):
            w2, w3, solved = self._solved(face[left], points[left])
            inner = np.stack([1.0 - w2 - w3, w2, w3], axis=1)
            done = solved & (inner.min(axis=1) >= -INSIDE)
            second[left], third[left], inside[left] = w2, w3, done
            # Across the edge opposite to the most negative weight that has a neighbor.
            beyond = self.neighbors[face[left]]
            step = np.where((inner < -INSIDE) & (beyond >= 0), inner, np.inf)
            edge = step.argmin(axis=1)
            row = np.arange(len(left))
            go = ~done & np.isfinite(step[row, edge])
            face[left[go]] = beyond[row[go], edge[go]]
            left = left[go]
            if len(left) == 0:
                break
        lost = np.flatnonzero(~inside)
        if len(lost):
            self._searched(lost, points, features, face, second, third, inside)
        inner = np.maximum(np.stack([1.0 - second - third, second, third], axis=1), 0.0)
        inner = inner / inner.sum(axis=1, keepdims=True)
        return Place(face.astype(np.int32), inner[:, 1], inner[:, 2], inside)

    def _searched(self, lost, points, features, face, second, third, inside) -> None:
        """For points that no walk found: the candidate nearby that holds them, or else comes nearest to it."""
        near = min(_CANDIDATES, len(self._owner))
        candidates = self._owner[self._tree.query(features[lost], near)[1].reshape(len(lost), near)]
        candidates = np.sort(np.concatenate([face[lost, None], candidates], axis=1), axis=1)
        fresh = np.concatenate([np.ones((len(lost), 1), bool), np.diff(candidates, axis=1) != 0], axis=1)
        rows, columns = np.nonzero(fresh)
        faces = candidates[rows, columns]
        w2, w3, solved = self._solved(faces, points[lost[rows]])
        inner = np.maximum(np.stack([1.0 - w2 - w3, w2, w3], axis=1), 0.0)
        within = solved & (np.minimum(np.minimum(w2, w3), 1.0 - w2 - w3) >= -INSIDE)
        inner = inner / inner.sum(axis=1, keepdims=True)
        parts = np.stack(weights(inner[:, 1], inner[:, 2], self.faces.shape[1]), axis=1)
        gap = np.linalg.norm((parts[..., None] * self.vertices[self.faces[faces]]).sum(1) - points[lost[rows]], axis=1)
        order = np.lexsort((gap, ~within, rows))
        first = order[np.concatenate([[True], np.diff(rows[order]) != 0])]
        face[lost], inside[lost] = faces[first], within[first]
        second[lost], third[lost] = inner[first, 1], inner[first, 2]

    def _solved(self, face: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Weights 2 and 3 with p(w) + c N(w) = point, also outside of the triangle, and whether they were found."""
        places, normals = (
            [table[column].T for column in self.faces[face].T] for table in (self.vertices, self.normals)
        )
        second, third, away = np.full(len(face), 1 / 3), np.full(len(face), 1 / 3), np.zeros(len(face))
        with np.errstate(all="ignore"):
            for _ in range(7):
                along = mixed(normals, second, third)
                miss = mixed(places, second, third) + away * along - points.T
                (e2, e3), (m2, m3) = (sides(values, second, third) for values in (places, normals))
                j2, j3 = e2 + away * m2, e3 + away * m3
                across = _cross(j3, along)
                volume = (j2 * across).sum(0)
                step2, step3 = (miss * across).sum(0) / volume, (miss * _cross(along, j2)).sum(0) / volume
                step = (miss * _cross(j2, j3)).sum(0) / volume
                second, third = np.clip(second - step2, -4, 5), np.clip(third - step3, -4, 5)
                away = away - step
            solved = np.abs(step2) + np.abs(step3) < 1e-6  # pyright: ignore[reportPossiblyUnboundVariable]
        good = np.isfinite(second) & np.isfinite(third)
        return np.where(good, second, 1 / 3), np.where(good, third, 1 / 3), solved & good


def neighbors(faces: np.ndarray) -> np.ndarray:
    """(F, 3) the face across the edge opposite to each corner, -1 at borders and where three or more faces meet."""
    count = len(faces)
    ends = np.sort(np.stack([faces[:, [1, 2]], faces[:, [2, 0]], faces[:, [0, 1]]], axis=1).reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    fresh = np.concatenate([[True], (np.diff(ends[order], axis=0) != 0).any(axis=1)])
    start = np.flatnonzero(fresh)
    lengths = np.diff(np.append(start, 3 * count))
    first = order[start[lengths == 2]]
    other = order[start[lengths == 2] + 1]
    result = np.full(3 * count, -1)
    result[first], result[other] = other // 3, first // 3
    return result.reshape(count, 3)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products, components first."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
