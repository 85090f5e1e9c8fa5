"""The same courtyard through the eight kinds of general linear cameras."""

import functools

import numpy as np

import mpcam as mp

FORMAT = "png"
SIZE = (420, 320)


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each kind."""
    scene = mp.builtin_scene("patio", *SIZE, triangles=60_000)
    pose, gl = mp.look_at((-2.2, 0.0, 1.6), (3.0, 0.6, 1.3)), mp.GeneralLinear
    step = 5.0 / SIZE[0]
    cameras = {
        "pinhole": gl.pinhole(*SIZE, camera_from_world=pose),
        "orthographic": gl.orthographic(*SIZE, 70.0, camera_from_world=pose),
        "pushbroom": gl.pushbroom(*SIZE, step, camera_from_world=pose),
        "cross_slit": gl.cross_slit(
            *SIZE, ((-2.2, 0, 1.6), (0, 0, 1)), ((-3.6, 0, 1.6), (0, 1, 0)), (2.0, 0.3, 1.4), 6.0
        ),
        "pencil": gl.pencil(*SIZE, 2.5 / SIZE[1], camera_from_world=pose),
        "twisted_orthographic": gl.twisted_orthographic(*SIZE, 0.12, 70.0, camera_from_world=pose),
        "bilinear": gl.bilinear(*SIZE, 0.25, 0.2, 100.0, camera_from_world=pose),
        "epi": gl.epi(*SIZE, 3.0 / SIZE[1], camera_from_world=pose),
    }
    return {title: np.clip(mp.render(camera, scene), 0, 1) ** (1 / 2.2) for title, camera in cameras.items()}


def draw(theme):
    return theme.pictures(pictures(), 3.2, rows=2)
