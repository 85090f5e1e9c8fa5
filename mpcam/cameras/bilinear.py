"""Rays between the centers of pixels: origins and directions of a table, interpolated bilinearly."""

from typing import NamedTuple

from mpcam.math import Array, Vector, isfinite, minimum, take, vector, where, whole


class Line(NamedTuple):
    """Rays as they are interpolated: origin, and direction of any length."""

    origin: Vector
    along: Vector


class Patch(NamedTuple):
    """The bilinear function around pixel positions: base + x across + y down + x y twist.

    base is the ray of the pixel itself, so that it comes out to the bit at the pixel's center, where x = y = 0.
    x_slope, y_slope: derivatives of x in u, and of y in v. valid: whether all pixels with a weight have a ray.
    """

    base: Line
    across: Line
    down: Line
    twist: Line
    x: Array
    y: Array
    x_slope: Array
    y_slope: Array
    valid: Array

    @property
    def ray(self) -> Line:
        """Origin and direction."""
        x, y = self.x, self.y
        terms = zip(self.base, self.across, self.down, self.twist, strict=True)
        return Line(*(base + x * across + y * down + (x * y) * twist for base, across, down, twist in terms))

    @property
    def slopes(self) -> tuple[Line, Line]:
        """Derivatives of origin and direction in u and in v."""
        right = zip(self.across, self.twist, strict=True)
        below = zip(self.down, self.twist, strict=True)
        return (
            Line(*(self.x_slope * (across + self.y * twist) for across, twist in right)),
            Line(*(self.y_slope * (down + self.x * twist) for down, twist in below)),
        )


def patch(tables: list[Array], width: int, height: int, u: Array, v: Array) -> Patch:
    """The bilinear function around pixel positions in [0, width] x [0, height].

    tables: the components of origins and directions, six of (height * width,), row by row. A pixel without a ray has
    the direction zero, or a number that is not finite. Beyond the outermost centers the function goes on.
    """
    column, beside, x, x_slope = _neighbors(u, width)
    row, under, y, y_slope = _neighbors(v, height)
    own, right, below, across = (
        _pixel(tables, j * width + i) for j, i in ((row, column), (row, beside), (under, column), (under, beside))
    )
    valid = own[1] & (right[1] | (x == 0)) & (below[1] | (y == 0)) & (across[1] | (x == 0) | (y == 0))
    base, r, b, a = own[0], right[0], below[0], across[0]
    to_right, to_below = Line(*(r[k] - base[k] for k in range(2))), Line(*(b[k] - base[k] for k in range(2)))
    twist = Line(*((a[k] - b[k]) - to_right[k] for k in range(2)))
    return Patch(base, to_right, to_below, twist, x, y, x_slope, y_slope, valid)


def _neighbors(position: Array, count: int) -> tuple[Array, Array, Array, Array]:
    """Pixel at a position, its neighbor on the side of the position, the neighbor's weight and the weight's slope.

    Pixels at the border have but one neighbor, which has a negative weight beyond their centers; a lone pixel is its
    own neighbor, without weight.
    """
    own = minimum(whole(position), count - 1)
    offset = position - own - 0.5
    if count == 1:
        return own, own, 0.0 * offset, 0.0 * offset
    onward = ((offset >= 0) | (own == 0)) & (own < count - 1)
    slope = where(onward, 1.0, -1.0 + 0.0 * offset)
    return own, where(onward, own + 1, own - 1), slope * offset, slope


def _pixel(tables: list[Array], number: Array) -> tuple[Line, Array]:
    """Origin and direction of pixels, and whether they have a ray; zero where they have none."""
    values = [take(table, number) for table in tables]
    valid = isfinite(values[0] + values[1] + values[2] + values[3] + values[4] + values[5])
    valid = valid & (abs(values[3]) + abs(values[4]) + abs(values[5]) > 0)
    values = [where(valid, value, 0.0) for value in values]
    return Line(vector(*values[:3]), vector(*values[3:])), valid
