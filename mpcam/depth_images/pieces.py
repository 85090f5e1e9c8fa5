"""Rays against depth images of graph cameras, frustum by frustum (Rosen et al. 2011, section 5.1).

An affine map for each frustum straightens its rays: what the frustum holds looks to the root's pinhole as the graph
camera sees it. So the part of a ray that lies in a frustum is a straight line in the image, and it is marched over the
depth image of the straightened scene as over any pinhole's. No point has to be looked for in the frusta.
"""

import functools
from typing import Any, Protocol, runtime_checkable

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, types
from mpcam.cameras.base import Camera
from mpcam.cameras.pinhole import Pinhole
from mpcam.cameras.types import PosedRays
from mpcam.depth_images import bent
from mpcam.depth_images.march import marched
from mpcam.depth_images.nearest import nearer
from mpcam.depth_images.surface import device_surface
from mpcam.errors import InputError
from mpcam.rendering.device_camera import device_camera


@runtime_checkable
class HasFrusta(Protocol):
    """A pinhole whose rays bend at planes: convex bodies (K, m, 4), and matrices (K, 4, 4) by which they are seen.

    A matrix takes (x, y, z, 1) of the world to (u w, v w, 1, w), a plane (n, o) has n . x + o <= 0 inside.
    """

    root: Pinhole

    @property
    def frustum_planes(self) -> np.ndarray: ...
    @property
    def frustum_matrices(self) -> np.ndarray: ...


def with_frusta(camera: Camera) -> Any:
    """The camera, known to have frusta; raises InputError otherwise."""
    if not isinstance(camera, HasFrusta):
        raise InputError(
            f"walk='pieces' goes through the frusta of a GraphCamera, and a {type(camera).__name__} has none: "
            "use walk='march'"
        )
    return camera


def straight_root(camera: Any) -> Pinhole:
    """The root's pinhole at the identity pose."""
    return camera.root.with_pose(np.eye(4))


def straightening(camera: Any) -> np.ndarray:
    """(K, 4, 4) affine maps from the world to where the root sees straight what each frustum holds."""
    root = camera.root
    view = np.array([[root.fx, 0, root.cx, 0], [0, root.fy, root.cy, 0], [0, 0, 0, 1], [0, 0, 1, 0]], np.float64)
    return np.linalg.inv(view) @ camera.frustum_matrices


@exclusive
def straight_surface(camera: Any, depth: Any, side: int) -> Any:
    """The surface of a graph camera's depth image as the root's pinhole sees it straightened.

    depth: Float, lengths along the bent rays.
    """
    from mpcam_kernels.threads import threads

    root, known = straight_root(camera), device_camera(camera)
    numbers = opaque_numbers([root.fx, root.fy, root.cx, root.cy])
    straight = _frozen_straight((camera.width, camera.height))
    pixel = threads(types(), 0, camera.width * camera.height)
    lengths = straight(pixel, known.on_device, bent.piece_rows(camera), numbers, depth)
    return device_surface(root, lengths, side)


@functools.lru_cache(maxsize=16)
def _frozen_straight(size: tuple[int, int]) -> Any:
    """Kernel from lengths along bent rays to distances from the root along straightened ones."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def straight(pixel: Any, camera: Any, pieces: tuple[Any, ...], numbers: list[Any], depth: Any) -> Any:
        t = types()
        fx, fy, cx, cy = numbers
        there = dr.isfinite(depth)
        point = bent.Pieces(pieces, pixel).point(dr.select(there, depth, 0.0))
        measure = camera.local_measure(point)
        u, v = t.Float(pixel % size[0]) + 0.5, t.Float(pixel // size[0]) + 0.5
        slant = dr.sqrt(1 + dr.square((u - cx) / fx) + dr.square((v - cy) / fy))
        there &= measure.valid & (measure.depth > 0)
        return dr.select(there, slant / dr.select(there, measure.depth, 1.0), dr.inf)

    return straight


def walked(camera: Any, surface: Any, rays: PosedRays, coarse: float, fine: float, far: Any) -> Any:
    """First hits of rays by way of all frusta; surface: from `straight_surface`. See `marched`."""
    root, best, limit = straight_root(camera), None, far
    for matrix, planes in zip(straightening(camera), camera.frustum_planes, strict=True):
        found = marched(root, surface, rays, coarse, fine, limit, matrix, planes)
        best, limit = (found, found[1]) if best is None else nearer(best, found)
    return best
