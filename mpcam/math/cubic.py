"""All real roots of a cubic on an interval, without branches, alike for NumPy, JAX and Dr.Jit arrays.

After Yuksel, "High-performance polynomial root finding for graphics" (2022): the derivative's roots cut the interval
into monotone pieces, and each piece has one root at most.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mpcam.math.arrays import Array, absolute, detach, epsilon, maximum, minimum, sqrt, where
from mpcam.math.roots import bracketed_newton, polynomial
from mpcam.math.vectors import Vector

STEPS = 8
"""Newton's steps per root: the start is off by a factor of two at most, so that these reach float64."""

Pair = tuple[Array, Array]


class Root(NamedTuple):
    """One real root, and whether there is one; 0 where there is none."""

    root: Array
    exists: Array


def cubic_roots(k0: Array, k1: Array, k2: Array, k3: Array, low: Array, high: Array) -> tuple[Root, Root, Root]:
    """Roots of k0 + k1 x + k2 x^2 + k3 x^3 in [low, high] (finite), in rising order.

    Leading coefficients may vanish. A double root comes twice or, where rounding lifts the touching extremum off zero,
    not at all. The polynomial that is zero has no roots here. Derivatives with respect to the coefficients come from
    the implicit-function theorem; they are zero at double roots.
    """
    if all(type(k) in (int, float) for k in (k0, k1, k2, k3)):
        k0 = np.float64(k0)  # so that comparisons can be negated by ~
    given = (k0, k1, k2, k3)
    largest = maximum(absolute(low), absolute(high))
    reach = where(largest > 0, largest, 1.0)
    powers = (1.0, reach, reach * reach, reach * reach * reach)
    scaled = [detach(k) * power for k, power in zip(given, powers, strict=True)]
    size = maximum(maximum(absolute(scaled[0]), absolute(scaled[1])), maximum(absolute(scaled[2]), absolute(scaled[3])))
    some = size > 0
    k = [s / where(some, size, 1.0) for s in scaled]
    zero = 0.0 * (k[0] + k[1] + k[2] + k[3])  # of the type and shape that the result has
    low, high = zero + low / reach, zero + high / reach
    first, inflection, last, monotone = _turns(k, low, high)
    at_first, at_middle, at_last = polynomial(k, first), polynomial(k, inflection), polynomial(k, last)
    left_half = (inflection != first) & _opposite(at_first, at_middle)
    outer, at_outer = where(left_half, first, last), where(left_half, at_first, at_last)
    # The middle piece is entered from an extremum, or from the inflection if that is nearer in value.
    inward = absolute(at_outer) <= absolute(at_middle)
    anchor = where(inward, outer, inflection)
    end = where(left_half == inward, last, first)
    found = (
        _piece(k, first, low, first - low),
        _piece(k, anchor, end, absolute(inflection - outer)),
        _piece(k, last, high, high - last),
    )
    twice = monotone & found[0][1] & (at_last == 0)  # a single root at the inflection
    exists = (found[0][1] & some, found[1][1] & some & ~monotone, found[2][1] & some & ~twice)

    def result(i: int) -> Root:
        x = where(exists[i], found[i][0] * reach, 0.0)
        return Root(_differentiable(given, x, exists[i]), exists[i])

    return result(0), result(1), result(2)


def _turns(k: list[Array], low: Array, high: Array) -> tuple[Array, Array, Array, Array]:
    """Extrema and the inflection between them, clamped to [low, high], and whether there are no extrema.

    Without extrema all three are the inflection, where the slope is least.
    """
    discriminant = k[2] * k[2] - 3 * k[1] * k[3]
    monotone = discriminant <= 0
    root = sqrt(where(monotone, 0.0, discriminant))
    stable = -(k[2] + where(k[2] >= 0, root, -root))
    near, far = _quotient(k[1], stable), _quotient(stable, 3 * k[3])
    inflection = minimum(maximum(_quotient(-k[2], 3 * k[3]), low), high)
    first = where(monotone, inflection, minimum(maximum(minimum(near, far), low), high))
    last = where(monotone, inflection, minimum(maximum(maximum(near, far), low), high))
    return first, minimum(maximum(inflection, first), last), last, monotone


def _quotient(x: Array, y: Array) -> Array:
    """x / y, limited to the magnitude 4, which is beyond the interval."""
    small = absolute(x) < 4 * absolute(y)
    return where(small, x / where(small, y, 1.0), where((x >= 0) == (y >= 0), 4.0, -4.0 + 0.0 * x))


def _piece(k: list[Array], anchor: Array, end: Array, distance: Array) -> tuple[Array, Array]:
    """The root between an anchor and the end of its monotone piece, at most `distance` away, and whether there is one.

    With s the distance from the anchor, |f(s) - f(0)| is about slope s + bend s^2 + |k3| s^3; the least s at which one
    term makes up for |f(0)| is at most twice the root, and 1.3 times it is above the root.
    """
    start, stop = polynomial(k, anchor), polynomial(k, end)
    exists = (anchor != end) & _opposite(start, stop)
    value = absolute(start)
    slope = absolute(polynomial([k[1], 2 * k[2], 3 * k[3]], anchor))
    bend, twist = absolute(k[2] + 3 * k[3] * anchor), absolute(k[3])
    for term, power in ((slope, 1), (bend, 2), (twist, 3)):
        enough = term * distance**power > value
        ratio = where(enough, value, 0.0) / where(enough, term, 1.0)
        distance = where(enough, _root(ratio, power), distance)
    one = 0.0 * value + 1.0  # of the right precision
    side = where(end >= anchor, one, -one)
    start_at, other = anchor + side * distance, anchor + side * minimum(1.3 * distance, absolute(end - anchor))
    rising = where((stop - start) * side >= 0, one, -one)
    x = bracketed_newton(
        lambda x: rising * polynomial(k, x),
        lambda x: rising * polynomial([k[1], 2 * k[2], 3 * k[3]], x),
        minimum(anchor, other),
        maximum(anchor, other),
        start_at,
        STEPS,
        absolute(other - anchor),
    )
    return x, exists


def _opposite(x: Array, y: Array) -> Array:
    """Whether two numbers have different signs, or one is zero."""
    return ((x <= 0) & (y >= 0)) | ((x >= 0) & (y <= 0))


def _root(x: Array, power: int) -> Array:
    return x if power == 1 else sqrt(x) if power == 2 else x ** (1 / 3)


def _differentiable(k: tuple[Array, ...], x: Array, exists: Array) -> Array:
    """The same root, with the derivative of one Newton step on the coefficients."""
    x = detach(x)
    slope = polynomial([detach(k[1]), 2 * detach(k[2]), 3 * detach(k[3])], x)
    steep = exists & (absolute(slope) > 0)
    step = polynomial(k, x) / where(steep, slope, 1.0)
    return where(steep, x - (step - detach(step)), x)


def determinant_cubic(a: Sequence[Vector], d: Sequence[Vector]) -> tuple[tuple[Array, Array, Array, Array], Array]:
    """Coefficients of det[a_i + (center + t) d_i] in t, for three vectors each, and the center.

    Their terms cancel where the vectors are nearly parallel or in one plane, and then they would be lost in rounding
    although the roots are not; so every number here is a pair, of a value and of what rounding took from it (Dekker
    1971), and only the results are rounded. The center is 0, or the inflection if all three roots are near it, as they
    are where rays nearly meet. No vectors of numbers are formed, so components may broadcast.
    """
    e, f = [[[_difference(x, y) for x, y in zip(m[i], m[2], strict=True)] for i in range(2)] for m in (a, d)]
    tail_a, tail_d = [[(x, 0.0 * x) for x in m[2]] for m in (a, d)]
    n0, n2 = _cross(e[0], e[1]), _cross(f[0], f[1])
    n1 = [_add(x, y) for x, y in zip(_cross(e[0], f[1]), _cross(f[0], e[1]), strict=True)]
    k0, k3 = _dot(n0, tail_a), _dot(n2, tail_d)
    k1, k2 = _add(_dot(n1, tail_a), _dot(n0, tail_d)), _add(_dot(n2, tail_a), _dot(n1, tail_d))
    spread = absolute(k2[0] * k2[0] - 3 * k1[0] * k3[0])
    near = (spread < k2[0] * k2[0] / 64) & (absolute(k2[0]) < 1e3 * absolute(k3[0]))
    center = where(near, -k2[0] / where(near, 3 * k3[0], 1.0), 0.0)
    shift = (center, 0.0 * center)
    k2 = _add(k2, _multiply(k3, shift))
    k1 = _add(k1, _multiply(k2, shift))
    k0 = _add(k0, _multiply(k1, shift))
    k2 = _add(k2, _multiply(k3, shift))
    k1 = _add(k1, _multiply(k2, shift))
    k2 = _add(k2, _multiply(k3, shift))
    return (k0[0], k1[0], k2[0], k3[0]), center


def _sum(x: Array, y: Array) -> Pair:
    total = x + y
    part = total - x
    return total, (x - (total - part)) + (y - part)


def _difference(x: Array, y: Array) -> Pair:
    return _sum(x, -y)


def _halves(x: Array) -> Pair:
    """The upper half of the bits and the rest."""
    wide = x * (4097.0 if epsilon(x) > 1e-10 else 134217729.0)
    upper = wide - (wide - x)
    return upper, x - upper


def _multiply(x: Pair, y: Pair) -> Pair:
    product, (a, b), (c, d) = x[0] * y[0], _halves(x[0]), _halves(y[0])
    rest = ((a * c - product) + a * d + b * c) + b * d
    return _sum(product, rest + (x[0] * y[1] + x[1] * y[0]))


def _add(x: Pair, y: Pair) -> Pair:
    total, rest = _sum(x[0], y[0])
    return _sum(total, rest + (x[1] + y[1]))


def _cross(a: Sequence[Pair], b: Sequence[Pair]) -> list[Pair]:
    def component(i: int, j: int) -> Pair:
        first, second = _multiply(a[i], b[j]), _multiply(a[j], b[i])
        return _add(first, (-second[0], -second[1]))

    return [component(1, 2), component(2, 0), component(0, 1)]


def _dot(a: Sequence[Pair], b: Sequence[Pair]) -> Pair:
    return _add(_add(_multiply(a[0], b[0]), _multiply(a[1], b[1])), _multiply(a[2], b[2]))
