"""Hou's projection by a quartic (Hou et al. 2006, appendix A), for comparison with `mpcam.cameras.three_rays`.

With A = p(w) - q and D = D(w), a point appears where A x D = 0. Two of these three equations are conics in the weights
(w1, w2); eliminating w2 leaves a quartic in w1. One of its roots is no image: there the components of A and of D along
the axis that both equations share vanish together, whatever the others are. NumPy, float64.
"""

from typing import Any

import numpy as np
from numpy.polynomial import polynomial as poly

from mpcam.cameras.three_rays import Image
from mpcam.math.quartic import quartic_roots

REAL = 1e-7
"""Roots with an imaginary part below this, relative to 1 + |root|, count as real: double roots are no better."""

TOLERANCE = 1e-9
"""What weights may lack to be inside."""

RESIDUAL = 1e-6
"""Largest |p + c D - q| of an image, relative to its terms."""

AXES = np.array([[6.0, 2, 9], [7, 6, -6], [-6, 9, 2]]) / 11
"""Generic axes: any rotation will do whose entries are far from 0 and 1."""


def project_quartic(v: Any, d: Any, q: Any) -> tuple[Image, Image, Image]:
    """The images of a point as `three_rays.project` gives them, from the quartic; no polishing, no derivatives.

    v, d: (3, 3, ...), corner or ray, then component; q: (3, ...).
    """
    a, d, farthest, longest = _scaled(v, d, q)
    with np.errstate(all="ignore"):  # degenerate triangles, whose images are refused below
        conics = _conics(a, d)
        w1 = _without(quartic_roots(*_resultant(*conics)[::-1]), _spurious(a, d))
        real, w1 = np.abs(np.imag(w1)) <= REAL * (1 + np.abs(w1)), np.real(w1)
        w2 = _other_weight(*conics, w1)
        w = np.stack([w1, w2, 1 - w1 - w2])[:, None]
        p, ray = (w * a[..., None]).sum(0), (w * d[..., None]).sum(0)
        c = -(p * ray).sum(0) / (ray * ray).sum(0)
        size = (np.abs(w) * (np.abs(a[..., None]) + np.abs(c * d[..., None]))).sum(0)
        small = np.abs(p + c * ray).max(0) <= RESIDUAL * size.max(0)
        inside = (w1 >= -TOLERANCE) & (w2 >= -TOLERANCE) & (1 - w1 - w2 >= -TOLERANCE) & (c >= -TOLERANCE)
        c = np.maximum(c * (farthest / longest)[..., None], 0)
        valid = real & small & inside & np.isfinite(c)
    order = np.argsort(np.where(valid, c, np.inf), axis=-1)
    parts = [np.take_along_axis(x, order, -1) for x in (w1, w2, c, valid)]
    kept = [np.where(parts[3], x, 0) for x in parts[:3]]
    first, second, third = [Image(*[x[..., i] for x in (*kept, parts[3])]) for i in range(3)]
    return first, second, third


def spurious_root(v: Any, d: Any, q: Any) -> np.ndarray:
    """The root w1 of the quartic that is no image: p and q agree along the pivot axis, and D has no part along it.

    Infinite where that axis is normal to a plane that holds the differences of all rays.
    """
    return _spurious(*_scaled(v, d, q)[:2])


def _spurious(a: np.ndarray, d: np.ndarray) -> np.ndarray:
    x, y = a[:, 0], d[:, 0]
    det = (x[0] - x[2]) * (y[1] - y[2]) - (x[1] - x[2]) * (y[0] - y[2])
    with np.errstate(all="ignore"):
        return np.where(det != 0, (x[1] * y[2] - x[2] * y[1]) / det, np.inf)


def quartic_coefficients(v: Any, d: Any, q: Any) -> np.ndarray:
    """Coefficients (5, ...) of the quartic in w1, the highest first."""
    return _resultant(*_conics(*_scaled(v, d, q)[:2]))[::-1]


def _scaled(v: Any, d: Any, q: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Corners minus the point and directions, each in units of their largest component, and the units.

    Axes are turned by a fixed rotation of no meaning: along the normal of a triangle the quartic may lose its degree.
    """
    a, d = np.broadcast_arrays(np.asarray(v, float) - np.asarray(q, float), np.asarray(d, float))
    a, d = np.einsum("ij,kj...->ki...", AXES, a), np.einsum("ij,kj...->ki...", AXES, d)
    farthest, longest = np.abs(a).max((0, 1)), np.abs(d).max((0, 1))
    return a / np.where(farthest > 0, farthest, 1), d / np.where(longest > 0, longest, 1), farthest, longest


def _conics(a: np.ndarray, d: np.ndarray) -> tuple[list[Any], list[Any]]:
    """A_x D_y - A_y D_x and A_x D_z - A_z D_x as polynomials in w2, whose coefficients are polynomials in w1."""

    def linear(m: np.ndarray, i: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return m[2, i], m[0, i] - m[2, i], m[1, i] - m[2, i]

    def conic(i: int) -> list[Any]:
        (p0, p1, p2), (q0, q1, q2) = linear(a, 0), linear(d, i)
        (r0, r1, r2), (s0, s1, s2) = linear(a, i), linear(d, 0)
        return [
            np.stack([p0 * q0 - r0 * s0, p0 * q1 + p1 * q0 - r0 * s1 - r1 * s0, p1 * q1 - r1 * s1]),
            np.stack([p0 * q2 + p2 * q0 - r0 * s2 - r2 * s0, p1 * q2 + p2 * q1 - r1 * s2 - r2 * s1]),
            np.stack([p2 * q2 - r2 * s2]),
        ]

    return conic(1), conic(2)


def _product(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Of two polynomials, the lowest coefficient first, along the first axis."""
    result = np.zeros((len(x) + len(y) - 1, *x.shape[1:]))
    for i in range(len(x)):
        result[i : i + len(y)] += x[i] * y
    return result


def _minors(x: list[Any], y: list[Any]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """x2 y0 - x0 y2, x2 y1 - x1 y2, x1 y0 - x0 y1."""
    return (
        _product(x[2], y[0]) - _product(x[0], y[2]),
        _product(x[2], y[1]) - _product(x[1], y[2]),
        _product(x[1], y[0]) - _product(x[0], y[1]),
    )


def _resultant(x: list[Any], y: list[Any]) -> np.ndarray:
    """Coefficients (5, ...) of the resultant of two conics in w2, the lowest first."""
    outer, high, low = _minors(x, y)
    return _product(outer, outer) - _product(high, low)


def _without(roots: np.ndarray, spurious: np.ndarray) -> np.ndarray:
    """Three roots (..., 3), without the one nearest to the spurious one, or the largest if that is infinite."""
    with np.errstate(all="ignore"):
        distance = np.where(np.isinf(spurious)[..., None], -np.abs(roots), np.abs(roots - spurious[..., None]))
    order = np.argsort(distance, axis=-1, kind="stable")
    return np.take_along_axis(roots, order, -1)[..., 1:]


def _other_weight(x: list[Any], y: list[Any], w1: np.ndarray) -> np.ndarray:
    """The common root w2 of two conics at w1 (..., 3), by the quotient with the larger denominator."""
    outer, high, low = [poly.polyval(np.moveaxis(w1, -1, 0), m, tensor=False) for m in _minors(x, y)]
    by_high = np.abs(high) >= np.abs(outer)
    w2 = np.where(by_high, -outer / np.where(by_high, high, 1), -low / np.where(by_high, 1, outer))
    return np.moveaxis(w2, 0, -1)
