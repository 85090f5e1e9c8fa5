"""Pictures of scenes with a curved mirror or lens face, near objects in it, by camera triangles (Hou et al. 2006).

The same picture by other means, to compare with: vertices with straight edges between them, an environment map, and
rays traced from the true surface.
"""

import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Unpack

import numpy as np

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.decompose import decompose
from mpcam.effects.by_depth_image import ByDepthImages
from mpcam.effects.depth_image_choice import DepthImageChoice, choice_of
from mpcam.effects.lookup import check_size
from mpcam.effects.mirror_methods import MIRROR_METHODS, MirrorSettings
from mpcam.effects.mirror_parts import ByEnvironment, ByTracing, ByTriangles, ByVertices, MirrorPart, explained
from mpcam.effects.mirror_rays import MirrorRays, mirror_rays
from mpcam.effects.surface_picture import SurfacePicture
from mpcam.effects.traced_orders import ByTracedOrders
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.explanation import Step
from mpcam.rendering.hits import Hits
from mpcam.scene.mirror import Mirror
from mpcam.scene.scene import Scene


class Reflection(SurfacePicture):
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
        found = mirror if mirror is not None else scene.mirror
        if found is None:
            raise InputError(f"scene {scene.name!r} has no mirror: give it one, mpcam.Mirror(surface), or pass mirror=")
        if not isinstance(found, Mirror):
            raise InputError(f"mirror is a {type(found).__name__}: give mpcam.Mirror(surface)")
        super().__init__(scene, camera, method, shading, shadows, MIRROR_METHODS, settings, "mirror")
        self.mirror = found
        self.part = self._part()

    def _part(self) -> MirrorPart:
        """What the method shows in the mirror."""
        camera, mesh, mirror, given = self.camera, self.scene.mesh, self.mirror, self._settings

        def decomposed(side: int, mode: str = "normals") -> CameraTriangles:
            many = given.get("triangles", mirror.triangles)
            return decompose(mirror.surface, camera, many, resolution=side, index=mirror.index, mode=mode)

        cams = given.get("cams")
        ready = mirror.camera_triangles
        if cams is None and ready is not None and not {"triangles", "resolution"} & given.keys():
            cams = ready if self.method != "vertex" or ready.degree == 1 else None
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
    def tint(self) -> tuple[float, float, float]:
        return self.mirror.color

    def _steps(self) -> Iterator[Step]:
        return explained(self.part, self.method)

    @functools.cached_property
    def rays(self) -> MirrorRays:
        """The rays that the true surface sends on."""
        return mirror_rays(self.camera, self.mirror)


def reflection(scene: Scene, camera: Camera | None = None, mirror: Mirror | None = None, **settings: Any) -> np.ndarray:
    """A picture of a scene with a mirror or an interface: (H, W, 3) float32, linear RGB.

    settings: see `Reflection`, which is to be kept for many frames. Raises InputError as it does.
    """
    if isinstance(scene, (Mesh, list, tuple)):
        scene = Scene.of(scene)
    return Reflection(scene, camera, mirror, **settings).image()
