"""Images of graph cameras by their definition, in 50 digits: back along a ray from face to face, by its centers alone.

A point belongs to a way through portals if it lies behind the last face and the line from it to the center crosses the
face; there the same holds for the place of crossing and the face before, and so on to the root. No map and no table of
the camera is used, and no search.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from mpcam.cameras.graph import GraphCamera
from mpcam.cameras.graph_tree import owner

Real = Any  # a number of mpmath
Point = list[Any]


class Image(NamedTuple):
    """An image by one way, and by how much the point lies outside of its last frustum, negative inside; the condition
    numbers are what errors of one part in a matrix and in the point make of the pixel, and in all places of the depth.
    """

    pixel: tuple[Real, Real]
    depth: Real
    outside: Real
    pixel_condition: float
    depth_condition: float


class _Face(NamedTuple):
    corners: list[Point]
    plane: Point  # (n, o), positive behind
    center: Point
    sides: list[Point]  # planes through the center and the edges, negative inside


class Truth:
    """A graph camera whose root is at the identity pose, as its portals describe it; made within mpmath's workdps."""

    def __init__(self, camera: GraphCamera):
        self.root, self.portals = camera.root, camera.portals
        self.ways = [camera.tree.way(number)[1:] for number in range(len(camera.tree.parents))]
        self.entered, self.children = camera.tree.portals, [camera.tree.children(k) for k in range(len(self.ways))]
        self.faces = [_face(portal.polygon, portal_center(camera, k)) for k, portal in enumerate(camera.portals)]
        self.ends = [_planes(portal.ends) for portal in camera.portals]
        self.root_ends = _planes(camera.ends)
        self.matrices = camera.frustum_matrices
        self.owners = camera.tree.owners
        self.size = float(max([1e-300, *(np.abs(portal.polygon).max() for portal in camera.portals)]))

    def images(self, point: Sequence[Any]) -> list[Image]:
        """By every way, the root's first."""
        given = _exact(point)
        return [self.image(number, given) for number in range(len(self.ways))]

    def image(self, number: int, point: Point) -> Image:
        """By one way."""
        import mpmath

        faces = [self.faces[self.entered[node]] for node in self.ways[number]]
        ends = self.root_ends if number == 0 else self.ends[self.owners[number]]
        outside = [_at(plane, point) for plane in ends]
        outside += [_at(self.faces[self.entered[child]].plane, point) for child in self.children[number]]
        if number == 0:
            outside.append(-point[2])
        start, depth, doubt, total = point, mpmath.mpf(0), _long(point), 0.0
        for level, face in enumerate(reversed(faces)):
            behind, before = _at(face.plane, point), _at(face.plane, face.center)
            if level == 0 or self._merges(number):
                outside += [_at(side, point) for side in face.sides]
            if level == 0:
                outside.append(-behind)
            if behind - before <= 0:  # before the center
                return Image((mpmath.mpf(0), mpmath.mpf(0)), mpmath.mpf(0), max(outside), 1.0, 1.0)
            part = behind / (behind - before)
            way = [part * (c - x) for c, x in zip(face.center, point, strict=True)]
            reach = float(_norm(_minus(face.center, point)) / (abs(behind) + abs(before)))
            doubt += (1 + reach) * (doubt + _long(face.center) + self.size)
            total += doubt
            depth, point = depth + _norm(way), [x + y for x, y in zip(point, way, strict=True)]
        depth += _norm(point)
        x, y, z = point
        root = self.root
        z = z if z > 0 else mpmath.mpf(10) ** -300
        pixel = (root.cx + root.fx * x / z, root.cy + root.fy * y / z)
        return Image(pixel, depth, max(outside), self._condition(number, start), total + _long(point) + float(depth))

    def _merges(self, number: int) -> bool:
        return self.owners.count(self.owners[number]) > 1

    def _condition(self, number: int, point: Point) -> float:
        given = np.array([*(float(x) for x in point), 1.0])
        rows, sizes = self.matrices[number] @ given, np.abs(self.matrices[number]) @ np.abs(given)
        scale = abs(self.root.fx) + abs(self.root.fy) + abs(self.root.cx) + abs(self.root.cy)
        with np.errstate(all="ignore"):
            pixel = np.abs(rows[:2] / rows[3]).max()
            return float((sizes[:2].max() + pixel * sizes[3]) / abs(rows[3]) + pixel + scale)


def portal_center(camera: GraphCamera, number: int) -> Any:
    """The center behind a portal."""
    return camera.portals[owner(camera.portals, number)].center


def _face(polygon: Any, center: Any) -> _Face:
    corners, middle = [_exact(corner) for corner in polygon], _exact(center)
    normal = _cross(_minus(corners[1], corners[0]), _minus(corners[2], corners[0]))
    length = _norm(normal)
    plane = [x / length for x in normal]
    plane.append(-_dot(plane, corners[0]))
    if _at(plane, middle) > 0:
        plane = [-x for x in plane]
    return _Face(corners, plane, middle, _sides(corners, middle))


def _sides(corners: list[Point], center: Point) -> list[Point]:
    found, count = [], len(corners)
    inside = [sum(corner[i] for corner in corners) / count for i in range(3)]
    for k, corner in enumerate(corners):
        normal = _cross(_minus(corner, center), _minus(corners[(k + 1) % count], center))
        length = _norm(normal)
        plane = [x / length for x in normal]
        plane.append(-_dot(plane, center))
        found.append(plane if _at(plane, inside) < 0 else [-x for x in plane])
    return found


def _planes(ends: Any) -> list[Point]:
    if ends is None:
        return []
    rows = np.asarray(ends)
    if rows.shape[1] == 3:
        low, high = rows.min(0), rows.max(0)
        rows = np.concatenate([np.column_stack([-np.eye(3), low]), np.column_stack([np.eye(3), -high])])
    exact = [_exact(row) for row in rows]
    return [[x / _norm(row[:3]) for x in row] for row in exact]


def _exact(values: Any) -> Point:
    import mpmath

    return [x if isinstance(x, mpmath.mpf) else mpmath.mpf(float(x)) for x in values]


def _at(plane: Point, point: Point) -> Real:
    return _dot(plane, point) + plane[3]


def _dot(a: Point, b: Point) -> Real:
    return sum(x * y for x, y in zip(a[:3], b[:3], strict=True))


def _minus(a: Point, b: Point) -> Point:
    return [x - y for x, y in zip(a, b, strict=True)]


def _cross(a: Point, b: Point) -> Point:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _norm(a: Point) -> Real:
    import mpmath

    return mpmath.sqrt(_dot(a, a))


def _long(point: Point) -> float:
    return float(sum(abs(x) for x in point))
