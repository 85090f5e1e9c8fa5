"""Control points of image curves: with the ends of a curve, points whose convex hull holds all of it.

The image of an edge turns one way only (`Profile.convex`), so a part that turns by less than half a turn lies in the
triangle of its ends and the crossing of the tangents there. Cut where its tangent is parallel to its chord, an edge has
two such crossings, and the line through them is that tangent: no parallel to the chord can be tighter. Where the cut is
a little off, the crossings hold the curve all the same: nothing rests on a root.
"""

from typing import NamedTuple

from mpcam.cameras.arcs import RadialCamera, image_and_slopes, rounding
from mpcam.cameras.profiles import COSINE_SPHERE, PARABOLOID, Profile
from mpcam.math import PI, Array, Vector, atan2, cos, dot, epsilon, maximum, minimum, sin, sqrt, vector, where

_STEPS = 3  # a guess and two of false position, after which tangents are parallel to about 1e-4

_TOGETHER = 6e-3  # radians; rounding moves the end of an edge that is nearly parallel to the rim by up to 2.5e-3


class Hull(NamedTuple):
    """Two control points (pixels) of a curve, the way it turns, and whether the points hold it.

    turn: 1 for a curve that turns from the u towards the v axis, else -1. wild: the points mean nothing, for rounding
    or for too sharp a turn.
    """

    points: tuple[Vector, Vector]
    turn: Array
    wild: Array

    @property
    def reverse(self) -> "Hull":
        """Of the same curve, followed the other way."""
        return self._replace(turn=-self.turn)


def minus(q: Vector, p: Vector) -> Vector:
    """q - p, of any number of components."""
    return vector(*(q[i] - p[i] for i in range(len(p))))


def area_2d(p: Vector, q: Vector) -> Array:
    """Cross product of two image vectors."""
    return p[0] * q[1] - p[1] * q[0]


def unit_2d(p: Vector, least: Array, otherwise: Vector) -> Vector:
    """An image vector at length 1; `otherwise` where it is not longer than `least`."""
    length = sqrt(p[0] * p[0] + p[1] * p[1])
    some = length > least
    return vector(*(where(some, p[i] / where(some, length, 1.0), otherwise[i]) for i in (0, 1)))


def edge_hull(
    camera: RadialCamera, start: Vector, step: Vector, images: tuple[Vector, Vector], slopes: tuple[Vector, Vector]
) -> Hull:
    """Hull of the image of an edge from the unit direction `start` to the unit direction start + step.

    images, slopes: pixels of both ends, and their velocities in the direction of `step`.
    """
    still = 16 * epsilon(images[0][0]) * camera.radius  # slower is rounding: the flat tip of a nearly straight curve
    chord = unit_2d(minus(images[1], images[0]), 0.0, (1.0, 0.0))
    first, last = (unit_2d(slope, still, chord) for slope in slopes)
    # Which way it turns, by the end that is farther from rounding.
    turn = where(area_2d(first, chord) + area_2d(chord, last) < 0, -1.0, 1.0)
    rise, fall = maximum(turn * area_2d(first, chord), 0.0), minimum(turn * area_2d(last, chord), 0.0)
    low, high = 0.0 * turn, 0.0 * turn + 1.0
    cut = _parallel_tangent(camera.profile, start, step)
    for number in range(1 if camera.profile in (COSINE_SPHERE, PARABOLOID) else _STEPS):
        if number > 0:
            cut = low + (high - low) * where(rise > fall, rise / where(rise > fall, rise - fall, 1.0), 0.5)
        image, (slope,), _ = image_and_slopes(camera, vector(*(start[i] + cut * step[i] for i in range(3))), step)
        heading = unit_2d(slope, still, chord)
        climb = turn * area_2d(heading, chord)
        low, rise = where(climb > 0, cut, low), where(climb > 0, climb, rise)
        high, fall = where(climb > 0, high, cut), where(climb > 0, fall, climb)
    before, wild_before = _crossing(camera, images[0], first, image, heading, turn)
    after, wild_after = _crossing(camera, image, heading, images[1], last, turn)
    return Hull((before, after), turn, wild_before | wild_after)


def _parallel_tangent(profile: Profile, start: Vector, step: Vector) -> Array:
    """How far along `step` the tangent is parallel to the chord: exact for cosine-sphere and paraboloid, else a guess.

    The cosine-sphere is an orthographic view of the unit sphere: it keeps the middle of the arc. The middle of the
    paraboloid's circle arc is as far from both ends, and an arc of angle s from a direction of height z is seen in the
    ratio sin(s / 2) / sqrt(1 + z) there. Other profiles lie between the two.
    """
    if profile is COSINE_SPHERE:
        return 0.5 + 0.0 * step[2]
    a, b = (sqrt(maximum(1.0 + z, 1e-6)) for z in (start[2], start[2] + step[2]))
    if profile is not PARABOLOID:
        a, b = sqrt(a), sqrt(b)
    squared = dot(step, step)
    opening = sqrt(maximum(4.0 - squared, 0.0))  # length of the sum of both directions
    s, t = a / (2.0 * b + a * opening), b / (2.0 * a + b * opening)  # tangents of the half angles over the step
    s, t = s * (1.0 + squared * t * t), t * (1.0 + squared * s * s)
    return s / (s + t)


def _crossing(camera: RadialCamera, p: Vector, u: Vector, q: Vector, w: Vector, turn: Array) -> tuple[Vector, Array]:
    """Where the tangents at two points of a curve cross; u and w: unit tangents; turn: 1 to the right, -1 to the left.

    Wild where a tangent leaves the chord on the wrong side, or where tangents lead away from each other.
    """
    pad = rounding(camera, p[0])
    apart = minus(q, p)
    chord = unit_2d(apart, 0.0, u)
    length = apart[0] * chord[0] + apart[1] * chord[1]
    sine_p, sine_q = turn * area_2d(u, chord), turn * area_2d(chord, w)
    cosine_p, cosine_q = (v[0] * chord[0] + v[1] * chord[1] for v in (u, w))
    wild = length * minimum(sine_p, sine_q) < -pad
    sine_p, sine_q = maximum(sine_p, 0.0), maximum(sine_q, 0.0)
    between = sine_p * cosine_q + cosine_p * sine_q  # sine of the angle by which the curve turns
    gentle = (cosine_p > 0) & (cosine_q > 0)
    crosses = (between > 0) & (gentle | (between > 0.05))
    reach = where(crosses, length * sine_q / where(crosses, between, 1.0), 0.0)
    wild = wild | ~(gentle | crosses | (length <= pad))
    return vector(p[0] + reach * u[0], p[1] + reach * u[1]), wild


def rim_hull(camera: RadialCamera, e: Vector, f: Vector, turn: Array, acute: Array) -> tuple[Hull, Array]:
    """Hull of the rim's arc from azimuth e to azimuth f (unit vectors), and its angle, radians below 2 pi.

    turn: 1 for rising azimuths, -1 for falling ones. acute: whether this side of a triangle lies opposite to an angle
    below 90 degrees, which never opens to a whole turn. The crossings are those of the tangents at the ends with that
    at the middle. Wild where no turn and a whole one look alike.
    """
    angle = atan2(turn * area_2d(e, f), e[0] * f[0] + e[1] * f[1])
    angle = where(angle < where(acute, -_TOGETHER, 0.0), angle + 2 * PI, angle)
    c, s = cos(0.25 * angle), turn * sin(0.25 * angle)
    reach = camera.radius / maximum(c, 1e-3)

    def turned(p: Vector, s: Array) -> Vector:
        return vector(camera.cx + reach * (c * p[0] - s * p[1]), camera.cy + reach * (c * p[1] + s * p[0]))

    wild = ~acute & ((angle < _TOGETHER) | (angle > 2 * PI - _TOGETHER))
    return Hull((turned(e, s), turned(f, -s)), turn, wild), angle
