"""Ways to make single-pole occlusion cameras: around an object, from a table of a scene file, and examples."""

import math
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Self

import numpy as np

from mpcam.cameras.fields import Limits, Number, Positive
from mpcam.checks import is_number, three_numbers, whole_number
from mpcam.errors import InputError, KeyProblem
from mpcam.math import library
from mpcam.math.pose import look_at

if TYPE_CHECKING:
    from mpcam.cameras.base import Camera

Point = tuple[float, float, float]
NotNegative = Annotated[Any, Limits(at_least=0)]
_OF_OBJECT = ("around", "radius", "seen_from", "aside", "top")
_BY_NUMBERS = ("focal", "center", "pole", "near", "far", "shift_near", "shift_far")


class PoleMakers:
    """The classmethods of `SinglePoleOcclusion`."""

    placed_by: ClassVar[tuple[str, ...]] = _OF_OBJECT

    @classmethod
    def around(
        cls,
        width: int,
        height: int,
        center: Any,
        radius: float,
        eye: Any,
        aside: float = 1.0,
        *,
        up: Any = (0.0, 0.0, 1.0),
    ) -> Self:
        """A camera that looks from a place at an object, and around it (Rosen et al. 2011, sections 4 and 6.1).

        center (3,), radius: of a sphere that holds the object, scene units. eye (3,): outside of the sphere. aside: how
        far beside the eye the rays of the middle range come from, in radii of the sphere. 0 is a pinhole. 1 shows a
        ball up to its widest circle, exactly the half that faces the eye, and of other objects what lies close behind
        their outline. More shows parts of the back too, and the front with fewer pixels. up (3,): direction towards the
        top of the image.

        The pole is the image of the center, the middle of the picture. The shift grows over the depth of the sphere,
        from 0 at its front. The field of view is the smallest in which the shifted image of the whole sphere has room.
        Raises InputError for an eye within the sphere, and numbers that are negative or not finite.
        """
        place, look = three_numbers("eye", eye), three_numbers("center", center)
        for name, value, least in (("radius", radius, "above 0"), ("aside", aside, "from 0")):
            if not is_number(value) or value < 0 or (name == "radius" and value == 0):
                raise InputError(f"SinglePoleOcclusion.around({name}={value!r}): a finite number {least} is needed")
        distance = float(np.linalg.norm(look - place))
        near, far = distance - radius, distance + radius
        if not near > 0:
            raise InputError(
                f"SinglePoleOcclusion.around: the eye is {distance:g} from the center, within the sphere of radius "
                f"{radius:g}: give an eye outside of it"
            )
        width, height = (whole_number("size", side, 1, of="around", unit="pixels") for side in (width, height))
        # In the plane of the axis and one direction from it rays come from a point beside the eye, and the shift is
        # f beside (1 / near - 1 / z): (x, z) lands at f ((x - beside) / z + beside / near), the largest on the tangent.
        beside = aside * radius
        steepest = math.tan(math.asin(radius / math.hypot(distance, beside)) - math.atan2(beside, distance))
        focal = 0.5 * min(width, height) / (steepest + beside / near)
        shift = focal * beside * (1.0 / near - 1.0 / far)
        frame: tuple[Any, ...] = (width, height, focal, focal, 0.5 * width, 0.5 * height)
        return cls(*frame, near=near, far=far, shift_far=shift, camera_from_world=look_at(place, look, up))  # pyright: ignore[reportCallIssue]

    @classmethod
    def from_table(
        cls,
        width: int,
        height: int,
        focal: tuple[Positive, Positive] | None = None,
        center: tuple[float, float] | None = None,
        pole: tuple[float, float] | None = None,
        near: Positive | None = None,
        far: Positive | None = None,
        shift_near: Number | None = None,
        shift_far: Number | None = None,
        around: Point | None = None,
        radius: Positive | None = None,
        seen_from: Point | None = None,
        aside: NotNegative | None = None,
        top: Point | None = None,
    ) -> Self:
        """`focal`, `near`, `far`, `shift_far` and what else the constructor takes; or the object that it looks at.

        Of the latter: `around` and `radius`, a sphere that holds it; `seen_from`, the eye; `aside`; `top`, the
        direction that is up. They place the camera.
        """
        given = {key: value for key, value in locals().items() if key not in ("cls", "width", "height")}
        given = {key: value for key, value in given.items() if value is not None}
        kind = _OF_OBJECT if "around" in given else _BY_NUMBERS
        for key in given:
            if key not in kind:
                raise KeyProblem(key, f"without around there are only {', '.join(_BY_NUMBERS)}")
        for key in ("radius", "seen_from") if "around" in given else ("focal", "near", "far", "shift_far"):
            if key not in given:
                raise KeyProblem(key, f"give it too, with {', '.join(kind)}")
        if around is not None:
            more = {"aside": aside} if "aside" in given else {}
            return cls.around(width, height, around, radius, seen_from, up=top or (0.0, 0.0, 1.0), **more)  # pyright: ignore[reportArgumentType]
        middle = center or (0.5 * width, 0.5 * height)
        rest = {key: value for key, value in given.items() if key not in ("focal", "center")}
        return cls(width, height, *focal, *middle, **rest)  # pyright: ignore[reportCallIssue]

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> "dict[str, Camera]":
        """A pole beside the center, a disc of pixels that have no ray, a pole outside of the image, and no shift."""

        frame: tuple[Any, ...] = (width, height, 0.6 * width, 0.55 * width, 0.47 * width, 0.52 * height)

        def make(pole: tuple[float, float], near: float, far: float, first: float, last: float) -> Any:
            place, shifts = (
                (pole[0] * width, pole[1] * height),
                {"shift_near": first * width, "shift_far": last * width},
            )
            return cls(*frame, pole=place, near=near, far=far, **shifts, camera_from_world=camera_from_world)  # pyright: ignore[reportCallIssue]

        return {
            "single pole": make((0.58, 0.4), 0.5, 3.0, 0.0, 0.12),
            "single pole, hole": make((0.35, 0.6), 0.4, 1.6, 0.05, 0.25),
            "single pole, outside": make((1.3, -0.2), 0.3, 2.0, 0.1, 0.3),
            "single pole, no shift": make((0.5, 0.5), 0.5, 3.0, 0.0, 0.0),
        }


def a_pole(values: Any) -> tuple[Any, Any]:
    """Two finite numbers, as Python's unless they are another library's."""
    try:
        u, v = (x if library(x) != "numpy" else float(x) for x in values)
        if all(library(x) != "numpy" or math.isfinite(x) for x in (u, v)):
            return u, v
    except (TypeError, ValueError):
        pass
    raise InputError(f"SinglePoleOcclusion(pole={values!r}): give two finite numbers (u, v), pixels")
