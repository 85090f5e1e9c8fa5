"""Mazes on a square grid, as `GraphCamera.through` takes them."""

import dataclasses
from typing import Any, Protocol

import numpy as np

from mpcam.checks import is_number, shown
from mpcam.errors import InputError

Cell = tuple[int, int]


class MazeLike(Protocol):
    """What `GraphCamera.through` wants of a maze; `MazePlan` is one."""

    @property
    def open(self) -> Any:
        """(R, C) bool, False where a block of wall stands; row 0 is at the smallest y, column 0 at the smallest x."""
        ...

    @property
    def cell(self) -> float:
        """Side of a cell, scene units."""
        ...

    @property
    def height(self) -> float:
        """Of the walls, from z = 0."""
        ...

    @property
    def entrance(self) -> Cell:
        """Row and column of the open cell in the border through which one enters."""
        ...

    @property
    def corner(self) -> tuple[float, float]:
        """x and y of the outer corner of cell (0, 0)."""
        ...


@dataclasses.dataclass(frozen=True, eq=False)
class MazePlan:
    """A maze on a square grid, with its walls from z = 0 up: see `MazeLike` for the fields.

    Raises InputError unless the entrance is an open cell in the border, and sizes are above 0.
    """

    open: Any
    cell: float = 1.0
    height: float = 1.0
    entrance: Cell = (0, 0)
    corner: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        cells = np.array(self.open, bool)
        object.__setattr__(self, "open", cells)
        if cells.ndim != 2 or cells.size == 0:
            raise InputError(f"MazePlan: open has shape {cells.shape}: give rows and columns of cells, (R, C)")
        for name in ("cell", "height"):
            value = getattr(self, name)
            if not is_number(value) or not value > 0:
                raise InputError(f"MazePlan({name}={shown(value)}): a number above 0 is needed")
        doors = border_cells(cells)
        if tuple(self.entrance) not in doors:
            raise InputError(
                f"MazePlan(entrance={shown(self.entrance)}): give row and column of an open cell in the border; there "
                f"are {', '.join(map(str, doors)) or 'none'}"
            )

    @classmethod
    def drawn(cls, text: str | list[str], cell: float = 1.0, height: float = 1.0) -> "MazePlan":
        """From a drawing, north (+y) up: # is a wall, anything else is open; its middle is at x = y = 0.

        The entrance is the only open cell in the border, or the one marked by E. Raises InputError for lines of
        different lengths, and for no such cell or several.
        """
        lines = (text.strip("\n").split("\n") if isinstance(text, str) else list(text))[::-1]
        if len({len(line) for line in lines}) != 1 or not lines[0]:
            raise InputError("MazePlan: a drawing has lines of equal length, one character for each cell")
        letters = np.array([list(line) for line in lines])
        cells = letters != "#"
        doors = [door for door in border_cells(cells) if letters[door] == "E"] or border_cells(cells)
        if len(doors) != 1:
            raise InputError(
                f"MazePlan: the drawing has {len(doors)} open cells in its border: leave one open, the entrance, or "
                "mark it E"
            )
        rows, columns = cells.shape
        return cls(cells, cell, height, doors[0], (-0.5 * cell * columns, -0.5 * cell * rows))


def border_cells(cells: np.ndarray) -> list[Cell]:
    """Open cells in the border."""
    inner = np.zeros_like(cells)
    inner[1:-1, 1:-1] = True
    return [(int(row), int(column)) for row, column in np.argwhere(cells & ~inner)]
