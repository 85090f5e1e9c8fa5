"""Fields of rays that no formula is behind, as cameras that are written for NumPy alone, and their truth."""

import dataclasses
from typing import Any

import numpy as np

import mpcam as mp


@dataclasses.dataclass(frozen=True, eq=False)
class Field(mp.Camera):
    """A ray per pixel: origins and directions (H, W, 3), valid (H, W)."""

    width: int
    height: int
    origins: Any = None
    directions: Any = None
    valid: Any = None
    camera_from_world: Any = None

    def local_ray(self, pixel):
        u, v = pixel
        at = np.floor(v).astype(int), np.floor(u).astype(int)
        return mp.Ray(np.moveaxis(self.origins[at], -1, 0), np.moveaxis(self.directions[at], -1, 0), self.valid[at])


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def fields(width: int, height: int, seed: int = 0) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Origins, directions and validity by name: everything that a bound of rays may stumble over."""
    rng = np.random.default_rng(seed)
    shape = (height, width)
    a, b = np.meshgrid(2 * (np.arange(width) + 0.5) / width - 1, 2 * (np.arange(height) + 0.5) / height - 1)
    zero, one, every = 0 * a, 0 * a + 1, np.ones(shape, bool)
    plane = np.stack([a, b, zero - 1.5], -1)
    longitude, latitude = np.pi * a, 0.5 * np.pi * b
    around = np.stack(
        [np.cos(latitude) * np.sin(longitude), np.sin(latitude), np.cos(latitude) * np.cos(longitude)], -1
    )
    twisted = unit(np.stack([0.5 * a - 0.8 * b, 0.5 * b + 0.8 * a, one], -1))
    anywhere = unit(rng.normal(size=(*shape, 3)))
    sign = np.where(np.indices(shape).sum(0) % 2, 1.0, -1.0)[..., None]
    hole, jump = rng.random(shape) > 0.4, (rng.random(shape) < 0.02)[..., None]
    wide, turn = 1.2 * rng.random(shape), 2 * np.pi * rng.random(shape)
    cone = np.stack([np.sin(wide) * np.cos(turn), np.sin(wide) * np.sin(turn), np.cos(wide)], -1)
    return {
        "panorama": (np.zeros((*shape, 3)), around, every),
        "panorama elsewhere": (np.zeros((*shape, 3)) + [0.1, 0.2, 0.3], around, every),
        "twisted": (plane, twisted, every),
        "folded": (plane, unit(np.stack([np.sin(4 * a), np.sin(3 * b + a), 0.6 * one], -1)), every),
        "noise": (plane + 0.05 * rng.normal(size=plane.shape), unit(twisted + 0.05 * anywhere), every),
        "holes": (plane, np.where(hole[..., None], twisted, np.nan), every),
        "no ray at all": (plane, 0 * twisted, ~every),
        "all directions": (plane, anywhere, every),
        "wider than a half-space": (plane, cone, every),
        "to and fro": (plane, sign * [0.0, 0.0, 1.0], every),
        "almost to and fro": (plane, np.where(sign > 0, [1e-9, 0.0, 1.0], [0.0, 0.0, -1.0]), every),
        "converging": (plane, unit(np.array([0.1, 0.2, 1.5]) - plane), every),
        "parallel": (plane, np.broadcast_to([0.0, 0.0, 1.0], plane.shape), every),
        "focus far away": (plane, unit(np.array([0.0, 0.0, 200.0]) - plane), every),
        "outward": (0.3 * around, around, every),
        "inward": (4.0 * around, -around, every),
        "outliers": (np.where(jump, plane + 20 * anywhere, plane), np.where(jump, anywhere, twisted), every),
        "push broom": (np.stack([zero, 2 * b, zero - 1], -1), np.stack([np.sin(a), zero, np.cos(a)], -1), every),
    }


def camera(field: tuple[np.ndarray, np.ndarray, np.ndarray], pose: np.ndarray | None = None) -> Field:
    """The camera of a field."""
    height, width = field[2].shape
    return Field(width, height, *field, camera_from_world=pose)


def soup(count: int, seed: int, size: float) -> mp.Mesh:
    """Random triangles around the origin, of all sizes up to one."""
    rng = np.random.default_rng(seed)
    center = 2 * rng.random((count, 1, 1)) * unit(rng.normal(size=(count, 1, 3)))
    corners = center + size * rng.random((count, 1, 1)) * rng.normal(size=(count, 3, 3))
    return mp.Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def wrong_pixels(given: mp.Camera, mesh: mp.Mesh, hits: mp.Hits, sure: float = 1e-4) -> int:
    """Pixels whose first hit is not what float64 brute force over all triangles finds, away from edges.

    sure: barycentric weights and distances that decide nothing within so much.
    """
    world = given.ray(np.stack(np.meshgrid(np.arange(given.width) + 0.5, np.arange(given.height) + 0.5), -1))
    o, d = (np.asarray(part, np.float64).reshape(-1, 3) for part in (world.origin, world.direction))
    usable = np.asarray(world.valid).ravel() & np.isfinite(o + d).all(-1) & ((d * d).sum(-1) > 0)
    o, d = np.where(usable[:, None], o, 0.0), np.where(usable[:, None], d, [0.0, 0.0, 1.0])
    a, b, c = np.moveaxis(mesh.corners, 1, 0)
    normal = np.cross(b - a, c - a)
    with np.errstate(all="ignore"):
        facing = d @ normal.T
        distance = ((a * normal).sum(-1) - o @ normal.T) / facing
        moment = np.cross(o, d)
        sides = [d @ np.cross(p, q).T + moment @ (q - p).T for p, q in ((b, c), (c, a), (a, b))]
        least = np.min(sides / facing, axis=0)
    least = np.where((facing != 0) & np.isfinite(least) & usable[:, None], least, -np.inf)
    clear = (least > sure) & (distance > sure)
    nearest = np.where(clear, distance, np.inf).min(axis=1)
    ours, depth = hits.triangle.ravel(), hits.depth.ravel()
    pixel = np.arange(len(ours))
    seen = ours >= 0
    missed = ~seen & np.isfinite(nearest)
    chosen = np.where(seen, ours, 0)
    possible = (least[pixel, chosen] > -sure) & (np.abs(distance[pixel, chosen] - depth) <= sure * (1 + np.abs(depth)))
    hidden = depth > nearest + sure * (1 + nearest)
    return int((missed | (seen & (~possible | hidden))).sum())
