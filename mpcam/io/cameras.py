"""A camera from whatever holds one: a file of its own, the header of an image, a calibration, or a scene."""

from pathlib import Path
from typing import TYPE_CHECKING

from mpcam.errors import InputError

if TYPE_CHECKING:
    from mpcam.cameras import Camera


def load_camera(path_or_name: str | Path, *, size: tuple[int, int] | None = None) -> "Camera":
    """The camera in a .json file (see `camera_to_json`), a calibration, the header of an .exr, or else of a scene.

    path_or_name: FILE, or FILE:NAME for one of several cameras. Calibrations are the files that `read_calibration`
    reads, and folders with COLMAP's models. Scenes are what `load_scene` reads. size: width and height, pixels; the
    camera is resized to it, and has it where its file says none. Raises InputError for files that are missing,
    unreadable or without a camera, and for names that are not there.
    """
    from mpcam.cameras.change import resized
    from mpcam.io.camera_files import SUFFIXES, read_camera_file, split_name
    from mpcam.io.scenes import load_scene

    path, name = split_name(path_or_name)
    if Path(path).suffix.lower() in SUFFIXES or _is_folder(path):
        return read_camera_file(path, name, size).camera
    if name is not None:
        raise InputError(f"{path}: is a scene, which has one camera: leave out {name!r}, or give a camera's file")
    camera = load_scene(path_or_name).scene.camera
    return camera if size is None else resized(camera, *size)


def _is_folder(path: str) -> bool:
    try:
        return Path(path).is_dir()
    except (OSError, ValueError):  # a name too long, or with a zero byte
        return False
