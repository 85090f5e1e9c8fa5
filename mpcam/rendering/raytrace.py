"""First hits by Mitsuba and Embree: the truth for `Hits`, and the rival on speed."""

from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.capabilities import Bends
from mpcam.cameras.types import PosedRays, Ray
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.math.pose import frame_origin
from mpcam.rendering.clock import Clock
from mpcam.rendering.device import in_frame
from mpcam.rendering.device_camera import looks_from, posed_rays, world_rays
from mpcam.rendering.device_rays import device_rays
from mpcam.rendering.explanation import Step, timed_steps
from mpcam.rendering.hits import Hits, Stats
from mpcam.rendering.moving import Moving
from mpcam.rendering.traced_rays import bent_rays, straight_rays
from mpcam.tracing.meshes import mitsuba_mesh, move, position_key
from mpcam.tracing.variant import mitsuba


class RayTraced(Moving):
    """Frames by tracing each pixel's ray through a tree over the triangles.

    The same rays and the same float32 vertices as the kernels use; but where something is far away, rays and vertices
    are brought to float32 around the point that the rays leave from, not as the other methods do it, so that comparing
    with them shows what rounding costs. Bent rays are traced piece by piece, each up to its end. Triangles with a
    corner that is not finite are left out of the tree, which may not hold such numbers. rays: others than the camera's,
    in the world, one for each of its pixels, row by row: origin (N, 3), unit direction (N, 3), valid (N,).
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
        unit = self.device.scale
        middle = looks_from(self.camera) if self._posed is None else frame_origin(self._posed.pose)
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

    def _own_rays(self) -> PosedRays | None:
        """Those of the camera; of camera triangles around the mesh's anchor, so that rays may start on its faces.

        None for bent rays.
        """
        if isinstance(self.camera, Bends):
            return None
        if isinstance(self.camera, CameraTriangles):
            return device_rays(self.camera, self.device).posed(self.camera)
        return posed_rays(self.camera)

    def _look(self) -> None:
        """The rays around the origin, in its unit."""
        with mitsuba() as mi:
            if self._posed is None:
                self._rays = bent_rays(mi, self.camera, self._origin, self._unit)
            else:
                self._rays = straight_rays(mi, self._posed, self._origin, self._unit)

    def _build(self) -> None:
        """A scene of the faces whose corners are finite."""
        import drjit as dr

        mesh, self._unit = self.mesh, self.device.scale
        with np.errstate(invalid="ignore", over="ignore"):
            finite = np.isfinite(mesh.corners).all(axis=(1, 2))
        self._kept = None if finite.all() else types().UInt(aligned(np.flatnonzero(finite), np.uint32))
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

        t, posed, count = types(), self._posed, self.camera.width * self.camera.height
        triangle, depth = dr.full(t.Int, -1, count), dr.full(t.Float, dr.inf, count)
        second, third = dr.zeros(t.Float, count), dr.zeros(t.Float, count)
        with mitsuba():
            for rays in self._rays:
                if self._scene is None:
                    break
                wanted = rays.valid & (triangle < 0)
                found = self._scene.ray_intersect_preliminary(rays.ray, coherent=True, active=wanted)
                hit, number = t.Bool(wanted & found.is_valid()), t.UInt(dr.detach(found.prim_index))
                if self._kept is not None:
                    number = dr.gather(t.UInt, self._kept, number, hit)
                away = t.Float(dr.detach(found.t))
                away = away if rays.start is None else away + rays.start
                triangle, depth = dr.select(hit, t.Int(number), triangle), dr.select(hit, away * self.unit, depth)
                weights = (t.Float(dr.detach(weight)) for weight in found.prim_uv)
                second, third = (dr.select(hit, new, old) for new, old in zip(weights, (second, third), strict=True))
                dr.eval(triangle, depth, second, third)
        view = None if posed is None else lambda: posed
        return Hits(
            self.camera,
            self.mesh,
            self.method,
            triangle,
            depth,
            lambda: (second, third),
            lambda: Stats(0, 0),
            view,
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
