"""Straight-edged triangles whose corners were projected one by one; a corner out of view has a negative depth.

A triangle with all three corners out of view is left out: behind the eye its edges would run across the whole image.
"""

from typing import Any

from mpcam_kernels import planar
from mpcam_kernels.planar import ROWS as ROWS
from mpcam_kernels.planar import hit as hit
from mpcam_kernels.planar import inside as inside
from mpcam_kernels.planar import may_hit as may_hit
from mpcam_kernels.planar import pack as pack
from mpcam_kernels.planar import turn as turn
from mpcam_kernels.planar import unpack as unpack
from mpcam_kernels.planar import weights as weights


def setup(a: Any, b: Any, c: Any) -> planar.PlanarTriangle:
    """Edge functions; x, y of the corners are pixels, |z| their depths."""
    seen = (a.z > 0) | (b.z > 0) | (c.z > 0)
    shape = planar.setup(*(type(p)(p.x, p.y, abs(p.z)) for p in (a, b, c)))
    return shape._replace(usable=shape.usable & seen)
