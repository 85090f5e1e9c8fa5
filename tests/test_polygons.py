"""Polygons as triangles: the area of the shoelace formula, every point inside once, and convex ones as fans."""

import numpy as np
import pytest

from mpcam.geometry.polygons import triangulate

SHAPES = {
    "u": [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)],
    "l": [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)],
    "dart": [(0, 0), (2, -1), (0.5, 0), (2, 1)],
    "dart from behind": [(0.5, 0), (2, 1), (0, 0), (2, -1)],
    "comb": [
        (0, 0),
        (9, 0),
        (9, 4),
        (8, 4),
        (8, 1),
        (6, 1),
        (6, 4),
        (5, 4),
        (5, 1),
        (3, 1),
        (3, 4),
        (2, 4),
        (2, 1),
        (0, 1),
    ],
    "star": [
        ((2 if k % 2 else 5) * np.cos(k * np.pi / 7), (2 if k % 2 else 5) * np.sin(k * np.pi / 7)) for k in range(14)
    ],
    "on one line": [(0, 0), (1, 0), (2, 0), (3, 0), (3, 2), (1.5, 0.5), (0, 2)],
    "with a hole on a bridge": [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)],
}


def shoelace(points) -> float:
    x, y = np.array(points, float).T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2)


def inside(points, query) -> np.ndarray:
    """By how often a ray to the right crosses the edges."""
    found = np.zeros(len(query), bool)
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        crosses = (a[1] > query[:, 1]) != (b[1] > query[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            x = a[0] + (query[:, 1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        found ^= crosses & (query[:, 0] < x)
    return found


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("turned", [False, True])
def test_concave_polygons_in_any_plane(name, turned):
    flat = np.array(SHAPES[name], float)[:: -1 if turned else 1]
    rng = np.random.default_rng(7)
    query = rng.uniform(flat.min(axis=0), flat.max(axis=0), (500, 2))
    expected = inside(flat, query).astype(int)
    for trial in range(5):
        axes = np.eye(3) if trial == 0 else np.linalg.qr(rng.standard_normal((3, 3)))[0]
        scale = (1.0, 1e-4, 1e6, 30.0, 1.0)[trial]
        points = (flat @ axes[:2]) * scale + rng.integers(-3, 3, 3) * scale
        triangles, polygon = triangulate(np.array([len(points)]), points)
        assert set(polygon) == {0} and len(triangles) <= len(points) - 2
        corners = flat[triangles]
        areas = np.array([shoelace(corner) for corner in corners])
        # turned as the polygon is, each of them
        assert np.all(areas * shoelace(flat) >= -1e-9)
        assert areas.sum() == pytest.approx(shoelace(flat))
        np.testing.assert_array_equal(sum(inside(corner, query).astype(int) for corner in corners), expected)


def test_convex_polygons_stay_fans_and_all_stay_in_order():
    square, u = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]), np.array(SHAPES["u"])
    flat = np.concatenate([square, u, square[:3], u + 9, square])
    counts = np.array([4, 8, 3, 8, 4])
    triangles, polygon = triangulate(counts, np.c_[flat, np.zeros(len(flat))])
    np.testing.assert_array_equal(polygon, np.repeat(range(5), [2, 6, 1, 6, 2]))
    np.testing.assert_array_equal(
        triangles[[0, 1, 8, 15, 16]], [[0, 1, 2], [0, 2, 3], [12, 13, 14], [23, 24, 25], [23, 25, 26]]
    )
    for number, (start, count) in enumerate(zip(np.cumsum(counts) - counts, counts, strict=True)):
        own = triangles[polygon == number]
        assert own.min() >= start and own.max() < start + count


def test_every_corner_of_a_straight_side_is_kept():
    """Neighbors share it: without, a picture would have gaps."""
    triangles, _ = triangulate(np.array([7]), np.c_[np.array(SHAPES["on one line"]), np.zeros(7)])
    assert set(triangles.ravel()) == set(range(7))


def test_polygons_without_area_and_without_number():
    line = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]], float)
    for points in (
        line,
        np.zeros((4, 3)),
        np.full((4, 3), np.nan),
        np.array([[0, 0, 0], [np.inf, 0, 0], [1, 1, 0], [0, 1, 0]]),
    ):
        triangles, _ = triangulate(np.array([4]), points)
        np.testing.assert_array_equal(triangles, [[0, 1, 2], [0, 2, 3]])


def test_a_polygon_that_crosses_itself_is_said():
    said = []
    points = np.array([(0, 0), (4, 0), (4, 4), (1, -1), (0, 4)], float)
    triangulate(np.array([5]), np.c_[points, np.zeros(5)], said.append)
    assert said and "cross" in said[0]
