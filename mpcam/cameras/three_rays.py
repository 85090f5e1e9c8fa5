"""The camera with three rays: where a point appears between the rays of a camera triangle.

A camera triangle (Hou et al. 2006; the continuous 3-ray camera of Popescu et al. 2006) has corners v_i and directions
d_i, and the ray of weights w leaves p(w) = sum w_i v_i along D(w) = sum w_i d_i. A point q appears at w if
q = p(w) + c D(w). Then q lies in the plane of the swept triangle v_i + c d_i, so c is a root of a cubic, and there are
three images at most.
"""

from typing import Any, NamedTuple

import numpy as np

from mpcam.math import Array, absolute, detach, epsilon, library, maximum, minimum, vector, where
from mpcam.math.cubic import Root, cubic_roots, determinant_cubic
from mpcam.math.roots import repeat

SLACK = 4.0
"""Rounding that is forgiven at the edges of the triangle and at c = 0, in units of eps times the condition number."""

LARGEST_SLACK = 2.0**-10
"""The same at most, as a weight, and as a fraction of the distance."""

UNCERTAIN = 0.25
"""Weights that rounding may change by this much are no image: slits, centers and the like."""

RESIDUAL = 64.0
"""Largest |p + c D - q| of an image, component by component, in units of eps times the sum of the magnitudes."""

COLLAPSED = 16.0
"""Swept triangles whose normal is uncertain by 1 / this have collapsed, and so have rays whose direction is."""

FOLD = 2.0**-6
"""Where the determinant of the derivatives, columns scaled to 1, is below this many eps, an image has no derivative."""

POLISH = 3
"""Newton's steps on all three unknowns, after the cubic."""

AWAY = 64.0
"""Growth of the residual that one of these steps may cause while it is too large."""

FAR = 1e9
"""Weights are kept within this, so that they do not overflow."""

Triple = tuple[Any, Any, Any]


class Image(NamedTuple):
    """Weights of corners 1 and 2 (the third is 1 - w1 - w2), and c >= 0, so that q = p + c D; all 0 where invalid."""

    w1: Array
    w2: Array
    c: Array
    valid: Array


def project(v: Any, d: Any, q: Any) -> tuple[Image, Image, Image]:
    """The images of a point in a camera triangle, in rising order of c; any of the three may be invalid.

    v, d: three corners and three directions, each of three components; q: a point. All components broadcast. Lengths of
    d are free: they scale with 1 / c, and their ratios decide which camera it is. A point on the camera triangle
    counts, at c = 0, and so does a weight that is negative by rounding only. Images where the ray's points form a
    family of more than one (slits, centers, everything in one plane) are invalid, as are numbers that are none.

    Derivatives with respect to v, d and q come from the implicit-function theorem (Newton's step on detached
    arguments); they are zero where invalid and on folds (caustics), where they are infinite.
    """
    (v1, v2, v3), (d1, d2, d3) = v, d
    given = [_triple(x) for x in (v1, v2, v3, d1, d2, d3, q)]
    if all(type(x) in (int, float) for row in given for x in row):
        given[0] = _triple(np.float64(x) for x in given[0])  # so that comparisons can be negated by ~
    largest = _largest(*given)
    limit = 1e15 if epsilon(largest) > 1e-10 else 1e100  # ratios of three such numbers do not overflow
    fine = largest < limit
    given = [_below(x, limit) for x in given]
    corners, rays, point = given[:3], given[3:6], given[6]
    fixed = [tuple(detach(x) for x in row) for row in given]
    frame = _Scaled(fixed[:3], fixed[3:6], fixed[6])
    k, center = determinant_cubic(frame.a, frame.d)
    roots = cubic_roots(*k, -LARGEST_SLACK - center, 1.0 / frame.eps - center)
    roots = [Root(center + root, exists) for root, exists in roots]
    some = fine & (frame.longest > 0) & (frame.farthest > 0)

    def images(x: Array, exists: Array, others: list[Root]) -> Image:
        return _differentiable(corners, rays, point, frame, frame.image(x, some & exists, others))

    def stacked(order: tuple[int, int, int]) -> Root:
        return Root(vector(*[roots[i].root for i in order]), vector(*[roots[i].exists for i in order]))

    first, second, third = roots
    if library(largest) == "drjit":
        one, two, three = (
            images(*first, [second, third]),
            images(*second, [first, third]),
            images(*third, [first, second]),
        )
        return one, two, three
    result = images(*stacked((0, 1, 2)), [stacked((1, 2, 0)), stacked((2, 0, 1))])  # a third of the code to compile
    one, two, three = [Image(*(part[i] for part in result)) for i in range(3)]
    return one, two, three


def inside(w1: Array, w2: Array, slack: Triple | Array = 0.0) -> Array:
    """Whether weights are those of a point in the triangle, up to a slack, one for all three or one for each."""
    s1, s2, s3 = slack if isinstance(slack, tuple) else (slack, slack, slack)
    return (w1 >= -s1) & (w2 >= -s2) & (1.0 - w1 - w2 >= -s3)


class _Guess(NamedTuple):
    """Unknowns near a solution, what Newton's step for them takes, and how far rounding carries.

    value: the sum below. rows: of the inverse of its derivatives; zero on folds. error: largest component of the sum,
    relative to its terms. slack, slack_x: what is forgiven. sound: the ray has a direction, and the weights are more
    than rounding.
    """

    w1: Array
    w2: Array
    x: Array
    rows: tuple[Triple, Triple, Triple]
    value: Triple
    error: Array
    slack: Triple
    slack_x: Array
    sound: Array


class _Scaled:
    """A triangle seen from the point, in units of the largest distance and of the longest direction; a constant.

    The equations are sum w_i (a_i + x d_i) = 0 with x = c * longest / farthest. a: corners minus the point. e, f:
    corners and directions 1 and 2 minus the third.
    """

    def __init__(self, corners: list[Triple], rays: list[Triple], point: Triple):
        a = [_minus(corner, point) for corner in corners]
        self.farthest, self.longest = _largest(*a), _largest(*rays)
        self.per_distance = 1.0 / where(self.farthest > 0, self.farthest, 1.0)
        self.per_length = 1.0 / where(self.longest > 0, self.longest, 1.0)
        self.a, self.d = [_times(x, self.per_distance) for x in a], [_times(x, self.per_length) for x in rays]
        self.e = [_times(_minus(corners[i], corners[2]), self.per_distance) for i in range(2)]
        self.f = [_times(_minus(rays[i], rays[2]), self.per_length) for i in range(2)]
        self.eps = epsilon(self.per_distance + self.per_length)

    def image(self, x: Array, exists: Array, others: list[Root]) -> tuple[_Guess, Array]:
        """The weights at a root of the cubic, polished together with it, and whether they are an image."""

        def step(now: _Guess) -> _Guess:
            # From a value that is held: a compiler that works it out anew for each row, with other roundings, would
            # spoil what is left of the rows' difference.
            trial = self.guess(*(u - _dot(row, now.value) for u, row in zip(now[:3], now.rows, strict=True)))
            # The first steps may lead away; as long as there is no image yet, they are not held to every one.
            better = (trial.error <= now.error) | (
                (now.error > 0.5 * RESIDUAL * self.eps) & (trial.error <= AWAY * now.error)
            )
            for root, there in others:  # each image stays with its own root
                better = better & (~there | (absolute(trial.x - x) <= absolute(trial.x - root)))
            return _chosen(better, trial, now)

        w1, w2 = self.weights(x)
        zero = 0.0 * (w1 + w2 + x)
        zeros, no = (zero, zero, zero), zero > 1.0
        blank = _Guess(w1 + zero, w2 + zero, x + zero, (zeros, zeros, zeros), zeros, zero + 1e9, zeros, zero, no)
        now = repeat(step, blank, POLISH + 1)
        normal, _, _, alpha, beta = self.plane(now.x)
        spread = [_largest(self.e[i]) + absolute(now.x) * _largest(self.f[i]) for i in range(2)]
        flat = _largest(normal) <= COLLAPSED * self.eps * (spread[0] / alpha + spread[1] / beta)
        valid = exists & ~flat & now.sound & (now.error <= RESIDUAL * self.eps)
        return now, valid & inside(now.w1, now.w2, now.slack) & (now.x >= -now.slack_x)

    def plane(self, x: Array) -> tuple[Triple, Triple, Triple, Array, Array]:
        """Normal of the swept triangle, and the edges that it is the product of, scaled to 1, with their lengths."""
        a, alpha = _unit(_along(self.e[0], x, self.f[0]))
        b, beta = _unit(_along(self.e[1], x, self.f[1]))
        return _cross(a, b), a, b, alpha, beta

    def weights(self, x: Array) -> tuple[Array, Array]:
        """Weights of the point of the swept triangle's plane that is nearest."""
        normal, a, b, alpha, beta = self.plane(x)
        p = _along(self.a[2], x, self.d[2])
        square = _dot(normal, normal)
        factor = 1.0 / where(square > self.eps * self.eps, square, 1.0)
        w1, w2 = _dot(normal, _cross(b, p)) * factor / alpha, _dot(normal, _cross(p, a)) * factor / beta
        return minimum(maximum(w1, -FAR), FAR), minimum(maximum(w2, -FAR), FAR)

    def guess(self, w1: Array, w2: Array, x: Array) -> _Guess:
        """What is known here."""
        w = (w1, w2, 1.0 - w1 - w2)
        terms = [_along(self.a[i], x, self.d[i]) for i in range(3)]
        value = _weighted(w, terms)
        sizes = [_along(_absolute(self.a[i]), absolute(x), _absolute(self.d[i])) for i in range(3)]
        size = _weighted(_absolute(w), sizes)
        # The third weight is as exact as the sum that it comes from.
        bound = _weighted((absolute(w1), absolute(w2), 1.0 + absolute(w1) + absolute(w2)), sizes)
        normal, a, b, alpha, beta = self.plane(x)
        direction = _weighted(w, self.d)
        longest = _largest(*[_times(self.d[i], w[i]) for i in range(3)])
        d, gamma = _unit(direction)
        det = _dot(normal, d)
        regular = absolute(det) > FOLD * self.eps
        per_det = where(regular, 1.0 / where(regular, det, 1.0), 0.0)
        rows = (
            _times(_cross(b, d), per_det / alpha),
            _times(_cross(d, a), per_det / beta),
            _times(normal, per_det / gamma),
        )
        forgiven = SLACK * self.eps
        third = _times(_plus(rows[0], rows[1]), -1.0)
        carried = [forgiven * _dot(_absolute(row), size) for row in (rows[0], rows[1], third, rows[2])]
        s1, s2, s3, s4 = [minimum(forgiven + x, LARGEST_SLACK) for x in carried]
        relative = [absolute(u) / where(s > 0, s, 1.0) for u, s in zip(value, bound, strict=True)]
        return _Guess(
            *(w1, w2, x, rows, value),
            error=maximum(maximum(relative[0], relative[1]), relative[2]),
            slack=(s1, s2, s3),
            slack_x=s4,
            sound=(_largest(direction) > COLLAPSED * self.eps * longest)
            & (maximum(carried[0], carried[1]) < UNCERTAIN),
        )


def _differentiable(corners: list[Triple], rays: list[Triple], point: Triple, frame: _Scaled, image: Any) -> Image:
    """The image in the caller's units, with the derivative of one Newton step."""
    now, valid = image
    unknowns, per_c = [now.w1, now.w2, maximum(now.x, 0.0)], frame.farthest * frame.per_length
    if library(*unknowns) != "numpy":
        w = (now.w1, now.w2, 1.0 - now.w1 - now.w2)
        a = [_times(_minus(corner, point), frame.per_distance) for corner in corners]
        value = _weighted(w, [_along(a[i], now.x * frame.per_length, rays[i]) for i in range(3)])
        steps = [_dot(row, value) for row in now.rows]
        unknowns = [u - (step - detach(step)) for u, step in zip(unknowns, steps, strict=True)]
    w1, w2, x = [where(valid, u, 0.0) for u in unknowns]
    return Image(w1, w2, x * per_c, valid)


def _chosen(condition: Array, new: Any, old: Any) -> Any:
    """`where` on nested tuples."""
    if not isinstance(new, tuple):
        return where(condition, new, old)
    parts = [_chosen(condition, x, y) for x, y in zip(new, old, strict=True)]
    return type(new)(*parts) if isinstance(new, _Guess) else tuple(parts)


def _below(a: Triple, limit: float) -> Triple:
    """The vector without components beyond a limit, and without those that are no numbers."""
    x, y, z = [where(absolute(component) < limit, component, 0.0) for component in a]
    return x, y, z


def _triple(p: Any) -> Triple:
    x, y, z = p
    return x, y, z


def _minus(a: Triple, b: Triple) -> Triple:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _plus(a: Triple, b: Triple) -> Triple:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _times(a: Triple, s: Array) -> Triple:
    return a[0] * s, a[1] * s, a[2] * s


def _along(a: Triple, s: Array, b: Triple) -> Triple:
    """a + s b."""
    return a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]


def _weighted(w: Triple, a: list[Triple]) -> Triple:
    return _plus(_plus(_times(a[0], w[0]), _times(a[1], w[1])), _times(a[2], w[2]))


def _absolute(a: Triple) -> Triple:
    return absolute(a[0]), absolute(a[1]), absolute(a[2])


def _dot(a: Triple, b: Triple) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Triple, b: Triple) -> Triple:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _largest(*vectors: Triple) -> Array:
    """Largest magnitude of all components."""
    result = absolute(vectors[0][0])
    for x in [x for a in vectors for x in a][1:]:
        result = maximum(result, absolute(x))
    return result


def _unit(a: Triple) -> tuple[Triple, Array]:
    """The vector with largest component 1, and its factor; a zero vector stays as it is."""
    length = _largest(a)
    length = where(length > 0, length, 1.0)
    return _times(a, 1.0 / length), length
