"""The one place that talks to OpenImageIO: files to arrays and back, its errors as one line."""

import os
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.errors import InputError

_stderr_lock = threading.Lock()


@dataclass
class StoredImage:
    """What a file holds: planes by channel name, each (H, W) and as stored (integers scaled to [0, 1], EXR ids kept).

    linear: False where the numbers follow the sRGB curve. unassociated: the colors are not multiplied by alpha.
    """

    planes: dict[str, np.ndarray]
    attributes: dict[str, Any] = field(default_factory=dict)
    linear: bool = True
    unassociated: bool = False


def load(path) -> StoredImage:
    """The first image of a file, placed in its display window. Raises InputError if it cannot be read."""
    import OpenImageIO as oiio

    with _opened(path) as file:
        spec = file.spec()
        if spec.deep or spec.depth > 1:
            raise InputError(f"{path}: deep and volume images cannot be read: flatten it to one value per pixel")
        try:
            with _quiet_stderr():
                planes = _planes(file, spec)
                problem = _problem(file)
        except MemoryError:
            raise InputError(f"{path}: {spec.width}x{spec.height} pixels do not fit into memory") from None
        if planes is None or problem:
            raise InputError(f"{path}: damaged image: {_first_line(problem, path)}")
        formats = (oiio.HALF, oiio.FLOAT, oiio.DOUBLE)
        linear = spec.format.basetype in formats or file.format_name() == "openexr"
        return StoredImage(
            {name: _in_display_window(plane, spec) for name, plane in planes.items()},
            linear=linear or spec.get_string_attribute("oiio:ColorSpace").lower().startswith("lin"),
            unassociated=bool(spec.get_int_attribute("oiio:UnassociatedAlpha")),
        )


def load_attribute(path, name: str) -> Any:
    """The value of a metadata attribute, or None; no pixels are read. Raises InputError if it is not an image."""
    with _opened(path) as file:
        return file.spec().getattribute(name)


def store(path, image: StoredImage, kind: str, half: tuple[str, ...] = ()) -> None:
    """Write planes (of one shape) as channels of type `kind` ("float" or "uint8"), those named in half as half floats.

    With "uint8" the numbers in [0, 1] are rounded to 0..255. path: its suffix picks the format. Attributes are strings,
    numbers or 4x4 matrices (16 numbers, stored as given). Raises InputError if OpenImageIO refuses.
    """
    import OpenImageIO as oiio

    pixels = np.stack(list(image.planes.values()), axis=-1)
    height, width, count = pixels.shape
    spec = oiio.ImageSpec(width, height, count, kind)
    spec.channelnames = tuple(image.planes)
    if half:
        spec.channelformats = tuple(oiio.TypeDesc("half" if name in half else kind) for name in image.planes)
    for name, value in image.attributes.items():
        if isinstance(value, np.ndarray):
            spec.attribute(name, oiio.TypeMatrix, tuple(float(x) for x in value.ravel()))
        else:
            spec.attribute(name, value)
    if not image.linear:
        spec.attribute("oiio:ColorSpace", "sRGB")
    if Path(path).suffix.lower() in (".jpg", ".jpeg"):  # for looking at: color at full resolution, few artefacts
        spec.attribute("compression", "jpeg:95")
        spec.attribute("jpeg:subsampling", "4:4:4")
    if image.unassociated:
        spec.attribute("oiio:UnassociatedAlpha", 1)
    pixels = np.rint(pixels * 255).astype(np.uint8) if kind == "uint8" else pixels.astype(np.float32)
    with _quiet_stderr():
        file = oiio.ImageOutput.create(str(path))
        done = file is not None and file.open(str(path), spec) and file.write_image(np.ascontiguousarray(pixels))
        # closing writes too, and can fail where the disk is full
        done = file is not None and file.close() and done
        problem = "" if done else (_problem(file) if file else "") or _problem(oiio)
    if not done:
        raise InputError(_first_line(problem, path))


@contextmanager
def _opened(path) -> Iterator[Any]:
    import OpenImageIO as oiio

    try:
        status = Path(path).stat()
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file: check the spelling and the folder") from None
    except (OSError, ValueError) as error:  # no permission, a name too long, a zero byte in it
        raise InputError(f"{path}: cannot be read: {error}") from None
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: not a file: give the name of an image file")
    if status.st_size == 0:
        raise InputError(f"{path}: the file is empty: write it again")
    hints = oiio.ImageSpec()
    # colors as they are in the file: the division by alpha would otherwise be done in 8 bits
    hints.attribute("oiio:UnassociatedAlpha", 1)
    with _quiet_stderr():
        file = oiio.ImageInput.open(str(path), hints)
        problem = _problem(oiio)
    if file is None:
        raise InputError(f"{path}: not an image that can be read: {_first_line(problem, path)}")
    try:
        yield file
    except UnicodeDecodeError:
        raise InputError(f"{path}: damaged image: its names are not UTF-8 text") from None
    finally:
        file.close()


def _planes(file, spec) -> dict[str, np.ndarray] | None:
    """Planes by name; integer ids in EXR stay integers, all else becomes float32. None if reading failed."""
    import OpenImageIO as oiio

    formats = spec.channelformats or (spec.format,) * spec.nchannels
    integers = file.format_name() == "openexr"
    ids = [k for k in range(spec.nchannels) if integers and formats[k].basetype == oiio.UINT]
    pixels = file.read_image(oiio.FLOAT)
    if pixels is None:
        return None
    pixels = pixels.reshape(spec.height, spec.width, spec.nchannels)
    planes = {name: np.ascontiguousarray(pixels[..., k]) for k, name in enumerate(spec.channelnames)}
    for k in ids:
        plane = file.read_image(0, 0, k, k + 1, oiio.UINT)
        if plane is None:
            return None
        planes[spec.channelnames[k]] = plane.reshape(spec.height, spec.width)
    return planes


def _in_display_window(plane: np.ndarray, spec) -> np.ndarray:
    """The plane over the display window of its file: cut to it, and 0 where the file holds nothing."""
    data = (spec.x, spec.y, spec.width, spec.height)
    display = (spec.full_x, spec.full_y, spec.full_width, spec.full_height)
    if data == display or display[2] <= 0 or display[3] <= 0:
        return plane
    placed = np.zeros((display[3], display[2]), plane.dtype)
    left, top = max(data[0], display[0]), max(data[1], display[1])
    right = min(data[0] + data[2], display[0] + display[2])
    bottom = min(data[1] + data[3], display[1] + display[3])
    if left < right and top < bottom:
        placed[top - display[1] : bottom - display[1], left - display[0] : right - display[0]] = plane[
            top - data[1] : bottom - data[1], left - data[0] : right - data[0]
        ]
    return placed


def _problem(source: Any) -> str:
    """The error that a file, or OpenImageIO as a whole, has pending; "" if there is none."""
    try:
        return source.geterror()
    except UnicodeDecodeError:  # it quotes what it found in the file
        return "its header is not text"


def _first_line(problem: str, path) -> str:
    line = (problem.strip().splitlines() or ["no reason given"])[0]
    for noise in (f'"{path}"', f"({path})", str(path)):
        line = line.replace(noise, "")
    return " ".join(line.replace("()", "").split()).strip(" :")


@contextmanager
def _quiet_stderr() -> Iterator[None]:
    """Discards what C libraries print: the PNG reader reports errors both there and to us."""
    with _stderr_lock:
        try:
            kept = os.dup(2)
        except OSError:  # no standard error to protect
            yield
            return
        sink = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(sink, 2)
            yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            os.close(sink)
