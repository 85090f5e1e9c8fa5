"""Pixel regions that hold the image of a triangle: a box and, where known, three lines around it.

A line (a, b, c) keeps the pixel centers (u, v) with a u + b v + c >= 0; (a, b) has unit length. Along a row of pixels
a region is one span.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import drjit as dr

EVERYWHERE = (0.0, 0.0, 1.0)
"""The line that keeps every pixel."""


class PixelOutline(NamedTuple):
    """A region in pixels, not clipped to the image: low, high corners, whether there is any, and three lines."""

    low: Any
    high: Any
    valid: Any
    lines: tuple[Any, Any, Any]


class Region(NamedTuple):
    """Pixels x0 <= x < x1, y0 <= y < y1 on the inner side of three lines."""

    x0: Any
    y0: Any
    x1: Any
    y1: Any
    lines: tuple[Any, Any, Any]

    @property
    def pixels(self) -> Any:
        """Pixels in the box."""
        return (self.x1 - self.x0) * (self.y1 - self.y0)

    def spans(self, types: Any) -> Callable[[Any, Any], tuple[Any, Any]]:
        """A function of the first and the last of some rows: first and one past the last column that they reach."""
        lowest, highest = types.Float(self.x0), types.Float(self.x1 - 1)
        # Divided once, not row by row. Hardly tilted lines give huge columns of the right sign; a line that keeps
        # everything gives none at all.
        tilts = [-1.0 / dr.select(abs(a) > 1e-9, a, dr.select(a < 0, -1e-9, 1e-9)) for a, _, _ in self.lines]

        def span(first: Any, last: Any) -> tuple[Any, Any]:
            low, high = lowest, highest
            top, bottom = types.Float(first) + 0.5, types.Float(last) + 0.5
            for (_, b, c), tilt in zip(self.lines, tilts, strict=True):
                end = dr.fma(c + dr.maximum(b * top, b * bottom), tilt, -0.5)
                low, high = (
                    dr.select(tilt < 0, dr.maximum(low, end), low),
                    dr.select(tilt > 0, dr.minimum(high, end), high),
                )
            start = types.Int(dr.ceil(dr.minimum(low, highest + 1)))
            return start, types.Int(dr.floor(dr.maximum(high, lowest - 1))) + 1

        return span


def region(types: Any, outline: PixelOutline, width: Any, height: Any) -> tuple[Region, Any]:
    """The pixels of an outline, widened by what rounding can amount to, and whether there are any.

    width, height: numbers, or one Float on the device for squares of several sizes.
    """
    x0, x1 = _range(types, outline.low[0], outline.high[0], width)
    y0, y1 = _range(types, outline.low[1], outline.high[1], height)
    pad = slack(width if width is height else max(width, height))
    lines = tuple(types.Array3f(a, b, c + pad) for a, b, c in outline.lines)
    return Region(x0, y0, x1, y1, lines), outline.valid & (x0 < x1) & (y0 < y1)  # pyright: ignore[reportArgumentType]


def slack(size: Any) -> Any:
    """What rounding of float32 can amount to in an image of so many pixels, in pixels."""
    return 2e-6 * size + 1e-3


def _range(types: Any, low: Any, high: Any, size: Any) -> tuple[Any, Any]:
    """First and one past the last pixel whose center lies in [low, high]."""
    pad, size = slack(size), float(size) if isinstance(size, int) else size
    first = dr.ceil(dr.maximum(low - (0.5 + pad), 0.0))
    last = dr.floor(dr.minimum(high + (0.5 + pad), size))
    return types.Int(dr.minimum(first, size)), types.Int(dr.maximum(last, 0.0))


def pack(types: Any, area: Region, triangle: Any) -> list[Any]:
    """A region and the number of its triangle, in three rows of four numbers."""
    numbers = (
        types.UInt(area.x0) | (types.UInt(area.x1) << 16),
        types.UInt(area.y0) | (types.UInt(area.y1) << 16),
        triangle,
    )
    return [
        types.Array4f(*line, dr.reinterpret_array(types.Float, types.UInt(number)))
        for line, number in zip(area.lines, numbers, strict=True)
    ]


def unpack(types: Any, rows: list[Any]) -> tuple[Region, Any]:
    """A region and the number of its triangle from its rows."""
    numbers: list[Any] = [dr.reinterpret_array(types.UInt, row.w) for row in rows]
    columns, lines, triangle = numbers
    x0, y0, x1, y1 = (types.Int(n) for n in (columns & 0xFFFF, lines & 0xFFFF, columns >> 16, lines >> 16))
    return Region(x0, y0, x1, y1, (rows[0].xyz, rows[1].xyz, rows[2].xyz)), triangle
