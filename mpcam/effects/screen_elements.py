"""What a pinhole's pixels see, as points, for kernels of effects in screen space."""

from typing import Any


def element(t: Any, size: tuple[int, int], surface: dict[str, Any], buffer: Any) -> tuple[Any, Any, Any]:
    """Pixel numbers, points and whether there is one."""
    import drjit as dr

    pixel = dr.arange(t.UInt, size[0] * size[1])
    row = pixel // size[0]
    hit = surface["z"] < dr.inf
    z = dr.select(hit, surface["z"], 1.0)
    x = (t.Float(pixel - row * size[0]) + 0.5 - buffer.cx) / buffer.fx
    y = (t.Float(row) + 0.5 - buffer.cy) / buffer.fy
    return pixel, t.Array3f(x * z, y * z, z), hit
