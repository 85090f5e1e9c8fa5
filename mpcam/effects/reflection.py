"""Pictures of scenes with a curved mirror or lens face, near objects in it, by camera triangles (Hou et al. 2006).

The same picture by other means, to compare with: an environment map, and rays traced from the true surface.
"""

import functools
from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.decompose import decompose
from mpcam.decomposition.reflector import reflector_of
from mpcam.decomposition.resolve import Resolver
from mpcam.effects.environment import DeviceEnvironment
from mpcam.effects.lookup import back_to_back, check_size
from mpcam.effects.mirror_rays import MirrorRays, mirror_rays
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.mirror import Mirror
from mpcam.geometry.scene import Scene
from mpcam.rendering.device import opaque_numbers, opaque_zero, types
from mpcam.rendering.exclusive import exclusive
from mpcam.rendering.explain import Explanation, Step
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import check_shading, check_shadows, shade_device

METHODS = ("camera_triangles", "environment", "raytrace")


class Part(Protocol):
    """What is seen in the mirror, by one method."""

    def update(self, vertices: np.ndarray) -> None:
        """New positions (V, 3) of the scene's vertices."""
        ...

    def colours(self) -> list[Any]:
        """Three Floats, one number for each pixel of the eye's camera, evaluated; anything beside the mirror."""
        ...


class Reflection:
    """Frames of a scene with a mirror; everything that does not change with the scene's vertices is made here.

    scene: its meshes are seen in the mirror and beside it. mirror: default the scene's. camera: with a common centre;
    default the scene's. method: "camera_triangles"; "environment", an environment map from the mirror's middle, two
    views of `size` pixels; "raytrace", rays from the true surface (Mitsuba), the truth. shading: as for `render`; rays
    that miss the scene see its environment, or its background. triangles, resolution: in place of the mirror's. cams:
    camera triangles to take instead of decomposing the mirror. shadows: shadow maps of the scene's lights (see
    `shadow_map`), in which the mirror itself throws none. Raises InputError for a scene without mirror or camera,
    an eye that does not see it, and other values.
    """

    @exclusive
    def __init__(
        self,
        scene: Scene,
        camera: Camera | None = None,
        mirror: Mirror | None = None,
        *,
        method: str = "camera_triangles",
        shading: str = "light",
        triangles: int | None = None,
        resolution: int | None = None,
        size: int = 512,
        cams: CameraTriangles | None = None,
        shadows: Sequence[Any] = (),
    ):
        self.scene, self.method, self.shading, self.shadows = scene, method, shading, shadows
        given = camera if camera is not None else scene.camera
        found = mirror if mirror is not None else scene.mirror
        if found is None:
            raise InputError(f"scene {scene.name!r} has no mirror: give it one, mpcam.Mirror(surface), or pass mirror=")
        if not isinstance(found, Mirror):
            raise InputError(f"mirror is a {type(found).__name__}: give mpcam.Mirror(surface)")
        if not isinstance(given, Camera) or not given.central:
            raise InputError("a camera with a common centre is needed to look into a mirror: give one as camera=")
        check_shading(shading)
        check_shadows(shadows, scene, shading)
        self.camera, self.mirror = given, found
        settings = {"triangles": triangles, "resolution": resolution, "cams": cams}
        idle = [name for name, value in settings.items() if value is not None]
        if method not in METHODS:
            raise InputError(f"method={method!r}: allowed are {', '.join(METHODS)}")
        if method != "camera_triangles" and idle:
            raise InputError(f"{idle[0]}= goes with method='camera_triangles', not with {method!r}")
        self.direct = prepare(given, scene.mesh)
        self.part: Part
        if method == "camera_triangles":
            self.part = _ByTriangles(self, triangles or found.triangles, resolution or found.resolution, cams)
        elif method == "environment":
            self.part = _ByEnvironment(self, check_size(size))
        else:
            self.part = _ByTracing(self)
        self._color = opaque_numbers(list(found.color))

    @exclusive
    def update(self, vertices: np.ndarray) -> None:
        """New positions (V, 3) of the scene's vertices, meshes in order; nothing but their upload is needed."""
        self.direct.update(vertices)
        self.part.update(vertices)

    @exclusive
    def frame(self) -> Any:
        """One frame on the device: an evaluated Array3f, one entry per pixel."""
        hits = self.direct.frame()
        beside = self.shaded(hits)
        return _over(hits.device_depth, beside, self.distance, self.part.colours(), self._color)

    def shaded(self, hits: Hits) -> Any:
        """Colours of hits on the scene, on the device."""
        return shade_device(hits, self.scene, self.shading, self.shadows)

    @exclusive
    def image(self) -> np.ndarray:
        """One frame: (H, W, 3) float32, linear RGB."""
        shape = (self.camera.height, self.camera.width, 3)
        return np.stack([np.asarray(part.numpy()) for part in self.frame()], -1).reshape(shape)

    @property
    def cams(self) -> CameraTriangles | None:
        """The camera triangles that stand for the mirror; None for other methods."""
        return self.part.cams if isinstance(self.part, _ByTriangles) else None

    @property
    def hits(self) -> Hits:
        """First hits of the camera triangles' rays. Raises InputError for other methods."""
        if not isinstance(self.part, _ByTriangles):
            raise InputError(f"method={self.method!r} has no camera triangles that hit anything")
        return self.part.prepared.frame()

    @property
    def explanation(self) -> Explanation:
        """Which stages a frame takes, which are left out, and why."""
        triangles, tracing = isinstance(self.part, _ByTriangles), self.method == "raytrace"
        many = f"{self.cams.count} that the camera sees" if self.cams else ""
        bent = "its pixels bend the camera's rays by interpolated normals" if triangles else ""
        other = f"method {self.method!r}"
        lost = self.scene.environment is not None
        return Explanation(
            (
                Step("direct view", True, f"{self.scene.mesh.triangle_count:,} scene triangles beside the mirror"),
                Step("camera triangles", triangles, f"{many}; {bent}" if triangles else other),
                Step(
                    "candidates",
                    triangles,
                    "groups and blocks of rays against clusters of triangles" if triangles else other,
                ),
                Step("root finding", False, "rays of pixels are known; only project() needs the cubic"),
                Step(
                    "atlas to picture",
                    triangles,
                    "texels by the true surface's points, found once" if triangles else other,
                ),
                Step(
                    "environment map",
                    self.method == "environment",
                    "two views from the mirror's middle" if self.method == "environment" else other,
                ),
                Step("rays of the true surface", tracing, "traced anew in each frame" if tracing else other),
                Step("rays that miss", lost, "see the scene's environment" if lost else "see the background"),
            )
        )

    @functools.cached_property
    def rays(self) -> MirrorRays:
        """The rays that the true surface sends on."""
        return mirror_rays(self.camera, self.mirror)

    @functools.cached_property
    @exclusive
    def distance(self) -> Any:
        """Float on the device: how far the mirror is along each pixel's ray, infinite beside it."""
        return types().Float(self.rays.distance.astype(np.float32)) + opaque_zero()

    @property
    def mask(self) -> np.ndarray:
        """(H, W) bool: pixels that see the mirror, unless something stands before it."""
        return np.isfinite(self.rays.distance).reshape(self.camera.height, self.camera.width)


class _ByTriangles:
    """The scene through camera triangles, brought to the eye's pixels."""

    def __init__(self, whole: Reflection, triangles: int, resolution: int, cams: CameraTriangles | None):
        mirror = whole.mirror
        if cams is None:
            cams = decompose(mirror.surface, whole.camera, triangles, resolution=resolution, index=mirror.index)
        self.cams, self.whole = cams, whole
        self.resolver = Resolver(cams, mirror.surface, whole.camera)
        self.prepared = prepare(cams, whole.scene.mesh)
        self._nothing = opaque_numbers([0.0, 0.0, 0.0])

    def update(self, vertices: np.ndarray) -> None:
        self.prepared.update(vertices)

    def colours(self) -> list[Any]:
        import drjit as dr

        atlas = self.whole.shaded(self.prepared.frame())
        return self.resolver.on_device(dr.ravel(atlas), self._nothing)


class _ByEnvironment:
    """Two views of the surroundings from the mirror's middle, looked up along the true rays."""

    def __init__(self, whole: Reflection, size: int):
        self.whole, self.size = whole, size
        middle = reflector_of(whole.mirror.surface).center
        self.views = [prepare(camera, whole.scene.mesh) for camera in back_to_back(middle, size)]
        directions = np.ascontiguousarray(np.asarray(whole.rays.ray.direction).T, np.float32)
        self.directions = types().Array3f(directions) + opaque_zero()

    def update(self, vertices: np.ndarray) -> None:
        for view in self.views:
            view.update(vertices)

    def colours(self) -> list[Any]:
        import drjit as dr

        parts: list[Any] = [dr.ravel(self.whole.shaded(view.frame())) for view in self.views]
        texels = dr.concat(parts)
        return list(_look_up()(DeviceEnvironment(texels, self.size), self.directions))


@functools.cache
def _look_up() -> Any:
    from mpcam_kernels.frozen import frozen

    @frozen
    def looked_up(environment: DeviceEnvironment, directions: Any) -> Any:
        return environment.lookup(directions)

    return looked_up


class _ByTracing:
    """The scene along the rays of the true surface."""

    def __init__(self, whole: Reflection):
        from mpcam.truth.raytrace import RayTraced

        self.whole = whole
        self.prepared = RayTraced(whole.camera, whole.scene.mesh, whole.rays.ray)

    def update(self, vertices: np.ndarray) -> None:
        self.prepared.update(vertices)

    def colours(self) -> list[Any]:
        return list(self.whole.shaded(self.prepared.frame()))


def _over(depth: Any, beside: Any, distance: Any, colours: list[Any], color: list[Any]) -> Any:
    """The mirror's colours where it is nearer than the rest."""
    return _over_kernel()(depth, beside, distance, colours, color)


@functools.cache
def _over_kernel() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def over(depth: Any, beside: Any, distance: Any, colours: list[Any], color: list[Any]) -> Any:
        t = types()
        seen = t.Array3f(*(part * tint for part, tint in zip(colours, color, strict=True)))
        return dr.select(distance < depth, seen, t.Array3f(beside))

    return over


def reflection(scene: Scene, camera: Camera | None = None, mirror: Mirror | None = None, **settings: Any) -> np.ndarray:
    """A picture of a scene with a mirror or an interface: (H, W, 3) float32, linear RGB.

    settings: see `Reflection`, which is to be kept for many frames. Raises InputError as it does.
    """
    if isinstance(scene, (Mesh, list, tuple)):
        scene = Scene.of(scene)
    return Reflection(scene, camera, mirror, **settings).image()
