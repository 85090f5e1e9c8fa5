"""A walker from all sides at once, and what surrounds the walker, next to a pinhole picture."""

import functools

import numpy as np
from matplotlib import pyplot

import mpcam as mp
from mpcam.effects.visualization import surround, unrolled, walker_scene

FORMAT = "png"


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each view."""
    scene = walker_scene()
    pinhole = mp.Pinhole(260, 420, 420, camera_from_world=mp.look_at((1.6, -3.2, 1.5), (0, 0, 1.0)))
    inward = surround(
        (0, 0, 1.0), radius=0.95, height=2.1, columns=10, rows=20, slant=(0.12, -0.2), start=-3.0, resolution=27
    )
    outward = surround(
        (0, 0, 1.6), radius=0.3, height=0.2, columns=20, rows=10, inward=False, slant=(-1.0, 0.57), resolution=37
    )
    found = {"Pinhole": mp.render(pinhole, scene)}
    for title, cams in (("Looking in", inward), ("Looking out", outward)):
        found[title] = unrolled(cams, mp.render(cams, scene))
    return {title: np.clip(picture, 0, 1) ** (1 / 2.2) for title, picture in found.items()}


def draw(theme):
    figure, axes = pyplot.subplots(1, 3, figsize=(theme.width, 2.5), width_ratios=(260 / 420, 260 / 521, 2.0))
    for place, (title, picture) in zip(axes, pictures().items(), strict=True):
        place.imshow(picture, interpolation="antialiased")
        place.set_title(title)
        place.set_axis_off()
    return figure
