"""Exact rasterization where rays have no common centre: bundles of them against clusters, then pixel by pixel."""

import copy
import functools
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.pose import frame_origin
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.order import nearby
from mpcam.math import normalize
from mpcam.rendering.clock import Clock
from mpcam.rendering.device import DeviceMesh, device_mesh, opaque_numbers, types
from mpcam.rendering.exclusive import exclusive
from mpcam.rendering.hits import Hits, Stats, View
from mpcam.rendering.layout import Layout, layout
from mpcam.rendering.maps import CoverageMap, DepthMap

BOUNDS = ("tight", "triangle", "nine_point")
CULLING = ("objects", "triangles")
FEW = 256  # balls that are held against every group of blocks: more of them get clusters


class Bundled:
    """Frames of camera triangles over a mesh.

    bound: "tight" takes what the pixels' own rays exclude, block by block; "triangle" is the bounding triangle of Hou
    et al. 2006 (section 2.1), "nine_point" the box of the same projected corners: every pixel inside is tested. output:
    "hits", "depth" or "coverage". culling: what is left out early (section 2.4): "objects" by clusters of triangles,
    "triangles" each by itself.
    """

    method = "invert"

    @exclusive
    def __init__(
        self,
        camera: CameraTriangles,
        mesh: Mesh,
        bound: str = "tight",
        output: str = "hits",
        cull: str = "none",
        culling: Sequence[str] = CULLING,
    ):
        if cull != "none":
            raise InputError(f"cull={cull!r}: camera triangles show both sides of faces, use cull='none'")
        if bound not in BOUNDS:
            raise InputError(f"bound={bound!r}: allowed for camera triangles are {', '.join(BOUNDS)}")
        if isinstance(culling, str) or not set(culling) <= set(CULLING):
            raise InputError(f"culling={culling!r}: give some or none of {', '.join(CULLING)}, as a tuple")
        self.mesh, self.output, self.bound = mesh, output, bound
        self.culling = tuple(name for name in CULLING if name in culling)
        self.device = device_mesh(mesh)
        self.vertices, self.faces = self.device.vertices, self.device.faces
        self.tree = _tree(mesh)
        self.unit = opaque_numbers([self.device.scale])[0]
        self.aim(camera)

    @exclusive
    def aim(self, camera: CameraTriangles) -> None:
        """Another camera, for frames in which the eye or the mirror moves."""
        self.camera = camera
        self.rays = DeviceRays(camera, self.device, self.bound != "tight")

    @exclusive
    def update(self, vertices: np.ndarray) -> None:
        """New positions (V, 3) of the vertices, for a moving scene; nothing but their upload is needed."""
        self.vertices = self.device.place(np.asarray(vertices))

    def run(self, done: Callable[[str, Any], None] | None = None, count: bool = False) -> tuple[Any, Any]:
        """Keys of all places, and counters or None; done(stage, arrays) is told of each stage."""
        from mpcam_kernels.backend import backend_name
        from mpcam_kernels.candidates import Task

        rays, (names, faces, counts) = self.rays, self.tree
        kernels = _pipeline(self.bound, self.output, self.culling, rays.layout.blocks, count, backend_name())
        task = Task(self.vertices, faces, names, counts, rays.bundle, rays.fan)
        return kernels.frame(task, done)

    @exclusive
    def frame(self) -> Any:
        """One frame, evaluated: Hits, DepthMap or CoverageMap."""
        return self._decoded(self.run()[0])

    @exclusive
    def stages(self) -> dict[str, float]:
        """Seconds of one frame by stage."""
        clock = Clock()
        keys, _ = self.run(clock.done)
        self._decoded(keys)
        clock.done("decode")
        return clock.seconds

    def _decoded(self, keys: Any) -> Any:
        place = self.rays.place
        found = _frozen_decode(self.output)(place, keys, self.unit)
        if self.output == "depth":
            return DepthMap(self.camera, found[0])
        if self.output == "coverage":
            return CoverageMap(self.camera, found[0], place >= 0)
        triangle, depth = found
        vertices, rays = self.vertices, self.rays

        def weights() -> tuple[Any, Any]:
            if self.mesh.triangle_count == 0:
                return depth * 0.0, depth * 0.0
            return _frozen_weights()(place, triangle, vertices, self.faces, rays.bundle.pixels)

        def stats() -> Stats:
            if self.mesh.triangle_count == 0:
                return Stats(0, 0)
            tests, rendered = self._count(vertices, rays)
            return Stats(int(tests), int(rendered))

        return Hits(self.camera, self.mesh, self.method, triangle, depth, weights, stats, lambda: rays.view)

    @exclusive
    def _count(self, vertices: Any, rays: "DeviceRays") -> np.ndarray:
        """Tests and covered pixels of a frame over vertices and rays that may have been replaced since."""
        other = copy.copy(self)
        other.vertices, other.rays = vertices, rays
        return other.run(count=True)[1].numpy()


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
    def view(self) -> View:
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


def _tree(mesh: Mesh) -> tuple[Any, Any, tuple[int, ...]]:
    """Numbers and corners of the triangles, neighbours together, and the sizes of the levels of clusters above."""
    with np.errstate(invalid="ignore", over="ignore"):
        order = nearby(mesh.corners.mean(axis=1)) if mesh.triangle_count else np.zeros(0, np.int64)
    faces = np.ascontiguousarray(mesh.faces[order].ravel(), np.uint32)
    return types().UInt(order.astype(np.uint32)), types().UInt(faces), levels(mesh.triangle_count)


def levels(count: int) -> tuple[int, ...]:
    """How many balls there are, and how many clusters of them level by level."""
    from mpcam_kernels.hierarchy import FAN

    counts = [count]
    while counts[-1] > FEW and len(counts) < 5:
        counts.append(-(-counts[-1] // FAN))
    return tuple(counts)


@functools.lru_cache(maxsize=32)
def _pipeline(bound: str, output: str, culling: tuple[str, ...], blocks: int, count: bool, backend: str) -> Any:
    """The frozen kernels for cameras of so many blocks: some arrays that they make have that length."""
    from mpcam_kernels.bundle_pipeline import BundlePipeline, PlanePipeline

    settings: dict[str, Any] = {"output": output, "count": count, "culling": culling}
    if bound == "tight":
        return BundlePipeline(types(), blocks, **settings)
    return PlanePipeline(types(), blocks, bound, **settings)


@functools.cache
def _frozen_decode(output: str) -> Any:
    """Kernel from keys to what a frame holds, pixels row by row."""
    import drjit as dr

    from mpcam_kernels import decode
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.outputs import OUTPUTS as KINDS

    kind = KINDS[output]

    @frozen
    def decoded(place: Any, keys: Any, unit: Any) -> tuple[Any, ...]:
        t = types()
        found = dr.gather(kind.kind(t), keys, t.UInt(dr.maximum(place, 0)), place >= 0)
        return decode.frame(t, kind, found, unit)

    return decoded


@functools.cache
def _frozen_weights() -> Any:
    import drjit as dr

    from mpcam_kernels import decode, skew
    from mpcam_kernels.frozen import frozen

    @frozen
    def weights(place: Any, triangle: Any, vertices: Any, faces: Any, pixels: Any) -> tuple[Any, Any]:
        t = types()
        views = pixels.at(t, t.UInt(dr.maximum(place, 0)), place >= 0)
        return decode.weights(t, skew, vertices, faces, triangle, views, t.Array3f)

    return weights
