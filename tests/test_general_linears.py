"""Several general linear cameras in one image: rays, seams, images, mistakes."""

import dataclasses
from typing import Any

import numpy as np
import pytest

import mpcam as mp

GL, MANY = mp.GeneralLinear, mp.GeneralLinears
EXAMPLES: Any = MANY.examples(90, 60)
RING = MANY.around((0.5, -0.2, 0.3), 3.0, 2.0, 240, 100, 16)


def seams(camera, rows=9):
    """Rays just left and just right of each border between columns: how far apart they are at two places."""
    y = np.linspace(0, camera.height, rows)
    worst = 0.0
    for x in camera.columns[1:-1]:
        left, right = (camera.ray(np.stack([np.full(rows, x + step), y], -1)) for step in (-1e-9, 1e-9))
        turn = np.abs(left.direction - right.direction).max()
        gap = np.abs(np.cross(left.origin - right.origin, left.direction)).max()
        worst = max(worst, turn, gap)
    return worst


@pytest.mark.parametrize("outward", [False, True])
@pytest.mark.parametrize("up", [(0, 0, 1), (0.2, -1.0, 0.4), (1, 0, 0)])
def test_all_rays_of_a_panorama_meet_its_axis_and_its_circle(up, outward):
    center, up = np.array([0.5, -0.2, 0.3]), np.array(up, float) / np.linalg.norm(up)
    camera = MANY.around(center, 3.0, 2.0, 240, 100, 16, up=up, outward=outward)
    pixels = np.random.default_rng(0).uniform(0, 1, (500, 2)) * (240, 100)
    ray = camera.ray(pixels)
    normal = np.cross(ray.direction, up)
    assert np.abs(((ray.origin - center) * normal).sum(-1) / np.linalg.norm(normal, axis=-1)).max() < 1e-12
    from_center = ray.origin - center
    assert np.abs(from_center @ up).max() < 1e-12  # the path stays at one height
    distance = np.linalg.norm(from_center, axis=-1)
    assert distance.max() <= 3.0 + 1e-12 and distance.min() >= 3.0 * np.cos(np.pi / 16) - 1e-12
    toward = -(ray.direction * from_center).sum(-1)
    assert ((toward < 0) if outward else (toward > 0)).all()
    assert seams(camera) < 1e-7
    first, last = (camera.ray(np.array([[x, 31.0]])) for x in (0.0, 240.0 - 1e-9))
    assert np.allclose(first.origin, last.origin, atol=1e-7) and np.allclose(first.direction, last.direction, atol=1e-7)


def test_up_is_up_and_right_is_right_in_a_panorama():
    ray = RING.ray(np.array([[120.0, 1.0], [120.0, 99.0], [125.0, 1.0]]))
    assert ray.direction[0, 2] > 0 > ray.direction[1, 2]
    forward = ray.direction[0] * (1, 1, 0)
    step = ray.origin[2] - ray.origin[0]
    assert np.cross(step, forward)[2] > 0  # to the right of where it looks, seen from above


def test_extent_is_the_height_on_the_axis():
    at_border = RING.ray(np.array([[float(RING.columns[3]) + 1e-9, y] for y in (0.0, 50.0, 100.0)]))
    reach = at_border.origin + at_border.direction * (3.0 / np.linalg.norm(at_border.direction[:, :2], axis=1))[:, None]
    assert np.allclose(reach[:, 2], [1.3, 0.3, -0.7])


def test_a_turn_of_less_than_a_circle():
    camera = MANY.around((0, 0, 0), 2.0, 1.0, 90, 40, 5, turn=(0.3, 0.3 + 1.5 * np.pi))
    start, end = (camera.ray(np.array([[x, 20.0]])).origin[0] for x in (0.0, 90.0))
    assert np.allclose(start, 2 * np.array([np.cos(0.3), np.sin(0.3), 0]))
    assert np.allclose(end, 2 * np.array([np.cos(0.3 + 1.5 * np.pi), np.sin(0.3 + 1.5 * np.pi), 0]))


def test_cameras_that_hinge_have_no_seam_where_slits_and_corner_lie_in_one_plane():
    """Two segments with different slits: rows are fitted to each other."""
    hinge, axis = np.array([0.5, 0.0, 1.0]), np.array([0.3, 2.0, 0.0])
    turned = np.array([1.1, 0.4, 1.0])
    path = [[-1.0, 0.0, 1.0], hinge, turned]
    for away in (False, True):
        camera = MANY.along_path(path, [axis, hinge + 1.7 * (axis - hinge)], 150, 60, (-0.4, 0.3), away=away)
        assert seams(camera) < 1e-7
        pixels = np.random.default_rng(1).uniform(0, 1, (300, 2)) * (150, 60)
        ray = camera.ray(pixels)
        side = ray.origin[:, 1] > 1e-9  # the second segment
        assert 50 < side.sum() < 250
        slits = np.where(side[:, None], hinge + 1.7 * (axis - hinge), axis)
        assert np.abs(np.cross(ray.direction, slits - ray.origin)[:, 2]).max() < 1e-9
    other = MANY.along_path(path, [axis, axis + (1.0, 0.0, 0.0)], 150, 60)
    assert seams(other) > 0.01


def test_slope_is_that_of_the_first_corner():
    camera = MANY.along_path([[0, 0, 0], [1, 0, 0]], [[0.2, -2, 5]], 40, 20, (-0.25, 0.5), columns=[40])
    ray = camera.ray(np.array([[0.0 if camera.ray(np.array([[0.0, 0.0]])).origin[0, 0] < 0.5 else 40.0, 0.0]]))
    assert np.allclose(ray.origin, 0) and np.isclose(ray.direction[0, 2] / np.hypot(*ray.direction[0, :2]), 0.5)


def test_grids_are_continuous_everywhere():
    camera = EXAMPLES["grid"]
    assert camera.cut and camera.count == 12
    rng = np.random.default_rng(2)
    pixels = rng.uniform(0.01, 0.99, (4000, 2)) * (90, 60)
    near = pixels + rng.normal(0, 1e-7, pixels.shape)
    first, second = camera.ray(pixels), camera.ray(near)
    assert np.abs(first.direction - second.direction).max() < 1e-6 and np.abs(first.origin - second.origin).max() < 1e-6
    assert len(set(camera.locate(*pixels.T).tolist())) == 12


def test_grid_rays_are_those_given():
    rng = np.random.default_rng(3)
    rays = rng.normal(size=(3, 4, 4))
    camera = MANY.over_grid(rays, 60, 40)
    for row in range(3):
        for column in range(4):
            ray = camera.ray(np.array([float(camera.columns[column]), float(camera.rows[row])]))
            sigma, tau, u, v = rays[row, column]
            assert np.allclose(ray.origin, [u, v, 0])
            assert np.allclose(ray.direction, np.array([sigma, tau, 1.0]) / np.sqrt(sigma**2 + tau**2 + 1))


@pytest.mark.parametrize("camera", [RING, *EXAMPLES.values()])
def test_points_on_rays_project_back_into_their_piece(camera):
    rng = np.random.default_rng(4)
    pixels = rng.uniform(0, 1, (800, 2)) * (camera.width, camera.height)
    ray, depth = camera.ray(pixels), rng.uniform(0.1, 2.0, 800)
    found = camera.project(ray.origin + depth[:, None] * ray.direction)
    assert found.pixel.shape == (800, camera.count, 2)
    piece = camera.locate(*pixels.T)
    lane = np.arange(800)
    valid = found.valid[lane, piece]
    assert valid.mean() > 0.99
    assert np.abs(found.pixel[lane, piece] - pixels)[valid].max() < 1e-7
    assert np.abs(found.depth[lane, piece] - depth)[valid].max() < 1e-9
    for number in range(camera.count):
        x, y = np.moveaxis(found.pixel[found.valid[:, number], number], -1, 0)
        assert (camera.locate(x, y) == number).all()


def test_pieces_are_cameras():
    for camera in (RING, EXAMPLES["grid"]):
        pixels = np.random.default_rng(5).uniform(0, 1, (200, 2)) * (camera.width, camera.height)
        number = camera.locate(*pixels.T)
        rays = camera.ray(pixels)
        for k in set(number.tolist()):
            alone = camera.piece(int(k)).ray(pixels[number == k])
            assert np.allclose(alone.origin, rays.origin[number == k])
            assert np.allclose(alone.direction, rays.direction[number == k])
    assert all(RING.piece(k).kind == "cross_slit" for k in range(RING.count))


def test_cameras_beside_each_other():
    left = GL.pinhole(30, 40, camera_from_world=mp.look_at((1, 0, 0), (0, 3, 0)))
    right = GL.pushbroom(50, 40, 0.1, camera_from_world=mp.look_at((0, 1, 0), (0, 3, 1)))
    camera = MANY.beside([left, right])
    assert (camera.width, camera.height, camera.count) == (80, 40, 2)
    assert camera.piece(0).kind == "pinhole" and camera.piece(1).kind == "pushbroom"
    pixel = np.array([[12.3, 4.5], [47.0, 33.0]])
    ray = camera.ray(pixel)
    for number, one, shift in ((0, left, 0.0), (1, right, 30.0)):
        alone = one.ray(pixel[number] - (shift, 0.0))
        assert np.allclose(ray.origin[number], alone.origin) and np.allclose(ray.direction[number], alone.direction)
    moved = MANY.beside([left, right], mp.look_at((2, 2, 2), (0, 0, 0)))
    assert not np.allclose(moved.ray(pixel).direction, ray.direction)


GOOD = {"rays": np.zeros((2, 3, 4)), "image": [[[0, 0], [5, 0], [0, 4]]] * 2, "columns": [0, 5, 10], "rows": [0, 4]}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"rays": np.zeros((3, 3, 4))}, "grid has 2 tiles"),
        ({"rays": np.zeros((2, 4, 3))}, "shape"),
        ({"rays": np.full((2, 3, 4), np.nan)}, "NaN"),
        ({"image": [[[0, 0], [5, 0], [10, 0]]] * 2}, "piece 0 lie on one line"),
        ({"image": [[[0, 0], [5, 0], [0, 4]]] * 4}, "image holds 4"),
        ({"columns": [0, 5, 5]}, "columns"),
        ({"columns": [1, 5, 10]}, "rise from 0"),
        ({"rows": [0, 4.5]}, "rows"),
        ({"frames": np.zeros((2, 4, 4))}, "not rigid"),
        ({"rays": "words"}, "numbers"),
    ],
)
def test_mistakes_are_named(change, words):
    MANY(**GOOD)
    with pytest.raises(mp.InputError, match=words):
        MANY(**(GOOD | change))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: MANY.beside([]), "got none"),
        (lambda: MANY.beside([mp.Pinhole(4, 4)]), "got Pinhole"),
        (lambda: MANY.beside([GL.pinhole(4, 4), GL.pinhole(4, 5)]), "one height"),
        (lambda: MANY.around((0, 0, 0), 0.0, 1.0, 90, 40), "radius"),
        (lambda: MANY.around((0, 0, 0), 1.0, 1.0, 90, 40, 1), "half"),
        (lambda: MANY.around((0, 0, 0), 1.0, 1.0, 90, 40, turn=(0, 7)), "whole turn"),
        (lambda: MANY.around((0, 0, 0), 1.0, 1.0, 9, 40, 20), "width"),
        (lambda: MANY.around((0, 0), 1.0, 1.0, 90, 40), "center"),
        (lambda: MANY.along_path([[0, 0, 0], [1, 0, 1]], [[0, 1, 0]], 9, 9), "one height"),
        (lambda: MANY.along_path([[0, 0, 0], [1, 0, 0]], [[2, 0, 0]], 9, 9), "in line"),
        (lambda: MANY.along_path([[0, 0, 0], [1, 0, 0]], [[2, 0, 0]] * 2, 9, 9), "for each segment"),
        (lambda: MANY.along_path([[0, 0, 0], [1, 0, 0]], [[0, 1, 0]], 9, 9, (1, -1)), "slope"),
        (lambda: MANY.along_path([[0, 0, 0], [1, 0, 0]], [[0, 1, 0]], 9, 9, columns=[8]), "columns"),
        (lambda: MANY.along_path([[0, 0, 0], [1, 0, 0]], [[0, 1, 0]], 9, 9, up=(0, 0, 0)), "up"),
        (lambda: MANY.over_grid(np.zeros((3, 4)), 9, 9), "over_grid"),
        (lambda: MANY.over_grid(np.zeros((3, 30, 4)), 9, 9), "width"),
    ],
)
def test_mistakes_of_makers_are_named(make, words):
    with pytest.raises(mp.InputError, match=words):
        make()


def test_equal_cameras_are_equal():
    again = MANY.around((0.5, -0.2, 0.3), 3.0, 2.0, 240, 100, 16)
    assert again == RING and dataclasses.replace(again, rays=np.asarray(again.rays) * 1.1) != RING
    assert repr(RING) == "GeneralLinears(240x100, 16 pieces)"


def test_stress_cases_pass():
    from mpcam.stress.general_linears import cameras, piece_rows

    found = cameras()
    for name in (next(iter(found)), "grid"):
        rows = piece_rows(name, found[name], 6)
        assert [row for row in rows if not row.good()] == []
        assert sum(row.worst > 0 for row in rows) > 20 and any(row.count for row in rows if "other" in row.case)
