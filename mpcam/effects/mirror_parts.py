"""What is seen in a mirror, by one method each; parts of a `Reflection`."""

import functools
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

import numpy as np

from mpcam.backend import opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.types import Ray
from mpcam.decomposition.reflector import reflector_of
from mpcam.decomposition.resolve import Resolver
from mpcam.effects.environment import DeviceEnvironment
from mpcam.effects.lookup import back_to_back
from mpcam.effects.virtual_vertices import VirtualVertices
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface
from mpcam.rendering.explanation import Step
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.raytrace import RayTraced

Shaded = Callable[[Hits], Any]
"""From first hits on the scene to their colors: an Array3f on the device."""
STAGES = {
    "camera triangles": "",
    "candidates": "",
    "root finding": "rays of pixels are known; only project() needs the cubic",
    "straight edges": "",
    "atlas to picture": "",
    "environment map": "",
    "depth images": "",
    "rays of the true surface": "",
}
"""What any part may do, in order, and why a part does without it where this is not the method itself."""


class MirrorPart(Protocol):
    """What is seen in the mirror, by one method."""

    @property
    def stages(self) -> Mapping[str, str]:
        """Which of STAGES it takes, and on what."""
        ...

    def move(self, mesh: Mesh) -> None:
        """The scene's mesh as it is now (see `Moving.move`)."""
        ...

    def colors(self) -> list[Any]:
        """Three Floats, one number for each pixel of the eye's camera, evaluated; anything beside the mirror."""
        ...


def explained(part: MirrorPart, method: str) -> Iterator[Step]:
    """All of STAGES, and what a part makes of each."""
    runs = part.stages
    for name, why_not in STAGES.items():
        yield Step(name, name in runs, runs.get(name) or why_not or f"method {method!r}")


class Direct:
    """The colors of first hits, one for each pixel of the eye."""

    def __init__(self, prepared: Any, shaded: Shaded):
        self.prepared, self.shaded = prepared, shaded

    def move(self, mesh: Mesh) -> None:
        self.prepared.move(mesh)

    def colors(self) -> list[Any]:
        return list(self.shaded(self.prepared.frame()))


class ByTriangles(Direct):
    """The scene through camera triangles, brought to the eye's pixels. surface: the mirror's own."""

    def __init__(self, camera: Camera, mesh: Mesh, surface: Mesh | Surface, cams: CameraTriangles, shaded: Shaded):
        super().__init__(prepare(cams, mesh), shaded)
        self.cams, self.resolver = cams, Resolver(cams, surface, camera)
        self._nothing = opaque_numbers([0.0, 0.0, 0.0])

    @property
    def stages(self) -> dict[str, str]:
        bent = "their pixels bend the camera's rays by interpolated normals"
        return {
            "camera triangles": f"{self.cams.count} that the camera sees; {bent}",
            "candidates": "groups and blocks of rays against clusters of triangles",
            "atlas to picture": "texels by the true surface's points, found once",
        }

    def colors(self) -> list[Any]:
        import drjit as dr

        atlas = self.shaded(self.prepared.frame())
        return self.resolver.on_device(dr.ravel(atlas), self._nothing)


class ByVertices(Direct):
    """The scene's vertices where the mirror shows them, joined by straight edges. ray: those of the true surface."""

    def __init__(self, camera: Camera, mesh: Mesh, cams: CameraTriangles, ray: Ray, level: int, shaded: Shaded):
        super().__init__(VirtualVertices(camera, mesh, cams, ray, level), shaded)
        self.cams = cams

    @property
    def stages(self) -> dict[str, str]:
        return {
            "camera triangles": f"{self.cams.count} that the camera sees; with rays at the corners",
            "candidates": "camera triangles against clusters of vertices",
            "root finding": "the image of each vertex, by the cubic",
            "straight edges": "between the images of vertices",
        }


class ByEnvironment:
    """Two views of the surroundings from the surface's middle, looked up along the true rays."""

    stages = {"environment map": "two views from the mirror's middle"}

    def __init__(self, mesh: Mesh, surface: Mesh | Surface, ray: Ray, size: int, shaded: Shaded):
        self.size, self.shaded = size, shaded
        middle = reflector_of(surface).center
        self.views: list[Any] = [prepare(camera, mesh) for camera in back_to_back(middle, size)]
        directions = np.ascontiguousarray(np.asarray(ray.direction).T, np.float32)
        self.directions = types().Array3f(directions) + opaque_zero()

    def move(self, mesh: Mesh) -> None:
        for view in self.views:
            view.move(mesh)

    def colors(self) -> list[Any]:
        import drjit as dr

        parts: list[Any] = [dr.ravel(self.shaded(view.frame())) for view in self.views]
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

    stages = {"rays of the true surface": "traced anew in each frame"}

    def __init__(self, camera: Camera, mesh: Mesh, ray: Ray, shaded: Shaded):
        super().__init__(RayTraced(camera, mesh, ray), shaded)
