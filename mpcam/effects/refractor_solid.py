"""The mesh that stands for a thing of glass: closed, with its normals outward, and how thick it is along them."""

import functools
from typing import Any

import numpy as np

from mpcam.decomposition.reflector import Reflector, reflector_of
from mpcam.decomposition.welding import place_numbers
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface

OFF = 1e-5
"""How far rays start from the surface that they leave, as a share of its radius."""

BESIDE = 1e-3
"""How far from a vertex its thickness is measured, as a share of the way to the middles of its faces."""


class Solid:
    """reflector: the true surface, as `mpcam.Reflection` has it. mesh: of its faces, seen from outside in front, with
    outward normals. Raises InputError for a surface that is not closed.
    """

    def __init__(self, surface: Mesh | Surface):
        self.reflector: Reflector = reflector_of(surface)
        whole = self.reflector
        faces = whole.faces[whole.usable]
        _check_closed(whole, faces)
        corners = whole.vertices[faces] - whole.center
        inward = np.linalg.det(corners / whole.radius).sum() < 0
        faces = faces[:, ::-1] if inward else faces
        normals = -whole.normals if inward else whole.normals
        self.mesh = Mesh(whole.vertices, np.ascontiguousarray(faces), normals=normals)

    @property
    def off(self) -> float:
        """Scene units that rays start away from the surface."""
        return OFF * self.reflector.radius

    def holds(self, point: np.ndarray) -> bool:
        """Whether a point (3,) is inside: faces around it fill the whole sphere (Van Oosterom and Strackee 1983)."""
        if np.linalg.norm(point - self.reflector.center) > self.reflector.radius:
            return False
        a, b, c = np.moveaxis(self.mesh.corners - point, 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        volume = (a * np.cross(b, c)).sum(axis=1)
        dots = la * lb * lc + (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        return bool(np.abs((2 * np.arctan2(volume, dots)).sum()) > 2 * np.pi)

    @functools.cached_property
    def thickness(self) -> np.ndarray:
        """(V,) lengths of the lines that run inward from the vertices along their normals (Wyman 2005)."""
        mesh, inward = self.mesh, -np.asarray(self.mesh.normals)
        # From a little beside each vertex, towards the middles of its faces: not along the side of a corner.
        middles, number = np.repeat(mesh.corners.mean(axis=1), 3, axis=0), mesh.faces.ravel()
        count = np.maximum(np.bincount(number, minlength=len(inward)), 1)
        around = np.stack([np.bincount(number, column, minlength=len(inward)) / count for column in middles.T], axis=1)
        found = self.reflector.first_hits(mesh.vertices + BESIDE * (around - mesh.vertices) + self.off * inward, inward)
        return np.where(found.hit, found.distance + self.off, 0.0)

    @functools.cached_property
    def middle_sees_all(self) -> bool:
        """Whether the whole inner side is seen from the middle of the mesh's ball, as it is in a convex thing."""
        corners = self.mesh.corners - self.reflector.center
        return bool((np.linalg.det(corners / self.reflector.radius) > 0).all())


def _check_closed(whole: Reflector, faces: np.ndarray) -> None:
    """See that each edge is passed as often one way as the other."""
    group = place_numbers(whole.vertices, np.ones(len(faces), bool), faces, whole.radius)[faces]
    starts, ends = group.ravel(), np.roll(group, -1, axis=1).ravel()
    low, high = np.minimum(starts, ends), np.maximum(starts, ends)
    _, number = np.unique(low * (group.max() + 1) + high, return_inverse=True)
    open_edges = int((np.bincount(number.ravel(), np.where(starts < ends, 1.0, -1.0)) != 0).sum())
    if open_edges:
        raise InputError(
            f"the refractor is not closed: {open_edges} edges have a face on one side only; close it, or give the "
            "face that light passes alone as mpcam.Mirror(surface, index=...)"
        )


@functools.lru_cache(maxsize=8)
def solid_of(surface: Any) -> Solid:
    """The prepared solid; the eight used last are kept. Raises InputError for a surface that is not closed."""
    return Solid(surface)
