"""Plain shapes for tests and first tries: sphere, plane, cube, and a room seen from the inside."""

import numpy as np

from mpcam.geometry.mesh import Material, Mesh
from mpcam.geometry.shapes import MeshPart, join, surface, to_mesh
from mpcam.geometry.textures import rgb


def sphere(triangles: int) -> Mesh:
    """Icosphere of radius 1 around the origin: 20 * 4**k triangles, k from 0 to 8, the nearest (by ratio)."""
    level = int(np.clip(np.rint(np.log(triangles / 20) / np.log(4)), 0, 8))
    golden = (1 + 5**0.5) / 2
    points = []
    for a in (-1.0, 1.0):
        for b in (-golden, golden):
            points += [(0, a, b), (a, b, 0), (b, 0, a)]
    vertices = np.array(points) / np.hypot(1, golden)
    distance = np.linalg.norm(vertices[:, None] - vertices[None], axis=2)
    near = distance < 1.2 * distance[distance > 0].min()
    faces = [
        (i, j, k) for i in range(12) for j in range(i) for k in range(j) if near[i, j] and near[j, k] and near[i, k]
    ]
    faces = np.array(faces)
    corners = vertices[faces]
    inward = (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) * corners[:, 0]).sum(axis=1) < 0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    for _ in range(level):
        vertices, faces = _split(vertices, faces)
    return Mesh(vertices, faces, normals=vertices, materials=(Material(rgb("#c8d4e0")),), name="sphere")


def _split(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each face into four; new vertices on the unit sphere, shared between neighbors."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    keys = edges.min(axis=1).astype(np.int64) * len(vertices) + edges.max(axis=1)
    unique, inverse = np.unique(keys, return_inverse=True)
    middle = vertices[unique // len(vertices)] + vertices[unique % len(vertices)]
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    ab, bc, ca = (inverse.reshape(-1) + len(vertices)).reshape(3, -1)
    a, b, c = faces.T
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([vertices, middle]), np.stack([np.stack(f, axis=1) for f in four], axis=1).reshape(-1, 3)


def _sheet(corner, along, up, pieces: int) -> MeshPart:
    """A square sheet of pieces x pieces cells, seen from the side where along x up points."""
    v, u = np.meshgrid(np.linspace(0, 1, pieces + 1), np.linspace(0, 1, pieces + 1), indexing="ij")
    corner, along, up = (np.asarray(a, dtype=np.float64) for a in (corner, along, up))
    points = corner + u[:, :, None] * along + v[:, :, None] * up
    return surface(
        points, normals=np.broadcast_to(np.cross(along, up) / np.linalg.norm(np.cross(along, up)), points.shape)
    )


def plane(triangles: int) -> Mesh:
    """The square -1 to 1 in x and y at z = 0, seen from above: 2 n**2 triangles, the nearest."""
    pieces = max(round((triangles / 2) ** 0.5), 1)
    return to_mesh([(_sheet((-1, -1, 0), (2, 0, 0), (0, 2, 0), pieces), Material(rgb("#d8d0c0")))], "plane")


def cube(triangles: int) -> Mesh:
    """The cube -1 to 1, seen from outside: 12 n**2 triangles, the nearest."""
    pieces = max(round((triangles / 12) ** 0.5), 1)
    parts = []
    for axis in range(3):
        for side in (-1.0, 1.0):
            first, second = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            first, second = (first, second) if side > 0 else (second, first)
            parts.append(_sheet(side * np.eye(3)[axis] - first - second, 2 * first, 2 * second, pieces))
    return to_mesh([(join(parts), Material(rgb("#d09060")))], "cube")


def quad_room(triangles: int) -> Mesh:
    """A room 6 x 6 m and 3 m high with its floor at z = 0, seen from inside: 12 n**2 triangles, the nearest.

    Each side has a color of its own: red and green walls at +x and -x, blue and yellow at +y and -y.
    """
    pieces = max(round((triangles / 12) ** 0.5), 1)
    x, y, z = np.diag((6.0, 6.0, 3.0))
    sides = [
        ("#c04030", (3, 3, 0), -y, z),
        ("#40a050", (-3, -3, 0), y, z),
        ("#3060c0", (-3, 3, 0), x, z),
        ("#d8b030", (3, -3, 0), -x, z),
        ("#909090", (-3, -3, 0), x, y),
        ("#e8e8e0", (-3, -3, 3), y, x),
    ]
    parts = [(_sheet(corner, along, up, pieces), Material(rgb(code))) for code, corner, along, up in sides]
    return to_mesh(parts, "quad_room")
