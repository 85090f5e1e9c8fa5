"""First hits by Mitsuba and Embree: the truth for `Hits`, and the rival on speed."""

from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.types import PosedRays, Ray
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.math.pose import frame_origin
from mpcam.rendering.clock import Clock
from mpcam.rendering.device import in_frame
from mpcam.rendering.device_camera import posed_rays, world_rays
from mpcam.rendering.device_rays import device_rays
from mpcam.rendering.explanation import Step, timed_steps
from mpcam.rendering.hits import Hits, Stats
from mpcam.rendering.moving import Moving
from mpcam.tracing.meshes import mitsuba_mesh, move, position_key
from mpcam.tracing.variant import mitsuba


def rays_around(posed: PosedRays, origin: np.ndarray, unit: float) -> tuple[Any, Any, Any]:
    """Origin, direction and validity of rays, row by row, in world axes around a point (3,) in a unit."""
    rotation = posed.pose[:3, :3]
    numbers = opaque_numbers([*rotation.ravel(), *((rotation @ origin + posed.pose[:3, 3]) / unit), 1.0 / unit])
    columns, shift, scale = [numbers[i:9:3] for i in range(3)], numbers[9:12], numbers[12]

    def turned(vector: Any) -> list[Any]:
        return [sum(column[j] * vector[j] for j in range(3)) for column in columns]

    start = [posed.ray.origin[i] * scale - shift[i] for i in range(3)]
    return turned(start), turned(posed.ray.direction), posed.ray.valid


class RayTraced(Moving):
    """Frames by tracing each pixel's ray through a tree over the triangles.

    The same rays and the same float32 vertices as the kernels use; but where something is far away, rays and vertices
    are brought to float32 around the point that the rays leave from, not as the other methods do it, so that comparing
    with them shows what rounding costs. Triangles with a corner that is not finite are left out of the tree, which may
    not hold such numbers. rays: others than the camera's, in the world, one for each of its pixels, row by row: origin
    (N, 3), unit direction (N, 3), valid (N,).
    """

    method = "raytrace"

    @exclusive
    def __init__(self, camera: Camera, mesh: Mesh, rays: Ray | None = None):
        self._prepare_mesh(mesh)
        self._given, self.camera = rays, camera
        self._posed = self._own_rays() if rays is None else world_rays(rays)
        self._origin = self._near()
        self._build()
        self._look()

    def _near(self) -> np.ndarray:
        """The point that all is put around: near that of the rays, and the same for cameras near to each other."""
        middle, unit = frame_origin(self._posed.pose), self.device.scale
        if isinstance(self.camera, CameraTriangles) and self._given is None:
            return middle
        if self.device.stands_apart(self.mesh, middle) is not None:
            return middle
        return np.rint(middle / unit) * unit if self.device.reaches_far else self.device.anchor

    @exclusive
    def aim(self, camera: Camera) -> None:
        """Another camera, or another pose of it: the tree stays as it is, unless it is too far away for float32.

        Raises InputError where rays were given.
        """
        if self._given is not None:
            raise InputError("these frames are of rays that were given, not of a camera's: prepare anew")
        self.camera = camera
        self._posed = self._own_rays()
        middle = self._near()
        if (middle != self._origin).any():
            self._origin = middle
            self._build()
        self._look()

    def _own_rays(self) -> PosedRays:
        """Those of the camera; of camera triangles around the mesh's anchor, so that rays may start on its faces."""
        if isinstance(self.camera, CameraTriangles):
            return device_rays(self.camera, self.device).posed(self.camera)
        return posed_rays(self.camera)

    def _look(self) -> None:
        """The rays around the origin, in its unit."""
        import drjit as dr

        with mitsuba() as mi:
            world, along, valid = rays_around(self._posed, self._origin, self._unit)
            self._ray = mi.Ray3f(mi.Point3f(*map(mi.Float, world)), mi.Vector3f(*map(mi.Float, along)))
            self._valid = mi.Bool(valid)
            dr.eval(self._ray, self._valid)

    def _build(self) -> None:
        """A scene of the faces whose corners are finite."""
        import drjit as dr

        mesh, self._unit = self.mesh, self.device.scale
        with np.errstate(invalid="ignore", over="ignore"):
            finite = np.isfinite(mesh.corners).all(axis=(1, 2))
        self._kept = None if finite.all() else types().UInt(np.flatnonzero(finite).astype(np.uint32))
        faces = mesh.faces if self._kept is None else mesh.faces[finite]
        self._scene: Any = None
        self._parameters: Any = None
        if len(faces) == 0:
            return
        positions = self._positions()
        with mitsuba() as mi:
            shape = mitsuba_mesh(mi, "mesh", dr.select(dr.isfinite(positions), positions, 0.0), faces)
            self._scene = mi.load_dict({"type": "scene", "mesh": shape})
            self._parameters = mi.traverse(self._scene)
            self._key = position_key(self._parameters)

    @exclusive
    def move(self, mesh: Mesh) -> None:
        """See `Moving.move`: uploads the vertices and rebuilds the tree."""
        before = self.device
        self._hold(mesh)
        if not self.device.same_frame(before):
            if self._given is None:
                self._posed = self._own_rays()
            self._origin, self._unit = self._near(), self.device.scale
            self._look()
        if self._scene is None or self._kept is not None or not np.isfinite(mesh.vertices).all():
            self._build()  # other faces may be finite now
            return
        with mitsuba() as mi:
            move(self._parameters, self._key, mi.Float(self._positions()))

    def _positions(self) -> Any:
        """The vertices around the origin: those on the device where that is the mesh's own anchor."""
        if (self._origin == self.device.anchor).all() and self._unit == self.device.scale:
            return self.device.vertices
        return in_frame(self.mesh.vertices, self._origin, self._unit)

    @exclusive
    def frame(self) -> Hits:
        """One frame, evaluated."""
        import drjit as dr

        t, posed = types(), self._posed
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
                depth = dr.select(t.Bool(hit), t.Float(dr.detach(found.t)) * self.unit, dr.inf)
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
            lambda: posed,
        )

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
