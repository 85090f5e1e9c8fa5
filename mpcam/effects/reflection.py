"""Pictures of scenes with a curved mirror or lens face, near objects in it, by camera triangles (Hou et al. 2006).

The same picture by other means, to compare with: vertices with straight edges between them, an environment map, and
rays traced from the true surface.
"""

import functools
from collections.abc import Callable, Sequence
from typing import Any, Unpack

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.decompose import decompose
from mpcam.effects.by_depth_image import ByDepthImages
from mpcam.effects.depth_image_choice import DepthImageChoice, choice_of
from mpcam.effects.lookup import check_size
from mpcam.effects.mirror_methods import MIRROR_METHODS, MirrorSettings
from mpcam.effects.mirror_parts import ByEnvironment, ByTracing, ByTriangles, ByVertices, MirrorPart, explained
from mpcam.effects.mirror_rays import MirrorRays, mirror_rays
from mpcam.effects.traced_orders import ByTracedOrders
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.moved import moved
from mpcam.rendering.explanation import Explanation, Step
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import check_shading, check_shadows, shade_device, vertex_normals
from mpcam.scene.mirror import Mirror
from mpcam.scene.scene import Scene


class Reflection:
    """Frames of a scene with a mirror; everything that does not change with the scene's vertices is made here.

    scene: its meshes are seen in the mirror and beside it. mirror: default the scene's. camera: with a common center;
    default the scene's. method: "camera_triangles"; "vertex", the images of the scene's vertices in camera triangles,
    joined by straight edges, each split 2**level times first; "environment", an environment map from the mirror's
    middle, two views of `size` (512) pixels; "depth_image", depth images that the true surface's rays are met with;
    "raytrace", rays from the true surface (Mitsuba), the truth. shading: as for `render`; rays that miss the scene see
    its environment, or its background. shadows: shadow maps of the scene's lights (see `shadow_map`), in which the
    mirror itself throws none.

    settings: of the method, see `TriangleSettings`, `MirrorVertexSettings`, `EnvironmentSettings`,
    `DepthImageSettings`, and `OrderSettings`, which "raytrace" has too.

    Raises InputError for a scene without mirror or camera, an eye that does not see it, and other values.
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
        shadows: Sequence[Any] = (),
        **settings: Unpack[MirrorSettings],
    ):
        self.scene, self.method, self.shading, self.shadows = scene, method, shading, shadows
        given = camera if camera is not None else scene.camera
        found = mirror if mirror is not None else scene.mirror
        if found is None:
            raise InputError(f"scene {scene.name!r} has no mirror: give it one, mpcam.Mirror(surface), or pass mirror=")
        if not isinstance(found, Mirror):
            raise InputError(f"mirror is a {type(found).__name__}: give mpcam.Mirror(surface)")
        if not isinstance(given, Camera) or given.ray_geometry != "central":
            raise InputError("a camera with a common center is needed to look into a mirror: give one as camera=")
        check_shading(shading)
        check_shadows(shadows, scene, shading)
        self.camera, self.mirror = given, found
        if method not in MIRROR_METHODS:
            raise InputError(f"method={method!r}: allowed are {', '.join(MIRROR_METHODS)}")
        self._settings = self._checked(dict(settings))
        self.direct: Any = prepare(given, scene.mesh)
        self.part = self._part()
        self._color = opaque_numbers(list(found.color))

    def _checked(self, settings: dict[str, Any]) -> dict[str, Any]:
        """Those that are not None; raises InputError for those that do not go with the method."""
        names = {one: entry.home(self.camera).names for one, entry in MIRROR_METHODS.items()}
        kept = {name: value for name, value in settings.items() if value is not None or name == "coarse"}
        for name in kept:
            if name not in names[self.method]:
                fitting = " or ".join(repr(one) for one in names if name in names[one])
                if not fitting:
                    allowed = ", ".join(names[self.method]) or "none"
                    raise InputError(f"method={self.method!r} has no setting {name!r}: allowed are {allowed}")
                raise InputError(f"{name}= goes with method={fitting}, not with {self.method!r}")
        return kept

    def _part(self) -> MirrorPart:
        """What the method shows in the mirror."""
        camera, mesh, mirror, given = self.camera, self.scene.mesh, self.mirror, self._settings

        def decomposed(side: int, mode: str = "normals") -> CameraTriangles:
            many = given.get("triangles", mirror.triangles)
            return decompose(mirror.surface, camera, many, resolution=side, index=mirror.index, mode=mode)

        cams = given.get("cams")
        if cams is None and not {"triangles", "resolution"} & given.keys():
            cams = mirror.camera_triangles
        if self.method == "camera_triangles":
            found = decomposed(given.get("resolution", mirror.resolution), mirror.mode) if cams is None else cams
            return ByTriangles(camera, mesh, mirror.surface, found, self.shaded)
        if self.method == "vertex":
            found = decomposed(2) if cams is None else cams
            return ByVertices(camera, mesh, found, self.rays.ray, given.get("level", 0), self.shaded)
        if self.method == "environment":
            size = check_size(given.get("size", 512))
            return ByEnvironment(mesh, mirror.surface, self.rays.ray, size, self.shaded)
        if self.method == "depth_image":
            choice = self._choice()
            shadows: Callable[[], Sequence[Any]] = lambda: self.shadows  # noqa: E731
            rays = camera.eye, self.rays.ray, camera.width
            return ByDepthImages(self.scene, mirror, *rays, self.shading, shadows, choice)
        choice = self._choice()
        if choice.bounces > 1:
            return ByTracedOrders(self.scene, mirror, self.rays.ray, self.shaded, choice)
        return ByTracing(camera, mesh, self.rays.ray, self.shaded)

    def _choice(self) -> DepthImageChoice:
        """Depth images and orders of reflection: the mirror's, and what was given instead."""
        mirror = self.mirror
        own = {"bounces": mirror.bounces, "reflectance": mirror.reflectance, "own": mirror.own}
        return choice_of(self.scene, **(own | dict(mirror.depth_images or {}) | self._settings))

    @exclusive
    def update(
        self,
        vertices: Any = None,
        *,
        normals: Any = None,
        transform: Any = None,
        shadows: Sequence[Any] | None = None,
    ) -> None:
        """The scene elsewhere: positions (V, 3) of all its vertices or a list with one array for each of its meshes,
        or a rigid transform; see `Moving.update`. The mirror and its camera triangles stay. shadows: the shadow maps as
        they are now, of a picture with shadows; they do not move by themselves. Raises InputError for other shapes,
        where shading needs normals that are not known, and for shadows that are missing or none of this picture.
        """
        if shadows is None and self.shadows:
            raise InputError(
                "this picture has shadow maps, which do not move with the scene: pass shadows=, the maps as they are "
                "now (see mpcam.shadow_map), or the same ones where they are to stay"
            )
        if shadows is not None:
            check_shadows(shadows, self.scene, self.shading)
            self.shadows = shadows
        mesh = moved(self.scene.mesh, vertices, normals, transform)
        if self.shading in ("light", "normal"):
            vertex_normals(mesh)
        self.direct.move(mesh)
        self.part.move(mesh)

    @exclusive
    def frame(self) -> Any:
        """One frame on the device: an evaluated Array3f, one entry per pixel."""
        hits = self.direct.frame()
        beside = self.shaded(hits)
        return _over(hits.device_depth, beside, self.distance, self.part.colors(), self._color)

    def shaded(self, hits: Hits, shading: str | None = None) -> Any:
        """Colors of hits on the scene, on the device; shading: another than the picture's."""
        if shading not in (None, self.shading):
            return shade_device(hits, self.scene, shading)
        return shade_device(hits, self.scene, self.shading, self.shadows)

    @exclusive
    def image(self) -> np.ndarray:
        """One frame: (H, W, 3) float32, linear RGB."""
        shape = (self.camera.height, self.camera.width, 3)
        return np.stack([np.asarray(part.numpy()) for part in self.frame()], -1).reshape(shape)

    @property
    def cams(self) -> CameraTriangles | None:
        """The camera triangles that stand for the mirror; None for other methods."""
        return self.part.cams if isinstance(self.part, (ByTriangles, ByVertices)) else None

    @property
    def hits(self) -> Hits:
        """First hits of the camera triangles' rays. Raises InputError for methods without."""
        if not isinstance(self.part, ByTriangles):
            raise InputError(f"hits are those of method='camera_triangles', and this picture has {self.method!r}")
        return self.part.prepared.frame()

    @property
    def explanation(self) -> Explanation:
        """Which stages a frame takes, which are left out, and why."""
        direct = Step("direct view", True, f"{self.scene.mesh.triangle_count:,} scene triangles beside the mirror")
        lost = self.scene.environment is not None
        missing = Step("rays that miss", lost, "see the scene's environment" if lost else "see the background")
        return Explanation((direct, *explained(self.part, self.method), missing))

    @functools.cached_property
    def rays(self) -> MirrorRays:
        """The rays that the true surface sends on."""
        return mirror_rays(self.camera, self.mirror)

    @functools.cached_property
    @exclusive
    def distance(self) -> Any:
        """Float on the device: how far the mirror is along each pixel's ray, infinite beside it."""
        return types().Float(aligned(self.rays.distance)) + opaque_zero()

    @property
    def mask(self) -> np.ndarray:
        """(H, W) bool: pixels that see the mirror, unless something stands before it."""
        return np.isfinite(self.rays.distance).reshape(self.camera.height, self.camera.width)


def _over(depth: Any, beside: Any, distance: Any, colors: list[Any], color: list[Any]) -> Any:
    """The mirror's colors where it is nearer than the rest."""
    return _over_kernel()(depth, beside, distance, colors, color)


@functools.cache
def _over_kernel() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def over(depth: Any, beside: Any, distance: Any, colors: list[Any], color: list[Any]) -> Any:
        t = types()
        seen = t.Array3f(*(part * tint for part, tint in zip(colors, color, strict=True)))
        return dr.select(distance < depth, seen, t.Array3f(beside))

    return over


def reflection(scene: Scene, camera: Camera | None = None, mirror: Mirror | None = None, **settings: Any) -> np.ndarray:
    """A picture of a scene with a mirror or an interface: (H, W, 3) float32, linear RGB.

    settings: see `Reflection`, which is to be kept for many frames. Raises InputError as it does.
    """
    if isinstance(scene, (Mesh, list, tuple)):
        scene = Scene.of(scene)
    return Reflection(scene, camera, mirror, **settings).image()
