"""How a scene's surfaces keep ambient light from each other in pictures."""

import math
from dataclasses import dataclass

from mpcam.checks import is_number, shown, whole_number
from mpcam.errors import InputError

FALLOFFS = ("quadratic", "linear", "none")
MOST_LINES = 1024


@dataclass(frozen=True)
class Occlusion:
    """Ambient occlusion of pictures by pinhole cameras, from their own depths; see `screen_occlusion` for the fields.

    Raises InputError for numbers out of range.
    """

    radius: float
    thickness: float | None = None
    directions: int = 6
    steps: int = 6
    falloff: str = "quadratic"
    bias: float = 0.05
    blur: int = 21

    def __post_init__(self):
        checked_lengths(self.radius, self.falloff)
        checked_thickness(self.thickness)
        whole_number("directions", self.directions, 1, MOST_LINES)
        whole_number("steps", self.steps, 1, MOST_LINES)
        if not is_number(self.bias) or not 0 <= self.bias < 0.5 * math.pi:
            raise InputError(f"bias={shown(self.bias)}: radians from 0 to below pi / 2 are needed")
        if whole_number("blur", self.blur, 1, 255, unit="pixels") % 2 == 0:
            raise InputError(f"blur={self.blur}: an odd number of pixels is needed, so that it has a middle")


def checked_lengths(radius: float, falloff: str) -> float:
    """The radius, where it and the falloff are what they should be."""
    if not (is_number(radius) and radius > 0) and not (isinstance(radius, float) and radius == math.inf):
        raise InputError(f"radius={shown(radius)}: give a length above 0 in scene units, or math.inf")
    if falloff not in FALLOFFS:
        raise InputError(f"falloff={shown(falloff)}: allowed are {', '.join(FALLOFFS)}")
    if falloff != "none" and radius == math.inf:
        raise InputError(f"falloff={falloff!r} needs a radius that is not infinite: give one, or falloff='none'")
    return float(radius)


def checked_thickness(thickness: float | None) -> float | None:
    """The thickness, where it is a length or None."""
    if thickness is not None and (not is_number(thickness) or thickness <= 0):
        raise InputError(f"thickness={shown(thickness)}: give a length above 0 in scene units, or None for no end")
    return thickness
