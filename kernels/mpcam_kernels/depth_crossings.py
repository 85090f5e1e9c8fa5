"""Where a step of a ray goes through the surface of a depth image, from patch to patch."""

from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels.depth_patches import Patch


class Point(NamedTuple):
    """A point of a ray in the image: pixel (u, v), depth, and whether there is an image."""

    u: Any
    v: Any
    depth: Any
    valid: Any


class Crossing(NamedTuple):
    """Where, on a step, a ray goes through the surface, as parts of the step: between `first` and `last`, with the
    gaps in depth there; in the patch where the step ends (or in that where it starts); from the front or not."""

    hit: Any
    first: Any
    last: Any
    gaps: tuple[Any, Any]
    later: Any
    front: Any


def parts(types: Any, now: Point, ahead: Point) -> tuple[Any, Any]:
    """The parts of a step at which it leaves the pixel in which it starts and enters that in which it ends: 1 and 0 if
    these are the same. Between them it is in a third pixel, if the two only share a corner.
    """
    leave, enter = types.Float(1), types.Float(0)
    for start, end in ((now.u, ahead.u), (now.v, ahead.v)):
        here, there = dr.floor(start), dr.floor(end)
        moves, right = here != there, end > start
        inverse = 1.0 / dr.select(moves, end - start, 1.0)
        out = (dr.select(right, here + 1, here) - start) * inverse
        into = (dr.select(right, there, there + 1) - start) * inverse
        leave = dr.select(moves, dr.minimum(leave, out), leave)
        enter = dr.select(moves, dr.maximum(enter, into), enter)
    return dr.clip(leave, 0, 1), dr.clip(enter, 0, 1)


def crossing_of(
    now: Point,
    ahead: Point,
    held: Patch,
    gap: Any,
    found: Patch,
    column: Any,
    row: Any,
    beyond: Any,
    leave: Any,
    enter: Any,
) -> Crossing:
    """Where a ray goes through the surface on a step from the pixel of one patch to that of another, or to the same.

    gap and beyond: depths of the step's ends less those of the surface there. leave, enter: see `parts`.
    """
    du, dv, dz = ahead.u - now.u, ahead.v - now.v, ahead.depth - now.depth
    x, y = dr.floor(now.u), dr.floor(now.v)
    same = (x == column) & (y == row)

    def off(patch: Patch, part: Any, left: Any, top: Any) -> Any:
        return now.depth + part * dz - patch.at(now.u + part * du - left - 0.5, now.v + part * dv - top - 0.5)

    leaving = dr.select(same, beyond, off(held, leave, x, y))
    entering = dr.select(same, beyond, off(found, enter, column, row))
    in_old = (gap < 0) != (leaving < 0)
    # Over an edge the patches are joined or not; over a corner they are where both go on to the same place.
    right, down = column > x, row > y
    beside = dr.select(right, held.joined_right, found.joined_right)
    below = dr.select(down, held.joined_down, found.joined_down)
    agree = abs(off(held, enter, x, y) - entering) <= dr.maximum(held.slack(), found.slack())
    joint = dr.select(row == y, beside, dr.select(column == x, below, agree))
    between = ~same & ((leaving < 0) != (entering < 0)) & joint
    in_new = ~same & ((entering < 0) != (beyond < 0))
    first = dr.select(in_old, 0.0, dr.select(between, leave, enter))
    last = dr.select(in_old, dr.select(same, 1.0, leave), dr.select(between, enter, 1.0))
    before = dr.select(in_old, gap, dr.select(between, leaving, entering))
    after = dr.select(in_old, leaving, dr.select(between, entering, beyond))
    return Crossing(in_old | between | in_new, first, last, (before, after), ~in_old, before < 0)
