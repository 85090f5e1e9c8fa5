"""A thing of glass in a scene: light enters it through one interface and leaves it through a second one."""

from dataclasses import dataclass
from typing import Any, Literal, get_args

from mpcam.checks import is_number, shown, whole_number
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface
from mpcam.scene.mirror import tint_of

Second = Literal["march", "wyman", "trace", "none"]
SECONDS = get_args(Second)
MOST_INNER = 8


@dataclass(frozen=True, eq=False)
class Refractor:
    """A closed surface through which the rest of a scene is seen.

    surface: a Mesh (smooth unless it has facets' normals) or a Surface, closed; its outside is where normals point
    to. index: refractive index of the inside over that of the outside, e.g. 1.5 for glass in air. color: linear RGB,
    what is seen through it is multiplied by it. second: how the interface is found at which rays leave, for the
    methods that do not say otherwise, see `mpcam.Refraction`. inner: how many total reflections inside are followed.
    fresnel: whether the outer surface reflects, by Fresnel's equations. depth_images: settings of method "depth_image"
    (size, aside, images, coarse, fine). Raises InputError for a field of the wrong kind.
    """

    surface: Any
    index: float = 1.5
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    second: Second = "march"
    inner: int = 2
    fresnel: bool = False
    depth_images: Any = None

    def __post_init__(self) -> None:
        if not isinstance(self.surface, (Mesh, Surface)):
            raise InputError(
                f"refractor surface is a {type(self.surface).__name__}: give a Mesh or a Surface, e.g. Surface.sphere()"
            )
        if not is_number(self.index) or self.index <= 0:
            raise InputError(f"refractor index={shown(self.index)}: give a finite number above 0, e.g. 1.5 for glass")
        object.__setattr__(self, "color", tint_of("refractor", self.color))
        check_inside(self.second, self.inner, self.fresnel)


def check_inside(second: Any, inner: Any, fresnel: Any) -> None:
    """See that settings of a refractor's inside are some; raises InputError."""
    if second not in SECONDS:
        raise InputError(f"second={shown(second)}: allowed are {', '.join(SECONDS)}")
    whole_number("inner", inner, 0, MOST_INNER)
    if not isinstance(fresnel, bool):
        raise InputError(f"fresnel={shown(fresnel)}: give True, for the outer surface to reflect, or False")
