"""Files that hold no camera for read_calibration are called what they are, with what to do."""

import json
import pickle

import numpy as np
import pytest
import yaml

import mpcam as mp

METASHAPE = """<?xml version="1.0" encoding="UTF-8"?>
<calibration>
  <projection>frame</projection><width>640</width><height>480</height><f>500</f>
</calibration>
"""
OPENSFM = {
    "v2 maker model": {"projection_type": "fisheye", "width": 640, "height": 480, "focal": 0.5, "k1": 0, "k2": 0}
}
FILES = {
    "bundle.out": ("# Bundle file v0.3\n2 0\n", "Bundler's bundle.out: convert it to COLMAP"),
    "model.nvm": ("NVM_V3\n\n2\n", "VisualSFM's .nvm: convert it to COLMAP"),
    "points3D.txt": ("# 3D point list with one line of data per point:\n", "COLMAP's points3D.txt: give cameras.bin"),
    "database.db": (b"SQLite format 3\0rest", "a database, as COLMAP's database.db: export the model"),
    "calib.mat": (b"MATLAB 5.0 MAT-file, Platform", "MATLAB's .mat: write K, D and the size as JSON"),
    "calib.pkl": (pickle.dumps({"K": 1}), "a Python pickle: it could run any program"),
    "mtx.npy": (b"\x93NUMPY\1\0rest", "one array of NumPy: save the matrix and the coefficients with names"),
    "camera.xml": (METASHAPE, "Agisoft Metashape's calibration: export it there as OpenCV's XML"),
    "camera_models.json": (json.dumps(OPENSFM), "OpenSfM's: export COLMAP's model"),
    "reconstruction.json": (json.dumps([{"cameras": OPENSFM, "shots": {}}]), "OpenSfM's: export COLMAP's model"),
    "sfm_data.json": (json.dumps({"sfm_data_version": "0.3"}), "OpenMVG's sfm_data.json: export COLMAP's text"),
    "target.yaml": ("target_type: aprilgrid\ntagCols: 6\n", "Kalibr's description of a target: give the camchain"),
    "imu.yaml": ("accelerometer_noise_density: 0.1\n", "Kalibr's description of an IMU: give the camchain"),
    "SN1.conf": ("[LEFT_CAM_HD]\nfx=700\n", "Stereolabs' .conf: write fx, fy"),
    "photo.png": (b"\x89PNG\r\n\x1a\nrest", "an image: give the calibration file"),
    "a.obj": ("v 0 0 0\n", "a mesh: give a camera's file, and the mesh as SCENE"),
    "scene.toml": ("[[mesh]]\n", "a scene file: give it as SCENE"),
    "x.cameramodel": ("{\n    'lensmodel': 'LENSMODEL_OPENCV8',\n}", "mrcal's .cameramodel"),
}


@pytest.mark.parametrize("name", FILES)
def test_files_of_other_kinds_are_named(tmp_path, name):
    content, message = FILES[name]
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(mp.InputError) as caught:
        mp.read_calibration(tmp_path / name)
    assert f"{name}: is {message}" in str(caught.value) and "\n" not in str(caught.value)


def test_what_has_keys_but_no_camera(tmp_path):
    (tmp_path / "a.yaml").write_text(yaml.safe_dump({"speed": 3, "colour": "red"}))
    with pytest.raises(mp.InputError, match="has the keys colour, speed, and no camera among them"):
        mp.read_calibration(tmp_path / "a.yaml")
    (tmp_path / "b.yaml").write_text("K: [1, 2\n")
    with pytest.raises(mp.InputError, match=":2: not YAML"):
        mp.read_calibration(tmp_path / "b.yaml")
    (tmp_path / "c.dat").write_bytes(np.zeros(9).tobytes())
    with pytest.raises(mp.InputError, match="not recognized as a calibration of colmap"):
        mp.read_calibration(tmp_path / "c.dat")


def test_text_in_two_bytes_is_read(tmp_path):
    (tmp_path / "cameras.txt").write_text("1 PINHOLE 640 480 300 301 320 240\n", encoding="utf-16")
    assert mp.read_calibration(tmp_path / "cameras.txt")["1"] == mp.Pinhole(640, 480, 300, 301, 320, 240)
