"""Distortion by Brown and Conrady: a map of the plane that folds, and its inverse on the part that has not.

With q = (p2, p1), s = x^2 + y^2 and the ratio R(s) of two polynomials, the image of (x, y) is

    F(x) = (R(s) + 2 q.x) x + s q,

which is the gradient of P(s) / 2 + s q.x, P' = R. So its derivative is symmetric, and on each circle around the axis
the potential minus y.x is a cosine of the azimuth, lowest along m = y - s q. Hence a point of radius r has the image y
only if it lies along m, and r R(s) + 2 s q.m / |m| = |m|: one equation in r alone.
"""

from typing import NamedTuple

from mpcam.math import Array, absolute, detach, epsilon, polynomial, safe_sqrt, sqrt, where
from mpcam.math.roots import repeat

STEPS = 32
"""Of random lenses, wild ones too, none needs more than 28."""

_NUDGE = 1 / 16  # of the bracket, from the end that a step would cross
_ROUNDING = 2  # roundings in the sum that decides whether a root was found
NO_EDGE = -1e6


class Reach(NamedTuple):
    """The part of the plane around the axis where the map is one to one; radii are tangents of angles.

    inner: the circle within which all points belong to it. outer: the circle that holds it. level: between the two, the
    component of q along a point's azimuth must be above this and above `Distortion.edge`. rim: the circle, in focal
    lengths, that holds the image.
    """

    inner: Array
    outer: Array
    level: Array
    rim: Array


class Distortion(NamedTuple):
    """k: k1 to k6, numerator first; q: (p2, p1)."""

    k: tuple[Array, ...]
    q: tuple[Array, Array]

    def still(self) -> "Distortion":
        """The same, a constant to gradients."""
        return Distortion(tuple(detach(k) for k in self.k), (detach(self.q[0]), detach(self.q[1])))

    def parts(self) -> tuple[tuple[Array, ...], tuple[Array, ...]]:
        """Coefficients of the numerator and the denominator of R."""
        return (1.0, *self.k[:3]), (1.0, *self.k[3:])

    def size(self) -> Array:
        """|q|."""
        return sqrt(self.q[0] * self.q[0] + self.q[1] * self.q[1])

    def ratio(self, s: Array) -> tuple[Array, Array, Array]:
        """R(s) and its first two derivatives."""
        (value, slope, bend), below = _jet(self.k[:3], s), _jet(self.k[3:], s)
        inverse = 1.0 / below[0]
        first = value * inverse
        second = (slope - first * below[1]) * inverse
        return first, second, (bend - 2.0 * second * below[1] - first * below[2]) * inverse

    def image(self, x: Array, y: Array) -> tuple[Array, Array]:
        """F at (x, y)."""
        s = x * x + y * y
        common = self.ratio(s)[0] + 2.0 * (self.q[0] * x + self.q[1] * y)
        return x * common + s * self.q[0], y * common + s * self.q[1]

    def turned(self, x: Array, y: Array) -> tuple[Array, Array]:
        """q.x and q cross x: what q is along a point and across it, times its radius."""
        return self.q[0] * x + self.q[1] * y, self.q[0] * y - self.q[1] * x

    def unfolded(self, s: Array, along: Array, across: Array) -> Array:
        """Whether points lie on the arc of their circle around q where both eigenvalues of F' are positive.

        On a circle the determinant is a quadratic polynomial of 4 q.x: (4 q.x + B)^2 - E; the arc is beyond its larger
        root, or the whole circle where it has none.
        """
        value, slope, _ = self.ratio(s)
        determinant = (value + 2.0 * along) * (value + 2.0 * s * slope + 6.0 * along) - 4.0 * across * across
        beyond = value + 0.5 * s * slope + 4.0 * along > 0
        return where(beyond, determinant > 0, self._excess(s, value, slope) < 0)

    def _excess(self, s: Array, value: Array, slope: Array) -> Array:
        """E / s."""
        return 0.25 * s * slope * slope - value * slope + 4.0 * (self.q[0] * self.q[0] + self.q[1] * self.q[1])

    def edge(self, r: Array) -> Array:
        """Component of q along the azimuth where the unfolded arc of a circle ends; NO_EDGE where it is whole."""
        s = r * r
        value, slope, _ = self.ratio(s)
        half, excess = value + 0.5 * s * slope, s * self._excess(s, value, slope)
        root = safe_sqrt(excess)
        ahead = half > 0
        # The larger root of the quadratic polynomial, without cancellation.
        larger = where(ahead, (excess - half * half) / where(ahead, half + root, 1.0), root - half)
        return where(excess >= 0, larger / (4.0 * r), NO_EDGE)

    def holds(self, reach: Reach, x: Array, y: Array) -> Array:
        """Whether points are where the map is one to one."""
        s = x * x + y * y
        inner, outer, level, _ = reach
        along, across = self.turned(x, y)
        r = safe_sqrt(s)
        near = r <= outer * (1.0 + 4.0 * epsilon(r))
        return near & ((r < inner) | (self.unfolded(s, along, across) & (along > level * r)))

    def undistorted(self, reach: Reach, u: Array, v: Array, doubt: Array) -> tuple[Array, Array, Array]:
        """The point whose image is (u, v), and whether there is one where the map is one to one.

        doubt: how far off (u, v) may be by rounding; images so little beyond a fold count as on it. The derivative is
        that of the implicit-function theorem: one Newton step of the map of the plane.
        """
        still = self.still()
        x, y, valid = still._solved(reach, detach(u), detach(v), detach(doubt))
        s = x * x + y * y
        value, slope, _ = still.ratio(s)
        common = value + 2.0 * still.turned(x, y)[0]
        xx = common + 2.0 * slope * x * x + 4.0 * still.q[0] * x
        yy = common + 2.0 * slope * y * y + 4.0 * still.q[1] * y
        xy = 2.0 * slope * x * y + 2.0 * (x * still.q[1] + y * still.q[0])
        determinant = xx * yy - xy * xy
        regular = valid & (determinant > 0)
        inverse = where(regular, 1.0 / where(regular, determinant, 1.0), 0.0)
        off_u, off_v = self.image(x, y)
        off_u, off_v = off_u - u, off_v - v
        step_x, step_y = (yy * off_u - xy * off_v) * inverse, (xx * off_v - xy * off_u) * inverse
        # Only their derivatives: near a fold the steps themselves are rounding noise.
        return x - (step_x - detach(step_x)), y - (step_y - detach(step_y)), valid

    def _solved(self, reach: Reach, u: Array, v: Array, doubt: Array) -> tuple[Array, Array, Array]:
        """The root in r between 0 and where the point along m leaves the reach.

        There the function has one root at most, where it rises. Along the way q.m / |m| only falls, and the reach only
        shrinks, so the point leaves it once: whatever is beyond counts as above the root, and bisection holds.
        """
        length = safe_sqrt(u * u + v * v)
        inner, outer, level, _ = reach

        def at(r: Array) -> tuple[Array, ...]:
            s = r * r
            m = u - s * self.q[0], v - s * self.q[1]
            size = safe_sqrt(m[0] * m[0] + m[1] * m[1])
            inverse = 1.0 / where(size > 0, size, 1.0)
            m = m[0] * inverse, m[1] * inverse
            along, across = self.turned(*m)
            value, slope, bend = self.ratio(s)
            turn = 4.0 * s * across * across * inverse
            function = r * value + 2.0 * s * along - size
            rise = value + 2.0 * s * slope + 6.0 * r * along - r * turn
            curve = 6.0 * r * slope + 4.0 * r * s * bend + 6.0 * along - 6.0 * turn * (1.0 + s * along * inverse)
            inside = (r < inner) | (self.unfolded(s, r * along, r * across) & (along > level))
            return function, rise, curve, inside, *m

        def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
            below, above, r, before = state
            function, rise, curve, inside, _, _ = at(r)
            left = inside & (function <= 0)
            below, above = where(left, r, below), where(left, above, r)
            # The root of the quadratic model, or where the model is largest: a fold is quadratic.
            square, rising = rise * rise - 2.0 * function * curve, rise > 0
            real = square >= 0
            divisor = where(real, where(rising, rise, 1.0) + safe_sqrt(square), curve)
            guess, nudge = r - where(real, 2.0 * function, rise) / divisor, _NUDGE * (above - below)
            guess = where(guess > above, above - nudge, where(guess < below, below + nudge, guess))
            usable = inside & rising & (absolute(guess - r) <= 0.5 * before + 4.0 * epsilon(r) * r)
            middle = sqrt((1.0 + below) * (1.0 + above)) - 1.0
            after = where(inside & (function == 0), r, where(usable, guess, middle))
            # After a bisection, any step within the bracket may follow.
            return below, above, after, where(usable, absolute(after - r), 2.0 * (above - below))

        zero = 0.0 * (at(0.0 * length)[0] + outer)  # of the type that the result has
        above = zero + outer
        start = where(length < above, length, above)
        below, _, r, _ = repeat(step, (zero, above, start, above), STEPS)
        r = where(at(r)[3], r, below)  # the last step may have left the reach
        function, rise, _, _, x, y = at(r)
        s = r * r
        sizes = [polynomial([absolute(c) for c in part], s) for part in self.parts()]
        rounding = (sizes[0] + sizes[1] * absolute(self.ratio(s)[0])) / polynomial(self.parts()[1], s)
        scale = length + r * (rounding + absolute(rise)) + 3.0 * s * (absolute(self.q[0]) + absolute(self.q[1]))
        return r * x, r * y, absolute(function) <= doubt + _ROUNDING * epsilon(r) * scale


def _jet(coefficients: tuple[Array, ...], s: Array) -> tuple[Array, Array, Array]:
    """1 + a s + b s^2 + c s^3 and its first two derivatives."""
    a, b, c = coefficients
    return polynomial((1.0, a, b, c), s), polynomial((a, 2.0 * b, 3.0 * c), s), 2.0 * b + 6.0 * c * s
