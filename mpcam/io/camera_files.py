"""A camera in a file of its own: JSON, the header of an image, or one of a calibration."""

import difflib
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from mpcam.errors import InputError

if TYPE_CHECKING:
    from mpcam.cameras import Camera

SUFFIXES = (".json", ".exr", ".yaml", ".yml", ".xml", ".txt", ".bin", ".npz", ".gz")


class FoundCamera(NamedTuple):
    """A camera, and whether its pose is that in the world: calibrations may know none, or only that in a rig."""

    camera: "Camera"
    placed: bool


def read_camera_file(path: str | Path, name: str | None = None, size: tuple[int, int] | None = None) -> FoundCamera:
    """The camera in a .json file (see `camera_to_json`), in the header of an .exr, or in a calibration.

    name: which of several; left out where there is one. size: width and height of its image; what the file says is
    resized to it (see `resized`), and what says nothing has it. Raises InputError for files that are missing, cannot be
    read or have no camera, and for names that are not among those of the file.
    """
    if Path(path).suffix.lower() == ".exr":
        found = FoundCamera(_chosen(path, {"": _in_header(path)}, name), True)
    else:
        found = _in_text(path, name, size)
    if size is None or (found.camera.width, found.camera.height) == size:
        return found
    from mpcam.cameras.change import resized

    return found._replace(camera=resized(found.camera, *size))


def split_name(text: str | Path) -> tuple[str, str | None]:
    """FILE and NAME of "FILE:NAME"; the name is None where it is left out, and where FILE has a colon of its own."""
    whole = str(text)
    if ":" not in whole or _exists(whole):
        return whole, None
    ends = [place for place, sign in enumerate(whole) if sign == ":" and _exists(whole[:place])]
    end = ends[0] if ends else whole.rfind(":")
    # A drive is no file, and what is behind a name that does not exist is taken for a part of it.
    return (whole[:end], whole[end + 1 :]) if ends or Path(whole[:end]).suffix else (whole, None)


def _exists(path: str) -> bool:
    try:
        return Path(path).exists()
    except (OSError, ValueError):  # a name too long, or with a zero byte
        return False


def _in_header(path: str | Path) -> "Camera":
    from mpcam.io.images import read_camera

    camera = read_camera(path)
    if camera is None:
        raise InputError(f"{path}: has no camera in its header: give an EXR that mpcam wrote with one")
    return camera


def _in_text(path: str | Path, name: str | None, size: tuple[int, int] | None) -> FoundCamera:
    from mpcam.cameras.registry import MODELS
    from mpcam.cameras.serialize import camera_from_dict
    from mpcam.io.calibration import open_calibration
    from mpcam.io.calibration_document import Document
    from mpcam.io.calibration_parts import NoSize

    data = Document(path).mapping()
    if "schema" in data or str(data.get("model")) in MODELS:
        try:
            return FoundCamera(_chosen(path, {"": camera_from_dict(data)}, name), True)
        except InputError as error:
            raise InputError(f"{path}: {str(error).removeprefix(f'{path}: ')}") from None
    try:
        cameras, poses = open_calibration(path)
    except NoSize:
        if size is None:
            raise
        cameras, poses = open_calibration(path, size)
    return FoundCamera(_chosen(path, cameras, name), poses == "world")


def _chosen(path: str | Path, cameras: "dict[str, Camera]", name: str | None) -> "Camera":
    if name is None and len(cameras) == 1:
        return next(iter(cameras.values()))
    if name in cameras:
        return cameras[name]
    if list(cameras) == [""]:
        raise InputError(f"{path}: there is no camera {name!r}: its only camera has no name; leave it out")
    names = list(cameras)
    near = difflib.get_close_matches(name or "", names, 1)
    shown = ", ".join(names[:8]) + (f", ... ({len(names)} in all)" if len(names) > 8 else "")
    if name is None:
        raise InputError(
            f"{path}: has {len(names)} cameras: give the name of one, as {Path(path).name}:{names[-1]} or name = "
            f"{names[-1]!r} in a scene file; there are {shown}"
        )
    hint = f"did you mean {near[0]}? " if near else ""
    raise InputError(f"{path}: there is no camera {name!r}: {hint}there {'are' if len(names) > 1 else 'is'} {shown}")
