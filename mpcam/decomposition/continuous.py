"""Continuous camera triangles that are nearly general linear and follow the true rays: both fitted together.

Shared lengths alone make camera triangles nearly general linear, at two to seven times the error of their rays. Here
directions and lengths of the rays at the vertices are free together: least squares of the errors of rays in two planes,
and of how far the rays of each triangle are from one common part along its normal. The weight of the second goes down
until the rays are good enough. Vertices stay where they are, so that each point keeps its place in its triangle, and
neighbors share the rays of their edge: there is no seam.
"""

import dataclasses
from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.crossing import FAR, NEAR, crossing
from mpcam.decomposition.ray_error import bent
from mpcam.decomposition.reflector import Reflector
from mpcam.decomposition.shared_lengths import GRAZING, slants, with_shared_lengths
from mpcam.decomposition.shooting import Locator
from mpcam.decomposition.views import SeenPoints, seen_samples

GOAL, ENOUGH = 0.7, 0.99
"""Errors of rays, over those of unit directions: where to stop, and what will do if the spread would grow too large."""
SPREAD = 0.03
"""Median spread (see `shared_lengths.spread`) from which on `ENOUGH` is enough."""
_WEIGHTS = 1000.0 * 2.0 ** (-0.5 * np.arange(28))
"""Of the squared spread over that of the relative error."""
_TOLERATED = 0.03
"""Spreads above this count less and less (Cauchy's weights): a few triangles of saddles cannot be general linear."""
_SAMPLES, _PER_TRIANGLE = 20_000, 40
_STEPS, _TRIES = 8, 6
_STILL = 3e-3
"""Relative gain of a step below which the next weight comes."""
_PULL = 1e-5
"""Of the median diagonal: draws rays that no sample decides about to where they were."""
_LEAST = 0.05


class _Samples(NamedTuple):
    """True rays beside camera triangles: face (N,), weights of its corners (N, 3), places on it, true points and true
    unit directions (N, 3), planes' distances, and the errors (2,) of unit directions there, root mean square.
    """

    face: np.ndarray
    weights: np.ndarray
    places: np.ndarray
    points: np.ndarray
    true: np.ndarray
    distances: tuple[float, float]
    unit: np.ndarray


def continuous(cams: CameraTriangles, direct: CameraTriangles, reflector: Reflector, eye: Any) -> CameraTriangles:
    """The camera triangles `direct` with rays and lengths (ray_scale "near_far") that are fitted as above.

    cams: the same with normals. eye: a point (3,) or a camera, as for `decompose`. Where the rays of no triangle have
    enough of a part along its normal, or those of unit directions are exact, lengths are shared and nothing is fitted.
    """
    start = with_shared_lengths(direct)
    slant = slants(direct)
    regular = np.asarray((slant >= GRAZING).all(axis=0) | (slant <= -GRAZING).all(axis=0))
    unit = direct.directions / np.linalg.norm(direct.directions, axis=1, keepdims=True)
    view = seen_samples(reflector, eye, max(_SAMPLES, _PER_TRIANGLE * cams.count))
    samples = _samples(cams, unit, view, reflector.radius)
    if not regular.any() or not len(samples.face) or samples.unit.min() <= 1e-12 * reflector.radius:
        return start
    fit = _Fit(start, regular, samples)
    rays, best = start.directions, None
    for weight in _WEIGHTS:
        rays = fit.solved(rays, weight)
        error = float(fit.errors(rays)[1].max())
        spread = float(np.median(np.ptp(fit.parts(rays)[regular], axis=1)))
        if best is not None and best[0] <= ENOUGH and spread > SPREAD:
            break
        best = error, rays
        if error <= GOAL:
            break
    assert best is not None
    return dataclasses.replace(start, directions=best[1])


def _samples(cams: CameraTriangles, unit: np.ndarray, view: SeenPoints, radius: float) -> _Samples:
    points, normals = view.points, view.normals
    true, passes = bent(points - view.eye, normals, cams.index)
    points, normals, true = points[passes], normals[passes], true[passes]
    place = Locator(cams.vertices, cams.normals, cams.faces).locate(points, normals)
    weights = np.stack([1.0 - place.second - place.third, place.second, place.third], axis=1)
    places = np.einsum("nc,ncx->nx", weights, cams.vertices[cams.faces[place.face]])
    distances = NEAR * radius, FAR * radius
    bare = _Samples(place.face, weights, places, points, true, distances, np.ones(2))
    return bare._replace(unit=np.array([_rms(met.miss) for met in _met(bare, cams.faces, unit)]))


def _met(samples: _Samples, faces: np.ndarray, rays: np.ndarray) -> list[Any]:
    along = np.einsum("nc,ncx->xn", samples.weights, rays[faces[samples.face]])
    return [
        crossing(samples.places.T, along, samples.points.T, samples.true.T, distance, _LEAST)
        for distance in samples.distances
    ]


def _rms(miss: np.ndarray) -> float:
    return float(np.sqrt((miss**2).sum(axis=0).mean())) if miss.size else 0.0


class _Fit:
    """The sum of squares over rays (V, 3), and Levenberg and Marquardt's steps on it.

    Half the squared errors of rays in both planes, each over that of unit directions, plus a weight times the mean
    square of a triangle's parts along the normal over their mean, less 1.
    """

    def __init__(self, cams: CameraTriangles, regular: np.ndarray, samples: _Samples):
        self.faces, self.regular, self.samples = cams.faces, regular, samples
        a, b, c = (cams.vertices[cams.faces[:, i]] for i in range(3))
        across = np.cross(b - a, c - a)
        self.normals = across / np.linalg.norm(across, axis=1, keepdims=True)
        self.start = cams.directions
        self.rows = (cams.faces[:, :, None] * 3 + np.arange(3)).reshape(-1, 9)

    def parts(self, rays: np.ndarray) -> np.ndarray:
        """(F, 3) parts of the corners' rays along the normal, over their mean."""
        part = np.einsum("fx,fcx->fc", self.normals, rays[self.faces])
        return part / part.mean(axis=1, keepdims=True)

    def errors(self, rays: np.ndarray) -> tuple[list[Any], np.ndarray]:
        """Crossings of both planes, and root mean squares over those of unit directions (2,)."""
        met = _met(self.samples, self.faces, rays)
        return met, np.array([_rms(one.miss) for one in met]) / self.samples.unit

    def cost(self, rays: np.ndarray, weight: float) -> float:
        uneven = ((self.parts(rays)[self.regular] - 1.0) ** 2).sum(axis=1)
        tolerated = _TOLERATED**2
        return float(0.5 * (self.errors(rays)[1] ** 2).sum() + weight * tolerated * np.log1p(uneven / tolerated).mean())

    def solved(self, rays: np.ndarray, weight: float) -> np.ndarray:
        """The rays at the minimum for a weight, nearly."""
        damping, cost = 1e-4, self.cost(rays, weight)
        for _ in range(_STEPS):
            normal, right = self.equations(rays, weight)
            for _ in range(_TRIES):
                trial = rays - _step(normal, right, damping).reshape(rays.shape)
                after = self.cost(trial, weight)
                if after < cost:
                    break
                damping *= 10.0
            else:
                return rays
            gain, rays, cost, damping = 1.0 - after / cost, trial, after, max(damping / 10.0, 1e-9)
            if gain < _STILL:
                break
        return rays

    def equations(self, rays: np.ndarray, weight: float) -> tuple[Any, np.ndarray]:
        """Gauss and Newton's normal equations: a sparse (3 V, 3 V) matrix, and the right side."""
        from scipy.sparse import coo_matrix

        samples, count = self.samples, len(self.faces)
        length = np.linalg.norm(np.einsum("nc,ncx->nx", samples.weights, rays[self.faces[samples.face]]), axis=1)
        square, slope = np.zeros((3, 3, len(length))), np.zeros((3, len(length)))
        for met, unit in zip(self.errors(rays)[0], samples.unit, strict=True):
            # Of a ray's change across itself, all is seen in the plane, slanted; of a change along it, nothing.
            matrix = np.eye(3)[:, :, None] - met.along[:, None] * samples.true.T[None] / met.forward
            matrix *= met.reach / length
            share = 0.5 / (unit**2 * len(length))
            square += share * np.einsum("ijn,ikn->jkn", matrix, matrix)
            slope += share * np.einsum("ijn,in->jn", matrix, met.miss)
        blocks, right = np.zeros((count, 3, 3, 3, 3)), np.zeros((count, 3, 3))
        w = samples.weights.T
        for i in range(3):
            right[:, i] = np.stack([np.bincount(samples.face, w[i] * slope[x], count) for x in range(3)], axis=1)
            for j in range(i + 1):
                for x in range(3):
                    for y in range(3):
                        blocks[:, i, x, j, y] = np.bincount(samples.face, w[i] * w[j] * square[x, y], count)
                blocks[:, j, :, i, :] = np.swapaxes(blocks[:, i, :, j, :], 1, 2)
        part = np.einsum("fx,fcx->fc", self.normals, rays[self.faces])
        uneven = ((self.parts(rays) - 1.0) ** 2).sum(axis=1)
        share = np.where(self.regular, weight / (1.0 + uneven / _TOLERATED**2), 0.0)
        share /= self.regular.sum() * part.mean(axis=1) ** 2
        center = np.eye(3) - 1.0 / 3.0
        blocks += np.einsum("f,ij,fx,fy->fixjy", share, center, self.normals, self.normals)
        right += np.einsum("f,fi,fx->fix", share, part @ center, self.normals)
        rows = self.rows
        at = np.repeat(rows, 9, axis=1).ravel(), np.tile(rows, (1, 9)).ravel()
        normal: Any = coo_matrix((blocks.ravel(), at), shape=(rays.size, rays.size)).tocsc()
        pull = _PULL * float(np.median(normal.diagonal()))
        normal.setdiag(normal.diagonal() + pull)
        return normal, np.bincount(rows.ravel(), right.ravel(), rays.size) + pull * (rays - self.start).ravel()


def _step(normal: Any, right: np.ndarray, damping: float) -> np.ndarray:
    from scipy.sparse import diags
    from scipy.sparse.linalg import spsolve

    diagonal = normal.diagonal()
    return np.asarray(spsolve((normal + diags(damping * diagonal + 1e-300)).tocsc(), right))
