"""The single-pole occlusion camera by its definition at 50 digits: a pinhole's pixel, and how far it is moved.

A ray is the points of all depths whose images are one pixel. Its length is that of the straight lines between its
points at z = 0, near, far and its end, which tests prove to be on it. How much rounding counts is found by doing it:
each number that goes in is moved by half of its last place, to both sides, so limits of ranges need no special care.
"""

from typing import Any

from mpcam.cameras.single_pole import SinglePoleOcclusion
from mpcam.stress.exact import DIGITS, Real

Numbers = list[Real]
"""fx, fy, cx, cy, pole, near, far, shift_near, shift_far."""


def numbers(camera: SinglePoleOcclusion) -> list[float]:
    """A camera's numbers in the order of `Numbers`."""
    lens = camera.fx, camera.fy, camera.cx, camera.cy, *camera.pole
    return [*lens, camera.near, camera.far, camera.shift_near, camera.shift_far]


def shift(z: Real, values: Numbers) -> Real:
    """d(z) = a + b / z between the limits, constant outside; a step where there is nothing between them."""
    near, far, least, most = values[6:]
    if z <= near or z >= far:
        return least if z <= near and not z >= far else most
    return least + (most - least) * (1 / near - 1 / z) / (1 / near - 1 / far)


def pixel_of(x: Real, y: Real, z: Real, values: Numbers) -> tuple[Real, Real]:
    """Where a point with z > 0 lands; on the pole's axis to the right of the pole."""
    fx, fy, cx, cy, pole_u, pole_v = values[:6]
    u, v = cx + fx * x / z, cy + fy * y / z
    along = _unit(u - pole_u, v - pole_v)
    moved = shift(z, values)
    return u + moved * along[0], v + moved * along[1]


def point_at(u: Real, v: Real, z: Real, values: Numbers) -> list[Real]:
    """The point at depth z whose image is (u, v)."""
    fx, fy, cx, cy, pole_u, pole_v = values[:6]
    along = _unit(u - pole_u, v - pole_v)
    back = shift(z, values)
    return [z * (u - back * along[0] - cx) / fx, z * (v - back * along[1] - cy) / fy, z]


def distance(u: Real, v: Real, values: Numbers) -> Real:
    """Pixels from the pole."""
    import mpmath

    return mpmath.hypot(u - values[4], v - values[5])


def end_of_middle(u: Real, v: Real, values: Numbers) -> Real:
    """Depth z at which the middle piece ends: on the pole's axis, or at the far limit."""
    near, far, least, most = values[6:]
    r = distance(u, v, values)
    if r >= most or most <= least or near >= far:
        return max(near, far)
    if r <= least:
        return near
    return 1 / (1 / near - (1 / near - 1 / far) * (r - least) / (most - least))


def depth_of(x: Real, y: Real, z: Real, values: Numbers) -> Real:
    """Length of the bent ray from the eye to a point."""
    u, v = pixel_of(x, y, z, values)
    knots = [values[6], values[7]]
    places = [[0, 0, 0], *(point_at(u, v, knot, values) for knot in knots if knot < z), [x, y, z]]
    return sum(_apart(p, q) for p, q in zip(places, places[1:], strict=False))


def bent_ray(u: Real, v: Real, values: Numbers) -> dict[str, list[Real]]:
    """The ray of a pixel: vectors and lengths by name, continued smoothly where there is no such piece."""
    near, far = values[6], values[7]
    first = point_at(u, v, near, _with(values, 9, values[8]))
    last = point_at(u, v, far, _with(values, 8, values[9]))
    depth = end_of_middle(u, v, values)
    ways = [_unit3(first), _unit3([q - p for p, q in zip(first, last, strict=True)]), _unit3(last)]
    start = _apart([0, 0, 0], first)
    share = (depth - near) / (far - near) if far > near else 0
    end = start + share * _apart(first, last)
    back = [p - start * d for p, d in zip(first, ways[1], strict=True)]
    directions = {f"direction {k}": way for k, way in enumerate(ways)}
    return {**directions, "origin 1": first, "origin 2": last, "start 1": [start], "end 1": [end], "produced": back}


def conditions(function: Any, given: list[Real], step: Real) -> list[Real]:
    """By how much each of several lists of numbers changes, in all, if each of those given changes by so many parts.

    In units of the step, so that times a precision's eps it is the error that rounding makes unavoidable.
    """
    parts = function(given)
    sums = [max(map(abs, part)) for part in parts]
    for i, value in enumerate(given):
        if value == 0:
            continue
        most = [0] * len(parts)
        for sign in (1, -1):
            moved = [*given]
            moved[i] = value * (1 + sign * step)
            changes = [
                max(abs(p - q) for p, q in zip(new, old, strict=True))
                for new, old in zip(function(moved), parts, strict=True)
            ]
            most = [max(pair) for pair in zip(most, changes, strict=True)]
        sums = [total + change / step for total, change in zip(sums, most, strict=True)]
    return sums


def exact(values: Any) -> list[Real]:
    """Floats as numbers of mpmath."""
    import mpmath

    with mpmath.workdps(DIGITS):
        return [mpmath.mpf(float(value)) for value in values]


def _with(values: Numbers, index: int, value: Real) -> Numbers:
    return [*values[:index], value, *values[index + 1 :]]


def _unit(u: Real, v: Real) -> tuple[Real, Real]:
    import mpmath

    length = mpmath.hypot(u, v)
    return (u / length, v / length) if length else (mpmath.mpf(1), mpmath.mpf(0))


def _apart(p: list[Real], q: list[Real]) -> Real:
    import mpmath

    return mpmath.sqrt(sum((a - b) ** 2 for a, b in zip(p, q, strict=True)))


def _unit3(way: list[Real]) -> list[Real]:
    length = _apart([0, 0, 0], way)
    return [part / length for part in way] if length else way
