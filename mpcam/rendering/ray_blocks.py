"""The rays of cameras on the device, block by block, with all that bounds them: for any camera that has rays."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.types import PosedRays
from mpcam.rendering.block_layout import BlockLayout, image_layout
from mpcam.rendering.device import DeviceMesh
from mpcam.rendering.device_camera import DeviceCamera, around, device_camera


@dataclass(frozen=True, eq=False)
class DeviceRays:
    """Rays of a camera's pixels, in the camera's axes, from an anchor, in the unit of a device mesh.

    kind: "central" where all leave from the anchor, else "general". anchor (3,): camera frame, scene units. blocks: a
    `mpcam_kernels.ray_blocks.RayBlocks`. rows: gives the rays of the pixels row by row, from the anchor, scene units.
    """

    layout: BlockLayout
    kind: str
    anchor: np.ndarray
    blocks: Any
    rows: Callable[[], Any]

    @property
    def slots(self) -> Any:
        """Int, the slot of each pixel row by row, -1 where there is none."""
        return self.layout.on_device["slots"]

    @exclusive
    def posed(self, camera: Camera) -> PosedRays:
        """The rays in scene units; camera: the one whose rays they are, at any pose."""
        return PosedRays(around(camera, self.anchor), self.rows())


def device_rays(camera: Camera, device: DeviceMesh, planes: bool = False) -> DeviceRays:
    """Rays of a camera in the unit of a device mesh; planes: with what bounds images on planes of camera triangles."""
    if isinstance(camera, CameraTriangles):
        from mpcam.rendering.camera_triangle_rays import camera_triangle_rays

        return camera_triangle_rays(camera, device.scale, planes)
    return image_rays(device_camera(camera), device.scale)


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
        rays = _frozen_image_rays(kind)(fixed["threads"][0], used, given, inverse, _room(kind, "Rays", layout, 0))
        blocks = bounded(kind, rays, layout)
        known = camera.kept[key] = DeviceRays(layout, kind, camera.anchor, blocks, lambda: camera.ray)
    return known


def _family(kind: str) -> Any:
    """The kernels' module for a kind of rays."""
    from mpcam_kernels.block_pipeline import RAYS

    return RAYS[kind]


def _room(kind: str, part: str, layout: BlockLayout, threads: int) -> Any:
    """Rows to be written: of rays, slopes or cones, one for each of the threads."""
    import drjit as dr

    from mpcam_kernels.rows import room

    count = getattr(_family(kind), part).ROWS
    return room(types(), count, dr.width(layout.on_device["threads"][threads]))


def bounded(kind: str, rays: Any, layout: BlockLayout, planes: Any = None) -> Any:
    """`RayBlocks` of rays by slot."""
    import drjit as dr

    from mpcam_kernels.ray_blocks import RayBlocks

    fixed, family = layout.on_device, _family(kind)
    _, block, group = fixed["threads"]
    first, count, corners = fixed["first"], fixed["count"], (fixed["x"], fixed["y"])
    bound, around = _frozen_bounds(kind)
    cones, slopes = bound(block, rays, *(_room(kind, part, layout, 1) for part in ("Cones", "Slopes")))
    cones, slopes = family.Cones(cones), family.Slopes(slopes)
    targets = (_room(kind, part, layout, 2) for part in ("Cones", "Slopes"))
    group_cones, group_slopes = around(group, cones, slopes, corners, first, count, *targets)
    group_cones, group_slopes = family.Cones(group_cones), family.Slopes(group_slopes)
    found = RayBlocks(
        rays,
        cones,
        slopes,
        group_cones,
        group_slopes,
        first,
        count,
        fixed["numbers"],
        fixed["exist"],
        corners,
        planes,
    )
    dr.eval(found)
    return found


@functools.cache
def _frozen_bounds(kind: str) -> tuple[Any, Any]:
    """Kernels that bound the rays of blocks, and of groups."""
    from mpcam_kernels import ray_blocks
    from mpcam_kernels.frozen import frozen

    family = _family(kind)

    @frozen
    def bound(block: Any, rays: Any, cones: Any, slopes: Any) -> tuple[Any, Any]:
        cone, lines = family.block_bounds(types(), rays, block)
        cones.store(cone, block)
        slopes.store(lines, block)
        return cones, slopes

    @frozen
    def around(
        group: Any, cones: Any, slopes: Any, corners: Any, first: Any, count: Any, cone_rows: Any, slope_rows: Any
    ) -> tuple[Any, Any]:
        first, count = (_at(values, group) for values in (first, count))
        cone_rows.store(cones.joined(types(), first, count), group)
        slope_rows.store(ray_blocks.group_bounds(types(), slopes, corners, first, count), group)
        return cone_rows, slope_rows

    return bound, around


def _at(values: Any, number: Any) -> Any:
    import drjit as dr

    return dr.gather(type(values), values, number)


@functools.cache
def _frozen_image_rays(kind: str) -> Any:
    """Kernel that brings rays of pixels, row by row, into blocks."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.samples import PIXELS, of_block

    family = _family(kind)

    @frozen
    def rays(slot: Any, fixed: dict[str, Any], given: Any, inverse: Any, target: Any) -> Any:
        t = types()
        block, (width, height) = slot // PIXELS, fixed["size"]
        column, row = of_block(slot)
        x, y = _at(fixed["x"], block) + column, _at(fixed["y"], block) + row
        exists = (x < width) & (y < height)
        pixel = y * width + x
        origin, direction, valid = given
        direction = dr.gather(t.Array3f, direction, pixel, exists)
        valid = exists & dr.gather(t.Bool, valid, pixel, exists)
        valid &= dr.isfinite(direction.x + direction.y + direction.z) & (dr.squared_norm(direction) > 0)
        origin = t.Array3f(0) if kind == "central" else dr.gather(t.Array3f, origin, pixel, exists) * inverse
        valid &= dr.isfinite(origin.x + origin.y + origin.z)
        direction, origin = dr.select(valid, direction, 0), dr.select(valid, origin, 0)
        target.store(family.packed(t, direction, origin), slot)
        return family.Rays(target)

    return rays
