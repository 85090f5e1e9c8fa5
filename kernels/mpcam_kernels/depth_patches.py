"""The surface that a depth image stands for: over the square of each pixel a patch, joined to those beside it or not.

A patch has the pixel's depth in its middle and four slopes, to the left, right, up and down. Towards a neighbor of the
same surface the slope is the difference of the two depths, so that the patches meet halfway; towards any other neighbor
the surface goes on as it comes from the opposite side, and ends at the edge of the pixel: nothing is spanned between
what lies one behind the other.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import drjit as dr

LEAST = 2.0
"""Steps of so many footprints of a pixel are no gap, whatever the surface does around them."""
WIDER = 2.0
"""A difference may be more than those beside it by so many times the smaller one of these."""
CREASE = 3.0
"""Footprints by which the difference to a neighbor may be off the pixel's own plane, which then goes on up to the edge,
as at a crease between the two; where it is farther off, as near silhouettes, the surface bends within the pixel."""
ROUND = 1e-6
"""Of a depth, what rounding may make of a difference."""


class Patch(NamedTuple):
    """depth: in the middle of the pixel, infinite: nothing there. left, right, up, down: derivatives of the depth to
    the right and downwards, per pixel. footprint: width of the pixel at that depth, scene units. joined_right,
    joined_down: whether the neighbors there belong to the same surface.
    """

    depth: Any
    left: Any
    right: Any
    up: Any
    down: Any
    footprint: Any
    joined_right: Any
    joined_down: Any

    def at(self, across: Any, along: Any) -> Any:
        """Depth at places given from the middle of the pixel, to the right and downwards."""
        return (
            self.depth
            + across * dr.select(across < 0, self.left, self.right)
            + along * dr.select(along < 0, self.up, self.down)
        )

    def bounds(self) -> tuple[Any, Any]:
        """Least and largest depth within the pixel's square."""
        pairs = [(-0.5 * self.left, 0.5 * self.right), (-0.5 * self.up, 0.5 * self.down)]
        least = sum(dr.minimum(0.0, dr.minimum(*ends)) for ends in pairs)
        most = sum(dr.maximum(0.0, dr.maximum(*ends)) for ends in pairs)
        return self.depth + least, self.depth + most

    def slack(self) -> Any:
        """How far two descriptions of one surface may be apart, scene units: a part of what changes over a pixel."""
        steepest = dr.maximum(dr.maximum(abs(self.left), abs(self.right)), dr.maximum(abs(self.up), abs(self.down)))
        return 0.25 * (self.footprint + steepest)


def packed(types: Any, patch: Patch) -> Any:
    """Four numbers: two slopes share one, 16 bits each, which is off by 1 / 512 at most; the last two bits of the
    footprint tell what is joined.
    """

    def both(first: Any, second: Any) -> Any:
        bits: list[Any] = [dr.reinterpret_array(types.UInt, types.Float(x)) for x in (first, second)]
        high, low = (one + 0x8000 for one in bits)
        return dr.reinterpret_array(types.Float, (high & 0xFFFF0000) | (low >> 16))

    bits: Any = dr.reinterpret_array(types.UInt, types.Float(patch.footprint))
    bits = bits & 0xFFFFFFFC
    bits |= dr.select(patch.joined_right, types.UInt(1), 0) | dr.select(patch.joined_down, types.UInt(2), 0)
    last = dr.reinterpret_array(types.Float, bits)
    return types.Array4f(patch.depth, both(patch.left, patch.right), both(patch.up, patch.down), last)


def unpacked(types: Any, row: Any) -> Patch:
    """The patch of four numbers."""

    def both(number: Any) -> tuple[Any, Any]:
        bits: Any = dr.reinterpret_array(types.UInt, number)
        first, second = (dr.reinterpret_array(types.Float, half) for half in (bits & 0xFFFF0000, bits << 16))
        return first, second

    bits: Any = dr.reinterpret_array(types.UInt, row[3])
    return Patch(row[0], *both(row[1]), *both(row[2]), row[3], (bits & 1) != 0, (bits & 2) != 0)


Read = Callable[[int, int], Any]


def patch_of(types: Any, read: Read, footprint: Any, slopes: tuple[Read, Read] | None = None) -> Patch:
    """The patch of a pixel. read(i, j): depth of the pixel i to the right and j down, infinite where nothing is.

    slopes: derivatives of the depth to the right and downwards in the same way, where the planes of the surfaces are
    known; else they are taken from the differences to the pixels behind.
    """
    depth = read(0, 0)
    there = dr.isfinite(depth)
    found: list[Any] = []
    joined: list[Any] = []
    for axis in range(2):

        def line(k: int, axis: int = axis, values: Read = read) -> Any:
            return values(k, 0) if axis == 0 else values(0, k)

        def slope(k: int, behind: int, axis: int = axis, line: Any = line) -> Any:
            if slopes is not None:
                return line(k, values=slopes[axis])
            return (line(k) - line(k + behind)) * -behind

        own = slope(0, -1), slope(0, 1)
        before, joined_before = _joined(line(-1), depth, slope(-1, -1), own[1], footprint)
        after, joined_after = _joined(depth, line(1), own[0], slope(1, 1), footprint)
        if slopes is None:
            alone = dr.select(joined_after, after, 0.0), dr.select(joined_before, before, 0.0)
            found.append(dr.select(joined_before, before, alone[0]))
            found.append(dr.select(joined_after, after, alone[1]))
        else:
            for difference, linked in ((before, joined_before), (after, joined_after)):
                bends = linked & (abs(difference - own[0]) > CREASE * footprint)
                found.append(dr.select(bends, difference, own[0]))
        joined.append(joined_after)
    left, right, up, down = (dr.select(there, slope, 0.0) for slope in found)
    return Patch(depth, left, right, up, down, footprint, joined[0], joined[1])


def _joined(a: Any, b: Any, before: Any, after: Any, footprint: Any) -> tuple[Any, Any]:
    """Difference of two neighbors, and whether they belong to one surface, by how the depth goes on at a and at b.

    On two planes that meet between them, and on a surface that bends one way, the difference lies between those before
    and after. At a gap it is far from both.
    """
    step = b - a
    known = [dr.isfinite(x) for x in (before, after)]
    lowest = dr.minimum(dr.select(known[0], before, dr.inf), dr.select(known[1], after, dr.inf))
    highest = dr.maximum(dr.select(known[0], before, -dr.inf), dr.select(known[1], after, -dr.inf))
    neither = ~known[0] & ~known[1]
    lowest, highest = dr.select(neither, 0.0, lowest), dr.select(neither, 0.0, highest)
    sizes = [dr.select(k, abs(x), dr.inf) for k, x in zip(known, (before, after), strict=True)]
    smaller = dr.select(neither, 0.0, dr.minimum(*sizes))
    wide = LEAST * footprint + WIDER * smaller + ROUND * dr.select(dr.isfinite(step), abs(a), 0.0)
    return step, dr.isfinite(step) & (step >= lowest - wide) & (step <= highest + wide)
