"""Exact rasterization through a curved projection: bound each triangle's image, then invert per pixel."""

import functools
from typing import Any

from mpcam.backend import types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Images, Outlines, need
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.device import to_camera
from mpcam.rendering.outlines import ROWS
from mpcam.rendering.registry import CULLS, OUTLINE_BOUNDS
from mpcam.rendering.z_buffer import ZBuffered

ANEW = "prepare anew, by mpcam.prepare"


class Inverted(ZBuffered):
    """Frames by bounding each curved triangle and testing the rays of the pixels inside.

    Central cameras test rays through one point; parallel rays are straight in the image plane and are tested there.
    bound: "tight" takes a box and three lines from the tangents at the corners (a box from the bounding cone where
    edges turn much) and drops what one edge excludes; "triangle" tests every pixel in one to four bounding triangles
    (Gascuel et al. 2008, 3.3), "quad" every pixel in the box of the quads around the curved edges (3.4). output:
    "hits", "depth" or "coverage". cull: "none", or "back" or "front": triangles that turn this side to the eye are
    left out; corners run counter-clockwise seen from the front.
    """

    method = "invert"

    def __init__(self, camera: Camera, mesh: Mesh, bound: str = "tight", output: str = "hits", cull: str = "none"):
        if bound not in OUTLINE_BOUNDS:
            raise InputError(f"bound={bound!r}: allowed are {', '.join(OUTLINE_BOUNDS)}")
        if cull not in CULLS:
            raise InputError(f"cull={cull!r}: allowed are {', '.join(CULLS)}")
        self.bound, self.output, self.cull = bound, output, cull
        super().__init__(camera, mesh)

    def test_for(self, camera: Camera) -> str:
        if self.bound != "tight" and not hasattr(camera, f"local_bound_{self.bound}s"):
            raise InputError(
                f"bound={self.bound!r} is for radial projections, not for a {type(camera).__name__}: use bound='tight'"
            )
        if camera.ray_geometry == "central":
            need(camera, Outlines, "this prepared frame", ANEW)
            return "ray_triangle"
        need(camera, Images, "this prepared frame", ANEW)
        if camera.ray_geometry != "parallel":
            raise InputError(f"this prepared frame is not for the rays of a {type(camera).__name__}: {ANEW}")
        return "pixel_triangle"

    def place(self, vertices: Any) -> list[Any]:
        import drjit as dr

        from mpcam_kernels.threads import threads

        number = threads(types(), 0, dr.width(vertices) // 3)
        rows = ROWS[self.bound] if self.curved else 1
        targets = [dr.empty(types().Float, 4 * dr.width(number)) for _ in range(rows)]
        model = type(self.camera)
        static = tuple(getattr(self.camera, name) for name in self.camera.static_fields)
        place = _frozen_place(self.curved, model, static if self.curved else (), rows)
        return place(number, targets, self.device_camera.on_device, self.pose, self.unit, vertices)


@functools.lru_cache(maxsize=64)
def _frozen_place(curved: bool, model: type, static: tuple[Any, ...], rows: int) -> Any:
    """Kernel that brings vertices to the camera frame, or into the image plane for parallel rays.

    A second row takes what each vertex knows of the projection around it.
    """
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def place(number: Any, targets: list[Any], camera: Any, pose: list[Any], unit: Any, vertices: Any) -> list[Any]:
        four = types().Array4f
        point = to_camera(pose, vertices, number)
        if not curved:
            point = point * unit
            pixel, _ = camera.local_image(point)
            values = [four(pixel.x, pixel.y, point.z, 0)]
        elif rows == 1:
            values = [four(*point, 0)]
        else:
            view = camera.local_vertex_view(point)
            values = [four(*point, view.place), four(view.s, view.p, view.q, 0)]
        for target, value in zip(targets, values, strict=True):
            dr.scatter(target, value, number)
        return targets

    return place
