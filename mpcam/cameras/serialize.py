"""Cameras as plain dictionaries and JSON, for image headers and scene files; a round trip gives an equal camera."""

import json
from typing import Any

from mpcam.cameras.base import Camera, given_fields
from mpcam.cameras.registry import MODELS, is_registered
from mpcam.cameras.tables import plain_value
from mpcam.errors import InputError

SCHEMA = 1


def camera_to_dict(camera: Camera) -> dict[str, Any]:
    """Model name, schema version and every field, as numbers, strings and nested lists.

    Raises InputError for a camera whose class is not in the register, or whose profile is a user's own function: no
    file can hold them. So it does for ray maps that are too large for text.
    """
    name = type(camera).__name__
    if not is_registered(camera):
        raise InputError(
            f"a {name} cannot be written: the register of cameras has {', '.join(MODELS)}; "
            f"add yours, mpcam.cameras.MODELS[{name!r}] = {name}, or keep it in your program"
        )
    camera._check_text()
    fields = {field: plain_value(getattr(camera, field)) for field in given_fields(camera)}
    return {"schema": SCHEMA, "model": name, **fields}


def can_be_written(camera: Camera) -> bool:
    """Whether `camera_to_dict` takes a camera."""
    try:
        camera_to_dict(camera)
    except InputError:
        return False
    return True


def camera_from_dict(data: dict[str, Any]) -> Camera:
    """The camera that `camera_to_dict` described: lists of numbers come back as the tuples that fields hold.

    Raises InputError for unknown models, schemas and fields.
    """
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
    fields = {key: tuple(value) if _numbers(value) else value for key, value in fields.items()}
    try:
        return model(**fields)
    except TypeError as error:
        raise InputError(f"camera model {name}: {error}") from None


def _numbers(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, (int, float)) for item in value)


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
