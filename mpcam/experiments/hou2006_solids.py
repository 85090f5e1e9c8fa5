"""Plain solids of few triangles, or of as many as wanted, for the scenes after Hou et al. 2006.

Each fills the cube from -0.5 to 0.5: corners (V, 3), faces (F, 3). Those that stand on the ground have no bottom.
"""

from typing import Any

import numpy as np

from mpcam.geometry.mesh import Mesh
from mpcam.geometry.plain import sphere
from mpcam.geometry.shapes import MeshPart, unit

Solid = tuple[np.ndarray, np.ndarray]


def box() -> Solid:
    corners = np.array([[(k >> axis & 1) - 0.5 for axis in range(3)] for k in range(8)])
    sides = np.array([(2, 0, 4, 6), (1, 3, 7, 5), (0, 1, 5, 4), (3, 2, 6, 7), (4, 5, 7, 6)])
    return corners, np.concatenate([sides[:, [0, 1, 2]], sides[:, [0, 2, 3]]])


def octahedron() -> Solid:
    corners = 0.5 * np.array([(1.0, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
    return corners, np.array([(i, (i + 1) % 4, 4) for i in range(4)] + [((i + 1) % 4, i, 5) for i in range(4)])


def ball(pieces: int = 1) -> Solid:
    """An icosahedron, or one whose faces are split, round."""
    mesh = sphere(20 * pieces * pieces)
    return 0.5 * mesh.vertices, mesh.faces


def _ring(sides: int) -> np.ndarray:
    around = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    return 0.5 * np.stack([np.cos(around), np.sin(around)], axis=1)


def prism(sides: int) -> Solid:
    ring = _ring(sides)
    corners = np.concatenate([np.c_[ring, np.full(sides, -0.5)], np.c_[ring, np.full(sides, 0.5)]])
    i = np.arange(sides)
    j = (i + 1) % sides
    top = [(sides, sides + k, sides + k + 1) for k in range(1, sides - 1)]
    return corners, np.concatenate([np.c_[i, j, j + sides], np.c_[i, j + sides, i + sides], top])


def cone(sides: int) -> Solid:
    corners = np.concatenate([np.c_[_ring(sides), np.full(sides, -0.5)], [(0, 0, 0.5)]])
    return corners, np.array([(i, (i + 1) % sides, sides) for i in range(sides)])


def plane(low: Any, high: Any, pieces: int, z: float = 0.0) -> MeshPart:
    """A level rectangle of 2 pieces^2 triangles; uv in meters."""
    (x, y), (right, far) = low, high
    corners = np.array([(x, y, z), (right, y, z), (right, far, z), (x, far, z)])
    part = _pieces(corners[[(0, 1, 2), (0, 2, 3)]].astype(float), pieces)
    flat = part.reshape(-1, 3)
    up = np.broadcast_to((0.0, 0.0, 1.0), flat.shape)
    return MeshPart(flat, np.arange(len(flat)).reshape(-1, 3), up, flat[:, :2])


def _pieces(corners: np.ndarray, count: int) -> np.ndarray:
    """Triangles (F, 3, 3), each in count^2."""
    steps = [(i, j) for i in range(count) for j in range(count - i)]
    up = [((i, j), (i + 1, j), (i, j + 1)) for i, j in steps]
    down = [((i + 1, j), (i + 1, j + 1), (i, j + 1)) for i, j in steps if i + j < count - 1]
    at = np.array(up + down) / count  # (count^2, 3, 2)
    weights = np.concatenate([1 - at.sum(-1, keepdims=True), at], axis=-1)
    return np.einsum("pkc,fcx->fpkx", weights, corners).reshape(-1, 3, 3)


def placed(solid: Solid, place: Any, size: Any, turn: float, pieces: int = 1, soft: float = 0.0) -> MeshPart:
    """A solid of a size, turned about z, at a place; soft: from 0, flat faces, to 1, an ellipsoid. uv in meters."""
    corners = _pieces(solid[0][solid[1]], pieces)
    normals = np.repeat(
        unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))[:, None], 3, axis=1
    )
    flat = normals
    if soft:
        ball = 0.5 * unit(corners)
        corners = corners + soft * (ball - corners)
        normals = _smoothed(corners)
    corners, normals = corners * size, unit(normals / size)
    axis = np.abs(flat[:, 0]).argmax(-1)
    uv = np.stack(
        [corners[np.arange(len(axis)), :, (axis == 0) * 1], corners[np.arange(len(axis)), :, 2 - (axis == 2)]], -1
    )
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.array([(c, -s, 0), (s, c, 0), (0, 0, 1)])
    points = (corners @ matrix.T + place).reshape(-1, 3)
    return MeshPart(
        points, np.arange(len(points)).reshape(-1, 3), (normals @ matrix.T).reshape(-1, 3), uv.reshape(-1, 2)
    )


def _smoothed(corners: np.ndarray) -> np.ndarray:
    """Mean normals (F, 3, 3) of the triangles (F, 3, 3) that meet at each corner."""
    flat = corners.reshape(-1, 3)
    _, number = np.unique(np.round(flat, 9), axis=0, return_inverse=True)
    mesh = Mesh(flat, np.arange(len(flat)).reshape(-1, 3))
    sums = np.zeros((number.max() + 1, 3))
    np.add.at(sums, number.ravel(), np.repeat(mesh.face_normals, 3, axis=0))
    return unit(sums[number.ravel()]).reshape(corners.shape)
