"""Graph cameras through mazes: frusta along corridors and at crossings, opened up breadth first from the entrance."""

import dataclasses
from collections import deque
from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.graph_portals import Portal, end_planes
from mpcam.cameras.maze_plan import Cell, MazeLike, border_cells
from mpcam.cameras.pinhole import Pinhole
from mpcam.errors import InputError
from mpcam.math.pose import look_at

_SKIN = 0.005  # of a cell: frusta reach so far into walls, since rays must not end before they meet them
_HALL = 4.0  # distance before a corridor from which it is seen, over its length
_ASIDE = 0.25  # of a doorway, by which a center is off its middle, away from the only opening beside what it sees
_STEPS = ((0, 1), (0, -1), (1, 0), (-1, 0))  # rows and columns

Step = tuple[int, int]


class _Run(NamedTuple):
    """A straight stretch of a corridor: its cells, the way in which it is entered, the steps into openings beside it,
    and the steps to sides at which cells belong to stretches that were there before."""

    cells: list[Cell]
    step: Step
    beside: list[Step]
    met: set[Step]


class _Seen(NamedTuple):
    """A corridor as rays come into it: number of the portal, from above the center and both ends of the face, and the
    box that it fills."""

    portal: int
    center: np.ndarray
    face: np.ndarray
    limits: np.ndarray


def through(maze: MazeLike, width: int, height: int, opening: float) -> tuple[Pinhole, list[Portal], np.ndarray]:
    """Root, portals and the root's ends for a maze; see `GraphCamera.through`."""
    ground = _Ground(maze)
    tall = maze.height
    first = ground.claimed(ground.entrance, ground.inward)
    face = ground.door(ground.entrance, ground.inward, 0.0)
    target = face.mean(axis=0)
    eye = ground.center(first._replace(beside=first.beside * 2), face, opening)  # in the middle
    distance = float(np.linalg.norm(target - eye))
    view = look_at((*eye, 0.5 * tall), (*target, 0.5 * tall))
    root = Pinhole(width, height, width * distance / maze.cell, height * distance / tall, camera_from_world=view)
    behind = 2.0 * distance * _ahead(ground.inward)
    ends = ground.box(first, [face - behind])
    portals: list[Portal] = []
    waiting = deque([(first, _Seen(-1, eye, face, ends))])
    while waiting:
        run, seen = waiting.popleft()
        for cell, step in ground.openings(run):
            if cell in ground.owned:  # by the branch before this one
                continue
            room = np.clip(ground.door(cell, step, ground.skin), seen.limits[0, :2], seen.limits[1, :2])
            door = _clipped(room, seen)
            if door is None:
                continue
            branch = ground.claimed(cell, step)
            limits = ground.box(branch, [door])
            door = np.clip(door, limits[0, :2], limits[1, :2])
            center = ground.center(branch, door, opening)
            corners = [(*door[i], z) for i, z in ((0, 0.0), (1, 0.0), (1, tall), (0, tall))]
            portals.append(Portal(corners, (*center, 0.5 * tall), seen.portal, ends=limits))
            waiting.append((branch, _Seen(len(portals) - 1, center, door, limits)))
    first_ends, *others = _parted([ends, *(portal.ends for portal in portals)])
    return (
        root,
        [dataclasses.replace(portal, ends=limits) for portal, limits in zip(portals, others, strict=True)],
        first_ends,
    )


class _Ground:
    """The cells of a maze, which of them belong to corridors by now, and places in it from above."""

    def __init__(self, maze: MazeLike):
        self.maze, self.cells = maze, np.array(maze.open, bool)
        self.entrance = (int(maze.entrance[0]), int(maze.entrance[1]))
        if self.entrance not in border_cells(self.cells):
            raise InputError(f"through: the entrance {self.entrance} of the maze is no open cell in its border")
        self.owned: set[Cell] = set()
        self.skin = _SKIN * maze.cell
        self.inward = next(step for step in _STEPS if not _within(self.cells, _moved(self.entrance, step, -1)))

    def claimed(self, cell: Cell, step: Step) -> _Run:
        """The stretch from a cell on, whose cells belong to it from now on: one cell if there are openings beside it,
        else all up to the next such cell.

        It ends too where a side would partly be wall and partly another stretch, as it could not reach into the wall.
        """
        sides = [side for side in _STEPS if side[0] * step[0] + side[1] * step[1] == 0]
        beside = [side for side in sides if self._free(_moved(cell, side))]
        met = {side for side in sides if _moved(cell, side) in self.owned}
        run = [cell]
        after = _moved(cell, step)
        while not beside and self._free(after):
            if any(
                self._free(_moved(after, side)) or (_moved(after, side) in self.owned) != (side in met)
                for side in sides
            ):
                break
            run.append(after)
            after = _moved(after, step)
        self.owned |= set(run)
        return _Run(run, step, beside, met | ({step} if after in self.owned else set()))

    def _free(self, cell: Cell) -> bool:
        """Whether a cell is open and belongs to no stretch yet."""
        return _within(self.cells, cell) and bool(self.cells[cell]) and cell not in self.owned

    def openings(self, run: _Run) -> list[tuple[Cell, Step]]:
        """Free cells after a stretch and beside it, and the steps into them."""
        ways = [(run.cells[-1], run.step), *((run.cells[0], side) for side in run.beside)]
        return [(_moved(cell, step), step) for cell, step in ways if self._free(_moved(cell, step))]

    def door(self, cell: Cell, step: Step, inside: float) -> np.ndarray:
        """(2, 2) the ends of the side by which one steps into a cell, so far inside of it."""
        side, ahead = self.maze.cell, _ahead(step)
        middle = np.array(self.maze.corner) + side * np.array([cell[1] + 0.5, cell[0] + 0.5])
        across = 0.5 * side * np.array([-ahead[1], ahead[0]])
        place = middle - (0.5 * side - inside) * ahead
        return np.stack([place + across, place - across])

    def center(self, run: _Run, face: np.ndarray, opening: float) -> np.ndarray:
        """(2,) where rays into a stretch come from: near where they shall fan out into openings beside it, away from
        the one if there is one; else far, so that what comes after the stretch takes up most of the image."""
        ahead = _ahead(run.step)
        distance = self.maze.cell * opening * (1.0 if run.beside else _HALL * len(run.cells))
        aside = _ahead(run.beside[0]) if len(run.beside) == 1 else 0.0 * ahead
        return face.mean(axis=0) - distance * ahead - _ASIDE * float(np.ptp(face, axis=0).max()) * aside

    def box(self, run: _Run, also: list[np.ndarray]) -> np.ndarray:
        """(2, 3) what a corridor fills: it reaches into walls, and where it meets another one not quite to its end."""
        low = np.min(run.cells, axis=0)[::-1].astype(np.float64)
        high = np.max(run.cells, axis=0)[::-1] + 1.0
        ends = np.array(self.maze.corner) + self.maze.cell * np.stack([low, high])
        for step in _STEPS:
            ahead = _ahead(step)
            axis = int(np.abs(ahead).argmax())
            if step != _moved((0, 0), run.step, -1):
                ends[int(ahead[axis] > 0), axis] += (-self.skin if step in run.met else self.skin) * ahead[axis]
        for points in also:
            axis = int(np.abs(_ahead(run.step)).argmax())
            back = int(_ahead(run.step)[axis] < 0)
            ends[back, axis] = points[0, axis]
        return np.column_stack([ends, [-self.skin, self.maze.height + self.skin]])


def _parted(boxes: list[np.ndarray]) -> list[np.ndarray]:
    """Boxes, or planes where two reach into the same wall at a corner of both: there a plane goes between them."""
    low, high = np.stack([box[0, :2] for box in boxes]), np.stack([box[1, :2] for box in boxes])
    first, second = np.maximum(low[:, None], low), np.minimum(high[:, None], high)
    extra: dict[int, list[Any]] = {}
    for a, b in np.argwhere(np.triu((second - first > 1e-9 * np.abs(high).max()).all(axis=-1), 1)):
        corner = 0.5 * (first[a, b] + second[a, b])
        for mine, other in ((a, b), (b, a)):
            toward = np.sign(low[other] + high[other] - low[mine] - high[mine])
            extra.setdefault(int(mine), []).append([*toward, 0.0, -(toward @ corner)])
    return [
        np.array([*end_planes(np, box), *extra[number]]) if number in extra else box for number, box in enumerate(boxes)
    ]


def _clipped(door: np.ndarray, seen: _Seen) -> np.ndarray | None:
    """The part of a door that rays of a corridor reach: they come through its face, and fan out behind it."""
    start, end = 0.0, 1.0
    inside = seen.face.mean(axis=0) - seen.center
    for edge in seen.face:
        way = edge - seen.center
        normal = np.array([-way[1], way[0]])
        normal = normal if normal @ inside > 0 else -normal
        first, second = ((place - seen.center) @ normal for place in door)
        if max(first, second) <= 0:
            return None
        if first < 0:
            start = max(start, first / (first - second))
        if second < 0:
            end = min(end, first / (first - second))
    if end - start < _SKIN:
        return None
    return np.stack([door[0] + part * (door[1] - door[0]) for part in (start, end)])


def _ahead(step: Step) -> np.ndarray:
    """(2,) the way of a step in x and y."""
    return np.array([step[1], step[0]], np.float64)


def _moved(cell: Cell, step: Step, times: int = 1) -> Cell:
    return cell[0] + times * step[0], cell[1] + times * step[1]


def _within(cells: np.ndarray, cell: Cell) -> bool:
    return 0 <= cell[0] < cells.shape[0] and 0 <= cell[1] < cells.shape[1]
