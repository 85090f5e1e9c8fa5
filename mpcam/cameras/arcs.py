"""Boxes of curved triangles under radial projections.

An edge of a scene triangle lies in a plane through the center, so it is a great-circle arc of directions, whose image
turns one way only (for profiles with `Profile.convex`; the page on rasterization says why). So along each image axis
an arc has at most one extremum per half turn, and it lies where the slope along the arc changes its sign; between two
points with tangents, the arc stays inside the triangle of the two points and the crossing of the tangents. Corners of
the box are also reached on the rim, where a rim point on an image axis lies inside the triangle.
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from mpcam.cameras.profiles import Profile
from mpcam.cameras.symmetric import radius_of
from mpcam.cameras.types import Box
from mpcam.math import (
    PI,
    Array,
    Vector,
    absolute,
    acos,
    asin,
    atan2,
    cos,
    cross,
    dot,
    epsilon,
    isfinite,
    maximum,
    minimum,
    norm,
    normalize,
    sin,
    sqrt,
    vector,
    where,
)

_PIECES = 8
_HALVINGS = 5
_FAR = 1e9  # pixels; stands for infinity

ON_AXIS = 1e-30
"""Squared angle from the axis below which the projection is a scaling; float32 holds its inverse."""


class RadialCamera(Protocol):
    """What the bounds need to know of a camera."""

    @property
    def profile(self) -> Profile: ...
    @property
    def fov(self) -> Array: ...
    @property
    def radius(self) -> Array: ...
    @property
    def cx(self) -> Array: ...
    @property
    def cy(self) -> Array: ...
    @property
    def pixels_per_radius(self) -> Array: ...


EdgeBox = Callable[["RadialCamera", Vector, Vector], Box]


def image_and_slopes(camera: RadialCamera, p: Vector, *velocities: Vector) -> tuple[Vector, list[Vector], Array]:
    """Pixel of a direction p (any length), pixel velocities for given velocities of p, and the angle from the axis.

    On the axis, where the azimuth is undefined, the projection is a scaling by f'(0) / z.
    """
    x, y, z = p
    squared = x * x + y * y
    length_squared = squared + z * z
    off_axis = squared > ON_AXIS * length_squared
    rho = sqrt(where(off_axis, squared, 1.0))
    ex, ey = where(off_axis, x / rho, 1.0), where(off_axis, y / rho, 0.0)
    theta = atan2(sqrt(squared), z)
    scale = camera.pixels_per_radius
    r = scale * radius_of(camera.profile, theta, rho, z)
    slope = scale * camera.profile.slope(minimum(theta, camera.profile.reach))
    flat = slope / where(z > 0, z, 1.0)
    sideways = where(off_axis, r / rho, flat)
    pixel = vector(camera.cx + sideways * x, camera.cy + sideways * y)
    slopes = []
    for vx, vy, vz in velocities:
        along = ex * vx + ey * vy
        turning = (z * along - rho * vz) / where(length_squared > 0, length_squared, 1.0)
        radial = where(off_axis, slope * turning, flat * along)
        slopes.append(vector(radial * ex + sideways * (vx - ex * along), radial * ey + sideways * (vy - ey * along)))
    return pixel, slopes, theta


def tangent_limit(m0: Vector, g0: Vector, m1: Vector, g1: Vector, i: int, span: Array, far: Array) -> Array:
    """Coordinate i that an arc between two points cannot pass, by the crossing of the tangents there.

    m0, m1: points; g0, g1: velocities, opposite along i; span: length of the parameter interval. Where the tangents
    are parallel to rounding, the arc is straight and its first velocity over the span limits it; where they oppose
    each other so that they do not cross, nothing is known but that it stays within `far`.
    """
    turn = g0[0] * g1[1] - g0[1] * g1[0]
    agreement = g0[0] * g1[0] + g0[1] * g1[1]
    parallel = abs(turn) <= 1e3 * epsilon(turn) * abs(agreement)
    reach = ((m1[0] - m0[0]) * g1[1] - (m1[1] - m0[1]) * g1[0]) / where(turn != 0, turn, 1.0)
    crossing = where((turn != 0) & (reach >= 0), m0[i] + g0[i] * reach, where(g0[i] > 0, far, -far))
    return where(parallel & (agreement > 0), m0[i] + g0[i] * span, crossing)


def arc_box(camera: RadialCamera, a: Vector, b: Vector) -> Box:
    """Box of the image of the great-circle arc between unit directions a and b, within the field of view."""
    along = dot(a, b)
    across = cross(a, b)
    tangent = normalize(cross(across, a))  # not from b - a along: in a narrow view, nothing but rounding is left of it
    length = atan2(norm(across), along)
    start, span, valid, twice = visible_part(camera, a, tangent, length)

    def at(s: Array) -> tuple[Vector, Vector]:
        c, d = cos(s), sin(s)
        point = vector(*(a[i] * c + tangent[i] * d for i in range(3)))
        velocity = vector(*(tangent[i] * c - a[i] * d for i in range(3)))
        pixel, slopes, _ = image_and_slopes(camera, point, velocity)
        return pixel, slopes[0]

    # Between its highest and its lowest point an arc turns by less than half a turn: no extremum hides between two.
    half = _PIECES // 2
    split = _extreme_height(a, tangent, start, span)
    nodes = [start + (split - start) * (k / half) for k in range(half)]
    nodes += [split + (start + span - split) * (k / half) for k in range(half + 1)]
    pixel, slope = at(start)
    low, high = [pixel[0], pixel[1]], [pixel[0], pixel[1]]
    brackets = {(i, sign): (start, start, span < 0) for i in (0, 1) for sign in (-1, 1)}
    for previous, s in zip(nodes[:-1], nodes[1:], strict=True):
        before = slope
        pixel, slope = at(s)
        for i in (0, 1):
            low[i], high[i] = minimum(low[i], pixel[i]), maximum(high[i], pixel[i])
            for sign in (-1, 1):
                turns = (sign * before[i] > 0) & (sign * slope[i] < 0)
                left, right, found = brackets[i, sign]
                brackets[i, sign] = (where(turns, previous, left), where(turns, s, right), found | turns)
    for (i, sign), (left, right, found) in brackets.items():
        for _ in range(_HALVINGS):
            middle = 0.5 * (left + right)
            rising = sign * at(middle)[1][i] > 0
            left, right = where(rising, middle, left), where(rising, right, middle)
        (m0, g0), (m1, g1) = at(left), at(right)
        limit = tangent_limit(m0, g0, m1, g1, i, right - left, _FAR)
        if sign > 0:
            high[i] = maximum(high[i], where(found, limit, high[i]))
        else:
            low[i] = minimum(low[i], where(found, limit, low[i]))
    center = (camera.cx, camera.cy)
    twice = twice | _through_antipode(camera, a[2] * cos(split) + tangent[2] * sin(split))
    low = [where(twice, center[i] - camera.radius, low[i]) for i in (0, 1)]
    high = [where(twice, center[i] + camera.radius, high[i]) for i in (0, 1)]
    return Box(vector(*low), vector(*high), valid)


def _extreme_height(a: Vector, tangent: Vector, start: Array, span: Array) -> Array:
    """Where an arc is farthest from or nearest to the camera plane; its middle where that lies outside of the arc."""
    ahead = atan2(tangent[2], a[2]) - start  # of the highest point; the lowest is half a turn on
    for _ in range(2):
        ahead = where(ahead < 0, ahead + PI, ahead)
    ahead = where(ahead >= PI, ahead - PI, ahead)
    return start + where(ahead < span, ahead, 0.5 * span)


def _through_antipode(camera: RadialCamera, height: Array) -> Array:
    """Whether an arc of this lowest height passes so near the point behind the eye that its azimuth is undefined.

    That point is the whole rim of a view of 360 degrees.
    """
    near = 1e-6 if epsilon(height) > 1e-10 else 1e-12
    return (height <= near - 1) & (0.5 * camera.fov + 0.0 * height >= PI - 2 * near**0.5)


def visible_part(camera: RadialCamera, a: Vector, tangent: Vector, length: Array) -> tuple[Array, Array, Array, Array]:
    """Part of an arc within the field of view: start, span, whether there is any, whether there are two parts.

    The arc is a cos s + tangent sin s, s in [0, length]; its height over the camera plane is R cos(s - crest).
    """
    reach = sqrt(a[2] * a[2] + tangent[2] * tangent[2])
    crest = atan2(tangent[2], a[2])
    slack = 8 * PI * epsilon(reach)
    lowest = cos(0.5 * camera.fov + 0.0 * reach) - slack  # an arc along the rim is seen, whichever side rounding takes
    everything = lowest <= -reach
    ratio = where(everything, -1.0, lowest / where(reach > 0, reach, 1.0))
    half = where(ratio >= 1, 0.0, acos(maximum(minimum(ratio, 1.0), -1.0)))
    parts = []
    for turn in (-2 * PI, 0.0, 2 * PI):
        first = maximum(crest + turn - half - slack, 0.0)
        last = minimum(crest + turn + half + slack, length)
        parts.append((first, last, (last >= first) & (ratio <= 1 + slack)))
    start, end, valid = parts[0]
    twice = valid & False
    for first, last, some in parts[1:]:
        twice = twice | (valid & some)
        start, end = where(some & ~valid, first, start), where(some & ~valid, last, end)
        valid = valid | some
    start, end = where(everything, 0.0, start), where(everything, length, end)
    return start, maximum(end - start, 0.0), valid | everything, twice & ~everything


def unit_corners(a: Vector, b: Vector, c: Vector) -> tuple[list[Vector], Array]:
    """Unit directions of finite corners (others replaced), and whether all are finite."""
    finite = isfinite(sum(corner[i] for corner in (a, b, c) for i in range(3)))
    corners = [vector(where(finite, p[0], 0.0), where(finite, p[1], 0.0), where(finite, p[2], 1.0)) for p in (a, b, c)]
    return [normalize(p) for p in corners], finite


def _disc(camera: RadialCamera, box: Box, whole: Array) -> Box:
    """The box, or the whole image circle where `whole` holds."""
    low = vector(*(where(whole, (camera.cx, camera.cy)[i] - camera.radius, box.low[i]) for i in (0, 1)))
    high = vector(*(where(whole, (camera.cx, camera.cy)[i] + camera.radius, box.high[i]) for i in (0, 1)))
    return Box(low, high, box.valid | whole)


def radial_bound(camera: RadialCamera, a: Vector, b: Vector, c: Vector, edge_box: EdgeBox = arc_box) -> Box:
    """Box of a triangle (camera frame): union of its edges' boxes and of the rim points that lie inside it."""
    corners, finite = unit_corners(a, b, c)
    if not camera.profile.convex:
        box = sector_bound(camera, corners)
        return Box(box.low, box.high, box.valid & finite)
    low, high, valid = [_FAR, _FAR], [-_FAR, -_FAR], ~finite & finite
    through_eye = valid
    for p, q in ((0, 1), (1, 2), (2, 0)):
        arc = edge_box(camera, corners[p], corners[q])
        for i in (0, 1):
            low[i] = minimum(low[i], where(arc.valid, arc.low[i], _FAR))
            high[i] = maximum(high[i], where(arc.valid, arc.high[i], -_FAR))
        valid = valid | arc.valid
        # Opposite corners, or one at the center: the edge passes through the eye, its arc is undefined.
        through_eye = through_eye | (dot(corners[p], corners[q]) < -1 + 1e-6) | (dot(corners[p], corners[p]) < 0.5)
    normals = [cross(corners[(i + 1) % 3], corners[(i + 2) % 3]) for i in range(3)]
    facing = where(dot(corners[0], normals[0]) < 0, -1.0, 1.0)
    area = norm(normals[0]) + norm(normals[1]) + norm(normals[2]) > 0
    z, side = cos(0.5 * camera.fov + 0.0 * facing), sin(0.5 * camera.fov + 0.0 * facing)
    center = (camera.cx, camera.cy)
    for i in (0, 1):
        for sign in (-1, 1):
            rim = vector(sign * side * (1 - i), sign * side * i, z)
            edges = [facing * dot(normal, rim) + 1e-6 * norm(normal) for normal in normals]
            inside = area & (minimum(minimum(edges[0], edges[1]), edges[2]) >= 0)
            valid = valid | inside
            if sign > 0:
                high[i] = maximum(high[i], where(inside, center[i] + camera.radius, -_FAR))
            else:
                low[i] = minimum(low[i], where(inside, center[i] - camera.radius, _FAR))
    box = _disc(camera, Box(vector(*low), vector(*high), valid), through_eye)
    return _padded(camera, Box(box.low, box.high, box.valid & finite))


def radial_bound_rough(camera: RadialCamera, a: Vector, b: Vector, c: Vector) -> Box:
    """Box of the annular sector of the triangle's bounding cone: cheap, and good for any increasing profile."""
    corners, finite = unit_corners(a, b, c)
    sector = sector_bound(camera, corners)
    return Box(sector.low, sector.high, sector.valid & finite)


class Cone(NamedTuple):
    """Bounding cone of a triangle's directions, in angles from the optical axis and azimuths around it.

    It holds the angles theta - spread to theta + spread, and azimuths up to half_turn away from `azimuth`. around:
    whether it holds a direction of the optical axis, and so every azimuth. wide: whether it may hold any direction.
    """

    theta: Array
    spread: Array
    azimuth: Array
    half_turn: Array
    around: Array
    wide: Array


def bounding_cone(corners: list[Vector]) -> Cone:
    """Cone around the mean of three unit directions; `wide` from 90 degrees, and where a corner is at the center."""
    axis = normalize(vector(*(corners[0][i] + corners[1][i] + corners[2][i] for i in range(3))))
    cosine = minimum(minimum(dot(axis, corners[0]), dot(axis, corners[1])), dot(axis, corners[2]))
    wide = (cosine < 0.01) | (dot(corners[0], corners[0]) < 0.5)
    wide = wide | (dot(corners[1], corners[1]) < 0.5) | (dot(corners[2], corners[2]) < 0.5)
    # From the chords, since the cosine of a small angle has lost it: in float32, all below 3e-4 look alike.
    chords = [vector(*(corner[i] - axis[i] for i in range(3))) for corner in corners]
    longest = maximum(maximum(dot(chords[0], chords[0]), dot(chords[1], chords[1])), dot(chords[2], chords[2]))
    spread = 2.0 * asin(minimum(0.5 * sqrt(longest), 1.0)) + 8 * epsilon(cosine)
    theta = atan2(sqrt(axis[0] * axis[0] + axis[1] * axis[1]), axis[2])
    around = (theta <= spread) | (theta + spread >= PI)
    opening = where(around, 0.0, sin(spread) / where(around, 1.0, maximum(sin(theta), 1e-30)))
    half_turn = where(around, PI, asin(minimum(opening, 1.0)) + 1e-6)
    return Cone(theta, spread, atan2(axis[1], axis[0]), half_turn, around, wide)


def _nearest(cone: Cone) -> list[tuple[Array, Array]]:
    """For u and v: cosines of the angles from the positive and from the negative image axis to the cone's azimuths."""
    cosines = []
    for i in (0, 1):
        towards = []
        for target in (i * 0.5 * PI, i * 0.5 * PI + PI):
            away = absolute(_wrapped(cone.azimuth - target))
            towards.append(cos(maximum(away - cone.half_turn, 0.0)))
        cosines.append((towards[0], towards[1]))
    return cosines


def sector_bound(camera: RadialCamera, corners: list[Vector]) -> Box:
    """Box of the annular sector that holds the triangle's bounding cone; for any increasing profile.

    corners: unit directions. A cone of 90 degrees or more gives the whole disc.
    """
    cone = bounding_cone(corners)
    half_fov = 0.5 * camera.fov
    valid = cone.wide | (cone.theta - cone.spread <= half_fov)
    outer = minimum(cone.theta + cone.spread, half_fov)
    inner = where(cone.around, 0.0, minimum(maximum(cone.theta - cone.spread, 0.0), half_fov))
    scale = camera.pixels_per_radius
    r0, r1 = scale * camera.profile.radius(inner), scale * camera.profile.radius(outer)
    low, high = [], []
    for center, (ahead, behind) in zip((camera.cx, camera.cy), _nearest(cone), strict=True):
        high.append(center + where(ahead >= 0, r1, r0) * ahead)
        low.append(center - where(behind >= 0, r1, r0) * behind)
    return _disc(camera, _padded(camera, Box(vector(*low), vector(*high), valid)), cone.wide)


def outer_bound(camera: RadialCamera, limit: Array, a: Vector, b: Vector, c: Vector) -> Box:
    """Box of the part of a triangle between the rim of the view and a larger angle, out to infinity.

    limit: radians. It takes no profile beyond the rim, and stands for images that reach very far out, whose rounding
    errors are large. Not valid where there is no such part.
    """
    corners, finite = unit_corners(a, b, c)
    cone = bounding_cone(corners)
    half_fov = 0.5 * camera.fov
    reached = cone.wide | ((cone.theta + cone.spread >= half_fov) & (cone.theta - cone.spread <= limit))
    # A view of less than 180 degrees is convex: it holds a triangle when it holds the corners.
    lowest = minimum(minimum(corners[0][2], corners[1][2]), corners[2][2])
    nearest = minimum(minimum(dot(corners[0], corners[0]), dot(corners[1], corners[1])), dot(corners[2], corners[2]))
    within = (nearest > 0.5) & (half_fov < 0.5 * PI) & (lowest > cos(half_fov + 0.0 * lowest) + 8 * epsilon(lowest))
    reached = reached & ~within
    inner = where(cone.around, 0.0, minimum(maximum(cone.theta - cone.spread, 0.0), half_fov))
    r0 = camera.pixels_per_radius * camera.profile.radius(inner)
    low, high = [], []
    for center, (ahead, behind) in zip((camera.cx, camera.cy), _nearest(cone), strict=True):
        high.append(where(cone.wide | (ahead > -1e-6), _FAR, center + r0 * ahead))
        low.append(where(cone.wide | (behind > -1e-6), -_FAR, center - r0 * behind))
    return _padded(camera, Box(vector(*low), vector(*high), finite & reached & (limit > half_fov)))


def _wrapped(angle: Array) -> Array:
    """An angle in [-2 pi, 2 pi] brought to [-pi, pi]."""
    angle = where(angle > PI, angle - 2 * PI, angle)
    return where(angle < -PI, angle + 2 * PI, angle)


def rounding(camera: RadialCamera, like: Array) -> Array:
    """Pixels by which rounding can move an image: 200 units in the last place of the radius, for the type of `like`."""
    return 200 * epsilon(like) * camera.radius


def _padded(camera: RadialCamera, box: Box) -> Box:
    """A box grown by what rounding can amount to."""
    pad = rounding(camera, box.low[0])
    return Box(vector(box.low[0] - pad, box.low[1] - pad), vector(box.high[0] + pad, box.high[1] + pad), box.valid)
