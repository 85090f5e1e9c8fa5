"""The ray-triangle test for rays through one point, with set-ups that carry the triangle's number."""

from typing import Any, NamedTuple

import drjit as dr

from mpcam_kernels import ray_triangle
from mpcam_kernels.ray_triangle import hit, inside, setup, turn, weights

__all__ = ["ROWS", "OneSided", "hit", "inside", "pack", "setup", "unpack", "weights"]

ROWS = ray_triangle.ROWS + 1


class NamedTriangle(NamedTuple):
    """A `ray_triangle.RayTriangle` and its number."""

    edges: tuple[Any, Any, Any]
    plane: Any
    usable: Any
    name: Any


def pack(types: Any, triangle: Any, name: Any) -> list[Any]:
    """The set-up and the number of the triangle, in rows of four numbers."""
    number = dr.reinterpret_array(types.Float, types.UInt(name))
    return [*ray_triangle.pack(types, triangle), types.Array4f(0, 0, 0, number)]


def unpack(rows: list[Any]) -> NamedTriangle:
    """The set-up of a usable triangle from its rows."""
    *shape, last = rows
    name = dr.reinterpret_array(dr.uint32_array_t(type(last.w)), last.w)
    return NamedTriangle(*ray_triangle.unpack(shape)[:2], True, name)


class OneSided:
    """The same test for triangles of which one side is not shown: "back" or "front"."""

    ROWS = ROWS
    hit, inside = staticmethod(hit), staticmethod(inside)
    pack, unpack, weights = staticmethod(pack), staticmethod(unpack), staticmethod(weights)

    def __init__(self, cull: str):
        self.sign = {"back": -1.0, "front": 1.0}[cull]

    def setup(self, a: Any, b: Any, c: Any) -> ray_triangle.RayTriangle:
        """As `setup`; unusable where the side that is turned to the eye is not shown."""
        shape = setup(a, b, c)
        return shape._replace(usable=shape.usable & (self.sign * turn(a, b, c) > 0))
