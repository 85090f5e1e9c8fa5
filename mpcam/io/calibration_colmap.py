"""COLMAP's models: cameras, one line or record each, and images with poses. Pixel centers are as here."""

import numpy as np

from mpcam.cameras import BrownConrady, Camera, FieldOfView, KannalaBrandt, Panorama, Pinhole, Scaramuzza, UnifiedOmni
from mpcam.errors import InputError
from mpcam.io import calibration_colmap_records as records
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_lenses import coefficients, field_of_view, fisheye_of, radtan, undistorted
from mpcam.io.calibration_parts import Section, as_number, intrinsics
from mpcam.io.calibration_poses import Poses, quaternion_matrix, rotated

STYLE = "COLMAP's cameras.txt"
POSES = "world"
MODELS: dict[type[Camera], str] = {
    Pinhole: "PINHOLE",
    BrownConrady: "FULL_OPENCV",
    KannalaBrandt: "OPENCV_FISHEYE",
    UnifiedOmni: "EUCM",
    FieldOfView: "FOV",
    Scaramuzza: "DIVISION",
}
_RADTAN = ("SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV")  # the first that holds a camera is written

# Parameters of each model in the order of the file, models in the order of their numbers. f stands for fx and fy; k1 to
# k6 belong to the angle's polynomial where the model is a fisheye, whose other parameters must be zero.
_FRAME = "fx fy cx cy"
_PARAMETERS = {
    "SIMPLE_PINHOLE": "f cx cy",
    "PINHOLE": _FRAME,
    "SIMPLE_RADIAL": "f cx cy k1",
    "RADIAL": "f cx cy k1 k2",
    "OPENCV": f"{_FRAME} k1 k2 p1 p2",
    "OPENCV_FISHEYE": f"{_FRAME} k1 k2 k3 k4",
    "FULL_OPENCV": f"{_FRAME} k1 k2 p1 p2 k3 k4 k5 k6",
    "FOV": f"{_FRAME} omega",
    "SIMPLE_RADIAL_FISHEYE": "f cx cy k1",
    "RADIAL_FISHEYE": "f cx cy k1 k2",
    "THIN_PRISM_FISHEYE": f"{_FRAME} k1 k2 p1 p2 k3 k4 sx1 sy1",
    "RAD_TAN_THIN_PRISM_FISHEYE": f"{_FRAME} k1 k2 k3 k4 k5 k6 p1 p2 s1 s2 s3 s4",
    "SIMPLE_DIVISION": "f cx cy k",
    "DIVISION": f"{_FRAME} k",
    "SIMPLE_FISHEYE": "f cx cy",
    "FISHEYE": _FRAME,
    "EUCM": f"{_FRAME} alpha beta",
    "EQUIRECTANGULAR": "w h",
}


def recognizes(document: Document) -> bool:
    """Whether it is a folder with a model, or a file of cameras or images as COLMAP writes them."""
    return records.kind(document) is not None


def read(document: Document) -> dict[str, Camera]:
    """Cameras by their numbers; those of images, and of a folder that has images, by the images' names, with poses."""
    if document.folder:
        document = records.in_folder(document)
    images = None
    if records.kind(document) == "images":
        images, document = records.images(document), records.cameras_beside(document)
    entries = records.cameras(document, [len(names.split()) for names in _PARAMETERS.values()])
    cameras: dict[str, Camera] = {}
    for where, number, model, size, values in entries:
        if number in cameras:
            raise InputError(f"{where}: camera {number} is there twice")
        cameras[number] = _camera(where, model if model in _PARAMETERS else _by_number(where, model), size, values)
    if not cameras:
        raise InputError(f"{document.where}: there is no camera in it")
    return cameras if images is None else _posed(cameras, images, document.where)


def _posed(cameras: dict[str, Camera], images: list[records.Image], where: str) -> dict[str, Camera]:
    found: dict[str, Camera] = {}
    poses = Poses()
    for image in images:
        if image.camera not in cameras:
            raise InputError(f"{image.where}: camera {image.camera} of image {image.name!r} is not in {where}")
        if image.name in found:
            raise InputError(f"{image.where}: image {image.name!r} is there twice")
        pose = rotated(quaternion_matrix(*image.quaternion), image.translation)
        rigid = poses.rigid(f"{image.where}: the quaternion", pose)
        found[image.name] = cameras[image.camera].with_pose(np.eye(4) if rigid is None else rigid)
    if not found:
        raise InputError(f"{where}: there is no image beside it")
    poses.warn()
    return found


def _by_number(where: str, model: str) -> str:
    """The name of a model that a binary file gives by its number."""
    if model.lstrip("-").isdigit() and 0 <= int(model) < len(_PARAMETERS):
        return list(_PARAMETERS)[int(model)]
    raise InputError(f"{where}: the model {model} is not known here: allowed are {', '.join(_PARAMETERS)}")


def _camera(where: str, model: str, size: list, values: list) -> Camera:
    names = _PARAMETERS[model].split()
    if len(values) != len(names):
        raise InputError(f"{where}: {model} has {len(names)} parameters ({', '.join(names)}), not {len(values)}")
    part = Section(where, dict(zip(names, values, strict=True)))
    given = {key: as_number(value, f"{where}: {key}") for key, value in part.data.items()}
    width, height = part.size(*size)
    if model == "EQUIRECTANGULAR":
        if (given["w"], given["h"]) != (width, height):
            raise part.error(f"EQUIRECTANGULAR of w, h = {given['w']:g}, {given['h']:g}: give those of the image")
        return part.camera(Panorama.equirectangular, width, height)
    focal = (given.pop("f"),) * 2 if "f" in given else (given.pop("fx"), given.pop("fy"))
    frame = [*focal, given.pop("cx"), given.pop("cy")]
    if model == "EUCM":
        return part.camera(UnifiedOmni, width, height, *frame, given["alpha"], given["beta"])
    if model == "FOV":
        return field_of_view(part, (width, height), frame, given["omega"])
    if model.endswith("DIVISION"):
        return part.camera(Scaramuzza, width, height, *frame, [given["k"]])
    if not model.endswith("FISHEYE"):
        return radtan(part, (width, height), frame, given)
    k = [given.pop(key, 0.0) for key in ("k1", "k2", "k3", "k4", "k5", "k6")]
    undistorted(part, list(given.values()), f"the distortion {', '.join(given)} of {model}")
    return fisheye_of(part, (width, height), frame, k)


def write(cameras: dict[str, Camera]) -> str:
    """The file's text; names must be whole numbers."""
    lines = [
        "# Camera list with one line of data per camera:",
        "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]",
        f"# Number of cameras: {len(cameras)}",
    ]
    for name, camera in cameras.items():
        if not (name.isdecimal() and name.isascii()):
            raise InputError(f"camera {name!r}: {STYLE} numbers its cameras: give names like '1', '2'")
        parameters, model = [*intrinsics(camera, MODELS, STYLE)], MODELS[type(camera)]
        if isinstance(camera, KannalaBrandt):
            parameters += camera.k
        elif isinstance(camera, UnifiedOmni):
            parameters += [camera.alpha, camera.beta]
        elif isinstance(camera, FieldOfView):
            parameters.append(camera.omega)
        elif isinstance(camera, Scaramuzza):
            if any(camera.a[1:]):
                raise InputError(f"{STYLE} has a division model with a2 alone, not {camera!r}")
            parameters.append(camera.a[0] if camera.a else 0.0)
        elif isinstance(camera, BrownConrady):
            model, parameters = _smallest(camera, *parameters)
        words = [name, model, camera.width, camera.height, *(repr(float(p)) for p in parameters)]
        lines.append(" ".join(map(str, words)))
    return "\n".join(lines) + "\n"


def _smallest(camera: BrownConrady, fx: float, fy: float, cx: float, cy: float) -> tuple[str, list[float]]:
    """The model with the fewest parameters that holds a camera, and they."""
    given = coefficients(camera)
    needed = {name for name, value in given.items() if value} | ({"fx"} if fx != fy else set())
    model = next(model for model in _RADTAN if needed <= set(_PARAMETERS[model].split()))
    values = {"f": fx, "fx": fx, "fy": fy, "cx": cx, "cy": cy, **given}
    return model, [values[name] for name in _PARAMETERS[model].split()]
