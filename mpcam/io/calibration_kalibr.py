"""Kalibr's camchain: cam0, cam1, ... with intrinsics, and poses from one to the next.

The center of the first pixel is at (0, 0) there. World is the frame of cam0.
"""

import re

import numpy as np

from mpcam.cameras import BrownConrady, Camera, DoubleSphere, KannalaBrandt, Pinhole, UnifiedOmni
from mpcam.errors import InputError
from mpcam.io.calibration_parts import (
    HALF,
    Section,
    coefficients_held,
    intrinsics,
    inverse,
    pinhole_or_fisheye,
    undistorted,
)
from mpcam.io.calibration_yaml import read_yaml

STYLE = "Kalibr's camchain"
MODELS: dict[type[Camera], str] = {
    Pinhole: "pinhole",
    BrownConrady: "pinhole",
    KannalaBrandt: "pinhole",
    DoubleSphere: "ds",
    UnifiedOmni: "eucm",
}
_LEADING = {"pinhole": 0, "omni": 1, "ds": 2, "eucm": 2}  # numbers before fu, fv, pu, pv
_DISTORTIONS = ("none", "radtan", "equidistant", "fov")


def recognizes(text: str) -> bool:
    """Whether there is a key cam0 or the like."""
    return re.search(r"^cam\d+\s*:", text, re.MULTILINE) is not None


def read(text: str, name: str) -> dict[str, Camera]:
    """Cameras by the names of the file, with the pose of each relative to cam0."""
    whole = Section(name, read_yaml(text, name))
    found = sorted(int(key[3:]) for key in whole.data if re.fullmatch(r"cam\d+", str(key)))
    if not found or found != list(range(len(found))):
        raise whole.error("cam0, cam1, ... are needed, without gaps")
    cameras: dict[str, Camera] = {}
    pose = np.eye(4)
    for number in found:
        part = Section(f"{name}: cam{number}", whole.data[f"cam{number}"])
        if number:
            pose = part.matrix("T_cn_cnm1") @ pose
        cameras[f"cam{number}"] = part.camera(_camera(part).with_pose, pose)
    return cameras


def _camera(part: Section) -> Camera:
    model = part.get("camera_model")
    if model not in _LEADING:
        raise part.error(f"camera_model {model!r} is not known here: allowed are {', '.join(_LEADING)}")
    distortion = str(part.get("distortion_model", "none")).lower()
    if distortion not in _DISTORTIONS:
        raise part.error(f"distortion_model {distortion!r} is not known here: allowed are {', '.join(_DISTORTIONS)}")
    coefficients = part.numbers("distortion_coeffs", otherwise=[])
    size = part.size(*part.numbers("resolution", 2))
    numbers = part.numbers("intrinsics", 4 + _LEADING[model])
    shape, (fx, fy, cx, cy) = numbers[:-4], numbers[-4:]
    frame = [fx, fy, cx + HALF, cy + HALF]
    if model == "pinhole":
        if distortion in ("none", "fov"):
            undistorted(part, coefficients, f"{distortion} distortion of {model}")
            coefficients = []
        return pinhole_or_fisheye(part, distortion == "equidistant", size, frame, coefficients)
    if distortion == "equidistant":
        raise part.error(f"no camera of mpcam has equidistant distortion on top of {model}")
    undistorted(part, coefficients, f"{distortion} distortion of {model}")
    if model == "omni":
        return part.camera(UnifiedOmni.mei, *size, *frame, *shape)
    return part.camera(DoubleSphere if model == "ds" else UnifiedOmni, *size, *frame, *shape)


def write(cameras: dict[str, Camera]) -> str:
    """The file's text. Names must be cam0, cam1, ...; only poses relative to cam0 are kept."""
    wanted = [f"cam{number}" for number in range(len(cameras))]
    if list(cameras) != wanted:
        raise InputError(f"{STYLE} calls its cameras cam0, cam1, ... in this order, not {', '.join(cameras)}")
    lines: list[str] = []
    before = np.eye(4)
    for name, camera in cameras.items():
        fx, fy, cx, cy = intrinsics(camera, MODELS, STYLE)
        shape: list[float] = []
        distortion, coefficients = "none", []
        if isinstance(camera, KannalaBrandt):
            distortion, coefficients = "equidistant", camera.k
        elif isinstance(camera, BrownConrady):
            distortion, coefficients = "radtan", coefficients_held(camera, "k1 k2 p1 p2", STYLE)
        elif isinstance(camera, DoubleSphere):
            shape = [camera.xi, camera.alpha]
        elif isinstance(camera, UnifiedOmni):
            shape = [camera.alpha, camera.beta]
        lines += [
            f"{name}:",
            f"  camera_model: {MODELS[type(camera)]}",
            f"  intrinsics: {_list([*shape, fx, fy, cx - HALF, cy - HALF])}",
            f"  distortion_model: {distortion}",
            f"  distortion_coeffs: {_list(coefficients)}",
            f"  resolution: [{camera.width}, {camera.height}]",
        ]
        pose = np.asarray(camera.camera_from_world, np.float64)
        if name != "cam0":
            lines += ["  T_cn_cnm1:", *(f"  - {_list(row)}" for row in pose @ inverse(before))]
        before = pose
    return "\n".join(lines) + "\n"


def _list(values) -> str:
    """Numbers in brackets; with a point before the exponent, which YAML 1.1 wants."""
    texts = [repr(float(value)) for value in values]
    texts = [re.sub(r"^(-?\d+)e", r"\1.0e", text) for text in texts]
    return f"[{', '.join(texts)}]"
