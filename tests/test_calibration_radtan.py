"""Radial and tangential distortion in calibration files."""

import json

import cv2
import numpy as np
import pytest
from calibration_examples import BROWN, PINHOLE, RATIONAL, SIMPLE, SIXTH
from test_calibration_files import OTHER, POSE, same

import mpcam as mp
from mpcam.io import calibration_colmap


@pytest.mark.parametrize(
    ("style", "camera", "names"),
    [("kalibr", SIXTH, "k3"), ("kalibr", RATIONAL, "k3, k4, k5, k6"), ("nerfstudio", RATIONAL, "k4, k5, k6")],
)
def test_coefficients_that_a_format_cannot_hold(tmp_path, style, camera, names):
    with pytest.raises(mp.InputError, match=f"has no place for {names} of BrownConrady.*: it holds k1 k2") as caught:
        mp.write_calibration(tmp_path / "file", camera, style)
    assert "\n" not in str(caught.value)
    assert not any(tmp_path.iterdir())


def test_colmap_gets_the_smallest_model():
    for camera, model in ((SIMPLE, "SIMPLE_RADIAL"), (BROWN, "OPENCV"), (SIXTH, "FULL_OPENCV")):
        assert f"\n1 {model} " in calibration_colmap.write({"1": camera})
    radial = mp.BrownConrady(640, 480, 500.1, 500.1, 320.3, 240.4, (0, 0.11))
    assert "1 RADIAL 640 480 500.1 320.3 240.4 0.0 0.11" in calibration_colmap.write({"1": radial})


@pytest.mark.parametrize("count", [4, 5, 8, 12, 14])
def test_all_of_opencvs_lengths_are_read(tmp_path, count):
    path = tmp_path / "camera.yml"
    numbers = np.array([-0.1, 0.02, 0.003, -0.002, 0.01, 0.04, 0.03, 0.02, 0, 0, 0, 0, 0, 0])[:count]
    matrix = np.array([[300.0, 0, 320], [0, 301, 240], [0, 0, 1]])
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in (("image_width", 640), ("image_height", 480), ("fisheye_model", 0), ("camera_matrix", matrix)):
        file.write(key, value)
    file.write("distortion_coefficients", numbers[None])
    file.release()
    camera = mp.read_calibration(path)["camera"]
    points, zero = np.random.default_rng(4).uniform(-1, 1, (50, 1, 3)) + [0, 0, 2], np.zeros(3)
    theirs, _ = cv2.projectPoints(points, zero, zero, matrix, numbers)
    assert np.abs(theirs[:, 0] + 0.5 - camera.project(points[:, 0]).pixel[:, 0]).max() < 1e-9


@pytest.mark.parametrize(
    ("model", "camera"), [("plumb_bob", SIXTH), ("rational_polynomial", RATIONAL), ("plumb_bob", PINHOLE)]
)
def test_ros_distortion_is_read(tmp_path, model, camera):
    path = tmp_path / "info.yaml"
    (k1, k2, k3, *rest), (p1, p2) = (camera.k, camera.p) if camera is not PINHOLE else ([0.0] * 3, [0.0] * 2)
    numbers = [k1, k2, p1, p2, k3, *(rest if model == "rational_polynomial" else [])]
    path.write_text(
        f"image_width: {camera.width}\nimage_height: {camera.height}\ndistortion_model: {model}\n"
        f"camera_matrix:\n  rows: 3\n  cols: 3\n"
        f"  data: [{camera.fx}, 0, {camera.cx - 0.5}, 0, {camera.fy}, {camera.cy - 0.5}, 0, 0, 1]\n"
        f"distortion_coefficients:\n  rows: 1\n  cols: {len(numbers)}\n  data: {numbers}\n"
    )
    assert same(mp.read_calibration(path)["camera"], camera)


def test_nerfstudio_holds_distorted_frames_beside_others(tmp_path):
    path = tmp_path / "transforms.json"
    mp.write_calibration(path, {"a.png": BROWN.with_pose(POSE), "b.png": PINHOLE.with_pose(OTHER)})
    assert json.loads(path.read_text())["camera_model"] == "OPENCV"
    cameras = mp.read_calibration(path)
    assert same(cameras["a.png"], BROWN.with_pose(POSE)) and same(cameras["b.png"], PINHOLE.with_pose(OTHER))
