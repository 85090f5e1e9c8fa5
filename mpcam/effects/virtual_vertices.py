"""Reflections as games have them: each vertex's image in the mirror, joined by straight edges (Ofek, Rappoport 1998).

The image of a vertex is worked out exactly, by the cubic of the camera triangle that it appears in; everything between
the vertices is linear in the picture. A baseline: see `mpcam.effects.reflection` for the method that needs no such
edges.
"""

import dataclasses
import functools
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_zero, types
from mpcam.cameras import three_rays
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.types import Ray
from mpcam.decomposition.decompose import directions_at_vertices
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.order import nearby
from mpcam.math.pose import frame_origin
from mpcam.rendering.camera_triangle_rays import node_rays
from mpcam.rendering.device_camera import world_rays
from mpcam.rendering.vertex import VertexProjected, corner, tessellated


class VirtualVertices(VertexProjected):
    """Frames of a mesh seen in camera triangles, in the picture of their eye; edges are split 2**level times first.

    camera: the eye's, with a common center. cams: camera triangles that it sees. rays: those of the true surface, one
    per pixel, with which hits are shaded. Of several images of a vertex the one nearest to the mirror counts; triangles
    with a corner that has none are left out. The depth of hits is the distance from the mirror. Raises InputError for
    other levels.
    """

    looks_from_eye = False  # but by way of the camera triangles

    def __init__(self, camera: Camera, mesh: Mesh, cams: CameraTriangles, rays: Ray, level: int = 0):
        super().__init__(camera, mesh, level)
        self.cams, view = with_directions(cams), world_rays(rays)
        self.view = lambda: view
        self._set_up()

    def _reframed(self) -> None:
        super()._reframed()
        self._set_up()

    @exclusive
    def _set_up(self) -> None:
        t, mesh, cams = types(), self.mesh, self.cams
        pose = np.asarray(cams.camera_from_world, np.float64)
        frame = np.eye(4)
        frame[:3, :3], frame[:3, 3] = pose[:3, :3].T, frame_origin(pose) - self.device.anchor
        table = node_rays(cams, frame, self.device.scale)
        self.rays = t.Float(aligned(table.transpose(2, 0, 1))) + opaque_zero()
        self.cones = _cones(table)
        with np.errstate(invalid="ignore", over="ignore"):
            places = mesh.corners.mean(axis=1) if self.level else mesh.vertices
        order = nearby(places) if mesh.triangle_count else np.zeros(1)
        self.order = t.UInt(aligned(order, np.uint32)) + t.UInt(opaque_zero())
        self.points = self.parts.points if self.level else 1
        from mpcam_kernels.candidates import levels

        self.counts = levels(len(places) * self.points, cams.count)

    def place(self, vertices: Any) -> list[Any]:
        import drjit as dr

        from mpcam_kernels.backend import backend_name
        from mpcam_kernels.rows import room
        from mpcam_kernels.threads import threads

        t, total = types(), self.counts[0]
        every = threads(t, 0, total)
        unbounded = self.camera.domain.image_radius is None
        candidates, balls, nearest, pixels = _kernels(type(self.camera), unbounded, self.points, backend_name())
        points = balls(every, vertices, self.corners, self.parts.grid, self.order, room(t, 1, total))
        keys = dr.zeros(t.UInt64, total)
        dr.make_opaque(keys)
        met = candidates.met(self.counts, self.cones, candidates.levels(points, self.counts))
        for pairs, number in met:
            keys = nearest(threads(t, 0, number), pairs, points, self.rays, keys)
        target = dr.empty(t.Float, 4 * total)
        eye = (self.device_camera.on_device, self.pose, self.unit)
        return [pixels(every, keys, points, self.rays, self.order, target, *eye)]


def with_directions(cams: CameraTriangles) -> CameraTriangles:
    """Camera triangles with rays at the vertices, less those that have a vertex where all light is reflected.

    Rays are as long as those that come from the eye: then the images in a flat mirror are exact, however large the
    triangles. Raises InputError where none is left, and for camera triangles of degree 2.
    """
    if cams.degree > 1:
        raise InputError("method='vertex' takes camera triangles of degree 1: give those that decompose makes, or none")
    if cams.normals is None:
        return cams
    _, valid = cams.bend(cams.vertices.T, cams.normals.T)
    kept = valid[cams.faces].all(axis=1)
    if not kept.any():
        raise InputError(
            "method='vertex': each camera triangle reflects all light: give another index, or move the camera"
        )
    used = np.unique(cams.faces[kept])
    sides = np.broadcast_to(np.asarray(cams.resolution), kept.shape)[kept]
    part = dataclasses.replace(
        cams,
        vertices=cams.vertices[used],
        normals=cams.normals[used],
        faces=np.searchsorted(used, cams.faces[kept]),
        resolution=sides,
    )
    direct = directions_at_vertices(part)
    ways = direct.directions / np.linalg.norm(direct.directions, axis=1, keepdims=True)
    lengths = np.linalg.norm(part.vertices - part.eye, axis=1, keepdims=True)
    return dataclasses.replace(direct, directions=ways * lengths, ray_scale="near_far")


def _cones(table: np.ndarray) -> Any:
    """Bounds of the rays of camera triangles, from those of their corners (6, 3, F): positions and directions between
    lie within the hull of the corners', and a cap that holds three directions holds those between them.
    """
    from mpcam_kernels.ray_cones import Cone, Cones
    from mpcam_kernels.rows import room
    from mpcam_kernels.threads import threads

    t, count = types(), table.shape[2]
    places, ways = table[0::2], table[1::2] / np.linalg.norm(table[1::2], axis=1, keepdims=True)
    center, axis = places.mean(axis=0), ways.mean(axis=0)
    axis /= np.maximum(np.linalg.norm(axis, axis=0), 1e-20)
    reach, spread = (
        np.linalg.norm(values - middle, axis=1).max(axis=0) * (1 + 1e-5)
        for values, middle in ((places, center), (ways, axis))
    )
    spread = np.where(spread < 1.2, spread, 2.0)  # caps beyond a half-sphere hold nothing between
    numbers = [np.ascontiguousarray(values, np.float32) for values in (center, reach, axis, spread)]
    cone = Cone(t.Array3f(numbers[0]), t.Float(numbers[1]), t.Array3f(numbers[2]), t.Float(numbers[3]), t.Float(0))
    target = room(t, 2, count)
    target.store(cone.rows(t), threads(t, 0, count))
    return Cones(target)


@functools.cache
def _kernels(model: type[Camera], unbounded: bool, points: int, backend: str) -> Any:
    """The search for camera triangles in which points may appear, and kernels before and after.

    balls: of radius 0 around the points of the tessellation, in the order of the search; radius -1 where a number is
    not finite. nearest: raises the keys of points by the images in pairs. pixels: from keys to (pixel, depth) of the
    points in the mesh's order; a depth of NaN where there is no image.
    """
    import drjit as dr

    from mpcam_kernels.candidates import CULLING, Candidates
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.outputs import HitKeys
    from mpcam_kernels.poses import placed
    from mpcam_kernels.rows import Rows

    def mapped(order: Any, number: Any) -> Any:
        """Number in the mesh's order."""
        return dr.gather(types().UInt, order, number // points) * points + number % points

    def image(face: Any, point: Any, rays: Any, active: Any) -> tuple[Any, Any, Any]:
        """The nearest image of points in camera triangles: where it lies, its distance, and whether there is one."""
        t = types()
        table = [dr.gather(t.Array3f, rays, face * 6 + k, active) for k in range(6)]
        best, distance, seen = t.Array3f(0), t.Float(dr.inf), t.Bool(False)
        for w1, w2, c, valid in three_rays.project(table[0::2], table[1::2], point):
            w3 = 1.0 - w1 - w2
            place, way = (one * w1 + two * w2 + three * w3 for one, two, three in (table[0::2], table[1::2]))
            away = c * dr.norm(way)  # rays differ in length, so c alone does not tell
            nearer = valid & (away < distance)
            best, distance = dr.select(nearer, place, best), dr.select(nearer, away, distance)
            seen |= valid
        return best, distance, seen

    @frozen
    def balls(number: Any, vertices: Any, faces: Any, grid: Any, order: Any, target: Rows) -> Rows:
        t, own = types(), mapped(order, number)

        def at(vertex: Any) -> Any:
            return dr.gather(t.Array3f, vertices, vertex)

        point = at(own) if points == 1 else tessellated(grid, at, faces, own, points)
        usable = dr.isfinite(point.x + point.y + point.z)
        target.store([t.Array4f(*dr.select(usable, point, 0), dr.select(usable, t.Float(0), -1))], number)
        return target

    @frozen
    def nearest(thread: Any, pairs: Any, points: Rows, rays: Any, keys: Any) -> Any:
        t = types()
        face, number = pairs.at(thread)
        (ball,) = points.at(t, number)
        _, distance, valid = image(face, ball.xyz, rays, True)
        nearness = 1.0 / dr.maximum(distance, 1e-30)
        dr.scatter_reduce(dr.ReduceOp.Max, keys, HitKeys.key(t, nearness, face), number, valid)
        return keys

    @frozen
    def pixels(
        number: Any, keys: Any, points: Rows, rays: Any, order: Any, target: Any, camera: Any, pose: Any, unit: Any
    ) -> Any:
        t, seen = types(), keys != 0
        (ball,) = points.at(t, number)
        place, distance, valid = image(dr.select(seen, HitKeys.triangle(t, keys), 0), ball.xyz, rays, seen)
        row = corner(camera, placed(types(), pose, place), distance * unit, unbounded)
        row.z = dr.select(seen & valid, row.z, dr.nan)
        dr.scatter(target, row, mapped(order, number))
        return target

    return Candidates(types(), CULLING), balls, nearest, pixels
