"""Portals: the faces at which the rays of a graph camera pass from one frustum into the next."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from mpcam.cameras.base import register_later
from mpcam.checks import number_table, shown, three_numbers
from mpcam.errors import InputError
from mpcam.math import Array, library


@dataclasses.dataclass(frozen=True, eq=False)
class Portal:
    """A face between two frusta of a `GraphCamera`, and the frustum behind it.

    polygon (n, 3): its corners in order, n >= 3, planar and convex, in the world. center (3,): where the rays behind it
    come from: one that crosses the face at a point goes on along point - center. parent: number of the portal whose
    frustum this one leaves, in the order of the list; -1: the root's. into: instead of a center, the number of another
    portal, into whose frustum this one leads as well (a merge). ends: where the frustum ends besides at the portals
    that leave it: a box with sides along the axes, as two opposite corners (2, 3); or planes (m, 4), of which
    n . x + o <= 0 holds inside. Without ends it may reach to infinity.

    Raises InputError for shapes that do not fit, numbers that are not finite, and for both or none of center and into.
    """

    polygon: Any
    center: Any = None
    parent: int = -1
    into: int | None = None
    ends: Any = None

    static_fields: ClassVar[tuple[str, ...]] = ("parent", "into")

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "polygon", _polygon(self.polygon))
        if (self.center is None) == (self.into is None):
            raise InputError("Portal: give center, or into with the number of another portal; not both, nor neither")
        if self.center is not None and library(self.center) == "numpy" and type(self.center) is not object:
            set_(self, "center", _fixed(three_numbers("Portal: center", self.center)))
        for name in ("parent", "into"):
            value = getattr(self, name)
            if value is not None:
                set_(self, name, _number(name, value))
        if self.ends is not None:
            if self.into is not None:
                raise InputError("Portal: ends belong to the frustum of the portal that into names: give them there")
            set_(self, "ends", checked_ends(self.ends, "Portal: ends"))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Portal) and all(
            np.array_equal(getattr(self, field.name), getattr(other, field.name)) for field in dataclasses.fields(self)
        )

    __hash__ = None  # pyright: ignore[reportAssignmentType]


register_later(Portal)


def checked_portals(given: Any) -> tuple[Portal, ...]:
    """Portals, or mappings with their fields, as a tuple; raises InputError with the number of the one at fault."""
    if isinstance(given, (Portal, Mapping)) or not isinstance(given, Sequence):
        raise InputError(f"GraphCamera: portals={shown(given)}: give a list of mpcam.Portal")
    found = []
    for number, one in enumerate(given):
        try:
            found.append(Portal(**one) if isinstance(one, Mapping) else one)
        except (InputError, TypeError) as error:
            text = str(error).removeprefix("Portal.__init__() ").removeprefix("Portal: ")
            raise InputError(f"GraphCamera: portal {number}: {text}") from None
        if not isinstance(found[-1], Portal):
            raise InputError(f"GraphCamera: portal {number} is a {type(one).__name__}: give an mpcam.Portal")
    return tuple(found)


def checked_ends(value: Any, name: str) -> Any:
    """A box (2, 3) or planes (m, 4) of finite numbers, normals not zero; other libraries' arrays pass."""
    if library(value) != "numpy" or type(value) is object:
        return value
    found = number_table(value)
    box, planes = found.shape == (2, 3), found.ndim == 2 and found.shape[1:] == (4,)
    if not (box or planes) or not np.isfinite(found).all():
        raise InputError(
            f"{name}={shown(value)}: give two opposite corners of a box (2, 3), or planes (m, 4), finite numbers"
        )
    if box and (found[0] == found[1]).any():
        raise InputError(f"{name}={shown(value)}: the box is flat: give two opposite corners that differ in x, y and z")
    if planes and (found[:, :3] == 0).all(axis=1).any():
        raise InputError(f"{name}={shown(value)}: a plane has no normal: give (n, o) with n . x + o <= 0 inside")
    return _fixed(found)


def end_planes(x: Any, ends: Array) -> list[Array]:
    """Rows (n, o) of a box or of planes, with x, the array library (numpy or jax.numpy); n as long as given."""
    if ends is None:
        return []
    table = x.asarray(ends)
    if table.shape[1] == 4:
        return list(table)
    low, high = x.minimum(table[0], table[1]), x.maximum(table[0], table[1])
    ahead = np.eye(3)
    lows = [x.append(-ahead[axis], low[axis]) for axis in range(3)]
    return lows + [x.append(ahead[axis], -high[axis]) for axis in range(3)]


def _polygon(value: Any) -> Any:
    """A read-only table of finite numbers; other libraries' arrays pass."""
    if library(value) != "numpy" or type(value) is object:
        return value
    found = number_table(value)
    if found.ndim != 2 or found.shape[-1] != 3 or len(found) < 3 or not np.isfinite(found).all():
        raise InputError(f"Portal: polygon={shown(value)}: give three corners or more, (n, 3), finite numbers")
    return _fixed(found)


def _number(name: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise InputError(f"Portal: {name}={shown(value)}: give the number of a portal in the list")
    return int(value)


def _fixed(table: np.ndarray) -> np.ndarray:
    table.flags.writeable = False
    return table
