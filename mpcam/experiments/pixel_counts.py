"""How often each pixel is tested against a triangle, and how often a test hits: a plain count in float64.

It asks the camera for the region of each bound and goes through its pixels; it shares no code with the kernels.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

CHUNK = 2_000_000
"""Pairs of a pixel and a triangle that are held at a time."""
SQUARE = 4
"""Pixels along a side of the squares by which the rasterizer takes large triangles with the tight bound."""

Numbers = NDArray[np.int64]
Reals = NDArray[np.float64]


class PixelRegion(NamedTuple):
    """Pixels that a bound leaves of each of F triangles: a box, and lines (F, 3) whose positive sides it lies on.

    first, last: (F, 2), the first pixels and those after the last; the same where there is no region. squares: (F,),
    whether not the region is tested but, within it, squares of pixels that the triangle covers in part; None: nowhere.
    """

    first: Numbers
    last: Numbers
    lines: tuple[Reals, ...] = ()
    squares: NDArray[np.bool_] | None = None


def local_corners(camera: Any, mesh: Any) -> Reals:
    """Corners of the mesh's triangles in the camera frame, (F, 3, 3)."""
    pose = np.asarray(camera.camera_from_world, np.float64)
    return np.asarray(mesh.corners, np.float64) @ pose[:3, :3].T + pose[:3, 3]


def regions(camera: Any, corners: Reals, bound: str) -> list[PixelRegion]:
    """What a bound ("tight", "quad" or "triangle") of a radial camera leaves; "triangle" gives up to four parts."""
    points = [np.moveaxis(corners[:, i], -1, 0) for i in range(3)]
    with np.errstate(all="ignore"):
        if bound == "quad":
            return [_region(camera, camera.local_bound_quads(*points))]
        if bound == "triangle":
            return [_region(camera, piece, piece.lines) for piece in camera.local_bound_triangles(*points)]
        outline, sure = camera.local_outline(points, [camera.local_vertex_view(point) for point in points])
        rough = _region(camera, camera.local_bound_rough(*points))
        fine = _region(camera, outline, outline.lines)
        everywhere = np.array([0.0, 0.0, 1.0])
        kept = np.asarray(sure)[:, None]  # the others are large
        return [
            PixelRegion(
                np.where(kept, fine.first, rough.first),
                np.where(kept, fine.last, rough.last),
                tuple(np.where(kept, line, everywhere) for line in fine.lines),
                ~np.asarray(sure),
            )
        ]


def counts(camera: Any, corners: Reals, bound: str) -> tuple[Numbers, Numbers]:
    """Tests of each pixel, (H, W), and how many of them hit; central cameras."""
    rows, columns = np.mgrid[0 : camera.height, 0 : camera.width]
    ray = camera.local_ray(np.stack([columns.ravel() + 0.5, rows.ravel() + 0.5]))
    directions, valid = np.stack([*ray.direction], -1), np.asarray(ray.valid)
    tested, hit = np.zeros(len(valid), np.int64), np.zeros(len(valid), np.int64)
    for region in regions(camera, corners, bound):
        for triangle, pixel in pairs(camera, region):
            found = valid[pixel] & ray_hits(directions[pixel], corners[triangle])
            hit += np.bincount(pixel[found], minlength=len(hit))
            if region.squares is not None:
                found &= region.squares[triangle]
                tested += in_squares(camera, triangle[found], pixel[found])
                pixel = pixel[~region.squares[triangle]]
            tested += np.bincount(pixel, minlength=len(tested))
    size = (camera.height, camera.width)
    return tested.reshape(size), hit.reshape(size)


def in_squares(camera: Any, triangle: Numbers, pixel: Numbers) -> Numbers:
    """How often each pixel lies in a square of which a triangle covers any of these pixels, row by row."""
    columns = -(-camera.width // SQUARE)
    rows = -(-camera.height // SQUARE)
    row, column = np.divmod(pixel, camera.width)
    square = (row // SQUARE) * columns + column // SQUARE
    each = np.unique(np.stack([triangle, square]), axis=1)[1]
    count = np.bincount(each, minlength=rows * columns).reshape(rows, columns)
    whole = count.repeat(SQUARE, 0).repeat(SQUARE, 1)
    return whole[: camera.height, : camera.width].ravel()


def pairs(camera: Any, region: PixelRegion) -> Iterator[tuple[Numbers, Numbers]]:
    """Triangles and the pixels (row by row numbers) in their regions, in chunks."""
    widths, areas = region.last[:, 0] - region.first[:, 0], (region.last - region.first).prod(-1)
    filled = np.flatnonzero(areas)
    ends = np.cumsum(areas[filled])
    start = 0
    while start < len(filled):
        held = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, held + CHUNK, "right")))
        some = filled[start:stop]
        triangle = np.repeat(some, areas[some])
        within = np.arange(len(triangle)) - np.repeat(np.cumsum(areas[some]) - areas[some], areas[some])
        row, column = np.divmod(within, widths[triangle])
        row, column = row + region.first[triangle, 1], column + region.first[triangle, 0]
        keep = np.ones(len(triangle), bool)
        for line in region.lines:
            a, b, c = line[triangle].T
            keep &= a * (column + 0.5) + b * (row + 0.5) + c >= 0
        yield triangle[keep], (row * camera.width + column)[keep]
        start = stop


def ray_hits(directions: Reals, corners: Reals) -> NDArray[np.bool_]:
    """Whether rays from the origin along directions (N, 3) hit triangles (N, 3, 3).

    The ray lies on the inner side of the planes through the origin and each edge, and the triangle lies ahead.
    """
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    sides = np.stack([np.sum(directions * np.cross(p, q), -1) for p, q in ((b, c), (c, a), (a, b))])
    normal = np.cross(b - a, c - a)
    ahead = np.sum(normal * a, -1) * np.sum(normal * directions, -1) > 0
    return ahead & ((sides >= 0).all(0) | (sides <= 0).all(0))


def _region(camera: Any, box: Any, lines: Any = ()) -> PixelRegion:
    """A camera's box (and lines) as pixels whose centers lie in it."""
    size = np.array([camera.width, camera.height])
    low, high = np.stack([*box.low], -1), np.stack([*box.high], -1)
    first = np.clip(np.ceil(np.nan_to_num(low, nan=0) - 0.5), 0, size).astype(np.int64)
    last = np.clip(np.floor(np.nan_to_num(high, nan=1e9) + 0.5), 0, size).astype(np.int64)
    last = np.where(np.asarray(box.valid)[:, None], np.maximum(last, first), first)
    return PixelRegion(first, last, tuple(np.stack(np.broadcast_arrays(*line), -1) for line in lines))
