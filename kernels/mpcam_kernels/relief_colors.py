"""Colors and normals of reliefs where rays met them."""

from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels.depth_colors import around

_STEPS = 32767.0


class Looks(NamedTuple):
    """color: Array3f. normal, flat: unit normals, for shading and of the triangle, in the texels' frame; or None."""

    color: Any
    normal: Any
    flat: Any


def packed_normal(types: Any, normal: Any) -> Any:
    """A unit normal in one number: the octahedron, 16 bits each way."""
    total = abs(normal.x) + abs(normal.y) + abs(normal.z)
    x, y = (dr.select(total > 0, part / dr.select(total > 0, total, 1.0), 0.0) for part in (normal.x, normal.y))
    over = [(1.0 - abs(b)) * dr.select(a >= 0, 1.0, -1.0) for a, b in ((x, y), (y, x))]
    x, y = (dr.select(normal.z < 0, folded, part) for folded, part in zip(over, (x, y), strict=True))
    high, low = (types.UInt(types.Int(dr.round(part * _STEPS)) + 32768) for part in (x, y))
    return dr.reinterpret_array(types.Float, (high << 16) | low)


def unpacked_normal(types: Any, number: Any) -> Any:
    """The normal of `packed_normal`, of length 1."""
    bits: Any = dr.reinterpret_array(types.UInt, number)
    x, y = ((types.Float(types.Int(part)) - 32768.0) / _STEPS for part in (bits >> 16, bits & 0xFFFF))
    z = 1.0 - abs(x) - abs(y)
    over = [(1.0 - abs(b)) * dr.select(a >= 0, 1.0, -1.0) for a, b in ((x, y), (y, x))]
    x, y = (dr.select(z < 0, folded, part) for folded, part in zip(over, (x, y), strict=True))
    return dr.normalize(types.Array3f(x, y, z))


def looks(
    types: Any,
    size: tuple[int, int],
    hit: Any,
    pixel: tuple[Any, Any],
    number: Any,
    patches: Any,
    colors: Any,
    normals: Any,
    paint: Any,
) -> Looks:
    """Of hits, mixed from the texels around that belong to the same surface.

    number: of the pixel whose patch was met. colors, normals: rows of four, see `effects.relief_texels`; either may be
    None. paint: Array3f, what takes the place of the key color.
    """
    total, own, painted, normal = types.Float(0), types.Array3f(0), types.Array3f(0), types.Array3f(0)
    for there, weight in around(types, size, hit, pixel, number, patches):
        total += weight
        if colors is not None:
            row = dr.gather(types.Array4f, colors, there, hit)
            own += row.xyz * (weight * (1.0 - row.w))
            painted += row.xyz * (weight * row.w)
        if normals is not None:
            normal += dr.gather(types.Array4f, normals, there, hit).xyz * weight
    color = (own + painted * paint) / dr.maximum(total, 1e-6)
    if normals is None:
        return Looks(color, None, None)
    flat = unpacked_normal(types, dr.gather(types.Array4f, normals, number, hit).w)
    square = dr.squared_norm(normal)
    normal = dr.select(square > 1e-12, normal * dr.rsqrt(dr.maximum(square, 1e-12)), flat)
    return Looks(color, normal, flat)
