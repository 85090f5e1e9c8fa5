"""Bounds of images on the planes of camera triangles: boxes and bounding triangles around projected corners.

Hou et al. 2006, section 2.1: the image of a scene triangle lies within its corners, projected along each generator of
the camera triangle's rays.
"""

from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import regions
from mpcam_kernels.poses import placed
from mpcam_kernels.ray_cones import Cones
from mpcam_kernels.samples import PART, PARTS


@dataclass(frozen=True)
class Planes:
    """Camera triangles. maps: three rows of four numbers each, point (x, y, z, 1) to u, v and height. slopes: per
    generator two numbers. state: 1 or -1, the side that rays leave on; 0 where generators bound nothing. lines: six
    numbers, the outward normals of a bounding triangle. side: pixels along the short sides. first, count: blocks, of
    which no camera triangle has more than `fan`. cones: of all rays of each.
    """

    maps: list[Any]
    slopes: list[Any]
    state: Any
    lines: Any
    side: Any
    first: Any
    count: Any
    fan: int
    cones: Cones


@dataclass(frozen=True)
class Items:
    """Regions of a triangle's image in a camera triangle. rows: see `regions.pack`; faces: the camera triangles."""

    rows: list[Any]
    faces: Any


def outline(types: Any, bound: str, planes: Planes, face: Any, points: list[Any]) -> tuple[regions.PixelOutline, Any]:
    """The outline of triangles, in pixels of the camera triangle (center of the first one at 0.5), and its side."""
    rows = [dr.gather(types.Array4f, row, face) for row in planes.maps]
    places = [[dr.dot(row.xyz, point) + row.w for row in rows] for point in points]
    state = dr.gather(types.Float, planes.state, face)
    side = types.Float(dr.gather(types.UInt, planes.side, face))
    finite = dr.isfinite(sum(number for place in places for number in place))
    highest = dr.maximum(dr.maximum(*(place[2] * state for place in places[:2])), places[2][2] * state)
    size = sum(abs(place[2]) for place in places)
    seen = finite & ((state == 0) | (highest >= -1e-6 * size))
    table = dr.gather(types.Array2f, planes.lines, face * 3), dr.gather(types.Array2f, planes.lines, face * 3 + 1)
    normals = [*table, dr.gather(types.Array2f, planes.lines, face * 3 + 2)]
    low, high = types.Array2f(dr.inf), types.Array2f(-dr.inf)
    ends, largest = [types.Float(-dr.inf) for _ in normals], types.Float(0)
    for slopes in planes.slopes:
        slope = dr.gather(types.Array2f, slopes, face)
        for u, v, height in places:
            shift = height * slope
            p = types.Array2f(u, v) - shift
            largest = dr.maximum(largest, abs(u) + abs(v) + abs(shift.x) + abs(shift.y))
            if bound == "nine_point":
                low, high = dr.minimum(low, p), dr.maximum(high, p)
            else:
                ends = [dr.maximum(end, dr.dot(normal, p)) for end, normal in zip(ends, normals, strict=True)]
    whole, pad = (state == 0) | ~(largest < 1e6), 2e-6 * largest  # rounding grows with what was subtracted
    zero, full = types.Array2f(0), types.Array2f(side)
    if bound == "nine_point":
        low, high = dr.select(whole, zero, low + 0.5 - pad), dr.select(whole, full, high + 0.5 + pad)
        return regions.PixelOutline(low, high, seen, (_all(types),) * 3), side
    lines = []
    for end, normal in zip(ends, normals, strict=True):
        offset = end + 0.5 * (normal.x + normal.y) + pad
        lines.append(dr.select(whole, _all(types), types.Array3f(-normal.x, -normal.y, offset)))
    return regions.PixelOutline(zero, full, seen, tuple(lines)), side  # pyright: ignore[reportArgumentType]


def _all(types: Any) -> Any:
    return types.Array3f(*regions.EVERYWHERE)


def items(
    types: Any, bound: str, thread: Any, planes: Planes, vertices: Any, faces: Any, pose: Any, pairs: Any, cull: bool
) -> tuple[Any, Any]:
    """Regions of pairs of a camera triangle and a triangle, and whether there is any; with `cull`, any pixel in it."""
    face, triangle = pairs.at(thread)
    corners = dr.gather(types.Array3u, faces, triangle)
    points = [placed(types, pose, dr.gather(types.Array3f, vertices, corner)) for corner in corners]
    shape, side = outline(types, bound, planes, face, points)
    area, some = regions.region(types, shape, side, side)
    some &= dr.isfinite(points[0].x + points[0].y + points[0].z)
    if cull:
        # Rows from the first on; on the long side of the camera triangle the least of u + v counts.
        some &= types.Float(area.x0 + area.y0) <= side - 1
        for a, b, c in area.lines:
            most = dr.maximum(dr.maximum(0.5 * (a + b), a * (side - 0.5) + 0.5 * b), 0.5 * a + b * (side - 0.5))
            some &= most + c >= 0
    return regions.pack(types, area, triangle), some


def reached(types: Any, thread: Any, fan: int, planes: Planes, items: Items, corners: Any) -> tuple[Any, Any, Any]:
    """Item, block and parts that its region reaches, for each block of its camera triangle; fan: most of these.

    corners: first column and row of each block.
    """
    item, k = thread // fan, thread % fan
    face = dr.gather(types.UInt, items.faces, item)
    exists = k < dr.gather(types.UInt, planes.count, face)
    block = dr.gather(types.UInt, planes.first, face) + k
    area, _ = regions.unpack(types, [dr.gather(types.Array4f, row, item) for row in items.rows])
    x, y = (types.Int(dr.gather(types.UInt, values, block, exists)) for values in corners)
    spans, bits = area.spans(types), types.UInt(0)
    last = types.Int(dr.gather(types.UInt, planes.side, face)) - 1
    for part in range(PARTS):
        left, top = x + (part % 4) * PART, y + (part // 4) * PART
        first, end = dr.maximum(top, area.y0), dr.minimum(top + PART, area.y1) - 1
        start, stop = spans(first, end)
        within = exists & (first <= end) & (start < left + PART) & (stop > left) & (start < stop)
        bits |= dr.select(within & (left + top <= last), types.UInt(1 << part), 0)
    return item, block, bits
