"""Meshes that move: the same faces with vertices elsewhere, and what becomes of the shading normals."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from mpcam.checks import shown
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.math.pose import as_pose

Normals = Callable[[], np.ndarray | None]


class MovedMesh(Mesh):
    """A mesh of which only vertices and normals differ from those of `base`, so that all else may be shared."""

    base: ClassVar[Mesh | None] = None
    _rule: tuple[Normals]

    @cached_property
    def normals(self) -> np.ndarray | None:  # pyright: ignore[reportIncompatibleVariableOverride]
        """As of a Mesh; worked out when first asked for. Raises InputError where they are not known."""
        return self._rule[0]()


def _made(base: Mesh, vertices: np.ndarray, normals: Normals) -> MovedMesh:
    """Without the checks of Mesh, which the base has passed, and without normals until they are asked for."""
    result, shared = object.__new__(MovedMesh), ("faces", "uv", "colors", "materials", "face_material", "name", "parts")
    vertices.flags.writeable = False
    fields = {"base": base, "vertices": vertices, "_rule": (normals,), **{name: getattr(base, name) for name in shared}}
    for key, value in fields.items():
        object.__setattr__(result, key, value)
    return result


def moved(mesh: Mesh, vertices: Any = None, normals: Any = None, transform: Any = None) -> Mesh:
    """The mesh with its vertices elsewhere.

    vertices: (V, 3) new positions, world frame; or a sequence with one (Vi, 3) for each mesh that it was joined from
    (of a Scene: its meshes in order), None for those that stay. normals: (V, 3) unit shading normals to go with them,
    or such a sequence. transform: instead of vertices, a rigid 4x4 matrix (world from the mesh as it was given), or a
    sequence of them; normals turn with it. Without normals or transform they are those of the faces where the mesh has
    none, made anew by `Mesh.smooth_normals` where the mesh's are equal to those of its faces, and otherwise not known:
    whatever asks for them then raises InputError. Raises InputError for other shapes and matrices.
    """
    if (vertices is None) == (transform is None):
        raise InputError("give either vertices=, new positions, or transform=, a rigid 4x4 matrix")
    if transform is not None:
        if normals is not None:
            raise InputError("normals= goes with vertices=: with transform= the mesh's own normals turn")
        return _carried(mesh, transform)
    places = _table(mesh, vertices, mesh.vertices, "vertices")
    if normals is not None:
        given = _table(mesh, normals, np.zeros_like(mesh.vertices) if mesh.normals is None else mesh.normals, "normals")
        return _made(mesh, places, lambda: given)
    return _made(mesh, places, lambda: _after(mesh, places))


def part_of(mesh: Mesh, base: Mesh, rows: Sequence[slice]) -> Mesh:
    """A mesh with its vertices, and normals, where they are in some rows of another, which it is a part of."""

    def cut(table: np.ndarray) -> np.ndarray:
        return table[rows[0]] if len(rows) == 1 else np.concatenate([table[span] for span in rows])

    def normals() -> np.ndarray | None:
        return None if mesh.normals is None or base.normals is None else cut(mesh.normals)

    return _made(base, cut(mesh.vertices), normals)


def begun_anew(mesh: Mesh, first: Mesh) -> Mesh:
    """The mesh with its first vertices, and their normals, where another mesh has them."""
    count, places = len(first.vertices), np.array(mesh.vertices)
    places[:count] = first.vertices

    def normals() -> np.ndarray | None:
        if mesh.normals is None:
            return None
        result = np.array(mesh.normals)
        result[:count] = 0.0 if first.normals is None else first.normals
        return result

    return _made(mesh, places, normals)


def _after(mesh: Mesh, vertices: np.ndarray) -> np.ndarray | None:
    """Shading normals of a mesh after its vertices moved."""
    if mesh.normals is None:
        return None
    normals, bent = np.array(mesh.normals), []
    for span in _spans(mesh):
        turn = _rotation(mesh.vertices[span], vertices[span])
        if turn is None:
            bent.append(span)
        else:
            normals[span] = normals[span] if np.array_equal(turn, np.eye(3)) else normals[span] @ turn.T
    if not bent:
        return normals
    smooth = Mesh(vertices, mesh.faces).smooth_normals()
    for span in bent:
        if not mesh.follows_faces[span].all():
            raise InputError(
                "the vertices moved, and the mesh's normals were given, not made from its faces, so they are not known "
                "any more: pass update(vertices, normals=...) or update(transform=...), or shade by 'color'"
            )
        given = mesh.normals[span].any(axis=1, keepdims=True)
        normals[span] = np.where(given, smooth[span], 0.0)
    return normals


def _rotation(before: np.ndarray, after: np.ndarray) -> np.ndarray | None:
    """The rotation (3, 3) of a rigid motion between positions (N, 3), to rounding; None where they were bent."""
    with np.errstate(invalid="ignore"):
        usable = np.isfinite(before - after).all(axis=1)
    a, b = before[usable], after[usable]
    if len(a) == 0:
        return np.eye(3)
    size = float(np.abs(a - a.mean(axis=0)).max())
    tolerance = 1e-12 * size + 1e-15 * float(max(np.abs(a).max(), np.abs(b).max()))
    if np.ptp(b - a, axis=0).max() <= tolerance:
        return np.eye(3)
    a, b = a - a.mean(axis=0), b - b.mean(axis=0)
    left, _, right = np.linalg.svd(a.T @ b)
    # Of a flat part the third axis is free: it is the one that makes a rotation.
    turn = (left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right).T
    return turn if np.abs(a @ turn.T - b).max() <= 1e3 * tolerance else None


def _carried(mesh: Mesh, transform: Any) -> Mesh:
    """The mesh after a rigid transform, or each part after its own."""
    several = isinstance(transform, (list, tuple)) and any(one is None or np.ndim(one) == 2 for one in transform)
    matrices = _one_each(mesh, transform, "transform") if several else [transform] * len(_spans(mesh))
    vertices = np.array(mesh.vertices)
    normals = None if mesh.normals is None else np.array(mesh.normals)
    for span, matrix in zip(_spans(mesh), matrices, strict=True):
        if matrix is None:
            continue
        part = Mesh(mesh.vertices[span], np.zeros((0, 3), int), None if normals is None else normals[span])
        part = part.transformed(as_pose(matrix))
        vertices[span] = part.vertices
        if normals is not None:
            normals[span] = part.normals
    return _made(mesh, vertices, lambda: normals)


def _spans(mesh: Mesh) -> list[slice]:
    """The rows of each part."""
    ends = np.cumsum(mesh.parts or (len(mesh.vertices),))
    return [slice(end - count, end) for end, count in zip(ends, mesh.parts or ends, strict=True)]


def _one_each(mesh: Mesh, values: Sequence[Any], name: str) -> Sequence[Any]:
    count = len(_spans(mesh))
    if len(values) != count:
        raise InputError(f"{name} holds {len(values)} entries, and there are {count} meshes: give one each, or None")
    return values


def _table(mesh: Mesh, values: Any, before: np.ndarray, name: str) -> np.ndarray:
    """(V, 3) float64 from one array, or from one for each part."""
    if isinstance(values, (list, tuple)) and any(one is None or np.ndim(one) == 2 for one in values):
        parts = [
            before[span] if one is None else _rows(one, span.stop - span.start, f"{name}[{number}]")
            for number, (span, one) in enumerate(zip(_spans(mesh), _one_each(mesh, values, name), strict=True))
        ]
        return np.concatenate(parts)
    return _rows(values, len(mesh.vertices), name, mesh)


def _rows(values: Any, count: int, name: str, mesh: Mesh | None = None) -> np.ndarray:
    """A copy: what the caller does with the array afterwards is none of ours."""
    try:
        table = np.array(values, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is {shown(values)}: give numbers of shape ({count}, 3)") from None
    if table.shape != (count, 3):
        hint = ""
        if mesh is not None and len(mesh.parts) > 1:
            hint = f", or a list with one array for each of its {len(mesh.parts)} meshes"
        raise InputError(f"{name} has shape {table.shape}: give ({count}, 3), as the mesh has{hint}")
    return table
