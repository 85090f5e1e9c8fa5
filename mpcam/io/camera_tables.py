"""Tables [camera] of scene files: one for each model in the register of cameras, with the keys that the model takes."""

import dataclasses
import functools
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from msgspec import Meta, Struct, defstruct

from mpcam.cameras.base import Camera
from mpcam.cameras.fields import Limits, with_parts
from mpcam.cameras.registry import MODELS, snake_case
from mpcam.cameras.tables import REQUIRED, fits_a_table, table_keys
from mpcam.io.scene_tables import Table, Vector

Row = tuple[float, float, float, float]
Pixels = Annotated[int, Meta(ge=1, le=32768)]


class CameraTable(Table, tag_field="model", frozen=True):
    """[camera]: keys of every model. Without a pose, the camera is put where it sees all meshes."""

    size: tuple[Pixels, Pixels] = (512, 512)  # width, height
    eye: Vector | None = None
    target: Vector | None = None
    up: Vector | None = None  # default: +z
    camera_from_world: tuple[Row, Row, Row, Row] | None = None  # instead of eye and target


class CameraFile(Table, frozen=True):
    """[camera] with a file that holds the camera: calibrations of other programs, camera JSON, EXR images."""

    file: str
    name: str | None = None  # which of several
    model: str | None = None  # what it must be
    size: tuple[Pixels, Pixels] | None = None  # width, height; what the file has is resized to it
    pose: list[Row] | Literal["file"] | None = None  # camera_from_world, rounded or without its last row; or the file's
    eye: Vector | None = None
    target: Vector | None = None
    up: Vector | None = None
    camera_from_world: tuple[Row, Row, Row, Row] | None = None


class ArrayTable(Table, tag_field="model", frozen=True):
    """[camera] of models that consist of arrays, for which there are no keys: they need a file, see CameraFile."""

    file: str
    eye: Vector | None = None
    target: Vector | None = None
    up: Vector | None = None
    camera_from_world: tuple[Row, Row, Row, Row] | None = None


@functools.cache
def camera_table(model: type[Camera]) -> type[Struct]:
    """The type of the table of one model."""
    name = snake_case(model.__name__)
    if not fits_a_table(model) and not hasattr(model, "from_table"):
        return defstruct(name, [], bases=(ArrayTable,), tag=name, frozen=True, kw_only=True)
    fields: list[Any] = []
    for key, (kind, default) in table_keys(model).items():
        kind = _limited(kind)
        fields.append((key, kind) if default is REQUIRED else (key, Union[kind, None], default))  # noqa: UP007
    return defstruct(name, fields, bases=(CameraTable,), tag=name, frozen=True, kw_only=True)


def any_camera_table() -> Any:
    """The type of a table of any model that is registered by now."""
    return Union[tuple(map(camera_table, MODELS.values()))]  # noqa: UP007


def model_of(table: CameraTable) -> type[Camera]:
    """The model that a table describes."""
    return next(model for model in MODELS.values() if isinstance(table, camera_table(model)))


def _limited(kind: Any) -> Any:
    """A type with its Limits as msgspec has them."""
    if get_origin(kind) is Annotated:
        base, ends = get_args(kind)[:2]
        if not isinstance(ends, Limits) or ends == Limits():
            return base
        limits: Any = {"gt": ends.above, "lt": ends.below, "ge": ends.at_least, "le": ends.at_most}
        return Annotated[base, Meta(**limits)]
    return _table(kind) if dataclasses.is_dataclass(kind) else with_parts(kind, _limited)


@functools.cache
def _table(kind: Any) -> type[Struct]:
    """The type of a table within a camera's, from a dataclass with its keys."""
    hints, fields = get_type_hints(kind, include_extras=True), []
    for field in dataclasses.fields(kind):
        given = _limited(hints[field.name])
        fields.append(
            (field.name, given) if field.default is dataclasses.MISSING else (field.name, given, field.default)
        )
    return defstruct(kind.__name__, fields, bases=(Table,), frozen=True, kw_only=True)
