"""The Patio scene: a large furnished courtyard with a gallery, very large triangles and very small ones.

Stands in for the scene of that name in Gascuel et al. 2008, section 5.1 (560,000 triangles).
"""

import numpy as np

from mpcam.geometry.levels import Level
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.patio_furniture import add_furniture
from mpcam.geometry.patio_plants import add_plants
from mpcam.geometry.shapes import Builder, MeshPart, boxes, copies, join, lathe, placements, quads, smooth_curve
from mpcam.geometry.textures import door, painted, planks, plaster, roof_tiles, textured, tiles

_X, _Y = 12.0, 9.0  # half the size of the room
_IX, _IY = 9.4, 6.4  # half the size of the space inside the gallery
_OX, _OY = 6.6, 4.2  # half the size of the opening in the roof
_SLAB, _UPPER, _TOP = 3.4, 3.7, 7.0  # underside and floor of the gallery, underside of the roof


def patio(triangles: int) -> Mesh:
    """The courtyard, floor at z = 0, eye in the middle. triangles: 60,000 to 3,000,000; leaves make up the number."""
    builder = Builder()
    level = Level(np.sqrt(triangles / 560_000))
    _walls(builder)
    _roof(builder)
    _gallery(builder, level)
    add_furniture(builder, level)
    add_plants(builder, level, triangles)
    return builder.mesh("patio")


def _walls(builder: Builder) -> None:
    """Floor, four walls with a tiled foot, and doors along them on both floors."""
    floor = textured("floor tiles", tiles(["#c98b5e", "#e3cfa6"], "#8a7055", 61))
    foot = textured("wall tiles", tiles(["#2f5f8f", "#e9e4d2"], "#d8d2c0", 62))
    upper = textured("wall", plaster("#e8d3a4", 63))
    corners = np.array([(-_X, -_Y, 0), (_X, -_Y, 0), (_X, _Y, 0), (-_X, _Y, 0)])
    builder.add(quads(corners, corners[:, :2] / 2.0), floor)
    for bottom, top, scale, material in ((0.0, 1.2, 1.2, foot), (1.2, _SLAB, 3.0, upper), (_UPPER, _TOP, 3.0, upper)):
        inside = boxes((-_X, -_Y, bottom), (_X, _Y, top), "xXyY")
        builder.add(MeshPart(inside.vertices, inside.faces[:, [0, 2, 1]], -inside.normals, inside.uv / scale), material)
    outside = boxes((-_X - 0.3, -_Y - 0.3, 0), (_X + 0.3, _Y + 0.3, _TOP), "xXyY")
    builder.add(MeshPart(outside.vertices, outside.faces, outside.normals, outside.uv / 3.0), upper)
    # a door leaf and its frame, standing on y = 0 and seen from +y
    leaf = quads([(0.55, 0.03, 0.0), (-0.55, 0.03, 0.0), (-0.55, 0.03, 2.3), (0.55, 0.03, 2.3)])
    frame = [boxes((0.55, 0, 0), (0.7, 0.1, 2.3), "xXY"), boxes((-0.7, 0, 0), (-0.55, 0.1, 2.3), "xXY")]
    frame = join([*frame, boxes((-0.78, 0, 2.3), (0.78, 0.16, 2.48), "xXYzZ")])
    spots, turns = [], []
    for z in (0.0, _UPPER):
        for x in (-7.2, -2.4, 2.4, 7.2):
            spots += [(x, -_Y, z), (x, _Y, z)]
            turns += [0.0, np.pi]
        for y in (-4.2, 0.0, 4.2):
            spots += [(_X, y, z), (-_X, y, z)]
            turns += [np.pi / 2, -np.pi / 2]
    matrices = placements(spots, turns)
    builder.add(copies(leaf, matrices), textured("door", door("#3f6f66")))
    builder.add(copies(frame, matrices), painted("door frame", "#8a5a38"))


def _roof(builder: Builder) -> None:
    """A boarded ceiling with an opening, rafters across it, and tiled slopes above."""
    boards = textured("ceiling", planks("#9a6a42", 64))
    wood = textured("rafter", planks("#7a4f30", 65))
    z = _TOP
    for x0, y0, x1, y1 in ((-_X, _OY, _X, _Y), (-_X, -_Y, _X, -_OY), (-_X, -_OY, -_OX, _OY), (_OX, -_OY, _X, _OY)):
        corners = np.array([(x0, y1, z), (x1, y1, z), (x1, y0, z), (x0, y0, z)])
        builder.add(quads(corners, corners[:, :2] / 2.0), boards)
    rim = z + 0.7
    well = boxes((-_OX, -_OY, z), (_OX, _OY, rim), "xXyY")
    builder.add(MeshPart(well.vertices, well.faces[:, [0, 2, 1]], -well.normals, well.uv), wood)
    across = np.arange(-6.0, 6.1, 1.2)
    low = np.stack([across - 0.07, np.full(len(across), -_OY), np.full(len(across), z + 0.2)], axis=1)
    high = np.stack([across + 0.07, np.full(len(across), _OY), np.full(len(across), z + 0.42)], axis=1)
    builder.add(boxes(low, high, "xXzZ"), wood)
    # the slopes go from the eaves of the outer walls up to the rim of the opening
    ex, ey = _X + 0.3, _Y + 0.3
    outer = [(-ex, -ey, z), (ex, -ey, z), (ex, ey, z), (-ex, ey, z)]
    inner = [(-_OX, -_OY, rim), (_OX, -_OY, rim), (_OX, _OY, rim), (-_OX, _OY, rim)]
    slopes = [[outer[k], outer[(k + 1) % 4], inner[(k + 1) % 4], inner[k]] for k in range(4)]
    uv = np.array([(0, 0), (12, 0), (9, 4), (3, 4)], dtype=float)
    builder.add(quads(slopes, uv), textured("roof", roof_tiles("#b05c3c", 66)))


def _ring(spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (N, 2) on the edge of the gallery, corners included, and the angle of the edge after each."""
    corners = np.array([(-_IX, -_IY), (_IX, -_IY), (_IX, _IY), (-_IX, _IY)])
    points, turns = [], []
    for k in range(4):
        step = corners[(k + 1) % 4] - corners[k]
        count = max(round(np.abs(step).max() / spacing), 1)
        points.append(corners[k] + np.arange(count)[:, None] / count * step)
        turns.append(np.full(count, np.arctan2(step[1], step[0])))
    return np.concatenate(points), np.concatenate(turns)


def _arch(width: float, segments: int) -> MeshPart:
    """The wall above an arch, from z = 2.3 to the gallery, standing along x from 0 to the width."""
    radius, thick = width / 2 - 0.2, 0.15
    angle = np.linspace(np.pi, 0, segments + 1)
    x, z = width / 2 + radius * np.cos(angle), 2.3 + 0.8 * np.sin(angle)
    z[[0, -1]] = 2.3
    x, z = np.concatenate([[0.0], x, [width]]), np.concatenate([[2.3], z, [2.3]])
    front = np.stack([np.stack([x[:-1], z[:-1]], 1), np.stack([x[1:], z[1:]], 1)], axis=1)
    top = front[:, ::-1].copy()
    top[:, :, 1] = _SLAB
    flat = np.concatenate([front, top], axis=1)
    faces = [np.insert(flat, 1, -thick, axis=2), np.insert(flat[:, ::-1], 1, thick, axis=2)]
    below = np.stack([front[:, 0], front[:, 1], front[:, 1], front[:, 0]], axis=1)
    soffit = np.insert(below, 1, 0.0, axis=2)
    soffit[:, :, 1] = (thick, thick, -thick, -thick)
    return quads(np.concatenate([*faces, soffit]), np.array([(0, 0), (0.1, 0), (0.1, 0.3), (0, 0.3)]))


def _gallery(builder: Builder, level: Level) -> None:
    """Columns with arches, the floor of the gallery, columns above, and a railing of turned balusters."""
    stone = textured("column stone", plaster("#ddd0b6", 67, contrast=0.05))
    wall = textured("arch wall", plaster("#ead9b2", 68))
    boards = textured("gallery floor", planks("#a87a50", 69))
    z = _SLAB
    x, y = _IX - 0.32, _IY - 0.32  # the floor reaches past the columns
    slabs = [((-_X, y, z), (_X, _Y, _UPPER), "y"), ((-_X, -_Y, z), (_X, -y, _UPPER), "Y")]
    slabs += [((x, -y, z), (_X, y, _UPPER), "x"), ((-_X, -y, z), (-x, y, _UPPER), "X")]
    for low, high, edge in slabs:
        builder.add(boxes(low, high, edge), wall)
        plate = boxes(low, high, "zZ")
        builder.add(MeshPart(plate.vertices, plate.faces, plate.normals, plate.uv / 2.0), boards)
    spots, turns = _ring(2.35)
    segments = level(24, 6)
    foot = [(0.28, 0.0), (0.28, 0.12), (0.22, 0.2), (0.2, 0.3)]
    shaft = [(0.2, 0.3), *[(0.2 - 0.03 * t**2, 0.3 + 1.6 * t) for t in np.linspace(0, 1, level(10, 3))[1:]]]
    head = [(0.17, 1.9), (0.2, 1.95), (0.2, 2.0), (0.28, 2.2), (0.28, 2.3)]
    column = join([lathe(piece, segments, smooth=k == 1) for k, piece in enumerate((foot, shaft, head))])
    column = join([column, boxes((-0.3, -0.3, 2.2), (0.3, 0.3, 2.3))])
    builder.add(copies(column, placements(np.insert(spots, 2, 0.0, axis=1))), stone)
    slim = [(0.16, _UPPER), (0.16, 3.8), (0.1, 3.95), (0.09, 6.6), (0.16, 6.8), (0.16, _TOP)]
    builder.add(copies(lathe(slim, segments, smooth=False), placements(np.insert(spots, 2, 0.0, axis=1))), stone)
    for turn in np.unique(turns):
        side = spots[turns == turn]
        gap = float(np.abs(side[1] - side[0]).max())
        builder.add(copies(_arch(gap, level(16, 4)), placements(np.insert(side, 2, 0.0, axis=1), turn)), wall)
    _railing(builder, level)


def _railing(builder: Builder, level: Level) -> None:
    """Turned balusters under a rail."""
    spots, _ = _ring(0.15 / min(level.factor, 1.0))
    profile = [(0.045, 0.0), (0.045, 0.06), (0.02, 0.1), (0.04, 0.24), (0.045, 0.34), (0.025, 0.48)]
    profile += [(0.018, 0.62), (0.03, 0.68), (0.018, 0.74), (0.025, 0.82), (0.04, 0.88)]
    baluster = lathe(smooth_curve(profile, level(10, 4)), level(10, 5))
    builder.add(copies(baluster, placements(np.insert(spots, 2, _UPPER, axis=1))), painted("baluster", "#efe6d0"))
    a, z0, z1 = 0.06, _UPPER + 0.88, _UPPER + 0.96
    rails = [((-_IX - a, s * _IY - a, z0), (_IX + a, s * _IY + a, z1)) for s in (-1, 1)]
    rails += [((s * _IX - a, a - _IY, z0), (s * _IX + a, _IY - a, z1)) for s in (-1, 1)]
    for low, high in rails:
        builder.add(boxes(low, high), painted("rail", "#6e4528"))
