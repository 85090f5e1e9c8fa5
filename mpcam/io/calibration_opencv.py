"""OpenCV's YAML of one camera: camera_matrix, distortion_coefficients, and what says which model they belong to.

The names are those of OpenCV's calibration programs and of ROS; the center of the first pixel is at (0, 0) there.
"""

import json
from typing import Any

from mpcam.cameras import BrownConrady, Camera, KannalaBrandt, Pinhole, UnifiedOmni
from mpcam.errors import InputError
from mpcam.io.calibration_parts import (
    HALF,
    Section,
    coefficients_held,
    intrinsics,
    pinhole_or_fisheye,
    single,
    undistorted,
)
from mpcam.io.calibration_yaml import read_yaml

STYLE = "OpenCV's YAML"
MODELS: dict[type[Camera], str] = {
    Pinhole: "pinhole",
    BrownConrady: "pinhole",
    KannalaBrandt: "fisheye",
    UnifiedOmni: "omnidir",
}

_FISHEYE = ("fisheye", "equidistant", "kannala_brandt", "kannalabrandt4")
_PLAIN = ("plumb_bob", "rational_polynomial", "radtan", "none", "pinhole")
_COEFFICIENTS = "k1 k2 p1 p2 k3 k4 k5 k6"  # the last three only where they are needed


def recognizes(text: str) -> bool:
    """Whether the text has OpenCV's matrices or its name for the camera matrix."""
    return "!!opencv-matrix" in text or "\ncamera_matrix:" in f"\n{text}"


def read(text: str, name: str) -> dict[str, Camera]:
    """The camera, under the name that the file gives it, or "camera"."""
    part = Section(name, read_yaml(text, name))
    size = part.size(part.get("image_width"), part.get("image_height"))
    matrix = _matrix(part, "camera_matrix", 9)
    if any(matrix[i] != expected for i, expected in ((1, 0), (3, 0), (6, 0), (7, 0), (8, 1))):
        raise part.error("camera_matrix has skew or is no camera matrix: fx 0 cx, 0 fy cy, 0 0 1 is needed")
    frame = [matrix[0], matrix[4], matrix[2] + HALF, matrix[5] + HALF]
    coefficients = _matrix(part, "distortion_coefficients") if "distortion_coefficients" in part else []
    if "xi" in part:
        undistorted(part, coefficients, "the distortion beside xi")
        camera = part.camera(UnifiedOmni.mei, *size, *frame, _xi(part))
    else:
        camera = pinhole_or_fisheye(part, _is_fisheye(part, coefficients), size, frame, coefficients)
    return {str(part.get("camera_name", "camera")): camera}


def _is_fisheye(part: Section, coefficients: list[float]) -> bool:
    if "fisheye_model" in part:
        flag = part.get("fisheye_model")
        return flag if isinstance(flag, bool) else part.number("fisheye_model") != 0
    if "distortion_model" in part:
        model = str(part.get("distortion_model")).lower()
        if model not in (*_FISHEYE, *_PLAIN):
            allowed = ", ".join((*_FISHEYE, *_PLAIN))
            raise part.error(f"distortion_model {model!r} is not known here: allowed are {allowed}")
        return model in _FISHEYE
    if any(coefficients) and len(coefficients) == 4:
        raise part.error(
            "four distortion coefficients may be a fisheye's or radial and tangential ones: add fisheye_model: 1 or 0"
        )
    return False


def _matrix(part: Section, key: str, count: int | None = None) -> list[float]:
    """The numbers of a matrix, row by row."""
    inner = Section(f"{part.where}: {key}", part.get(key))
    numbers = inner.numbers("data", otherwise=[])
    shape = [inner.number(side) for side in ("rows", "cols")]
    if shape[0] * shape[1] != len(numbers) or (count is not None and len(numbers) != count):
        wanted = f"{shape[0]:g} x {shape[1]:g}" if count is None else f"{count}"
        raise inner.error(f"{len(numbers)} numbers are there, {wanted} are needed")
    return numbers


def _xi(part: Section) -> float:
    if not isinstance(part.get("xi"), dict):
        return part.number("xi")
    (xi,) = _matrix(part, "xi", 1)
    return xi


def write(cameras: dict[str, Camera]) -> str:
    """The file's text, for one camera."""
    name, camera = single(cameras, STYLE)
    fx, fy, cx, cy = intrinsics(camera, MODELS, STYLE)
    lines = ["%YAML:1.0", "---", f"camera_name: {json.dumps(name)}"]
    lines += [f"image_width: {camera.width}", f"image_height: {camera.height}"]
    coefficients, scale = [0.0] * 5, 1.0
    if isinstance(camera, KannalaBrandt):
        coefficients = list(camera.k)
        lines.append("fisheye_model: 1")
    elif isinstance(camera, BrownConrady):
        coefficients = coefficients_held(camera, _COEFFICIENTS, STYLE)
        coefficients = coefficients if any(coefficients[5:]) else coefficients[:5]
    elif isinstance(camera, UnifiedOmni):
        if camera.beta != 1 or camera.alpha == 1:
            raise InputError(
                f"{STYLE} has the unified model with beta = 1 and alpha below 1 only (Mei's), not {camera!r}"
            )
        coefficients, scale = [0.0] * 4, 1 / (1 - float(camera.alpha))
        lines.append(f"xi: {_real(camera.xi)}")
    matrix = [scale * fx, 0.0, cx - HALF, 0.0, scale * fy, cy - HALF, 0.0, 0.0, 1.0]
    lines += _block("camera_matrix", 3, 3, matrix)
    lines += _block("distortion_coefficients", len(coefficients), 1, coefficients)
    return "\n".join(lines) + "\n"


def _real(value: Any) -> str:
    return repr(float(value))


def _block(key: str, rows: int, columns: int, values: list[float]) -> list[str]:
    data = ", ".join(map(_real, values))
    return [
        f"{key}: !!opencv-matrix",
        f"   rows: {rows}",
        f"   cols: {columns}",
        "   dt: d",
        f"   data: [ {data} ]",
    ]
