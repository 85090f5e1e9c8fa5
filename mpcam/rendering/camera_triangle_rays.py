"""The rays of camera triangles on the device, with all that bounds them."""

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.backend import aligned, opaque_numbers, types
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.triangle_nodes import mixed
from mpcam.cameras.types import Ray
from mpcam.math import normalize
from mpcam.rendering.block_layout import BlockLayout, atlas_layout
from mpcam.rendering.device import DeviceMesh
from mpcam.rendering.ray_blocks import DeviceRays, bounded, rows_for


def camera_triangle_rays(camera: CameraTriangles, device: DeviceMesh, planes: bool = False) -> DeviceRays:
    """Rays around the anchor of a mesh, in its unit; planes: with bounds of images on the planes of the triangles.

    With no other shift than the mesh's own, rays that start on one of its faces do so on the device too.
    """
    t = types()
    layout = atlas_layout(camera.atlas)
    fixed = layout.on_device
    pose, scale = np.asarray(camera.camera_from_world, np.float64), device.scale
    anchor = pose[:3, :3] @ device.anchor + pose[:3, 3]
    frame = np.eye(4)
    frame[:3, 3] = -anchor
    table = node_rays(camera, frame, scale)
    rows = t.Float(aligned(table.transpose(2, 0, 1)))
    bent: dict[str, Any] = {}
    if camera.directions is None:
        bent["eye"] = opaque_numbers(list((np.asarray(camera.eye, np.float64) - anchor) / scale))
        if camera.index is not None:
            bent["index"] = opaque_numbers([float(camera.index)])[0]
    used = {name: fixed[name] for name in ("face", "x", "y")} | {"side": _sides(camera.atlas)}
    rays = _frozen_rays(camera.kind, camera.nodes)(
        fixed["threads"][0], used, rows, bent, rows_for("general", "Rays", layout, 0)
    )
    blocks = bounded("general", rays, layout)
    if planes:
        blocks = replace(blocks, planes=_planes(camera, anchor, scale, layout, blocks.cones))
    rows = functools.cache(lambda: _in_rows(blocks, fixed["slots"], scale))
    return DeviceRays(layout, "general", anchor, blocks, rows)


def node_rays(camera: CameraTriangles, frame: np.ndarray, scale: float) -> np.ndarray:
    """Positions and rays (or normals) of one vertex after the other of all camera triangles: (6, 3, F), or (12, 3, F).

    frame: 4x4, rigid, from the camera's frame to the one wanted. scale: the unit there, scene units.
    """
    rows = []
    for place, along in (camera.node(i) for i in range(camera.nodes)):
        rows += [(frame[:3, :3] @ np.asarray(place) + frame[:3, 3:]) / scale, frame[:3, :3] @ np.asarray(along)]
    return np.stack(rows)


def _in_rows(blocks: Any, slots: Any, scale: float) -> Ray:
    """Rays of all pixels, row by row, origins in scene units."""
    import drjit as dr

    t = types()
    valid = slots >= 0
    origin, direction = blocks.rays.origin_and_direction(t, t.UInt(dr.maximum(slots, 0)))
    valid = valid & (dr.squared_norm(direction) > 0)
    ray = Ray(origin * opaque_numbers([scale])[0], dr.select(valid, direction, t.Array3f(0, 0, 1)), valid)
    dr.eval(*ray)
    return ray


@functools.lru_cache(maxsize=16)
def _sides(atlas: Any) -> Any:
    """Pixels along the short sides of each camera triangle, on the device."""
    import drjit as dr

    sides = types().UInt(aligned(atlas.sides, np.uint32))
    dr.make_opaque(sides)
    return sides


def _planes(camera: CameraTriangles, anchor: np.ndarray, scale: float, layout: BlockLayout, cones: Any) -> Any:
    """What bounds images on the camera triangles' planes, in the frame of the rays. cones: of the blocks' rays."""
    import drjit as dr

    from mpcam.cameras.generators import plane_bounds
    from mpcam_kernels.planes import Planes
    from mpcam_kernels.ray_cones import Cones
    from mpcam_kernels.rows import room
    from mpcam_kernels.threads import threads

    t, found = types(), plane_bounds(camera)
    # Frame of the rays to camera frame, then to the plane; heights in the unit.
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = scale * np.eye(3), anchor
    maps = found.maps @ frame
    maps[:, 2] /= scale

    def flat(values: np.ndarray) -> Any:
        return t.Float(aligned(values))

    slopes = [flat(found.slopes[:, k] * scale) for k in range(found.slopes.shape[1])]
    counts = np.bincount(layout.face, minlength=camera.count)
    first, count = (t.UInt(aligned(values, np.uint32)) for values in (np.cumsum(counts) - counts, counts))
    around = room(t, Cones.ROWS, camera.count)
    around.store(cones.joined(t, first, count), threads(t, 0, camera.count))
    planes = Planes(
        [flat(maps[:, i]) for i in range(3)],
        slopes,
        flat(found.state),
        flat(found.lines),
        _sides(camera.atlas),
        first,
        count,
        int(counts.max()),
        Cones(around),
    )
    dr.eval(planes)
    return planes


@functools.lru_cache(maxsize=16)
def _frozen_rays(kind: str, nodes: int) -> Any:
    """Kernel of one kind of camera triangle, with so many vertices: rays by slot."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.general_rays import Rays, packed
    from mpcam_kernels.rows import Rows
    from mpcam_kernels.samples import PIXELS, of_block

    @frozen
    def rays(slot: Any, fixed: dict[str, Any], rows: Any, bent: dict[str, Any], target: Rows) -> Rays:
        t = types()
        block = slot // PIXELS
        face = dr.gather(t.UInt, fixed["face"], block)
        side = dr.gather(t.UInt, fixed["side"], face)
        column, row = of_block(slot)
        x, y = dr.gather(t.UInt, fixed["x"], block) + column, dr.gather(t.UInt, fixed["y"], block) + row
        last = t.Float(side) - 1
        second, third = t.Float(x) / last, t.Float(y) / last
        table = [dr.gather(t.Array3f, rows, face * (2 * nodes) + k) for k in range(2 * nodes)]
        origin, along = (mixed(table[k::2], second, third) for k in range(2))
        camera = _bender(kind, bent)
        direction, valid = camera.bend(origin, along)
        direction = normalize(direction)
        valid = valid & (x + y < side) & dr.isfinite(direction.x + direction.y + direction.z)
        direction, origin = dr.select(valid, direction, 0), dr.select(valid, origin, 0)
        target.store(packed(t, direction, origin), slot)
        return Rays(target)

    return rays


def _bender(kind: str, bent: dict[str, Any]) -> CameraTriangles:
    """What bends the rays inside of a kernel: a camera with nothing but its eye and index, on the device."""
    camera = object.__new__(CameraTriangles)
    fields = {"directions": kind == "direct" or None, "eye": bent.get("eye"), "index": bent.get("index")}
    for name, value in fields.items():
        object.__setattr__(camera, name, value)
    return camera
