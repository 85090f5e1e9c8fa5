"""Images that are symmetric about the optical axis: theta, the angle from the axis, lands at radius f(theta).

Everything here is in the units of the profile; cameras shift and scale it to pixels.
"""

from typing import Protocol

from mpcam.cameras.profiles import Profile
from mpcam.cameras.types import Projection, Ray
from mpcam.math import (
    Array,
    Vector,
    atan2,
    cos,
    epsilon,
    isfinite,
    maximum,
    minimum,
    norm,
    sin,
    smallest,
    sqrt,
    vector,
    where,
)


def finite_pixel(pixel: Vector) -> tuple[Array, Array, Array]:
    """u and v, 0 where they are not finite, and whether they are."""
    u, v = pixel
    finite = isfinite(u) & isfinite(v)
    return where(finite, u, 0.0), where(finite, v, 0.0), finite


def symmetric_ray(profile: Profile, x: Array, y: Array, rim: Array, valid: Array) -> Ray:
    """Ray of an image point relative to the center; valid up to the radius `rim`, where it was valid before."""
    squared = x * x + y * y
    distance = sqrt(where(squared > 0, squared, 1.0))
    rim = rim * (1.0 + 4.0 * epsilon(distance))
    valid = valid & (squared <= rim * rim)
    off_axis = valid & (squared > 0)
    distance = where(off_axis, distance, 1.0)  # 1 stands for points that do not matter
    side, ahead = _direction(profile, where(off_axis, distance, 0.0))
    sideways = where(off_axis, side / distance, 0.0)
    zero = 0.0 * x
    inside = where(valid, 1.0, 0.0)
    # At the center the slope of the direction in the image point is 1 / f'(0).
    center = 1.0 / profile.slope(zero)
    direction = vector(
        where(off_axis, x * sideways * inside, x * center * inside),
        where(off_axis, y * sideways * inside, y * center * inside),
        where(valid, ahead, 1.0),
    )
    return Ray(vector(zero, zero, zero), direction, valid)


def _direction(profile: Profile, r: Array) -> tuple[Array, Array]:
    """Unit direction of a radius: distance from the axis, and height."""
    if profile.direction is not None:
        return profile.direction(r)
    theta = profile.angle(r)
    return maximum(sin(theta), 0.0), cos(theta)  # float32 rounds pi up, to where the sine is negative


def symmetric_image(profile: Profile, point: Vector) -> tuple[Array, Array, Array]:
    """Image point (x, y) of a point in the camera frame, and its angle from the axis.

    Beyond the reach of the profile, the image point is that of its reach.
    """
    x, y, z = point
    largest = maximum(maximum(abs(x), abs(y)), abs(z))
    scale = 1.0 / where(largest > 0, largest, 1.0)
    x, y, z = x * scale, y * scale, where(largest > 0, z * scale, 1.0)
    squared = x * x + y * y
    off_axis = squared > smallest(squared)
    rho = sqrt(where(off_axis, squared, 1.0))
    theta = atan2(where(off_axis, rho, 0.0), z)
    radius = radius_of(profile, theta, rho, z)
    ahead = where(z > 0, z, 1.0)
    ratio = where(off_axis, radius / rho, profile.slope(0.0 * rho) / ahead)
    # Straight behind the camera the image is the whole circle; its point to the right stands for it.
    behind = where(off_axis | (z >= 0), 0.0, radius)
    return ratio * x + behind, ratio * y, theta


def radius_of(profile: Profile, theta: Array, rho: Array, z: Array) -> Array:
    """Radius of a direction at theta = atan2(rho, z), or of the profile's reach beyond that."""
    reach = profile.reach
    if profile.toward is None:
        return profile.radius(minimum(theta, reach))
    inside, length = within(theta, reach), sqrt(rho * rho + z * z)
    return profile.toward(where(inside, rho / length, sin(reach)), where(inside, z / length, cos(reach)))


def within(theta: Array, limit: Array) -> Array:
    """Whether an angle is at most the limit, to rounding."""
    return theta <= limit * (1.0 + 4.0 * epsilon(theta))


class CenteredCamera(Protocol):
    """A camera that gives the pixel of a finite point, and knows the pixel of its axis."""

    @property
    def cx(self) -> Array: ...
    @property
    def cy(self) -> Array: ...
    def local_image(self, point: Vector) -> tuple[Vector, Array]: ...


def project_centered(camera: CenteredCamera, point: Vector) -> Projection:
    """Image of a point in the camera frame; not valid outside of the domain, nor at the camera's center."""
    x, y, z = point
    finite = isfinite(x) & isfinite(y) & isfinite(z)
    point = vector(where(finite, x, 0.0), where(finite, y, 0.0), where(finite, z, 0.0))
    depth = norm(point)
    image, inside = camera.local_image(point)
    valid = finite & (depth > 0) & inside
    return Projection(vector(where(valid, image[0], camera.cx), where(valid, image[1], camera.cy)), depth, valid)
