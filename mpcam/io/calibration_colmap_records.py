"""What COLMAP's files hold, text and binary alike, before any of it means a camera."""

import struct
from pathlib import Path
from typing import Any, NamedTuple

from mpcam.checks import reads_as_number
from mpcam.errors import InputError
from mpcam.io.calibration_document import Document

_CAMERAS, _IMAGES = ("cameras.bin", "cameras.txt"), ("images.bin", "images.txt")


class Image(NamedTuple):
    """An image: world to camera as a quaternion w, x, y, z and a translation, and the number of its camera."""

    where: str
    name: str
    camera: str
    quaternion: tuple[Any, ...]
    translation: tuple[Any, ...]


def kind(document: Document) -> str | None:
    """ "cameras", "images" or, of a folder, "model"; None for files of other kinds."""
    if document.folder:
        return "model" if any((document.path / name).is_file() for name in _CAMERAS) else None
    if document.path.name.lower() in ("cameras.bin", "images.bin"):
        return document.path.stem.lower()
    if document.binary:
        return "cameras" if _looks_binary(document.data) else None
    words = next((line.split() for line in _lines(document)), [])
    if not words or not words[0].isdigit():
        return None
    if len(words) > 4 and words[1].replace("_", "").isupper():
        return "cameras"
    return "images" if len(words) > 9 and words[8].isdigit() and all(map(reads_as_number, words[1:8])) else None


def in_folder(document: Document) -> Document:
    """The file of a model's folder to begin with: its images where it has some, else its cameras."""
    for name in (*_IMAGES, *_CAMERAS):
        if (document.path / name).is_file():
            return document.beside(name)
    raise InputError(f"{document.where}: a folder without {' or '.join(_CAMERAS)}: give COLMAP's, like sparse/0")


def cameras_beside(document: Document) -> Document:
    """The cameras that go with a file of images, preferably of the same kind."""
    suffix = document.path.suffix.lower()
    for name in sorted(_CAMERAS, key=lambda name: Path(name).suffix != suffix):
        if (document.path.parent / name).is_file():
            return document.beside(name)
    raise InputError(f"{document.where}: has the images' poses: put {' or '.join(_CAMERAS)} beside it, for the lenses")


def cameras(document: Document, counts: list[int]) -> list[tuple[str, str, str, list, list]]:
    """Place, number, model, width and height, parameters of each camera.

    counts: how many parameters the models have, by their numbers in binary files.
    """
    if _is_binary(document):
        return _binary_cameras(document, counts)
    found = []
    for number, line in enumerate(document.text.splitlines(), 1):
        words, where = line.split(), f"{document.where}:{number}"
        if not words or words[0].startswith("#"):
            continue
        if len(words) < 5:
            raise InputError(f"{where}: a camera needs a number, a model, width, height and parameters")
        if words[1].lstrip("-").isdigit():
            raise InputError(f"{where}: the model {words[1]} is not known here: text files have its name")
        found.append((where, words[0], words[1], words[2:4], words[4:]))
    return found


def images(document: Document) -> list[Image]:
    """All images, whose lines, or records, also hold points of the image, which are skipped."""
    if _is_binary(document):
        return _binary_images(document)
    found, points = [], False
    for number, line in enumerate(document.text.splitlines(), 1):
        if line.startswith("#") or (not line.strip() and not points):
            continue
        if not points:
            words, where = line.split(None, 9), f"{document.where}:{number}"
            if len(words) < 10 or not all(map(reads_as_number, words[:9])):
                raise InputError(f"{where}: an image needs a number, a quaternion, a translation, a camera and a name")
            values = tuple(map(float, words[1:8]))
            found.append(Image(where, words[9].strip(), words[8], values[:4], values[4:]))
        points = not points  # the line of points may be empty
    return found


def _binary_cameras(document: Document, counts: list[int]) -> list[tuple[str, str, str, list, list]]:
    found, position = [], 8
    try:
        (total,) = struct.unpack_from("<Q", document.data, 0)
        for _ in range(total):
            number, model, width, height = struct.unpack_from("<IiQQ", document.data, position)
            where = f"{document.where}: camera {number}"
            if not 0 <= model < len(counts):
                raise InputError(f"{where}: the model {model} is not known here: allowed are 0 to {len(counts) - 1}")
            values = struct.unpack_from(f"<{counts[model]}d", document.data, position + 24)
            position += 24 + 8 * counts[model]
            found.append((where, str(number), str(model), [width, height], list(values)))
    except struct.error:
        raise _cut(document) from None
    if position != len(document.data):
        raise InputError(f"{document.where}: {len(document.data) - position} bytes follow the last camera: damaged?")
    return found


def _binary_images(document: Document) -> list[Image]:
    data, found, position = document.data, [], 8
    try:
        (total,) = struct.unpack_from("<Q", data, 0)
        for _ in range(total):
            number, *pose, camera = struct.unpack_from("<I7dI", data, position)
            end = data.index(b"\0", position + 64)
            name = data[position + 64 : end].decode("utf-8", "replace")
            (points,) = struct.unpack_from("<Q", data, end + 1)
            position = end + 9 + 24 * points
            if position > len(data):
                raise _cut(document)
            where = f"{document.where}: image {number}"
            found.append(Image(where, name, str(camera), tuple(pose[:4]), tuple(pose[4:])))
    except (struct.error, ValueError):
        raise _cut(document) from None
    return found


def _cut(document: Document) -> InputError:
    return InputError(
        f"{document.where}: ends in the middle of COLMAP's records: is it {document.path.stem}.bin, whole?"
    )


def _is_binary(document: Document) -> bool:
    return document.path.suffix.lower() == ".bin" or document.binary


def _looks_binary(data: bytes) -> bool:
    """Whether a count, a number, a model and a size stand at the beginning."""
    if len(data) < 56:
        return False
    count, _, model, width, height = struct.unpack_from("<QIiQQ", data, 0)
    return 0 < count < 1e6 and 0 <= model < 64 and 0 < width < 1e6 and 0 < height < 1e6


def _lines(document: Document) -> list[str]:
    lines = (line.strip() for line in document.text[:100_000].splitlines())
    return [line for line in lines if line and not line.startswith("#")]
