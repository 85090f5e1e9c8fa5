"""Two mirror balls with one bounce and with two, and a glass ball."""

import functools

import numpy as np

import mpcam as mp
from mpcam.decomposition.chaining import chained
from mpcam.decomposition.decompose import decompose
from mpcam.decomposition.resolve import Resolver
from mpcam.geometry.surfaces import Surface

FORMAT = "png"
LEFT, RIGHT = Surface.sphere(1.0, (-1.1, 0, 1.2)), Surface.sphere(1.0, (1.1, 0.3, 1.2))
BALL = Surface.sphere(1.2, (0, 0, 1.4))


def street():
    """The facades of a street, with light from all sides."""
    scene = mp.builtin_scene("facade")
    return mp.Scene(scene.meshes, None, scene.lights, ambient=(0.35, 0.36, 0.4), background=(0.45, 0.62, 0.88))


@functools.cache
def pictures():
    """Title and (H, W, 3) picture of each view."""
    scene, found = street(), {}
    camera = mp.Pinhole(400, 320, 420, camera_from_world=mp.look_at((0, -4.6, 1.9), (0, 0, 1.25)))
    behind = mp.render(camera, scene)
    once, twice = behind, behind
    for one, other in ((LEFT, RIGHT), (RIGHT, LEFT)):
        cams = decompose(one, camera, 400)
        gray = mp.Scene((*scene.meshes, other.mesh(5_000)), None, scene.lights, scene.ambient, scene.background)
        resolve = Resolver(cams, one, camera)
        first = mp.render(cams, gray)
        chain = chained(cams, other, reflector=one)
        second = mp.render(chain.camera, scene)
        nearer = mp.depth_map(cams, scene).depth
        once, twice = resolve(first, once), resolve(chain.combined(first, second, nearer), twice)
    found["One bounce: the other ball is gray"], found["Two bounces"] = once, twice
    cams = decompose(BALL, camera, 400, index=1.5)
    chain = chained(cams, BALL, 1 / 1.5, reflector=BALL)
    inside = chain.combined(np.zeros((cams.height, cams.width, 3)), mp.render(chain.camera, scene))
    found["A glass ball: two interfaces"] = Resolver(cams, BALL, camera)(inside, behind)
    return {title: np.clip(picture, 0, 1) ** (1 / 2.2) for title, picture in found.items()}


def draw(theme):
    return theme.pictures(pictures(), 2.2)
