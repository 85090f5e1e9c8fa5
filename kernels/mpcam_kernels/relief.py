"""Copies of a depth image in space, each in a box: what rays meet first (Rosen et al. 2011, section 6.2).

Balls around the boxes meet cones around the rays of blocks of pixels, which gives a list of copies for each block. A
ray goes down the list of its block, is brought into the frame of each copy whose box it runs through, and followed over
the depth image between where it enters the box and where it leaves it. The nearest hit counts, in whatever order the
copies come: a near box may be missed by its relief, and a far one hit.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels.marching import Point, Surface, march
from mpcam_kernels.poses import placed
from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import PIXELS

ENDS = 1e-6
"""Of a length, by which a ray is followed beyond its box, whose sides the relief may touch."""


@dataclass(frozen=True)
class Copies:
    """Where copies are. poses: three rows each, of a matrix from the frame of the rays to that of the depth image's
    scene. balls: center and radius of each one's box, in the frame of the rays. order: their numbers, the nearest
    first, more or less. count: how many.
    """

    poses: Rows
    balls: Any
    order: Any
    count: Any

    def placed(self, types: Any, number: Any, point: Any, vector: Any, active: Any) -> tuple[Any, Any]:
        """A point and a vector in the frame of a copy."""
        rows = self.poses.at(types, number, active)
        along = types.Array3f(*(dr.dot(row.xyz, vector) for row in rows))
        return types.Array3f(*(dr.dot(row.xyz, point) + row.w for row in rows)), along


@dataclass(frozen=True)
class Eyes:
    """Rays to be followed. rays: by slot. pose: twelve numbers, from the frame of the rays to that of the copies: a
    rotation and a shift. pixels: of each slot, -1 for none. limits: of each pixel, the length beyond which nothing
    counts.
    """

    rays: Any
    pose: list[Any]
    pixels: Any
    limits: Any


class Ray(NamedTuple):
    """A ray in the frame of copies. start: its length at the origin, last: the length beyond which nothing counts."""

    origin: Any
    direction: Any
    start: Any
    last: Any
    valid: Any


class Met(NamedTuple):
    """What rays met. length: along them, infinite for nothing. u, v: pixel of the depth image. number: of the pixel
    whose patch it is. copy: which one. steps: points of the rays that were projected.
    """

    length: Any
    u: Any
    v: Any
    number: Any
    copy: Any
    steps: Any


def ray_of(types: Any, bent: bool, eyes: Eyes, slot: Any, inverse: Any) -> Ray:
    """The ray of a slot in the frame of the copies. inverse: of the unit of the rays, in that of the limits."""
    pixel = dr.gather(types.Int, eyes.pixels, slot)
    exists = pixel >= 0
    origin, direction, start = way_of(types, bent, eyes.rays, eyes.pose, slot, exists)
    exists &= dr.squared_norm(direction) > 0
    last = dr.gather(types.Float, eyes.limits, types.UInt(pixel), exists) * inverse
    if bent:
        piece = eyes.rays.at(types, slot, exists)
        ends = piece.finite > 0
        last = dr.minimum(last, dr.select(ends, start + 1.0 / dr.select(ends, piece.inverse_length, 1.0), dr.inf))
    return Ray(origin, direction, start, last, exists)


def way_of(types: Any, bent: bool, rays: Any, pose: list[Any], slot: Any, active: Any) -> tuple[Any, Any, Any]:
    """Origin and direction of the rays of slots in the frame of the copies, and their length at the origin."""
    if bent:
        piece = rays.at(types, slot, active)
        origin, direction, start = piece.origin, piece.direction, rays.start(types, slot, active)
    else:
        origin, direction = rays.origin_and_direction(types, slot)
        start = types.Float(0)
    return placed(types, pose, origin), turned(types, pose, direction), start


def turned(types: Any, pose: list[Any], vector: Any) -> Any:
    """A vector in another frame."""
    return types.Array3f(*(sum(pose[3 * i + j] * vector[j] for j in range(3)) for i in range(3)))


def turned_back(types: Any, rows: list[Any], normal: Any) -> Any:
    """A normal of a copy in the frame of the rays, of length 1: by the transposed matrix, of any scale."""
    found = types.Array3f(sum(row.xyz * normal[i] for i, row in enumerate(rows)))
    largest = dr.maximum(dr.maximum(abs(found.x), abs(found.y)), abs(found.z))
    found = found * dr.select(largest > 0, 1.0 / dr.select(largest > 0, largest, 1.0), 0.0)
    return types.Array3f(found * dr.rsqrt(dr.maximum(dr.squared_norm(found), 1e-30)))


def listed(types: Any, cones: Any, block: Any, pose: list[Any], copies: Copies, lists: Any) -> Any:
    """Write for each block of rays which copies they may meet, in order; returns how many.

    pose: from the frame of the copies to that of the cones. lists: `copies.count` places for each block.
    """
    cone = cones(types, block)

    def add(k: Any, found: Any) -> Any:
        number = dr.gather(types.UInt, copies.order, k)
        ball = dr.gather(types.Array4f, copies.balls, number)
        ball = types.Array4f(*placed(types, pose, ball.xyz), ball.w)
        meets = cone.may_meet(ball)
        dr.scatter(lists, number, block * copies.count + found, meets)
        return k + 1, found + dr.select(meets, types.UInt(1), 0)

    return dr.while_loop((types.UInt(0), types.UInt(0)), lambda k, found: k < copies.count, add)[1]


def first_met(
    types: Any,
    project: Callable[[Any], Point],
    surface: Surface,
    box: list[Any],
    pose: list[Any],
    copies: Copies,
    lists: tuple[Any, Any],
    ray: Ray,
    block: Any,
    steps: tuple[Any, Any, Any],
) -> Met:
    """First hits of rays on copies.

    box: least and largest x, y, z of the relief. pose: from there to the frame of the depth image's camera. lists:
    copies of each block, and how many. steps: coarse and fine ones, and the most of them.
    """
    entries, counts = lists
    first, count = block * copies.count, dr.gather(types.UInt, counts, block, ray.valid)
    coarse, fine, most = steps

    def seek(k: Any, best: Any) -> Any:
        """The next copy in the list whose box the ray enters before what it has met, and where."""

        def look(k: Any, copy: Any, entry: Any, leave: Any, found: Any) -> Any:
            copy = dr.gather(types.UInt, entries, first + k)
            origin, along = copies.placed(types, copy, ray.origin, ray.direction, True)
            entry, leave = types.Float(0), best - ray.start
            for axis in range(3):
                way = dr.select(abs(along[axis]) > 1e-20, along[axis], 1e-20)
                ends = [(box[axis + side] - origin[axis]) / way for side in (0, 3)]
                entry = dr.maximum(entry, dr.minimum(*ends))
                leave = dr.minimum(leave, dr.maximum(*ends))
            return k + 1, copy, entry, leave, entry <= leave

        state = (k, types.UInt(0), types.Float(0), types.Float(0), types.Bool(False))
        return dr.while_loop(state, lambda k, copy, entry, leave, found: ~found & (k < count), look)

    def follow(k: Any, best: Any, u: Any, v: Any, number: Any, copy: Any, steps: Any) -> Any:
        k, at, entry, leave, found = seek(k, best)
        origin, along = copies.placed(types, at, ray.origin, ray.direction, found)
        start, way = placed(types, pose, origin), turned(types, pose, along)
        way = dr.select(found, way, types.Array3f(0, 0, 1))
        far = leave + ENDS * abs(leave)
        one = march(types, project, surface, start, way, found, coarse, fine, entry, far, most)
        length = ray.start + one.length
        nearer = one.hit & (length < best)
        new = (length, one.u, one.v, one.number, types.Int(at))
        kept = [dr.select(nearer, x, y) for x, y in zip(new, (best, u, v, number, copy), strict=True)]
        return k, *kept, steps + dr.select(found, one.steps, 0)

    zero = types.Float(0)
    last = dr.select(ray.valid, ray.last, -1.0)
    state = (types.UInt(0), last, zero, zero, types.UInt(0), types.Int(-1), types.UInt(0))
    _, best, u, v, number, copy, taken = dr.while_loop(state, lambda k, *_: (k < count) & ray.valid, follow)
    return Met(dr.select(copy >= 0, best, dr.inf), u, v, number, copy, taken)


def block_of(slot: Any) -> Any:
    """The block of a slot."""
    return slot // PIXELS
