"""From keys to triangles, depths, coverage and barycentric weights."""

from typing import Any

import drjit as dr

from mpcam_kernels.poses import placed
from mpcam_kernels.samples import slots_of


def triangles(types: Any, output: Any, keys: Any) -> Any:
    """Int triangle of every pixel, -1 where nothing is."""
    return dr.select(keys == 0, -1, types.Int(output.triangle(types, keys)))


def depths(types: Any, output: Any, keys: Any, scale: Any, start: Any = None) -> Any:
    """Float depth of every pixel times `scale`, infinite where nothing is. start: depths that distances count from."""
    near = output.nearness(types, keys)
    return dr.select(keys == 0, dr.inf, scale / near if start is None else (start + 1.0 / near) * scale)


def frame(types: Any, output: Any, keys: Any, unit: Any, start: Any = None) -> tuple[Any, ...]:
    """What a frame of an output (see `outputs`) holds: triangle and depth, depth, or whether there is anything."""
    if not output.depth:
        return (keys != 0,)
    depth = depths(types, output, keys, unit, start)
    return (triangles(types, output, keys), depth) if hasattr(output, "triangle") else (depth,)


def in_rows(kind: Any, values: Any, pixel: Any, width: int) -> Any:
    """Values kept in block order, for pixels that are numbered row by row."""
    return dr.gather(kind, values, slots_of(pixel, width))


def weights(
    types: Any, test: Any, vertices: Any, faces: Any, triangle: Any, samples: Any, row: Any, pose: Any = None
) -> tuple[Any, Any]:
    """Barycentric weights of corners 2 and 3 where `samples` hit their triangles; 0 where triangle is -1.

    vertices: a row (an array type) each, which starts with the position; pose: brings them to the samples' frame.
    """
    hit = triangle >= 0
    corners = dr.gather(types.Array3u, faces, types.UInt(dr.maximum(triangle, 0)), hit)
    found = [dr.gather(row, vertices, corner, hit) for corner in corners]
    points = [test.corner(row) if pose is None else placed(types, pose, row.xyz) for row in found]
    shape = test.setup(*points)
    second, third = test.weights(shape, samples)
    return dr.select(hit, dr.clip(second, 0, 1), 0), dr.select(hit, dr.clip(third, 0, 1), 0)
