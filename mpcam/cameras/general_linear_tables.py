"""General linear cameras in scene files: by kind with the numbers that a person has, or by their rays."""

import inspect
import math
from typing import Annotated, Any, ClassVar, Literal, Self

from mpcam.cameras.fields import Limits, Number, Positive
from mpcam.cameras.general_linear_kinds import KINDS as ALL_KINDS
from mpcam.errors import KeyProblem
from mpcam.math import PI

Generator = tuple[float, float, float, float]
Place = tuple[float, float]
Point = tuple[float, float, float]
Slit = tuple[Point, Point]
KINDS = tuple(kind for kind in ALL_KINDS if kind != "not a camera")
_CROSSED = ("slits", "look", "extent", "top")


class LinearTable:
    """The keys of `GeneralLinear`."""

    placed_by: ClassVar[tuple[str, ...]] = ("slits",)

    @classmethod
    def from_table(
        cls,
        width: int,
        height: int,
        kind: Literal[KINDS] | None = None,  # pyright: ignore[reportInvalidTypeForm]
        rays: tuple[Generator, Generator, Generator] | None = None,
        image: tuple[Place, Place, Place] | None = None,
        focal: Positive | None = None,
        scale: Positive | None = None,
        step: Number | None = None,
        slide: Number | None = None,
        twist: Number | None = None,
        spread: Number | None = None,
        center: Place | None = None,
        slits: tuple[Slit, Slit] | None = None,
        look: Point | None = None,
        extent: Positive | None = None,
        top: Point | None = None,
    ) -> Self:
        """`kind` and what its constructor takes, or `rays` and `image`.

        Of crossed slits: `slits`, each a point and a direction in the world; `look`, the point in the middle of the
        image; `extent`, the width that is seen there; `top`, the direction that is up. They place the camera.
        """
        given = {key: value for key, value in locals().items() if key not in ("cls", "width", "height", "kind")}
        given = {key: value for key, value in given.items() if value is not None}
        if kind is None:
            if rays is None:
                raise KeyProblem("kind", f"give kind ({', '.join(KINDS)}), or rays")
            _only(given, ("rays", "image"), "without kind")
            return cls(rays, width, height, image)  # pyright: ignore[reportCallIssue]
        make = getattr(cls, kind)
        if kind == "cross_slit":
            _only(given, _CROSSED, kind)
            for key in _CROSSED[:3]:
                if key not in given:
                    raise KeyProblem(key, f"kind cross_slit needs {', '.join(_CROSSED[:3])}")
            return make(width, height, *given["slits"], look, extent, top or (0.0, 0.0, 1.0))
        names = inspect.signature(make).parameters
        if center is not None:
            given["cx"], given["cy"] = given.pop("center")
        if "fx" in names and focal is not None:
            given["fx"] = given.pop("focal")
        allowed = [{"cx": "center", "fx": "focal"}.get(name, name) for name in names]
        _only({key: value for key, value in given.items() if key not in ("cx", "cy", "fx")}, allowed, kind)
        for key, parameter in names.items():
            if parameter.default is parameter.empty and key not in ("width", "height", *given):
                raise KeyProblem(key, f"kind {kind} needs it")
        return make(width, height, **given)

    def to_table(self) -> dict[str, Any]:
        """The keys that `from_table` takes, but for width and height."""
        from mpcam.cameras.tables import plain_value

        found = {"rays": plain_value(self.rays)}  # pyright: ignore[reportAttributeAccessIssue]
        image = self.image  # pyright: ignore[reportAttributeAccessIssue]
        return found if image is None else found | {"image": plain_value(image)}


class PiecewiseTable:
    """The keys of `GeneralLinears`: a panorama around an axis, or slits along a path."""

    placed_by: ClassVar[tuple[str, ...]] = ("center", "path", "slits", "radius")

    @classmethod
    def from_table(
        cls,
        width: int,
        height: int,
        center: Point | None = None,
        radius: Positive | None = None,
        extent: Positive | None = None,
        pieces: int | None = None,
        turn: tuple[float, float] | None = None,
        outward: bool | None = None,
        path: list[Point] | None = None,
        slits: list[Point] | None = None,
        slope: tuple[float, float] | None = None,
        away: bool | None = None,
        columns: list[Annotated[int, Limits(at_least=1)]] | None = None,
        top: Point | None = None,
    ) -> Self:
        """`center`, `radius` and `extent` of `GeneralLinears.around`, turn in degrees; or `path` and `slits` of
        `GeneralLinears.along_path`. `top`: the direction that is up. The world is their frame."""
        given = {key: value for key, value in locals().items() if key not in ("cls", "width", "height", "top")}
        given = {key: value for key, value in given.items() if value is not None}
        up = {} if top is None else {"up": top}
        needed, optional = ("center", "radius", "extent"), ("pieces", "turn", "outward")
        way = "around a center"
        if path is not None:
            needed, optional, way = ("path", "slits"), ("slope", "away", "columns"), "along a path"
        elif center is None:
            raise KeyProblem("center", "give center, radius and extent, or path and slits")
        _only(given, (*needed, *optional), way)
        for key in needed:
            if key not in given:
                raise KeyProblem(key, f"a camera {way} needs {', '.join(needed)}")
        if turn is not None:
            given["turn"] = tuple(2 * PI if end == 360.0 else math.radians(end) for end in turn)
        first = [given.pop(key) for key in needed]
        if path is not None:
            return cls.along_path(*first, width, height, **given, **up)  # pyright: ignore[reportAttributeAccessIssue]
        return cls.around(*first, width, height, **given, **up)  # pyright: ignore[reportAttributeAccessIssue]


def _only(given: dict[str, Any], allowed: Any, what: str) -> None:
    for key in given:
        if key not in allowed:
            names = [name for name in allowed if name not in ("width", "height", "cy", "fy", "camera_from_world")]
            raise KeyProblem(key, f"does not go with {what}: allowed are {', '.join(names)}")
