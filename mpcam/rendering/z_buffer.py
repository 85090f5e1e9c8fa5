"""What the rasterizing methods share: place vertices, run the kernels, decode the depth buffer."""

import functools
import importlib
from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.cameras.outline import HIDDEN
from mpcam.cameras.types import PosedRays
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.math.pose import frame_origin
from mpcam.rendering.clock import Clock
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.explanation import Step
from mpcam.rendering.hits import Hits, Stats
from mpcam.rendering.maps import CoverageMap, DepthMap
from mpcam.rendering.moving import Moving
from mpcam.rendering.outlines import HIDDEN_TESTS, OUTLINES, PIECES, hidden_never

MOST_PIXELS = 32767  # along a side: kernels keep two pixel numbers in 32 bits


@functools.lru_cache(maxsize=64)
def _pipeline(
    test: str,
    outline: str,
    output: str,
    cull: str,
    model: type | None,
    static: tuple[Any, ...],
    width: int,
    height: int,
    count: bool,
    backend: str,
) -> Any:
    """The frozen kernels of a test, an output, an image size and, for curved images, a camera model's static fields."""
    from mpcam_kernels.pipeline import Pipeline

    return Pipeline(
        types(),
        OUTLINES[outline],
        HIDDEN_TESTS.get(outline, hidden_never),
        kernel_test(test),
        (width, height),
        output=output,
        cull=cull,
        bounded=outline in ("quad", "triangle"),
        pieces=PIECES.get(outline, 1),
        count=count,
    )


def kernel_test(name: str) -> Any:
    """The kernels' module by name: ray_triangle, pixel_triangle or screen_triangle."""
    return importlib.import_module(f"mpcam_kernels.{name}")


class ZBuffered(Moving):
    """Frames of one camera and mesh by a depth buffer.

    test: "ray_triangle" (rays through one point against triangles in the camera frame), "pixel_triangle" (pixels
    against straight-edged triangles in the image plane, exact for parallel rays) or "screen_triangle" (the same, for
    corners that were projected one by one).
    """

    method: ClassVar[str]
    bound: str = "tight"
    output: str = "hits"
    cull: str = "none"
    view: Callable[[], PosedRays] | None = None
    looks_from_eye: ClassVar[bool] = True

    @exclusive
    def __init__(self, camera: Camera, mesh: Mesh):
        self._prepare_mesh(mesh)
        self.aim(camera)

    @exclusive
    def aim(self, camera: Camera) -> None:
        """Another camera, or another pose of it: the scene stays as it is. Raises InputError as at the beginning."""
        test = self.test_for(camera)
        if max(camera.width, camera.height) > MOST_PIXELS:
            size = f"{camera.width}x{camera.height}"
            raise InputError(f"the camera has {size} pixels: at most {MOST_PIXELS} along a side are possible")
        self.camera, self.test, self.curved = camera, test, test == "ray_triangle"
        self.device_camera = device_camera(camera)
        self.samples = self.device_camera.directions if self.curved else self.device_camera.centers
        if self.looks_from_eye:
            self._look_from(frame_origin(camera.camera_from_world))
        self.pose = self.device.pose(camera.camera_from_world)

    def test_for(self, camera: Camera) -> str:
        """The test that serves a camera; raises InputError where none does."""
        raise TypeError(f"{type(self).__name__} must define test_for")

    def _reframed(self) -> None:
        self.pose = self.device.pose(self.camera.camera_from_world)

    def place(self, vertices: Any) -> list[Any]:
        """Device vertices to what the kernels take, a list of arrays with four numbers per vertex.

        The first array starts with the position: camera frame in units of the mesh's scale, or (pixel, depth).
        """
        raise TypeError(f"{type(self).__name__} must define place")

    def parent(self, triangle: Any) -> Any:
        """Face of the mesh that a kernel's triangle belongs to."""
        return triangle

    def parent_weights(self, triangle: Any, second: Any, third: Any) -> tuple[Any, Any]:
        """Barycentric weights within that face."""
        return second, third

    def buffer(self, clock: Clock | None = None) -> tuple[Any, Any]:
        """Placed vertices and the depth buffer over them."""
        done = clock.done if clock else None
        positions = self.place(self.vertices) if self.mesh.triangle_count else [self.vertices]
        if done:
            done("vertices", positions)
        return positions, self.run(positions, done)[0]

    @exclusive
    def count(self, positions: Any) -> np.ndarray:
        """Tests and covered samples of a frame over placed vertices."""
        return self.run(positions, count=True)[1].numpy()

    @property
    def pixels(self) -> Any:
        """Numbers of the pixels, row by row."""
        from mpcam_kernels.threads import threads

        return threads(types(), 0, self.camera.width * self.camera.height)

    @property
    def triangle_count(self) -> int:
        """Triangles that the kernels see: those of the mesh, or their parts."""
        import drjit as dr

        return dr.width(self.faces) // 3

    def run(
        self, positions: list[Any], done: Callable[[str, Any], None] | None = None, count: bool = False
    ) -> tuple[Any, Any]:
        """Keys of all places over placed vertices, and counters or None; done(stage, arrays) is told of each stage."""
        from mpcam_kernels.backend import backend_name

        camera, model, static = None, None, ()
        if self.curved:
            camera, model = self.device_camera.on_device, type(self.camera)
            static = tuple(getattr(self.camera, name) for name in self.camera.static_fields)
        size = (self.camera.width, self.camera.height)
        outline = self.bound if self.curved else "straight"
        kernels = _pipeline(self.test, outline, self.output, self.cull, model, static, *size, count, backend_name())
        return kernels.frame(camera, positions, self.faces, self.samples, done)

    @exclusive
    def frame(self) -> Any:
        """One frame, evaluated: Hits, DepthMap or CoverageMap."""
        return self._decoded(*self.buffer())

    @exclusive
    def stages(self) -> dict[str, float]:
        """Seconds of one frame by stage."""
        clock = Clock()
        self._decoded(*self.buffer(clock))
        clock.done("decode")
        return clock.seconds

    @exclusive
    def explain(self) -> tuple[Step, ...]:
        """Which stages a frame takes, which are left out, and why; takes one frame to find out."""
        return tuple(self._steps())

    def _steps(self) -> Iterator[Step]:
        seen: dict[str, Any] = {}
        positions = self.place(self.vertices) if self.mesh.triangle_count else []
        if not positions:
            yield Step("rasterization", False, "the mesh has no triangles")
            return
        self.run(positions, seen.__setitem__)
        vertices, triangles = len(positions[0].numpy()) // 4, self.triangle_count
        yield Step("vertices", True, f"{vertices:,} brought to the camera")
        outlined = self.curved and len(positions) > 1
        lens = f"{vertices:,}: what each knows of the projection, so that triangles need no profile"
        why = lens if outlined else f"the bound {self.bound!r} is worked out triangle by triangle"
        yield Step("projection around vertices", outlined, why if self.curved else "edges are straight in the image")
        hidden = self._hidden(positions) if outlined else 0
        culled = "" if self.cull == "none" else f", and those that show their {self.cull}"
        yield Step(
            "triangles", True, f"{triangles - hidden:,} bounded; left out: {hidden:,} that no pixel can see{culled}"
        )
        large = int(seen["triangles"][1].count[0])
        few = f"{large:,} of more pixels than a lane walks by itself"
        yield Step(
            "lists of blocks", "lists" in seen, few if large else "no triangle covers more than a lane walks by itself"
        )
        yield Step("pixels through lists", "pixels" in seen, "nearest of each list" if large else "there are no lists")
        wanted = {"hits": "triangle and depth", "depth": "depth alone", "coverage": "coverage alone"}[self.output]
        yield Step("decode", True, f"{wanted} of each pixel")
        yield Step(
            "root finding", False, "a pixel's ray is known in closed form or kept per camera, and is met by a plane"
        )
        yield Step("tree over the triangles", False, "only method='raytrace' needs one")

    def _hidden(self, positions: list[Any]) -> int:
        """Triangles whose corners all lie in the convex region that no pixel sees."""
        place = np.asarray(positions[0].numpy()).reshape(-1, 4)[:, 3]
        return int((place[self.mesh.faces] >= HIDDEN).all(axis=1).sum())

    def _decoded(self, positions: list[Any], keys: Any) -> Any:
        unit = self.unit if self.curved else opaque_one()
        found = _frozen_decode(self.output, self.camera.width)(self.pixels, keys, unit)
        if self.output == "depth":
            return DepthMap(self.camera, found[0])
        if self.output == "coverage":
            return CoverageMap(self.camera, found[0], self.device_camera.ray.valid)
        return self._hits(positions, *found)

    def _hits(self, positions: list[Any], small: Any, depth: Any) -> Hits:
        width, faces, samples = self.camera.width, self.faces, self.samples.pixels
        triangle, nothing = self.parent(small), self.triangle_count == 0

        def weights() -> tuple[Any, Any]:
            if nothing:
                return depth * 0.0, depth * 0.0
            found = _frozen_weights(self.test, width)(self.pixels, small, positions[0], faces, samples)
            return self.parent_weights(small, *found)

        def stats() -> Stats:
            if nothing:
                return Stats(0, 0)
            tests, rendered = self.count(positions)
            return Stats(int(tests), int(rendered))

        return Hits(self.camera, self.mesh, self.method, triangle, depth, weights, stats, self.view)


@functools.cache
def opaque_one() -> Any:
    """The number one on the device."""
    return opaque_numbers([1.0])[0]


@functools.cache
def _frozen_decode(output: str, width: int) -> Any:
    """Kernel from keys to what a frame holds, pixels row by row."""
    from mpcam_kernels import decode
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.outputs import OUTPUTS as KINDS

    kind = KINDS[output]

    @frozen
    def decoded(pixel: Any, keys: Any, unit: Any) -> tuple[Any, ...]:
        t = types()
        found = decode.in_rows(kind.kind(t), keys, pixel, width)
        return decode.frame(t, kind, found, unit)

    return decoded


@functools.cache
def _frozen_weights(test: str, width: int) -> Any:
    from mpcam_kernels import decode
    from mpcam_kernels.frozen import frozen

    @frozen
    def weights(pixel: Any, triangle: Any, positions: Any, faces: Any, samples: Any) -> tuple[Any, Any]:
        views = decode.in_rows(type(samples), samples, pixel, width)
        return decode.weights(types(), kernel_test(test), positions, faces, triangle, views, types().Array4f)

    return weights
