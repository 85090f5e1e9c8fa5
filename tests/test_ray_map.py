"""Ray maps: rays between pixels, all images of points against brute force and closed forms, derivatives and files."""

import dataclasses
import pickle
from typing import Any

import drjit.llvm as device
import jax
import jax.numpy as jnp
import numpy as np
import OpenImageIO as oiio
import pytest
from catalog import POSE, registered, soup
from ray_fields import wrong_pixels

import mpcam as mp
from mpcam.backend import aligned
from mpcam.cameras.serialize import camera_from_json, camera_to_json
from mpcam.io.cameras import load_camera
from mpcam.stress import ray_map as stress


def grid(width, height):
    """Origins on the plane z = 0 over [-1, 1], and +z everywhere."""
    x, y = np.meshgrid((np.arange(width) + 0.5) / width * 2 - 1, (np.arange(height) + 0.5) / height * 2 - 1)
    return np.stack([x, y, 0 * x], -1), np.stack([0 * x, 0 * x, 1 + 0 * x], -1)


def example(name, *frame) -> Any:
    return mp.RayMap.examples(*frame)[name]


def centers(camera):
    v, u = np.indices((camera.height, camera.width)) + 0.5
    return np.stack([u, v], -1)


def pixels_in(camera, count, seed=0):
    return np.random.default_rng(seed).uniform(0, 1, (count, 2)) * [camera.width, camera.height]


# Rays


def test_at_the_centers_the_rays_are_the_given_ones_to_the_bit():
    rng = np.random.default_rng(0)
    origins, directions = rng.normal(size=(2, 7, 9, 3)) * [[[[3e5]]], [[[1e-3]]]]
    camera = mp.RayMap(origins, directions)
    ray = camera.ray(centers(camera))
    assert ray.valid.all() and np.array_equal(ray.origin, origins)
    unit = np.moveaxis(mp.math.normalize(np.moveaxis(directions, -1, 0)), 0, -1)
    assert np.array_equal(ray.direction, unit)
    found = camera.ray(device.Array2f(*map(aligned, centers(camera).reshape(-1, 2).T)))
    assert np.array_equal(found.origin.numpy().T, origins.reshape(-1, 3).astype(np.float32))


def test_between_the_centers_they_are_bilinear():
    assert stress.ray_row(100).good()


def test_they_go_on_as_far_as_the_border():
    """Linear origins and directions are met everywhere, in the outer halves of the outermost pixels too."""
    origins, directions = grid(6, 4)
    camera = mp.RayMap(origins, directions + [0.5, 0.25, 0] * origins)
    pixels = np.concatenate([pixels_in(camera, 50), [[0, 0], [6, 4], [0, 4], [6, 0], [0.25, 2]]])
    ray = camera.ray(pixels)
    x, y = (pixels / [6, 4] * 2 - 1).T
    assert ray.valid.all()
    assert np.allclose(ray.origin, np.stack([x, y, 0 * x], -1), atol=1e-15)
    assert np.allclose(ray.direction / ray.direction[:, 2:], np.stack([x / 2, y / 4, 1 + 0 * x], -1), atol=1e-15)
    assert not camera.ray([[-1e-12, 1], [6 + 1e-12, 1], [1, -1e-12], [1, 4 + 1e-12], [1e300, 1]]).valid.any()


@pytest.mark.parametrize("lost", [0.0, np.nan, np.inf])
def test_a_ray_takes_all_pixels_with_a_weight(lost):
    origins, directions = grid(5, 4)
    directions[1, 2] = lost
    if np.isnan(lost):
        origins[1, 2, 0], directions[1, 2] = lost, 1.0
    camera = mp.RayMap(origins, directions)
    assert camera == mp.RayMap(camera.origins, camera.directions)
    known = {(2.5, 1.5): False, (2.5, 0.5): True, (2.5, 0.75): False, (1.5, 0.7): True, (1.6, 0.5): True}
    known |= {(1.6, 0.7): False, (1.5, 1.5): True, (1.500001, 1.5): False, (1.2, 2.2): True, (2.2, 2.2): False}
    for pixel, valid in known.items():
        assert camera.ray(pixel).valid == valid, pixel
    assert np.isfinite(camera.ray(centers(camera)).origin).all()
    with jax.enable_x64(True):
        slopes = jax.jit(jax.jacobian(lambda o: mp.RayMap(o, jnp.asarray(directions)).ray([2.2, 2.2]).direction))
        assert np.isfinite(np.asarray(slopes(jnp.asarray(origins)))).all()


def test_tables_go_to_the_device_once_for_all_poses():
    camera = example("twisted", 8, 6)
    pixel = device.Array2f([1.0, 2.0], [3.0, 4.0])
    camera.ray(pixel)
    tables = camera.made.tables(device.Float)
    moved = camera.with_pose(POSE)
    moved.ray(pixel)
    moved.project([0.0, 0, 1])
    assert moved.made is camera.made and camera.made.tables(device.Float) is tables
    assert moved.origins is camera.origins
    again = pickle.loads(pickle.dumps(moved))
    assert again == moved and again.made is not moved.made and again.project([0.0, 0, 1]).valid.any()


@pytest.mark.parametrize("name", ["equidistant 270", "pinhole", "orthographic", "equirectangular", "folded"])
def test_any_camera_becomes_a_map(name):
    camera = registered(12, 8, POSE)[name]
    rays, same = camera.ray(centers(camera)), mp.RayMap.of(camera)
    taken = same.ray(centers(camera))
    assert np.array_equal(taken.valid, rays.valid) and np.array_equal(same.camera_from_world, POSE)
    assert np.allclose(taken.origin[rays.valid], rays.origin[rays.valid], atol=1e-15)
    assert np.allclose(taken.direction[rays.valid], rays.direction[rays.valid], atol=1e-15)


# Images


@pytest.mark.parametrize("kind", ["random", "rough", "twisted", "folded", "holes", "directions of many lengths"])
def test_images_are_those_of_brute_force(kind):
    """Every cell by elimination, in both precisions: none missed, none invented."""
    rows = stress.projection_rows(kind, 24)
    assert [row for row in rows if not row.good()] == []
    assert rows[0].worst > 0


def test_brute_force_can_tell(monkeypatch):
    from mpcam.cameras import ray_images

    found = ray_images.roots
    for wrong in (
        lambda *given: found(*given)._replace(x=found(*given).x + 1e-9),
        lambda *given: type(found(*given))(*(part[1:] for part in found(*given))),
    ):
        monkeypatch.setattr(ray_images, "roots", wrong)
        assert not stress.projection_rows("rough", 24)[0].good()


def test_the_map_of_a_pinhole_is_the_pinhole():
    pinhole = mp.Pinhole(40, 30, 30, 28, 19, 16, POSE)
    u, v = np.moveaxis(centers(pinhole), -1, 0)
    directions = np.stack([(u - 19) / 30, (v - 16) / 28, 1 + 0 * u], -1)
    camera = mp.RayMap(0 * directions, directions, POSE)
    points = np.random.default_rng(1).normal(size=(3000, 3)) * 3
    ours, theirs = camera.project(points), pinhole.project(points)
    seen = theirs.valid[:, 0] & pinhole.contains(theirs.pixel[:, 0])
    assert np.array_equal(ours.valid[:, 0], seen) and not ours.valid[:, 1:].any()
    assert np.abs(ours.pixel[seen, 0] - theirs.pixel[seen, 0]).max() < 1e-10
    assert np.allclose(ours.depth[seen, 0], theirs.depth[seen, 0], rtol=1e-13)


def test_the_map_of_parallel_rays_is_orthographic():
    origins, directions = grid(40, 30)
    camera, parallel = mp.RayMap(origins, 3 * directions), mp.Orthographic(40, 30, 20)
    points = np.random.default_rng(1).normal(size=(1000, 3)) * [0.8, 0.8, 3]
    points[:, 1] *= 15 / 20
    ours = camera.project(points)
    # Its pixels are not square: half of 40 and half of 30 pixels to a unit.
    theirs = parallel.project(points * [1, 15 / 20, 1])
    seen = theirs.valid[:, 0] & parallel.contains(theirs.pixel[:, 0])
    assert np.array_equal(ours.valid[:, 0], seen)
    assert np.abs(ours.pixel[seen, 0] - theirs.pixel[seen, 0]).max() < 1e-12
    assert np.allclose(ours.depth[seen, 0], points[seen, 2])


def test_inside_of_a_caustic_there_are_two_images_and_outside_none():
    """Columns whose rays lean by the square of their place: x + z x^2 has two values of x, up to x = -1 / (4 z)."""
    origins, directions = grid(64, 8)
    origins[..., 0] *= 2
    x = origins[..., :1]
    camera = mp.RayMap(origins, directions + [1, 0, 0] * x**2)
    # Between the columns at -0.53125 and -0.46875 the parabola is a chord, and these are its lowest places.
    low = -0.53125 + 0.53125**2
    assert low == -0.46875 + 0.46875**2
    for off, count in ((1e-2, 2), (1e-6, 2), (-1e-6, 0), (-1e-2, 0)):
        assert camera.project([low + off, 0.1, 1.0]).valid.sum() == count, off


def test_the_nearest_of_too_many_images_count():
    rng = np.random.default_rng(5)
    every = mp.RayMap(rng.normal(size=(6, 6, 3)), rng.normal(size=(6, 6, 3)), images=40)
    points = rng.normal(size=(30, 3))
    all_, few = every.project(points), dataclasses.replace(every, images=3).project(points)
    assert all_.valid.sum(-1).max() > 3 and few.pixel.shape == (30, 3, 2) and every.images_per_point == 40
    assert (np.diff(all_.depth, axis=-1)[all_.valid[:, 1:]] >= 0).all()
    assert np.array_equal(few.valid, all_.valid[:, :3]) and np.array_equal(few.pixel, all_.pixel[:, :3])


def test_where_no_image_is_isolated_there_is_none():
    assert all(row.good() for row in stress.lone_rows())
    assert stress.border_row(60).good()


@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_scale_does_not_matter(scale):
    camera = example("twisted", 16, 12)
    other = mp.RayMap(scale * camera.origins, camera.directions)
    points = np.random.default_rng(2).normal(size=(200, 3)) + [0, 0, 2]
    here, there = camera.project(points), other.project(scale * points)
    assert np.array_equal(here.valid, there.valid) and here.valid.any()
    assert np.abs(here.pixel - there.pixel).max() < 1e-11
    single = other.project(device.Array3f(*map(aligned, (scale * points).T)))
    assert np.abs(single.pixel[0].numpy().T - here.pixel[:, 0]).max() < 1e-4


# Derivatives


def test_gradients_in_everything_match_differences():
    """In the point, the pose, and single rays of the table."""
    camera = example("folded", 12, 9, POSE)
    point = camera.ray([3.2, 4.7]).origin + 1.7 * camera.ray([3.2, 4.7]).direction
    assert camera.project(point).valid.sum() == 2

    def image(point, pose, directions, library=jnp):
        found = mp.RayMap(camera.origins, directions, pose).project(point)
        return library.concatenate([found.pixel[:2].ravel(), found.depth[:2]])

    given = (point, camera.camera_from_world, camera.directions)
    with jax.enable_x64(True):
        exact = jax.jit(jax.jacobian(image, argnums=(0, 1, 2)))(*map(jnp.asarray, given))
    step = 1e-6
    for number, entries in ((0, [(0,), (1,), (2,)]), (1, [(0, 3), (2, 3)]), (2, [(4, 2, 0), (4, 3, 1), (5, 3, 2)])):
        for entry in entries:
            ends = []
            for sign in (1, -1):
                moved = [np.array(value) for value in given]
                moved[number][entry] += sign * step
                ends.append(image(*moved, np))
            found = np.asarray(exact[number])[(slice(None), *entry)]
            assert np.allclose(found, (ends[0] - ends[1]) / (2 * step), atol=1e-6), (number, entry)


def test_vmap_and_single_precision():
    camera = example("twisted", 6, 5)
    points = camera.ray(pixels_in(camera, 6)).direction * 2
    expected = camera.project(points)
    with jax.enable_x64(True):
        each = jax.jit(jax.vmap(jax.vmap(lambda point: camera.project(point[None]).pixel)))
        assert np.array_equal(np.asarray(each(jnp.asarray(points).reshape(2, 3, 3))).reshape(6, 4, 2), expected.pixel)
        several = jax.tree_util.tree_map(lambda leaf: jnp.stack([leaf, leaf]), camera)
        maps = jax.jit(jax.vmap(lambda one, point: one.project(point).pixel, (0, None)))
        assert np.array_equal(np.asarray(maps(several, jnp.asarray(points))), np.stack([expected.pixel] * 2))
    nowhere = [[np.nan, 0, 1], [0, 0, -1e30], [1e30, 0, 0]]
    slopes = jax.jit(jax.vmap(jax.grad(lambda point: camera.project(point).pixel.sum())))
    found = np.asarray(slopes(jnp.asarray(np.concatenate([points, nowhere]), jnp.float32)))
    assert np.isfinite(found).all() and (np.abs(found[:6]).max(-1) > 0).all() and not found[6:].any()


# Hits


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1), (33, 21)])
def test_hits_are_those_of_brute_force_at_every_size(size):
    camera = example("mirror with a hole", *size)
    mesh = soup(200, 12)
    assert wrong_pixels(camera, mesh, mp.rasterize(camera, mesh)) == 0


@pytest.mark.parametrize("method", ["invert", "raytrace"])
def test_rays_far_from_the_worlds_origin_lose_nothing(method):
    """A map in the world, at the coordinates of a survey: float32 holds these to half a unit only."""
    near = example("twisted", 60, 40)
    near = mp.RayMap(0.3 * near.origins - [0, 0, 3], near.directions)
    off = np.array([5e5, -4e6, 100.25])
    far = mp.RayMap(near.origins + off, near.directions)
    mesh = mp.builtin_mesh("sphere", triangles=5120)
    moved = mp.Mesh(mesh.vertices + off, mesh.faces)
    here, there = mp.rasterize(near, mesh, method=method), mp.rasterize(far, moved, method=method)
    assert here.mask.mean() > 0.1 and np.array_equal(here.triangle, there.triangle)
    assert np.abs(here.depth[here.mask] - there.depth[here.mask]).max() < 1e-4


def test_methods_that_need_one_image_refuse_it():
    camera, mesh = example("folded", 8, 6), mp.builtin_mesh("cube")
    with pytest.raises(mp.InputError, match="method='vertex' needs one image .* RayMap has up to 4"):
        mp.rasterize(camera, mesh, method="vertex")
    with pytest.raises(mp.InputError, match="'cubemap'"):
        mp.rasterize(camera, mesh, method="cubemap")


# Files


@pytest.mark.parametrize("name", mp.RayMap.examples(2, 2))
def test_an_exr_holds_what_float32_holds(name, tmp_path):
    exact = example(name, 12, 9, POSE)
    camera = mp.RayMap(exact.origins + 1e-9, exact.directions * 1.1, POSE, images=3)
    mp.write_ray_map(tmp_path / "a.exr", camera)
    back = mp.read_ray_map(tmp_path / "a.exr")
    for table, given in ((back.origins, camera.origins), (back.directions, camera.directions)):
        assert table.dtype == np.float64 and np.array_equal(table, given.astype(np.float32))
    assert np.array_equal(back.camera_from_world, POSE) and back.images == 3
    assert mp.read_camera(tmp_path / "a.exr") == back == load_camera(tmp_path / "a.exr")
    image, depth = np.zeros((9, 12, 3), np.float32), np.ones((9, 12), np.float32)
    mp.write_image(tmp_path / "b.exr", image, camera=camera, depth=depth, half=True)
    assert mp.read_camera(tmp_path / "b.exr") == back and mp.read_image(tmp_path / "b.exr").shape == (9, 12, 3)
    assert set(mp.read_channels(tmp_path / "b.exr")) == {*"RGB", "ray.distance", *CHANNELS}


CHANNELS = [f"{layer}.{axis}" for layer in ("origin", "direction") for axis in "XYZ"]


def test_any_cameras_rays_are_written(tmp_path):
    fisheye = mp.Radial.equisolid(20, 16, POSE)
    mp.write_ray_map(tmp_path / "a.exr", fisheye)
    back = mp.read_ray_map(tmp_path / "a.exr")
    rays, ours = fisheye.ray(centers(fisheye)), back.ray(centers(back))
    assert np.array_equal(rays.valid, ours.valid)
    assert np.abs(rays.direction - ours.direction)[rays.valid].max() < 1e-7


def test_another_program_writes_one_and_reads_ours(tmp_path):
    rng = np.random.default_rng(0)
    spec = oiio.ImageSpec(5, 4, 6, "float")
    spec.channelnames = tuple(CHANNELS)
    pixels = rng.normal(size=(4, 5, 6)).astype(np.float32)
    file = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert file is not None and file.open(str(tmp_path / "a.exr"), spec) and file.write_image(pixels)
    file.close()
    camera = mp.read_ray_map(tmp_path / "a.exr")
    assert np.array_equal(camera.origins, pixels[..., :3]) and np.array_equal(camera.directions, pixels[..., 3:])
    assert np.array_equal(camera.camera_from_world, np.eye(4)) and mp.read_camera(tmp_path / "a.exr") is None
    mp.write_ray_map(tmp_path / "b.exr", camera.with_pose(POSE))
    ours = oiio.ImageInput.open(str(tmp_path / "b.exr"))
    assert ours is not None and sorted(ours.spec().channelnames) == sorted(CHANNELS)
    matrix = np.reshape(ours.spec().getattribute("worldToCamera"), (4, 4))
    assert np.allclose(matrix, POSE.T, atol=1e-6)
    ours.close()


def test_json_holds_small_ones():
    small = example("mirror with a hole", 12, 9, POSE)
    assert camera_from_json(camera_to_json(small)) == small
    with pytest.raises(mp.InputError, match="100x100 rays is too large for JSON .*mpcam.write_ray_map"):
        camera_to_json(mp.RayMap.of(mp.Pinhole(100, 100)))


FLAT, AHEAD = grid(4, 3)
MISTAKES = [
    (lambda path: mp.RayMap(FLAT, AHEAD[:2]), r"origins have shape \(3, 4, 3\), directions \(2, 4, 3\)"),
    (lambda path: mp.RayMap(FLAT[..., 0], AHEAD), r"origins have shape \(3, 4\): give \(H, W, 3\)"),
    (lambda path: mp.RayMap(FLAT[:0], AHEAD[:0]), r"origins have shape \(0, 4, 3\)"),
    (lambda path: mp.RayMap("rays", AHEAD), "origins are not an array of numbers"),
    (lambda path: mp.RayMap(FLAT, AHEAD, images=1), r"RayMap\(images=1\): a whole number >= 2"),
    (lambda path: mp.RayMap(FLAT, AHEAD, 2 * np.eye(4)), "not a rigid transform"),
    (lambda path: mp.RayMap.of(3), "needs"),
    (
        lambda path: mp.write_ray_map(path / "a.png", mp.RayMap(FLAT, AHEAD)),
        r"\.png files keep no rays: write an \.exr",
    ),
    (lambda path: mp.write_ray_map(path / "a.exr", FLAT), "camera is a ndarray"),
    (lambda path: mp.write_ray_map(path / "a.exr", mp.RayMap(1e300 * FLAT, AHEAD)), "12 rays are too large"),
    (lambda path: mp.write_ray_map(path / "a.exr", mp.RayMap(FLAT, 1e-300 * AHEAD)), "12 rays are .* too short"),
    (lambda path: mp.read_ray_map(path / "none.exr"), "no such file"),
    (lambda path: read_back(path), "has no channel origin.X, but B, G, R"),
    (
        lambda path: image_with(path, {"origin.X": FLAT[..., 0]}),
        "channels and the rays of the camera both give origin.X",
    ),
]


def read_back(path):
    mp.write_image(path / "a.exr", np.zeros((3, 4, 3), np.float32))
    mp.read_ray_map(path / "a.exr")


def image_with(path, channels):
    mp.write_image(path / "a.exr", np.zeros((3, 4, 3), np.float32), camera=mp.RayMap(FLAT, AHEAD), channels=channels)


@pytest.mark.parametrize(("call", "message"), MISTAKES)
def test_mistakes_are_one_line(call, message, tmp_path):
    with pytest.raises(mp.InputError, match=message) as error:
        call(tmp_path)
    assert "\n" not in str(error.value)
