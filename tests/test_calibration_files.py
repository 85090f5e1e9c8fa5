"""Calibration files: each format against its own program, round trips, pixel centers, and axes."""

import json
from typing import Any

import cv2
import numpy as np
import pycolmap
import pytest
import yaml
from calibration_examples import BROWN, CAMCHAIN, DOUBLE, FISHEYE, MEI, PINHOLE, RATIONAL, SIMPLE, SIXTH, UNIFIED

import mpcam as mp
from mpcam.cameras.serialize import camera_to_dict
from mpcam.io import calibration_colmap, calibration_kalibr, calibration_nerfstudio, calibration_opencv
from mpcam.io.cameras import load_camera

POSE = mp.look_at((0.3, -0.2, 0.1), (0.5, 1.0, 0.7))
OTHER = mp.look_at((1.3, 0.2, 0.1), (0.5, 1.0, 0.7))
HELD = {
    "colmap": [PINHOLE, FISHEYE, UNIFIED, MEI, BROWN, SIXTH, RATIONAL, SIMPLE],
    "opencv": [PINHOLE, FISHEYE, MEI, BROWN, SIXTH, RATIONAL],
    "kalibr": [PINHOLE, FISHEYE, DOUBLE, UNIFIED, MEI, BROWN],
    "nerfstudio": [PINHOLE, FISHEYE, BROWN, SIXTH],
}
SUFFIX = {"colmap": "txt", "opencv": "yml", "kalibr": "yaml", "nerfstudio": "json"}
NAMES = {"colmap": ["1", "7"], "opencv": ["left"], "kalibr": ["cam0", "cam1"], "nerfstudio": ["a/1.png", "a/2.png"]}
POSED = ("kalibr", "nerfstudio")


def same(camera, other):
    """Whether two cameras are equal up to rounding."""
    a, b = (camera_to_dict(c) for c in (camera, other))
    keys = [key for key in a if key != "model"]
    return a["model"] == b["model"] and all(np.allclose(a[k], b[k], rtol=1e-14, atol=1e-13) for k in keys)


@pytest.mark.parametrize(("style", "camera"), [(s, c) for s, cameras in HELD.items() for c in cameras])
def test_round_trip(tmp_path, style, camera):
    path = tmp_path / f"file.{SUFFIX[style]}"
    poses = {"kalibr": [np.eye(4), OTHER], "nerfstudio": [POSE, OTHER]}.get(style, [np.eye(4)] * 2)
    cameras = {name: camera.with_pose(pose) for name, pose in zip(NAMES[style], poses, strict=False)}
    mp.write_calibration(path, cameras, style)
    for again in (mp.read_calibration(path), mp.read_calibration(path, style)):
        assert list(again) == list(cameras)
        assert all(same(again[name], cameras[name]) for name in cameras)
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("style", HELD)
def test_a_camera_without_a_name(tmp_path, style):
    path = tmp_path / f"file.{SUFFIX[style]}"
    mp.write_calibration(path, FISHEYE, style)
    (again,) = mp.read_calibration(path).values()
    assert same(again, FISHEYE)
    if style != "nerfstudio":
        assert same(load_camera(path), FISHEYE)


@pytest.mark.parametrize(
    ("style", "camera"),
    [("colmap", DOUBLE), ("opencv", DOUBLE), ("opencv", UNIFIED), ("nerfstudio", DOUBLE), ("nerfstudio", UNIFIED)]
    + [(style, mp.Radial.equidistant(64, 64)) for style in HELD],
)
def test_models_that_a_format_cannot_hold(tmp_path, style, camera):
    path = tmp_path / "file"
    with pytest.raises(mp.InputError, match="has no model for a|with beta = 1") as caught:
        mp.write_calibration(path, camera, style)
    assert "\n" not in str(caught.value)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("camera", [FISHEYE, PINHOLE, UNIFIED, BROWN, SIXTH, RATIONAL, SIMPLE])
def test_colmap_reads_what_is_written_and_the_other_way(tmp_path, camera):
    mp.write_calibration(tmp_path / "cameras.txt", {"3": camera})
    line = (tmp_path / "cameras.txt").read_text().splitlines()[-1].split()
    theirs = pycolmap.Camera(
        model=line[1], width=int(line[2]), height=int(line[3]), params=[float(x) for x in line[4:]]
    )
    points = np.random.default_rng(1).uniform(-1, 1, (50, 3)) + [0, 0, 2]
    assert np.abs(theirs.img_from_cam(points) - camera.project(points).pixel[:, 0]).max() < 1e-9


@pytest.mark.parametrize(
    ("model", "parameters"),
    [
        ("SIMPLE_PINHOLE", [300, 321, 239]),
        ("SIMPLE_RADIAL", [300, 321, 239, 0]),
        ("OPENCV", [300, 301, 321, 239, 0, 0, 0, 0]),
        ("SIMPLE_RADIAL", [300, 321, 239, -0.1]),
        ("RADIAL", [300, 321, 239, -0.1, 0.02]),
        ("OPENCV", [300, 301, 321, 239, -0.1, 0.02, 0.003, -0.002]),
        ("FULL_OPENCV", [300, 301, 321, 239, -0.1, 0.02, 0.003, -0.002, 0.01, 0.04, 0.03, 0.02]),
        ("SIMPLE_FISHEYE", [300, 321, 239]),
        ("FISHEYE", [300, 301, 321, 239]),
        ("SIMPLE_RADIAL_FISHEYE", [300, 321, 239, 0.02]),
        ("RADIAL_FISHEYE", [300, 321, 239, 0.02, -0.003]),
        ("THIN_PRISM_FISHEYE", [300, 301, 321, 239, 0.02, -0.003, 0, 0, 0.001, -0.0002, 0, 0]),
        ("RAD_TAN_THIN_PRISM_FISHEYE", [300, 301, 321, 239, 0.02, -0.003, 0.001, -2e-4, 0, 0, 0, 0, 0, 0, 0, 0]),
        ("OPENCV_FISHEYE", [300, 301, 321, 239, 0.02, -0.003, 0.001, -0.0002]),
        ("EUCM", [300, 301, 321, 239, 0.55, 1.2]),
    ],
)
def test_colmap_models(tmp_path, model, parameters):
    path = tmp_path / "cameras.txt"
    path.write_text(f"# comment\n\n5 {model} 640 480 {' '.join(map(str, parameters))}\n")
    ours = mp.read_calibration(path)["5"]
    theirs = pycolmap.Camera(model=model, width=640, height=480, params=parameters)
    points = np.random.default_rng(2).uniform(-1, 1, (50, 3)) + [0, 0, 2]
    assert np.abs(theirs.img_from_cam(points) - ours.project(points).pixel[:, 0]).max() < 1e-9


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE, MEI, BROWN, RATIONAL])
def test_opencv_reads_what_is_written(tmp_path, camera):
    path = tmp_path / "camera.yml"
    mp.write_calibration(path, camera, "opencv")
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    matrix, distortion = file.getNode("camera_matrix").mat(), file.getNode("distortion_coefficients").mat()
    assert (file.getNode("image_width").real(), file.getNode("image_height").real()) == (camera.width, camera.height)
    points, zero = np.random.default_rng(3).uniform(-1, 1, (50, 1, 3)) + [0, 0, 2], np.zeros(3)
    if camera is FISHEYE:
        assert file.getNode("fisheye_model").real() == 1
        theirs, _ = cv2.fisheye.projectPoints(points, zero, zero, matrix, distortion)
    elif camera is MEI:
        xi = file.getNode("xi").real()
        theirs, _ = cv2.omnidir.projectPoints(points, zero, zero, matrix, xi, distortion)
    else:
        theirs, _ = cv2.projectPoints(points, zero, zero, matrix, distortion)
    ours = camera.project(points[:, 0]).pixel[:, 0]
    assert np.abs(theirs.reshape(-1, 2) + 0.5 - ours).max() < 1e-9


@pytest.mark.parametrize("camera", [PINHOLE, FISHEYE, MEI])
def test_what_opencv_writes_is_read(tmp_path, camera):
    path = tmp_path / "camera.yml"
    scale = 1 + camera.xi if camera is MEI else 1.0
    matrix = np.array([[scale * camera.fx, 0, camera.cx - 0.5], [0, scale * camera.fy, camera.cy - 0.5], [0, 0, 1]])
    file = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    file.write("calibration_time", "Sun Nov 22 00:04:44 2026")
    file.write("image_width", camera.width)
    file.write("image_height", camera.height)
    file.writeComment("flags: +fix_skew")
    file.write("camera_matrix", matrix)
    file.write("distortion_coefficients", np.array(getattr(camera, "k", [0.0] * 4))[:, None])
    if camera is FISHEYE:
        file.write("fisheye_model", 1)
    elif camera is MEI:
        file.write("xi", np.array([[camera.xi]]))
    file.release()
    assert same(mp.read_calibration(path)["camera"], camera)
    older = path.read_text().replace("%YAML 1.2", "%YAML:1.0")
    path.write_text(older)
    assert older.startswith("%YAML:1.0")
    assert same(mp.read_calibration(path)["camera"], camera)


def test_ros_camera_info_is_read(tmp_path):
    path = tmp_path / "info.yaml"
    path.write_text(
        "image_width: 512\nimage_height: 400\ncamera_name: front\ndistortion_model: equidistant\n"
        "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [190.97, 0, 254.43, 0, 190.93, 196.39, 0, 0, 1]\n"
        "distortion_coefficients:\n  rows: 1\n  cols: 4\n  data: [3.4e-3, 7e-4, -2e-3, 2e-4]\n"
    )
    assert same(mp.read_calibration(path)["front"], FISHEYE)


def test_half_a_pixel():
    """The center of the first pixel is (0, 0) for OpenCV and Kalibr, (0.5, 0.5) here, for COLMAP and nerfstudio.

    A camera whose axis goes through the middle of a 4 x 2 image has its principal point at (1.5, 0.5) there.
    """
    middle = mp.Pinhole(4, 2, 3, 3, 2.0, 1.0)
    assert "data: [ 3.0, 0.0, 1.5, 0.0, 3.0, 0.5, 0.0, 0.0, 1.0 ]" in calibration_opencv.write({"a": middle})
    assert "intrinsics: [3.0, 3.0, 1.5, 0.5]" in calibration_kalibr.write({"cam0": middle})
    assert "1 PINHOLE 4 2 3.0 3.0 2.0 1.0" in calibration_colmap.write({"1": middle})
    written = json.loads(calibration_nerfstudio.write({"a.png": middle}))
    assert (written["cx"], written["cy"]) == (2.0, 1.0)


def test_kalibr_chain(tmp_path):
    path = tmp_path / "camchain.yaml"
    path.write_text(CAMCHAIN)
    cameras = mp.read_calibration(path)
    for (name, camera), expected in zip(cameras.items(), [FISHEYE, DOUBLE, MEI, UNIFIED, PINHOLE], strict=True):
        assert same(camera.with_pose(np.eye(4)), expected), name
    assert np.array_equal(cameras["cam0"].camera_from_world, np.eye(4))
    # A point in front of cam0 is 0.1 to the left in cam1, whose z is cam2's x.
    point = np.array([0.0, 0.0, 2.0])
    assert np.allclose(cameras["cam1"].local(point), [-0.1, 0, 2.02])
    assert np.allclose(cameras["cam2"].local(point), [2.02, 0, 0.6])
    assert np.allclose(cameras["cam4"].local(point), [2.02, 0, 0.6])


def test_what_is_written_for_kalibr_is_yaml(tmp_path):
    path = tmp_path / "chain.yaml"
    tiny = mp.KannalaBrandt(512, 400, 190.97, 190.93, 254.93, 196.89, (1e-5, 1e-300, 0, 2))
    mp.write_calibration(path, {"cam0": tiny, "cam1": DOUBLE.with_pose(POSE)}, "kalibr")
    theirs = yaml.safe_load(path.read_text())
    assert theirs["cam0"]["distortion_coeffs"] == [1e-5, 1e-300, 0, 2]
    assert np.allclose(theirs["cam1"]["T_cn_cnm1"], POSE, atol=1e-15)


def test_relative_poses_are_kept_by_kalibr(tmp_path):
    mp.write_calibration(
        tmp_path / "a.yaml", {"cam0": PINHOLE.with_pose(POSE), "cam1": DOUBLE.with_pose(OTHER)}, "kalibr"
    )
    cameras = mp.read_calibration(tmp_path / "a.yaml")
    assert np.allclose(cameras["cam1"].camera_from_world, OTHER @ np.linalg.inv(POSE), atol=1e-12)


def test_nerfstudio_axes(tmp_path):
    """The identity looks along -z with y up; ours along +z with y down."""
    path = tmp_path / "transforms.json"
    frame = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
    lens = {"fl_x": 10, "fl_y": 11, "cx": 4, "cy": 3, "w": 8, "h": 6}
    path.write_text(json.dumps({"camera_model": "OPENCV", **lens, "k1": 0, "p2": 0.0, "frames": [frame]}))
    camera = load_camera(path)
    ray = camera.ray([[4, 3], [4, 0]])
    assert np.allclose(ray.direction[0], [0, 0, -1])
    assert ray.direction[1, 1] > 0, "the top of the image is up"
    moved = np.eye(4)
    moved[:3, 3] = [1, 2, 3]
    path.write_text(json.dumps({**lens, "frames": [{**frame, "transform_matrix": moved.tolist()}]}))
    assert np.allclose(load_camera(path).eye, [1, 2, 3])


def test_nerfstudio_intrinsics_per_frame(tmp_path):
    path = tmp_path / "transforms.json"
    other = mp.KannalaBrandt(512, 400, 200, 201, 250, 190, (0, 0, 0, 0), OTHER)
    mp.write_calibration(path, {"a.png": FISHEYE.with_pose(POSE), "b.png": other})
    data = json.loads(path.read_text())
    assert data["camera_model"] == "OPENCV_FISHEYE"
    assert "fl_x" not in data
    cameras = mp.read_calibration(path)
    assert same(cameras["a.png"], FISHEYE.with_pose(POSE))
    assert same(cameras["b.png"], other)
    with pytest.raises(mp.InputError, match="has 2 cameras: give the name of one, .* there are a.png, b.png"):
        load_camera(path)


def test_instant_ngp_angle(tmp_path):
    path = tmp_path / "transforms.json"
    frame = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
    path.write_text(json.dumps({"camera_angle_x": np.pi / 2, "w": 8, "h": 6, "frames": [frame]}))
    camera: Any = mp.read_calibration(path)["a.png"]
    assert np.allclose([camera.fx, camera.fy, camera.cx, camera.cy], [4, 4, 4, 3])
    path.write_text(json.dumps({"is_fisheye": True, "fl_x": 3, "w": 8, "h": 6, "frames": [frame]}))
    assert isinstance(mp.read_calibration(path)["a.png"], mp.KannalaBrandt)
