"""Camera triangles of every kind, and scenes before them, that several tests share."""

import numpy as np

import mpcam as mp

QUAD = np.array([[0, 0, 0], [1, 0, 0.1], [0, 1, -0.1], [1.1, 1, 0.2]])
FACES = [[0, 1, 2], [1, 3, 2]]


def patch(columns: int = 3, resolution=24, **settings) -> mp.CameraTriangles:
    """A part of a sphere around (0, 1, 0) that bulges towards -y."""
    u, v = np.meshgrid(*[np.linspace(-0.9, 0.9, columns + 1)] * 2)
    points = np.stack([u, 1 - np.sqrt(3 - u * u - v * v), v], -1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(columns + 1, columns + 1)
    a, b, c, d = number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]
    faces = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([b, d, c], -1).reshape(-1, 3)])
    normals = points - [0, 1, 0]
    bent = {"normals": normals, "eye": (0.2, -4, 1.5)} if "directions" not in settings else {}
    return mp.CameraTriangles(points, faces, resolution=resolution, **(bent | settings))


def mixed(seed: int = 3, resolution: int = 40) -> mp.CameraTriangles:
    """Random triangles with random directions, to both sides of them."""
    rng = np.random.default_rng(seed)
    return mp.CameraTriangles(
        rng.normal(size=(5, 3)),
        [[0, 1, 2], [1, 2, 3], [2, 3, 4]],
        directions=rng.normal(size=(5, 3)),
        resolution=resolution,
    )


CAMERAS = {
    "direct": lambda: mp.CameraTriangles(
        QUAD, FACES, directions=[[0, 0, 1], [0.3, 0, 1], [0, 0.3, 1], [0.2, 0.2, 1]], resolution=30
    ),
    "lengths": lambda: mp.CameraTriangles(
        QUAD,
        FACES,
        directions=[[0, 0, 1], [0.3, 0, 2], [0, 0.3, 1], [0.2, 0.2, 0.4]],
        ray_scale="near_far",
        resolution=30,
    ),
    "plane": lambda: mp.CameraTriangles(
        QUAD, FACES, directions=[[0, 0, 1], [0.3, 0, 2], [0, 0.3, 1], [0.2, 0.2, 1]], ray_scale="plane", resolution=30
    ),
    "mirror": patch,
    "sizes": lambda: patch(resolution=np.arange(3, 21) * 3),
    "large": lambda: patch(1, 150),
    "lens": lambda: patch(index=1.5),
    "total reflection": lambda: patch(2, index=0.6),
    "mixed signs": mixed,
}


def centers(camera: mp.Camera) -> np.ndarray:
    """(H, W, 2) pixel centers of an image."""
    u, v = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    return np.stack([u, v], -1)


def around(camera: mp.CameraTriangles, count: int, size: float = 1.0, seed: int = 0) -> mp.Mesh:
    """Random triangles, most of them on rays of the camera, some behind it."""
    rng = np.random.default_rng(seed)
    ray = camera.ray(centers(camera))
    chosen = rng.choice(np.flatnonzero(ray.valid), count)
    along = rng.uniform(-0.5, 4, (count, 1))
    center = ray.origin.reshape(-1, 3)[chosen] + along * ray.direction.reshape(-1, 3)[chosen]
    corners = center[:, None] + size * rng.normal(size=(count, 3, 3))
    return mp.Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
