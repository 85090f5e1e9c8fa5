"""One place all around: a whole sphere, a cylinder, and a part of the sphere; where the seam is, nothing shows."""

import math

import numpy as np

import mpcam as mp

FORMAT = "png"


def views():
    """Pictures by title."""
    scene = mp.builtin_scene("patio", 64, 64, triangles=150_000)
    eye, ahead = scene.camera.eye, np.asarray(scene.camera.camera_from_world)[2, :3]
    pose = mp.look_at(eye, eye + ahead * [1, 1, 0])  # level, so that what stands upright is upright
    turned = {"longitude": (0.0, 2 * math.pi)}
    cameras = {
        "equirectangular, 360° × 180°": mp.Panorama.equirectangular(1000, 500, pose),
        "the same, from longitude 0°": mp.Panorama.equirectangular(1000, 500, pose, **turned),
        "cylindrical, 360° × 115°": mp.Panorama.cylindrical(1000, 500, pose),
    }
    return {title: np.clip(mp.render(camera, scene), 0, 1) ** (1 / 2.2) for title, camera in cameras.items()}


def draw(theme):
    return theme.pictures(views(), 1.5)
