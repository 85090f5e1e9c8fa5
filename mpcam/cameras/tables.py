"""Cameras as flat tables of plain values, as people write them into scene files: degrees, `focal`, `center`.

The keys of a model come from its dataclass fields; a model that is written in another way says so by a classmethod
`from_table`, whose parameters are its keys, and by `to_table` where that does not follow from the fields. What all
cameras have is not among them: the size, which comes first, and the pose.
"""

import dataclasses
import inspect
import math
from collections.abc import Mapping
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from mpcam.cameras.fields import Limits, plain_type
from mpcam.cameras.profiles import PROFILES, Profile
from mpcam.errors import InputError

REQUIRED = inspect.Parameter.empty
_FRAME = ("width", "height", "camera_from_world")
_Angle = Annotated[float, Limits(above=0, at_most=360)]


class Key(NamedTuple):
    """A key of a table: the type of its value, and what stands for it where it is missing, or REQUIRED."""

    kind: Any
    default: Any


def fits_a_table(model: type) -> bool:
    """Whether a model is described by a few numbers and a size; others are arrays, kept in files of their own."""
    return {"width", "height"} <= inspect.signature(model).parameters.keys()


def table_keys(model: type) -> dict[str, Key]:
    """Keys of a model's table by name."""
    own = getattr(model, "from_table", None)
    if own is None:
        return _derived(model)
    keys = _keys(own, get_type_hints(own, include_extras=True))
    catches = any(p.kind is p.VAR_KEYWORD for p in inspect.signature(own).parameters.values())
    return ({name: key for name, key in _derived(model).items() if name not in keys} if catches else {}) | keys


def from_table(model: type, width: int, height: int, keys: Mapping[str, Any]) -> Any:
    """The camera with these keys, at the identity pose. Raises InputError, a KeyProblem where one key is at fault."""
    own = getattr(model, "from_table", None)
    return model(**arguments(model, width, height, keys)) if own is None else own(width, height, **keys)


def to_table(camera: Any) -> dict[str, Any]:
    """Numbers, texts and lists by key, from which `from_table` makes an equal camera but for the pose."""
    own = getattr(camera, "to_table", None)
    if own is not None:
        return own()
    parameters = inspect.signature(type(camera)).parameters
    values = {name: plain_value(getattr(camera, name)) for name in parameters if name not in _FRAME}
    for key, names in (("focal", ("fx", "fy")), ("center", ("cx", "cy"))):
        if values.keys() >= set(names):
            values[key] = [values.pop(name) for name in names]
    if "max_angle" in values:
        values["fov"] = degrees(2 * values.pop("max_angle"))
    return {key: value for key, value in values.items() if value is not None}


def arguments(model: type, width: int, height: int, keys: Mapping[str, Any]) -> dict[str, Any]:
    """What a model's constructor takes, from keys that follow from its fields."""
    rest: dict[str, Any] = {name: tuple(value) if isinstance(value, list) else value for name, value in keys.items()}
    parameters = inspect.signature(model).parameters
    found: dict[str, Any] = {"width": width, "height": height}
    if "focal" in rest and "fx" in parameters:
        found["fx"], found["fy"] = rest.pop("focal")
    if "cx" in parameters and "cy" in parameters:
        found["cx"], found["cy"] = rest.pop("center", None) or (0.5 * width, 0.5 * height)
    if "fov" in rest and "max_angle" in parameters:
        found["max_angle"] = math.radians(0.5 * rest.pop("fov"))
    return found | rest


def plain_value(value: Any) -> Any:
    """A field's value as numbers, texts, lists and tables of them; raises InputError for a user's own function."""
    if isinstance(value, Profile):
        if PROFILES.get(value.name) is not value:
            raise InputError(
                f"a camera with the custom profile {value.name!r} cannot be written: only "
                f"{', '.join(PROFILES)} can; keep its function in your program"
            )
        return value.name
    if isinstance(value, (list, tuple)):
        return [plain_value(item) for item in value]
    if dataclasses.is_dataclass(value):
        return {field.name: plain_value(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if hasattr(value, "shape"):
        table = np.asarray(value)
        return (table if table.dtype.kind in "biu" else table.astype(np.float64)).tolist()
    return value


def degrees(angle: float) -> float:
    """The number of degrees that is this many radians, to the bit where there is one."""
    near = math.degrees(angle)
    guesses = (round(near, 9), near, math.nextafter(near, 0), math.nextafter(near, math.inf))
    return min(guesses, key=lambda guess: abs(math.radians(guess) - angle))


def _keys(maker: Any, hints: dict[str, Any]) -> dict[str, Key]:
    """Parameters of a callable as keys."""
    named = [p for p in inspect.signature(maker).parameters.values() if p.kind is not p.VAR_KEYWORD]
    return {p.name: Key(plain_type(hints.get(p.name, Any)), p.default) for p in named if p.name not in _FRAME}


def _derived(model: type) -> dict[str, Key]:
    """The fields of a model as keys: two focal lengths and the center each in one, the domain in degrees."""
    fields = _keys(model, get_type_hints(model, include_extras=True))
    keys: dict[str, Key] = {}
    if fields.keys() >= {"fx", "fy"}:
        kind, default = fields.pop("fx")
        keys["focal"] = Key(tuple[kind, fields.pop("fy").kind], default)
    if fields.keys() >= {"cx", "cy"}:
        keys["center"] = Key(tuple[fields.pop("cx").kind, fields.pop("cy").kind], None)
    if "max_angle" in fields:
        default = fields.pop("max_angle").default
        keys["fov"] = Key(_Angle, default if default is REQUIRED else degrees(2 * default))
    return keys | fields
