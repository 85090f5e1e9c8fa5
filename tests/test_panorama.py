"""Panoramas: the seam and the poles without cracks, against COLMAP's model and closed forms."""

from typing import Any

import drjit as dr
import jax
import jax.numpy as jnp
import numpy as np
import pycolmap
import pytest

import mpcam as mp
from mpcam.backend import aligned, types
from mpcam.cameras.change import resized
from mpcam.rendering.device_camera import unposed
from mpcam.stress import panorama as stress
from mpcam_kernels.frozen import frozen

PI = np.pi
TURNS = {"behind": (-PI, PI), "ahead": (0.0, 2 * PI), "askew": (-1.1, 2 * PI - 1.1)}


def centers(camera):
    v, u = np.indices((camera.height, camera.width)) + 0.5
    return np.stack([u.ravel(), v.ravel()], -1)


def lens(camera) -> Any:
    """The camera as kernels have it."""
    return unposed(camera)


def on_device(camera, points):
    """Pixel and validity of points (N, 3) in single precision, with the camera's numbers on the device."""
    t = types()
    image = lens(camera).local_project(t.Array3f(*map(aligned, points.T)))[0]
    return image.pixel.numpy().T, image.valid.numpy()


def test_images_are_those_of_colmap():
    camera = mp.Panorama.equirectangular(640, 320)
    points = np.random.default_rng(0).normal(size=(2000, 3)) * [[1, 1, 1]]
    theirs = pycolmap.Camera(model="EQUIRECTANGULAR", width=640, height=320, params=[640, 320])
    assert np.abs(camera.project(points).pixel[:, 0] - theirs.img_from_cam(points)).max() < 1e-10


@pytest.mark.parametrize("make", [mp.Panorama.equirectangular, mp.Panorama.cylindrical])
def test_longitude_runs_right_and_latitude_up(make):
    camera = make(8, 4)
    assert np.array_equal(camera.ray([4.0, 2.0]).direction, [0, 0, 1])
    assert np.allclose(camera.ray([6.0, 2.0]).direction, [1, 0, 0], atol=1e-15)
    assert np.allclose(camera.ray([2.0, 2.0]).direction, [-1, 0, 0], atol=1e-15)
    assert camera.ray([4.0, 1.0]).direction[1] < 0 < camera.ray([4.0, 3.0]).direction[1]
    image = camera.project([[0, 0, 3.0], [2.0, 0, 0], [0, -1.0, 1.0]])
    assert np.array_equal(image.depth[:, 0], [3, 2, np.sqrt(2)])
    assert np.allclose(image.pixel[:2, 0], [[4, 2], [6, 2]])
    assert image.pixel[2, 0, 1] < 2


@pytest.mark.parametrize("turn", TURNS)
def test_every_pixel_has_one_ray_and_every_direction_one_pixel(turn):
    camera = mp.Panorama.equirectangular(1000, 501, longitude=TURNS[turn])
    pixels = centers(camera)
    ray = camera.ray(pixels)
    assert ray.valid.all()
    back = camera.project(7 * ray.direction)
    assert back.valid.all() and np.abs(back.pixel[:, 0] - pixels).max() < 1e-9
    t = types()
    single = lens(camera).local_ray(t.Array2f(*map(aligned, pixels.T)))
    assert np.all(single.valid)
    pixel, valid = on_device(camera, single.direction.numpy().T)
    assert valid.all() and np.array_equal(np.floor(pixel), np.floor(pixels))
    directions = np.random.default_rng(1).normal(size=(100_000, 3))
    turned = 0.5 * sum(TURNS[turn]) + PI + np.linspace(-1e-6, 1e-6, 20_001)  # across the seam
    seam = np.stack([np.sin(turned), np.linspace(-3, 3, 20_001), np.cos(turned)], -1)
    poles = [[0, 1, 0], [0, -1, 0], [-0.0, 1, -0.0], [1e-300, 1, -1e-300], [1e-30, -1, 1e-20]]
    for pixel, valid in (
        (camera.project(np.concatenate([directions, seam, poles])).pixel[:, 0], True),
        on_device(camera, np.concatenate([directions, seam, poles])),
    ):
        assert np.all(valid) and (pixel >= 0).all() and (pixel < [1000, 501]).all()


def test_the_seam_and_the_poles_to_the_bit():
    camera = mp.Panorama.equirectangular(1000, 500)
    below = 500 * (1 - 2.0**-53)
    exact = (
        ((0.0, 0.0, -1.0), (0, 250)),
        ((-0.0, 0.0, -1.0), (0, 250)),
        ((-1e-300, 0.0, -1.0), (0, 250)),
        ((0.0, -2.0, 0.0), (500, 0)),
        ((0.0, 1.0, 0.0), (500, below)),
    )
    for point, pixel in exact:
        assert np.array_equal(camera.project(point).pixel[0], pixel), point
    left, right = camera.ray([0.0, 100.0]), camera.ray([1000.0, 100.0])
    assert left.valid and right.valid and np.abs(left.direction - right.direction).max() < 1e-15
    assert not camera.ray([[-1e-9, 100.0], [1000 + 1e-9, 100.0], [3.0, -1e-9], [3.0, 500 + 1e-9]]).valid.any()
    assert not camera.project([0.0, 0, 0]).valid


def test_narrower_ranges_go_on_as_far_as_a_turn_and_the_poles():
    camera = mp.Panorama.equirectangular(100, 50, longitude=(0.0, 1.0), latitude=(-0.25, 0.25))
    outside = camera.project([[-1.0, 0, 0], [0, -1.0, 1e-9], [np.sin(0.5 + PI), 0, np.cos(0.5 + PI)]])
    assert outside.valid.all() and not camera.contains(outside.pixel).any()
    back = camera.ray(outside.pixel[:, 0])
    assert back.valid.all() and np.allclose(back.direction[0], [-1, 0, 0])
    assert np.isclose(outside.pixel[0, 0, 0], 100 * -PI / 2) and np.isclose(abs(outside.pixel[2, 0, 0] - 50), 100 * PI)


def test_a_cylinder_keeps_vertical_lines_and_has_no_poles():
    camera = mp.Panorama.cylindrical(200, 100, heights=(-1.0, 3.0))
    height = np.linspace(-2, 2, 9)
    line = camera.project(np.stack([0 * height + 0.5, height, 0 * height + 2.0], -1)).pixel[:, 0]
    assert np.ptp(line[:, 0]) < 1e-12 and np.abs(np.diff(line[:, 1], 2)).max() < 1e-12
    assert np.allclose(camera.project([[0, -3.0, 1], [1.0, 1, 0]]).pixel[:, 0, 1], [0, 100])
    assert not camera.project([[0, 1.0, 0], [1e-16, -1.0, 0]]).valid.any()
    square = mp.Panorama.cylindrical(400, 100)
    right, below = (square.ray([200.0 + a, 50.0 + b]).direction for a, b in ((0.5, 0), (0, 0.5)))
    assert abs(np.arctan2(right[0], right[2]) - below[1] / below[2]) < 1e-12
    same = mp.Panorama.cylindrical(200, 100, fov=1.2), mp.Panorama.cylindrical(200, 100, latitude=(-0.6, 0.6))
    assert same[0] == same[1]
    assert np.allclose(mp.Panorama.cylindrical(9, 9, heights=(-1, 1)).latitude, [-PI / 4, PI / 4])


SPECIAL = [[0, 0, -1.0], [-0.0, 0, -2.0], [0, 1.0, 0], [0, -1.0, 0], [1e-20, -1, 1e-25], [0, 0, 0], [1e-30, 1e30, 1]]
"""On the seam, at the poles and near to them, at the center, and far apart in magnitude."""


@pytest.mark.parametrize("make", [mp.Panorama.equirectangular, mp.Panorama.cylindrical])
def test_gradients_are_finite_everywhere(make):
    camera = make(60, 30)

    def image(point):
        found = camera.project(point)
        return jnp.append(found.pixel[0], found.depth)

    for wide, way in ((True, jax.jacrev), (True, jax.jacfwd), (False, jax.jacrev)):
        with jax.enable_x64(wide):
            points = jnp.asarray(SPECIAL if wide else SPECIAL[:6])
            assert np.isfinite(np.asarray(jax.jit(jax.vmap(way(image)))(points))).all()
    rays = jax.jit(jax.vmap(jax.jacrev(lambda pixel: camera.ray(pixel).direction)))
    slopes = np.asarray(rays(jnp.asarray([[0.0, 0], [60, 30], [30, 0], [20, 10]])))
    assert np.isfinite(slopes).all() and np.abs(slopes).max() > 0


def test_gradients_in_the_ranges_hold_at_a_whole_turn_too():
    points = np.random.default_rng(3).normal(size=(20, 3))

    def total(ends, library):
        return library.sum(mp.Panorama(60, 30, "equirectangular", None, ends[:2], ends[2:]).project(points).pixel)

    start, step = np.array([-np.pi, np.pi, -0.7, 0.9]), 1e-6 * np.eye(4)
    with jax.enable_x64(True):
        found = np.asarray(jax.jit(jax.grad(lambda ends: total(ends, jnp)))(jnp.asarray(start)))
    # A range longer than a turn is refused, so to one side.
    inward = np.array([1, -1, 1, 1])
    for number in range(4):
        ends = [start + inward * k * step[number] for k in (0, 1, 2)]
        values = [total(e, np) for e in ends]
        slope = inward[number] * (-1.5 * values[0] + 2 * values[1] - 0.5 * values[2]) / 1e-6
        assert abs(found[number] - slope) < 1e-5 * max(1, abs(slope))


def test_frozen_kernels_take_the_ranges_as_data():
    t = types()

    @frozen
    def column(camera, point):
        return camera.local_project(point)[0].pixel

    point = t.Array3f([0.3, -2.0], [0.1, 0.2], [1.0, -0.5]) + dr.opaque(t.Float, 0)
    for longitude in ((-1.0, 1.0), (-2.0, 2.5), (0.0, 2 * PI)):
        camera = mp.Panorama.equirectangular(100, 50, longitude=longitude)
        found = column(lens(camera), point).numpy().T
        assert np.abs(found - camera.project(point.numpy().T).pixel[:, 0]).max() < 1e-3


def test_scene_files_have_degrees(tmp_path):
    keys = "size = [40, 20]\nlongitude = [-90, 270]\nlatitude = [-45, 60]\neye = [0, 0, 0]\ntarget = [1, 0, 0]"
    text = f'[[mesh]]\nbuiltin = "cube"\n[camera]\nmodel = "panorama"\nprojection = "cylindrical"\n{keys}\n'
    (tmp_path / "a.toml").write_text(text)
    camera = mp.load_scene(tmp_path / "a.toml").scene.camera
    expected = mp.Panorama.cylindrical(40, 20, longitude=(-PI / 2, 1.5 * PI), latitude=(-PI / 4, PI / 3))
    assert camera == expected.with_pose(mp.look_at((0, 0, 0), (1, 0, 0)))


def test_another_size_keeps_the_angles():
    camera = mp.Panorama.equirectangular(30, 20, longitude=(0, 1))
    larger = resized(camera, 60, 40)
    assert np.allclose(larger.ray([60.0, 10.0]).direction, camera.ray([30.0, 5.0]).direction)


@pytest.mark.parametrize("method", ["invert", "raytrace", "cubemap"])
def test_a_closed_mesh_has_no_holes(method):
    """A million pixels, with the seam and both poles in the middle of triangles and on edges."""
    cube = mp.builtin_mesh("cube")
    camera = mp.Panorama.equirectangular(1414, 707, mp.look_at((0.1, 0.2, 0.1), (1, 2, 0.3)))
    assert mp.rasterize(camera, cube, method=method).mask.all()
    if method != "cubemap":
        assert mp.rasterize(camera.with_pose(np.eye(4)), cube, method=method).mask.all()


def test_methods_that_cannot_serve_it_say_so():
    camera, mesh = mp.Panorama.equirectangular(8, 4), mp.builtin_mesh("cube")
    with pytest.raises(mp.InputError, match="method='vertex' needs one image for each point .* Panorama does not have"):
        mp.rasterize(camera, mesh, method="vertex")
    with pytest.raises(mp.InputError, match="method='hemicube' sees 180 degrees, the camera 360"):
        mp.rasterize(camera, mesh, method="hemicube")
    with pytest.raises(mp.InputError, match=r"bound\(\) needs boxes"):
        camera.bound(np.eye(3))


MISTAKES = [
    (lambda: mp.Panorama(8, 4, "mercator"), "projection='mercator'.*equirectangular, cylindrical"),
    (lambda: mp.Panorama.equirectangular(8, 0), "height=0"),
    (lambda: mp.Panorama.equirectangular(8, 4, longitude=(0, 6.3)), "at most 6.28319 apart"),
    (lambda: mp.Panorama.equirectangular(8, 4, longitude=(1, 1)), "low < high"),
    (lambda: mp.Panorama.equirectangular(8, 4, longitude=(0, np.nan)), "longitude=.*low < high"),
    (lambda: mp.Panorama.equirectangular(8, 4, longitude=(15, 16)), "within"),
    (lambda: mp.Panorama.equirectangular(8, 4, longitude=3), r"longitude=3\): give two numbers"),
    (lambda: mp.Panorama.equirectangular(8, 4, latitude=(-1.6, 1)), "latitude=.*within"),
    (lambda: mp.Panorama.cylindrical(8, 4, latitude=(-PI / 2, 1)), "latitude=.*inside of"),
    (lambda: mp.Panorama.cylindrical(8, 4, fov=4), "fov=4"),
    (lambda: mp.Panorama.cylindrical(8, 4, fov=1, heights=(0, 1)), "give one of"),
    (lambda: mp.Panorama.cylindrical(8, 4, heights="up"), "heights"),
]


@pytest.mark.parametrize(("call", "message"), MISTAKES)
def test_mistakes_are_one_line(call, message):
    with pytest.raises(mp.InputError, match=message) as error:
        call()
    assert "\n" not in str(error.value)


def test_stress_passes_and_can_fail(monkeypatch):
    for name in ("seam askew", "steep"):
        camera = stress.cameras()[name]
        rows = [*stress.image_rows(name, camera, 6), *stress.ray_rows(name, camera, 6)]
        assert all(row.good() for row in rows)
    whole = stress.cameras()["equirectangular"]
    assert all(row.good() for row in stress.pixel_rows("equirectangular", whole, 2000))
    exact = stress.definition
    monkeypatch.setattr(
        stress, "definition", lambda _: exact(mp.Panorama.equirectangular(512, 256, latitude=(-1.5, 1.5)))
    )
    assert any(not row.good() for row in stress.image_rows("equirectangular", whole, 6))
