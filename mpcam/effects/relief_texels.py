"""What shading reads of a relief's texels: color, how much of it an instance may color, and normals."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_numbers, opaque_zero, types
from mpcam.depth_images.depth_image import DepthImage
from mpcam.rendering.device import device_mesh

SAME_COLOR = 1e-4


@dataclass(frozen=True)
class Texels:
    """Rows of four numbers per texel, on the device.

    colors: color and 0; of texels with the key color what that is to be multiplied by, and 1. normals: shading normal
    in the frame of the image's scene, and that of the triangle, two numbers in one; or None. key: three numbers.
    """

    colors: Any
    normals: Any
    key: list[Any]


def texels_of(image: DepthImage, key: Any, mask: np.ndarray | None) -> Texels:
    """The texels of an image. key: the color that instances replace, or None; mask: (H, W), where it is."""
    flags = None
    if key is not None:
        chosen = np.abs(np.asarray(image.color) - key).max(-1) <= SAME_COLOR if mask is None else mask
        flags = types().Float(aligned(chosen)) + opaque_zero()
    numbers = opaque_numbers([1.0, 1.0, 1.0] if key is None else [*key])
    normals = image.device_normals
    hits = image.hits if normals is not None else None
    faces: Any = None
    if hits is not None:
        device = device_mesh(hits.mesh)
        faces = hits.device_triangle, device.faces, device.vertices
    colors, packed = _frozen()(image.device_color, flags, numbers, normals, faces)
    return Texels(colors, packed, numbers)


@functools.cache
def _frozen() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.relief_colors import packed_normal

    @frozen
    def rows(color: Any, flags: Any, key: list[Any], normals: Any, faces: Any) -> tuple[Any, Any]:
        t = types()
        flag = t.Float(0) if flags is None else flags
        known = [dr.select(part > 0, color[i] / dr.select(part > 0, part, 1.0), 0.0) for i, part in enumerate(key)]
        # A channel that the key has nothing of says nothing of the shade: the others do.
        some = [dr.select(part > 0, t.Float(1), 0.0) for part in key]
        mean = sum(known, t.Float(0)) / dr.maximum(t.Float(sum(some)), t.Float(1))
        factor = t.Array3f(*(dr.select(part > 0, one, mean) for part, one in zip(key, known, strict=True)))
        mixed = dr.select(flag > 0, factor, color)
        colors = dr.ravel(t.Array4f(*mixed, flag))
        if normals is None:
            return colors, None
        flat = t.Array3f(normals)
        if faces is not None:
            triangle, table, vertices = faces
            hit = triangle >= 0
            corners = dr.gather(t.Array3u, table, t.UInt(dr.maximum(triangle, 0)), hit)
            a, b, c = (dr.gather(t.Array3f, vertices, corner, hit) for corner in corners)
            found = dr.cross(b - a, c - a)
            size = dr.norm(found)
            flat = dr.select(hit & (size > 0), found / dr.select(size > 0, size, 1.0), flat)
        return colors, dr.ravel(t.Array4f(*normals, packed_normal(t, flat)))

    return rows
