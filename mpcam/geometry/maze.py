"""A maze of thick walls on a square grid, with a floor of checks and a few colored things in its corners."""

from dataclasses import dataclass

import numpy as np

from mpcam.errors import InputError
from mpcam.geometry.levels import Level, fitted
from mpcam.geometry.mesh import Material, Mesh
from mpcam.geometry.shapes import Builder, MeshPart, copies, ellipsoid, join, moved, placements, quads
from mpcam.geometry.solids import tapered, turned
from mpcam.geometry.textures import bricks, painted, plaster, rgb, textured

PLAN = """
###########
#a        #
##### ### #
#c  # #   #
### # # ###
#   # #  d#
# ### #####
#        e#
##### #####
"""
"""North is up, # a wall; letters stand for things in open cells. A tree: no way leads round in a ring."""
CELL, HEIGHT = 2.0, 1.7
_WALLS_SHARE = 0.6  # of the triangles that walls and floor may take, the things get the rest


@dataclass(frozen=True, eq=False)
class Maze:
    """Cells of a square grid; row 0 is the one with the smallest y, column 0 that with the smallest x.

    open: (R, C) bool, False where a block of wall stands. cell: side of a cell, scene units. height: of the walls,
    from z = 0. entrance: row and column of the open cell in the border. corner: x and y of the outer corner of cell
    (0, 0). things: letter and cell of what stands in some cells. Raises InputError where the entrance is not an open
    cell in the border, or another border cell is open.
    """

    open: np.ndarray
    cell: float
    height: float
    entrance: tuple[int, int]
    corner: tuple[float, float]
    things: tuple[tuple[str, tuple[int, int]], ...] = ()

    def __post_init__(self) -> None:
        cells = np.array(self.open, bool)
        cells.flags.writeable = False
        object.__setattr__(self, "open", cells)
        border = np.ones_like(cells)
        border[1:-1, 1:-1] = False
        if not np.array_equal(np.argwhere(cells & border), [self.entrance]):
            raise InputError(f"maze entrance {self.entrance}: it must be the only open cell in the border of the grid")

    def center(self, row: int, column: int, z: float = 0.0) -> np.ndarray:
        """(3,) the middle of a cell, at a height."""
        return np.array([self.corner[0] + self.cell * (column + 0.5), self.corner[1] + self.cell * (row + 0.5), z])

    @property
    def outward(self) -> tuple[int, int]:
        """The step (rows, columns) that leads out through the entrance."""
        row, column = self.entrance
        rows, columns = self.open.shape
        return int(row == rows - 1) - int(row == 0), int(column == columns - 1) - int(column == 0)

    @staticmethod
    def drawn(plan: str = PLAN, cell: float = CELL, height: float = HEIGHT) -> "Maze":
        """The maze of a drawing such as PLAN, its middle at x = y = 0. Raises InputError where lines differ in length,
        or there is not one open cell in the border.
        """
        lines = plan.strip("\n").split("\n")[::-1]
        if len({len(line) for line in lines}) != 1:
            raise InputError("maze plan: lines of different lengths; give one character for each cell")
        letters = np.array([list(line) for line in lines])
        cells = letters != "#"
        inner = np.zeros_like(cells)
        inner[1:-1, 1:-1] = True
        doors = np.argwhere(cells & ~inner)
        if len(doors) != 1:
            raise InputError(f"maze plan: {len(doors)} open cells in the border; one is needed, the entrance")
        things = tuple((str(letters[r, c]), (int(r), int(c))) for r, c in np.argwhere(cells & (letters != " ")))
        rows, columns = cells.shape
        corner = (-0.5 * cell * columns, -0.5 * cell * rows)
        return Maze(cells, cell, height, (int(doors[0, 0]), int(doors[0, 1])), corner, things)

    def mesh(self, triangles: int = 20_000) -> Mesh:
        """Walls, floor and things, within 3 % of so many triangles."""
        pieces = max(int((_WALLS_SHARE * triangles / (self.walls().count + self.floor().count)) ** 0.5), 1)
        stone, floor = textured("coping", plaster("#e3d8c2", 5)), textured("floor", _checks())
        ochre, red = (
            textured(f"wall {code}", bricks(code, "#e4d8c4", 7, rows=6, columns=2)) for code in ("#c99a62", "#b56a4c")
        )

        def build(level: Level) -> Builder:
            builder = Builder()
            for sides, material in (("zZ", stone), ("yY", ochre), ("xX", red)):
                builder.add(self.walls(pieces, sides), material)
            builder.add(self.floor(pieces), floor)
            for letter, (row, column) in self.things:
                for part, material in _thing(letter, level):
                    builder.add(moved(part, self.center(row, column), turn=0.4), material)
            return builder

        if not self.things:
            return build(Level(1.0)).mesh("maze")
        return fitted(build, triangles, max(_things_full(self.things), 1)).mesh("maze")

    def walls(self, pieces: int = 1, sides: str = "xXyYzZ") -> MeshPart:
        """The blocks, closed all round: each side of a cell in pieces x pieces squares.

        sides: which to make, as for `boxes`: a small letter is the side towards minus.
        """
        solid = np.pad(~self.open, 1)
        rows, columns = np.nonzero(solid[1:-1, 1:-1])
        low = self._lows(rows, columns)
        x, y, z = np.diag([self.cell, self.cell, self.height])
        # step to the neighbor (rows, columns), where the face starts in the cell, and which way it runs
        upright = {
            "x": (0, -1, y, -y),
            "X": (0, 1, x, y),
            "y": (-1, 0, 0 * x, x),
            "Y": (1, 0, x + y, -x),
        }
        faces = []
        for side in sides:
            if side in "zZ":
                faces.append(_grid(low, y, x, pieces) if side == "z" else _grid(low + z, x, y, pieces))
                continue
            down, right, start, along = upright[side]
            bare = ~solid[1 + rows + down, 1 + columns + right]
            faces.append(_grid(low[bare] + start, along, z, pieces))
        return join(faces)

    def floor(self, pieces: int = 1) -> MeshPart:
        """The ground of open cells, and one cell before the entrance."""
        rows, columns = np.nonzero(self.open)
        outside = np.add(self.entrance, self.outward)
        low = self._lows(np.append(rows, outside[0]), np.append(columns, outside[1]))
        x, y, _ = np.diag([self.cell, self.cell, 0.0])
        return _grid(low, x, y, pieces)

    def _lows(self, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """(N, 3) the corners of cells with the smallest x and y, on the ground."""
        return np.stack(
            [self.corner[0] + self.cell * columns, self.corner[1] + self.cell * rows, np.zeros(len(rows))], axis=1
        )


def maze(triangles: int) -> Mesh:
    """The maze of PLAN: 22 x 18 m, walls 1.7 m high, entrance at the south."""
    return Maze.drawn().mesh(triangles)


def _grid(low: np.ndarray, along: np.ndarray, up: np.ndarray, pieces: int) -> MeshPart:
    """Squares at low (N, 3), each in pieces x pieces, seen from where along x up points; uv in half scene units."""
    step = np.arange(pieces + 1) / pieces
    first = np.stack(np.meshgrid(step[:-1], step[:-1], indexing="ij"), axis=2).reshape(-1, 2)
    last = np.stack(np.meshgrid(step[1:], step[1:], indexing="ij"), axis=2).reshape(-1, 2)
    u = np.stack([first[:, 0], last[:, 0], last[:, 0], first[:, 0]], axis=1)
    v = np.stack([first[:, 1], first[:, 1], last[:, 1], last[:, 1]], axis=1)
    corners = low[:, None, None] + u[None, :, :, None] * along + v[None, :, :, None] * up
    size = 0.5 * np.linalg.norm(along), 0.5 * np.linalg.norm(up)
    return quads(corners.reshape(-1, 4, 3), np.tile(np.stack([u * size[0], v * size[1]], axis=2), (len(low), 1, 1)))


def _checks(size: int = 256) -> np.ndarray:
    """Four by four fields, a little uneven."""
    y, x = np.mgrid[0:size, 0:size] * 4 // size
    stain = plaster("#ffffff", 17, size, contrast=0.05)
    return np.where(((x + y) % 2 == 0)[..., None], rgb("#f3eee2"), rgb("#3f6b6a")).astype(np.float32) * stain


def _thing(letter: str, level: Level) -> list[tuple[MeshPart, Material]]:
    """What a letter stands for, around z from the ground up."""
    stone = painted("pedestal", "#b9b2a4")
    foot = turned([(0.0, 0.0), (0.42, 0.0), None, (0.42, 0.12), None, (0.34, 0.14), (0.3, 0.4), (0.34, 0.6), None,
                   (0.42, 0.62), None, (0.42, 0.7), None, (0.0, 0.7)], level, 20, 40)  # fmt: skip
    if letter == "a":
        return [(foot, stone), (ellipsoid((0, 0, 1.14), (0.44, 0.44, 0.44), level(28, 8), level(44, 8)),
                                painted("red ball", "#d2452f"))]  # fmt: skip
    if letter == "c":
        vase = [(0.0, 0.0), (0.3, 0.0), None, (0.46, 0.5), (0.4, 0.85), (0.2, 1.1), (0.3, 1.3), None, (0.24, 1.3), None]
        return [(turned([*vase, (0.15, 1.1), (0.0, 1.0)], level, 40, 48), painted("blue vase", "#2f6fb3"))]
    if letter == "d":
        ring = 2 * np.pi * np.arange(5) / 5
        stems = placements(np.stack([0.42 * np.cos(ring), 0.42 * np.sin(ring), 0 * ring], 1))
        pin = turned([(0.0, 0.0), (0.12, 0.0), None, (0.17, 0.3), (0.07, 0.72), (0.1, 0.88), (0.0, 1.0)], level, 26, 24)
        return [(copies(pin, stems), painted("yellow pins", "#e9b92f"))]
    horn = tapered(
        [(0.0, 0.0, 0.1), (0.16, 0.0, 0.55), (-0.08, 0.08, 1.0), (0.05, 0.0, 1.5)], (0.3, 0.2, 0.12, 0.04),
        level(48, 12), level(36, 8), (0.0, 1.0, 0.0),
    )  # fmt: skip
    return [(horn, painted("green horn", "#3f9a63"))]


def _things_full(things) -> int:
    return sum(part.count for letter, _ in things for part, _ in _thing(letter, Level(1.0)))
