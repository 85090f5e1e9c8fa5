"""Kalibr's camchain: cam0, cam1, ... with intrinsics, and poses from one to the next.

The center of the first pixel is at (0, 0) there. World is the frame of cam0.
"""

import re

import numpy as np

from mpcam.cameras import BrownConrady, Camera, DoubleSphere, FieldOfView, KannalaBrandt, Pinhole, UnifiedOmni
from mpcam.errors import InputError
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_lenses import coefficients_held, field_of_view, pinhole_or_fisheye, undistorted
from mpcam.io.calibration_parts import HALF, Section, intrinsics
from mpcam.io.calibration_poses import Poses, inverse

STYLE = "Kalibr's camchain"
POSES = "rig"
MODELS: dict[type[Camera], str] = {
    Pinhole: "pinhole",
    BrownConrady: "pinhole",
    KannalaBrandt: "pinhole",
    FieldOfView: "pinhole",
    DoubleSphere: "ds",
    UnifiedOmni: "eucm",
}
_LEADING = {"pinhole": 0, "omni": 1, "ds": 2, "eucm": 2}  # numbers before fu, fv, pu, pv
_DISTORTIONS = ("none", "radtan", "equidistant", "fov")
_POSES = ("T_cn_cnm1", "T_cam_imu", "T_imu_cam")


def recognizes(document: Document) -> bool:
    """Whether there are keys cam0 or the like, and a camera model in each."""
    found = [value for key, value in document.mapping().items() if re.fullmatch(r"cam\d+", str(key))]
    return bool(found) and not any(isinstance(value, dict) and {"K", "camera_matrix"} & value.keys() for value in found)


def read(document: Document) -> dict[str, Camera]:
    """Cameras by the names of the file, with the pose of each relative to cam0."""
    whole = Section(document.where, document.tree, document.size)
    found = sorted(int(key[3:]) for key in whole.data if re.fullmatch(r"cam\d+", str(key)))
    if not found or found != list(range(len(found))):
        raise whole.error("cam0, cam1, ... are needed, without gaps")
    parts = [Section(f"{whole.where}: cam{number}", whole.data[f"cam{number}"], whole.given) for number in found]
    lenses = [_camera(part) for part in parts]
    poses = Poses()
    placed = _placed(parts, poses)
    poses.warn()
    return {f"cam{n}": part.camera(lenses[n].with_pose, placed[n]) for n, part in enumerate(parts)}


def _placed(parts: list[Section], poses: Poses) -> list[np.ndarray]:
    """Pose of each camera from cam0: along the chain, or by the IMU where the chain is not given."""
    imu = [_from_imu(part, poses) if len(parts) > 1 and _needs_imu(parts, n) else None for n, part in enumerate(parts)]
    placed: list[np.ndarray | None] = [np.eye(4)]
    for number, part in enumerate(parts[1:], 1):
        first, own, before = imu[0], imu[number], placed[number - 1]
        if "T_cn_cnm1" in part:
            step = poses.read(part, "T_cn_cnm1")
            placed.append(None if step is None or before is None else step @ before)
            if step is not None and before is None:
                poses.lose(f"{part.where}: T_cn_cnm1", f"is relative to cam{number - 1}, whose pose is not known")
        elif own is not None and first is not None:
            placed.append(own @ inverse(first))
        else:
            if not any(key in part for key in _POSES[1:]) or not any(key in parts[0] for key in _POSES[1:]):
                poses.lose(f"{part.where}: T_cn_cnm1", "is missing, and so is T_cam_imu or T_imu_cam here or of cam0")
            placed.append(None)
    return [np.eye(4) if pose is None else pose for pose in placed]


def _needs_imu(parts: list[Section], number: int) -> bool:
    """Whether the pose of a camera relative to the IMU is used: of those without a chain, and of cam0 for them."""
    missing = ["T_cn_cnm1" not in part for part in parts[1:]]
    return any(missing) if number == 0 else missing[number - 1]


def _from_imu(part: Section, poses: Poses) -> np.ndarray | None:
    if "T_cam_imu" in part:
        return poses.read(part, "T_cam_imu")
    found = poses.read(part, "T_imu_cam") if "T_imu_cam" in part else None
    return None if found is None else inverse(found)


def _camera(part: Section) -> Camera:
    model = str(part.get("camera_model"))
    if model not in _LEADING:
        raise part.error(f"camera_model {model!r} is not known here: allowed are {', '.join(_LEADING)}")
    distortion = str(part.get("distortion_model", "none")).lower()
    if distortion not in _DISTORTIONS:
        raise part.error(f"distortion_model {distortion!r} is not known here: allowed are {', '.join(_DISTORTIONS)}")
    coefficients = part.numbers("distortion_coeffs", otherwise=[])
    size = part.image_size("resolution")
    numbers = part.numbers("intrinsics", 4 + _LEADING[model])
    shape, (fx, fy, cx, cy) = numbers[:-4], numbers[-4:]
    frame = [fx, fy, cx + HALF, cy + HALF]
    if model == "pinhole":
        if distortion == "fov":
            (omega,) = part.numbers("distortion_coeffs", 1)
            return field_of_view(part, size, frame, omega)
        if distortion == "none":
            undistorted(part, coefficients, f"{distortion} distortion of {model}")
            coefficients = []
        return pinhole_or_fisheye(part, distortion == "equidistant", size, frame, coefficients)
    if distortion in ("equidistant", "fov"):
        raise part.error(f"no camera of mpcam has {distortion} distortion on top of {model}")
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
        elif isinstance(camera, FieldOfView):
            distortion, coefficients = "fov", [camera.omega]
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
