"""Exact rasterization of any rays: blocks of pixels and groups of them against clusters of triangles, then pixels."""

import copy
import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mpcam.backend import exclusive, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.clock import Clock
from mpcam.rendering.device_camera import around, looks_from
from mpcam.rendering.device_rays import device_rays
from mpcam.rendering.explanation import Step, timed_steps
from mpcam.rendering.hits import Hits, Stats
from mpcam.rendering.maps import CoverageMap, DepthMap
from mpcam.rendering.moving import Moving
from mpcam.rendering.ray_blocks import DeviceRays
from mpcam.rendering.registry import CULLING, CULLS, RAY_BOUNDS

MOST_PAIRS = 1 << 32


class GeneralRasterizer(Moving):
    """Frames of a mesh through any camera that gives rays.

    bound: "tight" takes what the pixels' own rays exclude, block by block. For camera triangles also "triangle", the
    bounding triangle of Hou et al. 2006 (section 2.1), and "nine_point", the box of the same projected corners: every
    pixel inside is tested. output: "hits", "depth" or "coverage". cull: "none", or "back" or "front": the side of
    triangles that is not shown; corners run counter-clockwise seen from the front. culling: what is left out early
    (section 2.4): "objects" by clusters of triangles, "triangles" each by itself.
    """

    method = "invert"

    @exclusive
    def __init__(
        self,
        camera: Camera,
        mesh: Mesh,
        bound: str = "tight",
        output: str = "hits",
        cull: str = "none",
        culling: Sequence[str] = CULLING,
    ):
        if cull not in CULLS:
            raise InputError(f"cull={cull!r}: allowed are {', '.join(CULLS)}")
        if bound not in RAY_BOUNDS:
            raise InputError(f"bound={bound!r}: allowed are {', '.join(RAY_BOUNDS)}")
        if isinstance(culling, str) or not set(culling) <= set(CULLING):
            raise InputError(f"culling={culling!r}: give some or none of {', '.join(CULLING)}, as a tuple")
        self.output, self.bound, self.cull = output, bound, cull
        self.culling = tuple(name for name in CULLING if name in culling)
        self._prepare_mesh(mesh)
        self.order = self.device.ordered(mesh)
        self.aim(camera)

    @exclusive
    def aim(self, camera: Camera) -> None:
        """Another camera, or another pose of it: the scene stays as it is."""
        if self.bound != "tight" and not isinstance(camera, CameraTriangles):
            raise InputError(
                f"bound={self.bound!r} is for camera triangles, not for a {type(camera).__name__}: use bound='tight'"
            )
        if self.bound != "tight" and isinstance(camera, CameraTriangles) and camera.degree > 1:
            raise InputError(f"bound={self.bound!r} is for camera triangles of degree 1: use bound='tight'")
        if not isinstance(camera, CameraTriangles):
            self._look_from(looks_from(camera))
        self.camera, self.rays = camera, device_rays(camera, self.device, self.bound != "tight")
        self.pose = self.device.pose(around(camera, self.rays.anchor))
        from mpcam_kernels.candidates import levels

        cones = self._cones.items
        if "objects" not in self.culling and cones * self.mesh.triangle_count >= MOST_PAIRS:
            raise InputError(
                f"culling={self.culling!r} would look at {cones:,} cones of rays x {self.mesh.triangle_count:,} "
                f"triangles: at most {MOST_PAIRS:,} pairs are possible, so keep 'objects', or give fewer triangles"
            )
        self.counts = levels(self.mesh.triangle_count, cones)

    @property
    def _cones(self) -> Any:
        """What the hierarchy begins with."""
        return self.rays.blocks.group_cones if self.bound == "tight" else self.rays.blocks.planes.cones

    def _reframed(self) -> None:
        self.aim(self.camera)

    def run(self, done: Callable[[str, Any], None] | None = None, count: bool = False) -> tuple[Any, Any]:
        """Keys of all slots, and counters or None; done(stage, arrays) is told of each stage."""
        from mpcam_kernels.backend import backend_name
        from mpcam_kernels.block_pipeline import Task

        rays, (names, faces) = self.rays, self.order
        settings = (self.bound, rays.kind, self.output, self.cull, self.culling)
        kernels = _pipeline(*settings, rays.layout.blocks, count, backend_name())
        return kernels.frame(Task(self.vertices, faces, names, self.counts, self.pose, rays.blocks), done)

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

    def explain(self) -> tuple[Step, ...]:
        """The stages of a frame; takes one frame to find out."""
        return tuple(timed_steps(self.stages(), self.method))

    def _decoded(self, keys: Any) -> Any:
        slots = self.rays.slots(keys)
        pieces = self.rays.blocks.rays if self.rays.bent else None
        found = _frozen_decode(self.output)(slots, keys, self.unit, pieces)
        if self.output == "depth":
            return DepthMap(self.camera, found[0])
        if self.output == "coverage":
            return CoverageMap(self.camera, found[0], self.rays.rows().valid)
        triangle, depth = found
        camera, vertices, rays, pose = self.camera, self.vertices, self.rays, self.pose

        def weights() -> tuple[Any, Any]:
            if self.mesh.triangle_count == 0:
                return depth * 0.0, depth * 0.0
            return _frozen_weights(rays.kind)(slots, triangle, vertices, self.faces, rays.blocks.rays, pose)

        def stats() -> Stats:
            if self.mesh.triangle_count == 0:
                return Stats(0, 0)
            tests, rendered = self._count(vertices, rays, pose)
            return Stats(int(tests), int(rendered))

        view = None if rays.bent else lambda: rays.posed(camera)
        return Hits(camera, self.mesh, self.method, triangle, depth, weights, stats, view)

    @exclusive
    def _count(self, vertices: Any, rays: DeviceRays, pose: Any) -> np.ndarray:
        """Tests and covered pixels of a frame over vertices and rays that may have been replaced since."""
        other = copy.copy(self)
        other.vertices, other.rays, other.pose = vertices, rays, pose
        return other.run(count=True)[1].numpy()


@functools.lru_cache(maxsize=32)
def _pipeline(
    bound: str,
    kind: str,
    output: str,
    cull: str,
    culling: tuple[str, ...],
    blocks: int,
    count: bool,
    backend: str,
) -> Any:
    """The frozen kernels for cameras of so many blocks: some arrays that they make have that length."""
    from mpcam_kernels.block_pipeline import BlockPipeline
    from mpcam_kernels.plane_pipeline import PlanePipeline

    settings: dict[str, Any] = {"output": output, "cull": cull, "count": count, "culling": culling}
    if bound == "tight":
        return BlockPipeline(types(), blocks, kind, **settings)
    return PlanePipeline(types(), blocks, bound, **settings)


@functools.cache
def _frozen_decode(output: str) -> Any:
    """Kernel from keys to what a frame holds, pixels row by row; depths count from the starts of pieces, if any."""
    import drjit as dr

    from mpcam_kernels import decode
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.outputs import OUTPUTS as KINDS

    kind = KINDS[output]

    @frozen
    def decoded(slots: Any, keys: Any, unit: Any, pieces: Any) -> tuple[Any, ...]:
        t = types()
        slot, exists = t.UInt(dr.maximum(slots, 0)), slots >= 0
        found = dr.gather(kind.kind(t), keys, slot, exists)
        start = None if pieces is None else pieces.start(t, slot, exists)
        return decode.frame(t, kind, found, unit, start)

    return decoded


@functools.cache
def _frozen_weights(kind: str) -> Any:
    import drjit as dr

    from mpcam_kernels import decode
    from mpcam_kernels.block_pipeline import RAYS
    from mpcam_kernels.frozen import frozen

    test = RAYS[kind].test

    @frozen
    def weights(slots: Any, triangle: Any, vertices: Any, faces: Any, rays: Any, pose: Any) -> tuple[Any, Any]:
        t = types()
        views = rays.at(t, t.UInt(dr.maximum(slots, 0)), slots >= 0)
        return decode.weights(t, test, vertices, faces, triangle, views, t.Array3f, pose)

    return weights
