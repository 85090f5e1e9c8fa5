"""One place seen by four cameras, from 100 to 300 degrees."""

import functools
import math

import numpy as np

import mpcam as mp

FORMAT = "png"
SIZE = 900


@functools.cache
def views():
    """Title and (H, W, 4) picture of each camera, clear where it sees nothing."""
    scene = mp.builtin_scene("patio", SIZE, SIZE, triangles=150_000)
    pose = scene.camera.camera_from_world
    cameras = {
        "Pinhole, 100°": mp.Pinhole.from_fov(SIZE, SIZE, math.radians(100), pose),
        "Paraboloid, 180°": mp.Radial.paraboloid(SIZE, SIZE, pose),
        "Equisolid, 240°": mp.Radial.equisolid(SIZE, SIZE, pose, fov=math.radians(240)),
        "Equidistant, 300°": mp.Radial.equidistant(SIZE, SIZE, pose, fov=math.radians(300)),
    }
    v, u = np.indices((SIZE, SIZE)) + 0.5
    pictures = {}
    for title, camera in cameras.items():
        image = np.clip(mp.render(camera, scene), 0, 1) ** (1 / 2.2)
        pictures[title] = np.dstack([image, camera.ray(np.stack([u, v], -1)).valid])
    return pictures


def draw(theme):
    return theme.pictures(views(), 2.05)
