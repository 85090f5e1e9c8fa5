"""What tests of depth images share: a scene, cameras that see it, rays, and which of their true hits an image holds."""

import numpy as np

import mpcam as mp
from mpcam.cameras.types import Ray
from mpcam.rendering.raytrace import RayTraced

WIDTH, HEIGHT = 220, 180


def things() -> mp.Mesh:
    """Balls, cubes and a large triangle, some before others."""
    rng, parts = np.random.default_rng(8), []
    for number in range(9):
        pose = np.diag([*(0.45 * rng.uniform(0.5, 1, 1).repeat(3)), 1.0])
        pose[:3, :3] = pose[:3, :3] @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
        pose[:3, 3] = rng.uniform(-1, 1, 3)
        one = mp.builtin_mesh("cube") if number % 3 == 0 else mp.builtin_mesh("sphere", triangles=1280)
        parts.append(one.transformed(pose))
    floor = mp.Mesh([(-2.0, -1.6, -1.3), (2.0, -1.2, -1.2), (0.0, 2.2, -1.4)], [(0, 1, 2)])
    return mp.Mesh.concatenate([*parts, floor])


MESH = things()
MIDDLE = MESH.bounds.mean(axis=0)
SIZE = 0.5 * float(np.linalg.norm(np.ptp(MESH.bounds, axis=0)))
EYE = MIDDLE + SIZE * np.array([0.7, -1.5, 0.8])
POSE = mp.look_at(EYE, MIDDLE)


def cameras() -> dict[str, mp.Camera]:
    """One of each kind, which sees the whole mesh."""
    shared, away = mp.GeneralLinear.examples(WIDTH, HEIGHT, POSE), float(np.linalg.norm(EYE - MIDDLE))
    lens = 150.0, 150.0, 0.5 * WIDTH, 0.5 * HEIGHT
    ends = {"near": away - 0.7 * SIZE, "far": away + 0.7 * SIZE}
    pole = mp.SinglePoleOcclusion(WIDTH, HEIGHT, *lens, **ends, shift_far=25.0, camera_from_world=POSE)
    return {
        "pinhole": mp.Pinhole.from_fov(WIDTH, HEIGHT, 1.1, POSE),
        "orthographic": mp.Orthographic(WIDTH, HEIGHT, 0.5 * WIDTH / SIZE, camera_from_world=POSE),
        "paraboloid": mp.Radial.paraboloid(WIDTH, HEIGHT, POSE, fov=2.0),
        "equisolid": mp.Radial.equisolid(WIDTH, HEIGHT, POSE),
        "kannala-brandt": mp.KannalaBrandt(WIDTH, HEIGHT, 140.0, 142.0, 110.0, 92.0, (0.02, -0.01, 0, 0), POSE),
        "panorama": mp.Panorama.equirectangular(WIDTH, HEIGHT, camera_from_world=POSE),
        "cross slit": shared["cross slit"],
        "bilinear": shared["bilinear"],
        "single pole": pole,
        "graph": mp.GraphCamera.around(MIDDLE, mp.Pinhole.from_fov(WIDTH, HEIGHT, 1.1, POSE)),
    }


SHARES = {
    "pinhole": 0.985,
    "orthographic": 0.99,
    "paraboloid": 0.975,
    "equisolid": 0.965,
    "kannala-brandt": 0.98,
    "panorama": 0.975,
    "cross slit": 0.985,
    "bilinear": 0.98,
    "single pole": 0.97,
    "graph": 0.98,
}


def rays(count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """From all sides through the middle of the mesh and past it."""
    rng = np.random.default_rng(seed)
    start = rng.normal(size=(count, 3))
    start *= 2 * SIZE * rng.uniform(0.6, 1.3, (count, 1)) / np.linalg.norm(start, axis=1)[:, None]
    return start + MIDDLE, unit(0.6 * SIZE * rng.normal(size=(count, 3)) - start)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def embree(mesh: mp.Mesh, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance and triangle of the first hit of each ray (N, 3)."""
    count = len(origins)
    hits = RayTraced(mp.Pinhole(count, 1), mesh, Ray(origins, directions, np.ones(count, bool))).frame()
    return hits.depth[0].astype(float), hits.triangle[0]


def apart(a: mp.Intersections, b: mp.Intersections) -> np.ndarray:
    """How far two hits of one ray lie apart; 0 unless both are hits."""
    both = a.hit & b.hit
    return np.abs(np.where(both, a.distance, 0) - np.where(both, b.distance, 0))


def at(origins: np.ndarray, directions: np.ndarray, distance: np.ndarray) -> np.ndarray:
    return origins + directions * np.where(np.isfinite(distance), distance, 0.0)[..., None]


class Truth:
    """Embree's hits of rays, and which of them a depth image holds: their pixel has their triangle."""

    def __init__(self, camera: mp.Camera, mesh: mp.Mesh, origins: np.ndarray, directions: np.ndarray):
        self.distance, triangle = embree(mesh, origins, directions)
        self.hit = triangle >= 0
        image = camera.project(at(origins, directions, self.distance))
        self.pixel, seen = image.pixel[:, 0], image.valid[:, 0] & self.hit & camera.contains(image.pixel[:, 0])
        column, row = (np.clip(x, 0, n - 1).astype(int) for x, n in zip(self.pixel.T, (WIDTH, HEIGHT), strict=True))
        self.held = seen & (mp.rasterize(camera, mesh).triangle[row, column] == triangle)

    def off(self, found: mp.Intersections) -> np.ndarray:
        """Pixels between each hit that was found and the true one."""
        return np.where(found.hit, np.hypot(*(found.pixel - self.pixel).T), np.inf)
