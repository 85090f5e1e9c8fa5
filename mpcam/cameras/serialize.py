"""Cameras as plain dictionaries and JSON, for image headers and scene files; a round trip gives an equal camera."""

import json
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera, given_fields
from mpcam.cameras.brown_conrady import BrownConrady
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.cameras.double_sphere import DoubleSphere
from mpcam.cameras.kannala_brandt import KannalaBrandt
from mpcam.cameras.orthographic import Orthographic
from mpcam.cameras.pinhole import Pinhole
from mpcam.cameras.profiles import PROFILES, Profile
from mpcam.cameras.radial import Radial
from mpcam.cameras.unified_omni import UnifiedOmni
from mpcam.errors import InputError

SCHEMA = 1

MODELS: dict[str, type[Camera]] = {
    model.__name__: model
    for model in (
        Pinhole,
        Orthographic,
        Radial,
        KannalaBrandt,
        DoubleSphere,
        UnifiedOmni,
        BrownConrady,
        CameraTriangles,
    )
}


def camera_to_dict(camera: Camera) -> dict[str, Any]:
    """Model name, schema version and every field, as numbers, strings and nested lists.

    Raises InputError for a camera whose profile is a user's own function, which no file can hold.
    """
    result: dict[str, Any] = {"schema": SCHEMA, "model": type(camera).__name__}
    for name in given_fields(camera):
        value = getattr(camera, name)
        if isinstance(value, Profile):
            if PROFILES.get(value.name) is not value:
                raise InputError(
                    f"a camera with the custom profile {value.name!r} cannot be written: only "
                    f"{', '.join(PROFILES)} can; keep its function in your program"
                )
            value = value.name
        elif hasattr(value, "shape"):
            table = np.asarray(value)
            value = (table if table.dtype.kind in "iu" else table.astype(np.float64)).tolist()
        elif isinstance(value, tuple):
            value = [float(number) for number in value]
        result[name] = value
    return result


def camera_from_dict(data: dict[str, Any]) -> Camera:
    """The camera that `camera_to_dict` described; raises InputError for unknown models, schemas and fields."""
    fields = dict(data)
    schema, name = fields.pop("schema", SCHEMA), fields.pop("model", None)
    if schema != SCHEMA:
        raise InputError(f"camera has schema {schema!r}: this version reads schema {SCHEMA}")
    if not isinstance(name, str) or name not in MODELS:
        raise InputError(f"camera model {name!r} is unknown: allowed are {', '.join(MODELS)}")
    model = MODELS[name]
    known = set(given_fields(model))
    unknown = sorted(set(fields) - known)
    if unknown:
        raise InputError(f"camera model {name} has no field {unknown[0]!r}: allowed are {', '.join(sorted(known))}")
    try:
        return model(**fields)
    except TypeError as error:
        raise InputError(f"camera model {name}: {error}") from None


def camera_to_json(camera: Camera) -> str:
    """`camera_to_dict` as one line of JSON; numbers keep all their digits."""
    return json.dumps(camera_to_dict(camera), allow_nan=False)


def camera_from_json(text: str) -> Camera:
    """The camera in a line of JSON; raises InputError where the text is none."""
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise InputError(f"camera is not JSON ({error}): give what camera_to_json writes") from None
    if not isinstance(data, dict):
        raise InputError(f"camera is a JSON {type(data).__name__}: an object with the key 'model' is needed")
    return camera_from_dict(data)
