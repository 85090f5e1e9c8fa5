"""Near things in a wavy mirror by an environment map, by camera triangles and by rays of the true surface."""

import functools

import numpy as np
from matplotlib import pyplot

from mpcam.effects.reflection import Reflection
from mpcam.experiments.hou2006_scenes import reflection_scene

FORMAT = "png"


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each method."""
    scene = reflection_scene(width=400, height=300)
    found = {
        "Environment map": Reflection(scene, method="environment"),
        "26 camera triangles": Reflection(scene, triangles=26, resolution=96),
        "416 camera triangles": Reflection(scene, triangles=416, resolution=32),
        "Rays of the true surface": Reflection(scene, method="raytrace"),
    }
    return {title: np.clip(picture.image(), 0, 1) ** (1 / 2.2) for title, picture in found.items()}


def draw(theme):
    figure, axes = pyplot.subplots(2, 2, figsize=(theme.width, 5.0))
    for place, (title, picture) in zip(axes.flat, pictures().items(), strict=True):
        place.imshow(picture, interpolation="antialiased")
        place.set_title(title)
        place.set_axis_off()
    return figure
