"""Exact rasterization through a curved projection: bound each triangle's image, then invert per pixel."""

import functools
from typing import Any

from mpcam.cameras.base import Camera
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.buffered import Buffered
from mpcam.rendering.device import flat, to_camera, types

BOUNDS = ("tight", "quad")


class Inverted(Buffered):
    """Frames by bounding each curved triangle and testing the rays of the pixels inside.

    Central cameras test rays through one point; parallel rays are straight in the image plane and are tested there.
    bound: "tight" takes boxes from the tangents at the corners (from the bounding cone where edges turn much) and
    drops blocks of pixels that one edge excludes; "quad" tests every pixel in the box of the quads around the curved
    edges (Gascuel et al. 2008, 3.4).
    """

    method = "invert"

    def __init__(self, camera: Camera, mesh: Mesh, bound: str = "tight", output: str = "hits"):
        if bound not in BOUNDS:
            raise InputError(f"bound={bound!r}: allowed are {', '.join(BOUNDS)}")
        if bound == "quad" and not hasattr(camera, "local_bound_quads"):
            raise InputError(
                f"bound='quad' is for radial projections, not for a {type(camera).__name__}: use bound='tight'"
            )
        super().__init__(camera, mesh, "central" if camera.central else "planar")
        self.bound, self.output = bound, output

    def place(self, vertices: Any) -> Any:
        import drjit as dr

        number = dr.arange(types().UInt, dr.width(vertices) // 3)
        dr.make_opaque(number)
        target = dr.empty(types().Float, dr.width(vertices))
        return _frozen_place(self.curved)(number, target, self.lens.on_device, self.pose, self.unit, vertices)


@functools.cache
def _frozen_place(curved: bool) -> Any:
    """Kernel that brings vertices to the camera frame, or into the image plane for parallel rays."""

    from mpcam_kernels.frozen import frozen

    @frozen
    def place(number: Any, target: Any, camera: Any, pose: list[Any], unit: Any, vertices: Any) -> Any:
        point = to_camera(pose, vertices, number)
        if not curved:
            point = point * unit
            pixel, _ = camera.local_image(point)
            point = types().Array3f(pixel.x, pixel.y, point.z)
        return flat(target, point, number)

    return place
