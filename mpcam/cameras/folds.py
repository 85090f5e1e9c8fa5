"""How far a distortion is one to one, found from its coefficients.

Inside of the circle `inner` the larger root of `Distortion.unfolded` is off the circle: whole circles have not folded.
Farther out, the arc that has not folded shrinks towards q. Where it would grow again, behind an island of folds, the
part in the shadow is left out by `level`. At `outer` the last of it folds, or the image or the plane ends.
"""

import functools
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from mpcam.cameras.calibrated import FARTHEST
from mpcam.cameras.distortion import NO_EDGE, Distortion, Reach
from mpcam.math import (
    Array,
    absolute,
    atan,
    detach,
    first_true,
    library,
    maximum,
    minimum,
    polynomial,
    sign_changes,
    tan,
    where,
)

WIDEST = 1e5
"""Tangent of the largest angle from the axis: 90 degrees but for 2 arc seconds."""

_GREATEST = 1e36  # of a term of R, so that float32 holds it
_CELLS = np.linspace(0.0, 1.0, 1025)
_SAMPLES = np.linspace(0.0, 1.0, 257)
_ZOOMS = 3


def reach(distortion: Distortion, max_angle: Array) -> Reach:
    """Where a distortion is one to one, at most max_angle (radians) from the axis; constants to gradients."""
    still = distortion.still()
    numbers = (*still.k, *still.q, detach(max_angle))
    kind = library(*numbers)
    if kind == "jax":
        return _on_grid(still, detach(max_angle))
    values = [float(number if library(number) == "numpy" else number[0]) for number in numbers]
    return _exact(tuple(values[:6]), (values[6], values[7]), values[8])


@functools.lru_cache(maxsize=256)
def _exact(k: tuple[float, ...], q: tuple[float, float], max_angle: float) -> Reach:
    distortion = Distortion(k, q)
    above, below = (_even(part) for part in distortion.parts())
    slopes = [_even([i * c for i, c in enumerate(part)][1:]) for part in distortion.parts()]
    r = Polynomial([0.0, 1.0])
    ends, turns = _conditions(r, above, below, slopes[0] * below - above * slopes[1], distortion.size())
    outer = float(_widest(k, max_angle))
    for condition in (below, *ends):
        outer = _first_change(condition.coef, outer)
    inner = outer
    for condition in turns:
        inner = _first_change(condition.coef, inner)
    ring = inner < outer * (1 - 1e-14)  # else nothing but rounding
    level = float(_level(distortion, inner, outer)) if ring else NO_EDGE
    return Reach(inner, outer, level, float(_rim(distortion, outer)))


def _on_grid(distortion: Distortion, max_angle: Array) -> Reach:
    """The same for JAX, on ever finer grids: at most 1e-10 smaller, but pairs of folds within 1e-4 may pass unseen."""
    limit = atan(_widest(distortion.k, max_angle))

    def ended(theta: Array, inner: bool = False) -> Array:
        r = tan(theta)
        value, slope, _ = distortion.ratio(r * r)
        ends, turns = _conditions(r, value, 1.0, slope, distortion.size())
        negative = polynomial(distortion.parts()[1], r * r) <= 0
        for condition in (*ends, *turns) if inner else ends:
            negative = negative | (condition <= 0)
        return negative

    outer = first_true(ended, limit)
    inner = first_true(functools.partial(ended, inner=True), outer)
    inner, outer = tan(inner), tan(outer)
    return Reach(inner, outer, _level(distortion, inner, outer), _rim(distortion, outer))


def _rim(distortion: Distortion, outer: Array) -> Array:
    """Radius of the image where it is widest, towards q."""
    return outer * distortion.ratio(outer * outer)[0] + 3.0 * outer * outer * distortion.size()


def _widest(k: tuple[Array, ...], max_angle: Array) -> Array:
    """Radius to look for folds within."""
    r = minimum(tan(minimum(max_angle, atan(WIDEST))), WIDEST)
    for i, coefficient in enumerate(k):
        r = minimum(r, (_GREATEST / maximum(absolute(coefficient), 1.0)) ** (0.5 / (i % 3 + 1)))
    return r


def _conditions(r: Any, above: Any, below: Any, slope: Any, size: Array) -> tuple[list[Any], list[Any]]:
    """Positive at 0; one changes its sign at `outer`, where none did before, and one at `inner`.

    r, R = above / below and R' = slope / below^2 are arrays, or polynomials in r; size: |q|. Along q both eigenvalues
    of F' are simple, R + 2 |q| r and R + 2 s R' + 6 |q| r; against q, with the other sign. An arc can begin within a
    circle, not at the side against q, only where R is below 10/3 |q| r.
    """
    s, turned = r * r, size * r * below
    radial = above * below + 2.0 * s * slope
    far = FARTHEST * below - r * above - 3.0 * r * turned
    return (
        [above + 2.0 * turned, radial + 6.0 * turned * below, far, FARTHEST * below - above],
        [above - 10.0 / 3.0 * turned, radial - 6.0 * turned * below],
    )


def _level(distortion: Distortion, inner: Array, outer: Array) -> Array:
    """The highest `Distortion.edge` from which it falls again between inner and outer; NO_EDGE if it only rises."""
    theta, edge = _edges(distortion, atan(inner), atan(outer))
    peak = where(edge[1:] < edge[:-1], edge[:-1], NO_EDGE)
    falls = peak.max() > NO_EDGE
    for _ in range(_ZOOMS):
        at = peak.argmax()
        theta, edge = _edges(distortion, theta[maximum(at - 1, 0)], theta[minimum(at + 1, len(_SAMPLES) - 1)])
        peak = edge
    return where(falls, peak.max(), NO_EDGE)


def _edges(distortion: Distortion, low: Array, high: Array) -> tuple[Array, Array]:
    """`Distortion.edge` at angles from low to high."""
    theta = low + (high - low) * _SAMPLES
    return theta, distortion.edge(tan(theta))


def _first_change(coefficients: Any, high: float) -> float:
    """Where a polynomial, positive at 0, first changes its sign below high; high if nowhere.

    Between two radii, the terms that are positive are least at the first, the others greatest at the second: cells of a
    grid where the former win hold no zero, and the search is left with the rest.
    """
    coefficients = np.trim_zeros(coefficients, "b").tolist()
    r = np.expm1(np.log1p(high) * _CELLS)
    gain = polynomial([max(c, 0.0) for c in coefficients], r[:-1])
    loss = polynomial([max(-c, 0.0) for c in coefficients], r[1:])
    doubtful = np.flatnonzero(gain * (1 - 1e-12) <= loss)
    for run in np.split(doubtful, np.flatnonzero(np.diff(doubtful) > 1) + 1):
        changes = sign_changes(coefficients, float(r[run[0]]), float(r[run[-1] + 1])) if len(run) else []
        if changes:
            return changes[0]
    return high


def _even(coefficients: Any) -> Polynomial:
    """A polynomial in s as one in r."""
    return Polynomial([c for value in coefficients for c in (value, 0.0)])
