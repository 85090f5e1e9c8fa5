"""The Facade scene: a street between two rows of houses, few textured polygons, detail added house by house.

Stands in for the scene of that name in Gascuel et al. 2008, section 5.1 (600 to 4,900 triangles).
"""

import numpy as np

from mpcam.geometry.facade_house import Detail, house_details
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, MeshPart, boxes, copies, join, lathe, moved, quads
from mpcam.geometry.textures import cobbles, painted, plaster, textured, tiles

_ROAD = 3.6  # half the width of the carriageway
_FRONT = 6.0  # distance of the house fronts from the middle
_END = 27.0  # the rows of houses end here; a cross street follows
_FAR = 33.0  # fronts of the houses that close the view


def facade(triangles: int) -> Mesh:
    """The street along x, its middle at the origin. triangles: 600 to 4,900; met to within a few."""
    details = _street() + _houses() + _furniture()
    chosen = [detail.plain for detail in details]
    count = sum(part.count for parts in chosen for part, _ in parts)
    for number in sorted(range(len(details)), key=lambda k: details[k].turn):
        cost = details[number].cost
        if details[number].fancy and count + cost <= triangles:
            chosen[number] = details[number].fancy
            count += cost
    builder = Builder()
    for parts in chosen:
        for part, material in parts:
            builder.add(part, material)
    return builder.mesh("facade")


def _street() -> list[Detail]:
    """Carriageway, pavements with kerbs, and the cross streets at both ends."""
    road = textured("cobbles", cobbles("#85817a", "#4a4743", 11))
    pavement = textured("pavement", tiles(["#b9b2a6", "#ada698"], "#77716a", 12))
    kerb = painted("kerb", "#9a958c")

    def floor(x0, y0, x1, y1, z=0.0, scale=1.8) -> MeshPart:
        corners = np.array([(x0, y0, z), (x1, y0, z), (x1, y1, z), (x0, y1, z)])
        return quads(corners, corners[:, :2] / scale)

    parts = [
        (floor(-_END, -_ROAD, _END, _ROAD), road),
        (floor(_END, -60, _FAR, 60), road),
        (floor(-_FAR, -60, -_END, 60), road),
    ]
    for side in (-1, 1):
        y0, y1 = sorted((side * _ROAD, side * (_FRONT + 9.0)))
        parts.append((floor(-_END, y0, _END, y1, 0.14, 1.6), pavement))
        parts.append((boxes((-_END, y0, 0), (_END, y1, 0.14), "xX" + ("y" if side > 0 else "Y")), kerb))
    return [Detail(parts, [])]


def _houses() -> list[Detail]:
    """Five houses on each side and two at each end, all different, all from one seed."""
    rng = np.random.default_rng(4)
    details: list[Detail] = []
    sites = []
    for turn in (0.0, np.pi):
        widths = 2 * _END * rng.dirichlet(np.full(5, 60.0))
        starts = np.concatenate([[0], np.cumsum(widths)[:-1]])
        sites += [(turn, -_END + start, width, _FRONT) for start, width in zip(starts, widths, strict=True)]
    for turn in (np.pi / 2, -np.pi / 2):
        sites += [(turn, -12.0, 12.5, _FAR), (turn, 0.5, 11.5, _FAR)]
    for number, (turn, start, width, distance) in enumerate(sites):
        # a house is built with its front along x, seen from +y; here it is set down and turned to face the street
        place = np.eye(4)
        place[:3, 3] = (start + 0.01, -distance, 0.14 if distance == _FRONT else 0.0)
        rotate = np.eye(4)
        rotate[:2, :2] = [(np.cos(turn), -np.sin(turn)), (np.sin(turn), np.cos(turn))]
        matrix = np.rint(rotate) @ place
        for detail in house_details(width - 0.02, number, rng):
            details.append(detail.moved(matrix))
    return details


def _furniture() -> list[Detail]:
    """Lamps and tubs with clipped trees along the kerbs."""
    iron, glass = painted("iron", "#2a3230"), painted("lamp glass", "#fff0c0")
    clay, leaf = painted("clay", "#a8583a"), textured("hedge", plaster("#4d7a35", 31, contrast=0.18))
    pole = lathe([(0.16, 0.0), (0.1, 0.35), (0.05, 0.7), (0.04, 3.4)], 6, smooth=False)
    lantern = lathe([(0.0, 3.4), (0.1, 3.4), (0.2, 3.85)], 6, smooth=False)
    cap = join(
        [lathe([(0.24, 3.85), (0.0, 4.12)], 6, smooth=False), lathe([(0.0, 3.85), (0.24, 3.85)], 6, smooth=False)]
    )
    tub = lathe([(0.28, 0.0), (0.36, 0.55), (0.3, 0.55), (0.0, 0.5)], 8, smooth=False)
    crown = lathe([(0.0, 0.5), (0.42, 0.75), (0.5, 1.15), (0.36, 1.55), (0.0, 1.75)], 8)
    details = []
    for x in np.linspace(-22.5, 22.5, 6):
        for side in (-1, 1):
            spot = (x, side * (_ROAD + 0.45), 0.14)
            lamp = [(moved(pole, spot), iron), (moved(lantern, spot), glass), (moved(cap, spot), iron)]
            details.append(Detail([], lamp, 2))
            spot = (x + 4.0, side * (_FRONT - 0.75), 0.14)
            tree = [(moved(tub, spot), clay), (copies(crown, [_at(spot)]), leaf)]
            details.append(Detail([], tree, 3))
    return details


def _at(spot) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = spot
    return matrix
