"""Frames of a scene with a surface in which, or through which, the rest of it is seen; what mirrors and glass share."""

import functools
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.effects.mirror_parts import MirrorPart
from mpcam.effects.mirror_rays import MirrorRays
from mpcam.effects.refractor_rays import RefractorRays
from mpcam.errors import InputError
from mpcam.geometry.moved import moved
from mpcam.rendering.explanation import Explanation, Step
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.registry import Method
from mpcam.rendering.shade import check_shading, check_shadows, shade_device, vertex_normals
from mpcam.scene.scene import Scene


class SurfacePicture(ABC):
    """What is beside the surface by the camera's own rays, and on it what a part makes of the rays that it sends on.

    camera: with a common center. methods: the register of those that there are. settings: of the method, None where
    not given. shading, shadows: see `mpcam.Reflection`. what: the surface in words. Raises InputError.
    """

    part: MirrorPart

    def __init__(
        self,
        scene: Scene,
        camera: Camera | None,
        method: str,
        shading: str,
        shadows: Sequence[Any],
        methods: Mapping[str, Method],
        settings: Mapping[str, Any],
        what: str,
    ):
        self.scene, self.method, self.shading, self.shadows = scene, method, shading, shadows
        given = camera if camera is not None else scene.camera
        if not isinstance(given, Camera) or given.ray_geometry != "central":
            raise InputError(f"a camera with a common center is needed to look into a {what}: give one as camera=")
        check_shading(shading)
        check_shadows(shadows, scene, shading)
        self.camera = given
        if method not in methods:
            raise InputError(f"method={method!r}: allowed are {', '.join(methods)}")
        self._settings = self._checked(dict(settings), methods)
        self.direct: Any = prepare(given, scene.mesh)

    def _checked(self, settings: dict[str, Any], methods: Mapping[str, Method]) -> dict[str, Any]:
        """Those that are not None; raises InputError for those that do not go with the method."""
        names = {one: entry.home(self.camera).names for one, entry in methods.items()}
        kept = {name: value for name, value in settings.items() if value is not None or name == "coarse"}
        for name in kept:
            if name not in names[self.method]:
                fitting = " or ".join(repr(one) for one in names if name in names[one])
                if not fitting:
                    allowed = ", ".join(names[self.method]) or "none"
                    raise InputError(f"method={self.method!r} has no setting {name!r}: allowed are {allowed}")
                raise InputError(f"{name}= goes with method={fitting}, not with {self.method!r}")
        return kept

    @functools.cached_property
    @abstractmethod
    def rays(self) -> MirrorRays | RefractorRays:
        """The rays that the surface sends on, and how far it is."""

    @property
    @abstractmethod
    def tint(self) -> Sequence[float]:
        """Linear RGB that what the part shows is multiplied by."""

    @abstractmethod
    def _steps(self) -> Iterable[Step]:
        """The stages of what is seen on the surface."""

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
        or a rigid transform; see `Moving.update`. The mirror, or the glass, stays. shadows: the shadow maps as they are
        now, of a picture with shadows; they do not move by themselves. Raises InputError for other shapes, where
        shading needs normals that are not known, and for shadows that are missing or none of this picture.
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
        return _over()(hits.device_depth, beside, self.distance, self.part.colors(), self._color)

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
    def explanation(self) -> Explanation:
        """Which stages a frame takes, which are left out, and why."""
        direct = Step("direct view", True, f"{self.scene.mesh.triangle_count:,} scene triangles beside the surface")
        lost = self.scene.environment is not None
        missing = Step("rays that miss", lost, "see the scene's environment" if lost else "see the background")
        return Explanation((direct, *self._steps(), missing))

    @functools.cached_property
    @exclusive
    def distance(self) -> Any:
        """Float on the device: how far the surface is along each pixel's ray, infinite beside it."""
        return types().Float(aligned(self.rays.distance)) + opaque_zero()

    @functools.cached_property
    def _color(self) -> list[Any]:
        return opaque_numbers(list(self.tint))

    @property
    def mask(self) -> np.ndarray:
        """(H, W) bool: pixels that see the surface, unless something stands before it."""
        return np.isfinite(self.rays.distance).reshape(self.camera.height, self.camera.width)


@functools.cache
def _over() -> Any:
    """The surface's colors where it is nearer than the rest."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def over(depth: Any, beside: Any, distance: Any, colors: list[Any], color: list[Any]) -> Any:
        t = types()
        seen = t.Array3f(*(part * tint for part, tint in zip(colors, color, strict=True)))
        return dr.select(distance < depth, seen, t.Array3f(beside))

    return over
