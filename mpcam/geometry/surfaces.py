"""Smooth surfaces with exact points and normals: reflectors whose truth no tessellation limits."""

import dataclasses
from typing import Any

import numpy as np

from mpcam.checks import shown, three_numbers, whole_number
from mpcam.errors import InputError
from mpcam.geometry import crossings
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import surface, unit

MOST = 20_000_000
"""Triangles that `Surface.mesh` makes at most."""
_EDGE = 1.0 + 1e-12  # a patch has its border


@dataclasses.dataclass(frozen=True, eq=False)
class Surface:
    """A smooth surface over parameters u and v from 0 to 1, made by `sphere`, `ellipsoid`, `torus` and so on.

    world_from_surface: (4, 4) rigid pose; the surface's own frame has its middle at the origin and its axis along z.
    Normals point away from the inside, and up (+z of the surface) where there is no inside.
    """

    world_from_surface: Any

    wraps = (False, False)
    """Whether the surface closes on itself along u, and along v."""

    def __post_init__(self) -> None:
        pose = np.array(self.world_from_surface, np.float64)
        pose.flags.writeable = False
        object.__setattr__(self, "world_from_surface", pose)

    # What each kind supplies, in its own frame.

    def _place(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Points (..., 3)."""
        raise TypeError(f"{type(self).__name__} must define _place")

    def _level(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A function (...) that is zero on the surface and grows outwards, and its gradient (..., 3)."""
        raise TypeError(f"{type(self).__name__} must define _level")

    def _crossings(self, origin: np.ndarray, along: np.ndarray) -> np.ndarray | None:
        """Distances (N, K) at which lines from (N, 3) along unit directions may cross the whole surface that this is
        a part of, infinite for none, in any order; None where they are not known in closed form.
        """
        return None

    def _within(self, x: np.ndarray) -> np.ndarray:
        """Whether points (..., 3) of the whole surface are on this part of it."""
        return np.ones(x.shape[:-1], bool)

    # What they share.

    def point(self, u: Any, v: Any) -> np.ndarray:
        """World points (..., 3) of parameters u and v (...), 0 to 1. Raises InputError for others."""
        return self._to_world(self._place(*_parameters(u, v)))

    def normal(self, u: Any, v: Any) -> np.ndarray:
        """Unit world normals (..., 3) at parameters u and v (...), 0 to 1. Raises InputError for others."""
        return self._turned(unit(self._level(self._place(*_parameters(u, v)))[1]))

    def normal_at(self, points: Any) -> np.ndarray:
        """Unit world normals (..., 3) at world points (..., 3) of the surface."""
        return self._turned(unit(self._level(self._to_own(np.asarray(points, np.float64)))[1]))

    def snap(self, points: Any, along: Any = None) -> np.ndarray:
        """World points (..., 3) of the surface beside points (..., 3) that are nearly on it.

        along: (..., 3) directions to go, either way; default: those of the normals. Newton's method; a border is
        overstepped rather than kept to.
        """
        x = self._to_own(np.asarray(points, np.float64))
        way = None if along is None else np.asarray(along, np.float64) @ self.world_from_surface[:3, :3]
        for _ in range(8):
            level, gradient = self._level(x)
            step = gradient if way is None else way
            slope = (gradient * step).sum(-1)
            steep = np.abs(slope) > 1e-3 * np.linalg.norm(gradient, axis=-1) * np.linalg.norm(step, axis=-1)
            x = x - np.where(steep, level / np.where(steep, slope, 1.0), 0.0)[..., None] * step
        return self._to_world(x)

    def first_crossing(self, origins: Any, directions: Any) -> np.ndarray | None:
        """How far rays (N, 3) along unit directions (N, 3) run to the surface, infinite beside it; None for kinds of
        which no closed form is known.
        """
        origin = self._to_own(np.asarray(origins, np.float64))
        along = np.asarray(directions, np.float64) @ self.world_from_surface[:3, :3]
        # From the point nearest to the middle, so that nothing cancels however far away the rays start.
        skip = -(origin * along).sum(-1)
        middle = origin + skip[:, None] * along
        found = self._crossings(middle, along)
        if found is None:
            return None
        exists = np.isfinite(found)
        found = np.where(exists, found, 0.0)
        for _ in range(3):
            level, gradient = self._level(middle[:, None] + found[..., None] * along[:, None])
            slope = (gradient * along[:, None]).sum(-1)
            steep = np.abs(slope) > 1e-3 * np.linalg.norm(gradient, axis=-1)
            found = found - np.where(steep, level / np.where(steep, slope, 1.0), 0.0)
        x = middle[:, None] + found[..., None] * along[:, None]
        exists &= (found + skip[:, None] > 0) & self._within(x)
        return np.where(exists, found + skip[:, None], np.inf).min(axis=1)

    def mesh(self, triangles: int = 20_000) -> Mesh:
        """A mesh of about so many triangles with exact vertices and normals, cells as square as whole numbers allow.

        uv holds the parameters. Raises InputError for counts that are not whole numbers from 12 to 20,000,000.
        """
        triangles = whole_number("triangles", triangles, 12, MOST)
        steps = np.linspace(0, 1, 65)
        u, v = np.meshgrid(steps, steps, indexing="ij")
        place = self._place(u, v)
        across, along = (np.linalg.norm(np.diff(place, axis=i), axis=-1).sum(i).max() for i in range(2))
        columns = max(round(float(np.sqrt(triangles / 2 * across / along))), 3)
        rows = max(round(triangles / 2 / columns), 2)
        v, u = np.meshgrid(np.linspace(0, 1, rows + 1), np.linspace(0, 1, columns + 1), indexing="ij")
        points = self._place(u, v)
        for axis, wraps in enumerate(self.wraps):  # the same numbers, to the bit, where the ends meet
            if wraps:
                np.moveaxis(points, 1 - axis, 0)[-1] = np.moveaxis(points, 1 - axis, 0)[0]
        normals = unit(self._level(points)[1])
        part = surface(points, np.stack([u, v], axis=-1), normals)
        corners = part.vertices[part.faces]
        outward = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        inward = (outward * part.normals[part.faces].sum(axis=1)).sum(axis=1) < 0
        faces = np.where(inward[:, None], part.faces[:, [0, 2, 1]], part.faces)
        return Mesh(
            self._to_world(part.vertices), faces, self._turned(part.normals), part.uv, name=type(self).__name__.lower()
        )

    def transformed(self, matrix: Any) -> "Surface":
        """The surface after a rigid 4x4 matrix (world from world). Raises InputError for other matrices."""
        from mpcam.math.pose import as_pose

        return dataclasses.replace(self, world_from_surface=as_pose(matrix) @ self.world_from_surface)

    def _to_world(self, x: np.ndarray) -> np.ndarray:
        return self._turned(x) + self.world_from_surface[:3, 3]

    def _turned(self, x: np.ndarray) -> np.ndarray:
        return x @ self.world_from_surface[:3, :3].T

    def _to_own(self, x: np.ndarray) -> np.ndarray:
        return (x - self.world_from_surface[:3, 3]) @ self.world_from_surface[:3, :3]

    # The kinds.

    @staticmethod
    def sphere(radius: float = 1.0, center: Any = (0, 0, 0)) -> "Surface":
        """A sphere; poles on z. Raises InputError unless the radius is above 0."""
        return Ellipsoid(_at(center), (_positive("radius", radius),) * 3)

    @staticmethod
    def ellipsoid(radii: Any, center: Any = (0, 0, 0)) -> "Surface":
        """An ellipsoid with half axes `radii` (3,) along x, y and z. Raises InputError unless they are above 0."""
        given = tuple(radii) if np.shape(radii) == (3,) else ()
        if not given:
            raise InputError(f"ellipsoid(radii={shown(radii)}): give three numbers above 0")
        return Ellipsoid(_at(center), tuple(_positive("radii", radius) for radius in given))

    @staticmethod
    def torus(ring: float = 1.0, tube: float = 0.4, center: Any = (0, 0, 0)) -> "Surface":
        """A torus around z: radius of its middle line, and of its tube. Raises InputError unless 0 < tube < ring."""
        ring, tube = _positive("ring", ring), _positive("tube", tube)
        if tube >= ring:
            raise InputError(f"torus(ring={ring:g}, tube={tube:g}): the tube must be thinner than the ring's radius")
        return Torus(_at(center), ring, tube)

    @staticmethod
    def paraboloid(radius: float = 1.0, height: float = 0.5, center: Any = (0, 0, 0)) -> "Surface":
        """The round patch z = height (r / radius)^2: a bowl where height > 0, a dome below, a disc at 0."""
        return Paraboloid(_at(center), _positive("radius", radius), _finite("height", height))

    @staticmethod
    def cylinder(radius: float = 1.0, length: float = 2.0, angle: float = np.pi, center: Any = (0, 0, 0)) -> "Surface":
        """A patch of a cylinder along z: `angle` radians wide, its middle at +x. Raises InputError beyond 2 pi."""
        angle = _positive("angle", angle)
        if angle > 2 * np.pi + 1e-12:
            raise InputError(f"cylinder(angle={angle:g}): radians, at most 2 pi")
        return Cylinder(_at(center), _positive("radius", radius), _positive("length", length), angle)

    @staticmethod
    def saddle(size: float = 2.0, height: float = 0.5, center: Any = (0, 0, 0)) -> "Surface":
        """The square patch z = height (x^2 - y^2) / (size / 2)^2, `size` wide: bulging one way, hollow the other."""
        return Saddle(_at(center), _positive("size", size), _finite("height", height))

    @staticmethod
    def wave(size: float = 2.0, height: float = 0.1, waves: float = 1.5, center: Any = (0, 0, 0)) -> "Surface":
        """The square patch z = height sin x' sin y' with so many waves along each side: bumps, hollows and saddles."""
        return Wave(_at(center), _positive("size", size), _finite("height", height), _positive("waves", waves))


@dataclasses.dataclass(frozen=True, eq=False)
class Ellipsoid(Surface):
    radii: tuple[float, ...]
    wraps = (True, False)

    def _place(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        around, ring = 2 * np.pi * u, np.where((v == 0) | (v == 1), 0.0, np.sin(np.pi * v))
        return np.stack([ring * np.cos(around), ring * np.sin(around), -np.cos(np.pi * v)], axis=-1) * self.radii

    def _level(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        # Near its zero this is the distance along the gradient, up to a factor, so that Newton's method is quick.
        scaled = x / self.radii
        length = np.maximum(np.linalg.norm(scaled, axis=-1), 1e-300)
        return length - 1.0, scaled / self.radii / length[..., None]

    def _crossings(self, origin: np.ndarray, along: np.ndarray) -> np.ndarray:
        o, d = origin / self.radii, along / self.radii
        return crossings.quadratic((d * d).sum(-1), (o * d).sum(-1), (o * o).sum(-1) - 1.0)


@dataclasses.dataclass(frozen=True, eq=False)
class Torus(Surface):
    ring: float
    tube: float
    wraps = (True, True)

    def _place(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        around, about = 2 * np.pi * u, 2 * np.pi * v
        far = self.ring + self.tube * np.cos(about)
        return np.stack([far * np.cos(around), far * np.sin(around), self.tube * np.sin(about)], axis=-1)

    def _level(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        far = np.maximum(np.hypot(x[..., 0], x[..., 1]), 1e-300)
        out = far - self.ring
        thick = np.maximum(np.hypot(out, x[..., 2]), 1e-300)
        side = out / far / thick
        return thick - self.tube, np.stack([side * x[..., 0], side * x[..., 1], x[..., 2] / thick], axis=-1)

    def _crossings(self, origin: np.ndarray, along: np.ndarray) -> np.ndarray:
        found = np.full((len(origin), 4), np.inf)
        near = (origin * origin).sum(-1) <= (1.001 * (self.ring + self.tube)) ** 2
        found[near] = crossings.torus(self.ring, self.tube, origin[near], along[near])
        return found

    def _within(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(np.abs(self._level(x)[0]) <= 1e-9 * (self.ring + self.tube))


@dataclasses.dataclass(frozen=True, eq=False)
class Cylinder(Surface):
    radius: float
    length: float
    angle: float

    @property
    def wraps(self) -> tuple[bool, bool]:  # pyright: ignore[reportIncompatibleVariableOverride]
        return self.angle > 2 * np.pi - 1e-9, False

    def _place(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        around = (u - 0.5) * self.angle
        return np.stack([self.radius * np.cos(around), self.radius * np.sin(around), (v - 0.5) * self.length], axis=-1)

    def _level(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        far = np.maximum(np.hypot(x[..., 0], x[..., 1]), 1e-300)
        return far - self.radius, np.stack([x[..., 0] / far, x[..., 1] / far, 0.0 * far], axis=-1)

    def _crossings(self, origin: np.ndarray, along: np.ndarray) -> np.ndarray:
        o, d = origin[:, :2], along[:, :2]
        return crossings.quadratic((d * d).sum(-1), (o * d).sum(-1), (o * o).sum(-1) - self.radius**2)

    def _within(self, x: np.ndarray) -> np.ndarray:
        around = np.abs(np.arctan2(x[..., 1], x[..., 0]))
        return np.asarray((np.abs(x[..., 2]) <= _EDGE * 0.5 * self.length) & (around <= _EDGE * 0.5 * self.angle))


@dataclasses.dataclass(frozen=True, eq=False)
class HeightField(Surface):
    """z over x and y; each kind supplies its height and slopes."""

    def _height(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Height, and its slopes along x and y."""
        raise TypeError(f"{type(self).__name__} must define _height")

    def _level(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        height, along_x, along_y = self._height(x[..., 0], x[..., 1])
        return x[..., 2] - height, np.stack([-along_x, -along_y, np.ones_like(height)], axis=-1)

    def _lifted(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.stack([x, y, self._height(x, y)[0]], axis=-1)


@dataclasses.dataclass(frozen=True, eq=False)
class Paraboloid(HeightField):
    radius: float
    height: float
    wraps = (True, False)

    def _place(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self._lifted(self.radius * v * np.cos(2 * np.pi * u), self.radius * v * np.sin(2 * np.pi * u))

    def _height(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        bend = self.height / self.radius**2
        return bend * (x * x + y * y), 2 * bend * x, 2 * bend * y

    def _crossings(self, origin: np.ndarray, along: np.ndarray) -> np.ndarray:
        return _bowl(self.height / self.radius**2 * np.array([1.0, 1.0]), origin, along)

    def _within(self, x: np.ndarray) -> np.ndarray:
        return np.asarray(np.hypot(x[..., 0], x[..., 1]) <= _EDGE * self.radius)


@dataclasses.dataclass(frozen=True, eq=False)
class Saddle(HeightField):
    size: float
    height: float

    def _place(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self._lifted((u - 0.5) * self.size, (v - 0.5) * self.size)

    def _height(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        bend = 4 * self.height / self.size**2
        return bend * (x * x - y * y), 2 * bend * x, -2 * bend * y

    def _crossings(self, origin: np.ndarray, along: np.ndarray) -> np.ndarray:
        return _bowl(4 * self.height / self.size**2 * np.array([1.0, -1.0]), origin, along)

    def _within(self, x: np.ndarray) -> np.ndarray:
        return np.asarray((np.abs(x[..., :2]) <= _EDGE * 0.5 * self.size).all(-1))


@dataclasses.dataclass(frozen=True, eq=False)
class Wave(HeightField):
    size: float
    height: float
    waves: float

    def _place(self, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return self._lifted((u - 0.5) * self.size, (v - 0.5) * self.size)

    def _height(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        k = 2 * np.pi * self.waves / self.size
        sx, sy, cx, cy = np.sin(k * x), np.sin(k * y), np.cos(k * x), np.cos(k * y)
        return self.height * sx * sy, self.height * k * cx * sy, self.height * k * sx * cy


def _bowl(bends: np.ndarray, origin: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Distances (N, 2) to z = bends[0] x^2 + bends[1] y^2."""
    o, d = origin[:, :2], along[:, :2]
    linear = 0.5 * along[:, 2] - (bends * o * d).sum(-1)
    return crossings.quadratic(-(bends * d * d).sum(-1), linear, origin[:, 2] - (bends * o * o).sum(-1))


def _parameters(u: Any, v: Any) -> tuple[np.ndarray, np.ndarray]:
    u, v = np.broadcast_arrays(np.asarray(u, np.float64), np.asarray(v, np.float64))
    if not (np.all((u >= 0) & (u <= 1)) and np.all((v >= 0) & (v <= 1))):
        raise InputError("u and v of a surface run from 0 to 1: some of those given do not")
    return u, v


def _finite(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number):
        raise InputError(f"{name}={shown(value)}: give a finite number")
    return number


def _positive(name: str, value: Any) -> float:
    number = _finite(name, value)
    if number <= 0:
        raise InputError(f"{name}={shown(value)}: give a finite number above 0")
    return number


def _at(center: Any) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = three_numbers("center", center)
    return pose
