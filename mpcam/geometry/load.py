"""Mesh files: OBJ, PLY, STL, glTF and GLB."""

import json
import os
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from mpcam.checks import shown
from mpcam.errors import InputError
from mpcam.geometry.load_image import linear_texture
from mpcam.geometry.load_obj import load_obj
from mpcam.geometry.mesh import Material, Mesh
from mpcam.math.srgb import linear_from_srgb

FORMATS = (".obj", ".ply", ".stl", ".gltf", ".glb")
_COMPRESSION = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")


def load_mesh(path: str | os.PathLike) -> Mesh:
    """Reads a mesh file: .obj, .ply, .stl, .gltf or .glb.

    Every face is kept, also those without area; polygons become triangles; several meshes in one file are put together,
    each where its nodes place it, in the file's axes and units. Normals and uv are set where the file has them. Vertex
    colors and textures become linear (color numbers of glTF and MTL are linear already). Raises InputError for files
    that are missing, empty, of another kind, damaged or without faces.
    """
    try:
        path = Path(path)
    except TypeError:
        raise InputError(f"mesh path is {shown(path)}: give a file name, as str or Path") from None
    kind = path.suffix.lower()
    if path.is_dir():
        raise InputError(f"{path} is a folder: give a mesh file ({' '.join(FORMATS)})")
    if not path.exists():
        raise InputError(f"{path} does not exist: check the name and the folder")
    if kind not in FORMATS:
        raise InputError(f"{path} has the ending {kind or 'none'}: mesh files are {' '.join(FORMATS)}")
    try:
        empty = path.stat().st_size == 0
        mesh = None if empty else load_obj(path) if kind == ".obj" else _load_with_trimesh(path, kind)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or type(error).__name__}") from None
    if mesh is None:
        raise InputError(f"{path} is empty: 0 bytes; write the mesh again")
    if mesh.triangle_count == 0:
        raise InputError(f"{path} holds no triangles: point clouds and lines are not meshes, give a file with faces")
    return replace(mesh, name=path.stem)


def _load_with_trimesh(path: Path, kind: str) -> Mesh:
    import trimesh
    from trimesh.exchange.stl import HeaderError

    gltf = kind in (".gltf", ".glb")
    # what the parsers raise on damaged files, besides OSError
    damaged = (ValueError, LookupError, TypeError, AttributeError, NameError)
    damaged += (ArithmeticError, AssertionError, EOFError, MemoryError, NotImplementedError, struct.error, HeaderError)
    try:
        if gltf:
            _check_gltf(path, kind)
        elif kind == ".stl":
            _check_stl(path.read_bytes())
        scene = trimesh.load_scene(str(path), process=False)
        parts = []
        converted = {}
        for node in scene.graph.nodes_geometry:
            matrix, name = scene.graph[str(node)]
            geometry = scene.geometry[name]
            if isinstance(geometry, trimesh.Trimesh):
                if name not in converted:
                    converted[name] = _convert(geometry, srgb=not gltf)
                parts.append(converted[name].transformed(matrix))
        whole = Mesh.concatenate(parts)
        if kind == ".ply" and whole.triangle_count < _ply_face_count(path.read_bytes()):
            raise ValueError("faces are missing")
    except InputError:
        raise
    except damaged:
        raise InputError(
            f"{path} is not a readable {kind[1:].upper()} file: it is damaged or of another kind"
        ) from None
    return whole


def _check_gltf(path: Path, kind: str) -> None:
    """Raises InputError for what trimesh would skip in silence: triangle fans and compressed geometry."""
    data = path.read_bytes()
    if kind == ".glb":
        if data[:4] != b"glTF":
            raise ValueError("not a GLB header")
        length = struct.unpack_from("<I", data, 12)[0]
        data = data[20 : 20 + length]
    header = json.loads(data)
    for name in _COMPRESSION:
        if name in header.get("extensionsRequired", []):
            raise InputError(f"{path} is compressed with {name}: export it again without compression")
    for mesh in header.get("meshes", []):
        if any(primitive.get("mode", 4) == 6 for primitive in mesh["primitives"]):
            raise InputError(f"{path} holds triangle fans: export it again as plain triangles")


def _ply_face_count(data: bytes) -> int:
    """How many polygons the header promises: trimesh reads a text file that was cut off as far as it goes."""
    header = data[: data.find(b"end_header")]
    counts = [line.split()[2] for line in header.splitlines() if line.split()[:2] == [b"element", b"face"]]
    return int(counts[0]) if counts else 0


def _check_stl(data: bytes) -> None:
    """Raises ValueError for a file that was cut off, which trimesh would read in part or as empty."""
    binary = len(data) >= 84 and len(data) == 84 + 50 * struct.unpack_from("<I", data, 80)[0]
    if not binary and (b"facet" not in data or b"endsolid" not in data):
        raise ValueError("neither a whole binary nor a whole text file")


def _convert(geometry, srgb: bool) -> Mesh:
    """A trimesh.Trimesh as a Mesh. srgb: vertex colors are encoded so (in glTF they are linear)."""
    visual = geometry.visual
    normals = None
    if "vertex_normals" in geometry._cache.cache:
        normals = np.array(geometry.vertex_normals, dtype=np.float64)
        length = np.linalg.norm(normals, axis=1, keepdims=True)
        usable = np.isfinite(length) & (length > 0)
        plain = Mesh(geometry.vertices, geometry.faces)
        normals = np.where(usable, normals / np.where(usable, length, 1.0), plain.smooth_normals())
    uv, color, material, per_face = None, None, Material(), False
    if visual.kind == "texture":
        if visual.uv is not None and len(visual.uv) == len(geometry.vertices):
            uv = np.asarray(visual.uv)[:, :2]
        material = _material(visual.material)
        color = visual.vertex_attributes.get("color", geometry.vertex_attributes.get("color"))
    elif visual.kind == "vertex":
        color = visual.vertex_colors
    elif visual.kind == "face":
        color, per_face = visual.face_colors, True
    mesh = Mesh(geometry.vertices, geometry.faces, normals=normals, uv=uv, materials=(material,))
    if color is None or len(color) != (len(mesh.faces) if per_face else len(mesh.vertices)):
        return mesh
    color = np.asarray(color)[:, :3]
    color = color / np.iinfo(color.dtype).max if color.dtype.kind in "iu" else color
    color = linear_from_srgb(color) if srgb else color
    # colors alone are the color, not a tint of gray
    material = Material((1.0, 1.0, 1.0)) if visual.kind != "texture" else material
    if per_face:
        return replace(mesh.flat(), normals=None, colors=np.repeat(color, 3, axis=0), materials=(material,))
    return replace(mesh, colors=color, materials=(material,))


def _material(material) -> Material:
    """A trimesh material (of glTF, or the plain one of a PLY texture)."""
    factor = getattr(material, "baseColorFactor", None)
    image = getattr(material, "baseColorTexture", None) or getattr(material, "image", None)
    color = (1.0, 1.0, 1.0) if factor is None else tuple(float(value) / 255.0 for value in factor[:3])
    texture = None if image is None else linear_texture(image)
    return Material((color[0], color[1], color[2]), texture, str(getattr(material, "name", None) or ""))
