"""Cameras and meshes that several tests share."""

import functools

import numpy as np

import mpcam as mp
from mpcam.cameras.capabilities import Bounds
from mpcam.cameras.registry import MODELS, snake_case
from mpcam.math import tan

POSE = mp.look_at((0.3, -0.2, 0.1), (0.5, 1.0, 0.7))


def registered(width: int = 64, height: int = 64, pose: np.ndarray | None = None) -> dict[str, mp.Camera]:
    """The examples of all models in the register, by their names, with the model's before those that are taken."""
    rows = None if pose is None else tuple(map(tuple, np.asarray(pose).tolist()))
    return dict(_examples(tuple(MODELS.values()), width, height, rows))


@functools.cache
def _examples(
    models: tuple[type[mp.Camera], ...], width: int, height: int, pose: tuple[tuple[float, ...], ...] | None
) -> dict[str, mp.Camera]:
    """Made once: hundreds of tests take one of them each."""
    matrix = None if pose is None else np.array(pose)
    found: dict[str, mp.Camera] = {}
    for model in models:
        for name, camera in model.examples(width, height, matrix).items():
            known = name in found or name == "default"
            found[f"{snake_case(model.__name__)} {name}" if known else name] = camera
    return found


def own(width: int = 64, height: int = 64, pose: np.ndarray | None = None) -> dict[str, mp.Camera]:
    """Radial cameras with a user's own profile, which no file can hold."""
    return {
        "user, convex": mp.Radial.from_function(width, height, lambda theta: tan(theta / 3), pose),
        "user, not convex": mp.Radial.from_function(width, height, lambda theta: theta + theta**3, pose),
    }


def cameras(size: int = 64, pose: np.ndarray | None = None) -> dict[str, mp.Camera]:
    """Those that bound the images of triangles."""
    found = registered(size, size, pose) | own(size, size, pose)
    return {name: camera for name, camera in found.items() if isinstance(camera, Bounds)}


NAMES = list(cameras())


def triangles(count: int, seed: int = 0) -> np.ndarray:
    """(count, 3, 3) random triangles around the origin: tiny to huge, near and far, in front and behind."""
    rng = np.random.default_rng(seed)
    center = rng.normal(size=(count, 1, 3))
    size = 10 ** rng.uniform(-3, 0.8, (count, 1, 1))
    return center + size * rng.normal(size=(count, 3, 3))


def soup(count: int, seed: int = 0) -> mp.Mesh:
    """Random triangles as one mesh."""
    return mp.Mesh(triangles(count, seed).reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def first_hits(camera: mp.Camera, mesh: mp.Mesh) -> tuple[np.ndarray, np.ndarray]:
    """Nearest triangle and depth of every pixel by brute force: every ray against every triangle, float64."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    ray = camera.ray(np.stack([u, v], -1))
    depth = np.full(u.shape, np.inf)
    triangle = np.full(u.shape, -1)
    for number, (a, b, c) in enumerate(mesh.corners):
        e1, e2 = b - a, c - a
        p = np.cross(ray.direction, e2)
        determinant = p @ e1
        s = ray.origin - a
        q = np.cross(s, e1)
        with np.errstate(divide="ignore", invalid="ignore"):
            beta, gamma = (s * p).sum(-1) / determinant, (ray.direction * q).sum(-1) / determinant
            t = q @ e2 / determinant
            hit = ray.valid & (beta >= 0) & (gamma >= 0) & (beta + gamma <= 1) & (t > 0) & (t < depth)
        depth[hit], triangle[hit] = t[hit], number
    return triangle, depth
