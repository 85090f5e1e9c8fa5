"""Meshes of reflectors as people bring them: which faces count, which vertices are one, which way normals look."""

import numpy as np

from mpcam.geometry.mesh import Mesh

_CLOSE = 1e-9
"""Vertices nearer than this part of the reflector's size are one."""
_ALIKE = float(np.cos(np.radians(1.0)))


def has_area(corners: np.ndarray) -> np.ndarray:
    """(F,) whether triangles (F, 3, 3) have an area, against the rounding of their own edges."""
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    longest = np.maximum(np.abs(e1).max(axis=1), np.abs(e2).max(axis=1))
    scale = np.where(longest > 0, longest, 1.0)[:, None]
    return np.linalg.norm(np.cross(e1 / scale, e2 / scale), axis=1) > 1e-14


def area_normals(corners: np.ndarray, size: float) -> np.ndarray:
    """(F, 3) normals as long as twice the areas, in units of a size."""
    with np.errstate(invalid="ignore", over="ignore"):
        e1, e2 = ((corners[:, i] - corners[:, 0]) / size for i in (1, 2))
        return np.cross(e1, e2)


def place_numbers(places: np.ndarray, usable: np.ndarray, faces: np.ndarray, size: float) -> np.ndarray:
    """(V,) number of the place of each vertex; vertices nearer than _CLOSE have the same, and unused ones the first."""
    used = np.unique(faces[usable])
    _, number = np.unique(np.rint(places[used] / (_CLOSE * size)), axis=0, return_inverse=True)
    result = np.zeros(len(places), np.int64)
    result[used] = number.ravel()
    return result


def usable_normals(mesh: Mesh, faces: np.ndarray, area_normals: np.ndarray) -> np.ndarray:
    """The mesh's unit normals to the side that its faces (F, 3) look to, and theirs where it has none that is usable.

    Which side is of no account for a mirror or an interface; but between normals of both sides there is none.
    """
    assert mesh.normals is not None
    index = faces.ravel()
    sums = [np.bincount(index, np.repeat(area_normals[:, i], 3), minlength=len(mesh.vertices)) for i in range(3)]
    own = np.stack(sums, axis=1)
    with np.errstate(invalid="ignore"):
        length = np.linalg.norm(mesh.normals, axis=1, keepdims=True)
        bad = ~(np.isfinite(length) & (length > 1e-12))
        given = mesh.normals / np.where(bad, 1.0, length)
    side = np.where((np.where(bad, 0.0, given) * own).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)
    own_length = np.linalg.norm(own, axis=1, keepdims=True)
    own = np.where(own_length > 0, own / np.where(own_length > 0, own_length, 1.0), (0.0, 0.0, 1.0))
    return np.where(bad, own, side * np.where(bad, 0.0, given))


def welded(
    places: np.ndarray, group: np.ndarray, faces: np.ndarray, normals: np.ndarray | None, usable: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, normals and faces with one vertex where places, by number, and normals to a degree, are the same."""
    if normals is None:
        merged = np.zeros((group.max() + 1, 3))
        used = np.unique(faces[usable])
        merged[group[used]] = places[used]
        joined = group[faces]
        return merged, Mesh(merged, joined[usable]).smooth_normals(), joined.astype(np.int32)
    number, left, count = np.full(len(group), -1), np.arange(len(group)), 0
    while len(left):
        # The first vertex of each place, with all there that have its normal.
        groups, first = np.unique(group[left], return_index=True)
        leader = np.zeros(group.max() + 1, np.int64)
        leader[groups] = left[first]
        lead = leader[group[left]]
        same = ((normals[left] * normals[lead]).sum(axis=1) >= _ALIKE) | (left == lead)
        order = np.zeros(group.max() + 1, np.int64)
        order[groups] = np.arange(count, count + len(groups))
        number[left[same]] = order[group[left[same]]]
        left, count = left[~same], count + len(groups)
    vertices, joined = np.zeros((count, 3)), np.zeros((count, 3))
    vertices[number], joined[number] = places, normals
    return vertices, joined, number[faces].astype(np.int32)
