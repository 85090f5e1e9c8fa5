"""Two paraboloid views back to back hold all directions from a point; where a direction lies in them, and four texels.

The front view looks along world +x, the back view along -x, both with +z up. Each goes RIM pixels past 180 degrees, so
that the four texels around any direction lie in one view, and bilinear look-ups have no seam.
"""

from typing import Any

import numpy as np

from mpcam.backend import types
from mpcam.cameras.radial import Radial
from mpcam.checks import whole_number
from mpcam.math import atan
from mpcam.math.pose import look_at

RIM = 2
LEAST, MOST = 8, 16384  # pixels along a side


def check_size(size: Any, name: str = "size") -> int:
    """The number of pixels along a side of a map; raises InputError unless it is a whole number that can be served."""
    return whole_number(name, size, LEAST, MOST, unit="pixels")


def pixels_per_radius(size: int) -> float:
    """Pixels from the center of a view to its circle of 180 degrees."""
    return 0.5 * size - RIM


def back_to_back(position: Any, size: int) -> tuple[Radial, Radial]:
    """Front and back camera at a world position."""
    fov = 4.0 * atan(0.5 * size / pixels_per_radius(size))
    eye = np.asarray(position, np.float64)
    poses = [_seen_from(look_at((0.0, 0.0, 0.0), (x, 0.0, 0.0)), eye) for x in (1.0, -1.0)]
    front, back = (Radial.paraboloid(size, size, pose, fov=fov) for pose in poses)
    return front, back


def _seen_from(pose: np.ndarray, eye: np.ndarray) -> np.ndarray:
    pose[:3, 3] = -pose[:3, :3] @ eye
    return pose


def place(direction: Any, length: Any, size: int) -> tuple[Any, Any, Any]:
    """Pixel (u, v) of device directions of a given length, and the number of their view's first texel."""
    import drjit as dr

    x, y, z = direction
    front = x >= 0
    scale = pixels_per_radius(size) / dr.maximum(length + abs(x), 1e-30)
    u = 0.5 * size - dr.select(front, y, -y) * scale
    v = 0.5 * size - z * scale
    return u, v, dr.select(front, types().Int(0), types().Int(size * size))


def texel_direction(column: Any, row: Any, front: Any, size: int) -> Any:
    """Unit world direction of a texel's center: stereographic projection, inverted without trigonometry."""
    import drjit as dr

    t = types()
    scale = 1.0 / pixels_per_radius(size)
    p, q = (t.Float(column) + 0.5 - 0.5 * size) * scale, (t.Float(row) + 0.5 - 0.5 * size) * scale
    squared = p * p + q * q
    part = 1.0 / (1.0 + squared)
    forward = (1.0 - squared) * part
    return t.Array3f(dr.select(front, forward, -forward), dr.select(front, -2 * p, 2 * p) * part, -2 * q * part)


def four_texels(u: Any, v: Any, width: int, height: int) -> list[tuple[Any, Any, Any]]:
    """Column, row and bilinear weight of the four texels around pixels (u, v); kept inside of the image."""
    import drjit as dr

    t = types()
    left, top = dr.floor(u - 0.5), dr.floor(v - 0.5)
    right, down = u - 0.5 - left, v - 0.5 - top
    found = []

    def kept(value: Any, last: int) -> Any:
        return t.Int(dr.fmax(dr.fmin(value, last), 0))  # these two turn NaN into a number

    for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):
        weight = (right if i else 1 - right) * (down if j else 1 - down)
        found.append((kept(left + i, width - 1), kept(top + j, height - 1), weight))
    return found
