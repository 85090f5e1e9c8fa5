"""Single-center cameras with radial symmetry, r = f(theta) (Gascuel et al. 2008)."""

import dataclasses
import math
from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal, Self

from mpcam.cameras.arcs import radial_bound, radial_bound_rough
from mpcam.cameras.base import Camera
from mpcam.cameras.chords import radial_bound_triangles
from mpcam.cameras.fields import Limits, Number, Positive
from mpcam.cameras.outline import Outline, VertexView, small_outline, symmetric_vertex_view
from mpcam.cameras.profiles import COSINE_SPHERE, EQUIDISTANT, EQUISOLID, PARABOLOID, PROFILES, Profile, custom_profile
from mpcam.cameras.quads import radial_bound_quads
from mpcam.cameras.symmetric import finite_pixel, project_centered, symmetric_image, symmetric_ray, within
from mpcam.cameras.tables import degrees, plain_value
from mpcam.cameras.types import Box, Domain, Projection, Ray, RayGeometry
from mpcam.errors import InputError, KeyProblem
from mpcam.math import PI, Array, Vector, library, vector


@dataclasses.dataclass(frozen=True, eq=False)
class Radial(Camera):
    """A ray at angle theta from the axis lands at distance radius * f(theta) / f(fov / 2) from the center.

    width, height: pixels. profile: a `Profile`, the name of a built-in one, or use the constructors `paraboloid`,
    `cosine_sphere`, `equisolid`, `equidistant`, `from_function`. camera_from_world: 4x4, OpenCV axes. fov: full angle
    of view, radians (default pi). radius: pixels from the center to the rim of the view (default: the inscribed
    circle). cx, cy: center, pixels (default: the image center). With fov = pi, the built-in profiles have f = 1 at the
    rim. Pixels outside of the rim are invalid.

    Raises InputError for sizes below 1, a field of view that the profile cannot reach, unknown profiles, and poses that
    are not rigid.
    """

    width: int
    height: int
    profile: Any
    camera_from_world: Any = None
    fov: Positive = PI
    radius: Positive = None
    cx: Number = None
    cy: Number = None

    ray_geometry: ClassVar[RayGeometry] = "central"
    static_fields: ClassVar[tuple[str, ...]] = ("width", "height", "profile")

    def __post_init__(self) -> None:
        self._check_frame()
        if isinstance(self.profile, str):
            if self.profile not in PROFILES:
                raise InputError(f"Radial(profile={self.profile!r}): allowed are {', '.join(PROFILES)}")
            object.__setattr__(self, "profile", PROFILES[self.profile])
        if not isinstance(self.profile, Profile):
            raise InputError(f"Radial(profile={self.profile!r}): give a Profile, a name, or use Radial.from_function")
        defaults = {"radius": 0.5 * min(self.width, self.height), "cx": 0.5 * self.width, "cy": 0.5 * self.height}
        for name, default in defaults.items():
            if getattr(self, name) is None:
                object.__setattr__(self, name, default)
        self._check_numbers()
        limit = 2 * self.profile.limit
        if library(self.fov) == "numpy" and (
            self.fov > limit * (1 + 1e-12) or (self.fov >= limit and not self.profile.limit_included)
        ):
            end = "up to" if self.profile.limit_included else "below"
            raise InputError(
                f"Radial(fov={self.fov:.6g}): the {self.profile.name} profile reaches fields of view "
                f"{end} {limit:.6g} rad"
            )

    @classmethod
    def paraboloid(cls, width: int, height: int, camera_from_world: Any = None, fov: float = PI, **rest: Any) -> Self:
        """r = tan(theta / 2), stereographic: keeps angles; fields of view below 360 degrees."""
        return cls(width, height, PARABOLOID, camera_from_world, fov, **rest)

    @classmethod
    def cosine_sphere(
        cls, width: int, height: int, camera_from_world: Any = None, fov: float = PI, **rest: Any
    ) -> Self:
        """r = sin(theta): image area is solid angle times cosine; fields of view up to 180 degrees."""
        return cls(width, height, COSINE_SPHERE, camera_from_world, fov, **rest)

    @classmethod
    def equisolid(cls, width: int, height: int, camera_from_world: Any = None, fov: float = PI, **rest: Any) -> Self:
        """r = sqrt(2) sin(theta / 2), Lambert's equal-area projection; fields of view up to 360 degrees."""
        return cls(width, height, EQUISOLID, camera_from_world, fov, **rest)

    @classmethod
    def equidistant(cls, width: int, height: int, camera_from_world: Any = None, fov: float = PI, **rest: Any) -> Self:
        """r = 2 theta / pi; fields of view up to 360 degrees."""
        return cls(width, height, EQUIDISTANT, camera_from_world, fov, **rest)

    @classmethod
    def from_function(
        cls,
        width: int,
        height: int,
        function: Callable[[Array], Array],
        camera_from_world: Any = None,
        fov: float = PI,
        *,
        slope: Callable[[Array], Array] | None = None,
        angle: Callable[[Array], Array] | None = None,
        name: str = "custom",
        **rest: Any,
    ) -> Self:
        """A user's own r = function(theta), on [0, fov / 2]; see `custom_profile` for what is checked."""
        profile = custom_profile(function, 0.5 * fov, slope=slope, angle=angle, name=name)
        return cls(width, height, profile, camera_from_world, fov, **rest)

    @classmethod
    def from_table(
        cls,
        width: int,
        height: int,
        projection: Literal["paraboloid", "cosine_sphere", "equisolid", "equidistant"] = "paraboloid",
        fov: Annotated[float, Limits(above=0, at_most=360)] = 180.0,
        radius: Positive | None = None,
        center: tuple[float, float] | None = None,
    ) -> Self:
        """From the keys of a scene file: `projection` is the profile's name, `fov` in degrees."""
        profile = PROFILES[projection]
        limit = 2 * math.degrees(profile.limit)
        if fov > limit or (fov == limit and not profile.limit_included):
            end = "up to" if profile.limit_included else "below"
            raise KeyProblem("fov", f"the projection {projection} reaches {end} {limit:g} degrees")
        cx, cy = center or (None, None)
        return cls(width, height, profile, fov=math.radians(fov), radius=radius, cx=cx, cy=cy)

    def to_table(self) -> dict[str, Any]:
        """The keys that `from_table` takes, but for width and height."""
        name = plain_value(self.profile)
        rest = {"radius": float(self.radius), "center": [float(self.cx), float(self.cy)]}
        return {"projection": name, "fov": degrees(float(self.fov)), **rest}

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Camera]:
        """All profiles at 180 degrees, a narrow view, and three beyond the horizon, one of all directions."""
        pose = camera_from_world
        return {
            "paraboloid": cls.paraboloid(width, height, pose),
            "cosine_sphere": cls.cosine_sphere(width, height, pose),
            "equisolid": cls.equisolid(width, height, pose),
            "equidistant": cls.equidistant(width, height, pose),
            "narrow": cls.equidistant(width, height, pose, fov=1.2),
            "paraboloid 270": cls.paraboloid(width, height, pose, fov=1.5 * PI),
            "equidistant 270": cls.equidistant(width, height, pose, fov=1.5 * PI),
            "equisolid 360": cls.equisolid(width, height, pose, fov=2 * PI),
        }

    @property
    def domain(self) -> Domain:
        """Half the field of view, and the radius of the image circle in pixels."""
        return Domain(0.5 * self.fov, self.radius)

    @property
    def pixels_per_radius(self) -> Array:
        """Pixels per unit of f."""
        return self.radius / self.profile.radius(0.5 * self.fov)

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame; valid up to the rim."""
        scale = self.pixels_per_radius
        u, v, valid = finite_pixel(pixel)
        return symmetric_ray(self.profile, (u - self.cx) / scale, (v - self.cy) / scale, self.radius / scale, valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Image of a point in the camera frame; valid up to the rim, not at the camera's center."""
        return (project_centered(self, point),)

    def local_image(self, point: Vector) -> tuple[Vector, Array]:
        """Pixel of a point, also beyond the rim as far as f goes on, and whether it lies within the field of view."""
        x, y, theta = symmetric_image(self.profile, point)
        scale = self.pixels_per_radius
        return vector(self.cx + scale * x, self.cy + scale * y), within(theta, 0.5 * self.fov)

    def local_bound(self, a: Vector, b: Vector, c: Vector) -> Box:
        """Box of the curved triangle, exact to about 0.01 pixel (annular sectors for profiles that are not convex)."""
        return radial_bound(self, a, b, c)

    def local_bound_quads(self, a: Vector, b: Vector, c: Vector) -> Box:
        """Box of the quads around the curved edges: the paper's looser bound, for comparison."""
        return radial_bound_quads(self, a, b, c)

    def local_bound_triangles(self, a: Vector, b: Vector, c: Vector) -> list[Outline]:
        """The paper's bounding triangles: four pieces, each valid or not, whose union holds the curved triangle."""
        return radial_bound_triangles(self, a, b, c)

    def local_vertex_view(self, point: Vector) -> VertexView:
        """What a vertex knows of the projection around it, for `local_outline`."""
        return symmetric_vertex_view(self.profile, 0.5 * self.fov, 0.5 * self.fov, point)

    def local_outline(self, points: list[Vector], views: list[VertexView]) -> tuple[Outline, Array]:
        """Box and three lines around a small triangle, and whether they hold."""
        scale = self.pixels_per_radius
        return small_outline((self.cx, self.cy), (scale, scale), points, views)

    def local_bound_rough(self, a: Vector, b: Vector, c: Vector) -> Box:
        """A cheap conservative box, for triangles of which `local_outline` is not sure."""
        return radial_bound_rough(self, a, b, c)
