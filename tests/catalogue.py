"""Cameras and meshes that several tests share."""

import numpy as np

import mpcam as mp
from mpcam.math import tan

POSE = mp.look_at((0.3, -0.2, 0.1), (0.5, 1.0, 0.7))


def cameras(size: int = 64, pose: np.ndarray | None = None) -> dict[str, mp.Camera]:
    """One camera per model and field of view."""
    w, h = size, size
    return {
        "paraboloid": mp.Radial.paraboloid(w, h, pose),
        "cosine_sphere": mp.Radial.cosine_sphere(w, h, pose),
        "equisolid": mp.Radial.equisolid(w, h, pose),
        "equidistant": mp.Radial.equidistant(w, h, pose),
        "narrow": mp.Radial.equidistant(w, h, pose, fov=1.2),
        "paraboloid 270": mp.Radial.paraboloid(w, h, pose, fov=1.5 * np.pi),
        "equidistant 270": mp.Radial.equidistant(w, h, pose, fov=1.5 * np.pi),
        "equisolid 360": mp.Radial.equisolid(w, h, pose, fov=2 * np.pi),
        "user, convex": mp.Radial.from_function(w, h, lambda theta: tan(theta / 3), pose),
        "user, not convex": mp.Radial.from_function(w, h, lambda theta: theta + theta**3, pose),
        "pinhole": mp.Pinhole(w, h, 0.6 * w, 0.55 * w, 0.47 * w, 0.52 * h, pose),
        "kannala_brandt": mp.KannalaBrandt(w, h, 0.31 * w, 0.3 * w, 0.48 * w, 0.51 * h, (0.05, -0.01, 0, 0), pose),
        "double_sphere": mp.DoubleSphere(w, h, 0.37 * w, 0.38 * w, 0.52 * w, 0.49 * h, -0.2, 0.59, pose),
        "unified_omni": mp.UnifiedOmni(w, h, 0.4 * w, 0.39 * w, 0.51 * w, 0.48 * h, 0.45, 1.1, pose),
        "orthographic": mp.Orthographic(w, h, 0.4 * w, camera_from_world=pose),
    }


NAMES = list(cameras())


def triangles(count: int, seed: int = 0) -> np.ndarray:
    """(count, 3, 3) random triangles around the origin: tiny to huge, near and far, in front and behind."""
    rng = np.random.default_rng(seed)
    centre = rng.normal(size=(count, 1, 3))
    size = 10 ** rng.uniform(-3, 0.8, (count, 1, 1))
    return centre + size * rng.normal(size=(count, 3, 3))


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
