"""Rays and images of a graph camera in the root's frame, from tables of its frusta (Rosen et al. 2011, section 5)."""

import dataclasses
import sys
from typing import Any, ClassVar

import numpy as np

from mpcam.cameras.graph_images import LOOP, ROWS, SLACK, FrustaImages, none, value
from mpcam.cameras.groups import grouped
from mpcam.cameras.symmetric import finite_pixel
from mpcam.cameras.types import Domain, Ray, RayGeometry, RayPieces
from mpcam.math import (
    Array,
    Vector,
    counted,
    dot,
    epsilon,
    library,
    maximum,
    minimum,
    normalize,
    take,
    take_row,
    vector,
    where,
)

_TABLES, _INDICES = ("nodes", "planes", "exits", "edges", "cuts"), ("parents", "ways", "branches", "candidates")


@dataclasses.dataclass(frozen=True)
class Counts:
    """Frusta, portals on the longest way, rows of a frustum in each table, steps to the candidates of a point, and how
    many they are at most. Frozen kernels tell cameras apart by them, as they would not by those of a named tuple."""

    frusta: int
    depth: int
    root_planes: int
    planes: int
    exits: int
    edges: int
    steps: int
    candidates: int


@dataclasses.dataclass(frozen=True, eq=False)
class Frusta(FrustaImages):
    """The frusta of a graph camera, numbered from the root, 0; parents come before their children.

    Tables of rows of four numbers. nodes: of each frustum its entry face (n, o), n . x + o > 0 behind it; its center;
    and by rows the affine map that unbends a point of it into the root's frustum, onto the straight continuation of the
    root's piece of its ray. planes: those of the root, then of each other frustum, (n, o) with n . x + o <= 0 inside.
    exits: those at which rays leave a frustum. edges: of a frustum's image, (a, b, c, 0) with a x + b y + c >= 0
    inside, x and y in focal lengths from the principal point. cuts: planes that part space for finding a point's
    frustum. Tables of whole numbers. parents: of each frustum. ways: the frusta on the way from the root to each, then
    -1. branches: of each cut what comes next on its two sides; a cut that leads to itself is an end, with its
    candidates, frusta or -1.

    fx, fy, cx, cy, width, height: of the root. All lengths in scene units, all of it in the root's frame.
    """

    fx: Any
    fy: Any
    cx: Any
    cy: Any
    nodes: Any
    planes: Any
    exits: Any
    edges: Any
    cuts: Any
    parents: Any
    ways: Any
    branches: Any
    candidates: Any
    counts: Counts
    width: int
    height: int

    ray_geometry: ClassVar[RayGeometry] = "general"
    images_per_point: ClassVar[int] = 1

    @property
    def pieces_per_ray(self) -> int:
        """Most straight pieces of a ray."""
        return self.counts.depth + 1

    @property
    def domain(self) -> Domain:
        """Rays have no common center."""
        return Domain(None, None)

    def on_device(self, kind: type) -> "Frusta":
        """The same with tables of Dr.Jit arrays, of this type of numbers; made once for each."""
        made = vars(self).setdefault("_made", {})
        if kind not in made:
            index = sys.modules["drjit"].int32_array_t(kind)
            precision = np.float64 if epsilon(kind(0)) == 2.0**-52 else np.float32
            tables = {name: kind(np.array(getattr(self, name), precision).ravel()) for name in _TABLES}
            indices = {name: index(np.array(getattr(self, name))) for name in _INDICES}
            made[kind] = dataclasses.replace(self, **tables, **indices)
        return made[kind]

    # Rays

    def local_ray(self, pixel: Vector) -> Ray:
        """The root's piece of a pixel's ray."""
        x, y, valid = self._ahead(pixel)
        zero = 0.0 * abs(x)
        return Ray(vector(zero, zero, zero), normalize(vector(x, y, zero + 1.0)), valid)

    def local_ray_pieces(self, pixel: Vector) -> tuple[RayPieces, ...]:
        """The pieces of a pixel's ray, one frustum after the other."""
        x, y, valid = self._ahead(pixel)
        parts = grouped(self._pieces, self._last(x, y), x, y)
        pieces = []
        for level in range(self.counts.depth + 1):
            there = valid & (parts[9 * level + 8] > 0)
            some = [where(there, part, 0.0) for part in parts[9 * level : 9 * level + 8]]
            pieces.append(RayPieces(vector(*some[:3]), vector(*some[3:6]), some[6], some[7], there))
        return tuple(pieces)

    def _ahead(self, pixel: Vector) -> tuple[Array, Array, Array]:
        """Pixels in focal lengths from the principal point, and whether they are finite."""
        u, v, valid = finite_pixel(pixel)
        return (u - self.cx) / self.fx, (v - self.cy) / self.fy, valid

    def _last(self, x: Array, y: Array) -> Array:
        """The frustum in which the ray of an image point ends."""
        if library(x) == "numpy":
            return self._last_of_many(x, y)

        def enter(number: Any, state: tuple[Array, ...]) -> tuple[Array, ...]:
            enters = (take(self.parents, number + 1) == state[0]) & self._enters(number + 1, x, y)
            return (where(enters, number + 1, state[0]),)

        return counted(enter, (none(x) + 1,), self.counts.frusta - 1)[0]

    def _last_of_many(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """The same for NumPy, where each frustum is tried on those image points alone that come to its parent."""
        shape, flat = np.shape(x), (np.ravel(x), np.ravel(y))
        last, waiting = np.zeros(flat[0].shape, np.int32), {0: np.arange(len(flat[0]))}
        for number in range(1, self.counts.frusta):
            some = waiting[int(self.parents[number])]
            enters = (last[some] == self.parents[number]) & self._enters(number, *(part[some] for part in flat))
            waiting[number] = some[enters]
            last[waiting[number]] = number
        return last.reshape(shape)

    def _enters(self, number: Any, x: Array, y: Array) -> Array:
        """Whether image points lie in the image of a frustum."""
        edges, inside = self.counts.edges, x == x
        slack = SLACK * epsilon(x) * (abs(x) + abs(y) + 1.0)
        for edge in range(edges):
            a, b, c, _ = take_row(self.edges, number * edges + edge)
            inside = inside & (a * x + b * y + c >= -slack)
        return inside

    def _pieces(self, last: Any, x: Array, y: Array) -> list[Array]:
        """For each level origin, direction, start, end, and 1 where there is a piece, of rays that end in `last`."""
        depth, zero = self.counts.depth, 0.0 * abs(x)
        origin, direction, start = vector(zero, zero, zero), normalize(vector(x, y, zero + 1.0)), zero
        node, found = 0 * last, []
        for level in range(depth + 1):
            if type(node) is int and node < 0:
                return found + [zero] * (9 * (depth + 1) - len(found))
            there, node = node >= 0, where(node >= 0, node, 0)
            after = take(self.ways, last * (depth + 1) + level + 1) if level < depth else 0 * last - 1
            after = int(after) if type(last) is int else after
            passes = after >= 0
            face, center = (take_row(self.nodes, where(passes, after, 0) * ROWS + row) for row in range(2))
            ahead = dot(face, direction)
            through = maximum(-value(face, origin), 0.0) / where(passes & (ahead > 0), ahead, 1.0)
            length = where(passes, through, self._way_out(node, origin, direction))
            found += [*origin, *direction, start, start + length, where(there, 1.0, 0.0) + zero]
            origin = vector(*(where(passes, origin[i] + through * direction[i], 0.0) for i in range(3)))
            along = vector(*(where(passes, origin[i] - center[i], direction[i]) for i in range(3)))
            direction, start, node = normalize(along), where(passes, start + through, 0.0), after
        return found

    def _way_out(self, node: Any, origin: Vector, direction: Vector) -> Array:
        """Length of a ray up to where it leaves a frustum other than by its portals."""
        exits = self.counts.exits

        def nearer(number: Any, state: tuple[Array, ...]) -> tuple[Array, ...]:
            plane = take_row(self.exits, node * exits + number)
            ahead = dot(plane, direction)
            leaves = ahead > 0
            way = maximum(-value(plane, origin), 0.0) / where(leaves, ahead, 1.0)
            return (where(leaves, minimum(state[0], way), state[0]),)

        return counted(nearer, (0.0 * origin[0] + np.inf,), exits, LOOP)[0]
