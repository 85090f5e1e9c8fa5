"""Exact rasterization where rays have no common centre: bundles of them against clusters, then pixel by pixel."""

import copy
import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.order import nearby
from mpcam.rendering.clock import Clock
from mpcam.rendering.device import device_mesh
from mpcam.rendering.device_rays import DeviceRays
from mpcam.rendering.explanation import Step, timed_steps
from mpcam.rendering.hits import Hits, Stats
from mpcam.rendering.layout import layout
from mpcam.rendering.maps import CoverageMap, DepthMap

BOUNDS = ("tight", "triangle", "nine_point")
CULLING = ("objects", "triangles")
MOST_PAIRS = 1 << 32
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
        tight = self.bound == "tight"
        bundles = len(layout(camera.atlas).first) if tight else camera.count
        if "objects" not in self.culling and bundles * self.mesh.triangle_count >= MOST_PAIRS:
            raise InputError(
                f"culling={self.culling!r} would look at {bundles:,} bundles of rays x {self.mesh.triangle_count:,} "
                f"triangles: at most {MOST_PAIRS:,} pairs are possible, so keep 'objects', or give fewer triangles"
            )
        self.camera, self.rays = camera, DeviceRays(camera, self.device, not tight)

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

    def explain(self) -> tuple[Step, ...]:
        """The stages of a frame; takes one frame to find out."""
        return tuple(timed_steps(self.stages(), self.method))

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
