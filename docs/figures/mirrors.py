"""Near things in a wavy mirror by environment map, projected vertices, camera triangles and rays of the surface."""

import functools

import numpy as np

from mpcam.effects.reflection import Reflection
from mpcam.experiments.hou2006_scenes import reflection_scene

FORMAT = "png"


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each method."""
    scene = reflection_scene(width=400, height=300)
    found = {
        "Environment map": Reflection(scene, method="environment"),
        "Vertices, edges straight": Reflection(scene, method="vertex", triangles=416),
        "Vertices, edges halved twice": Reflection(scene, method="vertex", triangles=416, level=2),
        "26 camera triangles": Reflection(scene, triangles=26, resolution=96),
        "416 camera triangles": Reflection(scene, triangles=416, resolution=32),
        "Rays of the true surface": Reflection(scene, method="raytrace"),
    }
    return {title: np.clip(picture.image(), 0, 1) ** (1 / 2.2) for title, picture in found.items()}


def draw(theme):
    return theme.pictures(pictures(), 5.0, rows=2)
