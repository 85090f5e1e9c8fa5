"""Images of points in ray maps by brute force: every cell, by elimination, then in 50 digits.

In a cell with p = origin - point and d both bilinear, the point is seen at (s, t) at depth c where p + c d = 0. For a
given t that is A + s B + c C + s c D = 0, with vectors that are linear in t, so (1, s, c, s c) is the null vector of
[A B C D], and its minors give a polynomial of degree 6 in t. It has all solutions, complex ones too, so that it is
known which are near to a fold.
"""

from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.ray_map import RayMap

_DEGREE = 6
_NODES = np.cos(np.pi * (np.arange(_DEGREE + 1) + 0.5) / (_DEGREE + 1))
_MIDDLE, _HALF = 0.5, 1.25  # t of the nodes: a cell at the border reaches from -0.5 to 1.5


class Truth(NamedTuple):
    """Images of one point: pixel (n, 2), depth (n,), with condition numbers, and whether they are surely there (n,).

    The conditions are what relative errors of the input's components make of pixel and depth. A place is sure if it is
    no fold, and not at the border of what has rays, nor at the origin of its ray.
    """

    pixel: np.ndarray
    depth: np.ndarray
    pixel_condition: np.ndarray
    depth_condition: np.ndarray
    sure: np.ndarray


class _Image(NamedTuple):
    """An image in a cell: s, t, the condition number of both, whether it is sure, depth and its condition number."""

    s: float
    t: float
    condition: float
    sure: bool
    depth: float
    depth_condition: float


def truths(camera: RayMap, points: np.ndarray) -> list[Truth]:
    """All images of points (N, 3) in a map, by trying every cell."""
    found: list[list[tuple[float, ...]]] = [[] for _ in points]
    exists = (camera.directions != 0).any(-1)
    for j in range(camera.height - 1):
        for i in range(camera.width - 1):
            corners = [(j, i), (j, i + 1), (j + 1, i), (j + 1, i + 1)]
            if not all(exists[corner] for corner in corners):
                continue
            origins, rays = (
                np.stack([table[corner] for corner in corners]) for table in (camera.origins, camera.directions)
            )
            low = np.array([-0.5 if i == 0 else 0.0, -0.5 if j == 0 else 0.0])
            high = np.array([1.5 if i == camera.width - 2 else 1.0, 1.5 if j == camera.height - 2 else 1.0])
            for images, cell in zip(found, _in_cell(origins, rays, points, low, high), strict=True):
                for one in cell:
                    place = (i + 0.5 + one.s, j + 0.5 + one.t)
                    images.append((*place, one.depth, one.condition + sum(place), one.depth_condition, one.sure))
    tables = [np.array(images, np.float64).reshape(-1, 6) for images in found]
    return [Truth(table[:, :2], table[:, 2], table[:, 3], table[:, 4], table[:, 5] > 0) for table in tables]


def _in_cell(
    origins: np.ndarray, rays: np.ndarray, points: np.ndarray, low: np.ndarray, high: np.ndarray
) -> list[list[_Image]]:
    """Images of points in one cell; low, high: its ends in s and t.

    s is eliminated, and t once more, since places with nearly the same t are told apart badly by it.
    """
    turned = [0, 2, 1, 3]
    places = _eliminated(origins, rays, points)
    others = _eliminated(origins[turned], rays[turned], points)[..., [1, 0, 2]]
    result = []
    for number, point in enumerate(points):
        images: list[_Image] = []
        for start, far in (found for all_ in (places, others) for found in _candidates(all_[number], low, high)):
            if any(abs(one.s - start[0]) + abs(one.t - start[1]) < 1e-8 for one in images):
                continue  # the same from both
            exact = _polished(origins, rays, point, start)
            if exact is None:
                continue
            (s, t, c), condition = exact
            inside = np.minimum(np.array([s, t]) - low, high - np.array([s, t])).min()
            doubt = 1e-12 + 64 * 2.0**-52 * condition[:2].max()
            near = 64 * 2.0**-52 * condition[2]
            if inside < -doubt or c < -near or any(abs(one.s - s) + abs(one.t - t) < 1e-9 for one in images):
                continue
            # A neighboring cell may take over at the border; nothing does at a hole or a fold.
            sure = far and inside > doubt and c > near
            depth, size, slope = _depth(origins, point, s, t)
            spread = condition[:2].max()
            images.append(_Image(s, t, spread, sure, depth, size + slope * (spread + 8)))
        result.append(images)
    return result


def _parts(corners: np.ndarray) -> tuple[np.ndarray, ...]:
    """A bilinear function's value at the first corner, and what t, s and s t add."""
    a, b, c, d = np.moveaxis(corners, -2, 0)
    return a, c - a, b - a, (d - c) - (b - a)


def _eliminated(origins: np.ndarray, rays: np.ndarray, points: np.ndarray) -> np.ndarray:
    """All (s, t, c) of points (N, 3) in one cell, (N, 6, 3) complex."""
    p = origins - points[:, None]
    size, length = np.abs(p).max((1, 2)), np.abs(rays).max()
    a, at, b, bt = _parts(p / size[:, None, None])
    c, ct, d, dt = _parts(rays / length)

    def minors(t: Any) -> tuple[Any, ...]:
        columns = (a + t * at, b + t * bt, c + t * ct, d + t * dt)
        return tuple(_determinant(*(columns[k] for k in range(4) if k != left)) for left in range(4))

    values = []
    for node in _NODES:
        one, s, depth, both = minors(_MIDDLE + _HALF * node)
        values.append(one * both - s * depth)
    series = np.linalg.solve(np.polynomial.chebyshev.chebvander(_NODES, _DEGREE), np.stack(values)).T
    t = _MIDDLE + _HALF * _chebyshev_roots(series)
    one, s, depth, both = (minor.T for minor in minors(t.T[..., None]))  # up to signs in proportion to 1, s, c, s c
    with np.errstate(all="ignore"):
        by_one, by_s = np.abs(one) >= np.abs(depth), np.abs(one) >= np.abs(s)
        places = np.where(by_one, -s / one, -both / depth), np.where(by_s, depth / one, both / s)
        return np.stack([places[0], t, places[1] * size[:, None] / length], -1)


def _determinant(a: Any, b: Any, c: Any) -> Any:
    return (np.cross(a, b) * c).sum(-1)


def _chebyshev_roots(series: np.ndarray) -> np.ndarray:
    """Roots (N, degree) of Chebyshev series (N, degree + 1), by eigenvalues; a zero at the head gives distant ones."""
    degree = series.shape[1] - 1
    largest = np.abs(series).max(1)
    largest = np.where(largest > 0, largest, 1.0)[:, None]
    series = series / largest
    head = np.where(np.abs(series[:, -1]) > 1e-15, series[:, -1], 1e-15)
    matrix = np.zeros((len(series), degree, degree))
    scale = np.array([1.0] + [np.sqrt(0.5)] * (degree - 1))
    for k in range(degree - 1):
        matrix[:, k, k + 1] = matrix[:, k + 1, k] = np.sqrt(0.5) if k == 0 else 0.5
    matrix[:, :, -1] -= series[:, :-1] / head[:, None] * (scale / scale[-1]) * 0.5
    return np.linalg.eigvals(matrix)


def _candidates(places: np.ndarray, low: np.ndarray, high: np.ndarray) -> list[tuple[np.ndarray, bool]]:
    """Places (s, t, c) that may be real and in the cell, and whether no other one is near."""
    found = []
    usable = np.isfinite(places).all(-1)
    for number in np.flatnonzero(usable):
        place = places[number]
        real = place.real
        if np.abs(place.imag[:2]).max() > 1e-3 or (real[:2] < low - 1e-3).any() or (real[:2] > high + 1e-3).any():
            continue
        others = np.delete(places, number, 0)
        near = np.abs(others[np.isfinite(others).all(-1)][:, :2] - place[:2]).max(-1, initial=0.0)
        found.append((real, not (near < 1e-3).any()))
    return found


def _polished(origins: np.ndarray, rays: np.ndarray, point: np.ndarray, start: np.ndarray) -> Any:
    """The solution near (s, t, c), and the condition numbers of s, t, c; None where there is none.

    Newton's method, at last with a residual of 50 digits, so that the place has about 30.
    """
    import mpmath

    place = start
    for _ in range(20):
        off = _residual(origins, rays, point, place)
        jacobian, size = _slopes(origins, rays, point, place)
        try:
            inverse = np.linalg.inv(jacobian)
        except np.linalg.LinAlgError:
            return None
        step = inverse @ np.array(off)
        place = place - step
        if not np.abs(place - start)[:2].max() <= 1e-2:
            return None
        if np.abs(step[:2]).max() < 1e-9:
            break
    else:
        return None
    with mpmath.workdps(50):
        exact = [[[mpmath.mpf(float(x)) for x in row] for row in rows] for rows in (origins, rays)]
        q, known = ([mpmath.mpf(float(x)) for x in values] for values in (point, place))
        exactly = _residual(exact[0], exact[1], q, known)
        jacobian, size = _slopes(origins, rays, point, place)
        inverse = np.linalg.inv(jacobian)
        final = [known[i] - sum(float(inverse[i, k]) * x for k, x in enumerate(exactly)) for i in range(3)]
        return [float(x) for x in final], np.abs(inverse) @ size


def _weights(s: Any, t: Any) -> list[Any]:
    return [(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t]


def _residual(origins: Any, rays: Any, point: Any, place: Any) -> list[Any]:
    """p + c d, for any kind of number."""
    s, t, c = place
    parts = list(zip(_weights(s, t), origins, rays, strict=True))
    return [sum(w * (o[k] + c * d[k]) for w, o, d in parts) - point[k] for k in range(3)]


def _slopes(origins: np.ndarray, rays: np.ndarray, point: np.ndarray, place: np.ndarray) -> Any:
    """Derivatives of p + c d in s, t and c by columns, and the sizes of what it is the sum of, by component."""
    s, t, c = place
    weights, ends = np.array(_weights(s, t)), origins + c * rays
    columns = [np.array([t - 1, 1 - t, -t, t]) @ ends, np.array([s - 1, -s, 1 - s, s]) @ ends, weights @ rays]
    return np.stack(columns, -1), np.abs(point) + np.abs(weights) @ (np.abs(origins) + np.abs(c * rays))


def _depth(origins: np.ndarray, point: np.ndarray, s: float, t: float) -> tuple[float, float, float]:
    """Distance of a point from the origin at (s, t), the sizes of what it is the difference of, and its slope."""
    weights = np.array(_weights(s, t))
    size = np.linalg.norm(np.abs(point) + np.abs(weights) @ np.abs(origins))
    slopes = [np.array(w) @ origins for w in ([t - 1, 1 - t, -t, t], [s - 1, -s, 1 - s, s])]
    return float(np.linalg.norm(point - weights @ origins)), float(size), float(sum(map(np.linalg.norm, slopes)))
