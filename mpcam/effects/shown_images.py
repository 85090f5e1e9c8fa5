"""Depth images of some of a scene's meshes, which follow them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.depth_images.depth_image import DepthImage
from mpcam.effects.depth_image_views import View, how_to_render, still_holds, used_vertices
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.moved import part_of
from mpcam.scene.scene import Scene


class ShownImages:
    """A view of some of a scene's meshes as depth images, which follow the meshes.

    view: its cameras. images: one for each of them. reflectance: part of the light that its meshes reflect as mirrors.
    """

    def __init__(self, scene: Scene, view: View, reflectance: float, shading: str, normals: bool, shadows: Any = ()):
        self.view, self.reflectance = view, reflectance
        self._whole = view.meshes == tuple(range(len(scene.meshes)))
        chosen = scene.meshes if self._whole else tuple(scene.meshes[i] for i in view.meshes)
        self.scene = replace(scene, meshes=chosen, mirror=None, refractor=None, camera=None)
        ends = np.cumsum([0] + [len(mesh.vertices) for mesh in scene.meshes])
        self._rows = [slice(int(ends[i]), int(ends[i + 1])) for i in view.meshes]
        self._settings: dict[str, Any] = {"shading": shading, "normals": normals, "shadows": shadows}
        self._last = self.scene.mesh.vertices, tuple(shadows)
        self.images = [self._rendered(camera) for camera in view.cameras]

    def _rendered(self, camera: Camera) -> DepthImage:
        method, settings = how_to_render(camera, self.scene.mesh)
        return DepthImage.render(camera, self.scene, method, **self._settings, **settings)

    def part(self, mesh: Mesh) -> Mesh:
        """What it shows of the whole scene's mesh as it is now."""
        if self._whole:
            return mesh
        return part_of(mesh, self.scene.mesh, self._rows)

    def move(self, mesh: Mesh, view: View | None, shadows: Sequence[Any]) -> None:
        """The whole scene's mesh as it is now; view: other cameras of the same kind, None: the same.

        Where neither has changed, nor the shadows, nothing is rendered.
        """
        part = self.part(mesh)
        vertices, maps = self._last
        if view is None and maps == tuple(shadows) and np.array_equal(vertices, part.vertices, equal_nan=True):
            return
        self._last = part.vertices, tuple(shadows)
        if view is not None:
            self.view = view
        for image, camera in zip(self.images, self.view.cameras, strict=True):
            image.move(part, shadows, camera if view is not None else None)

    def holds(self, mesh: Mesh) -> bool:
        """Whether the cameras have room for the meshes where they are now."""
        return self.view.kind not in ("thing", "flat") or still_holds(self.view, used_vertices(self.part(mesh)))
