"""A camera from whatever holds one: its own JSON file, the header of an image, or a scene."""

from pathlib import Path
from typing import TYPE_CHECKING

from mpcam.errors import InputError

if TYPE_CHECKING:
    from mpcam.cameras import Camera


def load_camera(path_or_name: str | Path) -> "Camera":
    """The camera in a .json file (see `camera_to_json`), a calibration, the header of an .exr, or else of a scene.

    Calibrations are .yaml, .yml, .txt and transforms.json files that `read_calibration` reads, with one camera. Scenes
    are what `load_scene` reads. Raises InputError for files that are missing, unreadable or without a camera, and for
    calibrations of several cameras.
    """
    from mpcam.io.camera_files import SUFFIXES, read_camera_file
    from mpcam.io.scenes import load_scene

    kind = Path(path_or_name).suffix.lower()
    if kind in (".yaml", ".yml", ".txt") or Path(path_or_name).name == "transforms.json":
        return _only(path_or_name)
    return read_camera_file(path_or_name) if kind in SUFFIXES else load_scene(path_or_name).scene.camera


def _only(path: str | Path) -> "Camera":
    """The only camera of a calibration."""
    from mpcam.io.calibration import read_calibration

    cameras = read_calibration(path)
    if len(cameras) > 1:
        names = ", ".join(cameras)
        names = names if len(names) < 60 else f"{names[:57]}..."
        raise InputError(f"{path}: has {len(cameras)} cameras ({names}): one is needed; pick it with read_calibration")
    return next(iter(cameras.values()))
