"""The single-pole occlusion camera: a pinhole that moves deep points away from a pole (Mei, Popescu and Sacks 2005)."""

import dataclasses
import math
from typing import Annotated, Any, ClassVar

from mpcam.cameras.base import Camera
from mpcam.cameras.fields import Number, Positive
from mpcam.cameras.pinhole import perspective_box
from mpcam.cameras.single_pole_bounds import directions_from, shifted_box
from mpcam.cameras.single_pole_makers import PoleMakers, a_pole
from mpcam.cameras.symmetric import finite_pixel
from mpcam.cameras.types import Box, Domain, Projection, Ray, RayGeometry, RayPieces
from mpcam.errors import InputError
from mpcam.math import (
    Array,
    Vector,
    epsilon,
    isfinite,
    library,
    maximum,
    minimum,
    norm,
    normalize,
    vector,
    where,
)

_FOLDS = "a shift toward the pole would carry points across it, and two of them would share a pixel: give 0 or more"
_ORDER = (
    "far points must move at least as far as near ones; otherwise they would be hidden more than by a pinhole, and "
    "rays would begin on the pole's axis: give shift_near <= shift_far"
)


@dataclasses.dataclass(frozen=True, eq=False)
class SinglePoleOcclusion(PoleMakers, Camera):
    """A pinhole's image, moved away from a pole by d(z) pixels: what lies deeper moves farther, out of hiding.

    pixel = p + d(z) (p - pole) / |p - pole| with p the pinhole's, and d affine in 1 / z from shift_near at z = near to
    shift_far at z = far, constant on both sides (Mei et al. 2005; Rosen et al. 2011, section 4). Distances from the
    pole are those of the image, in pixels, also where fx and fy differ.

    Rays are bent, in three straight pieces: from the eye to z = near, to z = far, and on for ever. The first and the
    last run along lines through the eye. The middle ones of one direction from the pole come from one point of the
    plane z = 0 beside the eye, which lies on that side: see `viewpoint_radii`. A ray less than shift_far from the pole
    ends on the pole's axis; less than shift_near from it there is none. Rays never cross, so a point has one image, and
    what is in front along a ray has the smaller z. A point on the pole's axis, whose image is a circle, is given at its
    right. `ray` gives the middle piece, produced backwards; `ray_pieces` all; depth is the length along the bent ray.

    width, height: pixels. fx, fy, cx, cy: focal lengths and principal point, pixels, center of the top left pixel at
    (0.5, 0.5). pole: (u, v), pixels; by default (cx, cy). near, far: depths z, scene units. shift_near, shift_far:
    pixels. camera_from_world: 4x4, OpenCV axes. `around` makes one that looks at an object.

    Raises InputError for sizes below 1, focal lengths and depths that are not positive, far that is not beyond near,
    negative shifts, a shift_far below shift_near, numbers that are not finite, and poses that are not rigid.
    """

    width: int
    height: int
    fx: Positive
    fy: Positive
    cx: Number
    cy: Number
    _: dataclasses.KW_ONLY
    pole: Annotated[Any, tuple[float, float]] = None
    near: Positive
    far: Positive
    shift_near: Number = 0.0
    shift_far: Number
    camera_from_world: Any = None
    bend: Any = dataclasses.field(default=None, init=False, repr=False)  # what kernels take ready: `_numbers`

    ray_geometry: ClassVar[RayGeometry] = "general"
    pieces_per_ray: ClassVar[int] = 3

    def __post_init__(self) -> None:
        self._check_frame()
        self._check_numbers()
        pole = (self.cx, self.cy) if self.pole is None else a_pole(self.pole)
        object.__setattr__(self, "pole", pole)
        if library(self.shift_near, self.shift_far) == "numpy":
            for name in ("shift_near", "shift_far"):
                if getattr(self, name) < 0:
                    raise InputError(f"SinglePoleOcclusion({name}={getattr(self, name):g}): {_FOLDS}")
            if self.shift_far < self.shift_near:
                given = f"shift_near={self.shift_near:g}, shift_far={self.shift_far:g}"
                raise InputError(f"SinglePoleOcclusion({given}): {_ORDER}")
        if library(self.near, self.far) == "numpy" and not self.near < self.far:
            given = f"near={self.near:g}, far={self.far:g}"
            raise InputError(f"SinglePoleOcclusion({given}): there are no depths between them: give near < far")
        if library(self.cx, self.cy, *pole, self.near, self.far, self.shift_near, self.shift_far) == "numpy":
            object.__setattr__(self, "bend", self._numbers())

    @property
    def domain(self) -> Domain:
        """All points with z > 0; no largest angle, since rays have no common center, and no image circle."""
        return Domain(None, None, (0.0,))

    @property
    def viewpoint_radii(self) -> tuple[Array, Array]:
        """Half axes, along x and y, of the ellipse in the plane z = 0 around the eye from which the middle pieces come.

        Scene units; equal where fx and fy are. What the camera reveals is what a walk around the eye, so far from it,
        would reveal.
        """
        aside = self._aside(self._bend)
        return aside / self.fx, aside / self.fy

    @property
    def _bend(self) -> tuple[Array, ...]:
        return self._numbers() if self.bend is None else self.bend

    def _numbers(self) -> tuple[Array, ...]:
        """Pole from the principal point in u and v; how much the shift grows; far and near over the range; the range.

        Differences, which kernels in single precision would lose digits of.
        """
        span = self.far - self.near
        if library(span) != "numpy":  # single precision may have made it zero
            span = maximum(span, 0.25 * epsilon(span) * self.far)
        grows = self.shift_far - self.shift_near
        return (self.pole[0] - self.cx, self.pole[1] - self.cy, grows, self.far / span, self.near / span, span)

    def _aside(self, bend: tuple[Array, ...]) -> Array:
        """Pixels times depth: -b of d(z) = a + b / z."""
        return bend[2] * bend[3] * self.near

    # Rays

    def local_ray(self, pixel: Vector) -> Ray:
        """Middle piece of a pixel's bent ray in the camera frame, from where its length would be 0."""
        u, v, valid = finite_pixel(pixel)
        bend = self._bend
        distance, e = self._from_pole(u - self.pole[0], v - self.pole[1])
        valid = valid & isfinite(distance) & (distance >= self.shift_near) & self._has_middle(distance)
        first, direction = self._way(u, v, e, self.shift_near), normalize(self._middle(u, v, e, bend))
        length = norm(first)
        origin = vector(*(self.near * (first[i] - length * direction[i]) for i in range(3)))
        valid = valid & isfinite(origin[0] + origin[1] + origin[2])
        plain = vector(0.0 * u, 0.0 * u, 0.0 * u + 1.0)
        return Ray(_either(valid, origin, 0.0 * plain), _either(valid, direction, plain), valid)

    def local_ray_pieces(self, pixel: Vector) -> tuple[RayPieces, ...]:
        """The three pieces of a pixel's bent ray in the camera frame."""
        u, v, valid = finite_pixel(pixel)
        bend, near, far = self._bend, self.near, self.far
        distance, e = self._from_pole(u - self.pole[0], v - self.pole[1])
        valid = valid & isfinite(distance) & (distance >= self.shift_near)
        first = self._way(u, v, e, self.shift_near)
        middle, last = self._middle(u, v, e, bend), self._way(u, v, e, self.shift_far)
        bent, goes_on = valid & self._has_middle(distance), valid & (distance >= self.shift_far)
        # Where the shift is the distance from the pole; toward it both lines lose so many pixels.
        left = where(goes_on | ~valid, 1.0, self.shift_far - distance + bend[2] * bend[4])
        thick = where(goes_on, bend[5], near * ((distance - self.shift_near) / left))
        thick = minimum(thick, bend[5])
        start = near * norm(first)
        end = start + thick * norm(middle)
        zero = 0.0 * u

        def piece(z: Array, way: Vector, along: Vector, start: Array, end: Array, valid: Array) -> RayPieces:
            valid = valid & isfinite(start) & isfinite(norm(along))
            origin = _either(valid, vector(*(z * part for part in way)), vector(zero, zero, zero))
            along = _either(valid, normalize(along), vector(zero, zero, zero + 1.0))
            return RayPieces(origin, along, where(valid, start, 0.0), where(valid, end, 0.0), valid)

        return (
            piece(0.0, first, first, zero, start, valid),
            piece(near, first, middle, start, end, bent),
            piece(far, last, last, end, zero + math.inf, goes_on),
        )

    def _has_middle(self, distance: Array) -> Array:
        """Whether a ray gets beyond z = near, as those at the least distance from the pole do if shifts are equal."""
        return (distance > self.shift_near) | (self._bend[2] <= 0)

    def _from_pole(self, u: Array, v: Array) -> tuple[Array, tuple[Array, Array]]:
        """Distance of a pixel from the pole, from which it is given, and unit direction; to the right at the pole."""
        offset = vector(u, v, 0.0 * u)
        distance, e = norm(offset), normalize(offset)
        away = distance > 0
        return distance, (where(away, e[0], 1.0), where(away, e[1], 0.0))

    def _per_pixel(self, e: tuple[Array, Array]) -> tuple[Array, Array]:
        """A pixel away from the pole, in the plane z = 1."""
        return e[0] / self.fx, e[1] / self.fy

    def _way(self, u: Array, v: Array, e: tuple[Array, Array], shift: Array) -> Vector:
        """Line through the eye of the pinhole's pixel that is shifted to (u, v): the point at z = 1."""
        x, y = (u - shift * e[0]) - self.cx, (v - shift * e[1]) - self.cy
        return vector(x / self.fx, y / self.fy, 0.0 * x + 1.0)

    def _middle(self, u: Array, v: Array, e: tuple[Array, Array], bend: tuple[Array, ...]) -> Vector:
        """Way along the middle piece for a step of 1 in z."""
        return self._way(u, v, e, self.shift_far + bend[2] * bend[4])

    # Images

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Image of a point in the camera frame; valid in front of the camera plane, where its pixel is finite."""
        x, y, z = point
        valid = (z > 0) & isfinite(x) & isfinite(y) & isfinite(z)
        x, y, z = where(valid, x, 0.0), where(valid, y, 0.0), where(valid, z, 1.0)
        bend, near, far = self._bend, self.near, self.far
        x, y = x / z, y / z
        u, v = self.fx * x, self.fy * y
        valid = valid & isfinite(u) & isfinite(v)
        u, v, x, y = (where(valid, part, 0.0) for part in (u, v, x, y))
        _, e = self._from_pole(u - bend[0], v - bend[1])
        part, inside = self._part(z, bend)
        grown = bend[2] * part
        shift = self.shift_near + grown
        pixel = vector(self.cx + u + shift * e[0], self.cy + v + shift * e[1])
        valid = valid & isfinite(pixel[0]) & isfinite(pixel[1])

        side, back, one = self._per_pixel(e), self._aside(bend) / inside, 0.0 * x + 1.0
        first = norm(vector(x + grown * side[0], y + grown * side[1], one))
        middle = norm(vector(x - back * side[0], y - back * side[1], one))
        beyond = maximum(z - far, 0.0) * norm(vector(x, y, one))
        within = where(z >= far, bend[5], inside - near)
        depth = minimum(z, near) * first + within * middle + beyond
        valid = valid & isfinite(depth)
        pixel = vector(where(valid, pixel[0], self.cx), where(valid, pixel[1], self.cy))
        return (Projection(pixel, where(valid, depth, 0.0), valid),)

    def local_measure(self, point: Vector) -> Array:
        """1 / z of points in front of the camera plane, 0 elsewhere: a measure of depth that costs one division.

        It falls along every ray, bent or not, so of two points in one pixel that in front has the larger measure. It is
        the pinhole's: linear in its image along straight lines, before the shift. On a plane and within one of the
        three ranges of depth, it is linear in this camera's image along each line through the pole, and not in general.
        """
        z = point[2]
        front = z > 0
        return where(front, 1.0 / where(front, z, 1.0), 0.0)

    def _part(self, z: Array, bend: tuple[Array, ...]) -> tuple[Array, Array]:
        """How much of the shift's growth there is at z, 0 to 1, and z brought to the range from near to far."""
        near, far = self.near, self.far
        inside = maximum(minimum(z, far), near)
        part = minimum(bend[3] * ((inside - near) / inside), 1.0)
        return where(z >= far, 1.0, where(z <= near, 0.0, part)), inside

    def local_bound(self, a: Vector, b: Vector, c: Vector) -> Box:
        """Box of the part of a triangle in front of the camera plane; unbounded sides are at +-1e9 pixels.

        That of the pinhole's image, moved by all shifts between those of the nearest and the farthest point in all
        directions that its points have from the pole.
        """
        bend, center = self._bend, (self.cx, self.cy)
        low, high, valid = perspective_box((self.fx, self.fy), center, a, b, c)
        depths = [where(valid, corner[2], 1.0) for corner in (a, b, c)]
        nearest, farthest = (pick(pick(depths[0], depths[1]), depths[2]) for pick in (minimum, maximum))
        # Where a triangle reaches behind the eye, its nearest point has z = 0, and no part of the growth.
        least, most = (self.shift_near + bend[2] * self._part(z, bend)[0] for z in (nearest, farthest))
        corners = [vector(*(where(valid, part, 1.0) for part in corner)) for corner in (a, b, c)]
        ends = directions_from((self.fx, self.fy), bend[:2], corners)
        return shifted_box(Box(low, high, valid), ends, least, most)


def _either(condition: Array, first: Vector, second: Vector) -> Vector:
    return vector(*(where(condition, first[i], second[i]) for i in range(3)))
