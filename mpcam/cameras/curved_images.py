"""Images of points in curved camera triangles, the nearest first, from the starts that subdivision finds. NumPy."""

from typing import Any

import numpy as np

from mpcam.cameras.bent_rays import Bend, Image, pixel_ray, refined
from mpcam.cameras.curved_search import controls, starts
from mpcam.math import Vector

IMAGES = 8
"""Images that are kept in each camera triangle."""
_SAME = 1e-7


def project(bend: Bend, v: Any, n: Any, q: Vector, eye: Any) -> list[Image]:
    """Images of points q in camera triangles of degree 2, nodes v, n there: weights 2 and 3, distance, validity.

    As `bent_rays.project`; eye (3,): whose rays normals mirror, None where n are directions. None is left out but where
    two nearly coincide, and of more than IMAGES the farthest.
    """
    shape = np.broadcast_shapes(*(np.shape(part) for one in (*v, *n, q) for part in one))

    def flat(one: Vector) -> np.ndarray:
        return np.stack([np.broadcast_to(part, shape).ravel() for part in one])

    v, n, q = tuple(map(flat, v)), tuple(map(flat, n)), flat(q)
    chosen = np.flatnonzero(np.isfinite(q).all(axis=0))
    if eye is None:
        chosen = chosen[_may_pass(controls(v), controls(n), q, chosen)]
    found = starts([node[:, chosen] for node in v], [node[:, chosen] for node in n], q[:, chosen], eye)
    pair = chosen[found.number]
    places, values = (tuple(node[:, pair] for node in table) for table in (v, n))
    origin, way, _ = pixel_ray(bend, places, values, found.second, found.third)
    distance = ((q[:, pair] - origin) * way).sum(axis=0)
    second, third, distance, good = refined(bend, places, values, q[:, pair], found.second, found.third, distance)
    pair, second, third, distance = (part[good] for part in (pair, second, third, distance))
    order = np.lexsort((distance, pair))
    pair, second, third, distance = (part[order] for part in (pair, second, third, distance))
    fresh = np.ones(len(pair), bool)
    for back in range(1, len(pair)):
        now, before = slice(back, None), slice(None, -back)
        close = pair[now] == pair[before]
        if not close.any():
            break
        near = (np.abs(second[now] - second[before]) < _SAME) & (np.abs(third[now] - third[before]) < _SAME)
        fresh[now] &= ~(close & near)
    pair, second, third, distance = (part[fresh] for part in (pair, second, third, distance))
    rank = np.arange(len(pair)) - np.searchsorted(pair, pair)
    result = []
    for number in range(IMAGES):
        rows = rank == number
        image = [np.zeros(q.shape[1]) for _ in range(3)]
        valid = np.zeros(q.shape[1], bool)
        valid[pair[rows]] = True
        for part, of in zip(image, (second, third, distance), strict=True):
            part[pair[rows]] = of[rows]
        result.append(tuple(part.reshape(shape) for part in (*image, valid)))
    return result


def _may_pass(places: np.ndarray, ways: np.ndarray, q: np.ndarray, chosen: np.ndarray) -> np.ndarray:
    """Which points can lie on a ray: positions are within the ball, directions within the cone of the controls."""
    places, ways = places[..., chosen], ways[..., chosen]
    length = np.sqrt((ways * ways).sum(axis=1, keepdims=True))
    ways = ways / np.where(length > 0, length, 1.0)
    center, axis = places.mean(axis=0), ways.mean(axis=0)
    size = np.sqrt((axis * axis).sum(axis=0))
    axis = axis / np.where(size > 0, size, 1.0)
    reach, spread = (
        1.000001 * np.sqrt(((one - middle) ** 2).sum(axis=1)).max(axis=0)
        for one, middle in ((places, center), (ways, axis))
    )
    away = q[:, chosen] - center
    a, b = 1.0 - spread**2, (away * axis).sum(axis=0) + reach * spread
    c = (away * away).sum(axis=0) - reach**2
    return (spread > 1.2) | (length == 0).any(axis=(0, 1)) | (c <= 0) | (a <= 0) | ((b > 0) & (b * b >= a * c))
