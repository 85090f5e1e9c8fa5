"""Meshes on the device, uploaded once and kept while they are alive."""

import weakref
from typing import Any

import numpy as np

from mpcam.backend import opaque_numbers, opaque_zero, types
from mpcam.cameras.types import PosedRays, Ray
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh


class DeviceMesh:
    """Vertices and faces in device memory.

    Vertices are kept as (v - anchor) / scale, which fills about [-1, 1], so that float32 holds a small mesh far from
    the world's origin, or a mesh of 1e-8 or 1e8 units, as well as any other.
    """

    def __init__(self, mesh: Mesh):
        t = types()
        used = mesh.corners.reshape(-1, 3)  # vertices that no face uses must not widen the range
        used = used[np.isfinite(used).all(axis=1)]
        low, high = (used.min(0), used.max(0)) if len(used) else (np.zeros(3), np.zeros(3))
        self.shape = mesh.vertices.shape
        extent = float(np.max(high - low)) / 2
        self.anchor = 0.5 * low + 0.5 * high
        self.scale = extent if extent > 0 else 1.0
        self.faces = t.UInt(np.ascontiguousarray(mesh.faces.ravel(), np.uint32))
        self.vertices = self.place(mesh.vertices)
        self.ordered: Any = None  # by who wants neighbors together

    def place(self, vertices: np.ndarray) -> Any:
        """Other positions of the same vertices, uploaded; raises InputError unless there are as many of them."""
        try:
            vertices = np.asarray(vertices, np.float64)
        except (TypeError, ValueError):
            raise InputError(f"vertices are a {type(vertices).__name__}: give numbers of shape {self.shape}") from None
        if vertices.shape != self.shape:
            raise InputError(f"vertices have shape {vertices.shape}: give {self.shape}, as the mesh has")
        with np.errstate(invalid="ignore", over="ignore"):
            flat = ((vertices - self.anchor) / self.scale).astype(np.float32).ravel()
        if flat.size == 0:
            return types().Float()
        return (
            types().Float(flat) + opaque_zero()
        )  # in Dr.Jit's own memory: frozen kernels are particular about alignment

    def rays(self, rays: Ray) -> tuple[Any, Any, Any]:
        """World rays (N, 3) in the mesh's frame: world axes, from the anchor, in units of the scale."""
        t = types()
        origin = (np.asarray(rays.origin, np.float64) - self.anchor) / self.scale
        origin, along = (np.ascontiguousarray(x.T, np.float32) for x in (origin, np.asarray(rays.direction)))
        return t.Array3f(origin), t.Array3f(along), t.Bool(np.ascontiguousarray(rays.valid))

    def view(self, origin: Any, direction: Any, valid: Any) -> PosedRays:
        """Rays of the mesh's frame, one per pixel, as what hits were found with: in scene units, from the anchor."""
        import drjit as dr

        pose = np.eye(4)
        pose[:3, 3] = -self.anchor
        ray = Ray(origin * opaque_numbers([self.scale])[0], direction, valid)
        dr.eval(*ray)  # of a named tuple it would do nothing
        return PosedRays(pose, ray)

    def pose(self, frame_from_world: Any) -> list[Any]:
        """Rotation (9) and shift (3) from device vertices to a frame in units of `scale`, opaque.

        frame_from_world: 4x4, rigid, scene units.
        """
        matrix = np.asarray(frame_from_world, np.float64)
        shift = (matrix[:3, :3] @ self.anchor + matrix[:3, 3]) / self.scale
        return opaque_numbers([*matrix[:3, :3].ravel(), *shift])


_meshes: weakref.WeakKeyDictionary[Mesh, DeviceMesh] = weakref.WeakKeyDictionary()


def device_mesh(mesh: Mesh) -> DeviceMesh:
    """The mesh on the device; uploaded at the first call."""
    if not isinstance(mesh, Mesh):
        raise InputError(
            f"a mpcam.Mesh is needed, got {type(mesh).__name__}: see mpcam.load_mesh and mpcam.builtin_mesh"
        )
    found = _meshes.get(mesh)
    if found is None:
        found = DeviceMesh(mesh)
        _meshes[mesh] = found
    return found


def to_camera(pose: list[Any], vertices: Any, count: Any) -> Any:
    """Device vertices numbered by `count` in the camera frame, in units of the mesh's scale."""
    import drjit as dr

    from mpcam_kernels.poses import placed

    return placed(types(), pose, dr.gather(types().Array3f, vertices, count))
