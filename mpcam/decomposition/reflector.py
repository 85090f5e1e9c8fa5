"""The true surface behind camera triangles: exact points and normals, traced and searched."""

import functools
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import KDTree

from mpcam.backend import exclusive
from mpcam.cameras.base import Camera
from mpcam.decomposition.welding import area_normals, has_area, place_numbers, usable_normals, welded
from mpcam.decomposition.winding import first_of_each, reversed_faces
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface

FINE = 40_000
"""Triangles of the mesh that stands for an analytic surface where rays are traced; points are put on it exactly."""
_CHUNK = 1 << 21
_ALIKE = 1.5
"""Triangles whose sizes differ by fewer powers of two are searched together."""


class FirstHits(NamedTuple):
    """Of rays (N,): whether they meet the surface, how far they run (infinite if not), the points (N, 3) and the unit
    shading normals (N, 3) there, and the rays' own unit directions (N, 3).
    """

    hit: np.ndarray
    distance: np.ndarray
    points: np.ndarray
    normals: np.ndarray
    along: np.ndarray


class Reflector:
    """A curved mirror or lens face, ready for questions.

    vertices (V, 3), normals (V, 3), faces (F, 3): the mesh with each vertex once, faces in the order of the mesh that
    was given; a vertex with several normals (a crease) stays several. A mesh without normals is taken for a smooth
    surface (`Mesh.flat` gives a facetted one). usable (F,): faces with area and finite corners. center (3,), radius: of
    a ball around it. surface: the analytic surface, or None. mesh: as given, or made of the surface.
    """

    def __init__(self, given: Mesh | Surface):
        self.surface = given if isinstance(given, Surface) else None
        self.mesh = mesh = given.mesh(FINE) if isinstance(given, Surface) else given
        corners = mesh.corners
        with np.errstate(invalid="ignore", over="ignore"):
            finite = np.isfinite(corners).all(axis=(1, 2))
            if not finite.any():
                raise InputError(
                    f"the reflector has {len(corners)} triangles and none with finite corners: give others"
                )
            self.usable = finite & has_area(corners)
        if not self.usable.any():
            raise InputError("the reflector has no triangle with an area: give a mesh with one at least")
        # Of faces with an area alone: others may be anywhere.
        low, high = (end(corners[self.usable], axis=(0, 1)) for end in (np.min, np.max))
        self.center = 0.5 * low + 0.5 * high
        self.radius = float(np.linalg.norm(corners[self.usable] - self.center, axis=-1).max())
        places = np.where(np.isfinite(mesh.vertices), mesh.vertices, 0.0)
        group = place_numbers(places, self.usable, mesh.faces, self.radius)
        self.usable &= first_of_each(group[mesh.faces])
        across = np.where(self.usable[:, None], area_normals(corners, self.radius), 0.0)
        areas = 0.5 * np.linalg.norm(across, axis=1)
        self.areas = areas * self.radius**2
        around = reversed_faces(group[mesh.faces], areas, self.usable)
        faces = np.where(around[:, None], mesh.faces[:, [0, 2, 1]], mesh.faces)
        across = np.where(around[:, None], -across, across)
        normals = None if mesh.normals is None else usable_normals(mesh, faces, across)
        self.vertices, self.normals, self.faces = welded(places, group, faces, normals, self.usable)
        self.face_normals = Mesh(self.vertices, self.faces).face_normals
        self.seen: tuple[Camera, FirstHits] | None = None  # by `pixel_hits`

    def at(
        self, face: np.ndarray, second: np.ndarray, third: np.ndarray, along: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """True points (N, 3) and unit shading normals (N, 3) at weights (N,) of corners 2 and 3 of faces (N,).

        along: (N, 3) directions from the mesh to an analytic surface; default: those of the interpolated normals.
        """
        weights = np.stack([1.0 - second - third, second, third], axis=-1)[..., None]
        corners = self.faces[face]
        points = (weights * self.vertices[corners]).sum(axis=-2)
        normals = (weights * self.normals[corners]).sum(axis=-2)
        if self.surface is not None:
            points = self.surface.snap(points, normals if along is None else along)
            return points, self.surface.normal_at(points)
        length = np.linalg.norm(normals, axis=-1, keepdims=True)
        return points, np.where(length > 1e-9, normals / np.maximum(length, 1e-9), self.face_normals[face])

    def first_hits(self, origins: Any, directions: Any) -> "FirstHits":
        """Where rays (N, 3) of any length meet the true surface first: in closed form where there is one, else along
        the rays from what `trace` finds.
        """
        origins, directions = np.broadcast_arrays(np.asarray(origins, np.float64), np.asarray(directions, np.float64))
        length = np.linalg.norm(directions, axis=-1, keepdims=True)
        along = directions / np.where(length > 0, length, 1.0)
        exact = None if self.surface is None else self.surface.first_crossing(origins, along)
        if exact is None:
            face, distance, second, third = self.trace(origins, along)
            hit = face >= 0
            face, distance = np.where(hit, face, 0), np.where(hit, distance, 0.0)
        else:
            hit = np.isfinite(exact)
            distance = np.where(hit, exact, 0.0)
        points = origins + distance[:, None] * along
        if exact is None and self.surface is None:
            points, normals = self._on_faces(face, origins, along, second, third)
        else:
            assert self.surface is not None
            if exact is None:
                points = self.surface.snap(points, along)
            normals = self.surface.normal_at(points)
        distance = np.where(hit, ((points - origins) * along).sum(-1), np.inf)
        return FirstHits(hit & (length[:, 0] > 0), distance, points, normals, along)

    def _on_faces(
        self, face: np.ndarray, origin: np.ndarray, along: np.ndarray, second: np.ndarray, third: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Where rays cross the planes of faces, to double precision, and the unit shading normals there."""
        a, b, c = (self.vertices[self.faces[face, i]] for i in range(3))
        normal = np.cross(b - a, c - a)
        squared = (normal * normal).sum(axis=1)
        towards = (along * normal).sum(axis=1)
        sure = np.abs(towards) > 1e-6 * np.sqrt(squared)  # edge-on, float32's weights are as good
        reach = ((a - origin) * normal).sum(axis=1) / np.where(sure, towards, 1.0)
        points = origin + reach[:, None] * along
        w2 = (np.cross(points - a, c - a) * normal).sum(axis=1) / np.maximum(squared, 1e-300)
        w3 = (np.cross(b - a, points - a) * normal).sum(axis=1) / np.maximum(squared, 1e-300)
        flat, normals = self.at(face, np.where(sure, w2, second), np.where(sure, w3, third))
        return np.where(sure[:, None], points, flat), normals

    def trace(self, origins: Any, directions: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """First hits of rays (N, 3): face (N,), -1 for none, distance in lengths of the direction, weights 2 and 3."""
        origins, directions = np.broadcast_arrays(np.asarray(origins, np.float64), np.asarray(directions, np.float64))
        scale = self.radius or 1.0
        origin, length = (origins - self.center) / scale, np.linalg.norm(directions, axis=-1, keepdims=True)
        along = directions / np.where(length > 0, length, 1.0)
        # Up to the ball around the reflector in float64: what is left fits into float32 wherever the eye is.
        skip = np.maximum(-(origin * along).sum(-1, keepdims=True) - 1.5, 0.0)
        origin = origin + skip * along
        parts = [
            self._traced(origin[i : i + _CHUNK], along[i : i + _CHUNK]) for i in range(0, max(len(origin), 1), _CHUNK)
        ]
        face, distance, second, third = (np.concatenate(values) for values in zip(*parts, strict=True))
        distance = (distance + skip[:, 0]) * scale / np.where(length > 0, length, 1.0)[:, 0]
        return face, np.where(face >= 0, distance, np.inf), second, third

    def _traced(self, origin: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, ...]:
        import drjit as dr

        from mpcam.tracing.variant import mitsuba

        @exclusive
        def run() -> tuple[np.ndarray, ...]:
            scene, numbers = self._scene
            with mitsuba() as mi:
                start, way = (np.ascontiguousarray(values.T, np.float32) for values in (origin, along))
                found = scene.ray_intersect_preliminary(mi.Ray3f(mi.Point3f(start), mi.Vector3f(way)))
                hit = found.is_valid()
                second, third = (dr.select(hit, dr.detach(w), 0.0).numpy().astype(np.float64) for w in found.prim_uv)
                face = np.where(hit.numpy(), numbers[dr.select(hit, found.prim_index, 0).numpy()], -1)
                return face, dr.detach(found.t).numpy().astype(np.float64), second, third

        return run() if len(origin) else (np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0))

    @functools.cached_property
    def _scene(self) -> tuple[Any, np.ndarray]:
        """Mitsuba's scene of the usable faces in units of the radius around the center, and their numbers."""
        from mpcam.tracing.meshes import mitsuba_mesh
        from mpcam.tracing.variant import mitsuba

        places = (self.vertices - self.center) / (self.radius or 1.0)
        numbers = np.flatnonzero(self.usable)
        with mitsuba() as mi:
            shape = mitsuba_mesh(mi, "reflector", np.where(np.isfinite(places), places, 0.0), self.faces[numbers])
            return mi.load_dict({"type": "scene", "mesh": shape}), numbers

    def sees(self, eye: np.ndarray, points: np.ndarray, slack: float = 1e-4) -> np.ndarray:
        """Whether nothing of the reflector hides its points (N, 3) from the eye (3,); slack: part of the radius."""
        way = points - eye
        _, distance, _, _ = self.trace(eye, way)
        return (distance - 1.0) * np.linalg.norm(way, axis=-1) > -slack * self.radius

    def closest(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Faces (N,) nearest to points (N, 3) among those on the side of normals (N, 3), and weights 2 and 3 there.

        Where there are none on that side, those on the other one count.
        """
        face, second, third, gap = self._closest(points, normals)
        lost = np.flatnonzero(np.isinf(gap))
        if len(lost):
            face[lost], second[lost], third[lost], _ = self._closest(points[lost], None)
        return face, second, third

    def _closest(
        self, points: np.ndarray, normals: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """As `closest`, and how far away they are, infinite for none; without normals both sides count."""
        count = len(points)
        face, second, third = np.zeros(count, np.int64), np.zeros(count), np.zeros(count)
        nearest = np.full(count, np.inf)
        for tree, numbers, reach in self._centers:
            left, near = np.arange(count), 16
            while len(left):
                near = min(near, len(numbers))
                step = max(_CHUNK // near // 4, 1)
                done = np.full(len(left), near == len(numbers))
                for i in range(0, len(left), step):
                    rows = left[i : i + step]
                    away, found = (v.reshape(len(rows), near) for v in tree.query(points[rows], near))
                    candidates = numbers[found]
                    w2, w3, gap = _nearest_in(self.vertices[self.faces[candidates]], points[rows][:, None])
                    if normals is not None:
                        fits = (self.face_normals[candidates] * normals[rows][:, None]).sum(-1) > 0
                        gap = np.where(fits, gap, np.inf)
                    row, best = np.arange(len(rows)), gap.argmin(axis=1)
                    better = gap[row, best] < nearest[rows]
                    mine, row, best = rows[better], row[better], best[better]
                    face[mine], nearest[mine] = candidates[row, best], gap[row, best]
                    second[mine], third[mine] = w2[row, best], w3[row, best]
                    done[i : i + step] |= nearest[rows] <= away[:, -1] - reach
                left, near = left[~done], near * 4
        return face, second, third, nearest

    @functools.cached_property
    def _centers(self) -> list[tuple[KDTree, np.ndarray, float]]:
        """Trees of the centers of triangles of like size, their numbers, and how far they reach from these.

        The largest come first: they are few, and one tree of all would have to be searched as far as they reach.
        """
        numbers = np.flatnonzero(self.usable)
        corners = self.vertices[self.faces[numbers]]
        center = corners.mean(axis=1)
        reach = np.linalg.norm(corners - center[:, None], axis=-1).max(axis=1)
        kind = np.floor(np.log2(np.maximum(reach, 1e-6 * reach.max()) / reach.max()) / _ALIKE)
        found = []
        for one in np.unique(kind)[::-1]:
            mine = kind == one
            found.append((KDTree(center[mine]), numbers[mine], float(reach[mine].max())))
        return found


@functools.lru_cache(maxsize=8)
def reflector_of(given: Mesh | Surface) -> Reflector:
    """The prepared reflector; the eight used last are kept. Raises InputError for anything else, and empty meshes."""
    if not isinstance(given, (Mesh, Surface)):
        raise InputError(f"the reflector is a {type(given).__name__}: give a Mesh or a Surface, e.g. Surface.sphere()")
    return Reflector(given)


def pixel_hits(camera: Camera, reflector: Reflector) -> FirstHits:
    """Where the rays of a camera's pixels, row by row, meet a reflector.

    Kept for the camera that came last: decomposing, pictures and their truth ask for the same.
    """
    if reflector.seen is None or reflector.seen[0] is not camera:
        u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
        ray = camera.ray(np.stack([u.ravel(), v.ravel()], -1))
        valid = np.asarray(ray.valid)
        found = reflector.first_hits(ray.origin, np.where(valid[:, None], ray.direction, (0.0, 0.0, 1.0)))
        found = found._replace(hit=found.hit & valid, distance=np.where(valid, found.distance, np.inf))
        reflector.seen = camera, found
    return reflector.seen[1]


def _nearest_in(corners: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights 2 and 3, and distance, of the nearest points of triangles (..., 3, 3) to points (..., 3)."""
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    ab, ac, ap = b - a, c - a, points - a
    d11, d12, d22 = (ab * ab).sum(-1), (ab * ac).sum(-1), (ac * ac).sum(-1)
    e1, e2 = (ab * ap).sum(-1), (ac * ap).sum(-1)
    whole = np.maximum(d11 * d22 - d12 * d12, 1e-300)
    u, v = (d22 * e1 - d12 * e2) / whole, (d11 * e2 - d12 * e1) / whole
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    on_ab = np.clip(e1 / np.maximum(d11, 1e-300), 0, 1)
    on_ac = np.clip(e2 / np.maximum(d22, 1e-300), 0, 1)
    bc, bp = c - b, points - b
    on_bc = np.clip((bc * bp).sum(-1) / np.maximum((bc * bc).sum(-1), 1e-300), 0, 1)
    best_u, best_v = np.where(inside, u, 0.0), np.where(inside, v, 0.0)
    gap = np.where(inside, np.linalg.norm(ap - u[..., None] * ab - v[..., None] * ac, axis=-1), np.inf)
    for s, t in ((on_ab, 0.0 * on_ab), (0.0 * on_ac, on_ac), (1.0 - on_bc, on_bc)):
        away = np.linalg.norm(ap - s[..., None] * ab - t[..., None] * ac, axis=-1)
        nearer = away < gap
        best_u, best_v, gap = np.where(nearer, s, best_u), np.where(nearer, t, best_v), np.where(nearer, away, gap)
    return best_u, best_v, gap
