"""What the fields of a camera may be: plain numbers within limits, where arrays of JAX and Dr.Jit pass unchecked.

Constructors, tables of scene files and messages all read the limits from here:

    xi: Annotated[Any, Limits(above=-1)]   # one number
    k: Annotated[Any, tuple[float, float]] # what a file holds for it
"""

import dataclasses
import functools
import math
from collections.abc import Callable
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints


@dataclasses.dataclass(frozen=True)
class Limits:
    """The finite numbers from or above one end, up to or below another; None leaves that end open."""

    above: float | None = None
    below: float | None = None
    at_least: float | None = None
    at_most: float | None = None

    def allow(self, number: float) -> bool:
        """Whether a number lies within the limits; NaN and infinity never do."""
        return (
            math.isfinite(number)
            and (self.above is None or number > self.above)
            and (self.below is None or number < self.below)
            and (self.at_least is None or number >= self.at_least)
            and (self.at_most is None or number <= self.at_most)
        )

    def __str__(self) -> str:
        ends = (("above", self.above), ("from", self.at_least), ("up to", self.at_most), ("below", self.below))
        return " ".join(["a finite number", *(f"{word} {end:g}" for word, end in ends if end is not None)])


Number = Annotated[Any, Limits()]
Positive = Annotated[Any, Limits(above=0)]
Share = Annotated[Any, Limits(at_least=0, at_most=1)]


@functools.cache
def limits_of(model: type) -> dict[str, Limits]:
    """Limits of the fields of a model that are numbers with limits, by name."""
    hints = get_type_hints(model, include_extras=True)
    found = {name: kind.__metadata__[0] for name, kind in hints.items() if get_origin(kind) is Annotated}
    return {name: limits for name, limits in found.items() if isinstance(limits, Limits)}


def plain_type(kind: Any) -> Any:
    """The type of the plain values that a field of this type may have, limits kept.

    Any, like all that is no plain value, stands for a number, a text or a list of numbers.
    """
    if get_origin(kind) is Annotated:
        base, first = get_args(kind)[:2]
        if not isinstance(first, Limits):
            return plain_type(first if base is Any else base)
        return Annotated[float if base is Any else base, first]
    if get_origin(kind) is tuple and get_args(kind)[-1] is ...:
        return list[plain_type(get_args(kind)[0])]
    if get_origin(kind) is Literal or kind in (bool, int, float, str, NoneType):
        return kind
    if dataclasses.is_dataclass(kind):  # a table
        return kind
    parts = with_parts(kind, plain_type)
    return float | str | list[float] if parts is kind else parts


def with_parts(kind: Any, change: Callable[[Any], Any]) -> Any:
    """A tuple, list or union type with each of its parts changed; other types as they are."""
    if get_origin(kind) in (tuple, list):
        return get_origin(kind)[tuple(map(change, get_args(kind)))]
    if get_origin(kind) in (Union, UnionType):
        return Union[tuple(map(change, get_args(kind)))]  # noqa: UP007  (made of what is only known here)
    return kind
