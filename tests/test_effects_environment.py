"""Environment maps: look-ups against what is there, across the seam, and in a kernel."""

import drjit as dr
import numpy as np
import pytest

import mpcam as mp
from mpcam.backend import types
from mpcam.effects.lookup import texel_direction
from mpcam_kernels.frozen import frozen

CENTRE = np.array([0.3, -0.2, 0.1])


def directions(count: int, seed: int = 0) -> np.ndarray:
    """Unit vectors all around, and those along the axes, where views meet and end."""
    random = np.random.default_rng(seed).normal(size=(count, 3))
    return np.vstack([random / np.linalg.norm(random, axis=1, keepdims=True), np.eye(3), -np.eye(3)])


def dome(color) -> mp.Mesh:
    """A ball around CENTRE, of vertices colored by their direction from it."""
    ball = mp.builtin_mesh("sphere", triangles=81_920)
    return mp.Mesh(
        5 * ball.vertices + CENTRE, ball.faces, colors=color(ball.vertices), materials=mp.Material((1, 1, 1))
    )


def linear(direction: np.ndarray) -> np.ndarray:
    return 0.5 + 0.5 * direction


@pytest.fixture(scope="module")
def maps() -> dict[int, mp.EnvironmentMap]:
    mesh = dome(linear)
    return {size: mp.environment_map(mesh, CENTRE, size, shading="color") for size in (16, 32, 64, 128)}


def test_bilinear_look_ups_converge_with_the_square_of_the_size(maps):
    d = directions(20_000)
    errors = [np.abs(one.lookup(d) - linear(d)).max() for one in maps.values()]
    assert errors[-1] < 4e-4
    slope = np.polyfit(np.log(list(maps)), np.log(errors), 1)[0]
    assert -2.6 < slope < -1.6


def test_there_is_no_seam(maps):
    """Where the views meet, look-ups are as good as elsewhere, from both sides."""
    angle = np.linspace(0, 2 * np.pi, 2000)
    for size, one in maps.items():
        for x in (0.0, 1e-7, -1e-7, 0.5 / size, -0.5 / size):
            d = np.stack([np.full_like(angle, x), np.cos(angle), np.sin(angle)], -1)
            assert np.abs(one.lookup(d) - linear(d / np.linalg.norm(d, axis=1, keepdims=True))).max() < 2.5 / size**2


def test_a_constant_surrounding_is_constant():
    """Nothing of the black corners beyond the rim comes in."""
    mesh = dome(lambda direction: 0 * direction + (0.25, 0.5, 0.75))
    for size in (8, 9, 33, 64):
        one = mp.environment_map(mesh, CENTRE, size, shading="color")
        assert np.allclose(one.lookup(directions(5000)), (0.25, 0.5, 0.75), atol=1e-6)
    assert np.abs(one.images[0][0, 0]).max() == 0  # what must not come in


def test_pixels_are_found_again(maps):
    """Looking along a pixel's ray gives the pixel, in the view that is asked for that direction."""
    one = maps[32]
    v, u = np.indices((32, 32)) + 0.5
    for camera, image, side in zip(one.cameras, one.images, (1, -1), strict=True):
        ray = camera.ray(np.stack([u, v], -1))
        use = ray.valid & (side * ray.direction[..., 0] > 1e-6)
        assert use.sum() > 500
        assert np.allclose(one.lookup(ray.direction[use]), image[use], atol=1e-5)
        column, row = types().Int(np.arange(1024) % 32), types().Int(np.arange(1024) // 32)
        found = np.array(texel_direction(column, row, types().Bool(side > 0), 32)).T.reshape(32, 32, 3)
        assert np.allclose(found[ray.valid], ray.direction[ray.valid], atol=1e-6)


def test_views_see_a_little_more_than_a_half_space_each(maps):
    for size, one in maps.items():
        front, back = one.cameras
        assert np.pi < front.fov < np.pi + 16 / size
        assert np.allclose(front.eye, CENTRE) and np.allclose(back.eye, CENTRE)
        v, u = np.indices((size, size)) + 0.5
        behind = front.ray(np.stack([u, v], -1))
        assert (behind.direction[behind.valid][:, 0] < 0).any()


def test_a_scene_looks_as_a_camera_there_sees_it():
    scene = mp.builtin_scene("temple", 96, 96)
    one = mp.environment_map(scene, scene.camera.eye, 512)
    image = mp.render(scene.camera, scene)
    v, u = np.indices((96, 96)) + 0.5
    ray = scene.camera.ray(np.stack([u, v], -1))
    difference = np.abs(one.lookup(ray.direction) - image).max(-1)[ray.valid]
    assert np.median(difference) < 0.02
    elsewhere = mp.environment_map(scene, scene.camera.eye + (0, 0, 1), 512)
    assert np.median(np.abs(elsewhere.lookup(ray.direction) - image).max(-1)[ray.valid]) > 0.04


def test_settings_reach_the_renderer():
    scene = mp.builtin_scene("facade")
    plain, shadowed = (mp.environment_map(scene, (0, 0, 1.6), 64, shadows=on) for on in (False, True))
    assert (plain.images[0] >= shadowed.images[0] - 1e-6).all()
    assert (plain.images[0] > shadowed.images[0] + 0.05).any()
    traced = mp.environment_map(scene, (0, 0, 1.6), 64, method="raytrace")
    assert (np.abs(traced.images[0] - plain.images[0]) < 1e-3).mean() > 0.99


def test_kernels_look_up_too(maps):
    @frozen
    def kernel(direction, environment):
        return environment.lookup(2 * direction)

    for size in (16, 64):
        for count in (1, 7, 3000):
            d = directions(count, seed=count)[:count]
            color = kernel(types().Array3f(d.T.astype(np.float32)), maps[size].on_device)
            assert np.allclose(np.array(color).T, maps[size].lookup(d), atol=1e-6)
    assert dr.width(maps[16].on_device.texels) == 2 * 16 * 16 * 3


def test_shapes_are_those_of_the_directions(maps):
    one, d = maps[16], directions(0).reshape(2, 3, 3)
    assert one.lookup(d).shape == (2, 3, 3)
    assert one.lookup(d).dtype == np.float32
    assert np.allclose(one.lookup(1e-30 * d), one.lookup(1e30 * d))
    assert one.lookup([0, 0, 1]).shape == (3,)
    assert one.lookup(np.zeros((0, 3))).shape == (0, 3)
    again = mp.EnvironmentMap(one.position, one.images)
    assert np.array_equal(again.lookup(d), one.lookup(d))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda m: mp.environment_map(m, (0, 0)), r"position has shape \(2,\): the last axis must have length 3"),
        (lambda m: mp.environment_map(m, [(0, 0, 0)]), r"position has shape \(1, 3\): give 3 numbers"),
        (lambda m: mp.environment_map(m, (0, 0, np.inf)), "position is .*inf.*: finite numbers are needed"),
        (lambda m: mp.environment_map(m, (0, 0, 0), 7), "size=7: a whole number of pixels from 8 to 16384"),
        (lambda m: mp.environment_map(m, (0, 0, 0), True), "size=True: a whole number"),
        (lambda m: mp.environment_map(m, (0, 0, 0), 8, shading="dark"), "shading='dark': allowed are color"),
        (lambda m: mp.environment_map(m, (0, 0, 0), 8, method="magic"), "method='magic': allowed are invert"),
        (lambda m: mp.environment_map("m", (0, 0, 0), 8), "a str is not a scene"),
        (lambda m: mp.EnvironmentMap((0, 0, 0), (np.zeros((8, 8, 3)),)), "give two pictures"),
        (lambda m: mp.EnvironmentMap((0, 0, 0), (np.zeros((8, 9, 3)),) * 2), r"\(8, 9, 3\).*square"),
        (lambda m: mp.environment_map(m, (0, 0, 0), 8).lookup((1, 2)), r"directions has shape \(2,\)"),
        (lambda m: mp.environment_map(m, (0, 0, 0), 8).lookup(np.zeros((2, 3))), r"directions\[0\].*\(and 1 more like"),
    ],
)
def test_mistakes_are_named(call, words):
    with pytest.raises(mp.InputError, match=words) as caught:
        call(mp.builtin_mesh("cube"))
    assert "\n" not in str(caught.value)
