"""Settings of ORB-SLAM2 and 3, and of stella_vslam (OpenVSLAM): flat YAML, Camera.fx and so on.

The center of the first pixel is at (0, 0) there. World is the frame of the first camera.
"""

from typing import Any

import numpy as np

from mpcam.cameras import Camera, Panorama, Scaramuzza
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_lenses import pinhole_or_fisheye, radtan
from mpcam.io.calibration_parts import HALF, Section
from mpcam.io.calibration_poses import Poses, inverse

STYLE = "ORB-SLAM's settings"
POSES = "rig"

_PLAIN, _FISHEYE = ("pinhole", "rectified", "perspective"), ("kannalabrandt8", "fisheye")
_OTHER = ("equirectangular", "radial_division")
_SIZE = (("Camera.width", "Camera.height"), ("Camera.cols", "Camera.rows"))
_RIGHT = ("Stereo.T_c1_c2", "Tlr")
"""Keys of the pose of the second camera in the frame of the first."""


def recognizes(document: Document) -> bool:
    """Whether there are keys like Camera.fx, or a table Camera with a model."""
    keys = _flat(document.mapping()).keys()
    return bool({"Camera.fx", "Camera1.fx", "Camera.model"} & keys) or "Camera.type" in keys


def read(document: Document) -> dict[str, Camera]:
    """The cameras "1" and, where there is one, "2"."""
    part = Section(document.where, _flat(Section(document.where, document.tree).data), document.size)
    first = "Camera1" if "Camera1.fx" in part else "Camera"
    cameras = {"1": _camera(part, first)}
    if "Camera2.fx" in part:
        cameras["2"] = _camera(part, "Camera2")
        poses = Poses()
        key = next((key for key in _RIGHT if key in part), None)
        if key is None:
            poses.lose(f"{part.where}: {' or '.join(_RIGHT)}", "is missing")
        pose = None if key is None else poses.read(part, key)
        poses.warn()
        cameras["2"] = cameras["2"].with_pose(np.eye(4) if pose is None else inverse(pose))
    return cameras


def _flat(data: dict[Any, Any]) -> dict[Any, Any]:
    """Stella's table Camera as the dotted keys that ORB-SLAM has."""
    inner = data.get("Camera")
    return data | {f"Camera.{key}": value for key, value in inner.items()} if isinstance(inner, dict) else data


def _camera(part: Section, name: str) -> Camera:
    key = "Camera.type" if "Camera.type" in part else "Camera.model"
    model = str(part.get(key, "PinHole"))
    size = part.image_size(*_SIZE)
    if model.lower() == "equirectangular":
        return part.camera(Panorama.equirectangular, *size)
    if model.lower() not in (*_PLAIN, *_FISHEYE, *_OTHER):
        raise part.error(
            f"{key} {model!r} is not known here: allowed are PinHole, Rectified, KannalaBrandt8 and stella's"
        )
    fx, fy, cx, cy = (part.number(f"{name}.{axis}") for axis in ("fx", "fy", "cx", "cy"))
    frame = [fx, fy, cx + HALF, cy + HALF]
    if model.lower() == "radial_division":
        return part.camera(Scaramuzza, *size, *frame, [part.number(f"{name}.distortion", 0.0)])
    if model.lower() in _FISHEYE:
        k = [part.number(f"{name}.k{i}", 0.0) for i in range(1, 5)]
        return pinhole_or_fisheye(part, True, size, frame, k)
    given = {key: part.number(f"{name}.{key}", 0.0) for key in ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")}
    return radtan(part, size, frame, {} if model == "Rectified" else given)
