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
    from mpcam.cameras.serialize import camera_from_json
    from mpcam.io.images import read_camera
    from mpcam.io.scenes import load_scene

    kind = Path(path_or_name).suffix.lower()
    if kind == ".exr":
        camera = read_camera(path_or_name)
        if camera is None:
            raise InputError(f"{path_or_name}: has no camera in its header: give an EXR that mpcam wrote with one")
        return camera
    if kind in (".yaml", ".yml", ".txt") or Path(path_or_name).name == "transforms.json":
        return _only(path_or_name)
    if kind != ".json":
        return load_scene(path_or_name).scene.camera
    try:
        return camera_from_json(Path(path_or_name).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path_or_name}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path_or_name}: is not text: give a camera that camera_to_json wrote") from None
    except InputError as error:
        raise InputError(f"{path_or_name}: {error}") from None


def _only(path: str | Path) -> "Camera":
    """The only camera of a calibration."""
    from mpcam.io.calibration import read_calibration

    cameras = read_calibration(path)
    if len(cameras) > 1:
        names = ", ".join(cameras)
        names = names if len(names) < 60 else f"{names[:57]}..."
        raise InputError(f"{path}: has {len(cameras)} cameras ({names}): one is needed; pick it with read_calibration")
    return next(iter(cameras.values()))
