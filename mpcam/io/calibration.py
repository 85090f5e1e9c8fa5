"""Cameras from and to the calibration files of other programs."""

import importlib
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from mpcam.cameras import Camera
from mpcam.errors import InputError
from mpcam.io.atomic import atomic_path
from mpcam.io.calibration_document import Document
from mpcam.io.calibration_others import named

FORMATS = ("colmap", "ocam", "nerfstudio", "woodscape", "basalt", "camodocal", "orbslam", "kalibr", "opencv")
"""In the order in which they are tried: each knows its own files, and the last ones are the least particular."""
WRITTEN = ("colmap", "opencv", "kalibr", "nerfstudio")

_SUFFIXES = {".txt": "colmap", ".json": "nerfstudio"}  # what a file that is to be written must be by its name


class Calibration(NamedTuple):
    """The cameras of a file by name, and what their poses are relative to.

    poses: "none", "rig" (the file's first camera) or "world".
    """

    cameras: dict[str, Camera]
    poses: str


def read_calibration(
    path: str | Path, format: str | None = None, *, size: tuple[int, int] | None = None
) -> dict[str, Camera]:
    """The cameras in a calibration file, by name.

    format: found out from the content if left out. "colmap": cameras.txt or .bin (names are numbers, there are no
    poses), images.txt or .bin beside it (names are those of the images, with poses), or the folder of both. "opencv":
    a camera matrix and coefficients in YAML, XML, JSON or .npz, ROS's camera_info too (no pose; two cameras of a stereo
    pair relative to the first). "kalibr": camchain YAML (poses relative to cam0). "nerfstudio": transforms.json, also
    instant-ngp's and Blender's (names are the frames' file paths). "camodocal": YAML of VINS and KITTI-360; "orbslam":
    settings of ORB-SLAM and stella_vslam; "basalt": JSON; "ocam": OCamCalib's calib_results.txt; "woodscape": JSON.
    size: width and height of the images, pixels, for files that do not say it.

    Pixel centers and axes are converted to those of mpcam: center of the top left pixel at (0.5, 0.5), x right, y down,
    z forward. A pose that was rounded by hand is put right, and one that is not rigid is left out, both with a warning
    that names its key; the lens is read. docs/calibrations.md has a table of what is read and what is refused.

    Raises InputError for files that cannot be read or understood, and for models and distortion that no camera of mpcam
    has.
    """
    return _read(Document(path, size), format).cameras


def open_calibration(path: str | Path, size: tuple[int, int] | None = None) -> Calibration:
    """`read_calibration`, and whether the poses are those of the world; for callers who place the camera."""
    return _read(Document(path, size), None)


def is_calibration(path: str | Path) -> bool:
    """Whether a file is that of a format known here; for files of other kinds that may be meant, such as meshes."""
    document = Document(path)
    return any(_style(name).recognizes(document) for name in FORMATS)


def _read(document: Document, format: str | None) -> Calibration:
    for name in FORMATS if format is None else (_checked(format, FORMATS),):
        style = _style(name)
        if format is not None or style.recognizes(document):
            return Calibration(style.read(document), style.POSES)
    what = named(document)
    if what is None:
        if document.path.suffix.lower() in (".yaml", ".yml", ".json", ".xml", ".npz"):
            document.tree  # noqa: B018 - says what is wrong with it
        what = f"not recognized as a calibration of {', '.join(FORMATS)}: give a file of one of these"
    raise InputError(f"{document.where}: {what}")


def write_calibration(path: str | Path, cameras: Camera | Mapping[str, Camera], format: str | None = None) -> None:
    """Write cameras to a calibration file of another program; the file appears whole or not at all.

    cameras: by name; names must suit the format ("colmap": whole numbers; "kalibr": cam0, cam1, ...; "nerfstudio": file
    paths of the images; "opencv": one camera only). A single camera gets a name that does. format: one of these four;
    if left out, .txt is COLMAP's and .json nerfstudio's. What these files have no place for is left out: poses (all but
    Kalibr's relative ones and nerfstudio's) and `max_angle`. Kalibr holds k1, k2, p1 and p2 of a BrownConrady,
    nerfstudio k3 too; COLMAP's file says the smallest of its models that holds the camera.

    Raises InputError for models and coefficients that the format does not have, for unsuitable names, and where nothing
    can be written.
    """
    suffix = Path(path).suffix.lower()
    if format is None and suffix not in _SUFFIXES:
        raise InputError(f"{path}: give the format to write: {', '.join(WRITTEN)}")
    name = _SUFFIXES[suffix] if format is None else _checked(format, WRITTEN)
    if isinstance(cameras, Camera):
        alone = {"colmap": "1", "opencv": "camera", "kalibr": "cam0", "nerfstudio": "image.png"}
        cameras = {alone[name]: cameras}
    if not cameras or not all(isinstance(camera, Camera) for camera in cameras.values()):
        raise InputError("write_calibration: give a camera, or a dictionary of names and cameras, at least one")
    text = _style(name).write({str(key): camera for key, camera in cameras.items()})
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _checked(format: str, allowed: tuple[str, ...]) -> str:
    if format not in allowed:
        raise InputError(f"format={format!r}: allowed are {', '.join(allowed)}")
    return format


def _style(name: str) -> ModuleType:
    return importlib.import_module(f"mpcam.io.calibration_{name}")
