"""Straight-edged triangles whose corners were projected one by one; a corner out of view has a negative depth.

A triangle with all three corners out of view is left out: behind the eye its edges would run across the whole image.
"""

from typing import Any

from mpcam_kernels import pixel_triangle
from mpcam_kernels.pixel_triangle import ROWS as ROWS
from mpcam_kernels.pixel_triangle import corner as corner
from mpcam_kernels.pixel_triangle import hit as hit
from mpcam_kernels.pixel_triangle import inside as inside
from mpcam_kernels.pixel_triangle import may_hit as may_hit
from mpcam_kernels.pixel_triangle import pack as pack
from mpcam_kernels.pixel_triangle import turn as turn
from mpcam_kernels.pixel_triangle import unpack as unpack
from mpcam_kernels.pixel_triangle import weights as weights


def setup(a: Any, b: Any, c: Any) -> pixel_triangle.PixelTriangle:
    """Edge functions; x, y of the corners are pixels, |z| their depths."""
    seen = (a.z > 0) | (b.z > 0) | (c.z > 0)
    shape = pixel_triangle.setup(*(type(p)(p.x, p.y, abs(p.z)) for p in (a, b, c)))
    return shape._replace(usable=shape.usable & seen)
