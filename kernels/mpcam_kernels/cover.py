"""Pairs of a block and a triangle: which places of the block the triangle may cover, from the block's linear rays.

The side on which a ray passes an edge is linear in its direction and moment, which are linear in the place but for a
known rest: so each edge is a line in the block, moved outwards by what the rest can amount to.
"""

from typing import Any

import drjit as dr

from mpcam_kernels import blocks, walk
from mpcam_kernels.bundles import Cones
from mpcam_kernels.hierarchy import ROOM, Found
from mpcam_kernels.regions import Region
from mpcam_kernels.samples import HEIGHT, PARTS, PIXELS, WIDTH

SMALL = 32  # places between the lines that one lane walks by itself
WIDE, HIGH = 0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1)


def block_pairs(
    types: Any,
    test: Any,
    output: Any,
    lane: Any,
    rays: Any,
    cones: Cones,
    slopes: list[Any],
    setups: list[Any],
    before: Found,
    counts: Any,
    buffer: Any,
    count: bool,
) -> tuple[blocks.Pairs, Any, Any]:
    """Walk the few places that small triangles may cover, and list the others with the parts that they may cover.

    counts: zeros, one for each block. Returns pairs, tests and hits of each lane; `buffer` is raised to the hits' keys.
    """
    block, triangle = dr.gather(types.Array2u, before.pairs, lane)
    shape = test.unpack([dr.gather(types.Array4f, row, triangle) for row in setups])
    edges, front, back = _edges(types, shape, cones, slopes, block)
    area = _between(types, edges, front)
    spans, places = area.spans(types), types.Int(0)
    for row in range(HEIGHT):
        start, stop = spans(types.Int(row), types.Int(row))
        places += dr.maximum(stop - start, 0)
    one_side = ~(front & back)
    small = one_side & (places <= SMALL)
    tests, hits = walk.walk(
        types, test, output, shape, shape.name, area, small & (places > 0), rays, _placed(types, block), buffer, count
    )
    bits = dr.select(small, 0, _parts(types, edges, front, back))
    keep, found = bits != 0, dr.zeros(types.UInt, 1)
    dr.make_opaque(found)
    slot: Any = dr.scatter_inc(found, types.UInt(0), keep)
    rank = dr.scatter_inc(counts, block, keep)
    names, numbers, parts, ranks = (dr.empty(types.UInt, ROOM) for _ in range(4))
    for target, value in ((names, triangle), (numbers, block), (parts, bits), (ranks, rank)):
        dr.scatter(target, value, slot, keep)
    return blocks.Pairs(names, numbers, parts, ranks, found, counts), tests, hits


def _edges(types: Any, shape: Any, cones: Cones, slopes: list[Any], block: Any) -> tuple[list[Any], Any, Any]:
    """Per edge its value in the middle of the block, its slopes to the right and down, and what it may be off.

    And whether rays may start in front of the triangle's plane, seen along the normal, and behind it: in front they hit
    where all edges are positive, behind where all are negative.
    """
    d, m, d_right, m_right, d_down, m_down = (dr.gather(types.Array4f, row, block) for row in slopes)
    edges = []
    for across, along in shape.edges:
        slack = (d.w + 1e-6) * dr.norm(across)
        slack += (m.w + 1e-6 * (1.0 + abs(m.x) + abs(m.y) + abs(m.z))) * dr.norm(along)
        steps = [
            dr.dot(a.xyz, across) + dr.dot(b.xyz, along) for a, b in ((d, m), (d_right, m_right), (d_down, m_down))
        ]
        edges.append((*steps, slack))
    start, _ = cones(types, block)
    n = shape.normal
    away, reach = shape.offset - dr.dot(n, start.xyz), dr.norm(n) * (start.w + 1e-6) + abs(shape.offset) * 1e-6
    return edges, away + reach >= 0, away - reach <= 0


def _between(types: Any, edges: list[Any], front: Any) -> Region:
    """The places between the lines, for triangles of which rays start on one side only."""
    sign, lines = dr.select(front, types.Float(1), -1), []
    for middle, right, down, slack in edges:
        a, b = sign * right * (1 / WIDE), sign * down * (1 / HIGH)
        c = sign * middle + slack - a * (0.5 * WIDTH) - b * (0.5 * HEIGHT)
        length = dr.sqrt(a * a + b * b)
        scale = 1.0 / dr.maximum(length, 1e-30)
        lines.append(types.Array3f(a * scale, b * scale, c * scale + 1e-3))
    zero = types.Int(0)
    return Region(zero, zero, zero + WIDTH, zero + HEIGHT, (lines[0], lines[1], lines[2]))


def _parts(types: Any, edges: list[Any], front: Any, back: Any) -> Any:
    """A bit for each part of a block that no edge excludes."""
    bits = types.UInt(0)
    for part in range(PARTS):
        s, t = ((part % 4) * 4 + 1.5 - WIDE) / WIDE, ((part // 4) * 4 + 1.5 - HIGH) / HIGH
        positive, negative = front, back
        for middle, right, down, slack in edges:
            value = dr.fma(right, s, dr.fma(down, t, middle))
            reach = slack + abs(right) * (1.5 / WIDE) + abs(down) * (1.5 / HIGH)
            positive, negative = positive & (value + reach >= 0), negative & (value - reach <= 0)
        bits |= dr.select(positive | negative, types.UInt(1 << part), 0)
    return bits


def _placed(types: Any, block: Any) -> Any:
    """A function from columns and rows within blocks to places."""

    def place(x: Any, y: Any) -> Any:
        return block * PIXELS + ((y >> 2) << 6 | (x >> 2) << 4 | (y & 3) << 2 | (x & 3))

    return place
