"""Meshes on the device, uploaded once and kept while they are alive."""

import weakref
from typing import Any

import numpy as np

from mpcam.backend import aligned, aligned_room, opaque_numbers, opaque_zero, types
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.moved import MovedMesh
from mpcam.geometry.order import nearby

FAR = 64.0
"""Scales from the anchor, and times the nearest vertex, from which a camera is far away."""
_SAMPLE = 1024  # vertices that tell where most of a mesh is
_TOGETHER = 64  # rows of three numbers that NumPy takes as one: loops over three numbers alone are slow
_FAR = 64.0  # a mesh that reaches so many times farther than most of its vertices has something far away


class DeviceMesh:
    """Vertices and faces in device memory.

    Vertices are kept as (v - anchor) / scale, which fills about [-1, 1], so that float32 holds a small mesh far from
    the world's origin, or a mesh of 1e-8 or 1e8 units, as well as any other. Anchor and scale are round numbers, so
    that they stay where they are while the mesh moves a little.
    """

    def __init__(self, mesh: Mesh, frame: tuple[np.ndarray, float] | None = None):
        """frame: an anchor and a scale to take instead of those that fit the mesh."""
        t = types()
        base = mesh.base if isinstance(mesh, MovedMesh) else mesh if frame else None
        self.base = None if base is None else device_mesh(base)  # of the mesh before it moved, or with its own frame
        self.used = _used(mesh) if self.base is None else self.base.used
        self.anchor, self.scale, self.reaches_far = (*frame, True) if frame else _frame(self.used_of(mesh))
        if self.base is None:
            self.faces = t.UInt(aligned(mesh.faces, np.uint32))
        else:
            self.faces = self.base.faces
        self.vertices = in_frame(mesh.vertices, self.anchor, self.scale)
        self._ordered: Any = None
        self._near: DeviceMesh | None = None

    def same_frame(self, other: "DeviceMesh") -> bool:
        """Whether positions in both have the same anchor and scale."""
        return self.scale == other.scale and bool((self.anchor == other.anchor).all())

    def used_of(self, mesh: Mesh) -> np.ndarray:
        """Those of the mesh's vertices that faces use."""
        return mesh.vertices if self.used is None else mesh.vertices.take(self.used, axis=0)

    def stands_apart(self, mesh: Mesh, point: np.ndarray) -> float | None:
        """How far a point (3,) is from the nearest vertex, if it is far from most of them but right before some."""
        away = float(np.abs(point - self.anchor).max())
        if away <= FAR * self.scale:
            return None
        with np.errstate(invalid="ignore", over="ignore"):
            gaps = np.abs(self.used_of(mesh) - point).max(axis=1)
        nearest = float(np.min(gaps, initial=np.inf, where=np.isfinite(gaps)))
        return nearest if nearest < away / FAR else None

    def near(self, mesh: Mesh, point: np.ndarray) -> "DeviceMesh":
        """The mesh as a camera at a point (3,) needs it: in a frame around the point where that stands apart."""
        nearest = self.stands_apart(mesh, point)
        if nearest is None:
            return self
        scale = float(2.0 ** np.ceil(np.log2(8.0 * nearest))) if nearest > 0 else self.scale
        anchor = np.rint(point / scale) * scale
        if self._near is None or self._near.scale != scale or (self._near.anchor != anchor).any():
            self._near = DeviceMesh(mesh, (anchor, scale))
        return self._near

    def ordered(self, mesh: Mesh) -> tuple[Any, Any]:
        """Numbers and corners of the triangles of this mesh, neighbors together; worked out once, before it moves."""
        if self.base is not None:
            return self.base.ordered((isinstance(mesh, MovedMesh) and mesh.base) or mesh)
        if self._ordered is None:
            with np.errstate(invalid="ignore", over="ignore"):
                order = nearby(mesh.corners.mean(axis=1)) if mesh.triangle_count else np.zeros(0, np.int64)
            faces = np.ascontiguousarray(mesh.faces[order].ravel(), np.uint32)
            self._ordered = types().UInt(aligned(order, np.uint32)), types().UInt(aligned(faces, np.uint32))
        return self._ordered

    def pose(self, frame_from_world: Any) -> list[Any]:
        """Rotation (9) and shift (3) from device vertices to a frame in units of `scale`, opaque.

        frame_from_world: 4x4, rigid, scene units.
        """
        matrix = np.asarray(frame_from_world, np.float64)
        shift = (matrix[:3, :3] @ self.anchor + matrix[:3, 3]) / self.scale
        return opaque_numbers([*matrix[:3, :3].ravel(), *shift])


def in_frame(vertices: np.ndarray, anchor: np.ndarray, scale: float) -> Any:
    """Positions (V, 3) around an anchor (3,) in units of a scale, uploaded: a flat Float."""
    with np.errstate(invalid="ignore", over="ignore"):
        flat = _around(vertices, anchor, scale)
    if flat.size == 0:
        return types().Float()
    return types().Float(flat) + opaque_zero()  # in Dr.Jit's own memory: frozen kernels are particular about alignment


def _around(vertices: np.ndarray, anchor: np.ndarray, scale: float) -> np.ndarray:
    """(vertices - anchor) / scale in float32, flat."""
    together, rest = _rows_together(vertices)
    result = aligned_room(vertices.size)
    cut = together.size
    moved = together - np.tile(anchor, _TOGETHER)
    moved /= scale
    result[:cut] = moved.ravel()
    result[cut:] = ((rest - anchor) / scale).ravel()
    return result


def _rows_together(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (V, 3) as rows of `_TOGETHER` of them, and the few that are left over."""
    cut = len(vertices) - len(vertices) % _TOGETHER
    return vertices[:cut].reshape(-1, 3 * _TOGETHER), vertices[cut:]


def _used(mesh: Mesh) -> np.ndarray | None:
    """Vertices that faces use, None for all: others must not widen the range."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces] = True
    return None if used.all() else np.flatnonzero(used)


def _frame(vertices: np.ndarray) -> tuple[np.ndarray, float, bool]:
    """Anchor (3,) and scale of positions (V, 3): of all, or of where most are if some are very far away; and if so.

    The scale is a power of two, the anchor a multiple of an eighth of it.
    """
    low, high = _ends(vertices)
    if not np.isfinite([low, high]).all():
        vertices = vertices[np.isfinite(vertices).all(axis=1)]
        if len(vertices) == 0:
            return np.zeros(3), 1.0, False
        low, high = _ends(vertices)
    center, extent = 0.5 * low + 0.5 * high, float((0.5 * high - 0.5 * low).max())
    sample = vertices[:: max(len(vertices) // _SAMPLE, 1)]
    middle = _median(sample)
    usual = 4.0 * float(_median(np.abs(sample - middle).max(axis=1, keepdims=True))[0])
    far = 0 < usual and extent > _FAR * usual
    if far:
        center, extent = middle, usual
    if extent == 0:
        return center, 1.0, False
    scale = float(2.0 ** np.clip(np.ceil(np.log2(extent)), -1000, 1000))
    step = scale / 8
    with np.errstate(over="ignore", invalid="ignore"):
        snapped = np.rint(center / step) * step
    return np.where(np.isfinite(snapped), snapped, center), scale, far


def _ends(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates of positions (V, 3), NaN where one is NaN or there are none."""
    if len(vertices) == 0:
        return np.full(3, np.nan), np.full(3, np.nan)
    found = []
    for function in (np.min, np.max):
        parts = [function(part, axis=0).reshape(-1, 3) for part in _rows_together(vertices) if len(part)]
        found.append(function(np.concatenate(parts), axis=0))
    return found[0], found[1]


def _median(values: np.ndarray) -> np.ndarray:
    """Of each column of (N, C), the upper one of an even number."""
    half = len(values) // 2
    return np.partition(np.ascontiguousarray(values.T), half, axis=1)[:, half]


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
