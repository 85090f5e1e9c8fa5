"""Images of points in a graph camera: which frustum they lie in, and back from there to the root."""

from typing import Any

import numpy as np

from mpcam.cameras.groups import grouped
from mpcam.cameras.types import Projection
from mpcam.math import (
    Array,
    Vector,
    counted,
    dot,
    epsilon,
    isfinite,
    maximum,
    norm,
    take,
    take_row,
    vector,
    where,
    whole,
)

ROWS = 5
"""Rows of four numbers for each frustum in `Frusta.nodes`."""
SLACK = 4.0
"""Last places by which rounding may put a point or a pixel outside of where it belongs."""
LOOP = 16
"""Steps from which kernels loop rather than repeat their code."""


class FrustaImages:
    """The images of points; a part of `Frusta`, whose fields it uses."""

    fx: Any
    fy: Any
    cx: Any
    cy: Any
    nodes: Any
    planes: Any
    cuts: Any
    parents: Any
    ways: Any
    branches: Any
    candidates: Any
    counts: Any

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """The image of a point, at the length of its bent ray."""
        node, point, valid = self._located(point)
        u, v, _, depth, there = grouped(self._image, node, *point)
        return (_projection(u, v, depth, valid & (there > 0)),)

    def local_measure(self, point: Vector) -> Projection:
        """The image of a point with another measure of depth, the third row of its frustum's matrix over the fourth.

        It is 1 / z where the ray is unbent: falling along each ray, and linear in the image over each plane within a
        frustum. It costs less than the length along the ray.
        """
        node, point, valid = self._located(point)
        u, v, measure, _, there = grouped(lambda node, *point: self._image(node, *point, length=False), node, *point)
        return _projection(u, v, measure, valid & (there > 0))

    def local_frustum(self, point: Vector) -> Array:
        """Number of the frustum that a point lies in, -1 where it is in none."""
        node, _, valid = self._located(point)
        return where(valid, node, -1)

    def _located(self, point: Vector) -> tuple[Array, Vector, Array]:
        """The frustum that a point lies in, the point itself, and whether there is one; else harmless values.

        Of the root's frustum also what its image's sides leave out.
        """
        x, y, z = point
        finite = isfinite(x + y + z)
        x, y, z = (where(finite, part, 0.0) for part in (x, y, z))
        point = vector(x, y, z)
        counts, at, slack = self.counts, none(x) + 1, SLACK * epsilon(x) * (abs(x) + abs(y) + abs(z))

        def onward(_: Any, state: tuple[Array, ...]) -> tuple[Array, ...]:
            beyond = value(take_row(self.cuts, state[0]), point) > 0
            return (take(self.branches, 2 * state[0] + where(beyond, 1, 0)),)

        at = counted(onward, (at,), counts.steps, LOOP)[0]

        def nearer(number: Any, state: tuple[Array, ...]) -> tuple[Array, ...]:
            candidate = take(self.candidates, at * counts.candidates + number)
            first = counts.root_planes + (maximum(candidate, 1) - 1) * counts.planes
            most = self._outside(first, counts.planes, point)
            better = (candidate > 0) & (most < state[0])
            return where(better, most, state[0]), where(better, candidate, state[1])

        least, node = counted(nearer, (0.0 * x + np.inf, none(x)), counts.candidates)
        inner = finite & (node > 0) & (least <= slack)
        root = finite & (z > 0) & (self._outside(0, counts.root_planes, point) <= slack)
        valid = inner | root
        safe = vector(*(where(valid, part, end) for part, end in zip(point, (0.0, 0.0, 1.0), strict=True)))
        return where(inner, node, 0), safe, valid

    def _outside(self, first: Any, rows: int, point: Vector) -> Array:
        """How far a point lies outside of some planes, from row `first` on."""

        def farther(row: Any, state: tuple[Array, ...]) -> tuple[Array, ...]:
            return (maximum(state[0], value(take_row(self.planes, first + row), point)),)

        return counted(farther, (0.0 * point[0] - np.inf,), rows, LOOP)[0]

    def _image(self, node: Any, *point: Array, length: bool = True) -> list[Array]:
        """Of points in a frustum: pixel, 1 / z where the ray is unbent, its length, and 1 if there is an image."""
        x, y, z = (value(take_row(self.nodes, node * ROWS + row), point) for row in (2, 3, 4))
        front = z > 0
        z = where(front, z, 1.0)
        u, v = self.cx + self.fx * (x / z), self.cy + self.fy * (y / z)
        there = where(front & isfinite(u) & isfinite(v), 1.0, 0.0)
        return [u, v, 1.0 / z, self._length(node, point) if length else 0.0 * z, there]

    def _length(self, node: Any, point: Any) -> Array:
        """Length of the bent ray up to a point in a frustum: back from face to face."""

        def before(_: Any, state: tuple[Array, ...]) -> tuple[Array, ...]:
            node, length, *point = state
            face, center = (take_row(self.nodes, node * ROWS + row) for row in range(2))
            behind, ahead = maximum(value(face, point), 0.0), value(face, center)
            part = where(node > 0, behind, 0.0) / where(node > 0, behind - ahead, 1.0)
            way = vector(*(part * (center[i] - point[i]) for i in range(3)))
            parent = where(node > 0, take(self.parents, node), 0)
            return (
                int(parent) if type(node) is int else parent,
                length + norm(way),
                *(point[i] + way[i] for i in range(3)),
            )

        steps = self.counts.depth
        if type(node) is int:  # of one frustum
            steps = int((self.ways.reshape(-1, steps + 1)[node] >= 0).sum()) - 1
        _, length, *point = counted(before, (node, 0.0 * point[0], *point), steps)
        return length + norm(vector(*point))


def _projection(u: Array, v: Array, depth: Array, valid: Array) -> Projection:
    return Projection(vector(where(valid, u, 0.0), where(valid, v, 0.0)), where(valid, depth, 0.0), valid)


def value(plane: Any, point: Any) -> Array:
    """n . x + o."""
    return dot(plane, point) + plane[3]


def none(x: Array) -> Array:
    """Whole numbers, all -1, in the shape of an array."""
    return whole(0.0 * x) - 1
