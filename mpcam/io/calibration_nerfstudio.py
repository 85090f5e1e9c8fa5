"""The transforms.json of nerfstudio, instant-ngp and Blender: intrinsics, and camera-to-world poses with OpenGL's axes.

Pixel centers are as here. OpenGL's camera axes are x right, y up, z backward. The world is that of the file's poses:
what was applied to them before (applied_transform, applied_scale) is not undone.
"""

import json
import math
from typing import Any

import numpy as np

from mpcam.cameras import BrownConrady, Camera, KannalaBrandt, Pinhole
from mpcam.errors import InputError
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_lenses import coefficients_held, pinhole_or_fisheye, radtan, undistorted
from mpcam.io.calibration_parts import Section, intrinsics
from mpcam.io.calibration_poses import Poses, inverse

STYLE = "nerfstudio's transforms.json"
POSES = "world"
MODELS: dict[type[Camera], str] = {Pinhole: "PINHOLE", BrownConrady: "OPENCV", KannalaBrandt: "OPENCV_FISHEYE"}

_PINHOLES = ("PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV")
_FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # between OpenGL's and OpenCV's camera axes
_COEFFICIENTS = ("k1", "k2", "k3", "k4")  # without a fisheye, k4 belongs to r^8
_FRAMES = ("frames", "test_frames")
_OTHER_LENSES = ("ftheta_p0", "latlong", "lens_mode")  # of instant-ngp
_TANGENTIAL = ("p1", "p2")


def recognizes(document: Document) -> bool:
    """Whether there is a list of frames with a matrix each."""
    data = document.mapping()
    lists = [data[key] for key in _FRAMES if isinstance(data.get(key), list)]
    return any(isinstance(frame, dict) and "transform_matrix" in frame for frames in lists for frame in frames)


def read(document: Document) -> dict[str, Camera]:
    """Cameras by the file_path of their frames, those for testing last."""
    whole = Section(document.where, document.tree, document.size)
    lists = {key: whole.get(key) for key in _FRAMES if key in whole or key == "frames"}
    for key, frames in lists.items():
        if not isinstance(frames, list) or (not frames and key == "frames"):
            raise whole.error(f"{key}: a list with at least one frame is needed")
    cameras: dict[str, Camera] = {}
    poses = Poses()
    for number, entry, key in ((n, one, key) for key, frames in lists.items() for n, one in enumerate(frames)):
        frame = Section(f"{whole.where}: {key}[{number}]", entry)
        # What a frame does not say itself, the top level says for all.
        rest = {name: value for name, value in whole.data.items() if name not in _FRAMES}
        part = Section(frame.where, rest | frame.data, whole.given)
        name = str(part.get("file_path"))
        if name in cameras:
            raise part.error(f"file_path {name!r} is there twice")
        camera = _camera(part)
        pose = poses.read(part, "transform_matrix")
        cameras[name] = camera if pose is None else camera.with_pose(inverse(pose @ _FLIP))
    poses.warn()
    return cameras


def _camera(part: Section) -> Camera:
    flag = part.data.get("is_fisheye")
    model = "OPENCV_FISHEYE" if flag is True or flag == 1 else part.get("camera_model", "OPENCV")
    if model not in (*_PINHOLES, "OPENCV_FISHEYE"):
        allowed = ", ".join((*_PINHOLES, "OPENCV_FISHEYE"))
        raise part.error(f"camera_model {model!r} is not known here: allowed are {allowed}")
    for key in (key for key in _OTHER_LENSES if part.data.get(key)):
        raise part.error(
            f"{key}: the lens it belongs to is not known here: allowed are {', '.join(_PINHOLES)}, fisheyes"
        )
    fisheye = model == "OPENCV_FISHEYE"
    width, height = part.image_size(("w", "h"), ("width", "height"))
    fx, fy = (_focal(part, axis, side, not fisheye) for axis, side in (("x", width), ("y", height)))
    if fisheye and fx is None and any(f"camera_angle_{axis}" in part for axis in "xy"):
        raise part.error("fl_x is missing: a fisheye's focal length does not follow from camera_angle_x")
    if fx is None and fy is None:
        raise part.error("fl_x is missing, and so are camera_angle_x, fl_y and camera_angle_y")
    frame = [fx or fy, fy or fx, part.number("cx", 0.5 * width), part.number("cy", 0.5 * height)]
    names: tuple[str, ...] = (*_COEFFICIENTS, *_TANGENTIAL)
    listed = part.numbers("distortion_params", len(names)) if "distortion_params" in part else None
    given: dict[str, float] = dict(zip(names, listed or [part.number(key, 0.0) for key in names], strict=True))
    if not fisheye:
        undistorted(part, [given.pop("k4")], "k4, the distortion of the eighth order")
        return radtan(part, (width, height), frame, given)
    if any(given[key] for key in _TANGENTIAL):
        raise part.error("p1 and p2 of a fisheye are not zero: no fisheye of mpcam has tangential distortion")
    return pinhole_or_fisheye(part, True, (width, height), frame, [given[key] for key in _COEFFICIENTS])


def _focal(part: Section, axis: str, side: int, angles: bool) -> float | None:
    """Focal length along an axis of the image, pixels: given, or with `angles` by that which its side takes up."""
    if f"fl_{axis}" in part:
        return part.number(f"fl_{axis}")
    for key, most in ((f"camera_angle_{axis}", math.pi), (f"{axis}_fov", 180.0)):  # radians, degrees
        if angles and key in part:
            angle = part.number(key)
            if not 0 < angle < most:
                unit = "radians between 0 and pi" if most < 4 else "degrees between 0 and 180"
                raise part.error(f"{key} is {angle:g}: {unit} are needed")
            return 0.5 * side / math.tan(0.5 * math.pi * angle / most)
    return None


def write(cameras: dict[str, Camera]) -> str:
    """The file's text; intrinsics stand at the top where all cameras share them, else in each frame."""
    models = {type(camera) for camera in cameras.values()}
    kinds = {MODELS.get(model, "") for model in models}
    if len(models) > 1 and kinds != {"PINHOLE", "OPENCV"}:
        names = ", ".join(sorted(model.__name__ for model in models))
        raise InputError(f"{STYLE} holds cameras of one model, not {names}: write one file for each")
    lenses = [_lens(camera) for camera in cameras.values()]
    shared = lenses[0] if all(lens == lenses[0] for lens in lenses) else {}
    frames = []
    for (name, camera), lens in zip(cameras.items(), lenses, strict=True):
        pose = inverse(np.asarray(camera.camera_from_world, np.float64)) @ _FLIP
        frames.append({"file_path": name, **({} if shared else lens), "transform_matrix": pose.tolist()})
    top = {"camera_model": "OPENCV" if len(kinds) > 1 else kinds.pop(), **shared}
    return json.dumps({**top, "frames": frames}, indent=1, allow_nan=False) + "\n"


def _lens(camera: Camera) -> dict[str, Any]:
    fx, fy, cx, cy = intrinsics(camera, MODELS, STYLE)
    lens: dict[str, Any] = {"fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy, "w": camera.width, "h": camera.height}
    if isinstance(camera, KannalaBrandt):
        lens |= dict(zip(_COEFFICIENTS, camera.k, strict=True))
    elif isinstance(camera, BrownConrady):
        names = (*_COEFFICIENTS[:3], *_TANGENTIAL)
        lens |= dict(zip(names, coefficients_held(camera, " ".join(names), STYLE), strict=True))
    return lens
