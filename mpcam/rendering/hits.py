"""What a camera sees first, pixel by pixel."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends
from mpcam.cameras.types import PosedRays
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.device_camera import posed_rays
from mpcam.rendering.layered_rays import bent_view


@dataclass(frozen=True)
class Stats:
    """How much work a frame took.

    tests: pixels tested against triangles. rendered: tests that hit, before the nearest one was chosen.
    """

    tests: int
    rendered: int

    @property
    def overdraw(self) -> float:
        """Tests per rendered fragment; 1 is ideal. Zero where nothing was tested, infinite where nothing was hit."""
        if self.tests == 0:
            return 0.0
        return self.tests / self.rendered if self.rendered else float("inf")


class Hits:
    """First hits of a camera's pixels on a mesh; every field is worked out when it is first asked for.

    triangle: (H, W) int32 face numbers, -1 where nothing is hit. depth: (H, W) float32 distance along the pixel's ray
    (unit direction), scene units, infinite where nothing is hit. barycentric: (H, W, 2) float32 weights of the
    triangle's second and third corner (the first has the rest to 1), 0 where nothing is hit. stats: work counts. mesh:
    with its vertices where they were in this frame.
    """

    def __init__(
        self,
        camera: Camera,
        mesh: Mesh,
        method: str,
        triangle: Any,
        depth: Any,
        weights: Callable[[], tuple[Any, Any]],
        stats: Callable[[], Stats],
        view: Callable[[], PosedRays] | None = None,
    ):
        self.camera, self.mesh, self.method = camera, mesh, method
        self.device_triangle, self.device_depth = triangle, depth
        self._weights, self._stats, self._view = weights, stats, view

    @cached_property
    @exclusive
    def view(self) -> PosedRays:
        """The rays; those of the camera unless something else found the hits. Of bent rays the pieces that hit."""
        if self._view:
            return self._view()
        if isinstance(self.camera, Bends):
            return bent_view(self.camera, self.device_depth)
        return posed_rays(self.camera)

    @cached_property
    @exclusive
    def device_weights(self) -> tuple[Any, Any]:
        """Barycentric weights of corners 2 and 3 on the device, one number per pixel."""
        return self._weights()

    @cached_property
    @exclusive
    def triangle(self) -> np.ndarray:
        """(H, W) int32, -1 where nothing is hit."""
        return self._image(self.device_triangle)

    @cached_property
    @exclusive
    def depth(self) -> np.ndarray:
        """(H, W) float32, infinite where nothing is hit."""
        return self._image(self.device_depth)

    @cached_property
    @exclusive
    def barycentric(self) -> np.ndarray:
        """(H, W, 2) float32, weights of the second and third corner."""
        return np.stack([self._image(weight) for weight in self.device_weights], -1)

    @cached_property
    @exclusive
    def stats(self) -> Stats:
        """Work counts; counted in a second run when they are asked for. Zero for methods that test no pixels."""
        return self._stats()

    @property
    def mask(self) -> np.ndarray:
        """(H, W) bool, where something is hit."""
        return self.triangle >= 0

    @property
    def points(self) -> np.ndarray:
        """(H, W, 3) float64 world positions of the hits, from the barycentric weights; 0 where nothing is hit."""
        return interpolate(self, self.mesh.vertices)

    def _image(self, values: Any) -> np.ndarray:
        return np.asarray(values.numpy()).reshape(self.camera.height, self.camera.width)

    def __repr__(self) -> str:
        size = f"{self.camera.width}x{self.camera.height}"
        return f"Hits({size}, method={self.method!r}, {self.mesh.triangle_count} triangles)"


def interpolate(hits: Hits, attribute: np.ndarray) -> np.ndarray:
    """Attribute of the mesh at every hit, linear on each triangle.

    attribute: (V, C) per vertex or (F, 3, C) per corner. Returns (H, W, C) in the attribute's float type (float64 for
    integers); 0 where nothing is hit. Raises InputError where the shape fits neither vertices nor faces.
    """
    values = np.asarray(attribute)
    if values.dtype.kind not in "fiu":
        raise InputError(f"attribute has type {values.dtype}: numbers are needed")
    mesh, kind = hits.mesh, values.dtype if values.dtype.kind == "f" else np.dtype(np.float64)
    vertices, faces = len(mesh.vertices), len(mesh.faces)
    if not (values.ndim == 2 and len(values) == vertices) and values.shape[:2] != (faces, 3):
        raise InputError(
            f"attribute has shape {values.shape}: ({vertices}, C) per vertex or ({faces}, 3, C) per corner is needed"
        )
    result = np.zeros((*hits.triangle.shape, values.shape[-1]), kind)
    mask = hits.mask
    if not mask.any():
        return result
    triangle, weights = hits.triangle[mask], hits.barycentric[mask].astype(np.float64)
    corners = values[mesh.faces[triangle]] if values.ndim == 2 else values[triangle]
    first = 1.0 - weights[:, :1] - weights[:, 1:]
    result[mask] = first * corners[:, 0] + weights[:, :1] * corners[:, 1] + weights[:, 1:] * corners[:, 2]
    return result
