"""Camera triangles on a mirror, and their atlas."""

import functools

import numpy as np
from matplotlib import pyplot
from matplotlib.collections import PolyCollection

import mpcam as mp
from mpcam.experiments.hou2006_scenes import reflection_scene

FORMAT = "png"


@functools.cache
def parts():
    """Outlines (F, 3, 2) of the camera triangles in the eye's picture, and the picture of the atlas."""
    scene = reflection_scene(width=400, height=300)
    assert scene.mirror
    cams = mp.decompose(scene.mirror.surface, scene.camera, 26, resolution=96)
    seen = scene.camera.project(cams.vertices[cams.faces]).pixel[..., 0, :]
    picture = mp.render(scene.camera, scene, triangles=26, resolution=96)
    atlas = mp.render(cams, mp.Scene(scene.meshes, lights=scene.lights, ambient=scene.ambient))
    return seen, *(np.clip(image, 0, 1) ** (1 / 2.2) for image in (picture, atlas))


def draw(theme):
    seen, picture, atlas = parts()
    figure, axes = pyplot.subplots(
        1, 2, figsize=(theme.width, 3.0), width_ratios=(400 / 300, atlas.shape[1] / atlas.shape[0])
    )
    axes[0].imshow(picture, interpolation="antialiased")
    axes[0].add_collection(PolyCollection(seen, facecolor="none", edgecolor="#ffb000", linewidth=0.8))
    axes[0].set_title("26 camera triangles on a wavy mirror")
    axes[1].imshow(atlas, interpolation="antialiased")
    axes[1].set_title("Their atlas")
    for one in axes:
        one.set_axis_off()
    return figure
