"""Calibration files with mistakes: each is named with its place."""

import json

import numpy as np
import pytest
from calibration_examples import CAMCHAIN, FISHEYE, PINHOLE

import mpcam as mp

OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 500., 0., 320., 0., 500., 240., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ 0.1, 0., 0., 0. ]
"""
FRAME = {"file_path": "a", "transform_matrix": np.eye(4).tolist(), "fl_x": 3, "w": 8, "h": 6}


def transforms(**changes):
    return json.dumps({"frames": [FRAME | changes]})


MISTAKES = [
    ("colmap", "", "there is no camera in it"),
    ("colmap", "1 PINHOLE 640\n", ":1: a camera needs"),
    ("colmap", "1 PINHOLE 640 480 1 2 3\n", r":1: PINHOLE has 4 parameters \(fx, fy, cx, cy\), not 3"),
    ("colmap", "1 PINHOLE 640 480 1 2 3 4\n1 PINHOLE 6 4 1 2 3 4\n", ":2: camera 1 is there twice"),
    ("colmap", "1 WARP 640 480 1 2 3 4 5\n", ":1: the model WARP is not known here: allowed are SIMPLE_PINHOLE"),
    ("colmap", "1 PINHOLE 640 480 1 2 x 4\n", ":1: cx: a finite number is needed, got 'x'"),
    ("colmap", "1 PINHOLE 640.5 480 1 2 3 4\n", "the image size is 640.5 x 480"),
    ("colmap", "1 PINHOLE 640 480 -1 2 3 4\n", r":1: Pinhole\(fx=-1"),
    ("colmap", "1 OPENCV 640 480 1 2 3 4 1e31 0 0 0\n", r":1: BrownConrady\(k=.*: numbers between"),
    ("colmap", "1 THIN_PRISM_FISHEYE 640 480 1 2 3 4 0 0 .1 0 0 0 0 0\n", "the distortion p1, p2, .* is not zero"),
    ("opencv", OPENCV, "add fisheye_model: 1 or 0"),
    (
        "opencv",
        OPENCV.replace("rows: 4", "rows: 12").replace("0., 0. ]\n", "0., 0., 0, 0, 0, 0, 0, .1, 0, 0 ]\n", 1),
        "thin prism distortion .s1, s2, s3, s4. is not zero",
    ),
    (
        "opencv",
        OPENCV.replace("rows: 4", "rows: 14").replace("0., 0. ]\n", "0., 0., 0, 0, 0, 0, 0, 0, 0, 0, 0, .1 ]\n", 1),
        "a tilted sensor .tau_x, tau_y. is not zero",
    ),
    (
        "opencv",
        OPENCV.replace("rows: 4", "rows: 6").replace("0., 0. ]\n", "0., 0., 0., .1 ]\n", 1),
        "6 distortion coefficients are there, 0, 4, 5, 8, 12 or 14 are needed",
    ),
    ("opencv", OPENCV + "xi: 1.2\n", "the distortion beside xi is not zero"),
    ("opencv", OPENCV + "distortion_model: omnidir\n", "'omnidir' is not known here: allowed are fisheye"),
    ("opencv", OPENCV.replace("0., 320.", "2., 320."), "camera_matrix has skew"),
    ("opencv", OPENCV.replace("500., 0., 320.", "500., 320."), "camera_matrix: 8 numbers are there, 3 x 3 are needed"),
    ("opencv", OPENCV.replace("image_width: 640\n", ""), "has no image size, such as image_width and image_height"),
    ("opencv", OPENCV.replace("640", ".Nan"), "the image size: a finite number is needed"),
    ("opencv", OPENCV.replace("rows: 4", "rows: 5"), "4 numbers are there, 5 x 1 are needed"),
    ("opencv", OPENCV.replace("[ 0.1,", "[ a,") + "fisheye_model: 1\n", "data: a finite number is needed, got 'a'"),
    ("opencv", OPENCV + "image_width: 3\n", ":15: not YAML .*: the key image_width is there twice"),
    ("opencv", "camera_matrix: [1, 2\n", ":2: not YAML as calibration files use it"),
    (
        "opencv",
        "camera_matrix: !!python/name:os.system x\n",
        "camera_matrix: .*a value tagged !!python/name:os.system, which is no plain YAML",
    ),
    ("opencv", "camera_matrix: 3\nimage_width: 1\nimage_height: 1\n", "camera_matrix: 1 numbers are there, 9"),
    ("kalibr", CAMCHAIN.replace("cam2", "cam9"), "cam0, cam1, ... are needed, without gaps"),
    ("kalibr", CAMCHAIN.replace("equidistant", "fov"), "cam0: distortion_coeffs: 4 numbers are there, 1 are needed"),
    ("kalibr", CAMCHAIN.replace("equidistant", "spline"), "cam0: distortion_model 'spline' is not known here"),
    ("kalibr", CAMCHAIN.replace("pinhole", "thin"), "cam0: camera_model 'thin' is not known here: allowed are pinhole"),
    ("kalibr", CAMCHAIN.replace("[0, 0, 0, 0]", "[0.1, 0, 0, 0]", 1), "cam2: radtan distortion of omni is not zero"),
    (
        "kalibr",
        CAMCHAIN.replace("distortion_model: radtan", "distortion_model: equidistant"),
        "cam2: no camera of mpcam",
    ),
    ("kalibr", CAMCHAIN.replace("[-0.24, 0.567,", "["), "cam1: intrinsics: 4 numbers are there, 6 are needed"),
    ("kalibr", CAMCHAIN.replace("-0.24", "-2"), r"cam1: DoubleSphere\(xi=-2"),
    ("kalibr", CAMCHAIN.replace("-0.002, 0.0002", "-0.002"), "cam0: a fisheye needs 4 distortion coefficients"),
    ("kalibr", "cam0: 3\n", "cam0: a mapping"),
    ("kalibr", "cam0: &a\n  x: *a\n", ":1: not YAML"),
    ("nerfstudio", "{", "not JSON"),
    ("nerfstudio", "[" * 100000, "not JSON"),
    ("nerfstudio", "{}", "frames is missing"),
    ("nerfstudio", '{"frames": []}', "a list with at least one frame"),
    ("nerfstudio", '{"frames": [3]}', r"frames\[0\]: a mapping"),
    ("nerfstudio", transforms(k4=0.1), "k4, the distortion of the eighth order is not zero"),
    ("nerfstudio", transforms(camera_model="OPENCV_FISHEYE", p1=0.1), "p1 and p2 of a fisheye are not zero"),
    ("nerfstudio", transforms(camera_model="EQUIRECTANGULAR"), "'EQUIRECTANGULAR' is not known here"),
    ("nerfstudio", transforms(w=None), "has no image size, such as w and h"),
    ("nerfstudio", transforms(fl_x=None), "fl_x is missing"),
    ("nerfstudio", transforms(fl_x=None, camera_angle_x=4), "camera_angle_x is 4"),
    ("nerfstudio", transforms(fl_x=True), "fl_x: a finite number is needed, got True"),
    ("nerfstudio", transforms(ftheta_p0=0.1), "ftheta_p0: the lens it belongs to is not known"),
    ("nerfstudio", transforms(distortion_params=[1, 2]), "distortion_params: 2 numbers are there, 6 are needed"),
    ("nerfstudio", transforms(fl_x=None, y_fov=190), "y_fov is 190: degrees between 0 and 180"),
    ("nerfstudio", transforms(fl_x=None, is_fisheye=1, camera_angle_x=1), "a fisheye's focal length does not follow"),
    ("nerfstudio", json.dumps({"frames": [FRAME, FRAME]}), r"frames\[1\]: file_path 'a' is there twice"),
]


@pytest.mark.parametrize(("style", "text", "message"), MISTAKES)
def test_mistakes_are_named(tmp_path, style, text, message):
    path = tmp_path / "file"
    path.write_text(text)
    with pytest.raises(mp.InputError, match=message) as caught:
        mp.read_calibration(path, style)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_names_that_a_format_does_not_take(tmp_path):
    for style, cameras, message in (
        ("colmap", {"left": PINHOLE}, "'left': .* give names like '1', '2'"),
        ("kalibr", {"cam1": PINHOLE}, "calls its cameras cam0, cam1, ... in this order, not cam1"),
        ("opencv", {"a": PINHOLE, "b": PINHOLE}, "holds one camera per file, not 2"),
        ("nerfstudio", {"a": PINHOLE, "b": FISHEYE}, "of one model, not KannalaBrandt, Pinhole"),
        ("nerfstudio", {}, "give a camera, or a dictionary"),
        ("magic", {"a": PINHOLE}, "format='magic': allowed are colmap, opencv, kalibr, nerfstudio"),
        (None, {"a": PINHOLE}, "give the format to write"),
    ):
        with pytest.raises(mp.InputError, match=message):
            mp.write_calibration(tmp_path / "file.yaml", cameras, style)
    assert not any(tmp_path.iterdir())


def test_files_that_are_not_calibrations(tmp_path):
    (tmp_path / "notes.txt").write_text("hello world, these are notes\n")
    (tmp_path / "image.yaml").write_bytes(b"\xff\xfe\x00")
    for name, message in (
        ("notes.txt", "not recognized as a calibration of colmap, ocam, nerfstudio, .*: give a file of one of these"),
        ("image.yaml", "is not text"),
        ("none.yaml", "cannot be read: No such file"),
        (".", "is a folder without a COLMAP model: give cameras.bin"),
    ):
        with pytest.raises(mp.InputError, match=message):
            mp.read_calibration(tmp_path / name)
    with pytest.raises(mp.InputError, match="cannot be read: embedded null"):
        mp.read_calibration("a\0b")
