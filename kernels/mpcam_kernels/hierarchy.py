"""Which triangles a block of rays may hit: down through groups of blocks and clusters of triangles, step by step.

Every step takes pairs of a bundle and a ball, refines one of the two, and keeps the pairs that may meet. The balls are
those around the triangles and, level by level, around eight of the level below.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels.bundles import Cones, may_meet
from mpcam_kernels.rows import Rows

FAN = 8  # children of a cluster
SHARE = 2  # lanes that share the children of a cluster: more of them gather the same cone again
ROOM = 1 << 20  # pairs that a step keeps at a time


@dataclass(frozen=True)
class Found:
    """Pairs of a bundle and a ball, and how many there are."""

    pairs: Any
    found: Any


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


def _kept(types: Any, a: Any, b: Any, keep: Any) -> Found:
    """The pairs to keep; those beyond ROOM are counted, but not kept."""
    found, pairs = dr.zeros(types.UInt, 1), dr.empty(types.UInt, 2 * ROOM)
    dr.make_opaque(found)
    slot: Any = dr.scatter_inc(found, types.UInt(0), keep)
    dr.scatter(pairs, types.Array2u(a, b), slot, keep & (slot < ROOM))
    return Found(pairs, found)


def first_pairs(types: Any, lane: Any, cones: Cones, balls: Rows, clusters: int, cull: bool) -> Found:
    """All pairs of a bundle and a cluster, a lane each; with `cull`, those that may meet."""
    bundle, cluster = lane // clusters, lane % clusters
    return _kept(types, bundle, cluster, _meeting(types, cones, bundle, balls, cluster, True, cull))


def _meeting(types: Any, cones: Cones, bundle: Any, balls: Rows, ball: Any, exists: Any, cull: bool) -> Any:
    """Whether bundles and balls may meet; without `cull`, whether there are both."""
    if cull:
        return exists & may_meet(cones(types, bundle, exists), *balls.at(types, ball, exists))
    return exists & (dr.gather(types.Float, balls.flat, ball * 4 + 3, exists) >= 0)


def refine_groups(
    types: Any, lane: Any, fan: int, cones: Cones, first: Any, count: Any, balls: Rows, before: Found, cull: bool
) -> Found:
    """Pairs of a group and a cluster to pairs of a block and a cluster; fan: most blocks in a group."""
    group, cluster = dr.gather(types.Array2u, before.pairs, lane // fan)
    k = lane % fan
    exists = k < dr.gather(types.UInt, count, group)
    block = dr.gather(types.UInt, first, group) + k
    return _kept(types, block, cluster, _meeting(types, cones, block, balls, cluster, exists, cull))


def refine_clusters(types: Any, lane: Any, cones: Cones, balls: Rows, count: int, before: Found, cull: bool) -> Found:
    """Pairs of a bundle and a cluster to pairs with its children, `count` in all; SHARE lanes for each."""
    bundle, cluster = dr.gather(types.Array2u, before.pairs, lane // SHARE)
    first, cone = cluster * FAN + (lane % SHARE) * (FAN // SHARE), cones(types, bundle)
    found, pairs = dr.zeros(types.UInt, 1), dr.empty(types.UInt, 2 * ROOM)
    dr.make_opaque(found)

    def look(k: Any) -> Any:
        child = first + k
        (ball,) = balls.at(types, child, child < count)
        keep = (child < count) & (may_meet(cone, ball) if cull else ball.w >= 0)
        slot: Any = dr.scatter_inc(found, types.UInt(0), keep)
        dr.scatter(pairs, types.Array2u(bundle, child), slot, keep & (slot < ROOM))
        return (k + 1,)

    dr.while_loop((0 * lane,), lambda k: k < FAN // SHARE, look)
    return Found(pairs, found)
