"""The rays of camera triangles on the device, in the frame of a mesh, with all that bounds them."""

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.types import PosedRays
from mpcam.math import normalize
from mpcam.math.pose import frame_origin
from mpcam.rendering.device import DeviceMesh
from mpcam.rendering.layout import Layout, layout


class DeviceRays:
    """Rays of camera triangles in the frame of a device mesh: world axes, from its anchor, in units of its scale.

    bundle: rays by place, with bounds. place: Int, of each pixel row by row, -1 where a pixel has no ray.
    """

    def __init__(self, camera: CameraTriangles, device: DeviceMesh, planes: bool = False):
        t = types()
        self.device = device
        self.layout: Layout = layout(camera.atlas)
        self.fan = int(self.layout.count.max())
        fixed = _on_device(self.layout, camera.atlas)
        self.place = fixed["place"]
        pose = np.asarray(camera.camera_from_world, np.float64)
        centre = frame_origin(pose) - device.anchor
        table = corner_rays(camera, device)
        rows = t.Float(np.ascontiguousarray(table.transpose(2, 0, 1), np.float32).ravel())
        bent: dict[str, Any] = {}
        if camera.directions is None:
            eye = (pose[:3, :3].T @ np.asarray(camera.eye, np.float64) + centre) / device.scale
            bent["eye"] = opaque_numbers(list(eye))
            if camera.index is not None:
                bent["index"] = opaque_numbers([float(camera.index)])[0]
        self.bundle = _frozen_rays(camera.kind)(*fixed["lanes"], fixed, rows, bent)
        if planes:
            found = _planes(camera, device, pose, centre, fixed, self.bundle.cones)
            self.bundle = replace(self.bundle, planes=found)

    @functools.cached_property
    @exclusive
    def view(self) -> PosedRays:
        """The rays in scene units, in world axes from the mesh's anchor."""
        return self.device.view(*self.in_rows())

    def in_rows(self) -> tuple[Any, Any, Any]:
        """Origin, direction and validity of every pixel's ray, row by row, in the mesh's frame."""
        import drjit as dr

        t, pixels = types(), self.bundle.pixels
        valid = self.place >= 0
        number = t.UInt(dr.maximum(self.place, 0))
        direction, _, origin = pixels.at(t, number)
        valid = valid & (dr.squared_norm(direction) > 0)
        return origin, dr.select(valid, direction, t.Array3f(0, 0, 1)), valid


def corner_rays(camera: CameraTriangles, device: DeviceMesh) -> np.ndarray:
    """Positions and rays (or normals) of corner 1, then 2, then 3 of all camera triangles, (6, 3, F), in the mesh's
    frame.
    """
    pose = np.asarray(camera.camera_from_world, np.float64)
    centre, rows = frame_origin(pose) - device.anchor, []
    for place, along in (camera.corners(i) for i in range(3)):
        rows += [(pose[:3, :3].T @ np.asarray(place) + centre[:, None]) / device.scale, pose[:3, :3].T @ along]
    return np.stack(rows)


@functools.lru_cache(maxsize=8)
def _on_device(found: Layout, atlas: Any) -> dict[str, Any]:
    """What of the layout kernels need."""
    import drjit as dr

    from mpcam_kernels.samples import PIXELS

    t = types()
    arrays = {"face": found.face, "x": found.x, "y": found.y, "first": found.first, "count": found.count}
    fixed: dict[str, Any] = {name: t.UInt(np.ascontiguousarray(values, np.uint32)) for name, values in arrays.items()}
    counts = np.bincount(found.face, minlength=len(atlas.sides))
    fixed["face_first"] = t.UInt((np.cumsum(counts) - counts).astype(np.uint32))
    fixed["face_count"] = t.UInt(counts.astype(np.uint32))
    fixed["side"] = t.UInt(np.ascontiguousarray(atlas.sides[found.face], np.uint32))
    fixed["place"] = t.Int(found.places)
    fixed["lanes"] = [dr.arange(t.UInt, n) for n in (found.blocks * PIXELS, found.blocks, len(found.first))]
    dr.make_opaque(fixed)
    return fixed


def _planes(
    camera: CameraTriangles, device: DeviceMesh, pose: np.ndarray, centre: np.ndarray, fixed: Any, blocks: Any
) -> Any:
    """What bounds images on the camera triangles' planes, in the mesh's frame. blocks: cones of the blocks' rays."""
    import drjit as dr

    from mpcam.cameras.generators import plane_bounds
    from mpcam_kernels.bundles import Cones, joined
    from mpcam_kernels.lanes import lanes
    from mpcam_kernels.planes import Planes
    from mpcam_kernels.rows import room

    t, found = types(), plane_bounds(camera)
    # Mesh's frame to camera frame, then to the plane; heights in the mesh's unit.
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = pose[:3, :3] * device.scale, -pose[:3, :3] @ centre
    maps = found.maps @ frame
    maps[:, 2] /= device.scale

    def flat(values: np.ndarray) -> Any:
        return t.Float(np.ascontiguousarray(values, np.float32).ravel())

    slopes = [flat(found.slopes[:, k] * device.scale) for k in range(found.slopes.shape[1])]
    sides = np.broadcast_to(np.asarray(camera.resolution), (camera.count,))
    first, count = fixed["face_first"], fixed["face_count"]
    around = room(t, 2, camera.count)
    around.store(joined(t, blocks, first, count), lanes(t, 0, camera.count))
    result = Planes(
        [flat(maps[:, row]) for row in range(3)],
        slopes,
        flat(found.state),
        flat(found.lines),
        t.UInt(np.ascontiguousarray(sides, np.uint32)),
        first,
        count,
        int(dr.max(count)[0]),
        Cones(around),
    )
    dr.make_opaque(result)
    return result


@functools.cache
def _frozen_rays(kind: str) -> Any:
    """Kernels from tables of camera triangles to rays and their bounds. kind: see `CameraTriangles.kind`."""
    import drjit as dr

    from mpcam_kernels.bundles import Bundle, Cones, bounds, joined
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.rows import Rows, room
    from mpcam_kernels.samples import PIXELS, of_block
    from mpcam_kernels.skew import Rays, packed

    @frozen
    def rays(place: Any, fixed: dict[str, Any], rows: Any, bent: dict[str, Any], target: Rows) -> Rays:
        t = types()
        block = place // PIXELS
        face, side = dr.gather(t.UInt, fixed["face"], block), dr.gather(t.UInt, fixed["side"], block)
        column, row = of_block(place)
        x, y = dr.gather(t.UInt, fixed["x"], block) + column, dr.gather(t.UInt, fixed["y"], block) + row
        last = t.Float(side) - 1
        second, third = t.Float(x) / last, t.Float(y) / last
        table = [dr.gather(t.Array3f, rows, face * 6 + k) for k in range(6)]
        origin, along = table[0], table[1]
        for weight, at in ((second, 2), (third, 4)):
            origin = origin + weight * (table[at] - table[0])
            along = along + weight * (table[at + 1] - table[1])
        camera = _bender(kind, bent)
        direction, valid = camera.bend(origin, along)
        direction = normalize(direction)
        valid = valid & (x + y < side) & dr.isfinite(direction.x + direction.y + direction.z)
        direction, origin = dr.select(valid, direction, 0), dr.select(valid, origin, 0)
        target.store(packed(t, direction, origin), place)
        return Rays(target)

    @frozen
    def bound(block: Any, pixels: Rays, cones: Rows, slopes: Rows) -> tuple[Rows, Rows]:
        first, second, *rest = bounds(types(), pixels, block)
        cones.store([first, second], block)
        slopes.store(rest, block)
        return cones, slopes

    @frozen
    def group(number: Any, cones: Any, first: Any, count: Any, target: Rows) -> Rows:
        target.store(joined(types(), cones, first, count), number)
        return target

    def bundle(places: Any, block: Any, groups: Any, fixed: dict[str, Any], rows: Any, bent: dict[str, Any]) -> Bundle:
        used = {name: fixed[name] for name in ("face", "side", "x", "y")}
        pixels = rays(places, used, rows, bent, room(types(), 2, dr.width(places)))
        targets = (room(types(), count, dr.width(block)) for count in (2, 6))
        cones, slopes = bound(block, pixels, *targets)
        cones = Cones(cones)
        around = group(groups, cones, fixed["first"], fixed["count"], room(types(), 2, dr.width(groups)))
        corners = (fixed["x"], fixed["y"])
        return Bundle(pixels, cones, slopes, Cones(around), fixed["first"], fixed["count"], corners, None)

    return bundle


def _bender(kind: str, bent: dict[str, Any]) -> CameraTriangles:
    """What bends the rays inside of a kernel: a camera with nothing but its eye and index, on the device."""
    camera = object.__new__(CameraTriangles)
    fields = {"directions": kind == "direct" or None, "eye": bent.get("eye"), "index": bent.get("index")}
    for name, value in fields.items():
        object.__setattr__(camera, name, value)
    return camera
