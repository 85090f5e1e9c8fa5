"""First hits by Mitsuba and Embree: the truth for `Hits`, and the rival on speed."""

from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.types import PosedRays, Ray
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.clock import Clock
from mpcam.rendering.device import DeviceMesh, device_mesh
from mpcam.rendering.device_camera import posed_rays
from mpcam.rendering.device_rays import device_rays
from mpcam.rendering.explanation import Step, timed_steps
from mpcam.rendering.hits import Hits, Stats
from mpcam.tracing.meshes import mitsuba_mesh, move, position_key
from mpcam.tracing.variant import mitsuba


def rays_in_rows(camera: Camera, device: DeviceMesh) -> tuple[Any, Any, Any]:
    """Origin, direction and validity of the rays of all pixels, row by row, in the frame of a device mesh."""
    if isinstance(camera, CameraTriangles):
        posed = device_rays(camera, device).posed(camera)
    else:
        posed = posed_rays(camera)
    (origin, direction, valid), pose, scale = posed.ray, device.pose(posed.pose), 1.0 / device.scale
    moved = [origin[i] * scale - pose[9 + i] for i in range(3)]
    columns = [[pose[3 * j + i] for j in range(3)] for i in range(3)]
    world = [sum(columns[i][j] * moved[j] for j in range(3)) for i in range(3)]
    return world, [sum(columns[i][j] * direction[j] for j in range(3)) for i in range(3)], valid


class RayTraced:
    """Frames by tracing each pixel's ray through a tree over the triangles.

    The same rays and the same float32 vertices as the kernels use. Triangles with a corner that is not
    finite are left out of the tree, which may not hold such numbers. rays: others than the camera's, in the world, one
    for each of its pixels, row by row: origin (N, 3), unit direction (N, 3), valid (N,).
    """

    method = "raytrace"

    @exclusive
    def __init__(self, camera: Camera, mesh: Mesh, rays: Ray | None = None):
        self.mesh, self.own_rays = mesh, rays is None
        self.device: DeviceMesh = device_mesh(mesh)
        self._look(camera, rays)
        self._build(mesh.vertices)

    @exclusive
    def aim(self, camera: Camera) -> None:
        """Another camera, or another pose of it: the tree stays as it is. Raises InputError where rays were given."""
        if not self.own_rays:
            raise InputError("these frames are of rays that were given, not of a camera's: prepare anew")
        self._look(camera, None)

    def _look(self, camera: Camera, rays: Ray | None) -> None:
        import drjit as dr

        self.camera = camera
        with mitsuba() as mi:
            world, along, valid = rays_in_rows(camera, self.device) if rays is None else self.device.rays(rays)
            self._ray = mi.Ray3f(mi.Point3f(*map(mi.Float, world)), mi.Vector3f(*map(mi.Float, along)))
            self._valid = mi.Bool(valid)
            dr.eval(self._ray, self._valid)

    def _build(self, vertices: np.ndarray) -> None:
        """A scene of the faces whose corners are finite."""
        import drjit as dr

        with np.errstate(invalid="ignore", over="ignore"):
            finite = np.isfinite(vertices[self.mesh.faces]).all(axis=(1, 2))
        self._kept = None if finite.all() else types().UInt(np.flatnonzero(finite).astype(np.uint32))
        faces = self.mesh.faces if self._kept is None else self.mesh.faces[finite]
        self._scene: Any = None
        self._parameters: Any = None
        positions = self._positions = self.device.place(vertices)
        if len(faces) == 0:
            return
        with mitsuba() as mi:
            shape = mitsuba_mesh(mi, "mesh", dr.select(dr.isfinite(positions), positions, 0.0), faces)
            self._scene = mi.load_dict({"type": "scene", "mesh": shape})
            self._parameters = mi.traverse(self._scene)
            self._key = position_key(self._parameters)

    @exclusive
    def update(self, vertices: np.ndarray) -> None:
        """New positions (V, 3) of the vertices: uploads them and rebuilds the tree."""
        positions = self._positions = self.device.place(vertices)
        if self._scene is None or self._kept is not None or not np.isfinite(vertices).all():
            self._build(np.asarray(vertices, np.float64))  # other faces may be finite now
            return
        with mitsuba() as mi:
            move(self._parameters, self._key, mi.Float(positions))

    @exclusive
    def frame(self) -> Hits:
        """One frame, evaluated."""
        import drjit as dr

        t = types()
        with mitsuba() as mi:
            if self._scene is None:
                count = self.camera.width * self.camera.height
                triangle, depth = dr.full(t.Int, -1, count), dr.full(t.Float, dr.inf, count)
                second, third = dr.zeros(t.Float, count), dr.zeros(t.Float, count)
            else:
                found = self._scene.ray_intersect_preliminary(self._ray, coherent=True, active=self._valid)
                hit = self._valid & found.is_valid()
                number = t.UInt(dr.detach(found.prim_index))
                if self._kept is not None:
                    number = dr.gather(t.UInt, self._kept, number, t.Bool(hit))
                triangle = dr.select(t.Bool(hit), t.Int(number), -1)
                depth = dr.select(t.Bool(hit), t.Float(dr.detach(found.t)) * self.device.scale, dr.inf)
                second, third = (dr.select(t.Bool(hit), t.Float(dr.detach(w)), 0.0) for w in found.prim_uv)
            dr.eval(triangle, depth, second, third)
            del mi
        return Hits(
            self.camera,
            self.mesh,
            self.method,
            triangle,
            depth,
            lambda: (second, third),
            lambda: Stats(0, 0),
            self._positions,
            None if self.own_rays else self._view,
        )

    def _view(self) -> PosedRays:
        t = types()
        origin, direction = (t.Array3f(*(t.Float(x) for x in part)) for part in (self._ray.o, self._ray.d))
        return self.device.view(origin, direction, t.Bool(self._valid))

    @exclusive
    def stages(self) -> dict[str, float]:
        """Seconds of rebuilding the tree over the present positions, and of tracing."""
        if self._scene is None:
            return {"build": 0.0, "trace": 0.0}
        clock = Clock()
        with mitsuba() as mi:
            # Written anew, or Mitsuba would see that nothing changed.
            move(self._parameters, self._key, self._parameters[self._key] + mi.Float(opaque_zero()))
        clock.done("build")
        self.frame()
        clock.done("trace")
        return clock.seconds

    def explain(self) -> tuple[Step, ...]:
        """The stages of a frame; takes one frame to find out."""
        return tuple(timed_steps(self.stages(), self.method))
