"""Vertices in the middle of edges, put on the true surface: camera triangles of degree 2, and each one in four."""

import dataclasses

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.triangle_nodes import EDGES, corners_only, mixed
from mpcam.decomposition.border import Border
from mpcam.decomposition.reflector import Reflector
from mpcam.decomposition.shooting import neighbors, shoot
from mpcam.errors import InputError

_NEAR = 1e-3
"""Part of the radius that vertices on a border may be off it."""


def quadratic(cams: CameraTriangles, reflector: Reflector | None = None) -> CameraTriangles:
    """Camera triangles of degree 2 with the corners of those given, of degree 1.

    reflector: with it the vertices on the edges lie on the true surface, beside the middle of the edge, on the border
    where the edge is one, and have its normals; without it the rays are those of `cams`. Raises InputError for
    ray_scale "plane", which has seams, and with a reflector for camera triangles that have directions.
    """
    if cams.degree > 1:
        raise InputError("quadratic: these camera triangles are of degree 2 already")
    if cams.linear:
        raise InputError("quadratic: ray_scale='plane' has a ray of its own for each triangle: give another")
    if cams.normals is None:
        if reflector is not None:
            raise InputError("quadratic: give camera triangles with normals, and see directions_at_vertices")
        values = np.array(cams.directions)
        if cams.ray_scale == "unit":
            values /= np.linalg.norm(values, axis=1, keepdims=True)
        changed = {"directions": values, "ray_scale": "near_far"}
    else:
        values = cams.normals
        changed = {"normals": values}
    ends, number, _ = edges_of(cams.faces)
    places, middle = cams.vertices[ends].mean(axis=1), values[ends].mean(axis=1)
    if reflector is not None:
        pose = np.asarray(cams.camera_from_world)
        turn, move = pose[:3, :3], pose[:3, 3]
        lengths = np.linalg.norm(values[ends], axis=2).mean(axis=1, keepdims=True)
        rim = on_border(cams.faces, number, len(ends))
        corners = (cams.vertices - move) @ turn
        points, normals = beside(reflector, (places - move) @ turn, middle @ turn, corners[ends], rim)
        places, middle = points @ turn.T + move, lengths * normals @ turn.T
    flat = np.flatnonzero((middle == 0).all(axis=1))  # two that are opposite: no direction between them
    middle[flat] = values[ends[flat, 0]]
    changed = {
        name: np.concatenate([table, middle]) if name != "ray_scale" else table for name, table in changed.items()
    }
    return dataclasses.replace(
        cams,
        vertices=np.concatenate([cams.vertices, places]),
        faces=np.concatenate([cams.faces, len(cams.vertices) + number], axis=1),
        degree=2,
        **changed,
    )


def in_four(
    reflector: Reflector, vertices: np.ndarray, normals: np.ndarray, faces: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (V', 3), normals (V', 3) and faces of each camera triangle in four; new vertices are on the surface.

    Their normals are as long as what lies between the lengths of the vertices around them.
    """
    lengths = np.linalg.norm(normals, axis=1)
    if faces.shape[1] == 3:
        ends, number, _ = edges_of(faces)
        shot = shoot(reflector, vertices[ends].mean(axis=1), normals[ends].sum(axis=1))
        points, ways, long = shot.points, shot.normals, lengths[ends].mean(axis=1)
        finer = corners_only(np.concatenate([faces, len(vertices) + number], axis=1))
    else:
        four = corners_only(faces)
        ends, number, first = edges_of(four)
        # Halfway along an edge of one of the four, as a place in the triangle that it came from.
        nodes = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0.5), (0, 0.5), (0.5, 0)])
        inner = nodes[corners_only(np.arange(6)[None])]
        halfway = np.stack([inner[:, [a, b]].mean(axis=1) for a, b in EDGES], axis=1).reshape(-1, 2)
        parent, (second, third) = first // 12, halfway[first % 12].T
        columns = faces[parent].T
        places, toward = (mixed([table[c].T for c in columns], second, third).T for table in (vertices, normals))
        long = np.maximum(mixed([lengths[c] for c in columns], second, third), 0.1 * lengths[ends].min(axis=1))
        rim = on_border(four, number, len(ends))
        points, ways = beside(reflector, places, toward, vertices[ends], rim)
        finer = np.concatenate([four, len(vertices) + number], axis=1)
    return np.concatenate([vertices, points]), np.concatenate([normals, long[:, None] * ways]), finer


def edges_of(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices at the ends of each edge (E, 2), the edges (F, 3) opposite to the corners of faces (F, 3), and for each
    edge the first place (E,) in that table.
    """
    ends = np.sort(np.stack([faces[:, edge] for edge in EDGES], axis=1).reshape(-1, 2), axis=1)
    unique, first, number = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    return unique, number.reshape(-1, 3), first


def on_border(faces: np.ndarray, number: np.ndarray, count: int) -> np.ndarray:
    """(count,) which of the edges numbered as in (F, 3) have a triangle on one side alone."""
    border = np.zeros(count, bool)
    border[number[neighbors(faces) < 0]] = True
    return border


def beside(
    reflector: Reflector, places: np.ndarray, toward: np.ndarray, ends: np.ndarray, border: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 3) of the true surface beside places (N, 3), along (N, 3), and its normals there.

    Where border (N,) is set, and both ends (N, 2, 3) of the edge lie on the border of the surface, so does the point.
    """
    shot = shoot(reflector, places, toward)
    points, normals = shot.points, shot.normals
    rows = np.flatnonzero(border)
    open_ = Border(reflector)
    if len(rows) and open_.count:
        off = open_.nearest(ends[rows].reshape(-1, 3))[0].reshape(-1, 2)
        rows = rows[(off <= _NEAR * reflector.radius).all(axis=1)]
        gap, face, second, third = open_.nearest(places[rows])
        near = gap <= 0.5 * np.linalg.norm(ends[rows, 1] - ends[rows, 0], axis=1)
        rows = rows[near]
        points[rows], normals[rows] = reflector.at(face[near], second[near], third[near])
    return points, normals
