"""Values of a depth image where rays met it: mixed from the pixels around that belong to the same surface."""

from collections.abc import Iterator
from typing import Any

import drjit as dr

from mpcam_kernels.depth_patches import unpacked


def mixed_around(
    types: Any, size: tuple[int, int], hit: Any, pixel: tuple[Any, Any], number: Any, patches: Any, values: Any
) -> Any:
    """Array3f: `values` (one per pixel) at places in the image, bilinear; see `around`."""
    total, result = types.Float(0), types.Array3f(0)
    for there, weight in around(types, size, hit, pixel, number, patches):
        total += weight
        result += dr.gather(types.Array3f, values, there, hit) * weight
    return dr.select(hit, result / dr.maximum(total, 1e-6), 0.0)


def around(
    types: Any, size: tuple[int, int], hit: Any, pixel: tuple[Any, Any], number: Any, patches: Any
) -> Iterator[tuple[Any, Any]]:
    """Numbers of the four pixels around places in the image, and their bilinear weights.

    number: of the pixel whose patch was met. Of the three others those count whose depth is that of the patch as it
    goes on to them; the rest have the weight 0.
    """
    width, height = size
    u, v = pixel
    column, row = types.Int(number % width), types.Int(number // width)
    patch = unpacked(types, dr.gather(types.Array4f, patches, number, hit))
    across, along = u - types.Float(column) - 0.5, v - types.Float(row) - 0.5
    right, down = dr.select(across < 0, -1, 1), dr.select(along < 0, -1, 1)
    part = [dr.clip(abs(x), 0, 1) for x in (across, along)]
    slack = 4 * patch.slack()
    for i in (0, 1):
        for j in (0, 1):
            x, y = column + i * right, row + j * down
            inside = hit & (x >= 0) & (y >= 0) & (x < width) & (y < height)
            there = types.UInt(dr.select(inside, y * width + x, 0))
            weight = (part[0] if i else 1 - part[0]) * (part[1] if j else 1 - part[1])
            if i or j:
                depth = dr.gather(types.Float, patches, 4 * there, inside)
                expected = patch.at(types.Float(i * right), types.Float(j * down))
                inside &= abs(depth - expected) <= slack
            else:
                weight = dr.maximum(weight, 1e-6)
            yield there, dr.select(inside, weight, 0.0)


def facing(types: Any, hit: Any, number: Any, patches: Any) -> Any:
    """Cosine of the angle between the pixels' rays and the normals of their patches."""
    patch = unpacked(types, dr.gather(types.Array4f, patches, number, hit))
    slopes = [0.5 * (patch.left + patch.right), 0.5 * (patch.up + patch.down)]
    width = dr.maximum(patch.footprint, 1e-30)
    return dr.rsqrt(1 + dr.square(slopes[0] / width) + dr.square(slopes[1] / width))
