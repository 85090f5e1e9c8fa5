"""Rigs of robots in the layouts of Kalibr, VINS, ORB-SLAM, stella and Basalt: lenses, and poses by hand or by SciPy."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

import mpcam as mp

HERE = [190.98, 190.97, 254.93, 256.9]
K = [0.00348, 0.000715, -0.00205, 0.000203]
LENS = mp.KannalaBrandt(512, 512, 190.98, 190.97, 255.43, 257.4, K)
POINTS = np.random.default_rng(6).uniform(-1, 1, (50, 3)) + [0, 0, 2]
ZERO = np.zeros(3)
BODY0 = [[1, 0, 0, 0.05], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
BODY1 = [[0, 1, 0, -0.05], [-1, 0, 0, 0], [0, 0, 1, 0.01], [0, 0, 0, 1]]
RELATIVE = [[0, 1, 0, -0.05], [-1, 0, 0, 0.05], [0, 0, 1, 0.01], [0, 0, 0, 1]]
"""cam1 from cam0, BODY1 inv(BODY0), by hand."""


def turned(angle, shift):
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = Rotation.from_rotvec(angle).as_matrix(), shift
    return pose


def chain(**cameras):
    lens = {
        "camera_model": "pinhole",
        "distortion_model": "equidistant",
        "distortion_coeffs": K,
        "intrinsics": HERE,
        "resolution": [512, 512],
    }
    return yaml.safe_dump({name: lens | keys for name, keys in cameras.items()})


def same_lens(camera, other=LENS):
    return np.array_equal(camera.with_pose(np.eye(4)).project(POINTS).pixel, other.project(POINTS).pixel)


# Kalibr


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ({"T_cam_imu": BODY0}, {"T_cam_imu": BODY1}),
        ({"T_imu_cam": np.linalg.inv(BODY0).tolist()}, {"T_imu_cam": np.linalg.inv(BODY1).tolist()}),
        ({"T_cam_imu": BODY0}, {"T_imu_cam": np.linalg.inv(BODY1)[:3].tolist()}),
        ({}, {"T_cn_cnm1": RELATIVE}),
        ({"T_cam_imu": BODY0}, {"T_cn_cnm1": RELATIVE, "T_cam_imu": np.eye(4).tolist()}),
    ],
    ids=["T_cam_imu", "T_imu_cam", "both, three rows", "chain", "chain before IMU"],
)
def test_kalibr_poses(tmp_path, first, second):
    (tmp_path / "camchain.yaml").write_text(chain(cam0=first, cam1=second))
    cameras = mp.read_calibration(tmp_path / "camchain.yaml")
    assert np.array_equal(cameras["cam0"].camera_from_world, np.eye(4))
    assert np.allclose(cameras["cam1"].camera_from_world, RELATIVE, rtol=0, atol=1e-15)
    assert all(same_lens(camera) for camera in cameras.values())


@pytest.mark.parametrize("chained", [1, 2])
def test_kalibr_poses_by_the_chain_and_by_the_imu_in_one_file(tmp_path, chained):
    """Of three cameras one hangs on the camera before it, the other on the IMU."""
    keys = {f"cam{n}": {"T_cn_cnm1": RELATIVE} if n == chained else {"T_cam_imu": BODY1} for n in (1, 2)}
    (tmp_path / "chain.yaml").write_text(chain(cam0={"T_cam_imu": BODY0}, **keys))
    cameras = mp.read_calibration(tmp_path / "chain.yaml")
    expected = np.array(RELATIVE) if chained == 1 else np.linalg.matrix_power(RELATIVE, 2)
    assert np.allclose(cameras["cam1"].camera_from_world, RELATIVE, rtol=0, atol=1e-15)
    assert np.allclose(cameras["cam2"].camera_from_world, RELATIVE if chained == 1 else expected, rtol=0, atol=1e-15)


def test_openvins_writes_kalibr_with_opencvs_first_line(tmp_path):
    text = chain(cam0={"T_imu_cam": np.linalg.inv(BODY0).tolist()}, cam1={"T_imu_cam": np.linalg.inv(BODY1).tolist()})
    (tmp_path / "chain.yaml").write_text(f"%YAML:1.0 # needed by OpenCV\n\n{text}")
    assert np.allclose(mp.read_calibration(tmp_path / "chain.yaml")["cam1"].camera_from_world, RELATIVE, atol=1e-15)


def test_kalibr_field_of_view(tmp_path):
    """r = atan(2 r_u tan(w / 2)) / w of a pinhole's r_u, by hand; written and read back equal."""
    path = tmp_path / "chain.yaml"
    path.write_text(chain(cam0={"distortion_model": "fov", "distortion_coeffs": [0.93]}))
    camera = mp.read_calibration(path)["cam0"]
    u, v = POINTS[:, 0] / POINTS[:, 2], POINTS[:, 1] / POINTS[:, 2]
    r = np.hypot(u, v)
    factor = np.arctan(2 * r * np.tan(0.93 / 2)) / (0.93 * r)
    expected = np.stack([190.98 * factor * u + 255.43, 190.97 * factor * v + 257.4], -1)
    assert np.abs(camera.project(POINTS).pixel[:, 0] - expected).max() < 1e-9
    mp.write_calibration(tmp_path / "again.yaml", camera, "kalibr")
    assert mp.read_calibration(tmp_path / "again.yaml")["cam0"] == camera


def test_size_of_a_chain_without_one(tmp_path):
    data = yaml.safe_load(chain(cam0={}))
    del data["cam0"]["resolution"]
    (tmp_path / "chain.yaml").write_text(yaml.safe_dump(data))
    assert same_lens(mp.read_calibration(tmp_path / "chain.yaml", size=(512, 512))["cam0"])
    with pytest.raises(mp.InputError, match="cam0: has no image size, such as resolution"):
        mp.read_calibration(tmp_path / "chain.yaml")


# Poses that are not right


def test_a_pose_rounded_by_hand_is_put_right(tmp_path):
    pose = turned([0.3, -0.2, 0.9], [0.1, 0.2, 0.3])
    rounded = np.round(pose, 3)
    (tmp_path / "chain.yaml").write_text(chain(cam0={}, cam1={"T_cn_cnm1": rounded.tolist()}))
    with pytest.warns(UserWarning, match="cam1: T_cn_cnm1: its rotation is off by .*rounded by hand"):
        found = mp.read_calibration(tmp_path / "chain.yaml")["cam1"].camera_from_world
    assert np.abs(found[:3, :3] @ found[:3, :3].T - np.eye(3)).max() < 1e-14
    assert np.abs(found - pose).max() < 1e-3 and np.array_equal(found[:3, 3], rounded[:3, 3])
    assert np.allclose(found[:3, :3], polar(rounded[:3, :3])[0], rtol=0, atol=1e-14)


WRONG = [
    ([[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "is not a rigid transform: its rotation is off by 3"),
    ([[-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "is not a rigid transform: it mirrors"),
    ([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 1, 1]], "has a last row that is not 0 0 0 1"),
    ([[1, 0, 0], [0, 1, 0], [0, 0, 1]], "four rows of four numbers are needed"),
    ([[1, 0, 0, "a"], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "a finite number is needed, got 'a'"),
    (None, "is missing, and so is T_cam_imu or T_imu_cam"),
]


@pytest.mark.parametrize(("pose", "message"), WRONG, ids=[message[-20:] for _, message in WRONG])
def test_what_is_no_pose_is_left_out_by_its_key(tmp_path, pose, message):
    (tmp_path / "chain.yaml").write_text(chain(cam0={}, cam1={} if pose is None else {"T_cn_cnm1": pose}))
    with pytest.warns(UserWarning, match=f"cam1: T_cn_cnm1: {message}.*: the lens is read and its pose left out"):
        cameras = mp.read_calibration(tmp_path / "chain.yaml")
    assert same_lens(cameras["cam1"]) and np.array_equal(cameras["cam1"].camera_from_world, np.eye(4))


def test_a_lost_pose_is_lost_along_the_chain(tmp_path):
    bad = (2 * np.eye(4)).tolist()
    (tmp_path / "chain.yaml").write_text(chain(cam0={}, cam1={"T_cn_cnm1": bad}, cam2={"T_cn_cnm1": RELATIVE}))
    with pytest.warns(UserWarning, match=r"cam1: T_cn_cnm1: .* \(and 1 more like it\)"):
        assert len(mp.read_calibration(tmp_path / "chain.yaml")) == 3


# Camodocal: VINS and KITTI-360

KANNALA = {
    "model_type": "KANNALA_BRANDT",
    "camera_name": "left",
    "image_width": 512,
    "image_height": 512,
    "projection_parameters": dict(zip(("k2", "k3", "k4", "k5", "mu", "mv", "u0", "v0"), [*K, *HERE], strict=True)),
}
MEI = KANNALA | {
    "model_type": "MEI",
    "mirror_parameters": {"xi": 1.9},
    "distortion_parameters": {"k1": 0, "k2": 0, "p1": 0, "p2": 0},
    "projection_parameters": {"gamma1": 669.8, "gamma2": 669.2, "u0": 377.9, "v0": 279.6},
}
BENT = KANNALA | {
    "model_type": "PINHOLE",
    "distortion_parameters": {"k1": -0.28, "k2": 0.07, "p1": 2e-4, "p2": 2e-5},
    "projection_parameters": {"fx": 461.6, "fy": 460.3, "cx": 363.0, "cy": 248.1},
}


def write(path: Path, data, first="%YAML:1.0\n---\n"):
    path.write_text(first + yaml.safe_dump(data))
    return path


def test_camodocal_lenses(tmp_path):
    assert same_lens(mp.read_calibration(write(tmp_path / "a.yaml", KANNALA))["left"])
    found = mp.read_calibration(write(tmp_path / "b.yaml", MEI))["left"].project(POINTS).pixel[:, 0]
    matrix = np.array([[669.8, 0, 377.9], [0, 669.2, 279.6], [0, 0, 1]])
    theirs, _ = cv2.omnidir.projectPoints(POINTS[:, None], ZERO, ZERO, matrix, 1.9, np.zeros(4))
    assert np.abs(theirs[:, 0] + 0.5 - found).max() < 1e-9
    found = mp.read_calibration(write(tmp_path / "c.yaml", BENT))["left"].project(POINTS).pixel[:, 0]
    matrix = np.array([[461.6, 0, 363.0], [0, 460.3, 248.1], [0, 0, 1]])
    theirs, _ = cv2.projectPoints(POINTS[:, None], ZERO, ZERO, matrix, np.array([-0.28, 0.07, 2e-4, 2e-5]))
    assert np.abs(theirs[:, 0] + 0.5 - found).max() < 1e-9


def test_what_camodocal_has_more(tmp_path):
    bent = {"distortion_parameters": {"k1": 0.1, "k2": 0, "p1": 0, "p2": 0}}
    for data, message in (
        (MEI | bent, "the distortion k1, k2, p1, p2 of MEI is not zero"),
        (KANNALA | {"model_type": "SCARAMUZZA"}, "'SCARAMUZZA' is not known here: give OCamCalib's calib_results.txt"),
    ):
        with pytest.raises(mp.InputError, match=message):
            mp.read_calibration(write(tmp_path / "a.yaml", data))


def test_configuration_of_vins(tmp_path):
    write(tmp_path / "left.yaml", KANNALA)
    write(tmp_path / "right.yaml", KANNALA)
    body0, body1 = turned([0.1, 0, 0.2], [0.1, 0.2, 0.3]), turned([0, 0.3, 0.1], [-0.1, 0.2, 0])
    file = cv2.FileStorage(str(tmp_path / "config.yaml"), cv2.FILE_STORAGE_WRITE)
    for key, value in (("num_of_cam", 2), ("cam0_calib", "left.yaml"), ("cam1_calib", "right.yaml")):
        file.write(key, value)
    file.write("body_T_cam0", body0)
    file.write("body_T_cam1", body1)
    file.release()
    cameras = mp.read_calibration(tmp_path / "config.yaml")
    expected = np.linalg.inv(body1) @ body0
    assert list(cameras) == ["cam0", "cam1"]
    assert np.allclose(cameras["cam1"].camera_from_world, expected, rtol=0, atol=1e-14)


# ORB-SLAM and stella

PINHOLES = ("fx", "fy", "cx", "cy")


def orb(name, kind, *coefficients):
    named = dict(zip((f"{name}.{key}" for key in PINHOLES), HERE, strict=True))
    keys = ("k1", "k2", "k3", "k4") if kind == "KannalaBrandt8" else ("k1", "k2", "p1", "p2", "k3")
    return named | {f"{name}.{key}": value for key, value in zip(keys, coefficients, strict=False)}


def test_orb_slam(tmp_path):
    size = {"Camera.width": 512, "Camera.height": 512, "Camera.fps": 20, "ORBextractor.nFeatures": 1500}
    for first in ("Camera1", "Camera"):
        data = {"Camera.type": "KannalaBrandt8", **size, **orb(first, "KannalaBrandt8", *K)}
        assert same_lens(mp.read_calibration(write(tmp_path / "a.yaml", data))["1"])
    coefficients = [-0.28, 0.07, 2e-4, 2e-5, 0.01]
    for kind in ({"Camera.type": "PinHole"}, {}):  # ORB-SLAM2 names no type
        found = mp.read_calibration(write(tmp_path / "b.yaml", kind | size | orb("Camera", "PinHole", *coefficients)))[
            "1"
        ]
        matrix = np.array([[HERE[0], 0, HERE[2]], [0, HERE[1], HERE[3]], [0, 0, 1]])
        theirs, _ = cv2.projectPoints(POINTS[:, None], ZERO, ZERO, matrix, np.array(coefficients))
        assert np.abs(theirs[:, 0] + 0.5 - found.project(POINTS).pixel[:, 0]).max() < 1e-9


def test_orb_slam_coefficients_that_are_not_there_are_0(tmp_path):
    data = {"Camera.type": "KannalaBrandt8", "Camera.width": 512, "Camera.height": 512}
    found = mp.read_calibration(write(tmp_path / "a.yaml", data | orb("Camera1", "KannalaBrandt8", K[0])))["1"]
    assert same_lens(found, mp.KannalaBrandt(512, 512, 190.98, 190.97, 255.43, 257.4, [K[0], 0, 0, 0]))


def test_an_orb_slam_pair_without_a_pose_keeps_its_lenses(tmp_path):
    data = {"Camera.type": "KannalaBrandt8", "Camera.width": 512, "Camera.height": 512}
    pair = orb("Camera1", "KannalaBrandt8", *K) | orb("Camera2", "KannalaBrandt8", *K)
    with pytest.warns(UserWarning, match="Stereo.T_c1_c2 or Tlr: is missing: the lens is read and its pose left out"):
        cameras = mp.read_calibration(write(tmp_path / "a.yaml", data | pair))
    assert all(same_lens(one) and np.array_equal(one.camera_from_world, np.eye(4)) for one in cameras.values())


@pytest.mark.parametrize("key", ["Stereo.T_c1_c2", "Tlr"])
def test_orb_slam_stereo(tmp_path, key):
    """The pose of the right camera in the left one's frame: its inverse takes points of the left to the right."""
    path, right = tmp_path / "a.yaml", turned([0.01, 0.02, -0.01], [0.101, 0, 0.001])
    data = {"Camera.type": "KannalaBrandt8", "Camera.width": 512, "Camera.height": 512}
    write(path, data | orb("Camera1", "KannalaBrandt8", *K) | orb("Camera2", "KannalaBrandt8", *K))
    numbers = ", ".join(map(repr, right[:3].ravel().tolist()))
    matrix = f"\n{key}: !!opencv-matrix\n  rows: 3\n  cols: 4\n  dt: f\n  data: [{numbers}]\n"
    path.write_text(path.read_text() + matrix)
    cameras = mp.read_calibration(path)
    assert list(cameras) == ["1", "2"] and same_lens(cameras["2"])
    assert np.allclose(cameras["2"].camera_from_world, np.linalg.inv(right), rtol=0, atol=1e-14)


def test_stella(tmp_path):
    base = {"name": "x", "setup": "monocular", "cols": 512, "rows": 512, "fps": 30}
    lens = dict(zip(PINHOLES, HERE, strict=True))
    fisheye = {"Camera": base | lens | {"model": "fisheye", **{f"k{i + 1}": k for i, k in enumerate(K)}}}
    assert same_lens(mp.read_calibration(write(tmp_path / "a.yaml", fisheye, ""))["1"])
    dotted = {f"Camera.{key}": value for key, value in fisheye["Camera"].items()}
    assert same_lens(mp.read_calibration(write(tmp_path / "b.yaml", dotted, ""))["1"])
    round_ = mp.read_calibration(write(tmp_path / "c.yaml", {"Camera": base | {"model": "equirectangular"}}, ""))["1"]
    assert round_ == mp.Panorama.equirectangular(512, 512)
    division = {"Camera": base | lens | {"model": "radial_division", "distortion": -0.2}}
    found = mp.read_calibration(write(tmp_path / "d.yaml", division, ""))["1"]
    pixel = found.project(POINTS).pixel[:, 0]
    bent = (pixel - [255.43, 257.4]) / HERE[:2]  # undistorted = distorted / (1 + d r^2)
    straight = bent / (1 - 0.2 * (bent**2).sum(-1, keepdims=True))
    assert np.abs(straight - POINTS[:, :2] / POINTS[:, 2:]).max() < 1e-12
    with pytest.raises(mp.InputError, match="Camera.model 'warp' is not known here"):
        mp.read_calibration(write(tmp_path / "e.yaml", {"Camera": base | lens | {"model": "warp"}}, ""))


# Basalt


def basalt(*lenses, places=(), size=(512, 512)):
    entries = [{"camera_type": kind, "intrinsics": values} for kind, values in lenses]
    data = {"T_imu_cam": list(places), "intrinsics": entries, "resolution": [list(size)] * len(lenses)}
    return json.dumps({"value0": data})


def place(rotation, shift):
    x, y, z, w = rotation.as_quat()
    return {"px": shift[0], "py": shift[1], "pz": shift[2], "qx": x, "qy": y, "qz": z, "qw": w}


def test_basalt(tmp_path):
    path, frame = tmp_path / "calibration.json", dict(zip(PINHOLES, HERE, strict=True))
    here = (512, 512, 190.98, 190.97, 255.43, 257.4)
    lenses = [
        ("kb4", {f"k{i + 1}": k for i, k in enumerate(K)}, LENS),
        ("ds", {"xi": -0.17, "alpha": 0.59}, mp.DoubleSphere(*here, -0.17, 0.59)),
        ("eucm", {"alpha": 0.59, "beta": 1.1}, mp.UnifiedOmni(*here, 0.59, 1.1)),
        ("ucm", {"alpha": 0.59}, mp.UnifiedOmni(*here, 0.59)),
        ("fov", {"w": 0.93}, mp.FieldOfView(*here, 0.93)),
        ("pinhole", {}, mp.Pinhole(*here)),
        ("pinhole-radtan8", {"k1": -0.2, "k2": 0.1, "p1": 1e-3, "p2": 2e-3, "k3": 0, "k4": 0, "k5": 0, "k6": 0},
         mp.BrownConrady(*here, (-0.2, 0.1), (1e-3, 2e-3))),
    ]  # fmt: skip
    turns = Rotation.random(len(lenses), np.random.default_rng(1))
    places = [(turn, np.arange(3.0) * number) for number, turn in enumerate(turns)]
    path.write_text(basalt(*((kind, frame | rest) for kind, rest, _ in lenses), places=[place(*p) for p in places]))
    cameras = mp.read_calibration(path)
    bodies = []
    for turn, shift in places:
        body = np.eye(4)
        body[:3, :3], body[:3, 3] = turn.as_matrix(), shift
        bodies.append(body)
    for number, (_, _, lens) in enumerate(lenses):
        camera = cameras[f"cam{number}"]
        assert same_lens(camera, lens)
        expected = np.linalg.inv(bodies[number]) @ bodies[0]
        assert np.allclose(camera.camera_from_world, expected, rtol=0, atol=1e-12)


def test_basalt_mistakes(tmp_path):
    path, frame = tmp_path / "a.json", dict(zip(PINHOLES, HERE, strict=True))
    path.write_text(basalt(("bal", frame)))
    with pytest.raises(
        mp.InputError, match=r"intrinsics\[0\]: camera_type 'bal' is not known here: allowed are pinhole"
    ):
        mp.read_calibration(path)
    path.write_text(basalt(("ds", frame | {"xi": 0.1})))
    with pytest.raises(mp.InputError, match=r"intrinsics\[0\]: intrinsics: alpha is missing"):
        mp.read_calibration(path)
    path.write_text(basalt(("pinhole", frame), places=[{"px": 1}]))
    with pytest.warns(UserWarning, match=r"T_imu_cam\[0\]: qw is missing: the lens is read"):
        assert mp.read_calibration(path)["cam0"] == mp.Pinhole(512, 512, 190.98, 190.97, 255.43, 257.4)
    rounded = {
        key: round(value, 3) for key, value in place(Rotation.from_rotvec([0.3, -0.2, 0.9]), [0.1, 0, 0]).items()
    }
    path.write_text(basalt(("pinhole", frame), ("pinhole", frame), places=[rounded, rounded]))
    with pytest.warns(UserWarning, match=r"T_imu_cam\[0\]: its rotation is off by .*and 1 more"):
        assert np.allclose(mp.read_calibration(path)["cam1"].camera_from_world, np.eye(4))
