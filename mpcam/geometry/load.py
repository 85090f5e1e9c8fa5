"""Mesh files: OBJ, PLY, STL, glTF and GLB."""

import os
import struct
import warnings
from dataclasses import replace
from pathlib import Path

from mpcam.checks import shown
from mpcam.errors import InputError
from mpcam.geometry.load_gltf import load_gltf
from mpcam.geometry.load_obj import load_obj
from mpcam.geometry.load_ply import load_ply
from mpcam.geometry.load_stl import load_stl
from mpcam.geometry.mesh import Mesh

_READERS = {".obj": load_obj, ".ply": load_ply, ".stl": load_stl, ".gltf": load_gltf, ".glb": load_gltf}
FORMATS = tuple(_READERS)
# what reading a damaged file may raise, besides OSError and what readers say themselves
_DAMAGED = (ValueError, LookupError, TypeError, AttributeError, ArithmeticError, MemoryError, struct.error)


def load_mesh(path: str | os.PathLike) -> Mesh:
    """Reads a mesh file: .obj, .ply, .stl, .gltf or .glb.

    Every face is kept, also those without area; polygons become triangles; several meshes in one file are put together,
    each where its nodes place it, in the file's axes and units. Normals and uv are set where the file has them. Vertex
    colors and textures become linear (color numbers of glTF and MTL are linear already). What a file holds and the mesh
    has not is a UserWarning. Raises InputError for files that are missing, empty, of another kind, damaged or without
    faces, and for those that need what is not read.
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
    said: list[str] = []
    try:
        if path.stat().st_size == 0:
            raise InputError(f"{path} is empty: 0 bytes; write the mesh again")
        mesh = _READERS[kind](path, said.append)
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror or type(error).__name__}") from None
    except InputError:
        raise
    except _DAMAGED as error:
        why = f" ({error})" if type(error) is ValueError and str(error) else ""
        raise InputError(
            f"{path} is not a readable {kind[1:].upper()} file: it is damaged or of another kind{why}"
        ) from None
    for text in dict.fromkeys(said):
        warnings.warn(f"{path}: {text}", UserWarning, stacklevel=2)
    if mesh.triangle_count == 0:
        raise InputError(f"{path} holds no triangles: point clouds and lines are not meshes, give a file with faces")
    return replace(mesh, name=path.stem)
