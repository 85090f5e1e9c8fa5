"""Ray maps as channels of an EXR: origin.X to origin.Z and direction.X to direction.Z, a ray for each pixel.

The rays are those of the pixels' centers, in the camera frame (OpenCV axes); a direction of zero marks a pixel without
a ray. The header's attribute mpcam:camera holds everything else: the pose, and which channels the rays are in. EXR has
no 64-bit floats: origins and directions are rounded to 24 bits, about 6e-8 of their values.
"""

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from mpcam.errors import InputError

if TYPE_CHECKING:
    from mpcam.cameras.ray_map import RayMap

LAYERS = {"origins": "origin", "directions": "direction"}
"""Prefix of the channels of each field."""


def ray_channels(path: Any, camera: "RayMap") -> dict[str, np.ndarray]:
    """The six channels (H, W) float32 by name; raises InputError where float32 would lose a ray or make it infinite."""
    tables = {name: np.asarray(getattr(camera, name), np.float64) for name in LAYERS}
    with np.errstate(over="ignore", under="ignore"):
        single = {name: table.astype(np.float32) for name, table in tables.items()}
    lost = (single["directions"] == 0).all(-1) & (tables["directions"] != 0).any(-1)
    lost |= ~np.isfinite(np.concatenate(list(single.values()), -1)).all(-1)
    if lost.any():
        raise InputError(
            f"{path}: {np.count_nonzero(lost)} rays are too large or too short for float32: scale the origins and "
            "directions, all directions by one number"
        )
    return {f"{LAYERS[name]}.{axis}": single[name][..., k] for name in LAYERS for k, axis in enumerate("XYZ")}


def ray_header(camera: "RayMap") -> str:
    """The camera as JSON, with the names of its channels in place of the arrays."""
    from mpcam.cameras.serialize import SCHEMA

    pose = np.asarray(camera.camera_from_world, np.float64).tolist()
    fields = {"schema": SCHEMA, "model": "RayMap", **LAYERS, "camera_from_world": pose, "images": camera.images}
    return json.dumps(fields, allow_nan=False)


def is_ray_header(text: str) -> bool:
    """Whether a camera's JSON says that its rays are in channels."""
    try:
        fields = json.loads(text)
    except json.JSONDecodeError:
        return False
    return isinstance(fields, dict) and fields.get("model") == "RayMap" and isinstance(fields.get("origins"), str)


def ray_map_of(path: Any, planes: dict[str, np.ndarray], header: str | None) -> "RayMap":
    """The ray map in the channels of an image; without a header its rays are in the world.

    Raises InputError where a channel is missing, or the header does not describe a ray map.
    """
    from mpcam.cameras.serialize import camera_from_dict

    fields: dict[str, Any] = json.loads(header) if header else {"model": "RayMap", **LAYERS}
    by_name = {name.lower(): plane for name, plane in planes.items()}
    for name in LAYERS:
        wanted = [f"{fields.get(name)}.{axis}" for axis in "XYZ"]
        missing = [channel for channel in wanted if channel.lower() not in by_name]
        if missing:
            raise InputError(
                f"{path}: has no channel {missing[0]}, but {', '.join(sorted(planes))}: a ray map has "
                f"{' and '.join(f'{layer}.X to {layer}.Z' for layer in LAYERS.values())}"
            )
        fields[name] = np.stack([by_name[channel.lower()] for channel in wanted], -1).astype(np.float64)
    return camera_from_dict(fields)  # pyright: ignore[reportReturnType]
