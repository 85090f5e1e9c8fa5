"""Mitsuba's own instances: one tree over a thing and one over its copies, the strongest rival for many of one thing."""

from typing import Any

import numpy as np

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.device import in_frame
from mpcam.rendering.device_camera import posed_rays
from mpcam.rendering.traced_rays import rays_around
from mpcam.scene.scene import DirectionalLight
from mpcam.tracing.meshes import mitsuba_mesh
from mpcam.tracing.variant import mitsuba


class InstanceTracing:
    """First hits of a camera's pixels on a ground and copies of a tile, by Embree's instances.

    matrices: (N, 4, 4), world from tile.
    """

    @exclusive
    def __init__(self, camera: Camera, ground: Mesh, tile: Mesh, matrices: np.ndarray):
        import drjit as dr

        with mitsuba() as mi:

            def shape(mesh: Mesh, name: str) -> Any:
                return mitsuba_mesh(mi, name, in_frame(mesh.vertices, np.zeros(3), 1.0), mesh.faces)

            scene: dict[str, Any] = {"type": "scene", "ground": shape(ground, "ground")}
            scene["tiles"] = {"type": "shapegroup", "tile": shape(tile, "tile")}
            for number, matrix in enumerate(matrices):
                place = mi.ScalarTransform4f(matrix.tolist())
                one = {"type": "instance", "group": {"type": "ref", "id": "tiles"}, "to_world": place}
                scene[f"copy{number}"] = one
            self._scene = mi.load_dict(scene)
            self._parameters = mi.traverse(self._scene)
            self._keys = [f"copy{number}.to_world" for number in range(len(matrices))]
            origin, along, valid = rays_around(posed_rays(camera), np.zeros(3), 1.0)
            self._ray = mi.Ray3f(mi.Point3f(*map(mi.Float, origin)), mi.Vector3f(*map(mi.Float, along)))
            self._valid = mi.Bool(valid)
            dr.eval(self._ray, self._valid)

    @exclusive
    def place(self, matrices: np.ndarray) -> None:
        """The copies elsewhere: their tree is made anew, that of the tile stays."""
        with mitsuba() as mi:
            for key, matrix in zip(self._keys, matrices, strict=True):
                self._parameters[key] = mi.Transform4f(mi.ScalarTransform4f(matrix.tolist()))
            self._parameters.update()

    @exclusive
    def frame(self) -> Any:
        """Lengths along the rays, on the device."""
        import drjit as dr

        with mitsuba():
            found = self._scene.ray_intersect_preliminary(self._ray, coherent=True, active=self._valid)
            dr.eval(found.t)
            return found.t

    @exclusive
    def lit(self, light: DirectionalLight) -> Any:
        """The same, and whether parallel light reaches each hit, by one more ray."""
        import drjit as dr

        with mitsuba() as mi:
            found = self._scene.ray_intersect_preliminary(self._ray, coherent=True, active=self._valid)
            hit = found.is_valid()
            back = mi.Vector3f(*(-part for part in light.direction))
            start = self._ray.o + self._ray.d * dr.select(hit, found.t, 0.0) * (1 - 1e-4)
            dark = self._scene.ray_test(mi.Ray3f(start, back), active=hit)
            dr.eval(found.t, dark)
            return found.t, dark

    def depth(self) -> np.ndarray:
        """(N,), infinite where nothing is hit."""
        return np.asarray(self.frame().numpy())
