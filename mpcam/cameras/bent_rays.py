"""Images of points where a camera triangle bends the rays of an eye: interpolated normals, reflection or refraction.

The pixel's ray is a polynomial of higher degree there (a cubic direction for mirrors), so the triangle is cut into parts
whose rays are nearly linear. Each part's cubic gives starts, and Newton's method the images of the true rays.
"""

from collections.abc import Callable
from typing import Any

from mpcam.cameras import three_rays
from mpcam.math import Array, Vector, cross, detach, dot, epsilon, norm, normalize, vector, where

PARTS = 4  # along each side of a camera triangle
IMAGES = 4
MARGIN = 0.5
"""How far out of its part a start may lie, as a weight: the linear rays of a part miss the true ones by a little."""
_STEPS = 6

Bend = Callable[[Vector, Vector], tuple[Vector, Array]]
Image = tuple[Array, Array, Array, Array]


def project(bend: Bend, v: tuple[Vector, ...], n: tuple[Vector, ...], q: Vector) -> list[Image]:
    """Images of points q in camera triangles with corners v and normals n: weights 2 and 3, distance, validity.

    All three components first, broadcast against each other. bend: origin and normal to direction and validity. At most
    IMAGES of them are found, in no order.
    """

    def ray(second: Array, third: Array) -> tuple[Vector, Vector, Array]:
        origin, normal = (
            vector(*(c[0][k] + second * (c[1][k] - c[0][k]) + third * (c[2][k] - c[0][k]) for k in range(3)))
            for c in (v, n)
        )
        direction, valid = bend(origin, normal)
        return origin, normalize(direction), valid

    blank = 0.0 * (q[0] + v[0][0])
    found = [(blank, blank, blank, blank > 1.0) for _ in range(IMAGES)]
    for part, corners in enumerate(_parts()):
        rays = [ray(blank + second, blank + third) for second, third in corners]
        starts = three_rays.project(tuple(r[0] for r in rays), tuple(r[1] for r in rays), q, margin=MARGIN)
        known: list[tuple[Array, Array, Array]] = []
        for start in starts:
            weights = (start.w1, start.w2, 1.0 - start.w1 - start.w2)
            second, third = (detach(sum(w * c[i] for w, c in zip(weights, corners, strict=True))) for i in range(2))
            second, third, distance, good = _refined(ray, q, second, third, detach(start.c))
            good = good & start.valid & (_part_of(second, third) == part)
            for other_second, other_third, other_good in known:
                near = 1e3 * epsilon(second) ** 0.75
                same = (abs(other_second - second) < near) & (abs(other_third - third) < near)
                good = good & ~(other_good & same)
            known.append((second, third, good))
            found = _kept(found, (second, third, distance, good))
    return found


def _refined(ray: Any, q: Vector, second: Array, third: Array, distance: Array) -> tuple[Array, Array, Array, Array]:
    """Newton's method on origin + distance direction = q; weights, distance, and whether it came to rest inside.

    The derivative is that of the last step, which is the implicit-function theorem's.
    """
    small = epsilon(second)
    change, scale, valid = second, second, second > 0
    for step in range(_STEPS):
        last = step == _STEPS - 1
        if last:
            second, third, distance = detach(second), detach(third), detach(distance)
        origin, direction, valid = ray(second, third)
        miss = vector(*(origin[k] + distance * direction[k] - q[k] for k in range(3)))
        h = 0.3 * small**0.5
        columns = []
        for sideways in (ray(second + h, third), ray(second, third + h)):
            columns.append(
                vector(*(detach((sideways[0][k] - origin[k] + distance * (sideways[1][k] - direction[k])) / h) for k in range(3)))
            )
        a, b, c = *columns, detach(direction)
        across = cross(b, c)
        volume = dot(a, across)
        usable = abs(volume) > 1e-12 * norm(a) * norm(b)
        inverse = where(usable, 1.0 / where(usable, volume, 1.0), 0.0)
        steps = (dot(miss, across) * inverse, dot(miss, cross(c, a)) * inverse, dot(miss, cross(a, b)) * inverse)
        # Not out of sight in one step: the linear part's start is near.
        damp = 1.0 if last else where(abs(steps[0]) + abs(steps[1]) > 0.5, 0.5 / (abs(steps[0]) + abs(steps[1]) + 1e-30), 1.0)
        second, third, distance = second - damp * steps[0], third - damp * steps[1], distance - damp * steps[2]
        change = abs(steps[0]) + abs(steps[1])
        scale = abs(distance) + norm(vector(*(origin[k] - q[k] for k in range(3))))
        valid = valid & usable
    rest = (change < 30.0 * small**0.75) & (norm(miss) <= 100.0 * small**0.75 * (scale + norm(a) + norm(b)))  # pyright: ignore[reportPossiblyUnboundVariable]
    edge = -three_rays.INSIDE * (1.0 if small < 1e-10 else 1.0)
    inside = (second >= edge) & (third >= edge) & (1.0 - second - third >= edge)
    return second, third, distance, valid & rest & inside & (distance >= 0)


def _parts() -> list[tuple[tuple[float, float], ...]]:
    """Weights 2 and 3 of the corners of each part."""
    step, parts = 1.0 / PARTS, []
    for j in range(PARTS):
        for i in range(PARTS - j):
            a, b, c, d = ((i + x, j + y) for x, y in ((0, 0), (1, 0), (0, 1), (1, 1)))
            parts.append((a, b, c))
            if i + j < PARTS - 1:
                parts.append((d, c, b))
    return [tuple((x * step, y * step) for x, y in part) for part in parts]


def _part_of(second: Array, third: Array) -> Array:
    """Number of the part that weights lie in, as a float; those a little outside belong to the nearest."""
    x, y = _clipped(second * PARTS), _clipped(third * PARTS)
    column, row = sum(where(x >= k, 1.0, 0.0 * x) for k in range(1, PARTS)), sum(where(y >= k, 1.0, 0.0 * y) for k in range(1, PARTS))
    beyond = column + row > PARTS - 1
    column = where(beyond & (x - column <= y - row), column - 1.0, column)
    row = where(beyond & (column + row > PARTS - 1), row - 1.0, row)
    lower = (column + row < PARTS - 1) & (x - column + (y - row) > 1.0)
    # Rows before hold 2 (PARTS - r) - 1 parts each.
    return row * (2.0 * PARTS - row) + 2.0 * column + where(lower, 1.0, 0.0 * x)


def _clipped(x: Array) -> Array:
    return where(x > 0, where(x < PARTS, x, 0.0 * x + PARTS), 0.0 * x)


def _kept(found: list[Image], image: Image) -> list[Image]:
    """The list with one more image in its first free place."""
    *values, left = image
    result = []
    for slot in found:
        put = left & ~slot[3]
        result.append((*(where(put, new, old) for new, old in zip(values, slot, strict=False)), slot[3] | put))
        left = left & ~put
    return result
