"""A camera in a file of its own: JSON, or the header of an image."""

from pathlib import Path
from typing import TYPE_CHECKING

from mpcam.errors import InputError

if TYPE_CHECKING:
    from mpcam.cameras import Camera

SUFFIXES = (".json", ".exr")


def read_camera_file(path: str | Path) -> "Camera":
    """The camera in a .json file (see `camera_to_json`) or in the header of an .exr.

    Raises InputError for files of other kinds, and for those that are missing, unreadable or without a camera.
    """
    from mpcam.cameras.serialize import camera_from_json
    from mpcam.io.images import read_camera

    kind = Path(path).suffix.lower()
    if kind not in SUFFIXES:
        raise InputError(f"{path}: cameras are in {' and '.join(SUFFIXES)} files")
    if kind == ".exr":
        camera = read_camera(path)
        if camera is None:
            raise InputError(f"{path}: has no camera in its header: give an EXR that mpcam wrote with one")
        return camera
    try:
        return camera_from_json(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not text: give a camera that camera_to_json wrote") from None
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
