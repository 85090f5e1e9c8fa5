"""What a camera may know beyond its rays. Methods say what they need; a camera without it is refused by name.

Rays alone are enough to be rasterized exactly, traced, written and compared. Everything else makes a camera faster, or
gives it more methods. The maps here are those in the camera's own frame, components first.
"""

from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np

from mpcam.cameras.outline import Outline, VertexView
from mpcam.cameras.types import Box, Projection, Ray, RayPieces
from mpcam.errors import InputError
from mpcam.math import Array, Vector


@runtime_checkable
class HasRays(Protocol):
    """Every camera: the ray of each pixel."""

    def local_ray(self, pixel: Vector) -> Ray: ...


@runtime_checkable
class Bends(Protocol):
    """Rays that are bent: straight piece by piece, at most `pieces_per_ray` of them, in order along the ray.

    Depths of such a camera are lengths along the bent ray.
    """

    pieces_per_ray: int

    def local_ray_pieces(self, pixel: Vector) -> tuple[RayPieces, ...]: ...


@runtime_checkable
class HasKernels(Protocol):
    """A form of its own for kernels: a dataclass of Dr.Jit arrays and numbers, with the maps that the camera has.

    number: the type of its numbers.
    """

    def for_kernels(self, number: type) -> Any: ...


@runtime_checkable
class Projects(Protocol):
    """All images of a point, with a mask: as many entries as a point can have images."""

    def local_project(self, point: Vector) -> tuple[Projection, ...]: ...


@runtime_checkable
class ProjectsNear(Protocol):
    """Images of points in the part of the image alone that holds a pixel each, where there are many parts."""

    def project_near(self, points: np.ndarray, pixels: np.ndarray) -> Projection: ...


@runtime_checkable
class Images(Protocol):
    """The one image of a point, going on smoothly beyond the domain, and whether the point lies in the domain."""

    def local_image(self, point: Vector) -> tuple[Vector, Array]: ...


@runtime_checkable
class Bounds(Protocol):
    """A box of pixels around the image of a triangle."""

    def local_bound(self, a: Vector, b: Vector, c: Vector) -> Box: ...


@runtime_checkable
class Outlines(Bounds, Images, Protocol):
    """Boxes and lines around the curved images of small triangles, from what each vertex knows of the projection."""

    def local_vertex_view(self, point: Vector) -> VertexView: ...
    def local_outline(self, points: list[Vector], views: list[VertexView]) -> tuple[Outline, Array]: ...
    def local_bound_rough(self, a: Vector, b: Vector, c: Vector) -> Box: ...


_WORDS: dict[type, str] = {
    HasRays: "rays of pixels (local_ray)",
    Bends: "bent rays (local_ray_pieces)",
    Projects: "images of points (local_project)",
    Images: "one image for each point (local_image)",
    Bounds: "boxes around images of triangles (local_bound)",
    Outlines: "outlines of curved triangles (local_outline)",
}

C = TypeVar("C")


def need(camera: object, capability: type[C], what: str, instead: str = "") -> C:
    """The camera, known to have a capability; raises InputError that names what is missing, and what to use instead."""
    if not isinstance(camera, capability):
        mend = f": {instead}" if instead else ""
        raise InputError(f"{what} needs {_WORDS[capability]}, which {type(camera).__name__} does not have{mend}")
    return camera
