"""A stand-in for the city of Yu et al. 2009, Fig. 1: a street of 15,000 triangles, and a cross-slit camera before it.

The paper's model is not public: this one is made by formula. Metres, z up; the street runs along x, its houses look
to +y.
"""

import numpy as np

from mpcam.cameras.general_linear import GeneralLinear
from mpcam.errors import InputError
from mpcam.experiments.hou2006_scenes import AMBIENT, sky
from mpcam.geometry.facade_house import Detail, Palette, Pieces, house_details
from mpcam.geometry.mesh import Material, Mesh
from mpcam.geometry.shapes import Builder, boxes, copies, ellipsoid, lathe, loft, placements, quads
from mpcam.geometry.textures import noise, painted, plaster, rgb, textured, tiles
from mpcam.scene.scene import DirectionalLight, Scene

TRIANGLES = 15_000
FEWEST = 11_000
LENGTH = 136.0
"""Of the street. The strip shows `EXTENT` of it."""
EXTENT = (100.0, 31.25)
"""Width and height of what the strip shows where the fronts of the houses are."""
PATH, FAR_SLIT, HEIGHT = 21.0, 75.0, 5.0
"""Distances of the two slits from the fronts, and the height of the one along the street."""
HOUSES = 15
SUN = DirectionalLight((-0.5, -0.75, -0.9), (0.86, 0.82, 0.74))


def city(triangles: int = TRIANGLES) -> Mesh:
    """The street, with exactly so many triangles. Raises InputError for an odd number, or fewer than FEWEST."""
    if triangles < FEWEST or triangles % 2:
        raise InputError(f"city({triangles}): give an even number from {FEWEST} on")
    details, fixed = _houses(), [*_ground(), *_towers(), *_trees(), *_cars(), *_lamps()]
    chosen = [detail.plain for detail in details]
    count = sum(part.count for part, _ in fixed) + sum(part.count for parts in chosen for part, _ in parts)
    for number in sorted(range(len(details)), key=lambda k: details[k].tier):
        cost = details[number].cost
        if details[number].fancy and count + cost <= triangles:
            chosen[number] = details[number].fancy
            count += cost
    builder = Builder()
    for part, material in [*fixed, *(piece for parts in chosen for piece in parts)]:
        builder.add(part, material)
    if count < triangles:
        builder.add(*_stones((triangles - count) // 2))
    return builder.mesh("city")


def strip_camera(x: float = 0.0, width: int = 1024, height: int = 320) -> GeneralLinear:
    """A cross-slit camera that looks at the street from beside it.

    One slit runs along the street, the other stands upright far behind it, so that the strip is seen from many places
    from side to side, and from one height.
    """
    along = ((x, PATH, HEIGHT), (1.0, 0.0, 0.0))
    upright = ((x, FAR_SLIT, HEIGHT), (0.0, 0.0, 1.0))
    return GeneralLinear.cross_slit(width, height, along, upright, (x, 0.0, 11.6), EXTENT)


def city_scene(triangles: int = TRIANGLES, width: int = 1024, height: int = 320) -> Scene:
    """The street with its camera, sun and sky."""
    return Scene(
        (city(triangles),),
        strip_camera(0.0, width, height),
        (SUN,),
        ambient=AMBIENT,
        name="city",
        environment=sky(),
    )


def _houses() -> list[Detail]:
    """A row of houses, all different."""
    rng = np.random.default_rng(12)
    widths = LENGTH * rng.dirichlet(np.full(HOUSES, 70.0))
    starts = -0.5 * LENGTH + np.concatenate([[0], np.cumsum(widths)[:-1]])
    found = []
    for number, (start, width) in enumerate(zip(starts, widths, strict=True)):
        place = placements([(start + 0.01, 0.0, 0.14)])[0]
        found += [detail.moved(place) for detail in house_details(width - 0.02, number, rng)]
    return found


def _ground() -> Pieces:
    """Pavements, the road between them, and lawn behind the houses."""
    half = 0.5 * LENGTH + 30.0

    def floor(y0: float, y1: float, z: float, scale: float):
        corners = np.array([(-half, y0, z), (half, y0, z), (half, y1, z), (-half, y1, z)])
        return quads(corners, corners[:, :2] / scale)

    pavement = textured("pavement", tiles(["#c2b9aa", "#b3ab9c"], "#8a837a", 12))
    return [
        (floor(-60.0, -9.0, 0.0, 6.0), textured("lawn", plaster("#7f9a58", 41))),
        (floor(-9.0, 3.6, 0.14, 1.6), pavement),
        (floor(3.6, 12.4, 0.0, 1.8), textured("asphalt", plaster("#6f7075", 11))),
        (floor(12.4, 16.0, 0.14, 1.6), pavement),
        (boxes((-half, 3.5, 0.0), (half, 3.62, 0.15), "YZ"), painted("kerb", "#a39d92")),
    ]


def _towers() -> Pieces:
    """Tall plain houses in two rows behind, with a window on each floor of each bay."""
    rng = np.random.default_rng(5)
    walls = [painted(f"tower {code}", code) for code in ("#c9a58a", "#8fa6b8", "#d8cdb4", "#b98273", "#9fb3a3")]
    glass = [painted(f"glass {code}", code) for code in ("#3d5a73", "#5b7f96", "#e7d9a0")]
    pieces: Pieces = []
    for row, (y, count) in enumerate(((-24.0, 9), (-44.0, 8))):
        places = np.linspace(-0.56, 0.56, count) * LENGTH + rng.uniform(-3, 3, count)
        for number, x in enumerate(places):
            floors, bays = int(rng.integers(8, 13)) + 3 * row, int(rng.integers(4, 7))
            width, height = 2.4 * bays, 3.1 * floors
            low = np.array([x - 0.5 * width, y - 10.0, 0.0])
            wall = walls[(number + 2 * row) % len(walls)]
            pieces.append((boxes(low, low + (width, 10.0, height), "xXYZ"), wall))
            bay, floor = (part.ravel() for part in np.meshgrid(np.arange(bays), np.arange(3, floors)))
            left, bottom = low[0] + 2.4 * bay + 0.55, 3.1 * floor + 0.8
            corners = [(left + 1.3, bottom), (left, bottom), (left, bottom + 1.6), (left + 1.3, bottom + 1.6)]
            panes = np.stack([np.stack([u, np.full_like(u, y + 0.04), v], -1) for u, v in corners], axis=1)
            lit = rng.random(len(panes)) < 0.12
            dark = glass[number % 2]
            pieces += [(quads(some), what) for some, what in ((panes[~lit], dark), (panes[lit], glass[2])) if len(some)]
    return pieces


def _trees() -> Pieces:
    """Trees along the pavement."""
    rng = np.random.default_rng(8)
    trunk = lathe([(0.17, 0.0), (0.12, 1.2), (0.09, 2.9)], 6)
    crown = ellipsoid((0, 0, 0), (1.0, 1.0, 1.15), 7, 10)
    shape = 1 + 0.16 * np.sin(5 * crown.vertices[:, :1] + 3) * np.cos(7 * crown.vertices[:, 1:2])
    crown = type(crown)(crown.vertices * shape, crown.faces, crown.normals, crown.uv)
    at = np.linspace(-0.5, 0.5, 13) * (LENGTH + 8.0) + rng.uniform(-1.5, 1.5, 13)
    place = np.stack([at, np.full(13, 2.7), np.full(13, 0.14)], axis=1)
    size = rng.uniform(1.05, 1.45, 13)
    tints = np.array([rgb(code) for code in ("#5f8a3e", "#7a9c45", "#4d7a45", "#c29a3f", "#8aa552")])
    pieces: Pieces = [(copies(trunk, placements(place)), painted("trunk", "#6b4f3a"))]
    leaves = textured("leaves", np.clip(0.85 + 0.14 * noise(64, 3, 1.2), 0, 1)[..., None].repeat(3, 2).astype("f4"))
    for lift, share, aside in ((3.6, 1.0, 0.0), (4.6, 0.66, 0.5), (3.3, 0.7, -0.8)):
        matrices = placements(place + np.stack([aside * size, 0 * size, lift + 0 * size], 1), at, share * size)
        pieces.append((copies(crown, matrices, tints[np.arange(13) % len(tints)]), leaves))
    return pieces


def _cars() -> Pieces:
    """Cars on both lanes."""
    rng = np.random.default_rng(21)
    body = loft(
        [(x, 0, z) for x, z in ((-2.0, 0.62), (-1.96, 0.62), (-1.2, 0.62), (1.2, 0.6), (1.96, 0.56), (2.0, 0.56))],
        [(0, 0), (0.78, 0.3), (0.86, 0.36), (0.86, 0.34), (0.78, 0.26), (0, 0)],
        *(10, (0, 1, 0), 5.0),
    )
    cabin = loft(
        [(x, 0, 1.12) for x in (-1.5, -1.3, -0.7, 0.4, 0.95)],
        [(0, 0), (0.62, 0.12), (0.68, 0.32), (0.68, 0.32), (0, 0)],
        *(10, (0, 1, 0), 5.0),
    )
    wheel = loft([(0, y, 0) for y in (-0.13, -0.12, 0.12, 0.13)], [0.0, 0.32, 0.32, 0.0], 10)
    wheels = copies(wheel, placements([(x, y, 0.32) for x in (-1.25, 1.25) for y in (-0.8, 0.8)]))
    colors = [painted(f"car {code}", code) for code in ("#b3322c", "#2c5f9e", "#e2b33a", "#e8e6df", "#3f7a5a")]
    pieces: Pieces = []
    at = np.linspace(-0.48, 0.48, 11) * LENGTH + rng.uniform(-3, 3, 11)
    for number, x in enumerate(at):
        lane, turn = ((5.6, 0.0), (8.6, np.pi))[number % 2]
        place = placements([(x, lane, 0.0)], [turn])
        parts = ((body, colors[number % len(colors)]), (cabin, painted("pane", "#2a3640")), (wheels, _rubber()))
        pieces += [(copies(part, place), what) for part, what in parts]
    return pieces


def _lamps() -> Pieces:
    """Street lamps."""
    pole = lathe([(0.12, 0.0), (0.07, 0.5), (0.05, 4.6)], 8)
    head = ellipsoid((0, 0, 4.85), (0.28, 0.28, 0.34), 6, 8)
    place = placements([(x, 3.1, 0.14) for x in np.linspace(-0.48, 0.48, 10) * LENGTH])
    return [(copies(pole, place), Palette.iron), (copies(head, place), painted("lamp", "#f6edc9"))]


def _rubber() -> Material:
    return painted("rubber", "#1d1d1f")


def _stones(count: int):
    """White stones along the middle of the road."""
    x = (np.linspace(-0.5, 0.5, count, endpoint=False) + 0.5 / count) * (LENGTH + 20.0)
    half = min(1.0, 0.3 * (LENGTH + 20.0) / count)
    corners = [(x - half, 6.95), (x + half, 6.95), (x + half, 7.15), (x - half, 7.15)]
    points = np.stack([np.stack([u, np.full_like(u, v), np.full_like(u, 0.02)], -1) for u, v in corners], axis=1)
    return quads(points), painted("stones", "#efece2")
