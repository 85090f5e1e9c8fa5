"""Barrels as triangles, by a single-pole relief, and by a conventional one."""

import functools
from dataclasses import replace

import numpy as np

import mpcam as mp

FORMAT = "png"
KINDS = {"By a single-pole image": "single_pole", "By an orthographic image": "orthographic"}


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each."""
    barrel = mp.builtin_mesh("barrel")
    places = np.tile(np.eye(4), (3, 1, 1))
    places[:, :2, 3] = [(-0.9, 0.1), (0.0, -0.4), (0.6, 0.6)]
    ground = mp.builtin_mesh("plane").transformed(np.diag([8.0, 8, 1, 1]))
    eye = mp.look_at((0.9, -3.2, 1.7), (-0.1, 0.0, 0.35))
    camera = mp.Pinhole.from_fov(400, 320, np.radians(42), camera_from_world=eye)
    light = mp.DirectionalLight((0.6, 0.5, -0.8), (0.9, 0.87, 0.8))
    scene = mp.Scene((ground,), camera, (light,), background=(0.55, 0.68, 0.82))
    whole = replace(scene, meshes=(ground, *(barrel.transformed(place) for place in places)))
    found = {"Triangles": mp.render(camera, whole, shadows=True)}
    for title, kind in KINDS.items():
        copies = mp.Relief.render(barrel, kind, 512).instances(places)
        found[title] = mp.render(camera, replace(scene, reliefs=copies), shadows=True)
    return {title: np.clip(image, 0, 1) ** (1 / 2.2) for title, image in found.items()}


def draw(theme):
    return theme.pictures(pictures(), 2.2)
