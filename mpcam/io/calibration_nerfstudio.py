"""The transforms.json of nerfstudio and instant-ngp: intrinsics, and camera-to-world poses with OpenGL's axes.

Pixel centers are as here. OpenGL's camera axes are x right, y up, z backward.
"""

import json
import math
from typing import Any

import numpy as np

from mpcam.cameras import BrownConrady, Camera, KannalaBrandt, Pinhole
from mpcam.errors import InputError
from mpcam.io.calibration_parts import (
    Section,
    coefficients_held,
    intrinsics,
    inverse,
    pinhole_or_fisheye,
    radtan,
    undistorted,
)

STYLE = "nerfstudio's transforms.json"
MODELS: dict[type[Camera], str] = {Pinhole: "PINHOLE", BrownConrady: "OPENCV", KannalaBrandt: "OPENCV_FISHEYE"}

_PINHOLES = ("PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV")
_FLIP = np.diag([1.0, -1.0, -1.0, 1.0])  # between OpenGL's and OpenCV's camera axes
_COEFFICIENTS = ("k1", "k2", "k3", "k4")  # without a fisheye, k4 belongs to r^8
_TANGENTIAL = ("p1", "p2")


def recognizes(text: str) -> bool:
    """Whether the text is a JSON object."""
    return text.lstrip().startswith("{")


def read(text: str, name: str) -> dict[str, Camera]:
    """Cameras by the file_path of their frames."""
    try:
        data = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise InputError(f"{name}: not JSON: {error}") from None
    whole = Section(name, data)
    frames = whole.get("frames")
    if not isinstance(frames, list) or not frames:
        raise whole.error("frames: a list with at least one frame is needed")
    cameras: dict[str, Camera] = {}
    for number, entry in enumerate(frames):
        frame = Section(f"{name}: frames[{number}]", entry)
        # What a frame does not say itself, the top level says for all.
        part = Section(frame.where, {key: value for key, value in whole.data.items() if key != "frames"} | frame.data)
        key = str(part.get("file_path"))
        if key in cameras:
            raise part.error(f"file_path {key!r} is there twice")
        pose = part.matrix("transform_matrix")
        camera = _camera(part)
        part.camera(camera.with_pose, pose)  # complains if it is not rigid
        cameras[key] = camera.with_pose(inverse(pose @ _FLIP))
    return cameras


def _camera(part: Section) -> Camera:
    model = "OPENCV_FISHEYE" if part.get("is_fisheye", False) is True else part.get("camera_model", "OPENCV")
    if model not in (*_PINHOLES, "OPENCV_FISHEYE"):
        allowed = ", ".join((*_PINHOLES, "OPENCV_FISHEYE"))
        raise part.error(f"camera_model {model!r} is not known here: allowed are {allowed}")
    fisheye = model == "OPENCV_FISHEYE"
    width, height = part.size(part.get("w"), part.get("h"))
    if "fl_x" not in part and "camera_angle_x" in part and not fisheye:
        angle = part.number("camera_angle_x")
        if not 0 < angle < math.pi:
            raise part.error(f"camera_angle_x is {angle:g}: radians between 0 and pi are needed")
        fx = 0.5 * width / math.tan(0.5 * angle)
    else:
        fx = part.number("fl_x")
    frame = [fx, part.number("fl_y", fx), part.number("cx", 0.5 * width), part.number("cy", 0.5 * height)]
    given = {key: part.number(key, 0.0) for key in (*_COEFFICIENTS, *_TANGENTIAL)}
    if not fisheye:
        undistorted(part, [given.pop("k4")], "k4, the distortion of the eighth order")
        return radtan(part, (width, height), frame, given)
    if any(given[key] for key in _TANGENTIAL):
        raise part.error("p1 and p2 of a fisheye are not zero: no fisheye of mpcam has tangential distortion")
    return pinhole_or_fisheye(part, True, (width, height), frame, [given[key] for key in _COEFFICIENTS])


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
