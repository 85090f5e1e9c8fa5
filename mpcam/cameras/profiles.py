"""Radial profiles r = f(theta): how far from the image center a ray at angle theta from the axis lands.

The four profiles of Gascuel et al. 2008 (Table 1) and any increasing function of a user. Table 1 lists five: its
"Lambert conformal" is the equal-area projection and the same as its first fish-eye, since
sqrt(1 - cos theta) = sqrt(2) sin(theta / 2).
"""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.errors import InputError
from mpcam.math import (
    PI,
    Array,
    absolute,
    asin,
    atan,
    central_slope,
    cos,
    invert_increasing,
    maximum,
    minimum,
    sin,
    tan,
    where,
)

_SAMPLES = 2001
_ROOT_2 = 2.0**0.5  # a Python number: a NumPy number would seize the arithmetic of Dr.Jit arrays


@dataclasses.dataclass(frozen=True)
class Profile:
    """An increasing function r = radius(theta) with radius(0) = 0.

    radius, slope: r and dr/dtheta of theta (radians). angle: theta of r. limit: the profile is defined and increasing
    on [0, limit) or [0, limit], radians. convex: whether 1/f is a convex, increasing-from-tangent function of
    cot(theta), which makes the images of straight lines bulge away from the center, so
    that tangents bound them; bounds fall back to annular sectors where it is False.

    toward, direction: radius and angle once more, where they have a form in the unit direction's distance from the
    axis and height, (sin theta, cos theta). It keeps what theta has lost to rounding near pi.
    """

    name: str
    radius: Callable[[Array], Array]
    slope: Callable[[Array], Array]
    angle: Callable[[Array], Array]
    limit: float
    limit_included: bool
    convex: bool
    toward: Callable[[Array, Array], Array] | None = None
    direction: Callable[[Array], tuple[Array, Array]] | None = None

    def __reduce_ex__(self, protocol: Any) -> Any:
        """Built-in profiles are pickled and copied by name: their functions are lambdas, and there is one of each."""
        if PROFILES.get(self.name) is self:
            return _built_in, (self.name,)
        return super().__reduce_ex__(protocol)

    @property
    def reach(self) -> float:
        """Largest angle at which to evaluate the profile, radians: the limit, or just below it."""
        return self.limit if self.limit_included else (1 - 1e-6) * self.limit


def _unit(x: Array) -> Array:
    return maximum(minimum(x, 1.0), -1.0)


def _half_tangent(side: Array, ahead: Array) -> Array:
    behind = ahead < 0
    return where(behind, (1.0 - ahead) / where(behind, side, 1.0), side / where(behind, 1.0, 1.0 + ahead))


PARABOLOID = Profile(
    "paraboloid",
    lambda theta: tan(0.5 * theta),
    lambda theta: 0.5 / (cos(0.5 * theta) * cos(0.5 * theta)),
    lambda r: 2.0 * atan(r),
    PI,
    False,
    True,
    _half_tangent,
    lambda r: (2.0 * r / (1.0 + r * r), (1.0 - r * r) / (1.0 + r * r)),
)
"""Stereographic projection, r = tan(theta / 2): keeps angles; lines become circle arcs."""

COSINE_SPHERE = Profile("cosine_sphere", sin, cos, lambda r: asin(_unit(r)), PI / 2, True, True)
"""r = sin(theta): image area is solid angle times cosine; lines become ellipse arcs."""

EQUISOLID = Profile(
    "equisolid",
    lambda theta: _ROOT_2 * sin(0.5 * theta),
    lambda theta: (0.5 * _ROOT_2) * cos(0.5 * theta),
    lambda r: 2.0 * asin(_unit(r * (0.5 * _ROOT_2))),
    PI,
    True,
    True,
)
"""Lambert's equal-area projection, r = sqrt(2) sin(theta / 2): image area is solid angle."""

EQUIDISTANT = Profile(
    "equidistant",
    lambda theta: theta * (2.0 / PI),
    lambda theta: theta * 0.0 + 2.0 / PI,
    lambda r: r * (PI / 2.0),
    PI,
    True,
    True,
)
"""r = 2 theta / pi: distance from the center is proportional to the angle."""

PROFILES = {profile.name: profile for profile in (PARABOLOID, COSINE_SPHERE, EQUISOLID, EQUIDISTANT)}


def _built_in(name: str) -> Profile:
    return PROFILES[name]


def custom_profile(
    radius: Callable[[Array], Array],
    max_angle: float,
    *,
    slope: Callable[[Array], Array] | None = None,
    angle: Callable[[Array], Array] | None = None,
    name: str = "custom",
) -> Profile:
    """A user's own profile, checked on 2,001 angles.

    radius: r of theta (radians), written with plain operators and the functions of `mpcam.math`, so that it runs on
    NumPy, JAX and Dr.Jit arrays. slope, angle: its derivative and inverse; found numerically when left out. max_angle:
    end of the domain, radians, at most pi. Raises InputError unless f is finite, f(0) = 0, f increases, and slope and
    angle agree with it.
    """
    if not 0 < max_angle <= PI:
        raise InputError(f"profile {name!r}: max_angle={max_angle!r}; radians above 0 and at most pi are needed")
    theta = np.linspace(0.0, max_angle, _SAMPLES)
    try:
        with np.errstate(all="ignore"):
            r = np.asarray(radius(theta), np.float64)
    except (TypeError, ValueError, AttributeError) as error:
        raise InputError(f"profile {name!r} fails on an array of angles ({error}): use mpcam.math functions") from None
    if r.shape != theta.shape or not np.isfinite(r).all():
        bad = theta[~np.isfinite(r)][0] if r.shape == theta.shape else None
        what = f"is not finite at theta = {bad:.4g}" if bad is not None else f"maps shape {theta.shape} to {r.shape}"
        raise InputError(f"profile {name!r} {what}: give a function that is finite on [0, {max_angle:.4g}]")
    if abs(r[0]) > 1e-9 * abs(r[-1]):
        raise InputError(f"profile {name!r}: f(0) = {r[0]:.3g}; the axis must land on the image center, f(0) = 0")
    fall = np.flatnonzero(np.diff(r) <= 0)
    if fall.size:
        raise InputError(
            f"profile {name!r} does not increase beyond theta = {theta[fall[0]]:.4g}: "
            f"give max_angle below that, or an increasing function"
        )
    chosen_slope = slope or central_slope(radius, 0.0, max_angle)
    chosen_angle = angle or (lambda value: invert_increasing(radius, chosen_slope, value, 0.0, max_angle))
    if slope is not None:
        error = float(np.abs(np.asarray(slope(theta)) - central_slope(radius, 0.0, max_angle)(theta))[1:-1].max())
        if error > 1e-4 * r[-1] / max_angle:
            raise InputError(f"profile {name!r}: slope is off the derivative of radius by {error:.2g}; mend or omit it")
    if angle is not None and float(np.abs(np.asarray(angle(r)) - theta).max()) > 1e-6:
        raise InputError(f"profile {name!r}: angle(radius(theta)) is not theta; mend or omit it")
    return Profile(name, radius, chosen_slope, chosen_angle, float(max_angle), True, bulges_outward(theta, r))


def bulges_outward(theta: np.ndarray, r: np.ndarray) -> bool:
    """Whether U(w) = 1 / f, w = cot(theta), has U'' >= 0 and U - w U' >= 0 on samples.

    The sample angles avoid the ends, where w or U is infinite; divided differences tolerate rounding of 1e-9.
    """
    inner = slice(20, -1)
    w, u = 1.0 / np.tan(theta[inner]), 1.0 / r[inner]
    step = np.diff(u) / np.diff(w)
    middle = 0.5 * (w[1:] + w[:-1])
    convex = np.diff(step) / np.diff(middle)
    offset = 0.5 * (u[1:] + u[:-1]) - middle * step
    scale = float(absolute(u).max())
    return bool((convex >= -1e-9 * scale).all() and (offset >= -1e-9 * scale).all())
