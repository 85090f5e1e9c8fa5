"""The rays of any camera on the device: of its image, of its layers if rays are bent, or of camera triangles."""

import functools
from typing import Any

from mpcam.backend import opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.capabilities import Bends
from mpcam.rendering.block_layout import image_layout
from mpcam.rendering.camera_triangle_rays import camera_triangle_rays
from mpcam.rendering.device import DeviceMesh
from mpcam.rendering.device_camera import DeviceCamera, device_camera
from mpcam.rendering.layered_rays import layered_rays
from mpcam.rendering.ray_blocks import DeviceRays, bounded, family, gathered, rows_for


def device_rays(camera: Camera, device: DeviceMesh, planes: bool = False) -> DeviceRays:
    """Rays of a camera in the unit of a device mesh; planes: with what bounds images on planes of camera triangles."""
    if isinstance(camera, CameraTriangles):
        return camera_triangle_rays(camera, device, planes)
    known = device_camera(camera)
    return layered_rays(known, device.scale) if isinstance(camera, Bends) else image_rays(known, device.scale)


def image_rays(camera: DeviceCamera, scale: float) -> DeviceRays:
    """The rays of a camera's pixels as it gives them; made once for all poses of the camera."""
    kind = "central" if camera.has_center else "general"
    key = kind, 1.0 if kind == "central" else scale
    known = camera.kept.get(key)
    if known is None:
        layout = image_layout(*camera.size)
        fixed = layout.on_device
        used = {name: fixed[name] for name in ("x", "y")}
        used["size"] = [types().UInt([side]) for side in camera.size]
        inverse = opaque_numbers([1.0 / scale])[0]
        given = tuple(camera.ray)  # frozen kernels do not look into named tuples
        rays = _frozen_image_rays(kind)(fixed["threads"][0], used, given, inverse, rows_for(kind, "Rays", layout, 0))
        blocks = bounded(kind, rays, layout)
        known = camera.kept[key] = DeviceRays(layout, kind, camera.anchor, blocks, lambda: camera.ray)
    return known


@functools.cache
def _frozen_image_rays(kind: str) -> Any:
    """Kernel that brings rays of pixels, row by row, into blocks."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.samples import PIXELS, of_block

    module = family(kind)

    @frozen
    def rays(slot: Any, fixed: dict[str, Any], given: Any, inverse: Any, target: Any) -> Any:
        t = types()
        block, (width, height) = slot // PIXELS, fixed["size"]
        column, row = of_block(slot)
        x, y = gathered(fixed["x"], block) + column, gathered(fixed["y"], block) + row
        exists = (x < width) & (y < height)
        pixel = y * width + x
        origin, direction, valid = given
        direction = dr.gather(t.Array3f, direction, pixel, exists)
        valid = exists & dr.gather(t.Bool, valid, pixel, exists)
        valid &= dr.isfinite(direction.x + direction.y + direction.z) & (dr.squared_norm(direction) > 0)
        origin = t.Array3f(0) if kind == "central" else dr.gather(t.Array3f, origin, pixel, exists) * inverse
        valid &= dr.isfinite(origin.x + origin.y + origin.z)
        direction, origin = dr.select(valid, direction, 0), dr.select(valid, origin, 0)
        target.store(module.packed(t, direction, origin), slot)
        return module.Rays(target)

    return rays
