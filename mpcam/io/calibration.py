"""Cameras from and to the calibration files of other programs."""

import importlib
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType

from mpcam.cameras import Camera
from mpcam.errors import InputError
from mpcam.io.atomic import atomic_path

FORMATS = ("colmap", "opencv", "kalibr", "nerfstudio")

_SUFFIXES = {".txt": "colmap", ".json": "nerfstudio"}  # what a file that is to be written must be by its name


def read_calibration(path: str | Path, format: str | None = None) -> dict[str, Camera]:
    """The cameras in a calibration file, by name.

    format: "colmap" (cameras.txt; names are its numbers, there are no poses), "opencv" (YAML of one camera, no pose),
    "kalibr" (camchain YAML; poses relative to cam0) or "nerfstudio" (transforms.json; names are the frames' file
    paths); found out from the content if left out. Pixel centers and axes are converted to those of mpcam: center of
    the top left pixel at (0.5, 0.5), x right, y down, z forward. Radial and tangential distortion makes a BrownConrady,
    and a Pinhole where all coefficients are zero.

    Raises InputError for files that cannot be read or understood, for models and distortion that no camera of mpcam
    has, and for poses that are not rigid.
    """
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not text: give a calibration file of {', '.join(FORMATS)}") from None
    except ValueError as error:  # a zero byte in the name
        raise InputError(f"{path!r}: cannot be read: {error}") from None
    names = FORMATS if format is None else (_checked(format),)
    for name in names:
        style = _style(name)
        if format is not None or style.recognizes(text):
            return style.read(text, str(path))
    raise InputError(f"{path}: not recognized as a calibration of {', '.join(FORMATS)}: give its format")


def write_calibration(path: str | Path, cameras: Camera | Mapping[str, Camera], format: str | None = None) -> None:
    """Write cameras to a calibration file of another program; the file appears whole or not at all.

    cameras: by name; names must suit the format ("colmap": whole numbers; "kalibr": cam0, cam1, ...; "nerfstudio": file
    paths of the images; "opencv": one camera only). A single camera gets a name that does. format: see
    `read_calibration`; if left out, .txt is COLMAP's and .json nerfstudio's. What these files have no place for is
    left out: poses (all but Kalibr's relative ones and nerfstudio's) and `max_angle`. Kalibr holds k1, k2, p1 and p2 of
    a BrownConrady, nerfstudio k3 too; COLMAP's file says the smallest of its models that holds the camera.

    Raises InputError for models and coefficients that the format does not have, for unsuitable names, and where nothing
    can be written.
    """
    suffix = Path(path).suffix.lower()
    if format is None and suffix not in _SUFFIXES:
        raise InputError(f"{path}: give the format to write: {', '.join(FORMATS)}")
    name = _SUFFIXES[suffix] if format is None else _checked(format)
    if isinstance(cameras, Camera):
        alone = {"colmap": "1", "opencv": "camera", "kalibr": "cam0", "nerfstudio": "image.png"}
        cameras = {alone[name]: cameras}
    if not cameras or not all(isinstance(camera, Camera) for camera in cameras.values()):
        raise InputError("write_calibration: give a camera, or a dictionary of names and cameras, at least one")
    text = _style(name).write({str(key): camera for key, camera in cameras.items()})
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _checked(format: str) -> str:
    if format not in FORMATS:
        raise InputError(f"format={format!r}: allowed are {', '.join(FORMATS)}")
    return format


def _style(name: str) -> ModuleType:
    return importlib.import_module(f"mpcam.io.calibration_{name}")
