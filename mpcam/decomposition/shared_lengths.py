"""Lengths of rays at the vertices of camera triangles, chosen so that each is as nearly general linear as it can be.

Over a camera triangle, origins and directions are mixed linearly. Where directions at its corners have the same part
along its normal it is a general linear camera: a point has one image, in closed form (Yu et al. 2009). Lengths of its
own for each triangle do that, but then neighbors disagree along their common edge. One length for each vertex, shared
by all triangles around it, keeps the camera without seams, and comes near.
"""

import dataclasses
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.errors import InputError

GRAZING = 0.25
"""Triangles with a ray that has less than this along the normal do not count: no length makes them regular."""
_PULL = 1e-6
"""Weight with which lengths that no triangle decides about are drawn to 1."""


def slants(cams: CameraTriangles) -> np.ndarray:
    """(3, F): parts of the unit rays at the corners of each camera triangle along its normal.

    Raises InputError for camera triangles with normals, whose rays are bent pixel by pixel, and for curved ones.
    """
    if cams.directions is None:
        raise InputError("give camera triangles with directions: see directions_at_vertices")
    if cams.degree > 1:
        raise InputError("camera triangles of degree 2 are no general linear cameras: give them with degree=1")
    a, b, c = (cams.vertices[cams.faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rays = cams.directions / np.linalg.norm(cams.directions, axis=1, keepdims=True)
    return np.stack([(normal * rays[cams.faces[:, i]]).sum(axis=1) for i in range(3)])


def shared_lengths(cams: CameraTriangles) -> np.ndarray:
    """(V,) length of the ray at each vertex, with a geometric mean of 1.

    Minimizes sum over triangles f and corners i of (log l_i + log s_fi - m_f)^2, where s is the part of the unit ray
    along the normal of the triangle and m_f the mean over its corners: linear, and sparse. Raises InputError as
    `slants`.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import spsolve

    slant = slants(cams)
    regular = (slant >= GRAZING).all(axis=0) | (slant <= -GRAZING).all(axis=0)
    corners, known = cams.faces[regular], np.log(np.abs(slant[:, regular])).T
    count = len(cams.vertices)
    center = np.eye(3) - 1.0 / 3.0  # takes the mean of a triangle away
    rows, columns = np.repeat(corners, 3, axis=1).ravel(), np.tile(corners, (1, 3)).ravel()
    normal: Any = coo_matrix((np.tile(center.ravel(), len(corners)), (rows, columns)), shape=(count, count)).tocsc()
    right = np.zeros(count)
    np.add.at(right, corners.ravel(), -(known @ center).ravel())
    normal.setdiag(normal.diagonal() + _PULL)
    logarithm: Any = spsolve(normal, right) if len(corners) else np.zeros(count)
    return np.exp(logarithm - logarithm.mean())


def with_shared_lengths(cams: CameraTriangles) -> CameraTriangles:
    """Camera triangles with the same rays at the vertices and `shared_lengths` (ray_scale "near_far")."""
    lengths = shared_lengths(cams)
    unit = cams.directions / np.linalg.norm(cams.directions, axis=1, keepdims=True)
    return dataclasses.replace(cams, directions=unit * lengths[:, None], ray_scale="near_far")


def spread(cams: CameraTriangles) -> np.ndarray:
    """(F,) how far camera triangles are from general linear: range over mean of their rays' parts along the normal.

    With lengths as they are given (ray_scale "near_far"), else of unit rays. Raises InputError as `slants`.
    """
    slant = slants(cams)
    if cams.ray_scale == "near_far":
        lengths = np.linalg.norm(cams.directions, axis=1)
        slant = slant * lengths[cams.faces].T
    return np.ptp(slant, axis=0) / np.abs(slant.mean(axis=0))
