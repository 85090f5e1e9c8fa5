"""Which triangles a block of rays may hit: down through groups of blocks and clusters of triangles, step by step.

Every step takes pairs of a bundle and a ball, refines one of the two, and keeps the pairs that may meet. The balls are
those around the triangles and, level by level, around eight of the level below.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import blocks
from mpcam_kernels.bundles import Bundle, Cones, may_meet
from mpcam_kernels.samples import PARTS

FAN = 8  # children of a cluster
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


def cluster_balls(types: Any, cluster: Any, balls: Any, order: Any, count: int) -> Any:
    """Ball around the balls of FAN children; order: which ones, or None for those with neighbouring numbers."""

    def child(k: int) -> tuple[Any, Any]:
        number = cluster * FAN + k
        exists = number < count
        if order is not None:
            number = dr.gather(types.UInt, order, number, exists)
        ball = dr.gather(types.Array4f, balls, number, exists)
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


def first_pairs(types: Any, lane: Any, cones: Cones, balls: Any, clusters: int, cull: bool) -> Found:
    """All pairs of a bundle and a cluster, a lane each; with `cull`, those that may meet."""
    bundle, cluster = lane // clusters, lane % clusters
    return _kept(types, bundle, cluster, _meeting(types, cones, bundle, balls, cluster, True, cull))


def _meeting(types: Any, cones: Cones, bundle: Any, balls: Any, ball: Any, exists: Any, cull: bool) -> Any:
    """Whether bundles and balls may meet; without `cull`, whether there are both."""
    if cull:
        return exists & may_meet(cones(types, bundle, exists), dr.gather(types.Array4f, balls, ball, exists))
    return exists & (dr.gather(types.Float, balls, ball * 4 + 3, exists) >= 0)


def refine_groups(types: Any, lane: Any, fan: int, bundle: Bundle, balls: Any, before: Found, cull: bool) -> Found:
    """Pairs of a group and a cluster to pairs of a block and a cluster; fan: most blocks in a group."""
    group, cluster = dr.gather(types.Array2u, before.pairs, lane // fan)
    k = lane % fan
    exists = k < dr.gather(types.UInt, bundle.count, group)
    block = dr.gather(types.UInt, bundle.first, group) + k
    return _kept(types, block, cluster, _meeting(types, bundle.cones, block, balls, cluster, exists, cull))


def refine_clusters(
    types: Any, lane: Any, cones: Cones, balls: Any, count: int, before: Found, order: Any, cull: bool
) -> Found:
    """Pairs of a bundle and a cluster to pairs with its children, of which there are `count` in all."""
    bundle, cluster = dr.gather(types.Array2u, before.pairs, lane // FAN)
    child = cluster * FAN + lane % FAN
    exists = child < count
    if order is not None:
        child = dr.gather(types.UInt, order, child, exists)
    return _kept(types, bundle, child, _meeting(types, cones, bundle, balls, child, exists, cull))


def block_pairs(
    types: Any, test: Any, lane: Any, bundle: Bundle, setups: list[Any], before: Found, counts: Any
) -> blocks.Pairs:
    """Pairs of a block and a triangle with the parts of the block that the triangle may cover. counts: zeros."""
    block, triangle = dr.gather(types.Array2u, before.pairs, lane)
    shape = test.unpack([dr.gather(types.Array4f, row, triangle) for row in setups])
    slopes = [dr.gather(types.Array4f, row, block) for row in bundle.slopes]
    bits = parts_hit(types, shape, bundle.cones(types, block), slopes)
    keep, found = bits != 0, dr.zeros(types.UInt, 1)
    dr.make_opaque(found)
    slot: Any = dr.scatter_inc(found, types.UInt(0), keep)
    rank = dr.scatter_inc(counts, block, keep)
    room = [dr.empty(types.UInt, ROOM) for _ in range(4)]
    for target, value in zip(room, (triangle, block, bits, rank), strict=True):
        dr.scatter(target, value, slot, keep)
    names, numbers, parts, ranks = room
    return blocks.Pairs(names, numbers, parts, ranks, found, counts)


def parts_hit(types: Any, shape: Any, cone: tuple[Any, Any], slopes: list[Any]) -> Any:
    """A bit for each part of a block that one edge does not exclude."""
    d, m, d_right, m_right, d_down, m_down = slopes
    values = []
    for across, along in shape.edges:
        middle = dr.dot(d.xyz, across) + dr.dot(m.xyz, along)
        right = dr.dot(d_right.xyz, across) + dr.dot(m_right.xyz, along)
        down = dr.dot(d_down.xyz, across) + dr.dot(m_down.xyz, along)
        long, wide = dr.norm(across), dr.norm(along)
        slack = (d.w + 1e-6) * long + (m.w + 1e-6 * (1.0 + abs(m.x) + abs(m.y) + abs(m.z))) * wide
        values.append((middle, right, down, slack + abs(right) * (3.0 / 15.0) + abs(down) * (3.0 / 7.0)))
    first, n = cone[0], shape.normal
    away, reach = shape.offset - dr.dot(n, first.xyz), dr.norm(n) * (first.w + 1e-6) + abs(shape.offset) * 1e-6
    front, back = away + reach >= 0, away - reach <= 0  # where origins may lie, seen along the normal
    bits = types.UInt(0)
    for part in range(PARTS):
        s, t = ((part % 4) * 4 + 1.5 - 7.5) / 7.5, ((part // 4) * 4 + 1.5 - 3.5) / 3.5
        positive, negative = front, back
        for middle, right, down, slack in values:
            value = dr.fma(right, s, dr.fma(down, t, middle))
            positive, negative = positive & (value + slack >= 0), negative & (value - slack <= 0)
        bits |= dr.select(positive | negative, types.UInt(1 << part), 0)
    return bits
