"""Horizon-based ambient occlusion: how high the surfaces of a z-buffer rise around a point (Bavoil and Sainz 2008).

From the image of the point, lines run through the z-buffer. Each step gives a sample of a surface. What lies between
its elevation above the plane at right angles to the view and that of the tangent plane in the same azimuth is covered.
Azimuths are those of the sample itself, not of the line: it lies beside the line, at the middle of its pixel.

With a thickness, a sample covers no more than what lies before it and so far behind it along the view; what is covered
along a line is kept as a set of sectors, one bit each (Therrien, Levesque and Gilet 2023).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

TURN = 6.283185307179586
SECTORS = 32
"""For each unit of the sine of the elevation, which runs over two of them."""
FALLOFFS = ("quadratic", "linear", "none")


@dataclass(frozen=True)
class PlanarBuffer:
    """A pinhole's z-buffer. z: Float, row by row, infinite where nothing is; fx, fy, cx, cy: Float of one entry."""

    z: Any
    fx: Any
    fy: Any
    cx: Any
    cy: Any

    def point(self, types: Any, column: Any, row: Any, pixel: Any, active: Any) -> Any:
        """Points (Array3f) at the middle of pixels; z is infinite or 0 where there is none."""
        z = dr.gather(types.Float, self.z, pixel, active)
        x = (types.Float(column) + 0.5 - self.cx) / self.fx
        y = (types.Float(row) + 0.5 - self.cy) / self.fy
        return types.Array3f(x * z, y * z, z)


@dataclass(frozen=True)
class PointBuffer:
    """Points (flat Float, three numbers each, row by row) of any image; z is infinite where nothing is."""

    points: Any

    def point(self, types: Any, column: Any, row: Any, pixel: Any, active: Any) -> Any:
        """As `PlanarBuffer.point`."""
        return dr.gather(types.Array3f, self.points, pixel, active)


def noise(types: Any, pixel: Any) -> tuple[Any, Any]:
    """Two numbers from 0 to 1 of each pixel number, as good as random and always the same (PCG, O'Neill 2014)."""
    state = pixel * types.UInt(747796405) + types.UInt(2891336453)
    first = _permuted(types, state)
    second = _permuted(types, first * types.UInt(747796405) + types.UInt(2891336453))
    scale = 2.0**-24
    return types.Float(first >> 8) * scale, types.Float(second >> 8) * scale


def _permuted(types: Any, state: Any) -> Any:
    word = ((state >> ((state >> 28) + 4)) ^ state) * types.UInt(277803737)
    return (word >> 22) ^ word


def covered(
    types: Any,
    buffer: Any,
    size: tuple[int, int],
    point: Any,
    normal: Any,
    view: Any,
    lines: Callable[[Any], tuple[Any, Any, Any, Any]],
    radius: Any,
    bias: Any,
    spin: tuple[Any, Any],
    directions: int,
    steps: int,
    falloff: str,
    active: Any,
    thickness: Any = None,
) -> Any:
    """Share (Float, 0 to 1) of the solid angle above surfaces that nearer ones than a radius cover, by weight.

    size: width and height of the buffer's image. point, normal, view: Array3f; normal and view are of length 1, view
    points to where the buffer is seen from. lines: of a direction at right angles to the view, where its line starts
    in the image and how far it runs within the radius (u, v, du, dv, pixels). spin: numbers from 0 to 1 by which lines
    are turned and steps are shifted. bias: sine of the angle above the tangent plane below which nothing counts.
    falloff: one of FALLOFFS. thickness: Float, one for each pixel of the buffer, how far its sample reaches back; None:
    without end, which is for points with normal . view > 0 alone.
    """
    width, height = size
    facing = dr.dot(normal, view)
    side = dr.select(facing >= 0, types.Float(1.0), -1.0)
    first, second = _across(types, view)

    def weight(distance: Any) -> Any:
        if falloff == "none":
            return types.Float(1.0)
        part = distance / radius
        return 1.0 - (part * part if falloff == "quadratic" else part)

    def along(number: Any, total: Any) -> Any:
        sine, cosine = dr.sincos((types.Float(number) + spin[0]) * (TURN / directions))
        u, v, du, dv = lines(first * cosine + second * sine)
        length = dr.sqrt(du * du + dv * dv)
        good = active & (length > 1.0) & (length < dr.inf)
        length = dr.select(good, length, 1.0)
        # No farther than the image reaches.
        far = dr.minimum(length, float(width + height))
        du, dv = du / length, dv / length
        # Ends of sectors are rounded up as often as they should be.
        shift = _fraction(spin[1] + types.Float(number) * 0.618034)

        def step(at: Any, known: Any, sum_: Any) -> Any:
            part = (types.Float(at) + spin[1]) / steps
            # What is near covers more, and a sample with an end covers nothing between it and the next one.
            place = 1.0 + (far - 1.0) * (part if thickness is None else part * part)
            column, row = types.Int(dr.floor(u + place * du)), types.Int(dr.floor(v + place * dv))
            inside = good & (column >= 0) & (row >= 0) & (column < width) & (row < height)
            pixel = types.UInt(dr.select(inside, row * width + column, 0))
            away = buffer.point(types, column, row, pixel, inside) - point
            above, up = dr.dot(away, normal), dr.dot(away, view)
            squared = dr.squared_norm(away)
            distance = dr.sqrt(squared)
            inside &= (above > bias * distance) & (distance < radius) & (squared > 0)
            # Sines of the elevations of the sample, and of the tangent plane in its azimuth.
            tilt, level = above - up * facing, dr.maximum(squared - up * up, 0.0)
            flat = side * tilt / dr.maximum(dr.sqrt(tilt * tilt + facing * facing * level), 1e-30)
            rise = side * (up / distance + flat)
            if thickness is None:
                higher = inside & (rise > known)
                more = weight(distance) * (rise - known)
                return at + 1, dr.select(higher, rise, known), sum_ + dr.select(higher, more, 0.0)
            deep = up - dr.gather(types.Float, thickness, pixel, inside)
            behind = side * (deep * dr.rsqrt(dr.maximum(level + deep * deep, 1e-30)) + flat)
            sectors = _sectors(types, dr.minimum(rise, behind), dr.maximum(rise, behind), shift)
            fresh = dr.select(inside, sectors & ~known, types.UInt64(0))
            more = weight(distance) * types.Float(dr.popcnt(fresh)) * (1.0 / SECTORS)
            return at + 1, known | fresh, sum_ + dr.select(inside, more, 0.0)

        nothing = types.Float(0.0) if thickness is None else types.UInt64(0)
        state = (types.UInt(0), nothing, types.Float(0.0))
        *_, found = dr.while_loop(state, lambda at, known, sum_: at < steps, step)
        return number + 1, total + found

    state = (types.UInt(0), types.Float(0.0))
    _, total = dr.while_loop(state, lambda number, total: number < directions, along)
    return dr.clip(total / directions, 0.0, 1.0)


def _sectors(types: Any, low: Any, high: Any, shift: Any) -> Any:
    """Bits (UInt64) of the sectors between two elevations above the tangent plane, from 0 to 2."""

    def below(rise: Any) -> Any:
        count = types.UInt(dr.clip(rise * SECTORS + shift, 0.0, 2.0 * SECTORS))
        one = types.UInt64(1)
        return dr.select(count >= 64, ~types.UInt64(0), (one << types.UInt64(dr.minimum(count, 63))) - one)

    return below(high) & ~below(low)


def _fraction(value: Any) -> Any:
    return value - dr.floor(value)


def _across(types: Any, view: Any) -> tuple[Any, Any]:
    """Two directions at right angles to unit ones and each other (Duff et al. 2017)."""
    sign = dr.copysign(types.Float(1.0), view.z)
    a = -1.0 / (sign + view.z)
    b = view.x * view.y * a
    first = types.Array3f(1.0 + sign * view.x * view.x * a, sign * b, -sign * view.x)
    return first, types.Array3f(b, sign + view.y * view.y * a, -view.y)


def blurred(
    types: Any,
    values: Any,
    buffer: Any,
    size: tuple[int, int],
    pixel: Any,
    point: Any,
    normal: Any,
    step: tuple[int, int],
    reach: int,
    thickness: Any,
    active: Any,
) -> Any:
    """Means of values along a row or a column, over 2 reach + 1 pixels of the same surface.

    Weights fall off as a bell, and with the distance from the tangent plane in units of a thickness. step: one pixel to
    the right, or down.
    """
    width, height = size
    row = pixel // width
    column = pixel - row * width
    spread = 2.0 / (reach + 1.0) ** 2

    def add(at: Any, total: Any, weights: Any) -> Any:
        off = types.Int(at) - reach
        x, y = types.Int(column) + off * step[0], types.Int(row) + off * step[1]
        inside = active & (x >= 0) & (y >= 0) & (x < width) & (y < height)
        other = types.UInt(dr.select(inside, y * width + x, 0))
        beside = dr.dot(buffer.point(types, x, y, other, inside) - point, normal) / thickness
        inside &= abs(beside) < 4.0
        far = types.Float(off)
        weight = dr.exp(-spread * far * far - beside * beside)
        value = dr.gather(types.Float, values, other, inside)
        return at + 1, total + dr.select(inside, weight * value, 0.0), weights + dr.select(inside, weight, 0.0)

    state = (types.UInt(0), types.Float(0.0), types.Float(0.0))
    _, total, weights = dr.while_loop(state, lambda at, total, weights: at < 2 * reach + 1, add)
    return dr.select(weights > 0, total / weights, 1.0)
