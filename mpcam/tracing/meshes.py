"""Meshes as Mitsuba shapes; the one place that knows the names of Mitsuba's mesh parameters (they change in 3.10)."""

from typing import Any

import numpy as np

POSITIONS, FACES, NORMALS, TEXCOORDS = "vertex_positions", "faces", "vertex_normals", "vertex_texcoords"


def mitsuba_mesh(
    mi: Any,
    name: str,
    positions: Any,
    faces: Any,
    *,
    normals: np.ndarray | None = None,
    uv: np.ndarray | None = None,
    bsdf: dict[str, Any] | None = None,
) -> Any:
    """A Mitsuba mesh from flat Dr.Jit or (N, 3) NumPy positions and faces; diffuse gray unless a BSDF is given."""
    flat_positions, flat_faces = _flat(mi.Float, positions), _flat(mi.UInt32, faces)
    counts = (len(flat_positions) // 3, len(flat_faces) // 3)
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(bsdf or {"type": "diffuse"})
    mesh = mi.Mesh(
        name, *counts, has_vertex_normals=normals is not None, has_vertex_texcoords=uv is not None, props=properties
    )
    parameters = mi.traverse(mesh)
    parameters[POSITIONS], parameters[FACES] = flat_positions, flat_faces
    if normals is not None:
        parameters[NORMALS] = _flat(mi.Float, normals)
    if uv is not None:
        parameters[TEXCOORDS] = _flat(mi.Float, uv)
    parameters.update()
    return mesh


def move(parameters: Any, key: str, positions: Any) -> None:
    """New positions of a mesh in a scene whose parameters were traversed; the tree is rebuilt."""
    parameters[key] = positions
    parameters.update()


def position_key(parameters: Any) -> str:
    """Name of the positions of the only mesh among a scene's parameters."""
    return next(key for key in parameters.keys() if key.endswith(POSITIONS))


def _flat(kind: Any, values: Any) -> Any:
    """Anything to a flat Dr.Jit array of a kind."""
    if type(values).__module__.startswith("drjit"):
        return kind(values)
    numbers = np.asarray(values)
    return kind(np.ascontiguousarray(numbers.ravel(), np.uint32 if numbers.dtype.kind in "iu" else np.float32))
