"""Box and three lines around a small curved triangle, from what each vertex knows of the projection around it.

For images that are symmetric about the axis, pixel = center + focal * (s x, s y) with s = f(theta) / rho. A point that
moves along v has the image velocity focal * (s v_xy + (p (v . xy) - q v_z) xy), where p and q too depend on the point
alone. So s, p and q are worked out once per vertex, and a triangle needs no angle and no profile.

An arc that turns one way and by less than 30 degrees stays between its chord and the crossing of the tangents at its
ends: the crossing bounds it along each image axis, and across the chord.
"""

from typing import NamedTuple, Protocol

from mpcam.cameras.profiles import Profile
from mpcam.cameras.symmetric import radius_of
from mpcam.cameras.types import Box
from mpcam.math import (
    PI,
    Array,
    Vector,
    absolute,
    atan2,
    dot,
    epsilon,
    isfinite,
    maximum,
    minimum,
    sqrt,
    vector,
    where,
)

NEAR, UNSURE, HIDDEN = 0.0, 1.0, 2.0
"""Where a vertex is: well inside of the view; elsewhere; in the convex region that no pixel sees."""

_SHARP = 2e-3  # pixels; chord triangles less high than this have no sure orientation in float32


class VertexView(NamedTuple):
    """What a vertex knows of the projection around it: s, p and q (see above), and where it is."""

    s: Array
    p: Array
    q: Array
    place: Array


class Outlined(Protocol):
    """A camera that outlines triangles from their corners."""

    def local_vertex_view(self, point: Vector) -> "VertexView": ...
    def local_outline(self, points: list[Vector], views: list["VertexView"]) -> tuple["Outline", Array]: ...
    def local_bound_rough(self, a: Vector, b: Vector, c: Vector) -> Box: ...


class Outline(NamedTuple):
    """A box, and three lines (a, b, c) with a u + b v + c >= 0 for all pixels (u, v) of the image, a^2 + b^2 = 1.

    Lines are (0, 0, 1), which holds everywhere, where none are known.
    """

    low: Vector
    high: Vector
    valid: Array
    lines: tuple[Vector, Vector, Vector]


def symmetric_vertex_view(profile: Profile, view: Array, end: Array, point: Vector) -> VertexView:
    """The lens of a point in the camera frame (any length).

    view: angle from the axis that the image reaches to, radians; end: from where on no point has an image.
    """
    x, y, z = point
    squared = x * x + y * y
    length_squared = squared + z * z
    off_axis = squared > 1e-30 * length_squared
    safe, length = where(off_axis, squared, 1.0), where(length_squared > 0, length_squared, 1.0)
    rho = sqrt(safe)
    theta = atan2(sqrt(squared), z)
    slope = profile.slope(minimum(theta, profile.reach))
    flat = slope / where(z > 0, z, 1.0)
    s = where(off_axis, radius_of(profile, theta, rho, z) / rho, flat)
    q = slope / length
    p = where(off_axis, (q * z - s) / safe, 0.0)
    # Edges of at most 45 degrees between corners nearer than 153 degrees keep away from the point behind the eye.
    near = (theta < minimum(view, minimum(0.95 * profile.limit, 0.85 * PI))) & (length_squared > 0)
    # What a view does not see is a cone around the point behind the eye, convex from 180 degrees of view on.
    hidden = theta > maximum(end, 0.5 * PI) + 1e-5
    place = where(hidden, HIDDEN, where(near, NEAR if profile.convex else UNSURE, UNSURE))
    return VertexView(s, p, q, place)


def small_outline(
    center: tuple[Array, Array], focal: tuple[Array, Array], points: list[Vector], views: list[VertexView]
) -> tuple[Outline, Array]:
    """Outline of a triangle from its corners (camera frame), and whether it holds; else look for a rougher one.

    An outline that holds is not valid where the triangle is hidden, or has corners that are not finite.
    """
    finite = isfinite(sum(point[i] for point in points for i in range(3)))
    places = [lens.place for lens in views]
    hidden = minimum(minimum(places[0], places[1]), places[2]) >= HIDDEN
    sure = maximum(maximum(places[0], places[1]), places[2]) <= NEAR
    images = [
        vector(center[0] + focal[0] * (lens.s * point[0]), center[1] + focal[1] * (lens.s * point[1]))
        for point, lens in zip(points, views, strict=True)
    ]
    low = [minimum(minimum(images[0][i], images[1][i]), images[2][i]) for i in (0, 1)]
    high = [maximum(maximum(images[0][i], images[1][i]), images[2][i]) for i in (0, 1)]
    area, lengths = _turn(images[0], images[1], images[2]), []
    bulges = []
    for k in range(3):
        after = (k + 1) % 3
        a, b, m0, m1 = points[k], points[after], images[k], images[after]
        step = vector(*(b[i] - a[i] for i in range(3)))
        g0, g1 = _velocity(focal, a, views[k], step), _velocity(focal, b, views[after], step)
        agreement = g0[0] * g1[0] + g0[1] * g1[1]
        speeds = (g0[0] * g0[0] + g0[1] * g0[1]) * (g1[0] * g1[0] + g1[1] * g1[1])
        sure = sure & ((speeds == 0) | ((agreement > 0) & (agreement * agreement > 0.75 * speeds)))
        along = dot(a, b)
        sure = sure & (along > 0) & (along * along > 0.49 * (dot(a, a) * dot(b, b)))
        turn = g0[0] * g1[1] - g0[1] * g1[0]
        chord = vector(m1[0] - m0[0], m1[1] - m0[1])
        length = sqrt(chord[0] * chord[0] + chord[1] * chord[1])
        reach = (chord[0] * g1[1] - chord[1] * g1[0]) / where(turn != 0, turn, 1.0)
        # Of turns as small as rounding all that is known is how small: a fourth of it, over the chord, is the bulge.
        least = 1e3 * epsilon(turn)
        straight = absolute(turn) <= least * agreement
        unknown = where(straight, 0.25 * least * length, 0.0)
        reach = where(straight, 0.0, maximum(reach, 0.0))
        for i in (0, 1):
            crossing = m0[i] + g0[i] * reach
            beyond = where(straight, maximum(m0[i], m1[i]) + unknown, crossing)
            before = where(straight, minimum(m0[i], m1[i]) - unknown, crossing)
            high[i] = maximum(high[i], where((g0[i] > 0) & (g1[i] < 0), beyond, high[i]))
            low[i] = minimum(low[i], where((g0[i] < 0) & (g1[i] > 0), before, low[i]))
        bulges.append((reach * (chord[0] * g0[1] - chord[1] * g0[0]), unknown))
        lengths.append(length)
    # The chords' triangle turned over against the real one: an angle of the image is beyond 180 degrees.
    volume = dot(points[0], _cross_of_steps(points))
    longest = maximum(maximum(lengths[0], lengths[1]), lengths[2])
    lined = (absolute(area) > _SHARP * longest) & (area * where(volume < 0, -1.0, 1.0) > 0)
    side = where(area < 0, -1.0, 1.0)
    lines = []
    for k in range(3):
        m0, m1, (bulge, unknown) = images[k], images[(k + 1) % 3], bulges[k]
        inverse = side / where(lengths[k] > 0, lengths[k], 1.0)
        a, b = (m0[1] - m1[1]) * inverse, (m1[0] - m0[0]) * inverse
        across, down = a * m0[0], b * m0[1]
        doubt = 4 * epsilon(across) * (absolute(across) + absolute(down))  # pixels, of corners far outside of the image
        c = maximum(-bulge * inverse, 0.0) + unknown - (across + down) + doubt
        usable = lined & (lengths[k] > 0)
        lines.append(vector(where(usable, a, 0.0), where(usable, b, 0.0), where(usable, c, 1.0)))
    outline = Outline(vector(*low), vector(*high), finite & ~hidden, (lines[0], lines[1], lines[2]))
    return outline, sure | hidden | ~finite


def outline(camera: "Outlined", a: Vector, b: Vector, c: Vector) -> Outline:
    """Outline of a triangle by its corners (camera frame): that of `local_outline`, or the rough box."""
    points = [a, b, c]
    quick, sure = camera.local_outline(points, [camera.local_vertex_view(point) for point in points])
    rough = without_lines(camera.local_bound_rough(a, b, c))

    def chosen(first: Vector, second: Vector) -> Vector:
        return vector(*(where(sure, first[i], second[i]) for i in range(len(first))))

    lines = [chosen(*pair) for pair in zip(quick.lines, rough.lines, strict=True)]
    return Outline(
        chosen(quick.low, rough.low),
        chosen(quick.high, rough.high),
        (sure & quick.valid) | (~sure & rough.valid),
        (lines[0], lines[1], lines[2]),
    )


def without_lines(box: Box) -> Outline:
    """A box as an outline."""
    zero = 0.0 * box.low[0]
    everywhere = vector(zero, zero, zero + 1.0)
    return Outline(box.low, box.high, box.valid, (everywhere, everywhere, everywhere))


def _velocity(focal: tuple[Array, Array], point: Vector, lens: VertexView, step: Vector) -> Vector:
    """Image velocity of a point that moves along `step`."""
    pull = lens.p * (point[0] * step[0] + point[1] * step[1]) - lens.q * step[2]
    return vector(focal[0] * (lens.s * step[0] + pull * point[0]), focal[1] * (lens.s * step[1] + pull * point[1]))


def _turn(a: Vector, b: Vector, c: Vector) -> Array:
    """Twice the signed area of an image triangle."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _cross_of_steps(points: list[Vector]) -> Vector:
    """(b - a) x (c - a), exact for small triangles but for a rounding."""
    a, b, c = points
    u, v = [b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)]
    return vector(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
