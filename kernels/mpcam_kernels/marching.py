"""Rays against depth images: a ray is followed along its image, in steps that the image decides (Rosen et al. 2011).

A step goes from a point of the ray to the next one, which is projected; how far apart the two pixels may be depends on
the level. On the levels of `depth_tiles`, a step whose depths do not meet the range around it is passed at once, and
one that may meet it is tried again a level lower. On the lowest, fine steps go from patch to patch (`depth_patches`),
and where a ray is on one side of the surface and then on the other, it hits.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels.depth_crossings import Point, crossing_of, parts
from mpcam_kernels.depth_patches import Patch, unpacked
from mpcam_kernels.depth_tiles import FACTOR, Levels

AIM = 0.95
"""Steps are chosen so much shorter than they may be: the image of a ray does not run evenly."""
SHORTEST = 2.0**-19
"""Of a ray's stretch within the image's volume: steps that still leap are leaps of the camera's, over a seam."""
CORNER = 0.02
"""Of a step, what it may run in a third pixel without looking at it."""
ROUND = 1e-6
"""Of a depth, what rounding makes of it."""
NEAR = 2.0
"""Slacks of a patch within which a ray is near to it."""
REFINE = 3
"""Times that a hit is brought nearer to its patch by the secant."""


Project = Callable[[Any], Point]


@dataclass(frozen=True)
class Surface:
    """A depth image on the device.

    patches: rows of four, see `depth_patches.packed`. ranges: rows of two, the levels one after the other, see
    `depth_tiles`. box: least and largest x, y, z of the surface, six numbers. size: width and height. levels: how
    `ranges` is laid out. curved: how much depths along a straight line may bend, in terms of distances from a point: 1
    for these, 0 for distances from a plane.
    """

    patches: Any
    ranges: Any
    box: list[Any]
    size: tuple[int, int]
    levels: Levels
    curved: float

    def patch(self, types: Any, u: Any, v: Any, active: Any) -> tuple[Patch, Any, Any, Any]:
        """The patch at a pixel, with an infinite depth beside the image; its column and row, and its number."""
        width, height = self.size
        column, row = dr.floor(u), dr.floor(v)
        inside = active & (u >= 0) & (v >= 0) & (u < width) & (v < height)
        number = types.UInt(dr.select(inside, row, 0)) * width + types.UInt(dr.select(inside, column, 0))
        patch = unpacked(types, dr.gather(types.Array4f, self.patches, number, inside))
        return patch._replace(depth=dr.select(inside, patch.depth, dr.inf)), column, row, number

    def range(self, types: Any, level: Any, u: Any, v: Any, active: Any) -> tuple[Any, Any]:
        """Least and largest depth around a place of the image."""
        start, columns, rows = types.Int(0), types.Int(1), types.Int(1)
        inverse = types.Float(1.0 / self.levels.side)
        for number, (across, along) in enumerate(self.levels.counts):
            here = level == number
            start = dr.select(here, self.levels.starts[number], start)
            columns, rows = dr.select(here, across, columns), dr.select(here, along, rows)
            inverse = dr.select(here, 1.0 / (self.levels.side * FACTOR**number), inverse)
        x = dr.clip(types.Int(dr.clip(u, -4e4, 8e4) * inverse), 0, columns - 1)
        y = dr.clip(types.Int(dr.clip(v, -4e4, 8e4) * inverse), 0, rows - 1)
        return dr.gather(types.Array2f, self.ranges, types.UInt(start + y * columns + x), active)

    def away(self, u: Any, v: Any) -> Any:
        """Pixels from a place beside the image to the image along the farther axis; 0 or less inside."""
        width, height = self.size
        return dr.maximum(dr.maximum(-u, u - width), dr.maximum(-v, v - height))


class Found(NamedTuple):
    """hit. length: along the ray from its start. u, v: pixel of the hit. number: of the pixel whose patch it is.
    front: whether the ray came from the camera's side. steps: points of the ray that were projected.
    """

    hit: Any
    length: Any
    u: Any
    v: Any
    number: Any
    front: Any
    steps: Any


def march(
    types: Any,
    project: Project,
    surface: Surface,
    start: Any,
    along: Any,
    active: Any,
    coarse: Any,
    fine: Any,
    near: Any,
    far: Any,
    most: Any,
    leaving: Any = True,
) -> Found:
    """First hits of rays with a depth image.

    start, along: Array3f in the frame of `project`; lengths are in terms of `along`, which may have any length. coarse,
    fine: steps in pixels; without coarse steps, coarse is 0. near, far: lengths between which hits count. most: steps
    after which a ray is given up. leaving: whether rays may start on the surface, which they do not hit there.
    """
    entry, exit_ = _clipped(types, surface.box, start, along, near, far)
    unit = dr.norm(along)
    active = active & (entry <= exit_)
    begin = start + along * dr.select(active, entry, 0.0)
    end = dr.select(active, exit_ - entry, 0.0)
    shortest = dr.maximum(end * SHORTEST, 4e-7 * (abs(entry) + dr.norm(start) / unit))
    coarsest = dr.select(coarse > 0, len(surface.levels.counts) - 1, -1)

    zero, no = types.Float(0), types.Bool(False)
    nothing = Patch(types.Float(dr.inf), zero, zero, zero, zero, zero, no, no)

    def span(level: Any, patch: Any, gap: Any) -> Any:
        """Pixels that a step may span. Between coarse ones, fine steps are longer while the surface is not near: no
        pixel is left out, and the patch of each is exact.
        """
        near = (abs(gap) <= NEAR * Patch(*patch).slack()) | (coarse == 0)
        small = dr.select(near, fine, dr.maximum(fine, 1.0))
        return dr.select(level < 0, small, coarse * dr.exp2(2.0 * types.Float(level)))

    here, there = project(begin), project(begin + along * end)
    level = dr.minimum(types.Int(1), coarsest)
    run = dr.maximum(_length(here, there), 1e-6)
    step = dr.select(
        here.valid & there.valid, end * dr.minimum(1.0, AIM * span(level, nothing, -dr.inf) / run), end / 64
    )
    # A ray that starts inside of the volume may start on the surface, which it does not hit there.
    armed = (entry > 0) | ~types.Bool(leaving)
    first = types.Int(-2)  # a fine step that only looks where the ray is
    level = dr.select(coarsest < 0, first, level)

    def going(s: Any, step: Any, level: Any, here: Any, *rest: Any) -> Any:
        count, done = rest[-1], rest[-2]
        return ~done & (count < most)

    def body(
        s: Any,
        step: Any,
        level: Any,
        here: tuple[Any, ...],
        patch: tuple[Any, ...],
        gap: Any,
        until: Any,
        armed: Any,
        quiet: Any,
        best: tuple[Any, ...],
        hit: Any,
        done: Any,
        count: Any,
    ) -> Any:
        now = Point(*here)
        looking = level == -2
        length_of_step = dr.select(looking, 0.0, dr.minimum(step, end - s))
        last = s + length_of_step >= end
        to = dr.select(last, end, s + length_of_step)
        ahead = project(begin + along * to)
        both = now.valid & ahead.valid
        length = dr.select(both, _length(now, ahead), 0.0)
        wanted = span(level, patch, gap)
        away = dr.select(now.valid, surface.away(now.u, now.v), 0.0)
        allowed = dr.maximum(wanted, away)
        # From where there is no image into the image, or the other way: that goes by way of its edge.
        edge = (now.valid != ahead.valid) & (dr.select(now.valid, away, surface.away(ahead.u, ahead.v)) <= 0.0)
        wide = both & (length > allowed)
        # Over the corner of a third pixel: that one comes first.
        leave, enter = parts(types, now, ahead)
        corner = both & (level < 0) & ~wide & (enter - leave > CORNER)
        again = (wide | edge | corner) & (length_of_step > shortest)
        leap = (wide | edge) & ~again

        coarse_step = (level >= 0) & ~again
        passed = ~both | leap
        clear = _clear(types, surface, level, now, ahead, length, (to - s) * unit, coarse_step & ~passed) | passed
        down = coarse_step & ~clear
        bottom = down & (level == 0)

        # Fine: the patch where the step ends, or, before the first of them, where it starts.
        small = (level < 0) & ~again
        stepped = small & ~looking & both & ~leap

        def fine_step(held: tuple[Any, ...], gap: Any, armed: Any, best: tuple[Any, ...], hit: Any) -> Any:
            u, v = dr.select(small, ahead.u, now.u), dr.select(small, ahead.v, now.v)
            depth = dr.select(small, ahead.depth, now.depth)
            image = dr.select(small, ahead.valid, now.valid)
            found, column, row, number = surface.patch(types, u, v, image)
            beyond = depth - found.at(u - column - 0.5, v - row - 0.5)
            crossing = crossing_of(now, ahead, Patch(*held), gap, found, column, row, beyond, leave, enter)
            hits = stepped & armed & crossing.hit
            armed = armed | (abs(beyond) > found.slack() + ROUND * depth)
            old = dr.floor(now.v) * surface.size[0] + dr.floor(now.u)
            owner = dr.select(crossing.later, number, types.UInt(dr.select(hits & ~crossing.later, old, 0.0)))
            at = [s + part * (to - s) for part in (crossing.first, crossing.last)]
            best = _selected(hits, (*at, *crossing.gaps, owner, crossing.front), best)
            return tuple(found), beyond, armed, best, hits

        look = small | bottom
        patch, gap, armed, best, hit = dr.if_stmt(
            (patch, gap, armed, best, hit), look, fine_step, lambda *unchanged: unchanged
        )
        armed = armed | (coarse_step & clear)

        # Where to, and how far.
        advance = ~again & ~down
        ended = advance & last & ~looking
        raised = coarse_step & clear & quiet
        level_after = dr.select(down, level - 1, level)
        level_after = dr.select(raised, dr.minimum(level + 1, coarsest), level_after)
        back = small & (looking | (to >= until) | leap) & (coarsest >= 0)
        level_after = dr.select(back, 0, dr.select(looking, -1, level_after))
        until = dr.select(bottom, to, until)
        quiet = coarse_step & clear
        outside = dr.select(advance & ahead.valid, surface.away(ahead.u, ahead.v), away)
        aim = AIM * dr.maximum(span(level_after, patch, gap), outside)
        ratio = dr.select(both, aim / dr.maximum(length, 1e-6), 2.0)
        ratio = dr.clip(ratio, 1.0 / 64, dr.select(advance, 4.0, 1.0))
        retry = dr.clip(AIM * allowed / dr.maximum(length, 1e-6), 1.0 / 64, 0.75)
        ratio = dr.select(again, dr.select(wide, retry, dr.select(corner, 0.5 * (leave + enter), 0.125)), ratio)
        after = dr.maximum(length_of_step * ratio, shortest)
        after = dr.select(both, after, dr.minimum(after, dr.maximum(end / 64, shortest)))
        step = dr.select(looking, step, after)
        s = dr.select(advance, to, s)
        here = _selected(advance, ahead, now)
        return s, step, level_after, here, patch, gap, until, armed, quiet, best, hit, done | hit | ended, count + 1

    best = (zero, zero, zero, zero, types.UInt(0), no)
    state = (zero, step, level, tuple(here), tuple(nothing), types.Float(-dr.inf), end, armed, no, best, no, ~active)
    state = dr.while_loop((*state, types.UInt(0)), going, body)
    best, hit, count = state[9], state[10], state[12]
    return _refined(types, project, surface, begin, along, entry, best, hit, count)


def _clear(
    types: Any, surface: Surface, level: Any, now: Point, ahead: Point, pixels: Any, length: Any, active: Any
) -> Any:
    """Whether a coarse step, so many pixels and so long in space, is out of the surface's reach."""

    def look(clear: Any) -> Any:
        middle_u, middle_v = 0.5 * (now.u + ahead.u), 0.5 * (now.v + ahead.v)
        low, high = surface.range(types, level, middle_u, middle_v, True)
        least, most = dr.minimum(now.depth, ahead.depth), dr.maximum(now.depth, ahead.depth)
        # Distances r from a point have the second derivative (1 - r'^2) / r, and nowhere is r less than this:
        nearest = dr.maximum(0.5 * (least + most - length), 1e-3 * most)
        bend = dr.maximum(length * length - dr.square(most - least), 0.0) / (8.0 * nearest)
        sag = surface.curved * bend + ROUND * most
        beside = surface.away(middle_u, middle_v) >= 0.5 * pixels
        return (beside | (most + sag < low) | (least - sag > high),)

    (clear,) = dr.if_stmt((types.Bool(False),), active, look, lambda clear: (clear,))
    return clear


def _length(a: Point, b: Point) -> Any:
    return dr.sqrt(dr.square(b.u - a.u) + dr.square(b.v - a.v))


def _selected(mask: Any, new: Any, old: Any) -> tuple[Any, ...]:
    return tuple(dr.select(mask, x, y) for x, y in zip(new, old, strict=True))


def between(types: Any, planes: list[Any], start: Any, along: Any, far: Any) -> tuple[Any, Any]:
    """Lengths along rays from 0 to `far` between which n . x + o <= 0 for planes (n, o), four numbers each."""
    entry, exit_ = types.Float(0), far + types.Float(0)
    for k in range(0, len(planes), 4):
        normal = types.Array3f(*planes[k : k + 3])
        height, rise = dr.dot(normal, start) + planes[k + 3], dr.dot(normal, along)
        crossing = -height / dr.select(rise != 0, rise, 1.0)
        entry = dr.select(rise < 0, dr.maximum(entry, crossing), entry)
        exit_ = dr.select(rise > 0, dr.minimum(exit_, crossing), exit_)
        exit_ = dr.select((rise == 0) & (height > 0), -1.0, exit_)
    return entry, exit_


def _clipped(types: Any, box: list[Any], start: Any, along: Any, entry: Any, exit_: Any) -> tuple[Any, Any]:
    """Lengths along rays between which they run within a box, of those between two."""
    for axis in range(3):
        way = dr.select(abs(along[axis]) > 1e-20, along[axis], 1e-20)
        first, second = ((box[axis + side] - start[axis]) / way for side in (0, 3))
        entry = dr.maximum(entry, dr.minimum(first, second))
        exit_ = dr.minimum(exit_, dr.maximum(first, second))
    return entry, exit_


def _refined(
    types: Any,
    project: Project,
    surface: Surface,
    begin: Any,
    along: Any,
    entry: Any,
    best: tuple[Any, ...],
    hit: Any,
    count: Any,
) -> Found:
    """Hits on their patches, from the stretch in which each of them is."""
    first, last, before, after, number, front = best
    width = surface.size[0]
    patch = unpacked(types, dr.gather(types.Array4f, surface.patches, number, hit))
    column, row = types.Float(number % width), types.Float(number // width)

    def nearer(k: Any, first: Any, last: Any, before: Any, after: Any, s: Any, u: Any, v: Any) -> Any:
        difference = after - before
        part = dr.select(difference != 0, -before / dr.select(difference != 0, difference, 1.0), 0.5)
        s = first + dr.clip(part, 0, 1) * (last - first)
        point = project(begin + along * s)
        gap = point.depth - patch.at(point.u - column - 0.5, point.v - row - 0.5)
        low = (gap < 0) == (before < 0)
        first, before = dr.select(low, s, first), dr.select(low, gap, before)
        last, after = dr.select(low, last, s), dr.select(low, after, gap)
        return k + 1, first, last, before, after, s, point.u, point.v

    zero = types.Float(0)
    rounds = dr.select(hit, types.UInt(REFINE), types.UInt(0))
    state = (types.UInt(0), first, last, before, after, zero, zero, zero)
    *_, s, u, v = dr.while_loop(state, lambda k, *_: k < rounds, nearer)
    return Found(hit, dr.select(hit, entry + s, dr.inf), u, v, number, front & hit, count)
