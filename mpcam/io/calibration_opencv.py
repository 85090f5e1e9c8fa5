"""OpenCV's calibrations, ROS's camera_info, and many files of their kind: a camera matrix and a list of coefficients.

YAML, JSON, XML or .npz; the center of the first pixel is at (0, 0) there.
"""

import json
import warnings
from typing import Any

import numpy as np

from mpcam.cameras import BrownConrady, Camera, KannalaBrandt, Pinhole, UnifiedOmni
from mpcam.errors import InputError
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_lenses import RADTAN, coefficients_held, pinhole_or_fisheye, undistorted
from mpcam.io.calibration_matrices import DISTORTION, MATRIX, SIZES, camera_matrix, key_of, listed_frame, numbers_of
from mpcam.io.calibration_parts import HALF, Section, intrinsics, single
from mpcam.io.calibration_poses import Poses, rotated

STYLE = "OpenCV's YAML"
POSES = "rig"
MODELS: dict[type[Camera], str] = {
    Pinhole: "pinhole",
    BrownConrady: "pinhole",
    KannalaBrandt: "fisheye",
    UnifiedOmni: "omnidir",
}

_FISHEYE = ("fisheye", "equidistant", "kannala_brandt", "kannalabrandt4", "opencv_fisheye")
_PLAIN = (
    "plumb_bob",
    "rational_polynomial",
    "radtan",
    "radial-tangential",
    "brown_conrady",
    "none",
    "pinhole",
    "opencv",
)
_MODEL_KEYS = ("distortion_model", "DistortionModel", "distortionModel", "camera_model", "model")
_NAMED = {"fx", "fy"}
_COEFFICIENTS = "k1 k2 p1 p2 k3 k4 k5 k6"  # the last three only where they are needed


def recognizes(document: Document) -> bool:
    """Whether it has a camera matrix by one of its names, itself or in each of its parts, or one for each of two."""
    data = document.mapping()
    return bool(_parts({"": data}) or _parts(data) or key_of(data, MATRIX, "1"))


def read(document: Document) -> dict[str, Camera]:
    """The camera, under the name that the file gives it, or "camera"; of two cameras in one file, "1" and "2".

    Cameras that are the parts of a file go by the parts' names.
    """
    part = Section(document.where, document.tree, document.size)
    alone, inner = _parts({"": part.data}), _parts(part.data)
    if not alone and key_of(part.data, MATRIX, "1") is not None:
        return _stereo(part)
    if not alone and inner:
        shared = {key: value for key, value in part.data.items() if key not in inner}
        return {
            str(key): _camera(Section(f"{part.where}: {key}", shared | one, part.given)) for key, one in inner.items()
        }
    return {str(part.get("camera_name", "camera")): _camera(part)}


def _parts(data: dict[Any, Any]) -> dict[Any, dict[Any, Any]]:
    """Values of a mapping that are cameras: mappings with a matrix, or with its numbers by name."""
    found = {key: value for key, value in data.items() if isinstance(value, dict)}
    return {key: one for key, one in found.items() if key_of(one, MATRIX) or _NAMED <= one.keys()}


def _camera(part: Section, suffix: str = "") -> Camera:
    key = key_of(part.data, MATRIX, suffix) or f"camera_matrix{suffix}"
    named = listed_frame(part) if key not in part else None
    frame = camera_matrix(part, key) if named is None else named
    size = part.image_size(*SIZES)
    listed = key_of(part.data, DISTORTION, suffix)
    if listed is None:
        coefficients = _named_coefficients(part) if not suffix else []
    else:
        coefficients = numbers_of(part, listed)
    _warn_of_regions(part)
    if "xi" in part:
        undistorted(part, coefficients, "the distortion beside xi")
        (xi,) = numbers_of(part, "xi")
        return part.camera(UnifiedOmni.mei, *size, *frame, xi)
    return pinhole_or_fisheye(part, _is_fisheye(part, coefficients), size, frame, coefficients)


def _named_coefficients(part: Section) -> list[float]:
    """Coefficients with a key for each; those of a fisheye, which has no p1 and p2, are four."""
    there = [name for name in RADTAN[:8] if name in part]
    if "p1" not in there and "k4" in there:
        return [part.number(name, 0.0) for name in ("k1", "k2", "k3", "k4")]
    last = max((RADTAN.index(name) for name in there), default=-1)
    count = next(length for length in (0, 4, 5, 8) if length > last)
    return [part.number(name, 0.0) for name in RADTAN[:count]]


def _stereo(part: Section) -> dict[str, Camera]:
    """Two cameras, as OpenCV's stereo programs write them; world is the frame of the first."""
    cameras = {number: _camera(part, number) for number in ("1", "2") if key_of(part.data, MATRIX, number)}
    poses = Poses()
    if "2" in cameras and "R" in part and "T" in part:
        rotation, shift = numbers_of(part, "R"), numbers_of(part, "T")
        if (len(rotation), len(shift)) == (9, 3):
            pose = poses.rigid(f"{part.where}: R", rotated(np.reshape(rotation, (3, 3)), shift))
            cameras["2"] = cameras["2"] if pose is None else cameras["2"].with_pose(pose)
        else:
            poses.lose(f"{part.where}: R and T", f"have {len(rotation)} and {len(shift)} numbers, not 9 and 3")
    elif "2" in cameras:
        poses.lose(f"{part.where}: R and T", "of the second camera are missing")
    poses.warn()
    return cameras


def _is_fisheye(part: Section, coefficients: list[float]) -> bool:
    for key in ("fisheye_model", "is_fisheye", "fisheye"):
        if key in part:
            flag = part.get(key)
            return flag if isinstance(flag, bool) else part.number(key) != 0
    named = next((key for key in _MODEL_KEYS if part.data.get(key)), None)
    if named is not None:
        model = str(part.get(named)).lower()
        if model not in (*_FISHEYE, *_PLAIN):
            allowed = ", ".join((*_FISHEYE, *_PLAIN))
            raise part.error(f"{named} {model!r} is not known here: allowed are {allowed}")
        return model in _FISHEYE
    if any(coefficients) and len(coefficients) == 4:
        raise part.error(
            "four distortion coefficients may be a fisheye's or radial and tangential ones: add fisheye_model: 1 or 0"
        )
    return False


def _warn_of_regions(part: Section) -> None:
    """Say where the images of a ROS camera are not those that the lens is given for."""
    roi = part.data.get("roi")
    inner = roi if isinstance(roi, dict) else {}
    moved = any(inner.get(key) not in (None, 0, 0.0) for key in ("x_offset", "y_offset", "width", "height"))
    binned = [key for key in ("binning_x", "binning_y") if part.data.get(key) not in (None, 0, 1)]
    for what in [*binned, *(["roi"] if moved else [])]:
        warnings.warn(
            f"{part.where}: {what} is not applied: the camera is that of the whole image",
            UserWarning,
            stacklevel=6,
        )
    rectified = part.data.get("R") or part.data.get("rectification_matrix")
    if rectified and "T" not in part:
        key = "R" if "R" in part else "rectification_matrix"
        numbers = numbers_of(part, key)
        if len(numbers) == 9 and np.abs(np.reshape(numbers, (3, 3)) - np.eye(3)).max() > 1e-9 and any(numbers):
            warnings.warn(
                f"{part.where}: {key} and the projection matrix belong to rectified images: the camera is that of the "
                "images as they are taken",
                UserWarning,
                stacklevel=6,
            )


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
