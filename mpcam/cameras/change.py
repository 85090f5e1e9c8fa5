"""The same view by another camera: another size of image, another projection."""

import dataclasses
from typing import Any

from mpcam.cameras.base import Camera
from mpcam.cameras.pinhole import Pinhole
from mpcam.cameras.profiles import PROFILES
from mpcam.cameras.radial import Radial
from mpcam.errors import InputError

PROJECTIONS = (*PROFILES, "pinhole")
_LENGTHS = ("fx", "fy", "radius", "scale", "shift_near", "shift_far")
_CENTER = {"cx": "width", "cy": "height"}


def resized(camera: Any, width: int, height: int) -> Any:
    """The camera with an image of width x height pixels: what filled the shorter side still fills it, centers stay put.

    Panoramas keep their ranges of angles. Raises InputError for sizes below 1 pixel, and for camera models that do not
    say what of them is measured in pixels.
    """
    names = {field.name for field in dataclasses.fields(camera)}
    lengths = [name for name in _LENGTHS if name in names]
    if not lengths and "longitude" not in names:
        raise InputError(f"a {type(camera).__name__} has the size that it was made with: leave out the size")
    factor = min(width, height) / min(camera.width, camera.height)
    changes: dict[str, Any] = {"width": width, "height": height}
    changes |= {name: factor * getattr(camera, name) for name in lengths}

    def moved(place: Any, side: str) -> Any:
        return 0.5 * changes[side] + factor * (place - 0.5 * getattr(camera, side))

    changes |= {name: moved(getattr(camera, name), _CENTER[name]) for name in names & _CENTER.keys()}
    if "pole" in names:
        changes["pole"] = tuple(map(moved, camera.pole, _CENTER.values()))
    return dataclasses.replace(camera, **changes)


def projected(camera: Any, projection: str) -> Camera:
    """A camera with the size and pose of another: 180 degrees across the inscribed circle, or a pinhole with 90 across.

    projection: one of PROJECTIONS. Raises InputError for other names.
    """
    if projection == "pinhole":
        return Pinhole(camera.width, camera.height, camera_from_world=camera.camera_from_world)
    if projection not in PROFILES:
        raise InputError(f"projection {projection!r} is unknown: allowed are {', '.join(PROJECTIONS)}")
    return Radial(camera.width, camera.height, PROFILES[projection], camera.camera_from_world)
