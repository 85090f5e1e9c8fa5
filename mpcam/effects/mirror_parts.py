"""What is seen in a mirror, by one method each; parts of a `Reflection`."""

import functools
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from mpcam.backend import opaque_numbers, opaque_zero, types
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.decompose import decompose
from mpcam.decomposition.reflector import reflector_of
from mpcam.decomposition.resolve import Resolver
from mpcam.effects.environment import DeviceEnvironment
from mpcam.effects.lookup import back_to_back
from mpcam.effects.virtual_vertices import VirtualVertices
from mpcam.rendering.methods import prepare

if TYPE_CHECKING:
    from mpcam.effects.reflection import Reflection


class Part(Protocol):
    """What is seen in the mirror, by one method."""

    def update(self, vertices: np.ndarray) -> None:
        """New positions (V, 3) of the scene's vertices."""
        ...

    def colours(self) -> list[Any]:
        """Three Floats, one number for each pixel of the eye's camera, evaluated; anything beside the mirror."""
        ...


class Direct:
    """The colours of first hits, one for each pixel of the eye."""

    def __init__(self, whole: "Reflection", prepared: Any):
        self.whole, self.prepared = whole, prepared

    def update(self, vertices: np.ndarray) -> None:
        self.prepared.update(vertices)

    def colours(self) -> list[Any]:
        return list(self.whole.shaded(self.prepared.frame()))


class ByTriangles(Direct):
    """The scene through camera triangles, brought to the eye's pixels."""

    def __init__(self, whole: "Reflection", triangles: int, resolution: int, cams: CameraTriangles | None):
        self.cams = decomposed(whole, triangles, resolution) if cams is None else cams
        super().__init__(whole, prepare(self.cams, whole.scene.mesh))
        self.resolver = Resolver(self.cams, whole.mirror.surface, whole.camera)
        self._nothing = opaque_numbers([0.0, 0.0, 0.0])

    def colours(self) -> list[Any]:
        import drjit as dr

        atlas = self.whole.shaded(self.prepared.frame())
        return self.resolver.on_device(dr.ravel(atlas), self._nothing)


class ByEnvironment:
    """Two views of the surroundings from the mirror's middle, looked up along the true rays."""

    def __init__(self, whole: "Reflection", size: int):
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


class ByTracing(Direct):
    """The scene along the rays of the true surface."""

    def __init__(self, whole: "Reflection"):
        from mpcam.truth.raytrace import RayTraced

        super().__init__(whole, RayTraced(whole.camera, whole.scene.mesh, whole.rays.ray))


class ByVertices(Direct):
    """The scene's vertices where the mirror shows them, joined by straight edges."""

    def __init__(self, whole: "Reflection", triangles: int, level: int, cams: CameraTriangles | None):
        self.cams = decomposed(whole, triangles, 2) if cams is None else cams
        super().__init__(whole, VirtualVertices(whole.camera, whole.scene.mesh, self.cams, whole.rays.ray, level))


def decomposed(whole: "Reflection", triangles: int, resolution: int) -> CameraTriangles:
    """Camera triangles of a picture's mirror."""
    mirror = whole.mirror
    return decompose(mirror.surface, whole.camera, triangles, resolution=resolution, index=mirror.index)
