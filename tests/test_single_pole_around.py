"""Single-pole occlusion cameras around objects, in files and in other sizes; and what is refused."""

import dataclasses

import numpy as np
import pytest
from single_poles import make, seen

import mpcam as mp
from mpcam.cameras.change import resized
from mpcam.cameras.serialize import camera_from_json, camera_to_json


@pytest.mark.parametrize("aside", [0.0, 0.5, 1.0, 2.5])
def test_around_a_ball_fills_the_picture(aside):
    """The image of the ball touches the border and no more; the part seen ends where rays are tangential."""
    camera = mp.SinglePoleOcclusion.around(320, 200, (3, 1, 2), 1.5, (-2, 0, 1), aside)
    distance = np.sqrt(27)
    assert camera.pole == (160.0, 100.0)
    middle = camera.project([3, 1, 2]).pixel[0] - camera.pole
    assert 0 <= middle[0] < camera.shift_far + 1e-9 and abs(middle[1]) < 1e-9
    toward = np.array([-5, -1, -1]) / distance
    side = np.cross(toward, [0, 0, 1]) / np.linalg.norm(np.cross(toward, [0, 0, 1]))
    angle = np.linspace(0, np.pi, 20001)[1:-1]
    normal = np.cos(angle)[:, None] * toward + np.sin(angle)[:, None] * side
    image = camera.project(np.array([3, 1, 2]) + 1.5 * normal)
    r = np.linalg.norm(image.pixel[:, 0] - camera.pole, axis=-1)
    assert abs(r.max() - 100) < 1e-5 and r.max() < 100 + 1e-9
    ray = camera.ray(image.pixel[:, 0])
    facing = (ray.direction * normal).sum(-1)
    last = angle[np.argmax(r)]
    expected = np.arctan2(1.5 * aside, distance) + np.arccos(1.5 / np.hypot(distance, 1.5 * aside))
    assert abs(last - expected) < 2e-4 and (facing[angle < expected - 1e-6] < 0).all()
    assert (facing[angle > expected + 1e-6] > 0).all()
    if aside == 1.0:
        assert abs(expected - np.pi / 2) < 1e-12
    assert np.allclose(camera.viewpoint_radii, 1.5 * aside)
    assert np.allclose([camera.near, camera.far], [distance - 1.5, distance + 1.5])
    assert camera.bound([[3, 1, 2]] * 3).valid and np.allclose(camera.eye, [-2, 0, 1])


# Mistakes


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"shift_near": -1.0}, "shift_near=-1.* a shift toward the pole .* two of them would share a pixel"),
        ({"shift_near": -3.0, "shift_far": -2.0}, "shift_near=-3"),
        ({"shift_far": -0.5, "shift_near": 0.0}, "shift_far=-0.5.* toward the pole"),
        ({"shift_near": 5.0, "shift_far": 4.0}, "shift_near=5, shift_far=4.* at least as far as near ones"),
        ({"near": 3.0}, "near=3, far=3.* give near < far"),
        ({"near": 4.0}, "near=4, far=3.* give near < far"),
        ({"near": 0.0}, r"near=0\.0\): a finite number above 0"),
        ({"near": -1.0}, "above 0"),
        ({"far": np.inf}, "far=inf"),
        ({"near": np.nan}, "near=nan"),
        ({"shift_far": np.inf}, "shift_far=inf"),
        ({"shift_near": "a"}, "shift_near='a'"),
        ({"pole": (1.0, 2.0, 3.0)}, "pole=.* give two finite numbers"),
        ({"pole": 3.0}, "pole=3.0.* give two finite numbers"),
        ({"pole": (np.nan, 0.0)}, "pole=.* give two finite numbers"),
        ({"pole": "ab"}, "pole='ab'.* give two finite numbers"),
        ({"camera_from_world": np.diag([2.0, 1, 1, 1])}, "rigid"),
    ],
)
def test_mistakes_are_refused(changes, message):
    with pytest.raises(mp.InputError, match=message):
        make(**changes)


def test_other_mistakes_are_refused():
    for size, lens in (((0, 64), (1, 1, 0, 0)), ((96, 64), (0, 1, 0, 0)), ((96, 64), (1, 1, np.nan, 0))):
        with pytest.raises(mp.InputError):
            mp.SinglePoleOcclusion(*size, *lens, near=1, far=2, shift_far=3)
    around = mp.SinglePoleOcclusion.around
    for arguments, message in (
        (((0, 0, 0), 2.0, (0, 1, 0)), "the eye is 1 from the center, within the sphere of radius 2"),
        (((0, 0, 0), 1.0, (0, 1, 0)), "within the sphere"),
        (((0, 0, 0), -1.0, (0, 3, 0)), "radius=-1.0.*above 0"),
        (((0, 0, 0), 0, (0, 3, 0)), "radius=0"),
        (((0, 0, 0), 1.0, (0, 3, 0), -0.1), "aside=-0.1.*from 0"),
        (((0, 0, np.nan), 1.0, (0, 3, 0)), "center"),
        (((0, 0, 0), 1.0, (0, 3)), "eye"),
    ):
        with pytest.raises(mp.InputError, match=message):
            around(64, 64, *arguments)
    with pytest.raises(mp.InputError, match="rays of a SinglePoleOcclusion bend.*method='raytrace'"):
        mp.truth.sensor(make())


# Files and sizes


def test_the_pole_is_the_center_unless_given():
    camera = mp.SinglePoleOcclusion(96, 64, 60, 52, 45, 33, near=1, far=3, shift_far=5)
    assert camera.pole == (45.0, 33.0) and camera.shift_near == 0
    assert camera_from_json(camera_to_json(camera)) == camera
    assert camera != dataclasses.replace(camera, pole=(45.0, 33.5))
    assert "bend" not in repr(camera) and camera.domain == mp.Domain(None, None, (0.0,))


def test_another_size_shows_the_same():
    camera = make()
    larger = resized(camera, 3 * 96, 2 * 64)  # twice as large, with more to both sides
    points = seen(camera, "within", 200)
    one, other = camera.project(points), larger.project(points)
    assert np.abs(other.pixel - (2 * one.pixel + [48, 0])).max() < 1e-9
    assert np.abs(other.depth - one.depth).max() < 1e-12


TABLE = """
[[mesh]]
builtin = "cube"
[camera]
model = "single_pole_occlusion"
size = [64, 48]
"""
OBJECT = "around = [0, 0, 0]\nradius = 0.9\nseen_from = [3, 0, 1]\n"
NUMBERS = "focal = [60, 52]\nnear = 1\nfar = 3\nshift_far = 5\n"


def load(tmp_path, keys):
    (tmp_path / "scene.toml").write_text(TABLE + keys)
    return mp.load_scene(tmp_path / "scene.toml").scene.camera


def test_scene_files_place_it_around_an_object(tmp_path):
    around = mp.SinglePoleOcclusion.around
    assert load(tmp_path, OBJECT) == around(64, 48, (0, 0, 0), 0.9, (3, 0, 1))
    turned = around(64, 48, (0, 0, 0), 0.9, (3, 0, 1), 2.0, up=(0, 1, 0))
    assert load(tmp_path, f"{OBJECT}aside = 2\ntop = [0, 1, 0]") == turned
    plain = load(tmp_path, NUMBERS)
    assert plain.pole == (32, 24) and plain.shift_near == 0 and plain.project([0, 0, 0]).valid


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (OBJECT + "focal = [60, 60]", "camera.focal.*around"),
        (OBJECT.replace("radius = 0.9\n", ""), "camera.radius.*give it too"),
        (OBJECT.replace("0.9", "9"), "within the sphere"),
        (OBJECT + "eye = [1, 2, 3]\ntarget = [0, 0, 0]", "camera.eye.*leave it out"),
        (NUMBERS.replace("far = 3\n", ""), "camera.far.*give it too"),
        (NUMBERS + "aside = 1", "camera.aside.*without around"),
        (NUMBERS.replace("= 5", "= -5"), "toward the pole"),
        (NUMBERS + "pole = [3]", "camera.pole"),
    ],
)
def test_mistakes_in_scene_files_name_the_key(tmp_path, keys, message):
    with pytest.raises(mp.InputError, match=message):
        load(tmp_path, keys)
