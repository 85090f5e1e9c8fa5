"""The single-pole occlusion camera: images and bent rays against its definition at 50 digits, and derivatives."""

import dataclasses

import jax
import jax.numpy as jnp
import mpmath
import numpy as np
import pytest
from catalog import POSE
from single_poles import EXAMPLES, RANGES, SHIFTED, at, make, seen

import mpcam as mp
from mpcam.stress.exact import DIGITS
from mpcam.stress.single_pole_truth import exact, numbers, pixel_of, point_at


@pytest.mark.parametrize("ranges", RANGES)
@pytest.mark.parametrize("name", EXAMPLES)
def test_rays_run_through_the_points_that_their_pixels_show(name, ranges):
    camera, k = EXAMPLES[name], RANGES.index(ranges)
    points = seen(camera, ranges)
    image = camera.project(points)
    assert image.valid.all() and image.pixel.shape == (3000, 1, 2)
    depth, pieces = image.depth[:, 0], camera.ray_pieces(image.pixel[:, 0])
    assert pieces.valid[:, k].all()
    size = 1 + np.linalg.norm(points - camera.eye, axis=-1)
    assert (np.linalg.norm(at(pieces, k, depth) - points, axis=-1) / size).max() < 1e-12
    assert ((pieces.start[:, k] - 1e-12 * size <= depth) & (depth <= pieces.end[:, k] + 1e-12 * size)).all()
    if ranges == "within":
        ray = camera.ray(image.pixel[:, 0])
        assert (np.linalg.norm(ray.origin + depth[:, None] * ray.direction - points, axis=-1) / size).max() < 1e-12


@pytest.mark.parametrize("name", EXAMPLES)
def test_points_of_rays_have_their_pixel_and_their_length(name):
    camera, rng = EXAMPLES[name], np.random.default_rng(1)
    pixels = rng.uniform(-0.5, 1.5, (3000, 2)) * [96, 64]
    pieces = camera.ray_pieces(pixels)
    assert pieces.origin.shape == (3000, 3, 3) and pieces.end.shape == (3000, 3)
    for k in range(3):
        there = pieces.valid[:, k]
        assert there.sum() > 1000
        start, end = pieces.start[:, k], np.minimum(pieces.end[:, k], pieces.start[:, k] + 30)
        length = start + rng.uniform(1e-3, 1 - 1e-3, 3000) * (end - start)
        points = at(pieces, k, length)
        image = camera.project(points)
        assert image.valid[there].all()
        assert np.abs(image.depth[there, 0] / length[there] - 1).max() < 1e-12
        pinhole = mp.Pinhole(96, 64, camera.fx, camera.fy, camera.cx, camera.cy, POSE).project(points)
        clear = there & (np.linalg.norm(pinhole.pixel[:, 0] - camera.pole, axis=-1) > 0.5) & (length > 0.02)
        assert clear.sum() > 0.8 * there.sum()  # not next to the axis, where the direction from the pole means little
        assert np.abs(image.pixel[:, 0] - pixels)[clear].max() < 1e-10


@pytest.mark.parametrize("name", SHIFTED)
def test_pieces_join_and_end_on_the_axis(name):
    camera, rng = EXAMPLES[name].with_pose(np.eye(4)), np.random.default_rng(2)
    angle, r = rng.uniform(0, 2 * np.pi, 2000), rng.uniform(0, 1.6 * camera.shift_far, 2000)
    pieces = camera.ray_pieces(camera.pole + r[:, None] * np.stack([np.cos(angle), np.sin(angle)], -1))
    assert (pieces.valid[:, 0] == (r >= camera.shift_near)).all()
    assert (pieces.valid[:, 1] == (r > camera.shift_near)).all() and (
        pieces.valid[:, 2] == (r >= camera.shift_far)
    ).all()
    assert not pieces.start[:, 0].any() and not pieces.origin[:, 0].any()
    assert np.isinf(pieces.end[pieces.valid[:, 2], 2]).all() and np.isfinite(pieces.end[:, :2]).all()
    assert np.isfinite(pieces.origin).all() and np.isfinite(pieces.direction).all()
    for k in (0, 1):
        both = pieces.valid[:, k + 1]
        assert np.array_equal(pieces.end[both, k], pieces.start[both, k + 1])
        assert np.abs(at(pieces, k, pieces.end[:, k]) - pieces.origin[:, k + 1])[both].max() < 1e-13
    ends = pieces.valid[:, 1] & ~pieces.valid[:, 2]
    last = at(pieces, 1, pieces.end[:, 1])[ends]
    pole = np.array([(camera.pole[0] - camera.cx) / camera.fx, (camera.pole[1] - camera.cy) / camera.fy])
    assert ends.sum() > 500 and np.abs(last[:, :2] - last[:, 2:] * pole).max() < 1e-13
    assert ((last[:, 2] > camera.near) & (last[:, 2] < camera.far)).all()


@pytest.mark.parametrize("name", EXAMPLES)
def test_image_and_depth_do_not_jump_at_the_limits(name):
    camera = EXAMPLES[name].with_pose(np.eye(4))
    x, y = np.random.default_rng(3).normal(size=(2, 500))
    for limit in (camera.near, camera.far):
        before, behind = (camera.project(np.stack([x, y, 0 * x + limit * k], -1)) for k in (1 - 1e-13, 1 + 1e-13))
        assert np.abs(before.pixel - behind.pixel).max() < 1e-9 and np.abs(before.depth - behind.depth).max() < 1e-9


@pytest.mark.parametrize("name", ["single pole", "single pole, hole"])
def test_pieces_are_straight_by_the_definition(name):
    """At 50 digits, and for fx != fy: the points of one pixel lie on one line within each range, and bend between."""
    camera = EXAMPLES[name]
    with mpmath.workdps(DIGITS):
        values = exact(numbers(camera))
        near, far = values[6], values[7]
        u, v = exact([camera.pole[0] + 29.0, camera.pole[1] - 17.0])
        depths = [near / 3, near / 2, near, (3 * near + far) / 4, (near + far) / 2, far, 2 * far, 5 * far]
        places = [mpmath.matrix(point_at(u, v, z, values)) for z in depths]
        for place in places:
            back = pixel_of(*place, values)
            assert max(abs(back[0] - u), abs(back[1] - v)) < mpmath.mpf(10) ** -50

        def turn(i, j, k):
            p, q = places[j] - places[i], places[k] - places[j]
            cross = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
            return max(map(abs, cross)) / (mpmath.norm(p) * mpmath.norm(q))

        assert max(turn(*i) for i in ((0, 1, 2), (2, 3, 4), (3, 4, 5), (2, 4, 5), (5, 6, 7))) < mpmath.mpf(10) ** -50
        assert min(turn(1, 2, 3), turn(4, 5, 6)) > 0.01
        lengths = [0, *(mpmath.norm(q - p) for p, q in zip(places, places[1:], strict=False))]
        lengths[0] = mpmath.norm(places[0])
        depth = camera.with_pose(np.eye(4)).project([[float(x) for x in place] for place in places]).depth[:, 0]
        for number, found in enumerate(depth):
            assert abs(mpmath.mpf(float(found)) - sum(lengths[: number + 1])) < 1e-14 * sum(lengths)


def test_middle_pieces_come_from_an_ellipse_of_viewpoints():
    camera = make()
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    e = np.stack([np.cos(angle), np.sin(angle)], -1)
    for r in (21.0, 40.0):
        ray = camera.ray(camera.pole + r * e)
        start = ray.origin - (ray.origin[:, 2] / ray.direction[:, 2])[:, None] * ray.direction
        assert np.abs(start[:, :2] - e * camera.viewpoint_radii).max() < 1e-13
    assert np.allclose(camera.viewpoint_radii, [18 * 1.5 / 60, 18 * 1.5 / 52], rtol=1e-15)


def test_without_a_shift_it_is_a_pinhole():
    camera, rng = EXAMPLES["single pole, no shift"], np.random.default_rng(5)
    pinhole = mp.Pinhole(96, 64, camera.fx, camera.fy, camera.cx, camera.cy, POSE)
    points = np.concatenate([seen(camera, name, 500) for name in RANGES] + [camera.eye + rng.normal(size=(500, 3))])
    one, other = camera.project(points), pinhole.project(points)
    assert np.array_equal(one.valid, other.valid) and not one.valid.all()
    assert np.abs(one.pixel - other.pixel)[one.valid].max() < 1e-9
    assert np.abs(one.depth / np.where(other.valid, other.depth, 1) - 1)[one.valid].max() < 1e-13
    pixels = np.concatenate([rng.uniform(0, 64, (500, 2)), [camera.pole]])
    mine, theirs, pieces = camera.ray(pixels), pinhole.ray(pixels), camera.ray_pieces(pixels)
    assert mine.valid.all() and pieces.valid.all()
    assert np.abs(mine.direction - theirs.direction).max() < 1e-15
    assert np.abs(mine.origin - theirs.origin).max() < 1e-14
    assert np.abs(pieces.direction - theirs.direction[:, None]).max() < 1e-14


def test_what_is_in_front_has_the_larger_measure():
    """1 / z falls along rays, is linear along lines in the pinhole's image, and here along lines through the pole."""
    camera = make()
    pixels = np.random.default_rng(6).uniform(0, 64, (300, 2))
    pieces = camera.ray_pieces(pixels)
    lengths = np.linspace(0.01, 1, 50)[:, None] * np.minimum(np.where(pieces.valid, pieces.end, 0).max(1), 40)
    points, there = [], []
    for row in lengths:
        inside = pieces.valid & (pieces.start <= row[:, None]) & (row[:, None] <= pieces.end)
        points.append(sum(inside.argmax(1)[:, None].__eq__(k) * at(pieces, k, row) for k in range(3)))
        there.append(inside.any(1))
    measure = np.stack([camera.local_measure(row.T) for row in points])
    there = np.all(there, axis=0)
    assert there.sum() > 250 and (np.diff(measure, axis=0)[:, there] < 0).all()
    assert np.array_equal(camera.local_measure(np.array([[0, 0], [0, 0], [0, -1.0]])), [0, 0])
    z = 1.5 / (1 + 0.3 * np.linspace(-0.4, 0.4, 9))  # the plane z + 0.3 x = 1.5 along the pole's row, within the range
    offset = np.array([(camera.pole[0] - camera.cx) / camera.fx, (camera.pole[1] - camera.cy) / camera.fy])
    x = np.linspace(0.1, 0.4, 9)
    z = 1.5 / (1 + 0.3 * x)
    plane = np.stack([(x + offset[0]) * z, offset[1] * z, z], -1)
    u = camera.project(plane).pixel[:, 0, 0]
    line = np.polyfit(u, 1 / z, 1)
    assert np.abs(np.polyval(line, u) - 1 / z).max() < 1e-12
    # beside the pole it is not linear
    aside = np.stack([x * z, (x + 0.2) * z, z], -1)
    u = camera.project(aside).pixel[:, 0, 0]
    assert np.abs(np.polyval(np.polyfit(u, 1 / z, 1), u) - 1 / z).max() > 1e-5


def test_points_on_the_axis_have_an_image_to_the_right_of_the_pole():
    camera = make()
    z = np.array([0.5, 1.0, 1.5, 3.0, 9.0])
    x, y = (40 - 45) / 60, (25 - 33) / 52
    image = camera.project(np.stack([x * z, y * z, z], -1))
    assert image.valid.all()
    assert np.allclose(image.pixel[:, 0], np.stack([40 + 2 + 18 * np.clip(1.5 * (1 - 1 / z), 0, 1), 0 * z + 25], -1))
    assert not camera.project([[0, 0, 0.0], [0, 0, -1], [1, 1, 0], [np.nan, 0, 1], [1e300, 0, 1e-300]]).valid.any()


# Derivatives


def test_derivatives_at_the_pole_are_finite():
    x, y, z = (40 - 45) / 60, (25 - 33) / 52, np.array([0.5, 1.0, 2.0, 3.0, 5.0])
    points = np.stack([x * z, y * z, z], -1)
    pixels = np.stack([40 + np.array([0.0, 1, 2, 10, 20, 30]), np.full(6, 25.0)], -1)

    def everything(camera, points, pixels):
        image, ray, pieces = camera.project(points), camera.ray(pixels), camera.ray_pieces(pixels)
        parts = (image.pixel, image.depth, *ray[:2], *pieces[:3], jnp.where(jnp.isfinite(pieces.end), pieces.end, 0.0))
        return sum(part.sum() for part in parts)

    with jax.enable_x64(True):
        gradient = jax.jit(jax.grad(everything, argnums=(0, 1, 2)))
        for shift in (0.0, 2.0):
            found = jax.tree_util.tree_leaves(
                gradient(make(shift_near=shift), jnp.asarray(points), jnp.asarray(pixels))
            )
            assert len(found) == 13 and all(np.isfinite(leaf).all() for leaf in found)
            assert all(np.abs(leaf).max() > 0 for leaf in found)


def test_a_range_that_single_precision_cannot_hold_gives_numbers():
    camera = make(far=1.0 + 1e-12)
    points = jnp.asarray([[0.1, 0.2, 0.5], [0.1, 0.2, 1.0], [0.1, 0.2, 2.0]], jnp.float32)
    image = jax.jit(lambda camera, points: camera.project(points))(camera, points)
    assert image.valid.all() and np.isfinite(image.pixel).all() and np.isfinite(image.depth).all()
    assert np.abs(image.pixel - camera.project(np.asarray(points)).pixel)[[0, 2]].max() < 1e-4


def test_derivatives_in_the_numbers_match_differences():
    names = ("near", "far", "shift_near", "shift_far")
    point, pixel = np.array([0.4, -0.3, 1.7]), np.array([70.0, 50.0])

    def both(values):
        camera = dataclasses.replace(make(), **dict(zip(names, values, strict=True)))
        image, pieces = camera.project(point), camera.ray_pieces(pixel)
        return image.pixel.sum() + image.depth.sum() + (pieces.origin + pieces.direction).sum() + pieces.start.sum()

    with jax.enable_x64(True):
        values = np.array([getattr(make(), name) for name in names])
        found = np.asarray(jax.jit(jax.grad(lambda values: both([*values])))(values))
    for row, derivative in zip(1e-6 * np.eye(4), found, strict=True):
        difference = (both([*map(float, values + row)]) - both([*map(float, values - row)])) / 2e-6
        assert abs(derivative - difference) < 1e-6 * max(1, abs(derivative))
