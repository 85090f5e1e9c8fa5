"""All real roots of a cubic on an interval, without branches, alike for NumPy, JAX and Dr.Jit arrays.

After Yuksel, "High-performance polynomial root finding for graphics" (2022): the derivative's roots cut the interval
into monotone pieces, and each piece has one root at most.
"""

from typing import NamedTuple

from mpcam.math.arrays import Array, absolute, detach, epsilon, maximum, minimum, sqrt, where
from mpcam.math.roots import bracketed_newton, polynomial

STEPS = 8
"""Newton's steps per root: the start is off by a factor of two at most, so that these reach float64."""


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
    left_half = (inflection != first) & _opposite(polynomial(k, first), polynomial(k, inflection))
    start, end = where(left_half, first, last), where(left_half, last, first)
    # From its anchor, an extremum or the inflection, each piece rises or falls as a power of the distance.
    found = (
        _piece(k, first, low, first - low),
        _piece(k, start, end, absolute(inflection - start)),
        _piece(k, last, high, high - last),
    )
    twice = monotone & found[0][1] & (polynomial(k, last) == 0)  # a single root at the inflection
    exists = (found[0][1] & some, found[1][1] & some & ~monotone, found[2][1] & some & ~twice)
    roots = [where(there, root * reach, 0.0) for (root, _), there in zip(found, exists, strict=True)]
    return tuple(Root(_differentiable(given, x, there), there) for x, there in zip(roots, exists, strict=True))


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
    term makes up for |f(0)| is above the root (up to 1.3 in the piece between the extrema), and below twice the root.
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
