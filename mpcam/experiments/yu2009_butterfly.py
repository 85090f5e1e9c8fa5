"""A stand-in for the butterfly scene of Yu et al. 2009, Fig. 8: butterflies and flowers around a mirror sphere.

The paper's models are not public: these are made by formula. Metres, z up; sky where rays miss everything.
"""

import numpy as np

from mpcam.cameras.pinhole import Pinhole
from mpcam.errors import InputError
from mpcam.experiments.hou2006_scenes import AMBIENT, sky
from mpcam.experiments.hou2006_solids import octahedron, placed, plane
from mpcam.geometry.mesh import Material
from mpcam.geometry.shapes import Builder, MeshPart, copies, join, placements, quads, unit
from mpcam.geometry.surfaces import Surface
from mpcam.geometry.textures import plaster, rgb, textured
from mpcam.math.pose import look_at
from mpcam.scene.mirror import Mirror
from mpcam.scene.scene import DirectionalLight, Scene

TRIANGLES = 1_100
FEWEST = 400
CENTER, RADIUS = np.array([0.0, 0.0, 1.45]), 1.0
EYE = np.array([0.4, -5.2, 2.3])
SUN = DirectionalLight((-0.45, 0.35, -0.8), (0.8, 0.77, 0.7))
_PLAIN = Material((1.0, 1.0, 1.0), None, "painted")
_WINGS = ("#e8862a", "#3f7fd0", "#f0c93a", "#c9447f", "#8a5cc4", "#d8432f", "#43b0a0", "#f3efe4")
_PETALS = ("#e2557f", "#f4d03f", "#f5f2ea", "#9b6bd3", "#ef7d3b")


def butterfly_scene(triangles: int = TRIANGLES, width: int = 800, height: int = 600) -> Scene:
    """Butterflies and flowers around a mirror sphere, with exactly so many triangles.

    A tenth of them is the meadow, about 0.55 are butterflies, 0.25 flowers; blades of grass make up the number. Raises
    InputError for fewer than FEWEST triangles.
    """
    if triangles < FEWEST:
        raise InputError(f"butterfly_scene({triangles}): give {FEWEST} triangles or more")
    rng = np.random.default_rng(3)
    builder = Builder()
    pieces = int(np.sqrt(0.05 * triangles))
    meadow = textured("meadow", plaster("#86a552", 41, contrast=0.16))
    ground = plane((-7.0, -7.0), (7.0, 7.0), pieces)
    builder.add(MeshPart(ground.vertices, ground.faces, ground.normals, 0.4 * ground.uv), meadow)
    one, flower = butterfly(_WINGS[0]), blossom(_PETALS[0])
    for number, matrix in enumerate(_flight(round(0.55 * triangles / one.count), rng)):
        builder.add(copies(butterfly(_WINGS[number % len(_WINGS)], 0.5 + 0.4 * np.sin(2.4 * number)), matrix), _PLAIN)
    for number, matrix in enumerate(_beds(round(0.25 * triangles / flower.count), rng)):
        builder.add(copies(blossom(_PETALS[number % len(_PETALS)]), matrix), _PLAIN)
    if builder.count < triangles:
        builder.add(_grass(triangles - builder.count, rng), _PLAIN)
    return Scene(
        (builder.mesh(f"butterflies {triangles}"),),
        Pinhole.from_fov(width, height, np.radians(42.0), camera_from_world=look_at(EYE, CENTER - (0, 0, 0.12))),
        (SUN,),
        ambient=AMBIENT,
        name="butterflies",
        mirror=Mirror(Surface.sphere(RADIUS, CENTER), color=(0.95, 0.96, 0.97)),
        environment=sky(),
    )


def butterfly(code: str, lift: float = 0.6) -> MeshPart:
    """A butterfly of 36 triangles, about 1 wide, its head at +y. lift: of the wings, radians from level."""
    tint, dark, light = np.array(rgb(code)), np.array(rgb("#2a2220")), np.array(rgb("#fff3d6"))
    parts = []
    lobes = (
        [(0.0, 0.06), (0.13, 0.24), (0.34, 0.40), (0.52, 0.38), (0.50, 0.20), (0.34, 0.04), (0.10, -0.01)],
        [(0.0, 0.02), (0.16, 0.00), (0.36, -0.04), (0.40, -0.20), (0.26, -0.36), (0.12, -0.30), (0.0, -0.08)],
    )
    c, s = np.cos(lift), np.sin(lift)
    for side in (1.0, -1.0):
        for rim in lobes:
            flat = np.array([np.mean(rim, axis=0), *rim])
            points = np.stack([side * flat[:, 0] * c, flat[:, 1], flat[:, 0] * s], axis=1)
            order = np.array([(0, k + 1, (k + 1) % len(rim) + 1) for k in range(len(rim))])
            faces = order[:, ::-1] if side > 0 else order
            rise = np.broadcast_to((-side * s, 0.0, c), points.shape)
            edge = np.r_[0.0, np.where(np.hypot(*np.array(rim).T) > 0.3, 1.0, 0.15)]
            colors = (1 - edge[:, None]) * (0.75 * tint + 0.25 * light) + edge[:, None] * (0.3 * dark + 0.7 * tint)
            parts.append(MeshPart(points, faces, rise, flat, colors))
    body = placed(octahedron(), (0.0, 0.02, 0.0), (0.07, 0.5, 0.07), 0.0)
    parts.append(MeshPart(body.vertices, body.faces, body.normals, body.uv, np.broadcast_to(dark, body.vertices.shape)))
    return join(parts)


def blossom(code: str) -> MeshPart:
    """A flower of 20 triangles, 1 high: a stem, a leaf, six petals and a middle."""
    green, tint, gold = np.array(rgb("#4f8a3a")), np.array(rgb(code)), np.array(rgb("#f2b632"))
    stem = quads([[(-0.015, 0, 0), (0.015, 0, 0), (0.012, 0, 0.9), (-0.012, 0, 0.9)]])
    leaf = quads([[(0, 0, 0.1), (0.16, 0.05, 0.3), (0.3, 0.04, 0.5), (0.08, 0.04, 0.36)]])
    turn = np.pi / 3 * np.arange(6)
    ways, across = np.stack([np.cos(turn), np.sin(turn)], 1), np.stack([-np.sin(turn), np.cos(turn)], 1)
    rims = [
        (0.03 * ways, 0.9),
        (0.17 * ways - 0.09 * across, 0.97),
        (0.3 * ways, 0.98),
        (0.17 * ways + 0.09 * across, 0.97),
    ]
    petals = quads(np.stack([np.c_[at, np.full(6, z)] for at, z in rims], axis=1))
    middle = quads(
        [
            [
                (*(0.07 * ways[0]), 0.95),
                (*(0.07 * across[0]), 0.95),
                (*(-0.07 * ways[0]), 0.95),
                (*(-0.07 * across[0]), 0.95),
            ]
        ]
    )
    middle = join(
        [middle, quads([[(-0.06, -0.06, 0.955), (0.06, -0.06, 0.955), (0.06, 0.06, 0.955), (-0.06, 0.06, 0.955)]])]
    )
    parts = []
    for part, color in ((stem, green), (leaf, 1.2 * green), (petals, tint), (middle, gold)):
        shade = np.broadcast_to(color, part.vertices.shape).copy()
        if part is petals:
            shade[::4] *= 0.6
        parts.append(MeshPart(part.vertices, part.faces, part.normals, part.uv, np.clip(shade, 0, 1)))
    return join(parts)


def _flight(count: int, rng: np.random.Generator) -> np.ndarray:
    """Frames of butterflies, evenly in all directions from the sphere but not between it and the eye."""
    step = np.arange(4 * count) + 0.5
    up = 1.0 - 1.35 * step / len(step)
    turn = np.pi * (1 + 5**0.5) * step
    ways = np.stack([np.cos(turn) * np.sqrt(1 - up**2), np.sin(turn) * np.sqrt(1 - up**2), up], axis=1)
    ways = ways[ways @ unit(EYE - CENTER) < 0.88]
    ways = ways[np.linspace(0, len(ways) - 1, count).round().astype(int)]
    places = CENTER + ways * rng.uniform(1.6, 2.9, (count, 1))
    places[:, 2] = np.maximum(places[:, 2], 0.35)
    sizes = rng.uniform(0.6, 1.0, count)
    # They turn about the vertical, and lean so that their backs are towards the sphere.
    frames = placements(places, rng.uniform(0, 2 * np.pi, count), sizes)
    for frame, way in zip(frames, ways, strict=True):
        back = unit(np.array([0.0, 0.0, 0.45]) - 0.9 * way)
        ahead = unit(np.cross(back, unit(rng.normal(size=3))))
        frame[:3, :3] = np.linalg.norm(frame[:3, 0]) * np.stack([np.cross(ahead, back), ahead, back], axis=1)
    return frames


def _beds(count: int, rng: np.random.Generator) -> np.ndarray:
    """Frames of flowers on the meadow, around the sphere."""
    turn, way = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(1.2**2, 3.4**2, count))
    places = np.stack([way * np.cos(turn), way * np.sin(turn), np.zeros(count)], axis=1)
    return placements(places, rng.uniform(0, 2 * np.pi, count), rng.uniform(0.55, 1.0, count))


def _grass(count: int, rng: np.random.Generator) -> MeshPart:
    """Blades of one triangle each."""
    turn, way = rng.uniform(0, 2 * np.pi, count), np.sqrt(rng.uniform(1.0, 4.5**2, count))
    foot = np.stack([way * np.cos(turn), way * np.sin(turn), np.zeros(count)], axis=1)
    aside, tall = rng.uniform(0, 2 * np.pi, count), rng.uniform(0.18, 0.42, count)
    half = 0.03 * np.stack([np.cos(aside), np.sin(aside), np.zeros(count)], axis=1)
    lean = rng.normal(0, 0.08, (count, 3)) * (1, 1, 0)
    points = np.stack([foot - half, foot + half, foot + lean + tall[:, None] * np.array([0, 0, 1.0])], axis=1)
    normals = unit(np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]))
    tone = np.array(rgb("#6b9a3f")) * rng.uniform(0.7, 1.25, (count, 1))
    colors = np.stack([0.7 * tone, 0.7 * tone, np.minimum(1.3 * tone, 1)], axis=1)
    flat = np.zeros((3 * count, 2))
    faces = np.arange(3 * count).reshape(-1, 3)
    return MeshPart(points.reshape(-1, 3), faces, np.repeat(normals, 3, axis=0), flat, colors.reshape(-1, 3))
