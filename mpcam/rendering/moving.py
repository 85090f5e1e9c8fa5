"""What all methods share of a scene that moves."""

from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.moved import moved
from mpcam.rendering.device import DeviceMesh, device_mesh


class Moving:
    """A mesh that was prepared, and as it is now.

    A frame after `update` is that of a method prepared for the moved mesh, to the bit.
    """

    mesh: Mesh
    device: DeviceMesh
    faces: Any
    _point: np.ndarray | None

    def _prepare_mesh(self, mesh: Mesh) -> None:
        self._start, self._point = mesh, None
        self._hold(mesh)
        self.faces = self.device.faces

    def _hold(self, mesh: Mesh) -> None:
        self.mesh, device = mesh, device_mesh(mesh)
        self.device = device if self._point is None else device.near(mesh, self._point)
        self.vertices, self.unit = self.device.vertices, opaque_numbers([self.device.scale])[0]

    def _look_from(self, point: np.ndarray) -> None:
        """The point (3,) around which the camera needs the mesh to be exact."""
        self._point = point
        self._hold(self.mesh)

    @exclusive
    def update(self, vertices: Any = None, *, normals: Any = None, transform: Any = None) -> None:
        """The scene elsewhere, for the frames that follow; nothing but the upload of vertices is needed.

        vertices: (V, 3) new positions, or a list with one array for each mesh of the scene, None for those that stay.
        normals: shading normals to go with them; without, those of the faces are made anew, and others are not known,
        so that shading by them raises InputError. transform: instead, a rigid 4x4 matrix (or a list of them) that takes
        the scene from where it was prepared; normals turn with it. Raises InputError for other shapes.
        """
        self.move(moved(self._start, vertices, normals, transform))

    @exclusive
    def move(self, mesh: Mesh) -> None:
        """The mesh as it is now, from `moved` of the one that was prepared."""
        before = self.device
        self._hold(mesh)
        if not self.device.same_frame(before):
            self._reframed()

    def _reframed(self) -> None:
        """Anchor and scale of the device mesh are others now: make anew what depends on them."""
        raise TypeError(f"{type(self).__name__} must define _reframed")
