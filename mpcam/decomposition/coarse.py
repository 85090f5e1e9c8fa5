"""Coarse meshes of a reflector whose vertices lie on the true surface and have its normals."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.decomposition.reflector import Reflector
from mpcam.decomposition.simplify import simplify
from mpcam.decomposition.views import SeenPoints

BEND = 0.5
"""Radii that a difference of 1 between normals counts as."""
HIDDEN = 0.1
"""Weight of the errors of faces that the eye does not see. With less, a few triangles would span all that is hidden,
and be seen at the outline."""
_PER_TRIANGLE, _AT_LEAST, _AT_MOST = 12, 2_500, 60_000
"""Triangles of an analytic surface that the collapses start from: for each one that is to be left, and in all."""
_LARGE = 20_000
"""Triangles of a mesh that are too many, where they are also twice as many for each one that is to be left."""
_SHARED = 3
"""Triangles, for each one that is to be left, down to which the collapses are the same for all tries."""


@dataclass(frozen=True, eq=False)
class Coarse:
    """vertices (V, 3), unit normals (V, 3), faces (F, 3). exact: the reflector's own triangles, nothing left out."""

    vertices: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    exact: bool = False

    def part(self, chosen: np.ndarray) -> "Coarse":
        """The chosen triangles (F,), with the vertices that they use."""
        used, faces = np.unique(self.faces[chosen], return_inverse=True)
        return Coarse(self.vertices[used], self.normals[used], faces.reshape(-1, 3).astype(np.int32), self.exact)


class Coarsening:
    """A reflector ready to be cut down to this or that number of triangles, best where a view sees it.

    triangles: about how many will be asked for.
    """

    def __init__(self, reflector: Reflector, view: SeenPoints, triangles: int):
        self.reflector = reflector
        own: np.ndarray | None = None  # the reflector's faces of which these are made, where they are
        if reflector.surface is not None:
            start = int(np.clip(_PER_TRIANGLE * triangles, _AT_LEAST, _AT_MOST))
            fine = Reflector(reflector.surface.mesh(start))
            vertices, normals, faces = fine.vertices, fine.normals, fine.faces[fine.usable]
        else:
            vertices, normals, faces = reflector.vertices, reflector.normals, reflector.faces[reflector.usable]
            large = max(_LARGE, 2 * _PER_TRIANGLE * triangles)
            own = np.flatnonzero(reflector.usable)
            if len(faces) > 1.5 * large:
                own = None
                vertices, normals, faces = _fewer(reflector, vertices, faces, large)
        self._weights = _weights(reflector, view, vertices, normals, faces, own)
        self._mesh = vertices, normals, faces
        if len(faces) > _SHARED * triangles and triangles > 4:
            self._mesh = self._cut(_SHARED * triangles)
            self._weights = _weights(reflector, view, *self._mesh)

    @property
    def count(self) -> int:
        """Triangles that the collapses start from."""
        return len(self._mesh[2])

    def _cut(self, triangles: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Vertices on the true surface, normals and faces of a mesh with at most so many triangles, where possible."""
        vertices, normals, faces = self._mesh
        scale, center = self.reflector.radius, self.reflector.center
        places, ways, faces = simplify((vertices - center) / scale, normals, faces, triangles, self._weights, BEND)
        found = self.reflector.at(*self.reflector.closest(places * scale + center, ways))
        return *found, faces

    def mesh(self, triangles: int) -> Coarse:
        """At most so many triangles; more where fewer would fold the surface or change its topology."""
        if self.count <= triangles and self.reflector.surface is None:
            vertices, normals, faces = self._mesh
            return Coarse(vertices, normals, faces.astype(np.int32), exact=True)
        vertices, normals, faces = self._cut(triangles)
        return Coarse(vertices, normals, faces.astype(np.int32))


def _fewer(
    reflector: Reflector, vertices: np.ndarray, faces: np.ndarray, triangles: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A first cut of a very large mesh, fast and by positions alone, with the true normals."""
    import fast_simplification

    from mpcam.geometry.mesh import Mesh

    places = ((vertices - reflector.center) / reflector.radius).astype(np.float32)
    cut: Any = fast_simplification.simplify(places, faces.astype(np.int32), target_count=triangles)
    places, faces = cut
    places = places.astype(np.float64) * reflector.radius + reflector.center
    return *reflector.at(*reflector.closest(places, Mesh(places, faces).smooth_normals())), faces


def _weights(
    reflector: Reflector,
    view: SeenPoints,
    vertices: np.ndarray,
    normals: np.ndarray,
    faces: np.ndarray,
    own: np.ndarray | None = None,
) -> np.ndarray:
    """(F,) weights of the errors of faces on the reflector: 1 where the view sees it, and a little around.

    own: (F,) the reflector's faces that they lie on, where they are known.
    """
    seen = np.zeros(len(reflector.vertices), bool)
    seen[reflector.faces[view.face]] = True
    if own is None:
        own, _, _ = reflector.closest(vertices[faces].mean(axis=1), normals[faces].sum(axis=1))
    return np.where(seen[reflector.faces[own]].any(axis=1), 1.0, HIDDEN)
