"""A teapot through glass: traced, and by depth images, with the second interface marched, guessed, and left out."""

import functools

import numpy as np

from mpcam.effects.refraction import Refraction
from mpcam.experiments.rosen2011_scenes import refraction_scene

FORMAT = "png"


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each."""
    scene = refraction_scene(width=400, height=300)
    found = {
        "Traced: the truth": {"method": "raytrace"},
        "Depth images, both interfaces": {},
        "Second interface guessed (Wyman)": {"second": "wyman"},
        "First interface alone": {"second": "none"},
        "Depth images of pinholes": {"aside": 0.0},
        "Environment map": {"method": "environment"},
    }
    images = {title: Refraction(scene, **settings).image() for title, settings in found.items()}
    return {title: np.clip(image, 0, 1) ** (1 / 2.2) for title, image in images.items()}


def draw(theme):
    return theme.pictures(pictures(), 4.4, rows=2)
