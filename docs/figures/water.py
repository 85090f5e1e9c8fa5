"""A basin seen through still air, through waves by camera triangles, and by rays of the true surface."""

import dataclasses
import functools

import numpy as np

import mpcam as mp
from mpcam.effects.reflection import Reflection
from mpcam.experiments.hou2006_scenes import refraction_scene

FORMAT = "png"


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each."""
    scene = refraction_scene(width=400, height=300)
    found = {
        "Empty": mp.render(scene.camera, dataclasses.replace(scene, mirror=None)),
        "104 camera triangles": Reflection(scene, triangles=104, resolution=64).image(),
        "Rays of the true surface": Reflection(scene, method="raytrace").image(),
    }
    return {title: np.clip(picture, 0, 1) ** (1 / 2.2) for title, picture in found.items()}


def draw(theme):
    return theme.pictures(pictures(), 2.2)
