"""Lenses of OCamCalib and WoodScape by their papers' and toolboxes' formulas, and nerfstudio's many keys."""

import json
import math
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import mpcam as mp
from mpcam.cameras.serialize import camera_from_json, camera_to_json

POINTS = np.random.default_rng(7).normal(size=(40, 3)) + [0, 0, 1]

OCAM = """#polynomial coefficients for the DIRECT mapping function (ocam_model.ss in MATLAB)

5 -2.692393e+02 0.000000e+00 1.388150e-03 -1.015000e-06 1.966000e-09

#polynomial coefficients for the inverse mapping function (ocam_model.invpol in MATLAB)

3 445.436119 318.234882 44.778758

#center: "row" and "column", starting from 0 (C convention)

496.783651 644.613923

#affine parameters "c", "d", "e"

1.001190 0.0 0.0

#image size: "height" and "width"

1024 1280
"""


def test_ocam(tmp_path):
    """Rows and columns by cam2world's formula: the ray of (row, column) is (x, y, polynomial(rho)), axis backward."""
    path = tmp_path / "calib_results.txt"
    path.write_text(OCAM)
    camera = mp.read_calibration(path)["camera"]
    assert (camera.width, camera.height) == (1280, 1024)
    rows, columns = np.meshgrid(np.linspace(100, 900, 9), np.linspace(200, 1100, 9))
    x, y = (rows - 496.783651) / 1.001190, columns - 644.613923
    rho = np.hypot(x, y)
    z = np.polyval([1.966e-9, -1.015e-6, 1.38815e-3, 0.0, -269.2393], rho)
    rays = np.stack([y, x, -z], -1) / np.linalg.norm([x, y, z], axis=0)[..., None]
    pixels = np.stack([columns, rows], -1) + 0.5
    found = camera.ray(pixels)
    assert found.valid.all() and np.abs(found.direction - rays).max() < 1e-12
    assert np.abs(camera.project(3 * rays).pixel[..., 0, :] - pixels).max() < 1e-9
    assert camera_from_json(camera_to_json(camera)) == camera


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("1.001190 0.0 0.0", "1.0 0.01 0.0", "the affine map has shear, d = 0.01 and e = 0, which moves the border"),
        ("-2.692393e+02", "2.692393e+02", "begins with 269.239 0: a number below 0, and 0"),
        ("5 -2.69", "6 -2.69", "has 5 coefficients, not 6 as its line says"),
        ("496.783651 644.613923", "496.783651", "the center has 1 numbers, 2 are needed"),
        ("1024 1280", "", "has no image size, such as width and height"),
        ("1024 1280", "1024 x", "the image size: a finite number is needed, got 'x'"),
    ],
)
def test_ocam_mistakes(tmp_path, old, new, message):
    path = tmp_path / "calib_results.txt"
    path.write_text(OCAM.replace(old, new, 1))
    with pytest.raises(mp.InputError, match=message):
        mp.read_calibration(path)


def test_a_little_shear_is_left_out_and_said(tmp_path):
    path = tmp_path / "calib_results.txt"
    path.write_text(OCAM.replace("1.001190 0.0 0.0", "1.001190 0.000073 -0.000510"))
    with pytest.warns(UserWarning, match="shear, d = 7.3e-05 and e = -0.00051, is left out: .* by 0.33 pixels"):
        mp.read_calibration(path)


def woodscape(**changes):
    lens = {"aspect_ratio": 1.02, "cx_offset": 3.9, "cy_offset": -3.1, "height": 966.0, "width": 1280.0}
    lens |= {"k1": 339.749, "k2": -31.988, "k3": 48.275, "k4": -7.201, "model": "radial_poly", "poly_order": 4}
    turn = Rotation.from_euler("ZXZ", [1.57, 2.1, -1.5])
    place = {"quaternion": turn.as_quat().tolist(), "translation": [3.7, 0.01, 0.66]}
    return {"extrinsic": place, "intrinsic": lens | changes, "name": "FV"}, turn


def test_woodscape(tmp_path):
    """By the data set's formula: rho = k1 theta + ... + k4 theta^4, principal point (size - 1) / 2 + offset."""
    data, turn = woodscape()
    (tmp_path / "FV.json").write_text(json.dumps(data))
    camera = mp.read_calibration(tmp_path / "FV.json")["FV"]
    local = turn.inv().apply(POINTS - [3.7, 0.01, 0.66])
    chi = np.hypot(local[:, 0], local[:, 1])
    theta = math.pi / 2 - np.arctan2(local[:, 2], chi)
    rho = 339.749 * theta - 31.988 * theta**2 + 48.275 * theta**3 - 7.201 * theta**4
    expected = (rho / chi)[:, None] * local[:, :2] * [1, 1.02] + [639.5 + 3.9, 482.5 - 3.1]
    found = camera.project(POINTS)
    assert found.valid.sum() > 30
    assert np.abs(found.pixel[:, 0] - expected - 0.5)[found.valid[:, 0]].max() < 1e-9
    assert camera_from_json(camera_to_json(camera)) == camera


def test_woodscape_mistakes(tmp_path):
    path = tmp_path / "a.json"
    for changes, message in (
        ({"model": "warp", "k1": 1}, "model 'warp' is not known here: radial_poly is"),
        ({"k1": 0}, "k1 is 0: pixels per radian"),
        ({"width": None}, "has no image size, such as width and height"),
        ({"poly_order": 3}, "k1, k2, k3, k4 are there and poly_order is 3: k1, k2, ... up to it are needed"),
        ({"poly_order": 1e300}, "poly_order is 1e[+]300"),
    ):
        path.write_text(json.dumps(woodscape(**changes)[0]))
        with pytest.raises(mp.InputError, match=message):
            mp.read_calibration(path)
    data, _ = woodscape()
    data["extrinsic"]["quaternion"] = [1, 1, 1, 1]
    path.write_text(json.dumps(data))
    with pytest.warns(UserWarning, match="extrinsic: quaternion: is not a rigid transform"):
        assert np.array_equal(mp.read_calibration(path)["FV"].camera_from_world, np.eye(4))


# nerfstudio, instant-ngp, Blender

POSE = np.eye(4)
POSE[:3, :3], POSE[:3, 3] = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix(), [1, 2, 3]


def transforms(path, pose=POSE, **top):
    frame = {"file_path": "a.png", "transform_matrix": np.asarray(pose).tolist()}
    path.write_text(json.dumps({"frames": [frame], **top}))
    return path


def test_two_angles(tmp_path):
    found = mp.read_calibration(transforms(tmp_path / "t.json", camera_angle_x=0.69, camera_angle_y=0.5, w=800, h=400))
    camera: Any = found["a.png"]
    assert camera.fx == pytest.approx(400 / math.tan(0.345), rel=1e-14)
    assert camera.fy == pytest.approx(200 / math.tan(0.25), rel=1e-14)
    camera = mp.read_calibration(transforms(tmp_path / "t.json", x_fov=90, w=800, h=400))["a.png"]
    assert camera.fx == camera.fy == pytest.approx(400, rel=1e-14)


def test_blender_says_no_size(tmp_path):
    path = transforms(tmp_path / "transforms_train.json", camera_angle_x=0.69)
    camera: Any = mp.read_calibration(path, size=(800, 800))["a.png"]
    assert camera.fx == pytest.approx(400 / math.tan(0.345), rel=1e-14) and camera.cx == 400
    with pytest.raises(mp.InputError, match=r"frames\[0\]: has no image size, such as w and h"):
        mp.read_calibration(path)


@pytest.mark.parametrize("flag", [1, True])
def test_is_fisheye(tmp_path, flag):
    path = transforms(tmp_path / "t.json", is_fisheye=flag, fl_x=200, w=64, h=48, k1=0.1, k2=-0.02)
    camera: Any = mp.read_calibration(path)["a.png"]
    assert camera.k == (0.1, -0.02, 0, 0)


def test_three_rows_and_frames_for_testing(tmp_path):
    """A camera at the pose's last column that looks along minus its third."""
    path = transforms(
        tmp_path / "t.json",
        POSE[:3],
        fl_x=40,
        w=64,
        h=48,
        applied_transform=[[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0]],
        test_frames=[{"file_path": "b.png", "transform_matrix": POSE.tolist()}],
    )
    cameras = mp.read_calibration(path)
    assert list(cameras) == ["a.png", "b.png"] and cameras["a.png"] == cameras["b.png"]
    ray = cameras["a.png"].ray([[32, 24], [32, 0]])
    assert np.allclose(ray.origin, [1, 2, 3]) and np.allclose(ray.direction[0], -POSE[:3, 2])
    assert (ray.direction[1] - ray.direction[0]) @ POSE[:3, 1] > 0


def test_a_pose_that_is_none(tmp_path):
    with pytest.warns(UserWarning, match=r"frames\[0\]: transform_matrix: is not a rigid .*the lens is read"):
        camera = mp.read_calibration(transforms(tmp_path / "t.json", 2 * POSE[:3], fl_x=40, w=64, h=48))["a.png"]
    assert camera == mp.Pinhole(64, 48, 40, 40, 32, 24)


def test_list_of_distortion(tmp_path):
    path = transforms(tmp_path / "t.json", fl_x=40, w=64, h=48, distortion_params=[0.1, 0.02, 0.003, 0, 0.01, 0.02])
    assert mp.read_calibration(path)["a.png"] == mp.BrownConrady(
        64, 48, 40, 40, 32, 24, (0.1, 0.02, 0.003), (0.01, 0.02), mp.read_calibration(path)["a.png"].camera_from_world
    )


# The models by numbers of their own


def test_models_by_other_means():
    """Scaramuzza's r by SciPy's bracketed root; one that folds is valid up to the fold alone."""
    lens = mp.Scaramuzza(100, 100, 30, 30, 50, 50, (-0.38, 0.06, -0.14))
    for theta in (0.3, 1.2, 1.9):
        r = brentq(lambda r, t=theta: math.atan2(r, 1 - 0.38 * r**2 + 0.06 * r**3 - 0.14 * r**4) - t, 0, 5)
        found = lens.project([math.sin(theta), 0, math.cos(theta)])
        assert found.valid.all() and abs(found.pixel[0, 0] - 50 - 30 * r) < 1e-9
    folds = mp.AnglePolynomial(100, 100, 30, 30, 50, 50, (-0.25,))  # r' = 1 - theta / 2
    assert folds.domain.max_angle == pytest.approx(2.0, abs=1e-14)
    assert list(folds.project([[math.sin(t), 0, math.cos(t)] for t in (1.99, 2.01)]).valid[:, 0]) == [True, False]
    for camera in (lens, folds, mp.FieldOfView(100, 100, 30, 30, 50, 50, 0.93)):
        assert eval(f"mp.{camera!r}", {"mp": mp}) == camera
