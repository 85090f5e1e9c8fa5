"""Camodocal's camera files, which VINS and KITTI-360 use, and VINS-Fusion's configuration, which names them.

The center of the first pixel is at (0, 0) there. A configuration's world is the frame of cam0.
"""

from mpcam.cameras import Camera, KannalaBrandt, UnifiedOmni
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_lenses import radtan, undistorted
from mpcam.io.calibration_parts import HALF, Section
from mpcam.io.calibration_poses import Poses, inverse

STYLE = "camodocal's YAML"
POSES = "rig"

_MODELS = ("PINHOLE", "PINHOLE_FULL", "MEI", "KANNALA_BRANDT")


def recognizes(document: Document) -> bool:
    """Whether there is a model type with its projection parameters, or a configuration that names such a file."""
    data = document.mapping()
    named = "model_type" in data and "SCARAMUZZA" in str(data["model_type"])
    return named or {"model_type", "projection_parameters"} <= data.keys() or "cam0_calib" in data


def read(document: Document) -> dict[str, Camera]:
    """The camera by its name in the file, or "camera"; those of a configuration as cam0, cam1, with their poses."""
    part = Section(document.where, document.tree, document.size)
    if "cam0_calib" not in part:
        return {str(part.get("camera_name", "camera")): _camera(part)}
    cameras, poses = {}, Poses()
    first = None
    for name in (f"cam{number}" for number in range(16) if f"cam{number}_calib" in part):
        lens = next(iter(read(document.beside(str(part.get(f"{name}_calib")))).values()))
        body = poses.read(part, f"body_T_{name}") if f"body_T_{name}" in part else None
        first = body if name == "cam0" else first
        if name != "cam0" and (body is None or first is None):
            if f"body_T_{name}" not in part or "body_T_cam0" not in part:
                poses.lose(f"{part.where}: body_T_{name}", "or that of cam0 is missing")
        elif name != "cam0" and body is not None and first is not None:
            lens = lens.with_pose(inverse(body) @ first)
        cameras[name] = lens
    poses.warn()
    return cameras


def _camera(part: Section) -> Camera:
    model = str(part.get("model_type")).upper()
    if model not in _MODELS:
        advice = ": give OCamCalib's calib_results.txt" if model == "SCARAMUZZA" else ""
        raise part.error(f"model_type {model!r} is not known here{advice}; allowed are {', '.join(_MODELS)}")
    size = part.image_size(("image_width", "image_height"))
    lens = part.part("projection_parameters")
    bent = part.part("distortion_parameters").data if "distortion_parameters" in part else {}
    given = Section(f"{part.where}: distortion_parameters", bent)
    named = {key: given.number(key) for key in given.data}
    if model == "KANNALA_BRANDT":
        undistorted(given, list(named.values()), "the distortion of KANNALA_BRANDT")
        frame = [lens.number("mu"), lens.number("mv"), lens.number("u0") + HALF, lens.number("v0") + HALF]
        return lens.camera(KannalaBrandt, *size, *frame, [lens.number(f"k{i}") for i in range(2, 6)])
    if model == "MEI":
        xi = part.part("mirror_parameters").number("xi")
        frame = [lens.number("gamma1"), lens.number("gamma2"), lens.number("u0") + HALF, lens.number("v0") + HALF]
        undistorted(given, list(named.values()), f"the distortion {', '.join(named)} of MEI")
        return part.camera(UnifiedOmni.mei, *size, *frame, xi)
    frame = [lens.number("fx"), lens.number("fy"), lens.number("cx") + HALF, lens.number("cy") + HALF]
    return radtan(part, size, frame, named)
