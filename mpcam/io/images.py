"""Images in and out: linear light in NumPy arrays, EXR for keeping, PNG for looking.

Which files keep what:

    .exr                             float32 (or half), depth, further channels, the camera
    .tif .tiff                       float32
    .hdr                             shared exponent, three channels, finite and not negative
    .png .bmp .tga .jpg .jpeg .ppm   8 bits, sRGB, clipped to [0, 1]

Color channels in an EXR are R, G, B and A, or Y for one channel. Depth is the channel DEPTH_CHANNEL, "ray.distance":
the distance along the ray of the pixel. It is not called Z, since Z means the distance along an optical axis, which
cameras with rays in all directions do not have. The camera is the string attribute CAMERA_ATTRIBUTE (JSON, exact) and,
for other programs, the standard attribute worldToCamera in float32. The rays of a ray map are six further channels, see
`mpcam.io.ray_maps`.
"""

from pathlib import Path
from typing import Any

import numpy as np

from mpcam.errors import InputError
from mpcam.io import openimageio
from mpcam.io.atomic import atomic_path
from mpcam.io.image_formats import format_of, linear, shared_exponent, srgb_encoded
from mpcam.io.ray_maps import is_ray_header, ray_channels, ray_header, ray_map_of

DEPTH_CHANNEL = "ray.distance"
CAMERA_ATTRIBUTE = "mpcam:camera"
COLOR_NAMES = {1: ("Y",), 3: ("R", "G", "B"), 4: ("R", "G", "B", "A")}


def write_image(
    path,
    image,
    *,
    depth=None,
    channels: dict[str, Any] | None = None,
    camera=None,
    half: bool = False,
) -> None:
    """Write linear light to a file; the suffix picks the format, see the table in this module.

    image: (H, W), (H, W, 1), (H, W, 3) or (H, W, 4) floats; the fourth channel is alpha, colors are multiplied
    by it. depth: (H, W) distance along each pixel's unit ray, inf where nothing is hit. channels: further (H, W) arrays
    by name, e.g. "normal.X" or "triangle.id"; integers must fit float32 exactly (up to 2**24). camera: any mpcam camera
    of the image's size; of a RayMap, float32 is kept, and of a camera that no text can hold (its class is not in the
    register, its profile is a user's own) its RayMap. half: R, G, B, A or Y as 16-bit floats; all else stays float32.

    The file appears whole or not at all, and an older one is kept if writing fails. Raises InputError for wrong shapes
    and types, for what the format cannot keep (NaN in 8 bits, depth or a camera outside EXR), for finite values beyond
    the range of the stored type, and if the file cannot be written.
    """
    form = format_of(path)
    pixels = _pixels(path, image)
    height, width, count = pixels.shape
    extras = {"depth": depth, "channels": channels or None, "camera": camera, "half": half or None}
    wanted = [name for name, value in extras.items() if value is not None]
    if wanted and not form.layers:
        raise InputError(f"{path}: {Path(path).suffix} files cannot keep {' and '.join(wanted)}: write an .exr file")
    if count == 4 and not form.alpha:
        raise InputError(f"{path}: {Path(path).suffix} files keep no alpha: give 3 channels, or write .exr or .png")
    planes = {name: pixels[..., k] for k, name in enumerate(COLOR_NAMES[count])}
    if half:
        _refuse_overflow(path, "image", pixels, np.float16)
    attributes: dict[str, Any] = {}
    if form.layers:
        attributes, rays = ({}, {}) if camera is None else _camera_attributes(path, camera, width, height)
        named = ({} if depth is None else {DEPTH_CHANNEL: depth}) | _named_channels(path, channels or {}, depth, rays)
        for name, plane in named.items():
            _check_channel_name(path, name, planes)
            planes[name] = _plane(path, "depth" if name == DEPTH_CHANNEL else name, plane, (height, width))
        planes |= rays
    if form.shared_exponent:
        planes = shared_exponent(path, planes)
    if not form.floats:
        planes = srgb_encoded(path, planes)
    stored = openimageio.StoredImage(planes, attributes, linear=form.floats, unassociated=not form.floats)
    _store(path, stored, "float" if form.floats else "uint8", COLOR_NAMES[count] if half else ())


def write_ray_map(path, camera) -> None:
    """Write the rays of a camera, any of mpcam's, as an EXR with six channels, which other programs can read too.

    path: ends in .exr. camera: a RayMap, or another one, of which the rays of the pixels' centers are taken (see
    `RayMap.of`). Channels are origin.X, .Y, .Z and direction.X, .Y, .Z in the camera frame (OpenCV axes), a direction
    of zero where a pixel has no ray; the pose is in the header, once exact and once as the standard attribute
    worldToCamera. EXR holds float32, so origins and directions lose what float64 has beyond 24 bits. Raises InputError
    for other suffixes, for rays that float32 cannot hold, and if the file cannot be written.
    """
    from mpcam.cameras.base import Camera
    from mpcam.cameras.ray_map import RayMap

    if not format_of(path).layers:
        raise InputError(f"{path}: {Path(path).suffix} files keep no rays: write an .exr file")
    if not isinstance(camera, Camera):
        raise InputError(f"{path}: camera is a {type(camera).__name__}: give one of mpcam's cameras")
    rays = camera if isinstance(camera, RayMap) else RayMap.of(camera)
    attributes, planes = _camera_attributes(path, rays, rays.width, rays.height)
    _store(path, openimageio.StoredImage(planes, attributes), "float")


def read_ray_map(path):
    """The RayMap in the six channels of an EXR, written by `write_ray_map`, or by another program.

    Without mpcam's header the rays are taken to be in the world. Numbers come back as they are in the file, float32.
    Raises InputError if the file is not a readable image, or has no such channels.
    """
    text = openimageio.load_attribute(path, CAMERA_ATTRIBUTE)
    header = str(text) if text is not None and is_ray_header(str(text)) else None
    return ray_map_of(path, openimageio.load(path).planes, header)


def _store(path, image: openimageio.StoredImage, kind: str, half: tuple[str, ...] = ()) -> None:
    """Write an image whole or not at all."""
    with atomic_path(path) as temporary:
        try:
            openimageio.store(temporary, image, kind, half)
        except InputError as error:
            raise InputError(f"{path}: cannot be written ({error}): write somewhere else") from None


def read_image(path) -> np.ndarray:
    """The colors of an image file: (H, W, C) float32 linear light, C = 1 (gray), 3 (RGB) or 4 (RGBA).

    Channels are found by name (R, G, B, A, or Y). Files of 8 or 16 bits are taken as sRGB unless they say that they are
    linear; colors come multiplied by alpha. Pixels of the display window that an EXR holds no data for are 0. Any
    format that OpenImageIO reads is accepted; of several images in a file the first is read. Raises InputError for a
    file that is missing, unreadable, damaged or without colors.
    """
    image = openimageio.load(path)
    planes = linear(image)
    by_name = {name.lower(): plane for name, plane in reversed(planes.items())}
    by_name |= {name.lower(): planes[name] for name in ("R", "G", "B", "A", "Y") if name in planes}
    if {"r", "g", "b"} <= by_name.keys():
        names = ["r", "g", "b"] + (["a"] if "a" in by_name else [])
    elif "y" in by_name:
        names = ["y", "y", "y", "a"] if "a" in by_name else ["y"]
    else:
        raise InputError(
            f"{path}: the image has no channels R, G, B or Y, but {_listed(planes)}: read them with read_channels"
        )
    return np.stack([by_name[name] for name in names], axis=-1).astype(np.float32)


def read_channels(path) -> dict[str, np.ndarray]:
    """All channels of the first image of a file by name, each (H, W): float32, or uint32 for integer ids in an EXR.

    Colors of files of 8 or 16 bits come as linear light, as from read_image. Raises InputError as read_image does.
    """
    return linear(openimageio.load(path))


def read_camera(path):
    """The camera that write_image stored with an image, equal to the one written; None if the file has none.

    A RayMap comes back as float32 holds it. Raises InputError if the file is not a readable image, or if what it says
    about its camera cannot be understood.
    """
    text = openimageio.load_attribute(path, CAMERA_ATTRIBUTE)
    if text is None:
        return None
    from mpcam.cameras.serialize import camera_from_json

    try:
        if is_ray_header(str(text)):
            return ray_map_of(path, openimageio.load(path).planes, str(text))
        return camera_from_json(str(text))
    except InputError as error:
        raise InputError(f"{path}: attribute {CAMERA_ATTRIBUTE}: {error}") from None


def _listed(names) -> str:
    return ", ".join(sorted(names))


def _floats(path, what: str, value) -> np.ndarray:
    try:
        array = np.asarray(value)
    except ValueError:
        raise InputError(f"{path}: {what} has rows of different lengths: give a rectangular array") from None
    if array.dtype.kind != "f":
        raise InputError(f"{path}: {what} has type {array.dtype}: give floats of linear light (bytes are not)")
    return array


def _pixels(path, image) -> np.ndarray:
    array = _floats(path, "image", image)
    if array.ndim == 2:
        array = array[..., None]
    if array.ndim != 3 or array.shape[2] not in COLOR_NAMES or array.size == 0:
        raise InputError(
            f"{path}: image has shape {np.shape(image)}: give (H, W), (H, W, 1), (H, W, 3) or (H, W, 4), at least 1x1"
        )
    return _single(path, "image", array)


def _plane(path, what: str, value, shape: tuple[int, int]) -> np.ndarray:
    array = np.asarray(value)
    if array.shape != shape:
        raise InputError(f"{path}: {what} has shape {array.shape}: give {shape}, the height and width of the image")
    if array.dtype.kind in "iub":
        if array.size and max(int(array.max()), -int(array.min())) > 2**24:
            raise InputError(
                f"{path}: {what} has integers beyond 2**24, which float32 rounds: split it in two channels"
            )
        return array.astype(np.float32)
    return _single(path, what, _floats(path, what, array))


def _single(path, what: str, array: np.ndarray) -> np.ndarray:
    _refuse_overflow(path, what, array, np.float32)
    return array.astype(np.float32)


def _refuse_overflow(path, what: str, array: np.ndarray, kind) -> None:
    """InputError if finite numbers would become infinite: infinity says no hit, so it is not invented."""
    if array.dtype.itemsize <= np.dtype(kind).itemsize:
        return
    with np.errstate(over="ignore"):
        lost = np.count_nonzero(np.isfinite(array) & ~np.isfinite(array.astype(kind)))
    if lost:
        largest = float(np.finfo(kind).max)
        raise InputError(
            f"{path}: {what} has {lost} finite values beyond {largest:g}, the {np.dtype(kind)} limit: scale it"
        )


def _named_channels(path, channels, depth, rays) -> dict[str, Any]:
    if not isinstance(channels, dict):
        raise InputError(
            f"{path}: channels is a {type(channels).__name__}: give a dict of (H, W) arrays by channel name"
        )
    if depth is not None and DEPTH_CHANNEL in channels:
        raise InputError(f"{path}: depth and channels both give {DEPTH_CHANNEL}: give one of them")
    twice = sorted(channels.keys() & rays.keys())
    if twice:
        raise InputError(f"{path}: channels and the rays of the camera both give {twice[0]}: choose another name")
    return channels


def _check_channel_name(path, name, taken) -> None:
    # 255 bytes is the limit of the EXR format
    if not isinstance(name, str) or not name.isprintable() or not 1 <= len(name.encode()) <= 255:
        raise InputError(f"{path}: channel name {name!r:.60}: give 1 to 255 printable characters")
    if name in taken or name in ("R", "G", "B", "A", "Y"):
        raise InputError(f"{path}: channel name {name!r} is kept for the image's own colors: choose another")


def _camera_attributes(path, camera, width: int, height: int) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """What the header says of a camera, and the channels that it needs beside."""
    from mpcam.cameras.ray_map import RayMap
    from mpcam.cameras.serialize import camera_to_json, can_be_written

    if (camera.width, camera.height) != (width, height):
        raise InputError(
            f"{path}: the camera is {camera.width}x{camera.height} pixels, the image {width}x{height}: "
            "give the camera that made the image"
        )
    if not isinstance(camera, RayMap) and not can_be_written(camera):
        camera = RayMap.of(camera)
    rays = ray_channels(path, camera) if isinstance(camera, RayMap) else {}
    attributes: dict[str, Any] = {CAMERA_ATTRIBUTE: ray_header(camera) if rays else camera_to_json(camera)}
    pose = getattr(camera, "camera_from_world", None)
    if pose is not None:
        # EXR matrices act on row vectors from the right (Imath): point_camera = point_world @ M
        attributes["worldToCamera"] = np.asarray(pose, dtype=np.float64).T
    return attributes, rays
