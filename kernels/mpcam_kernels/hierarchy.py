"""Which triangles, or points, a bundle of rays may meet: through groups of blocks and clusters of balls, step by step.

Every step takes pairs of a bundle and a ball, refines one of the two, and marks the pairs that may meet. The balls are
those around the triangles and, level by level, around FAN of the level below: of these a lane looks at all, since they
share the bundle, and marks them in a mask; of a group's blocks each has its lane. Marks become new pairs by a prefix
sum, which is quicker than a counter that all threads raise, and keeps the order.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels.bundles import Cone, Cones, may_meet
from mpcam_kernels.rows import Rows

FAN = 8  # children of a cluster


@dataclass(frozen=True)
class Pairs:
    """Numbers of bundles and balls."""

    bundles: Any
    balls: Any

    def at(self, number: Any) -> tuple[Any, Any]:
        """Pairs by number."""
        return dr.gather(type(number), self.bundles, number), dr.gather(type(number), self.balls, number)


def triangle_balls(types: Any, points: tuple[Any, Any, Any], usable: Any) -> Any:
    """Ball around the corners of triangles: centre and radius, radius -1 where unusable."""
    a, b, c = points
    low, high = dr.minimum(dr.minimum(a, b), c), dr.maximum(dr.maximum(a, b), c)
    centre = 0.5 * (low + high)
    radius = dr.sqrt(
        dr.maximum(dr.maximum(dr.squared_norm(a - centre), dr.squared_norm(b - centre)), dr.squared_norm(c - centre))
    )
    return types.Array4f(*dr.select(usable, centre, 0), dr.select(usable, radius, -1.0))


def cluster_balls(types: Any, cluster: Any, balls: Rows, count: int) -> Any:
    """Ball around the balls of FAN children with neighbouring numbers, of which there are `count`."""

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
    centre, radius = dr.select(some, 0.5 * (low + high), 0), types.Float(-1)
    for ball, exists in children:
        radius = dr.select(exists, dr.maximum(radius, dr.norm(ball.xyz - centre) + ball.w), radius)
    return types.Array4f(*centre, radius)


def meeting(types: Any, cone: Cone, balls: Rows, ball: Any, exists: Any, cull: bool) -> Any:
    """Whether bundles and balls may meet; without `cull`, whether there are both."""
    if cull:
        return exists & may_meet(cone, *balls.at(types, ball, exists))
    return exists & (dr.gather(types.Float, balls.flat, ball * 4 + 3, exists) >= 0)


def children(lane: Any, step: tuple[Any, ...], before: Any) -> tuple[Any, Any, Any]:
    """Bundle and ball of each lane of a step from pairs `before`, and whether there are such.

    step: ("all", clusters): all pairs that there are; ("groups", fan, first, count): from a group to its blocks, which
    begin at `first`, `fan` at most.
    """
    name, *rest = step
    if name == "all":
        return lane // rest[0], lane % rest[0], True
    fan, first, count = rest
    group, ball = before.at(lane // fan)
    k = lane % fan
    return dr.gather(type(lane), first, group) + k, ball, k < dr.gather(type(lane), count, group)


def met_children(
    types: Any, cones: Cones, pairs: Any, lane: Any, balls: Rows, count: int, cull: bool
) -> tuple[Any, Any]:
    """Which children of the clusters of pairs may meet the bundles, as a mask, and how many. count: of all balls."""
    bundle, cluster = pairs.at(lane)
    cone, mask = cones(types, bundle), types.UInt(0)
    for k in range(FAN):
        child = cluster * FAN + k
        mask |= dr.select(meeting(types, cone, balls, child, child < count, cull), types.UInt(1 << k), 0)
    return mask, dr.popcnt(mask)


def write_children(types: Any, pairs: Any, lane: Any, mask: Any, place: Any, targets: Pairs) -> None:
    """Write the pairs of bundles and children in masks, from a place on."""
    bundle, cluster = pairs.at(lane)

    def body(mask: Any, place: Any) -> tuple[Any, Any]:
        dr.scatter(targets.bundles, bundle, place)
        dr.scatter(targets.balls, cluster * FAN + dr.tzcnt(mask), place)
        return mask & (mask - 1), place + 1

    dr.while_loop((mask, place), lambda mask, place: mask != 0, body)


@dataclass(frozen=True)
class Chosen:
    """Pairs as the lanes of a step that found them: for few it is not worth writing them down."""

    lanes: Any
    step: tuple[Any, ...]
    before: Any

    def at(self, number: Any) -> tuple[Any, Any]:
        """Pairs by number."""
        bundle, ball, _ = children(dr.gather(type(number), self.lanes, number), self.step, self.before)
        return bundle, ball
