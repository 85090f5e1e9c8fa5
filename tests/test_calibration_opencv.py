"""Files that OpenCV's own writer makes, and those that scripts and ROS make around it, projected as OpenCV does."""

import json
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

import mpcam as mp

MATRIX = np.array([[300.0, 0, 320], [0, 301, 240], [0, 0, 1]])
FISHEYE, PLAIN = np.array([0.1, -0.02, 0.003, -0.001]), np.array([-0.1, 0.02, 0.003, -0.002, 0.01])
RATIONAL = np.array([9.1, 5.2, 1e-4, -2e-4, 0.19, 9.4, 8.1, 1.1])
POINTS = np.random.default_rng(5).uniform(-1, 1, (50, 1, 3)) + [0, 0, 2]
ZERO = np.zeros(3)


def off(camera, coefficients, matrix=MATRIX):
    """Largest distance in pixels from OpenCV's images of points; four coefficients are a fisheye's."""
    if len(coefficients) == 4:
        theirs, _ = cv2.fisheye.projectPoints(POINTS, ZERO, ZERO, matrix, coefficients)
    else:
        theirs, _ = cv2.projectPoints(POINTS, ZERO, ZERO, matrix, coefficients)
    return np.abs(theirs.reshape(-1, 2) + 0.5 - camera.project(POINTS[:, 0]).pixel[:, 0]).max()


def write(path, **values):
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in values.items():
        file.write(key, value)
    file.release()
    return path


@pytest.mark.parametrize("suffix", ["yml", "yaml", "xml", "json", "yml.gz"])
@pytest.mark.parametrize(
    ("coefficients", "flag"),
    [(FISHEYE, 1), (FISHEYE[:, None], 1), (PLAIN, 0), (PLAIN[None], 0), (RATIONAL[:, None], 0)],
    ids=["fisheye", "fisheye column", "plain", "plain row", "rational"],
)
def test_what_opencv_writes(tmp_path, suffix, coefficients, flag):
    path = write(
        tmp_path / f"a.{suffix}",
        calibration_time="Sun Nov 22 00:04:44 2026",
        image_width=640,
        image_height=480,
        fisheye_model=flag,
        camera_matrix=MATRIX,
        distortion_coefficients=coefficients,
        avg_reprojection_error=0.3,
        image_points=np.zeros((3, 4, 2), np.float32),
    )
    assert off(mp.read_calibration(path)["camera"], coefficients.ravel()) < 1e-9


@pytest.mark.parametrize(
    ("matrix", "coefficients"),
    [
        ("K", "D"),
        ("k", "d"),
        ("Camera_Matrix", "Distortion_Coefficients"),
        ("cameraMatrix", "distCoeffs"),
        ("camera_matrix", "dist_coeff"),
        ("mtx", "dist"),
        ("intrinsic_matrix", "distortion"),
        ("CameraMatrix", "DistCoeffs"),
    ],
)
def test_names_of_keys(tmp_path, matrix, coefficients):
    path = write(tmp_path / "a.yml", **{matrix: MATRIX, coefficients: PLAIN})
    camera = mp.read_calibration(path, size=(640, 480))["camera"]
    assert off(camera, PLAIN) < 1e-9 and (camera.width, camera.height) == (640, 480)
    with pytest.raises(mp.InputError, match=rf"no image size.* among its keys {matrix}, {coefficients}: give size="):
        mp.read_calibration(path)


@pytest.mark.parametrize("keys", [{"imageSize": [640, 480]}, {"width": 640, "height": 480}, {"resolution": [640, 480]}])
def test_names_of_the_size(tmp_path, keys):
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"K": MATRIX.tolist(), "D": PLAIN.tolist(), **keys}))
    camera = mp.read_calibration(path)["camera"]
    assert (camera.width, camera.height) == (640, 480) and off(camera, PLAIN) < 1e-9
    assert mp.read_calibration(path, size=(640, 480))["camera"] == camera
    with pytest.raises(mp.InputError, match="say 640 x 480: leave size out"):
        mp.read_calibration(path, size=(320, 240))


def test_arrays_of_numpy(tmp_path):
    np.savez(tmp_path / "a.npz", mtx=MATRIX, dist=PLAIN[None], rvecs=np.zeros((3, 3, 1)))
    assert off(mp.read_calibration(tmp_path / "a.npz", size=(640, 480))["camera"], PLAIN) < 1e-9
    np.savez(tmp_path / "b.npz", mtx=np.array([MATRIX], object))
    with pytest.raises(mp.InputError, match="not arrays of numbers .*allow_pickle"):
        mp.read_calibration(tmp_path / "b.npz")


def test_several_cameras_in_one_file(tmp_path):
    one = {"K": MATRIX.tolist(), "D": FISHEYE.tolist(), "width": 640, "height": 480, "distortion_model": "fisheye"}
    (tmp_path / "a.json").write_text(json.dumps({"left": one, "right": one | {"width": 660}, "notes": {"by": "me"}}))
    cameras = mp.read_calibration(tmp_path / "a.json")
    assert list(cameras) == ["left", "right"] and cameras["right"].width == 660
    assert off(cameras["left"], FISHEYE) < 1e-9
    named = {"fx": 300, "fy": 301, "cx": 320, "cy": 240, "width": 640, "height": 480}
    bent = dict(zip(("k1", "k2", "p1", "p2", "k3"), PLAIN.tolist(), strict=True))
    (tmp_path / "b.yaml").write_text(yaml.safe_dump(named | bent))
    assert off(mp.read_calibration(tmp_path / "b.yaml")["camera"], PLAIN) < 1e-9
    (tmp_path / "d.yaml").write_text(yaml.safe_dump(named | {"is_fisheye": 1, "k1": 0.1, "k4": -0.001}))
    assert off(mp.read_calibration(tmp_path / "d.yaml")["camera"], np.array([0.1, 0, 0, -0.001])) < 1e-9
    columns = {"intrinsic_matrix": [300, 0, 0, 0, 301, 0, 320, 240, 1], "width": 640, "height": 480}
    (tmp_path / "c.json").write_text(json.dumps(columns))
    assert off(mp.read_calibration(tmp_path / "c.json")["camera"], np.zeros(5)) < 1e-9


def test_stereo_pair(tmp_path):
    turn, _ = cv2.Rodrigues(np.array([0.1, -0.2, 0.05]))
    shift = np.array([-0.12, 0.01, 0.02])
    other = MATRIX + [[5, 0, 3], [0, 5, -4], [0, 0, 0]]
    given = {"M1": MATRIX, "D1": PLAIN, "M2": other, "D2": RATIONAL, "R": turn, "T": shift[:, None]}
    cameras = mp.read_calibration(write(tmp_path / "a.yml", **given), size=(640, 480))
    assert off(cameras["1"], PLAIN) < 1e-9
    theirs, _ = cv2.projectPoints(POINTS, turn, shift, other, RATIONAL)
    assert np.abs(theirs[:, 0] + 0.5 - cameras["2"].project(POINTS[:, 0]).pixel[:, 0]).max() < 1e-9
    alone = write(tmp_path / "b.yml", **{key: given[key] for key in ("M1", "D1", "M2", "D2")})
    with pytest.warns(UserWarning, match="R and T: of the second camera are missing: the lens is read"):
        assert off(mp.read_calibration(alone, size=(640, 480))["2"], RATIONAL, other) < 1e-9


ROS = {
    "header": {"seq": 1, "stamp": {"secs": 1, "nsecs": 2}, "frame_id": "camera_optical"},
    "height": 480,
    "width": 640,
    "R": [1.0, 0, 0, 0, 1, 0, 0, 0, 1],
    "P": [300.0, 0, 320, 0, 0, 301, 240, 0, 0, 0, 1, 0],
    "binning_x": 0,
    "binning_y": 0,
    "roi": {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False},
}


@pytest.mark.parametrize(("matrix", "list_"), [("K", "D"), ("k", "d")])
@pytest.mark.parametrize(
    ("model", "given", "coefficients"),
    [
        ("plumb_bob", PLAIN.tolist(), PLAIN),
        ("plumb_bob", [], np.zeros(5)),
        ("rational_polynomial", RATIONAL.tolist(), RATIONAL),
        ("equidistant", FISHEYE.tolist(), FISHEYE),
        ("equidistant", [*FISHEYE.tolist(), 0.0], FISHEYE),
        ("fisheye", FISHEYE.tolist(), FISHEYE),
    ],
)
def test_messages_of_ros(tmp_path, matrix, list_, model, given, coefficients):
    path = tmp_path / "info.yaml"
    message = yaml.safe_dump(ROS | {matrix: MATRIX.ravel().tolist(), list_: given, "distortion_model": model})
    path.write_text(f"{message}---\n{message}---\n")  # as echo of topics prints them
    assert off(mp.read_calibration(path)["camera"], coefficients) < 1e-9


def test_what_of_a_message_is_not_used_is_said(tmp_path):
    path = tmp_path / "info.yaml"
    base = ROS | {"K": MATRIX.ravel().tolist(), "D": PLAIN.tolist(), "distortion_model": "plumb_bob"}
    turned = cv2.Rodrigues(np.array([0.0, 0.01, 0.0]))[0].ravel().tolist()
    for change, said in (
        ({"binning_x": 2}, "binning_x is not applied: the camera is that of the whole image"),
        ({"roi": {"x_offset": 10, "y_offset": 0, "height": 0, "width": 0}}, "roi is not applied"),
        ({"R": turned}, "R and the projection matrix belong to rectified images"),
    ):
        path.write_text(yaml.safe_dump(base | change))
        with pytest.warns(UserWarning, match=said):
            assert off(mp.read_calibration(path)["camera"], PLAIN) < 1e-9


def test_tags_that_nobody_asks_for(tmp_path):
    path = tmp_path / "a.yaml"
    text = "K: [300, 0, 320, 0, 301, 240, 0, 0, 1]\nD: !!python/tuple [0.1, 0, 0, 0, 0]\nsize: [640, 480]\n"
    path.write_text(text + "note: !!python/object/apply:numpy.core.multiarray.scalar [1]\nflags: !mine {a: 1}\n")
    camera: Any = mp.read_calibration(path)["camera"]
    assert camera.k[0] == 0.1
    path.write_text(text.replace("[300, 0, 320, 0, 301, 240, 0, 0, 1]", "!!python/object/apply:numpy.array [1]"))
    with pytest.raises(
        mp.InputError, match=r"K: .*tagged !!python/object/apply:numpy.array, .* write numbers and lists"
    ):
        mp.read_calibration(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("K: [1, 2]\nwidth: 4\nheight: 4\n", "K: 2 numbers are there, 9 are needed"),
        ("K: [[300, 1, 3], [0, 300, 2], [0, 0, 1]]\nwidth: 4\nheight: 4\n", "K has skew or is no camera matrix"),
        ("K: [3, 0, 1, 0, 3, 1, 0, 0, 1]\nsize: [0, 4]\n", "the image size is 0 x 4: whole numbers"),
        (
            "K: [3, 0, 1, 0, 3, 1, 0, 0, 1]\nsize: [4, 4]\nD: [0.1, 0.2]\n",
            "2 distortion coefficients are there, 0, 4, 5",
        ),
        ("K: [3, 0, 1, 0, 3, 1, 0, 0, 1]\nsize: [4, 4]\nD: [.1, 0, 0, 0]\nmodel: warp\n", "model 'warp' is not known"),
        (
            "K: [3, 0, 1, 0, 3, 1, 0, 0, 1]\nsize: [4, 4]\nD: [.1, 0, 0, 0, 3]\ndistortion_model: equidistant\n",
            "what follows the 4 distortion coefficients of a fisheye",
        ),
        ("<?xml version='1.0'?>\n<opencv_storage>\n<K>\n</opencv_storage>", ":4: not XML: mismatched tag"),
        ('{"K": [1,', "not JSON: Expecting value"),
    ],
)
def test_mistakes(tmp_path, text, message):
    path = tmp_path / ("a.xml" if text[0] == "<" else "a.json" if text[0] == "{" else "a.yaml")
    path.write_text(text)
    with pytest.raises(mp.InputError, match=message) as caught:
        mp.read_calibration(path)
    assert str(caught.value).startswith(str(path)) and "\n" not in str(caught.value)
