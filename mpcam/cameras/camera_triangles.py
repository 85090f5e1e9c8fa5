"""Camera triangles: a mesh whose triangles are small cameras, with one ray at each vertex (Hou et al. 2006)."""

import dataclasses
import functools
from typing import Any, ClassVar

import numpy as np

from mpcam.cameras.atlas import Atlas, atlas
from mpcam.cameras.base import Camera, register_pytrees
from mpcam.cameras.general_linear_map import linear_numbers
from mpcam.cameras.linear_pieces import LinearPieces
from mpcam.cameras.triangle_nodes import NODES, mixed
from mpcam.cameras.types import Domain, Projection, Ray
from mpcam.checks import three_numbers, whole_number
from mpcam.errors import InputError
from mpcam.math import Array, Vector, cross, dot, isfinite, library, normalize, plain, take, vector, where
from mpcam.math.optics import reflect, refract
from mpcam.math.pose import as_pose

SCALES = ("unit", "plane", "near_far")


@dataclasses.dataclass(frozen=True, eq=False)
class CameraTriangles(Camera):
    """Rays that run from the triangles of a mesh; over each triangle their origins are linear, or quadratic.

    Direct: `directions` at the vertices; over a triangle the direction is their barycentric mean (Hou et al. 2006,
    eq. 1). Reflection and refraction: `normals` at the vertices and an `eye`; each pixel interpolates its normal and
    bends the ray from the eye there (sections 3.1 and 3.2). The image is an atlas with a right triangle for each camera
    triangle, two to a cell; pixels between them have no ray. degree 2: a triangle has a vertex more on each edge, and
    positions and directions, or normals, are quadratic in between: curved triangles that share the vertices of an edge
    still share all its rays.

    vertices (V, 3), directions (V, 3), normals (V, 3), eye (3,): camera frame, which is the world unless
    camera_from_world says otherwise; scene units, directions and normals of any length but zero. faces (F, 3): vertex
    numbers; for degree 2 (F, 6), after the corners 1, 2 and 3 the vertices on the edges 2-3, 3-1 and 1-2, whose values
    are those halfway along the edge. resolution: pixels along the short sides of each triangle in the image, one number
    >= 2 or F of them.
    ray_scale, for directions: "unit" (normalized at the vertices, as the paper has it), "plane" (equal parts along the
    triangle's normal: then pinholes and general linear cameras are met exactly, but rays of neighbors on a common edge
    differ unless the two lie in one plane) or "near_far" (lengths as given: vertices to vertices + directions, the
    continuous three-ray camera). index: None for a mirror, else the refractive index behind the surface over that on
    the eye's side. Raises InputError for shapes that do not fit, and values that are not finite.
    """

    vertices: Any
    faces: Any
    directions: Any = None
    normals: Any = None
    eye: Any = None  # pyright: ignore[reportIncompatibleVariableOverride, reportAssignmentType]
    resolution: Any = 64
    ray_scale: str = "unit"
    index: Any = None
    camera_from_world: Any = None
    degree: int = 1

    static_fields: ClassVar[tuple[str, ...]] = ("faces", "resolution", "ray_scale", "degree")

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "camera_from_world", as_pose(self.camera_from_world))
        set_(self, "vertices", _table(self.vertices, "vertices"))
        set_(self, "degree", whole_number("degree", self.degree, 1, 2, of="CameraTriangles"))
        set_(self, "faces", _faces(self.faces, len(self.vertices), self.degree))
        if (self.directions is None) == (self.normals is None):
            raise InputError("CameraTriangles: give directions=, or normals= and eye=, not both or neither")
        name = "normals" if self.directions is None else "directions"
        values = _table(getattr(self, name), name, zero=False)
        if len(values) != len(self.vertices):
            raise InputError(f"{name} has {len(values)} rows, vertices {len(self.vertices)}: give one row per vertex")
        set_(self, name, values)
        if self.directions is not None and (self.eye is not None or self.index is not None):
            raise InputError("CameraTriangles: eye= and index= go with normals=, not with directions=")
        if self.normals is not None:
            set_(self, "eye", _point(self.eye))
        if self.index is not None and library(self.index) == "numpy":
            self._check_number("index", 0)
        set_(self, "resolution", _resolution(self.resolution, len(self.faces)))
        if self.ray_scale not in SCALES:
            raise InputError(f"ray_scale={self.ray_scale!r}: allowed are {', '.join(SCALES)}")
        if self.ray_scale == "plane" and self.degree > 1:
            raise InputError("CameraTriangles: ray_scale='plane' is for flat triangles: use 'unit' with degree=2")
        if self.ray_scale == "plane" and self.directions is not None:
            self._check_plane()
        register_pytrees()

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """Two triangles with rays of their own, a mirror, a lens, a curved mirror, and rays to both sides."""
        pose, side = camera_from_world, min(width, height)
        corners = np.array([[-1, -1, 2], [1, -1, 2.1], [-1, 1, 1.9], [1.1, 1, 2.2]])
        faces = [[0, 1, 2], [1, 3, 2]]
        rng = np.random.default_rng(3)
        cap = np.array([[x, y, 3 - np.sqrt(3 - x * x - y * y)] for y in (-1, 0, 1) for x in (-1, 0, 1)])
        grid = [[i + a, i + b, i + c] for i in (0, 1, 3, 4) for a, b, c in ((0, 1, 3), (1, 4, 3))]
        bent = {"normals": cap - [0, 0, 3], "eye": (0.2, 0.1, -2), "resolution": max(2, side // 2 - 3)}
        return {
            "direct": cls(
                corners,
                faces,
                directions=[[0, 0, 1], [0.3, 0, 1], [0, 0.3, 1], [0.2, 0.2, 1]],
                resolution=max(2, side - 3),
                camera_from_world=pose,
            ),
            "mirror": cls(cap, grid, **bent, camera_from_world=pose),
            "lens": cls(cap, grid, **bent, index=1.5, camera_from_world=pose),
            "curved": cls(
                cap,
                [[0, 2, 6, 4, 3, 1], [8, 6, 2, 4, 5, 7]],
                normals=cap - [0, 0, 3],
                eye=(0.2, 0.1, -2),
                resolution=max(2, side - 3),
                camera_from_world=pose,
                degree=2,
            ),
            "mixed signs": cls(
                rng.normal(size=(5, 3)),
                [[0, 1, 2], [1, 2, 3], [2, 3, 4]],
                directions=rng.normal(size=(5, 3)),
                resolution=max(2, side // 2 - 3),
                camera_from_world=pose,
            ),
        }

    @property
    def count(self) -> int:
        """Number of camera triangles."""
        return len(self.faces)

    @property
    def atlas(self) -> Atlas:
        """Where the camera triangles lie in the image."""
        sides = np.broadcast_to(np.asarray(self.resolution), (self.count,))
        return atlas(tuple(map(int, sides)))

    @property
    def width(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Pixels of the atlas."""
        return self.atlas.width

    @property
    def height(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Pixels of the atlas."""
        return self.atlas.height

    @property
    def kind(self) -> str:
        """ "direct", "reflection" or "refraction"."""
        if self.directions is not None:
            return "direct"
        return "reflection" if self.index is None else "refraction"

    @property
    def domain(self) -> Domain:
        """No common center, so no largest angle, and no image circle."""
        return Domain(None, None)

    @property
    def images_per_triangle(self) -> int:
        """Most images that a point has in one camera triangle: 3 (a cubic), 1 where the camera is general linear; 4 are
        looked for where rays are bent, and 8 with degree 2."""
        if self.linear:
            return 1
        if self.degree > 1:
            return 8
        return 3 if self.directions is not None else 4

    @property
    def linear(self) -> bool:
        """Whether each camera triangle is a general linear camera in its own plane: ray_scale "plane"."""
        return self.directions is not None and self.ray_scale == "plane"

    @property
    def images_per_point(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Most images that a point has: image number n lies in camera triangle n // images_per_triangle."""
        return self.images_per_triangle * self.count

    @functools.cached_property
    def pieces(self) -> LinearPieces | None:
        """Camera triangles that are general linear, each in a frame on its own plane; None where they are not."""
        if not self.linear:
            return None
        places, rays = (np.stack([self.node(i)[k] for i in range(3)]) for k in range(2))
        first = places[0]
        right, normal = normalize(places[1] - first), normalize(cross(places[1] - first, places[2] - first))
        normal = where(dot(normal, rays[0]) < 0, -1.0, 1.0) * normal
        axes = np.stack([right, cross(normal, right), normal])
        frames = np.zeros((self.count, 4, 4))
        frames[:, :3, :3], frames[:, 3, 3] = np.moveaxis(axes, -1, 0), 1.0
        frames[:, :3, 3] = -np.einsum("ijn,jn->ni", axes, first)
        starts, along = (np.einsum("ijn,kjn->kin", axes, part) for part in (places - first, rays))
        generators = np.concatenate([along[:, :2] / along[:, 2:], starts[:, :2]], axis=1)
        zero, face = np.zeros(self.count), np.arange(self.count)
        corners = ((zero, zero), (zero + 1, zero), (zero, zero + 1))
        image = np.stack([np.stack(self.atlas.pixel(face, *weights)) for weights in corners])
        return LinearPieces.of(frames, linear_numbers(generators, image, 1, 1))

    def locate(self, x: Array, y: Array) -> Array:
        """Camera triangle of pixel positions; -1 for none."""
        face, _, _, inside = self.atlas.locate(x, y)
        return where(inside, face, -1)

    @property
    def nodes(self) -> int:
        """Vertices of each camera triangle: 3, or 6 for degree 2."""
        return NODES[self.degree]

    def node(self, i: int) -> tuple[Vector, Vector]:
        """Positions of vertex i (0 to 2: the corners) of all camera triangles, and their rays (direct, scaled) or
        normals; each (3, F).
        """
        number = self.faces[:, i]
        place = _columns(self.vertices, number)
        if self.directions is None:
            return place, _columns(self.normals, number)
        along = _columns(self.directions, number)
        if self.ray_scale == "near_far":
            return place, along
        along = normalize(along)
        return (place, along) if self.ray_scale == "unit" else (place, along / abs(dot(self._face_normals(), along)))

    def _face_normals(self) -> Vector:
        """Unit normals (3, F) of the camera triangles."""
        a, b, c = (_columns(self.vertices, self.faces[:, i]) for i in range(3))
        return normalize(cross(b - a, c - a))

    def _check_plane(self) -> None:
        if library(self.vertices, self.directions) != "numpy":
            return
        normal = self._face_normals()
        parts = np.stack([dot(normal, normalize(_columns(self.directions, self.faces[:, i]))) for i in range(3)])
        bad = ~((parts > 1e-9).all(axis=0) | (parts < -1e-9).all(axis=0))
        if bad.any():
            raise InputError(
                f"ray_scale='plane': the directions of camera triangle {int(np.flatnonzero(bad)[0])} do not all leave "
                "on one side of it: use ray_scale='unit'"
            )

    def ray_at(self, face: Array, second: Array, third: Array) -> tuple[Vector, Vector, Array]:
        """Origin, direction (not normalized) and validity of the rays at weights of corners 2 and 3 of faces."""
        origin, along = self.interpolated(face, second, third)
        return (origin, *self.bend(origin, along))

    def interpolated(self, face: Array, second: Array, third: Array) -> tuple[Vector, Vector]:
        """Positions, and directions or normals, at weights of corners 2 and 3 of faces."""
        nodes = [tuple(_taken(values, face) for values in self.node(i)) for i in range(self.nodes)]
        place, along = (mixed([node[k] for node in nodes], second, third) for k in range(2))
        return place, along

    def bend(self, origin: Vector, along: Vector) -> tuple[Vector, Array]:
        """Direction (not normalized) and validity of rays, from interpolated positions and directions or normals."""
        if self.directions is not None:
            return along, dot(along, along) > 0
        incident = vector(*(origin[i] - plain(self.eye[i]) for i in range(3)))
        if self.index is None:
            direction = reflect(incident, along)
            return direction, dot(direction, direction) > 0
        direction, passes = refract(incident, along, self.index)
        return direction, passes & (dot(along, along) > 0) & (dot(incident, incident) > 0)

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame; valid on camera triangles, where light is not totally reflected."""
        face, second, third, inside = self.atlas.locate(*pixel)
        origin, direction, valid = self.ray_at(face, second, third)
        valid = valid & inside & isfinite(direction[0] + direction[1] + direction[2])
        zero = 0.0 * second
        direction = [where(valid, part, zero + end) for part, end in zip(direction, (0.0, 0.0, 1.0), strict=True)]
        return Ray(origin, normalize(vector(*direction)), valid)

    def project(self, points: Array) -> Projection:
        """All images of points in all camera triangles; those of camera triangle f are numbers k f to k f + k - 1.

        points (..., 3): world frame. Returns Projection with pixel (..., n, 2), depth (..., n), valid (..., n) for
        n = images_per_point and k = images_per_triangle. A point on a triangle has an image there at depth 0. Dr.Jit:
        an Array3f in, tuples of n entries out. Raises InputError when the last axis is not 3.
        """
        from mpcam.cameras.images import images_of

        register_pytrees()
        return images_of(self, points)

    def project_near(self, points: np.ndarray, pixels: np.ndarray) -> Projection:
        """Images of points (N, 3), world frame, in those camera triangles alone that pixels (N, 2) lie in.

        Returns Projection with pixel (N, k, 2), depth (N, k), valid (N, k), k = images_per_triangle.
        """
        from mpcam.cameras.images import images_near

        return images_near(self, points, pixels)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Images of points in the camera frame, as `project` numbers them."""
        from mpcam.cameras.images import local_images

        pixel, depth, valid = local_images(self, point)
        if library(depth) == "drjit":
            return tuple(Projection(*image) for image in zip(pixel, depth, valid, strict=True))
        return tuple(Projection(pixel[..., n], depth[..., n], valid[..., n]) for n in range(self.images_per_point))


def _taken(table: Vector, face: Array) -> Vector:
    """Columns of a table (3, F) by number."""
    return vector(*(take(part, face) for part in table))


def _columns(table: Any, number: np.ndarray) -> Any:
    """Rows of a table (V, 3) by number, components first."""
    return table[number].T


def _table(values: Any, name: str, zero: bool = True) -> Any:
    """A table (N, 3), checked unless it is another library's."""
    if library(values) != "numpy" or type(values) is object:
        return values
    try:
        table = np.array(values, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"CameraTriangles: {name} is not an array of numbers: give shape (V, 3)") from None
    if table.ndim != 2 or table.shape[1] != 3:
        raise InputError(f"CameraTriangles: {name} has shape {table.shape}: give (V, 3), one row per vertex")
    if not np.isfinite(table).all():
        raise InputError(f"CameraTriangles: {name} holds NaN or infinity in row {_first(~np.isfinite(table).all(1))}")
    if not zero and (table == 0).all(axis=1).any():
        raise InputError(f"CameraTriangles: {name} is zero in row {_first((table == 0).all(1))}: give a direction")
    table.flags.writeable = False
    return table


def _first(mask: Any) -> int:
    return int(np.flatnonzero(mask)[0])


def _faces(values: Any, vertices: int, degree: int) -> np.ndarray:
    wide = NODES[degree]
    try:
        given = np.asarray(values)
        faces = given.astype(np.int32)
    except (TypeError, ValueError):
        raise InputError(f"CameraTriangles: faces is not an array of whole numbers: give shape (F, {wide})") from None
    if faces.ndim != 2 or faces.shape[1] != wide or len(faces) == 0 or not np.array_equal(faces, given):
        hint = next((f", or degree={d}" for d, many in NODES.items() if faces.ndim == 2 and faces.shape[1] == many), "")
        raise InputError(
            f"CameraTriangles: faces has shape {faces.shape}: give (F, {wide}) vertex numbers, F at least 1{hint}"
        )
    if faces.min() < 0 or faces.max() >= vertices:
        raise InputError(f"CameraTriangles: faces name vertices {faces.min()} to {faces.max()} of {vertices}")
    faces.flags.writeable = False
    return faces


def _point(value: Any) -> Any:
    if value is None:
        raise InputError("CameraTriangles: normals= needs eye=, the point (3,) that rays come from")
    if library(value) != "numpy" or type(value) is object:
        return value
    point = three_numbers("CameraTriangles: eye", value)
    point.flags.writeable = False
    return point


def _resolution(value: Any, count: int) -> Any:
    given = np.asarray(value)
    whole = given.dtype.kind in "iuf" and np.array_equal(given, np.rint(given))
    if not whole or given.shape not in ((), (count,)) or (given < 2).any() or (given > 8192).any():
        raise InputError(
            f"CameraTriangles: resolution={value!r}: give a whole number of pixels from 2 to 8192, or {count} of them"
        )
    if given.ndim == 0:
        return int(given)
    sides = given.astype(np.int32)
    sides.flags.writeable = False
    return sides
