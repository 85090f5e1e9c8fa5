"""Stand-ins for the scenes of Hou et al. 2006, Table 1: a curved mirror, a water surface, a ring that light falls on.

The paper's models are not public: these have its numbers of triangles. Metres, z up; sky where rays miss everything.
"""

import dataclasses
import functools

import numpy as np

from mpcam.cameras.change import resized
from mpcam.cameras.pinhole import Pinhole
from mpcam.effects.environment import EnvironmentMap
from mpcam.errors import InputError
from mpcam.experiments.hou2006_solids import ball, box, cone, octahedron, placed, plane, prism
from mpcam.geometry.mesh import Material
from mpcam.geometry.shapes import Builder, quads
from mpcam.geometry.surfaces import Surface
from mpcam.geometry.textures import bricks, noise, painted, planks, plaster, rgb, textured, tiles
from mpcam.math.pose import look_at
from mpcam.scene.mirror import Mirror
from mpcam.scene.scene import DirectionalLight, PointLight, Scene

SHAPES = ("mixed", "convex", "concave")
"""Of the mirror of the reflection scene."""
FINE = (13, 32)
"""Pieces along an edge of the solids and of the floor in the fine scene: 106 x 13^2 + 2 x 32^2 = 19,962 triangles."""
SUN = DirectionalLight((0.45, 0.5, -0.75), (0.8, 0.77, 0.7))
AMBIENT = (0.3, 0.33, 0.38)


def reflection_scene(shape: str = "mixed", fine: bool = False, width: int = 800, height: int = 600) -> Scene:
    """108 triangles before a standing mirror, or about 20,000: a floor and solids, near to it and seen in it.

    shape of the mirror: "mixed" (waves), "convex" (a dome) or "concave" (a bowl). fine: round solids. Raises InputError
    for other shapes.
    """
    surfaces = {
        "mixed": (lambda: Surface.wave(2.7, 0.05, 1.0), 2.0),
        "convex": (lambda: Surface.paraboloid(1.35, -0.3), 5.0),
        "concave": (lambda: Surface.paraboloid(1.35, 0.1), -4.0),
    }
    if shape not in surfaces:
        raise InputError(f"reflection_scene({shape!r}): allowed are {', '.join(surfaces)}")
    surface, lean = surfaces[shape]
    pieces, floor = FINE if fine else (1, 1)
    builder, rounding = Builder(), 0.75 if fine else 0.0
    builder.add(plane((-7.0, -11.0), (7.0, 3.0), floor), textured("floor", checker("#e9e4d6", "#8a3b2e")))
    solids = (
        (box(), (0.0, 0.12, 0.09), (3.0, 0.3, 0.18), 0.0, _plain("#3c3a38"), 0.0),
        (box(), (-1.05, -1.15, 0.32), (0.62, 0.62, 0.64), 0.5, textured("bricks", bricks("#b2563a", "#d8cdbb", 3)), 1),
        (box(), (0.95, -2.3, 0.25), (0.5, 0.5, 0.5), -0.35, textured("wood", planks("#c79a55", 5)), 1),
        (ball(), (0.2, -0.95, 0.36), (0.72, 0.72, 0.72), 0.2, _plain("#e3b23c"), 1),
        (ball(), (-0.55, -2.15, 0.28), (0.56, 0.56, 0.56), 0.9, _plain("#2f7fb5"), 1),
        (octahedron(), (-1.75, -1.9, 0.42), (0.7, 0.7, 0.84), 0.3, _plain("#7a4fa3"), 0.3),
        (prism(6), (1.2, -1.1, 0.33), (0.58, 0.58, 0.66), 0.0, _plain("#3f9a63"), 0.5),
        (cone(12), (0.15, -3.0, 0.36), (0.64, 0.64, 0.72), 0.0, _plain("#d2452f"), 0.2),
    )
    for solid, place, size, turn, material, soft in solids:
        builder.add(placed(solid, place, size, turn, pieces, rounding * soft), material)
    # Its middle faces -y and leans back a little, or forward; it stands on the first box.
    c, s = np.cos(np.radians(lean)), np.sin(np.radians(lean))
    pose = np.array([(1.0, 0, 0, 0), (0, s, -c, 0.25), (0, c, s, 1.53), (0, 0, 0, 1)])
    eye = look_at((0.35, -5.6, 2.75), (0.0, -0.35, 1.3))
    return Scene(
        (builder.mesh("reflection"),),
        Pinhole.from_fov(width, height, np.radians(43.0), camera_from_world=eye),
        (SUN,),
        ambient=AMBIENT,
        name=f"{shape} mirror",
        mirror=Mirror(surface().transformed(pose), color=(0.93, 0.95, 0.96)),
        environment=sky(),
    )


def refraction_scene(width: int = 800, height: int = 600) -> Scene:
    """252 triangles: solids in a basin, seen through the curved surface of its water, index 1.33."""
    builder = Builder()
    x, y, deep, rim = 2.0, 2.0, -1.4, 0.06
    at = np.array([(-x, -y), (x, -y), (x, y), (-x, y)])
    blue = textured("pool", tiles(["#cfe3e6", "#a9ccd4", "#bcd9de"], "#f4f6f4", 7))
    builder.add(plane((-x, -y), (x, y), 1, deep), textured("bottom", checker("#e8e2cf", "#4a8fa8")))
    for a, b in zip(at, np.roll(at, -1, axis=0), strict=True):
        wall = [(*b, deep), (*a, deep), (*a, rim), (*b, rim)]
        builder.add(quads(wall, [(0, 0), (2, 0), (2, 0.73), (0, 0.73)]), blue)
        out = 1.6 * np.array([a, b])
        corners = np.array([(*out[0], rim), (*out[1], rim), (*b, rim), (*a, rim)])
        builder.add(quads(corners, corners[:, :2] / 1.2), textured("deck", planks("#b98d5c", 9)))
    solids = (
        (ball(2), (-0.75, 0.35, -0.95), (0.9, 0.9, 0.9), 0.0, textured("ball", stripes("#e0483a", "#f6efe0"))),
        (ball(2), (0.95, -0.75, -1.08), (0.64, 0.64, 0.64), 0.4, textured("ball", stripes("#2d6fb3", "#f6efe0"))),
        (octahedron(), (0.05, -0.95, -1.05), (0.6, 0.6, 0.7), 0.3, _plain("#7a4fa3")),
        (prism(6), (0.8, 0.75, -0.95), (0.7, 0.7, 0.9), 0.0, _plain("#3f9a63")),
        (box(), (-1.2, -0.95, -1.15), (0.5, 0.5, 0.5), 0.4, textured("box", bricks("#b2563a", "#d8cdbb", 3))),
        (box(), (0.1, 0.15, -1.3), (0.5, 0.9, 0.2), 0.9, _plain("#e3b23c")),
        (box(), (1.5, 0.1, -1.1), (0.3, 0.3, 0.6), 0.2, _plain("#d97c2b")),
        (box(), (-1.5, 1.45, -0.9), (0.4, 0.4, 1.0), 0.1, _plain("#d5d0c4")),
        (box(), (1.5, 1.5, -0.9), (0.4, 0.4, 1.0), 0.3, _plain("#d5d0c4")),
    )
    for solid, place, size, turn, material in solids:
        builder.add(placed(solid, place, size, turn), material)
    eye = look_at((0.5, -4.4, 3.7), (0.0, -0.1, -0.35))
    return Scene(
        (builder.mesh("refraction"),),
        Pinhole.from_fov(width, height, np.radians(46.0), camera_from_world=eye),
        (DirectionalLight((0.35, 0.45, -0.9), (0.8, 0.78, 0.72)),),
        ambient=AMBIENT,
        name="water",
        mirror=Mirror(
            Surface.wave(2 * x, 0.07, 1.0), index=1.33, color=(0.86, 0.96, 0.98), triangles=12, resolution=128
        ),
        environment=sky(),
    )


def caustics_scene(width: int = 640, height: int = 480) -> Scene:
    """2 triangles: a table top below half a metal ring, which is the scene's mirror; its last light is a lamp."""
    builder = Builder()
    builder.add(plane((-3.0, -3.0), (3.0, 3.0), 1), textured("table", plaster("#cfc8ba", 31, contrast=0.04)))
    eye = look_at((1.3, -2.5, 2.7), (0.0, 0.05, 0.1))
    half = np.array([(0.0, -1, 0, 0), (1, 0, 0, 0), (0, 0, 1, 0.3), (0, 0, 0, 1)])  # the middle of the patch at +y
    ring = Surface.cylinder(1.0, 0.6, np.pi).transformed(half)
    return Scene(
        (builder.mesh("caustics"),),
        Pinhole.from_fov(width, height, np.radians(44.0), camera_from_world=eye),
        (PointLight((0.6, -3.0, 2.2), (6.5, 6.1, 5.4)),),
        ambient=(0.12, 0.12, 0.14),
        name="ring",
        mirror=Mirror(ring, color=(0.95, 0.85, 0.6), triangles=400, resolution=64),
        environment=sky(),
    )


def light_of(scene: Scene) -> PointLight:
    """The scene's lamp. Raises InputError if there is none."""
    for light in scene.lights:
        if isinstance(light, PointLight):
            return light
    raise InputError(f"scene {scene.name!r} has no PointLight: give caustics_scene()")


def smaller(scene: Scene) -> Scene:
    """The scene with a quarter of its width and height and a mirror of 2,000 triangles, for quick runs."""
    camera, mirror = scene.camera, scene.mirror
    if mirror is not None and isinstance(mirror.surface, Surface):
        mirror = dataclasses.replace(mirror, surface=mirror.surface.mesh(2_000))
    return dataclasses.replace(scene, camera=resized(camera, camera.width // 4, camera.height // 4), mirror=mirror)


@functools.cache
def sky(size: int = 512) -> EnvironmentMap:
    """An evening sky with clouds over far hills."""
    height, width = size, 2 * size
    y, x = np.mgrid[0:height, 0:width]
    up = np.sin(np.pi * (0.5 - (y + 0.5) / height))
    low, high, haze = (np.array(rgb(code)) for code in ("#dfeaf2", "#2f66b0", "#fbe3c0"))
    tone = np.clip(up, 0, 1)[..., None] ** 0.55
    color = low * (1 - tone) + high * tone
    grain = np.tile(noise(height, 17, 0.2), (1, 2))
    cloud = np.clip(0.8 * (grain - 0.3), 0, 1) * np.clip(3.5 * up, 0, 1) ** 1.5
    color = color + (np.array([1.0, 0.98, 0.95]) - color) * cloud[..., None]
    color = color + (haze - color) * (0.55 * np.exp(-np.abs(up) / 0.07))[..., None]
    turn = 2 * np.pi * (x + 0.5) / width
    for level, (lift, code) in enumerate(((0.075, "#93a9b5"), (0.045, "#6f8a72"))):
        ridge = lift * (
            1 + 0.45 * np.sin(5 * turn + level) + 0.3 * np.sin(11 * turn + 2 * level) + 0.12 * np.sin(31 * turn)
        )
        color = np.where((up < ridge)[..., None], rgb(code), color)
    meadow = np.array(rgb("#7c8f5a")) * (0.9 + 0.06 * grain[..., None])
    color = np.where(
        (up < 0)[..., None], meadow + (np.array(rgb("#8fa08c")) - meadow) * np.exp(up / 0.12)[..., None], color
    )
    return EnvironmentMap.from_panorama(np.clip(color, 0, 1).astype(np.float32))


def checker(light: str, dark: str, size: int = 256, count: int = 2) -> np.ndarray:
    """A chessboard of count x count fields, a little uneven."""
    y, x = np.mgrid[0:size, 0:size] * count // size
    base = np.where(((x + y) % 2 == 0)[..., None], rgb(light), rgb(dark))
    return np.clip(base * (1 + 0.03 * noise(size, 23, 1.2))[..., None], 0, 1).astype(np.float32)


def stripes(first: str, second: str, size: int = 64) -> np.ndarray:
    """Two stripes along u."""
    x = np.broadcast_to(np.arange(size) * 2 // size, (size, size))
    return np.where((x % 2 == 0)[..., None], rgb(first), rgb(second)).astype(np.float32)


def _plain(code: str) -> Material:
    return painted(code, code)
