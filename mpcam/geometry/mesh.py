"""Triangle meshes: arrays checked once, then read-only."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from mpcam.checks import shown
from mpcam.errors import InputError


@dataclass(frozen=True, eq=False)
class Material:
    """What a face looks like.

    color: linear RGB, 3 finite numbers >= 0. texture: (H, W, 3) float32 linear RGB, top row first, or None; it is
    multiplied with color. Raises InputError for anything else, 8-bit textures included (they are not linear).
    """

    color: tuple[float, float, float] = (0.8, 0.8, 0.8)
    texture: np.ndarray | None = None
    name: str = ""

    def __post_init__(self):
        color = _floats(self.color, "material color")
        if color.shape != (3,) or not np.all(np.isfinite(color)) or np.any(color < 0):
            raise InputError(f"material color is {shown(self.color)}: give 3 finite linear RGB numbers, none negative")
        object.__setattr__(self, "color", (float(color[0]), float(color[1]), float(color[2])))
        if self.texture is not None:
            texture = np.asarray(self.texture)
            if texture.dtype.kind != "f" or texture.ndim != 3 or texture.shape[2] != 3 or texture.size == 0:
                raise InputError(
                    f"material texture has shape {texture.shape} and type {texture.dtype}: give (H, W, 3) floats, "
                    "linear RGB (8-bit images: divide by 255 and undo the sRGB curve first)"
                )
            object.__setattr__(self, "texture", _frozen(texture, np.float32))


@dataclass(frozen=True, eq=False, init=False, repr=False)
class Mesh:
    """An indexed triangle mesh. All arrays are copied and read-only.

    vertices: (V, 3) float64. NaN and infinite vertices are allowed; their triangles are never hit.
    faces: (F, 3) int32 vertex numbers, counter-clockwise seen from outside.
    normals: (V, 3) float64 unit shading normals, or None: each face is shaded with its own normal, as it is at vertices
    whose normal is (0, 0, 0).
    uv: (V, 2) float64 texture coordinates, v up (OpenGL), or None.
    colors: (V, 3) float64 linear RGB that multiplies the material, or None.
    materials: one or more; face_material: (F,) int32 material number of each face, or None: all use the first.

    Lists are accepted, and so are meshes without faces or vertices. Raises InputError for wrong shapes, faces that are
    not integers or out of range, and material numbers out of range.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray | None
    uv: np.ndarray | None
    colors: np.ndarray | None
    materials: tuple[Material, ...]
    face_material: np.ndarray | None
    name: str
    parts: ClassVar[tuple[int, ...]] = ()
    """How many vertices each of the meshes has that this one was joined from."""

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        normals: ArrayLike | None = None,
        uv: ArrayLike | None = None,
        colors: ArrayLike | None = None,
        materials: Material | Sequence[Material] = (),
        face_material: ArrayLike | None = None,
        name: str = "",
    ):
        vertices = _table(vertices, 3, "vertices")
        faces = _integers(faces, "faces")
        if faces.size == 0 and faces.ndim < 3:
            faces = faces.reshape(0, 3)
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise InputError(f"faces have shape {faces.shape}: give (F, 3) vertex numbers, one row per triangle")
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            raise InputError(
                f"faces name vertices {faces.min()} to {faces.max()}, but there are {len(vertices)}: "
                f"vertex numbers start at 0 and end at {len(vertices) - 1}"
            )
        attributes = {"normals": (normals, 3), "uv": (uv, 2), "colors": (colors, 3)}
        checked = {
            key: None if value is None else _table(value, width, key) for key, (value, width) in attributes.items()
        }
        for key, value in checked.items():
            if value is not None and len(value) != len(vertices):
                raise InputError(f"{key} has {len(value)} rows, vertices {len(vertices)}: give one row per vertex")
        materials = (materials,) if isinstance(materials, Material) else tuple(materials) or (Material(),)
        if not all(isinstance(material, Material) for material in materials):
            raise InputError("materials holds something that is not a Material: give a tuple of mpcam Material objects")
        if face_material is not None:
            numbers = _integers(face_material, "face_material")
            if numbers.shape != (len(faces),):
                raise InputError(f"face_material has shape {numbers.shape}: give ({len(faces)},), one number per face")
            if numbers.size and (numbers.min() < 0 or numbers.max() >= len(materials)):
                raise InputError(
                    f"face_material names materials {numbers.min()} to {numbers.max()} of {len(materials)}: "
                    f"material numbers start at 0 and end at {len(materials) - 1}"
                )
            face_material = _frozen(numbers, np.int32)
        fields = {"vertices": vertices, "faces": _frozen(faces, np.int32), **checked}
        fields |= {"materials": materials, "face_material": face_material, "name": name}
        for key, value in fields.items():
            object.__setattr__(self, key, value)

    @property
    def triangle_count(self) -> int:
        return len(self.faces)

    @cached_property
    def corners(self) -> np.ndarray:
        """(F, 3, 3) float64: the three corner positions of each face."""
        return _read_only(self.vertices[self.faces])

    @cached_property
    def bounds(self) -> np.ndarray:
        """(2, 3) smallest and largest coordinates of the finite vertices; zeros if there are none."""
        finite = self.vertices[np.isfinite(self.vertices).all(axis=1)]
        if len(finite) == 0:
            return _read_only(np.zeros((2, 3)))
        return _read_only(np.stack([finite.min(axis=0), finite.max(axis=0)]))

    @cached_property
    def face_normals(self) -> np.ndarray:
        """(F, 3) unit geometric normals; (0, 0, 1) for faces without area and faces with NaN or infinite corners."""
        return _read_only(_unit(self._area_normals))

    @cached_property
    def _area_normals(self) -> np.ndarray:
        """(F, 3) normals with length proportional to area, scaled so that no mesh size under- or overflows."""
        a, b, c = self.corners[:, 0], self.corners[:, 1], self.corners[:, 2]
        with np.errstate(invalid="ignore", over="ignore"):
            e1, e2 = b - a, c - a
            usable = np.all(np.isfinite(e1) & np.isfinite(e2), axis=1)
            e1, e2 = np.where(usable[:, None], e1, 0.0), np.where(usable[:, None], e2, 0.0)
            scale = max(np.abs(e1).max(initial=0.0), np.abs(e2).max(initial=0.0))
            if scale > 0:
                e1, e2 = e1 / scale, e2 / scale
        return np.cross(e1, e2)

    @cached_property
    def follows_faces(self) -> np.ndarray:
        """(V,) whether the shading normal is that of the faces around, to float32, so that it can be made anew."""
        if self.normals is None:
            return np.ones(len(self.vertices), bool)
        near = np.abs(self.normals - self.smooth_normals()).max(axis=1, initial=0.0) <= 1e-6
        return near | ~self.normals.any(axis=1)

    def smooth_normals(self) -> np.ndarray:
        """(V, 3) unit vertex normals, the area-weighted mean over the faces of each vertex.

        Faces without area and faces with NaN corners weigh nothing; a vertex with no other face gets (0, 0, 1).
        """
        weights = self._area_normals
        index = self.faces.ravel()
        columns = [
            np.bincount(index, np.repeat(weights[:, axis], 3), minlength=len(self.vertices)) for axis in range(3)
        ]
        return _unit(np.stack(columns, axis=1))

    def transformed(self, matrix) -> "Mesh":
        """The mesh after the affine 4x4 matrix (world from mesh).

        Normals follow the surface. A mirroring matrix also reverses each face, so that outside stays outside.
        Raises InputError unless the matrix is a finite (4, 4) with last row 0 0 0 1.
        """
        matrix = _floats(matrix, "matrix")
        if matrix.shape != (4, 4) or not np.all(np.isfinite(matrix)) or not np.array_equal(matrix[3], (0, 0, 0, 1)):
            raise InputError("transform matrix is not affine: give a finite 4x4 with last row 0 0 0 1")
        linear = matrix[:3, :3]
        # a scaled copy, so that products of its entries neither overflow nor vanish
        even = linear / (np.abs(linear).max() or 1.0)
        mirrored = np.linalg.det(even) < 0
        with np.errstate(invalid="ignore", over="ignore"):
            vertices = self.vertices @ linear.T + matrix[:3, 3]
        normals = self.normals
        if normals is not None:
            # the cofactor matrix is the inverse transpose up to scale, and exists for flattening matrices too
            cofactor = np.cross(even[[1, 2, 0]], even[[2, 0, 1]])
            given = normals.any(axis=1, keepdims=True)
            normals = np.where(given, _unit(normals @ (-cofactor if mirrored else cofactor).T), 0.0)
        faces = self.faces[:, [0, 2, 1]] if mirrored else self.faces
        result = replace(self, vertices=vertices, faces=faces, normals=normals)
        object.__setattr__(result, "parts", self.parts)
        return result

    @staticmethod
    def concatenate(meshes, name: str = "") -> "Mesh":
        """One mesh with the faces of all, in order.

        Attributes that only some have are filled in: uv with 0, colors with 1, normals with (0, 0, 0), which stands for
        those of the faces. Raises InputError if something is not a Mesh.
        """
        meshes = tuple(meshes)
        for mesh in meshes:
            if not isinstance(mesh, Mesh):
                raise InputError(f"cannot concatenate a {type(mesh).__name__}: give Mesh objects")
        if not meshes:
            return Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32), name=name)
        if len(meshes) == 1:
            return replace(meshes[0], name=name or meshes[0].name)
        normals = uv = colors = None
        if any(mesh.normals is not None for mesh in meshes):
            tables = [np.zeros_like(m.vertices) if m.normals is None else m.normals for m in meshes]
            normals = np.concatenate(tables)
        if any(mesh.uv is not None for mesh in meshes):
            uv = np.concatenate([np.zeros((len(m.vertices), 2)) if m.uv is None else m.uv for m in meshes])
        if any(mesh.colors is not None for mesh in meshes):
            colors = np.concatenate([np.ones((len(m.vertices), 3)) if m.colors is None else m.colors for m in meshes])
        offsets = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
        materials: dict[int, tuple[int, Material]] = {}
        numbers = []
        for mesh in meshes:
            known = np.array([materials.setdefault(id(m), (len(materials), m))[0] for m in mesh.materials], np.int32)
            own = np.zeros(len(mesh.faces), np.int32) if mesh.face_material is None else mesh.face_material
            numbers.append(known[own])
        result = Mesh(
            np.concatenate([mesh.vertices for mesh in meshes]),
            np.concatenate([mesh.faces.astype(np.int64) + start for mesh, start in zip(meshes, offsets, strict=False)]),
            normals=normals,
            uv=uv,
            colors=colors,
            materials=tuple(material for _, material in materials.values()),
            face_material=np.concatenate(numbers) if len(materials) > 1 else None,
            name=name,
        )
        object.__setattr__(result, "parts", tuple(len(mesh.vertices) for mesh in meshes))
        return result

    def __repr__(self) -> str:
        return f"Mesh({self.name!r}, {len(self.vertices):,} vertices, {len(self.faces):,} triangles)"

    def flat(self) -> "Mesh":
        """The mesh with three vertices of its own per face, and the faces' normals as shading normals."""
        index = self.faces.ravel()
        return replace(
            self,
            vertices=self.vertices[index],
            faces=np.arange(len(index), dtype=np.int32).reshape(-1, 3),
            normals=np.repeat(self.face_normals, 3, axis=0),
            uv=None if self.uv is None else self.uv[index],
            colors=None if self.colors is None else self.colors[index],
        )


def _read_only(array: np.ndarray) -> np.ndarray:
    array.flags.writeable = False
    return array


def _frozen(array, dtype) -> np.ndarray:
    """A read-only array of that type: a copy, unless it is read-only already and owns its memory."""
    if isinstance(array, np.ndarray) and array.dtype == dtype and not array.flags.writeable and array.flags.owndata:
        return array
    return _read_only(np.array(array, dtype=dtype, order="C"))


def _floats(value, name: str) -> np.ndarray:
    try:
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is not an array of numbers: give a rectangular array of floats") from None


def _integers(value, name: str) -> np.ndarray:
    try:
        array = np.asarray(value)
    except ValueError:
        raise InputError(f"{name} has rows of different lengths: give a rectangular array of integers") from None
    if array.size == 0:
        return array.astype(np.int64)
    if array.dtype.kind not in "iu":
        raise InputError(f"{name} has type {array.dtype}: give integers, e.g. numpy.asarray({name}, dtype=int)")
    return array


def _table(value, width: int, name: str) -> np.ndarray:
    array = _frozen(value if isinstance(value, np.ndarray) and value.dtype == float else _floats(value, name), float)
    if array.size == 0 and array.ndim < 3:
        return _read_only(np.zeros((0, width)))
    if array.ndim != 2 or array.shape[1] != width:
        raise InputError(f"{name} has shape {array.shape}: give (V, {width}), one row per vertex")
    return array


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Rows scaled to length 1; (0, 0, 1) where that is impossible."""
    with np.errstate(invalid="ignore", over="ignore"):
        largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0.0)
        usable = np.isfinite(largest) & (largest > 0)
        scaled = np.where(usable, vectors, (0.0, 0.0, 1.0)) / np.where(usable, largest, 1.0)
    return scaled / np.sqrt((scaled * scaled).sum(axis=1, keepdims=True))
