"""The Brown-Conrady lens in JAX, Dr.Jit, kernels, Mitsuba and files, and wrong ones."""

import copy
import dataclasses
import pickle
from typing import Any

import drjit as dr
import drjit.llvm as types
import drjit.llvm.ad as ad
import jax
import mitsuba as mi
import numpy as np
import pytest
from catalog import POSE
from test_brown_conrady import LENSES, stretch

import mpcam as mp
from mpcam.backend import aligned
from mpcam.cameras import folds
from mpcam.cameras.change import resized
from mpcam.cameras.distortion import Distortion
from mpcam.cameras.serialize import camera_from_json, camera_to_json
from mpcam.rendering.device_camera import unposed
from mpcam.tracing.meshes import mitsuba_mesh


@pytest.fixture(params=LENSES)
def lens(request):
    return LENSES[request.param]


def numbers_of(camera):
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy, *camera.k, *camera.p])


def from_numbers(n, pose=None):
    return mp.BrownConrady(64, 64, n[0], n[1], n[2], n[3], n[4:10], n[10:], pose)


@pytest.mark.parametrize("scale", [1e-12, 1e-8, 1e8, 1e12])
def test_projection_does_not_depend_on_distance(lens, scale):
    points = np.array([[0.3, -0.2, 0.9], [1e-6, 0, 1.0], [0.0, 0.0, 1.0]]) * [0.01, 0.01, 1]
    near = lens.project(points)
    assert near.valid.all()
    assert np.allclose(lens.project(points * scale).pixel, near.pixel, rtol=1e-12)
    far = lens.project(types.Array3f(*map(aligned, (points * scale).T)))
    assert np.allclose(far.pixel[0].numpy().T, near.pixel[:, 0], rtol=2e-6, atol=1e-3)


@jax.jit
def traced_ray(numbers, pixels):
    """With parameters that JAX traces; the domain is found on grids."""
    return from_numbers(numbers).ray(pixels)


def test_float32_and_jax_agree_with_float64(lens):
    pixels = np.random.default_rng(11).uniform(0, 1, (2000, 2)) * [lens.width, lens.height]
    ray = lens.ray(pixels)
    on_device: Any = unposed(lens)
    device = on_device.local_ray(types.Array2f(*map(aligned, pixels.T)))
    with jax.enable_x64(True):
        traced = traced_ray(numbers_of(lens), pixels)
    for other in (device.valid, traced.valid):
        assert (np.asarray(other) != ray.valid).mean() < 2e-3
    # Away from folds, where sqrt(eps) of the pixel is eps of the ray.
    sure = ray.valid & (np.hypot(*ray.direction[:, :2].T) < 0.9 * lens.reach.inner * ray.direction[:, 2])
    assert sure.mean() > 0.2
    assert np.abs(device.direction.numpy().T - ray.direction)[sure].max() < 2e-5
    assert np.abs(np.asarray(traced.direction) - ray.direction)[sure].max() < 1e-13
    points = 3 * ray.direction[sure]
    image = on_device.local_project(types.Array3f(*map(aligned, points.T)))[0]
    off = np.abs(image.pixel.numpy().T - lens.project(points).pixel[:, 0]).max(-1)
    assert (off < 1e-6 * (stretch(lens, points / points[:, 2:]) + 100)).all()


def test_double_precision_on_dr_jit():
    camera = LENSES["EuRoC"]
    pixels = np.random.default_rng(12).uniform(0, 1, (500, 2)) * [camera.width, camera.height]
    device = camera.ray(types.Array2f64(*pixels.T))
    assert np.abs(device.direction.numpy().T - camera.ray(pixels).direction).max() < 1e-14


def test_jax_finds_the_same_domain():
    find = jax.jit(lambda n: folds.reach(Distortion(tuple(n[:6]), (n[7], n[6])), 1.5))
    for camera in LENSES.values():
        with jax.enable_x64(True):
            found = np.asarray(find(numbers_of(camera)[4:]))
        expected = dataclasses.replace(camera, max_angle=1.5).reach
        assert np.allclose(found[:2], expected[:2], rtol=1e-6)
        assert np.isclose(found[2], expected[2], atol=1e-9)


def outputs(numbers, pose, point, pixel):
    """Pixel of a point and direction of a pixel, as functions of everything."""
    camera = from_numbers(numbers, pose)
    return camera.project(point).pixel[0], camera.ray(pixel).direction


gradients = jax.jit(jax.jacrev(outputs, (0, 1, 2, 3)))


@pytest.mark.parametrize("name", ["EuRoC", "rational", "decentred", "folds in the image"])
def test_jax_gradients_match_differences(name):
    """Of pixels and rays, with respect to points, pixels, the pose and every number of the camera."""
    camera = LENSES[name]
    numbers = numbers_of(camera)
    for off in ([0.2, -0.1], [0.0, 0.0]):
        pixel = numbers[2:4] + off * numbers[:2]
        ray = camera.with_pose(POSE).ray(pixel)
        given = [numbers, POSE, ray.origin + 2.5 * ray.direction, pixel]
        with jax.enable_x64(True):
            found = gradients(*given)
        for of in range(2):
            for place in (0, 2, 3):
                for i, value in enumerate(given[place]):
                    step = 1e-6 * max(1.0, abs(value))
                    moved = [[*given], [*given]]
                    for side, sign in enumerate((1, -1)):
                        moved[side][place] = given[place] + sign * step * np.eye(len(given[place]))[i]
                    difference = (outputs(*moved[0])[of] - outputs(*moved[1])[of]) / (2 * step)
                    gradient = np.asarray(found[of][place])[..., i]
                    assert np.abs(gradient - difference).max() < 1e-6 * (1 + np.abs(difference).max())
            assert np.isfinite(np.asarray(found[of][1])).all()
        assert np.abs(np.asarray(found[0][1])).max() > 1


def test_gradients_are_finite_everywhere():
    numbers = numbers_of(LENSES["folds in the image"])
    pixels = [[32.0, 31], [5, 5], [np.nan, 1], [1e300, 0], [60, 31], [32, 31], [1, 1]]
    points = [[0, 0, 1.0], [0, 0, 0], [0, 0, -1], [1, 2, -3], [1e300, 0, 1], [9, 9, 1], [1, 0, 0]]
    for point, pixel in zip(points, pixels, strict=True):
        with jax.enable_x64(True):
            found = gradients(numbers, np.eye(4), np.array(point, float), np.array(pixel, float))
        assert all(np.isfinite(np.asarray(leaf)).all() for leaf in jax.tree_util.tree_leaves(found))


def test_dr_jit_gradients_match_differences():
    camera = LENSES["EuRoC"]
    pixel = ad.Array2f64([500.0, 200.0], [100.0, 300.0])
    dr.enable_grad(pixel)
    direction = camera.ray(pixel).direction
    dr.backward(dr.sum(direction.x) + 2 * dr.sum(direction.y))
    at, gradient = np.array([[500.0, 100.0], [200.0, 300.0]]), []
    for axis in range(2):
        step = 1e-5 * np.eye(2)[axis]
        change = (camera.ray(at + step).direction - camera.ray(at - step).direction) / 2e-5
        gradient.append(change @ [1, 2, 0])
    assert np.allclose(dr.grad(pixel).numpy(), gradient, rtol=1e-6)


def test_kernels_see_every_number():
    camera = LENSES["folds in the image"]
    on_device: Any = unposed(camera)
    for name in ("k", "p", "reach"):
        numbers = [number.numpy()[0] for number in getattr(on_device, name)]
        assert np.allclose(numbers, getattr(camera, name), rtol=1e-6)


@pytest.mark.parametrize("name", mp.BrownConrady.examples(8, 8))
def test_linear_views_and_fine_meshes_come_near(name):
    """On a finely divided sphere, straight edges and a cubemap are nearly right."""
    camera = mp.BrownConrady.examples(128, 96, mp.look_at((0.12, 0.07, 0.31), (0.5, 1.0, 0.7)))[name]
    mesh = mp.builtin_mesh("sphere", triangles=20480)
    truth = mp.rasterize(camera, mesh, method="raytrace")
    assert truth.mask.mean() > 0.8
    for method, settings, tolerance in (("vertex", {"level": 2}, 1e-4), ("cubemap", {"resolution": 512}, 2e-3)):
        hits = mp.rasterize(camera, mesh, method=method, **settings)
        assert (hits.mask != truth.mask).mean() < 2e-3
        both = hits.mask & truth.mask
        assert np.percentile(np.abs(hits.depth[both] - truth.depth[both]), 99) < tolerance


@pytest.mark.parametrize("name", mp.BrownConrady.examples(8, 8))
def test_mitsuba_traces_the_rays_of_the_camera(name):
    mi.set_variant("llvm_ad_rgb")
    mp.truth.register()
    camera = mp.BrownConrady.examples(96, 72, mp.look_at((0.12, 0.07, 0.31), (0.5, 1.0, 0.7)))[name]
    mesh = mp.builtin_mesh("temple")
    shape = mitsuba_mesh(mi, "mesh", mesh.vertices, mesh.faces)
    sensor = mp.truth.sensor(camera, 1, centered=True)
    scene = mi.load_dict({"type": "scene", "integrator": {"type": "depth"}, "mesh": shape, "sensor": sensor})
    image = np.array(mi.render(scene, spp=1))[..., 0]
    hits = mp.rasterize(camera, mesh, method="raytrace")
    assert ((image > 0) != hits.mask).sum() <= 1
    both = (image > 0) & hits.mask
    assert (np.abs(image[both] - hits.depth[both]) <= 1e-4 * np.maximum(hits.depth[both], 1)).mean() >= 0.999


def test_files_and_copies_are_equal(lens, tmp_path):
    camera = lens.with_pose(POSE)
    assert camera_from_json(camera_to_json(camera)) == camera
    mp.write_image(tmp_path / "a.exr", np.zeros((camera.height, camera.width, 3), np.float32), camera=camera)
    assert mp.read_camera(tmp_path / "a.exr") == camera
    for again in (pickle.loads(pickle.dumps(camera)), copy.deepcopy(camera)):
        assert again == camera
        assert again.reach == camera.reach
    leaves, tree = jax.tree_util.tree_flatten(camera)
    assert len(leaves) == 4 + 6 + 2 + 1 + 1
    assert jax.tree_util.tree_unflatten(tree, leaves) == camera


def test_another_size_shows_the_same():
    camera = LENSES["EuRoC"]
    half = resized(camera, 376, 240)
    pixels = np.array([[100.0, 200.0], [700.0, 30.0]])
    assert np.allclose(camera.ray(pixels).direction, half.ray(pixels / 2).direction, atol=1e-12)


def test_printed_on_one_line():
    text = repr(mp.BrownConrady(64, 48, 30, 31, 32, 24, (-0.3, 0.1), (1e-3,), mp.look_at((1, 2, 3), (0, 0, 0)), 1.0))
    assert text == (
        "BrownConrady(64, 48, fx=30, fy=31, cx=32, cy=24, k=(-0.3, 0.1, 0, 0, 0, 0), p=(0.001, 0), "
        "max_angle=1, eye=(1, 2, 3))"
    )


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: mp.BrownConrady(4, 4, 3, 3, 2, 2, 0.1), r"k=0.1\): at most 6 numbers are needed"),
        (lambda: mp.BrownConrady(4, 4, 3, 3, 2, 2, [0.0] * 7), "at most 6 numbers"),
        (lambda: mp.BrownConrady(4, 4, 3, 3, 2, 2, (), (1, 2, 3)), r"p=\(1, 2, 3\)\): at most 2 numbers"),
        (lambda: mp.BrownConrady(4, 4, 3, 3, 2, 2, (np.nan,)), "between -1e.30 and 1e.30"),
        (lambda: mp.BrownConrady(4, 4, 3, 3, 2, 2, "none"), "at most 6 numbers"),
        (lambda: mp.BrownConrady(4, 4, 0, 3, 2, 2), "fx=0.*above 0"),
        (lambda: mp.BrownConrady(4, 4, 3, 3, 2, 2, max_angle=2), "max_angle=2.*above 0 up to 1.5708"),
        (lambda: mp.BrownConrady(4, 4, 3, 3, 2, 2).bound(np.zeros((3, 3))), "local_bound.*BrownConrady does not have"),
    ],
)
def test_mistakes_are_one_line(make, words):
    with pytest.raises(mp.InputError, match=words) as caught:
        make()
    assert "\n" not in str(caught.value)
