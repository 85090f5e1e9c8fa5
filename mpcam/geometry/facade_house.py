"""One house of the Facade scene, as a plain version and details that replace or join it.

Local frame: the front stands along x from 0 to the width at y = 0 and is seen from +y; z is up.
"""

from dataclasses import dataclass

import numpy as np

from mpcam.geometry.mesh import Material
from mpcam.geometry.shapes import MeshPart, boxes, copies, join, quads
from mpcam.geometry.textures import bricks, door, painted, planks, plaster, roof_tiles, textured, window

Pieces = list[tuple[MeshPart, Material]]

_DEPTH = 9.0
_GROUND, _FLOOR = 3.5, 3.0  # heights of the ground floor and of those above
_RECESS = 0.18


@dataclass(frozen=True)
class Detail:
    """A piece of the scene: what is there always (plain), and what takes its place at more detail (fancy).

    tier: lower ones are made fancy first, of those that are equally near to the viewer.
    """

    plain: Pieces
    fancy: Pieces
    tier: float = 0.0

    @property
    def cost(self) -> int:
        return sum(part.count for part, _ in self.fancy) - sum(part.count for part, _ in self.plain)

    @property
    def turn(self) -> float:
        """The place in the line: 5 m nearer to the viewer at the origin weighs as much as one tier."""
        x, y, _ = np.concatenate([part.vertices for part, _ in self.fancy or self.plain]).mean(axis=0)
        return self.tier + float(np.hypot(x, y)) / 5.0

    def moved(self, matrix) -> "Detail":
        plain = [(copies(part, [matrix]), material) for part, material in self.plain]
        fancy = [(copies(part, [matrix]), material) for part, material in self.fancy]
        return Detail(plain, fancy, self.tier)


class Palette:
    """Materials, made once and shared by all houses."""

    walls = [
        textured("red brick", bricks("#a5553c", "#c9bba5", 1)),
        textured("ochre plaster", plaster("#dcb56e", 2)),
        textured("pale brick", bricks("#c7a27a", "#e0d6c4", 3)),
        textured("rose plaster", plaster("#d99a86", 4)),
        textured("white plaster", plaster("#ebe4d3", 5)),
        textured("blue plaster", plaster("#93aec0", 6)),
        textured("dark brick", bricks("#7c4636", "#a89a88", 7)),
        textured("green plaster", plaster("#a9ba8d", 8)),
    ]
    roofs = [textured("clay roof", roof_tiles("#b5563a", 21)), textured("slate roof", roof_tiles("#5c6670", 22))]
    windows = [
        textured("window", window("#f2efe6")),
        textured("curtained window", window("#f2efe6", "#e9dcc0")),
        textured("dark window", window("#4b3a2c", "#b8bcc8", 2, 2)),
    ]
    doors = [textured(f"door {code}", door(code)) for code in ("#2f5d50", "#7a2e26", "#27435f", "#5b3a21")]
    shutters = [textured(f"shutter {code}", planks(code, 9)) for code in ("#3f6b57", "#4a6785", "#8c4a3a")]
    stone = painted("stone", "#cfc6b4")
    iron = painted("railing", "#23282b")
    chimney = textured("chimney", bricks("#8f4a38", "#b5a48f", 10))


def house_details(width: float, number: int, rng: np.random.Generator) -> list[Detail]:
    """The details of one house. width: meters. number: which of the houses it is, it sets colors and turns."""
    floors = int(rng.choice([2, 3, 3, 4]))
    bays = max(int(width / 2.7), 2)
    wall = Palette.walls[number % len(Palette.walls)]
    height = _GROUND + _FLOOR * (floors - 1)
    ridge = height + rng.uniform(2.0, 3.0)
    roof = Palette.roofs[int(rng.integers(2))]
    glass = Palette.windows[int(rng.integers(3))]
    shutter = Palette.shutters[int(rng.integers(3))]
    entrance = int(rng.integers(bays))

    details = [Detail(_shell(width, height, ridge, wall, roof), [])]
    bay = width / bays
    for floor in range(floors):
        bottom = _GROUND + _FLOOR * (floor - 1) if floor else 0.0
        top = bottom + (_FLOOR if floor else _GROUND)
        sill = bottom + (0.85 if floor else 1.0)
        holes = np.array([(bay * (k + 0.5) - 0.55, sill, bay * (k + 0.5) + 0.55, sill + 1.7) for k in range(bays)])
        panes = [glass] * bays
        if floor == 0:
            holes[entrance] = (bay * (entrance + 0.5) - 0.6, bottom, bay * (entrance + 0.5) + 0.6, bottom + 2.5)
            panes[entrance] = Palette.doors[number % 4]
        details.append(
            Detail(
                _flat_storey(width, bottom, top, holes, panes, wall),
                _deep_storey(width, bottom, top, holes, panes, wall),
                1 if floor else 2,
            )
        )
        balcony = floor == 1 + number % 2 and bays > 2
        for k, hole in enumerate(holes):
            if floor == 0 and k == entrance:
                details.append(Detail([], _door_frame(hole), 3))
                continue
            details.append(_ledge(hole[0] - 0.1, hole[2] + 0.1, hole[1] - 0.12, hole[1], 0.14, 2.5))
            details.append(_ledge(hole[0] - 0.1, hole[2] + 0.1, hole[3], hole[3] + 0.2, 0.08, 4))
            if floor and balcony and k == bays // 2:
                details.append(Detail([], _balcony(hole, bottom), 3.5))
            elif floor and number % 3 != 2:
                details.append(Detail([], _shutters(hole, shutter), 3.8))
        if floor:
            details.append(_ledge(0.0, width, bottom - 0.1, bottom + 0.12, 0.1, 4.5))
    eaves = boxes((0.0, 0.0, height - 0.3), (width, 0.4, height + 0.02), "xXYzZ")
    details.append(Detail([], [(eaves, Palette.stone)], 1.5))
    details += _roof_details(width, height, ridge, glass, wall)
    return details


def _shell(width, height, ridge, wall, roof) -> Pieces:
    """Side walls, back wall, gables and the two slopes of the roof; the front is made storey by storey."""
    scale = 2.0
    middle = -_DEPTH / 2
    walls = [
        _upright((0, -_DEPTH), (0, 0), 0, height, scale),
        _upright((width, 0), (width, -_DEPTH), 0, height, scale),
        _upright((0, -_DEPTH), (width, -_DEPTH), 0, height, scale, flip=True),
    ]
    for x, towards in ((0.0, -1.0), (width, 1.0)):
        points = np.array([(x, -_DEPTH, height), (x, 0, height), (x, middle, ridge)])
        normal = np.tile((towards, 0.0, 0.0), (3, 1))
        faces = np.array([[0, 1, 2]]) if towards > 0 else np.array([[0, 2, 1]])
        walls.append(MeshPart(points, faces, normal, points[:, 1:] / scale))
    slope = np.hypot(ridge - height, _DEPTH / 2) / scale
    uv = np.array([(0, 0), (width / scale, 0), (width / scale, slope), (0, slope)])
    front = [(width, 0, height), (0, 0, height), (0, middle, ridge), (width, middle, ridge)]
    back = [(0, -_DEPTH, height), (width, -_DEPTH, height), (width, middle, ridge), (0, middle, ridge)]
    return [(join(walls), wall), (quads([front, back], uv), roof)]


def _upright(start, end, bottom, top, scale, flip=False) -> MeshPart:
    """A wall quad on the line from start to end (x, y), seen from its left side; flip: from its right side."""
    (x0, y0), (x1, y1) = (end, start) if flip else (start, end)
    length = np.hypot(x1 - x0, y1 - y0) / scale
    uv = np.array([(0, bottom / scale), (length, bottom / scale), (length, top / scale), (0, top / scale)])
    return quads([[(x1, y1, bottom), (x0, y0, bottom), (x0, y0, top), (x1, y1, top)]], uv)


def _front(rectangles, y: float) -> MeshPart:
    """Rectangles (x0, z0, x1, z1) in the plane of that y, seen from +y; uv along the wall, 2 m per tile."""
    r = np.atleast_2d(np.asarray(rectangles, dtype=np.float64))
    x = r[:, [2, 0, 0, 2]]
    z = r[:, [1, 1, 3, 3]]
    return quads(np.stack([x, np.full_like(x, y), z], axis=2), np.stack([-x, z], axis=2) / 2.0)


def _panes(holes, y: float, panes) -> Pieces:
    """Windows and doors in their holes, each with its whole texture."""
    pieces = []
    for hole, material in zip(holes, panes, strict=True):
        part = _front(hole, y)
        pieces.append(
            (
                MeshPart(part.vertices, part.faces, part.normals, np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)),
                material,
            )
        )
    return pieces


def _flat_storey(width, bottom, top, holes, panes, wall) -> Pieces:
    """One wall rectangle with the windows just before it."""
    return [(_front((0, bottom, width, top), 0.0), wall), *_panes(holes, 0.03, panes)]


def _deep_storey(width, bottom, top, holes, panes, wall) -> Pieces:
    """A wall with holes, their reveals, and the windows set back."""
    edges = np.concatenate([[0.0], holes[:, [0, 2]].ravel(), [width]]).reshape(-1, 2)
    solid = [(x0, bottom, x1, top) for x0, x1 in edges]
    solid += [(x0, z1, x1, top) for x0, _, x1, z1 in holes]
    solid += [(x0, bottom, x1, z0) for x0, z0, x1, _ in holes if z0 > bottom]
    low = np.stack([holes[:, 0], np.full(len(holes), -_RECESS), holes[:, 1]], axis=1)
    high = np.stack([holes[:, 2], np.zeros(len(holes)), holes[:, 3]], axis=1)
    # the inside of a box: its sides turned round
    reveal = boxes(low, high, "xXzZ")
    reveal = MeshPart(reveal.vertices, reveal.faces[:, [0, 2, 1]], -reveal.normals, reveal.uv)
    return [(_front(solid, 0.0), wall), (reveal, Palette.stone), *_panes(holes, -_RECESS, panes)]


def _ledge(x0, x1, z0, z1, reach, tier) -> Detail:
    """A stone bar along the front."""
    return Detail([], [(boxes((x0, 0.0, z0), (x1, reach, z1), "xXYzZ"), Palette.stone)], tier)


def _door_frame(hole) -> Pieces:
    x0, z0, x1, z1 = hole
    parts = [
        boxes((x0 - 0.18, 0, z0), (x0, 0.08, z1), "xXY"),
        boxes((x1, 0, z0), (x1 + 0.18, 0.08, z1), "xXY"),
        boxes((x0 - 0.3, 0, z1), (x1 + 0.3, 0.16, z1 + 0.25), "xXYzZ"),
        boxes((x0 - 0.2, 0.0, z0), (x1 + 0.2, 0.4, z0 + 0.12), "xXYZ"),
    ]
    return [(join(parts), Palette.stone)]


def _balcony(hole, bottom) -> Pieces:
    """A slab with a railing of upright bars."""
    x0, x1, reach = hole[0] - 0.5, hole[2] + 0.5, 0.9
    slab = boxes((x0, 0, bottom - 0.05), (x1, reach, bottom + 0.1), "xXYzZ")
    rail = [
        boxes((x0, reach - 0.06, bottom + 1.0), (x1, reach, bottom + 1.06), "xXyYzZ"),
        boxes((x0, 0, bottom + 1.0), (x0 + 0.06, reach - 0.06, bottom + 1.06), "xXzZ"),
        boxes((x1 - 0.06, 0, bottom + 1.0), (x1, reach - 0.06, bottom + 1.06), "xXzZ"),
    ]
    along = np.linspace(x0 + 0.03, x1 - 0.03, 10)
    bars = np.stack([along, np.full_like(along, reach - 0.03), np.full_like(along, bottom + 0.1)], axis=1)
    bars = boxes(bars - (0.015, 0.015, 0), bars + (0.015, 0.015, 0.9), "xXyY")
    return [(slab, Palette.stone), (join([*rail, bars]), Palette.iron)]


def _shutters(hole, material) -> Pieces:
    x0, z0, x1, z1 = hole
    low = [(x0 - 0.58, 0.0, z0), (x1 + 0.03, 0.0, z0)]
    high = [(x0 - 0.03, 0.05, z1), (x1 + 0.58, 0.05, z1)]
    part = boxes(low, high, "xXYzZ")
    return [(part, material)]


def _roof_details(width, height, ridge, glass, wall) -> list[Detail]:
    """A chimney and, on wide houses, dormer windows."""
    middle = -_DEPTH / 2
    x = width * 0.22
    stack = boxes((x - 0.35, middle - 0.35, ridge - 0.6), (x + 0.35, middle + 0.35, ridge + 1.1), "xXyYZ")
    details = [Detail([], [(MeshPart(stack.vertices, stack.faces, stack.normals, stack.uv / 2), Palette.chimney)], 3)]
    rise = (ridge - height) / (_DEPTH / 2)
    for x in np.array([0.3, 0.7] if width > 9.5 else [0.5]) * width:
        z0, y0 = height + 0.15 * rise + 0.35, -0.5
        top = z0 + 1.1
        back = -(top + 0.1 - height) / rise
        cheeks = boxes((x - 0.6, back, height), (x + 0.6, y0, top), "xXY")
        lid = boxes((x - 0.7, back, top), (x + 0.7, y0 + 0.15, top + 0.12), "xXYzZ")
        pane = _panes([(x - 0.45, z0, x + 0.45, top - 0.1)], y0 + 0.03, [glass])
        cheeks = MeshPart(cheeks.vertices, cheeks.faces, cheeks.normals, cheeks.uv / 2)
        details.append(Detail([], [(cheeks, wall), (lid, Palette.stone), *pane], 3.2))
    return details
