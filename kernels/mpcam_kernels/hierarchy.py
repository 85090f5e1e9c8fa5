"""Which triangles, or points, the rays of a cone may meet: through clusters of balls, step by step.

The balls are those around the triangles and, level by level, around FAN of the level below. Every step takes pairs of a
cone and a ball that may meet, and marks in a mask which of the ball's children the cone may meet: one thread looks at
all of them, since they share the cone. Masks become new pairs by a prefix sum, which is quicker than a counter that all
threads raise, and keeps the order.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels.rows import Rows

FAN = 8  # children of a cluster


@dataclass(frozen=True)
class Pairs:
    """Numbers of cones (or what they are around) and of balls (or what these are around)."""

    cones: Any
    balls: Any

    def at(self, number: Any) -> tuple[Any, Any]:
        """Pairs by number."""
        return dr.gather(type(number), self.cones, number), dr.gather(type(number), self.balls, number)


@dataclass(frozen=True)
class Marked:
    """Pairs as those numbers of threads that found them, when each cone was held against each of `count` balls."""

    threads: Any
    count: int

    def at(self, number: Any) -> tuple[Any, Any]:
        """Pairs by number."""
        return every_pair(dr.gather(type(number), self.threads, number), self.count)


def every_pair(thread: Any, count: int) -> tuple[Any, Any]:
    """Cone and ball of each thread, where each cone is held against each of `count` balls."""
    return thread // count, thread % count


def triangle_balls(types: Any, points: tuple[Any, Any, Any], usable: Any) -> Any:
    """Ball around the corners of triangles: center and radius, radius -1 where unusable."""
    a, b, c = points
    low, high = dr.minimum(dr.minimum(a, b), c), dr.maximum(dr.maximum(a, b), c)
    center = 0.5 * (low + high)
    radius = dr.sqrt(
        dr.maximum(dr.maximum(dr.squared_norm(a - center), dr.squared_norm(b - center)), dr.squared_norm(c - center))
    )
    return types.Array4f(*dr.select(usable, center, 0), dr.select(usable, radius, -1.0))


def cluster_balls(types: Any, cluster: Any, balls: Rows, count: int) -> Any:
    """Ball around the balls of FAN children with neighboring numbers, of which there are `count`."""

    def child(k: int) -> tuple[Any, Any]:
        number = cluster * FAN + k
        exists = number < count
        (ball,) = balls.at(types, number, exists)
        return ball, exists & (ball.w >= 0)

    low, high = types.Array3f(dr.inf), types.Array3f(-dr.inf)
    children = [child(k) for k in range(FAN)]
    for ball, exists in children:
        low = dr.select(exists, dr.minimum(low, ball.xyz - ball.w), low)
        high = dr.select(exists, dr.maximum(high, ball.xyz + ball.w), high)
    some = low.x <= high.x
    center, radius = dr.select(some, 0.5 * (low + high), 0), types.Float(-1)
    for ball, exists in children:
        radius = dr.select(exists, dr.maximum(radius, dr.norm(ball.xyz - center) + ball.w), radius)
    return types.Array4f(*center, radius)


def meeting(types: Any, cone: Any, balls: Rows, ball: Any, exists: Any, cull: bool) -> Any:
    """Whether cones and balls may meet; without `cull`, whether there are both."""
    if cull:
        return exists & cone.may_meet(*balls.at(types, ball, exists))
    return exists & (dr.gather(types.Float, balls.flat, ball * 4 + 3, exists) >= 0)


def met_children(
    types: Any, cones: Any, pairs: Any, thread: Any, balls: Rows, count: int, cull: bool
) -> tuple[Any, Any]:
    """Which children of the clusters of pairs may meet the cones, as a mask, and how many. count: of all balls."""
    number, cluster = pairs.at(thread)
    cone, mask = cones(types, number), types.UInt(0)
    for k in range(FAN):
        child = cluster * FAN + k
        mask |= dr.select(meeting(types, cone, balls, child, child < count, cull), types.UInt(1 << k), 0)
    return mask, dr.popcnt(mask)


def write_pairs(pair: Callable[[Any], tuple[Any, Any]], mask: Any, place: Any, targets: Pairs) -> None:
    """Write the pairs that masks stand for, from a place on; pair(bit) gives each."""

    def body(mask: Any, place: Any) -> tuple[Any, Any]:
        cone, ball = pair(dr.tzcnt(mask))
        dr.scatter(targets.cones, cone, place)
        dr.scatter(targets.balls, ball, place)
        return mask & (mask - 1), place + 1

    dr.while_loop((mask, place), lambda mask, place: mask != 0, body)
