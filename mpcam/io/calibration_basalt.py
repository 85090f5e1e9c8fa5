"""Basalt's calibration JSON: lenses, sizes, and poses relative to the IMU.

The center of the first pixel is at (0, 0) there. World is the frame of the first camera.
"""

from functools import partial
from typing import Any

import numpy as np

from mpcam.cameras import Camera, DoubleSphere, KannalaBrandt, Pinhole, UnifiedOmni
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_lenses import field_of_view, radtan
from mpcam.io.calibration_parts import HALF, Section
from mpcam.io.calibration_poses import Poses, inverse, quaternion_matrix, rotated

STYLE = "Basalt's JSON"
POSES = "rig"

_TYPES = ("pinhole", "pinhole-radtan8", "kb4", "ds", "ucm", "eucm", "fov")


def recognizes(document: Document) -> bool:
    """Whether there is a list of intrinsics, each with a camera type."""
    return any(isinstance(lens, dict) and "camera_type" in lens for lens in _lenses(_inside(document.mapping())))


def read(document: Document) -> dict[str, Camera]:
    """Cameras as cam0, cam1, ... in the order of the file."""
    part = Section(document.where, _inside(Section(document.where, document.tree).data), document.size)
    lenses, sizes, places = (_list(part, key) for key in ("intrinsics", "resolution", "T_imu_cam"))
    poses = Poses()
    names = [f"{part.where}: T_imu_cam[{number}]" for number in range(len(places))]
    bodies = [poses.made(name, partial(_in_body, name, place)) for name, place in zip(names, places, strict=True)]
    cameras = {}
    for number, lens in enumerate(lenses):
        inner = Section(f"{part.where}: intrinsics[{number}]", lens, part.given)
        if number < len(sizes):
            inner.data = inner.data | {"resolution": sizes[number]}
        camera = _camera(inner)
        if number and number < len(bodies):
            first, own = bodies[0], bodies[number]
            camera = camera if first is None or own is None else camera.with_pose(inverse(own) @ first)
        elif number:
            poses.lose(f"{part.where}: T_imu_cam[{number}]", "is missing")
        cameras[f"cam{number}"] = camera
    poses.warn()
    return cameras


def _inside(data: dict[Any, Any]) -> dict[Any, Any]:
    """What the program that writes the JSON puts into a mapping of its own."""
    inner = data.get("value0")
    return inner if isinstance(inner, dict) else data


def _lenses(data: dict[Any, Any]) -> list[Any]:
    found = data.get("intrinsics")
    return found if isinstance(found, list) else []


def _list(part: Section, key: str) -> list[Any]:
    found = part.get(key, [])
    if not isinstance(found, list):
        raise part.error(f"{key}: a list with one entry for each camera is needed")
    return found


def _in_body(where: str, place: Any) -> np.ndarray:
    """The pose of a camera in the frame of the IMU."""
    inner = Section(where, place)
    w, x, y, z = (inner.number(f"q{axis}") for axis in "wxyz")
    return rotated(quaternion_matrix(w, x, y, z), [inner.number(f"p{axis}") for axis in "xyz"])


def _camera(part: Section) -> Camera:
    kind = part.get("camera_type")
    if kind not in _TYPES:
        raise part.error(f"camera_type {kind!r} is not known here: allowed are {', '.join(_TYPES)}")
    size, lens = part.image_size("resolution"), part.part("intrinsics")
    fx, fy, cx, cy = (lens.number(name) for name in ("fx", "fy", "cx", "cy"))
    frame = [fx, fy, cx + HALF, cy + HALF]
    if kind == "ds":
        return lens.camera(DoubleSphere, *size, *frame, lens.number("xi"), lens.number("alpha"))
    if kind in ("ucm", "eucm"):
        return lens.camera(
            UnifiedOmni, *size, *frame, lens.number("alpha"), lens.number("beta") if kind == "eucm" else 1.0
        )
    if kind == "kb4":
        return lens.camera(KannalaBrandt, *size, *frame, [lens.number(f"k{i}") for i in range(1, 5)])
    if kind == "fov":
        return field_of_view(lens, size, frame, lens.number("w"))
    if kind == "pinhole":
        return lens.camera(Pinhole, *size, *frame)
    names = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
    return radtan(lens, size, frame, {name: lens.number(name, 0.0) for name in names})
