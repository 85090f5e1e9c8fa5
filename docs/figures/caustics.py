"""Light that a metal ring, a glass ball and water waves gather on a floor."""

import functools

import numpy as np

import mpcam as mp
from mpcam.effects.caustics import caustics
from mpcam.geometry.surfaces import Surface

FORMAT = "png"
BALL = Surface.sphere(0.7, (0, 0, 0.9))
CASES = {
    "A metal ring": (
        Surface.cylinder(1.0, 0.5, 3.8, (0, 0, 0.25)),
        (-2.5, 0.3, 2.2),
        ((-2.2, -2.2, 3.2), (0.1, 0.1, 0)),
        {"reflectance": (0.95, 0.75, 0.45)},
    ),
    "Below a glass ball": (
        BALL,
        (-2.6, 1.0, 3.2),
        ((1.6, -3.2, 2.4), (0.4, -0.2, 0.25)),
        {"index": 1.5, "back": BALL},
    ),
    "Below water waves": (
        Surface.wave(3.4, 0.09, 2.2, (0, 0, 1.3)),
        (0.5, 0.6, 4.5),
        ((0.3, -2.6, 3.2), (0, -0.1, 0)),
        {"index": 1.33, "triangles": 1600},
    ),
}


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each case."""
    corners = [(-4, -4, 0), (4, -4, 0), (4, 4, 0), (-4, 4, 0)]
    floor = mp.Mesh(corners, [(0, 1, 2), (0, 2, 3)], materials=mp.Material((0.6, 0.58, 0.55)))
    found = {}
    for title, (surface, place, (eye, target), settings) in CASES.items():
        light = mp.PointLight(place, (9.0, 9.0, 8.5))
        camera = mp.Pinhole(400, 320, 470, camera_from_world=mp.look_at(eye, target))
        scene = mp.Scene((floor,), lights=(light,), ambient=(0.05, 0.05, 0.06))
        image = caustics(scene, surface, light, camera, **settings).render()
        # Bright parts are drawn in, so that the folds can be told apart.
        found[title] = (image / (1 + 0.35 * image)) ** (1 / 2.2)
    return {title: np.clip(picture, 0, 1) for title, picture in found.items()}


def draw(theme):
    return theme.pictures(pictures(), 2.2)
