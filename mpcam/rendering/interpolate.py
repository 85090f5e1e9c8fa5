"""Attributes of the mesh at the hits."""

import numpy as np

from mpcam.errors import InputError
from mpcam.rendering.hits import Hits


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
