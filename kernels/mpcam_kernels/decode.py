"""From the depth buffer to triangles, depths and barycentric weights."""

from typing import Any

import drjit as dr

from mpcam_kernels.pipeline import EMPTY
from mpcam_kernels.samples import places


def triangles(types: Any, buffer: Any) -> Any:
    """Int triangle of every pixel, -1 where nothing is."""
    return dr.select(buffer == types.UInt64(EMPTY), -1, types.Int(types.UInt(buffer)))


def depths(types: Any, buffer: Any, scale: Any) -> Any:
    """Float depth of every pixel times `scale`, infinite where nothing is."""
    depth = dr.reinterpret_array(types.Float, types.UInt(buffer >> 32))
    return dr.select(buffer == types.UInt64(EMPTY), dr.inf, depth * scale)


def in_rows(types: Any, kind: Any, values: Any, width: int, height: int) -> Any:
    """Values kept in block order, row by row."""
    return dr.gather(kind, values, places(types, width, height))


def weights(types: Any, test: Any, positions: Any, faces: Any, triangle: Any, samples: Any) -> tuple[Any, Any]:
    """Barycentric weights of corners 2 and 3 where `samples` hit their triangles; 0 where triangle is -1."""
    hit = triangle >= 0
    corners = dr.gather(types.Array3u, faces, types.UInt(dr.maximum(triangle, 0)), hit)
    shape = test.setup(*(dr.gather(types.Array3f, positions, corner, hit) for corner in corners))
    second, third = test.weights(shape, samples)
    return dr.select(hit, dr.clip(second, 0, 1), 0), dr.select(hit, dr.clip(third, 0, 1), 0)
