"""Cameras whose rays bend, for tests, and first hits of bent rays by brute force."""

import dataclasses
from typing import Any, ClassVar

import numpy as np

import mpcam as mp
from mpcam.cameras.types import Projection, RayPieces
from mpcam.math import dot, isfinite, norm, sqrt, vector, where


@dataclasses.dataclass(frozen=True, eq=False)
class Kinked(mp.Camera):
    """A pinhole up to the plane z = bend; beyond it rays open `slope` times as fast, and run aside.

    Past the plane z = far they run on as those of the pinhole would, so that there are three pieces.
    """

    width: int
    height: int
    camera_from_world: Any = None
    focal: Any = 0.9
    bend: Any = 1.0
    far: Any = 2.0
    slope: Any = 0.25
    aside: Any = 0.3

    ray_geometry: ClassVar[Any] = "general"
    images_per_point: ClassVar[int] = 1
    pieces_per_ray: ClassVar[int] = 3

    def _side(self) -> float:
        return self.focal * max(self.width, self.height)

    def _spread(self, z: Any) -> tuple[Any, Any]:
        """How far apart rays are at z, and how far they have gone aside."""
        bend, far = self.bend, self.far
        middle = where(z < bend, 0 * z, where(z > far, far - bend + 0 * z, z - bend))
        return where(z < bend, z, z - middle + self.slope * middle), self.aside * middle

    def _at(self, a: Any, b: Any, z: Any) -> Any:
        spread, aside = self._spread(z + 0 * a)
        return vector(a * spread + aside, b * spread, z + 0 * a)

    def _way(self, pixel: Any) -> tuple[Any, Any]:
        u, v = pixel
        return (u - 0.5 * self.width) / self._side(), (v - 0.5 * self.height) / self._side()

    def _piece(self, a: Any, b: Any, first: Any, last: Any, start: Any) -> RayPieces:
        here, there = self._at(a, b, first), self._at(a, b, last)
        way = vector(*(there[i] - here[i] for i in range(3)))
        length = norm(way)
        return RayPieces(here, vector(*(way[i] / length for i in range(3))), start, start + length, isfinite(a + b))

    def local_ray_pieces(self, pixel: Any) -> tuple[RayPieces, ...]:
        a, b = self._way(pixel)
        first = self._piece(a, b, 0.0 * a, self.bend, 0.0 * a)
        middle = self._piece(a, b, self.bend, self.far, first.end)
        last = self._piece(a, b, self.far, self.far + 1.0, middle.end)
        return first, middle, last._replace(end=last.end + np.inf)

    def local_ray(self, pixel: Any) -> mp.Ray:
        piece = self.local_ray_pieces(pixel)[1]
        origin = vector(*(piece.origin[i] - piece.start * piece.direction[i] for i in range(3)))
        return mp.Ray(origin, piece.direction, piece.valid)

    def local_project(self, point: Any) -> tuple[Projection, ...]:
        x, y, z = point
        spread, aside = self._spread(z)
        seen = spread > 0
        spread = where(seen, spread, 1.0)
        a, b = (x - aside) / spread, y / spread
        u, v = a * self._side() + 0.5 * self.width, b * self._side() + 0.5 * self.height
        depth, before = 0.0 * a, 0.0
        for until in (self.bend, self.far, None):
            end = z if until is None else where(z < until, z, until + 0 * z)
            here, there = self._at(a, b, before + 0 * z), self._at(a, b, end)
            step = vector(*(there[i] - here[i] for i in range(3)))
            depth = depth + where(z > before, sqrt(dot(step, step)), 0.0)
            before = until
        return (Projection(vector(u, v), depth, seen & isfinite(u + v + depth)),)


@dataclasses.dataclass(frozen=True, eq=False)
class Polyline(mp.Camera):
    """Rays through given points: bends (H, W, K + 1, 3), some of them not used; written for NumPy.

    ways (H, W, 3): direction after the last point, zero where the ray ends there. counts (H, W): pieces before that.
    """

    width: int
    height: int
    bends: Any = None
    counts: Any = None
    ways: Any = None
    camera_from_world: Any = None

    ray_geometry: ClassVar[Any] = "general"

    @property
    def pieces_per_ray(self) -> int:
        return self.bends.shape[2]

    def local_ray_pieces(self, pixel: Any) -> tuple[RayPieces, ...]:
        u, v = pixel
        at = np.floor(v).astype(int), np.floor(u).astype(int)
        points, count, way = self.bends[at], self.counts[at], self.ways[at]
        start, found = np.zeros(count.shape), []
        for k in range(self.pieces_per_ray):
            last = k == count
            step = np.where(
                last[..., None], way, points[..., min(k + 1, self.pieces_per_ray - 1), :] - points[..., k, :]
            )
            length = np.linalg.norm(step, axis=-1)
            valid = (k <= count) & (length > 0)
            direction = step / np.where(length > 0, length, 1)[..., None]
            end = np.where(last, np.inf, start + length)
            here = [np.moveaxis(part, -1, 0) for part in (points[..., k, :], direction)]
            found.append(RayPieces(*here, start, np.where(valid, end, 0.0), valid))
            start = np.where(last, start, start + length)
        return tuple(found)

    def local_ray(self, pixel: Any) -> mp.Ray:
        first = self.local_ray_pieces(pixel)[0]
        return mp.Ray(first.origin, first.direction, first.valid)


def polylines(width: int, height: int, pieces: int, seed: int, pose: Any = None) -> Polyline:
    """Random rays that bend up to so many times, each pixel as it likes; some end, some never start.

    The two halves of the image look from two sides, so that their pieces cross.
    """
    rng = np.random.default_rng(seed)
    a, b = np.meshgrid(2 * (np.arange(width) + 0.5) / width - 1, 2 * (np.arange(height) + 0.5) / height - 1)
    side = np.where(a < 0, 1.0, -1.0)
    points = [np.stack([0.02 * a + 0.8 * side, 0.02 * b, 0 * a - 2.0], -1)]
    step = np.stack([0.5 * a - 0.4 * side, 0.5 * b, 0 * a + 0.9], -1)
    for _ in range(pieces - 1):
        twist, turn = rng.normal(size=(2, 3)), rng.normal(size=3)
        points.append(points[-1] + step * rng.uniform(0.4, 0.9) * (1 + 0.2 * (a * turn[0] + b * turn[1]))[..., None])
        step = step + 0.35 * (a[..., None] * twist[0] + b[..., None] * twist[1]) + 0.2 * turn * side[..., None]
    rough = np.floor(4 * (a + b + rng.normal())) % (pieces + 1)
    counts = np.where(rough == pieces, -1, np.minimum(rough + pieces // 2, pieces - 1)).astype(int)
    ways = np.where((b > 0.6)[..., None], 0.0, step)
    return Polyline(width, height, np.stack(points, 2), counts, ways, pose)


def first_of_bent(given: mp.Camera, mesh: mp.Mesh, sure: float = 0.0) -> tuple[Any, Any]:
    """For each pixel, piece and triangle: how far along the bent ray the piece meets the triangle's plane, and how far
    inside: the least barycentric weight, or how far the place is within the ends of the piece. (P, K, T), float64.
    """
    centers = np.stack(np.meshgrid(np.arange(given.width) + 0.5, np.arange(given.height) + 0.5), -1)
    pieces = given.ray_pieces(centers.reshape(-1, 2))
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    normal = np.cross(b - a, c - a)
    depths, insides = [], []
    for k in range(pieces.start.shape[-1]):
        o, d = pieces.origin[:, k], pieces.direction[:, k]
        valid, start, end = (part[:, k, None] for part in (pieces.valid, pieces.start, pieces.end))
        o, d = np.where(valid, o, 0.0), np.where(valid, d, [0.0, 0.0, 1.0])
        with np.errstate(all="ignore"):
            facing = d @ normal.T
            distance = ((a * normal).sum(-1) - o @ normal.T) / facing
            moment = np.cross(o, d)
            sides = [d @ np.cross(p, q).T + moment @ (q - p).T for p, q in ((b, c), (c, a), (a, b))]
            least = np.min(sides / facing, axis=0)
            inside = np.minimum(np.minimum(least, distance), end - start - distance)
        good = valid & (facing != 0) & np.isfinite(least) & np.isfinite(distance)
        depths.append(np.where(good, start + distance, np.inf))
        insides.append(np.where(good, inside, -np.inf))
    return np.stack(depths, 1), np.stack(insides, 1)


def wrong_pixels(given: mp.Camera, mesh: mp.Mesh, hits: mp.Hits, sure: float = 1e-4) -> int:
    """Pixels whose first hit is not what float64 brute force over all pieces and triangles finds, away from edges.

    sure: weights and lengths that decide nothing within so much. At bends nothing is unsure but the piece: a triangle
    there counts as hit if either piece hits it.
    """
    depths, insides = first_of_bent(given, mesh)
    nearest = np.where(insides > sure, depths, np.inf).min((1, 2))
    ours, depth = hits.triangle.ravel(), hits.depth.ravel()
    seen, pixel = ours >= 0, np.arange(len(ours))
    missed = ~seen & np.isfinite(nearest)
    chosen = np.where(seen, ours, 0)
    of_ours = depths[pixel, :, chosen]
    with np.errstate(invalid="ignore"):  # infinite where nothing is hit
        close = np.abs(of_ours - depth[:, None]) <= sure * (1 + depth[:, None])
    possible = (insides[pixel, :, chosen] > -sure) & close
    hidden = depth > nearest + sure * (1 + nearest)
    return int((missed | (seen & (~possible.any(1) | hidden))).sum())
