"""A basin seen through still air, through waves by camera triangles, and by rays of the true surface."""

import dataclasses
import functools

import numpy as np
from matplotlib import pyplot

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
    figure, axes = pyplot.subplots(1, 3, figsize=(theme.width, 2.2))
    for place, (title, picture) in zip(axes, pictures().items(), strict=True):
        place.imshow(picture, interpolation="antialiased")
        place.set_title(title)
        place.set_axis_off()
    return figure
