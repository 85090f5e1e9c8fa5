"""Where the rays of curved camera triangles pass through points: every place, by subdivision. NumPy, float64.

Positions over a triangle are quadratic, p - q for short p, and directions D are a polynomial too: quadratic, or of
degree 6 where rays are mirrored. A ray passes through the point where p x D = 0, and the Bernstein coefficients of that
bound it over a part of the triangle. A part without a root is left out; where the derivative, times its inverse in the
middle, is near to one throughout, there is at most one root, and iteration finds it; any other part is cut in four.
What is left at last is dropped: there two images meet, or a whole curve of rays meets in the point.
"""

import functools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.triangle_nodes import EDGES

LEVELS = 26
MOST_PARTS = 256
"""Parts of a triangle that wait to be looked at; where it takes more, the point is seen all along a curve."""
_CHUNK = 1 << 12
_STEPS = 16
_NEAR = 0.25
_EPS = 2.0**-52
_MIDDLES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.5, 0.5), (0.5, 0.0, 0.5), (0.5, 0.5, 0.0))
_FOUR = ((0, 5, 4), (5, 1, 3), (4, 3, 2), (3, 4, 5))
"""Corners of the four parts, among the middles."""


class Starts(NamedTuple):
    """Places (K,) of roots: which pair they belong to, and weights of corners 2 and 3."""

    number: np.ndarray
    second: np.ndarray
    third: np.ndarray


class _Parts(NamedTuple):
    """Parts of triangles. number (M,): of the pair; corners (3, 2, M): weights 2 and 3; p, along (6, 3, M), come: the
    control points of positions less the point, of directions or normals, and of positions less the eye.
    """

    number: np.ndarray
    corners: np.ndarray
    p: np.ndarray
    along: np.ndarray
    come: np.ndarray | None

    def chosen(self, which: np.ndarray) -> "_Parts":
        cut: list[Any] = [None if values is None else values[..., which] for values in self]
        return _Parts(*cut)

    def in_four(self) -> "_Parts":
        middles = np.tensordot(np.array(_MIDDLES), self.corners, 1)
        corners = np.concatenate([middles[list(one)] for one in _FOUR], axis=-1)
        cut: list[Any] = [
            None if values is None else np.concatenate([np.tensordot(part, values, 1) for part in _cuts()], axis=-1)
            for values in (self.p, self.along, self.come)
        ]
        return _Parts(np.tile(self.number, 4), corners, *cut)


def starts(places: Sequence[np.ndarray], along: Sequence[np.ndarray], points: np.ndarray, eye: Any = None) -> Starts:
    """All isolated roots of M pairs of a triangle and a point.

    places, along: six nodes (3, M) each, of positions, and of directions or, with an eye (3,), of normals that mirror
    its rays. points: (3, M). A root at an edge may be found slightly outside of the triangle.
    """
    found = []
    for first in range(0, points.shape[1], _CHUNK):
        part = slice(first, first + _CHUNK)
        nodes = [controls([node[:, part] for node in table]) for table in (places, along)]
        come = None if eye is None else nodes[0] - np.asarray(eye)[:, None]
        size = np.abs(nodes[1]).max(axis=(0, 1))
        ways = nodes[1] / np.where(size > 0, size, 1.0)
        number = np.arange(nodes[0].shape[2])
        corners = np.repeat(np.array([(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)])[..., None], len(number), axis=2)
        one = _searched(_Parts(number, corners, nodes[0] - points[:, part], ways, come), np.abs(points[:, part]).max(0))
        found.append(one._replace(number=one.number + first))
    if not found:
        return Starts(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
    return Starts(*(np.concatenate(values) for values in zip(*found, strict=True)))


def _searched(parts: _Parts, far: np.ndarray) -> Starts:
    count, found = len(parts.number), [Starts(np.zeros(0, np.int64), np.zeros(0), np.zeros(0))]
    for _ in range(LEVELS):
        if len(parts.number) == 0:
            break
        ways = _directions(parts)
        middle = ways.mean(axis=0)
        length = np.sqrt((middle * middle).sum(axis=0))
        axes = _frame(middle / np.where(length > 0, length, 1.0))
        p, d = (np.einsum("iam,cam->icm", axes, values) for values in (parts.p, ways))
        degree = 2 if parts.come is None else 6
        f = _product(p[1], d[2], degree) - _product(p[2], d[1], degree)
        f = np.stack([f, _product(p[2], d[0], degree) - _product(p[0], d[2], degree)])
        largest = np.sqrt((parts.p**2).sum(axis=1)).max(axis=0) + far[parts.number]
        doubt = 64 * _EPS * largest * np.sqrt((ways * ways).sum(axis=1)).max(axis=0)
        toward = _inner(parts.p, ways, degree)
        alive = (toward.min(axis=0) <= doubt) & ~_one_sign(f, doubt).any(axis=0)
        x, y = _derivatives(f, degree + 2)
        mx, my = x.mean(axis=1), y.mean(axis=1)
        determinant = mx[0] * my[1] - mx[1] * my[0]
        regular = (length > 0) & (np.abs(determinant) > 1e-12 * np.abs(mx).max(axis=0) * np.abs(my).max(axis=0))
        over = np.where(regular, 1.0 / np.where(regular, determinant, 1.0), 0.0)
        inverse = np.array([[my[1], -my[0]], [-mx[1], mx[0]]]) * over
        rounding = np.abs(inverse).sum(axis=1) * doubt
        g = np.einsum("abm,bkm->akm", inverse, f)
        alive &= ~(regular & _one_sign(g, rounding).any(axis=0))
        unit = np.eye(2)[:, :, None, None]
        change = np.abs(np.einsum("abm,bkm->akm", inverse, x) - unit[0]).max(axis=1)
        change = change + np.abs(np.einsum("abm,bkm->akm", inverse, y) - unit[1]).max(axis=1)
        one = alive & regular & (change.max(axis=0) <= _NEAR) & (d[2] > 0).all(axis=0) & (rounding.max(axis=0) < 0.05)
        if one.any():
            found.append(_iterated(parts.chosen(one), f[..., one], inverse[..., one], rounding[:, one], degree + 2))
        waiting = alive & ~one
        many = np.bincount(parts.number[waiting], minlength=count)
        parts = parts.chosen(waiting & (many[parts.number] <= MOST_PARTS)).in_four()
    return Starts(*(np.concatenate(values) for values in zip(*found, strict=True)))


def _iterated(parts: _Parts, f: np.ndarray, inverse: np.ndarray, rounding: np.ndarray, degree: int) -> Starts:
    """The roots of parts with at most one."""
    place = np.full((2, len(parts.number)), 1 / 3)
    step = place
    for _ in range(_STEPS):
        value = (_basis(place[0], place[1], degree) * f).sum(axis=1)
        step = np.einsum("abm,bm->am", inverse, value)
        place = np.maximum(place - step, 0.0)
        place = place / np.maximum(place.sum(axis=0), 1.0)
    value = (_basis(place[0], place[1], degree) * f).sum(axis=1)
    step = np.einsum("abm,bm->am", inverse, value)
    kept = (np.abs(step) <= 1e-6 + 4 * rounding).all(axis=0)  # else the root lies outside
    weights = np.stack([1.0 - place.sum(axis=0), place[0], place[1]])
    found = np.einsum("cm,ckm->km", weights, parts.corners)[:, kept]
    return Starts(parts.number[kept], found[0], found[1])


def controls(nodes: Sequence[np.ndarray]) -> np.ndarray:
    """Bernstein control points (6, 3, M) of what is met at six nodes."""
    corners, middles = list(nodes[:3]), nodes[3:]
    return np.stack(corners + [2.0 * m - 0.5 * (nodes[a] + nodes[b]) for m, (a, b) in zip(middles, EDGES, strict=True)])


def _directions(parts: _Parts) -> np.ndarray:
    """Control points of the directions: given, or (N . N) I - 2 (I . N) N, of degree 6."""
    if parts.come is None:
        return parts.along
    normal, come = parts.along, parts.come
    square, across = _inner(normal, normal, 2), _inner(come, normal, 2)
    return np.stack(
        [_product(come[:, k], square, 4) - 2.0 * _product(normal[:, k], across, 4) for k in range(3)], axis=1
    )


def _inner(f: np.ndarray, g: np.ndarray, degree: int) -> np.ndarray:
    """Coefficients of the inner product of vectors of polynomials, (6, 3, M) and (K, 3, M)."""
    x, y, z = (_product(f[:, k], g[:, k], degree) for k in range(3))
    return x + y + z


def _product(f: np.ndarray, g: np.ndarray, degree: int) -> np.ndarray:
    """Coefficients of the product of polynomials of degree 2, (6, M), and of another degree, (K, M)."""
    terms = (f[:, None] * g[None]).reshape(-1, f.shape[-1])
    return _multiply(degree) @ terms


@functools.cache
def _indices(degree: int) -> tuple[tuple[int, int, int], ...]:
    """Powers of the three weights; those of degree 2 in the order of the nodes."""
    if degree == 2:
        return (2, 0, 0), (0, 2, 0), (0, 0, 2), (0, 1, 1), (1, 0, 1), (1, 1, 0)
    return tuple((degree - j - k, j, k) for j in range(degree + 1) for k in range(degree + 1 - j))


def _ways(powers: tuple[int, int, int]) -> int:
    return math.factorial(sum(powers)) // math.prod(map(math.factorial, powers))


@functools.cache
def _multiply(degree: int) -> np.ndarray:
    """(K', 6 K) from products of coefficients, of degree 2 and another, to those of the product."""
    place = {powers: number for number, powers in enumerate(_indices(degree + 2))}
    one, other = _indices(2), _indices(degree)
    table = np.zeros((len(place), len(one) * len(other)))
    for i, a in enumerate(one):
        for j, b in enumerate(other):
            c = (a[0] + b[0], a[1] + b[1], a[2] + b[2])
            table[place[c], i * len(other) + j] = _ways(a) * _ways(b) / _ways(c)
    return table


@functools.cache
def _slopes(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """From coefficients to those of the derivatives by the weights of corners 2 and 3."""
    place = {powers: number for number, powers in enumerate(_indices(degree))}
    lower = _indices(degree - 1)
    tables = np.zeros((2, len(lower), len(place)))
    for row, (i, j, k) in enumerate(lower):
        for axis, up in enumerate(((i, j + 1, k), (i, j, k + 1))):
            tables[axis, row, place[up]] += degree
            tables[axis, row, place[i + 1, j, k]] -= degree
    return tables[0], tables[1]


def _derivatives(f: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    by_second, by_third = (np.einsum("lk,akm->alm", table, f) for table in _slopes(degree))
    return by_second, by_third


def _basis(second: np.ndarray, third: np.ndarray, degree: int) -> np.ndarray:
    first = 1.0 - second - third
    return np.stack([_ways(p) * first ** p[0] * second ** p[1] * third ** p[2] for p in _indices(degree)])


@functools.cache
def _cuts() -> np.ndarray:
    """(4, 6, 6) from control points to those of the four parts: by the polar form."""
    tables = np.zeros((4, 6, 6))
    for part, corners in enumerate(_FOUR):
        ends = [np.array(_MIDDLES[corner]) for corner in corners]
        pairs = [(0, 0), (1, 1), (2, 2), *EDGES]
        for row, (a, b) in enumerate(pairs):
            for column, (i, j) in enumerate(pairs):
                both = ends[a][i] * ends[b][j]
                tables[part, row, column] = both if i == j else both + ends[a][j] * ends[b][i]
    return tables


def _one_sign(values: np.ndarray, doubt: np.ndarray) -> np.ndarray:
    return (values.min(axis=1) > doubt) | (values.max(axis=1) < -doubt)


def _frame(axis: np.ndarray) -> np.ndarray:
    """Two unit vectors across a unit vector (3, M), and itself, right-handed: (3, 3, M)."""
    x, y, z = axis
    sign = np.where(z >= 0, 1.0, -1.0)  # Duff et al. 2017
    a = -1.0 / (sign + z)
    b = x * y * a
    return np.stack([[1 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y], [x, y, z]])
