"""The paper's bounding triangles: lines parallel to the chords of a triangle's curved edges (Gascuel et al. 2008, 3.3).

A triangle in view gives one bounding triangle. One with a corner out of view leaves a quadrilateral, cut in two along a
diagonal; one with two gives a triangle whose third side is an arc of the rim. Each of these is cut in two on a bisector
if its chords are the wrong way round: four pieces at most.

Other than in the paper, a line clears the control points of all sides of its piece that bend outwards, not just those
of its own side: a piece lies in the convex hull of its outline. So it holds its part of the image whichever way its
chords run; that decides only how tight it is. Where the outline is in doubt, one piece has the box of `radial_bound`.
"""

from typing import NamedTuple

from mpcam.cameras.arcs import (
    RadialCamera,
    bounding_cone,
    image_and_slopes,
    radial_bound,
    rounding,
    unit_corners,
    visible_part,
)
from mpcam.cameras.hulls import Hull, area_2d, edge_hull, minus, rim_hull, unit_2d
from mpcam.cameras.outline import Outline, without_lines
from mpcam.cameras.types import Box
from mpcam.math import (
    PI,
    Array,
    Vector,
    atan2,
    cos,
    cross,
    dot,
    epsilon,
    maximum,
    minimum,
    norm,
    normalize,
    sin,
    sqrt,
    vector,
    where,
)

_LONGEST = -0.9995  # cosine of 178 degrees; the plane of a longer edge is lost to rounding
_BEHIND = 0.05  # radians around the point behind the eye in which azimuths are lost


class _Curved(NamedTuple):
    """A curved triangle within the view; to be cut in two, from its first corner to `foot`, where `cut` holds.

    acute: whether the angle at the first corner, or at that corner of both halves, is below 90 degrees.
    """

    corners: list[Vector]
    foot: Vector
    cut: Array
    acute: Array


def radial_bound_triangles(camera: RadialCamera, a: Vector, b: Vector, c: Vector) -> list[Outline]:
    """Four pieces, valid or not, whose union holds the image of a triangle (camera frame) within the view."""
    return pieces_or_box(*chord_pieces(camera, a, b, c), radial_bound(camera, a, b, c))


def pieces_or_box(pieces: list[Outline], sure: Array, box: Box) -> list[Outline]:
    """The pieces where they hold; elsewhere the box alone, as the first of them."""
    first, *others = pieces
    rough = without_lines(box)
    lines = [_either(sure, line, nothing) for line, nothing in zip(first.lines, rough.lines, strict=True)]
    low, high = _either(sure, first.low, rough.low), _either(sure, first.high, rough.high)
    first = Outline(low, high, (first.valid & sure) | (rough.valid & ~sure), (lines[0], lines[1], lines[2]))
    return [first, *(piece._replace(valid=piece.valid & sure) for piece in others)]


def chord_pieces(camera: RadialCamera, a: Vector, b: Vector, c: Vector) -> tuple[list[Outline], Array]:
    """Four pieces around a triangle, and whether they hold its image; if not, take a rougher bound.

    Much cheaper than `radial_bound`, which kernels better leave to the triangles that need it. Never sure of profiles
    without `convex`. Triangles out of view, or not finite, surely have no piece.
    """
    corners, finite = unit_corners(a, b, c)
    if not camera.profile.convex:
        none = finite & ~finite
        zero = 0.0 * corners[0][0]
        return [without_lines(Box(vector(zero, zero), vector(zero, zero), none)) for _ in range(4)], none
    half = 0.5 * camera.fov + 0.0 * corners[0][2]
    rim = half + 4 * PI * epsilon(half)  # as far as the projection goes
    inside = [atan2(sqrt(p[0] * p[0] + p[1] * p[1]), p[2]) <= rim for p in corners]
    # Turned so that the only corner in view comes first, or the only one out of view comes last.
    p, q, r = _turned(corners, inside[1] & ~inside[0], inside[2] & ~inside[1])
    count = sum(where(some, 1, 0) for some in inside)
    all_in, one_out, two_out = count == 3, count == 2, count == 1
    volume = dot(p, cross(minus(q, p), minus(r, p)))
    turn = where(volume < 0, -1.0, 1.0)

    (pq, split_pq), (qr, split_qr), (pr, split_pr) = (_leaves(camera, *edge) for edge in ((p, q), (q, r), (p, r)))
    # The diagonal that meets the rim more steeply stays in view wherever one of them does.
    steep_p, steep_q = p[2] - dot(p, qr) * cos(half), q[2] - dot(q, pr) * cos(half)
    other = one_out & (steep_q > steep_p)
    inner = _inner(camera, [p, q, _either(all_in, r, _either(other, pr, qr))], turn)
    outer, reached = _outer(camera, [_either(other, q, p), _either(two_out, pq, qr), pr], turn)
    at_rim = one_out | two_out
    first, wild_inner = _halves(camera, inner, turn, all_in | one_out, False)
    last, wild_outer = _halves(camera, outer, turn, at_rim, True)

    # A view below 180 degrees may see a triangle, but none of its corners. In a wider one, what is hidden can stand in
    # the way of both diagonals, or cut an edge in two.
    doubt = wild_inner | wild_outer | ((count == 0) & (half < 0.5 * PI))
    doubt = doubt | (one_out & (maximum(steep_p, steep_q) < -1e-6)) | split_pq | split_qr | split_pr
    doubt = doubt | (at_rim & outer.cut & ~reached) | _around(corners, half, all_in)
    # Where the corners and the eye lie in one plane, it is lost which way the rim is followed, and on which side of a
    # triangle around the eye its inside is.
    flat = abs(volume) <= 8 * epsilon(volume) * (norm(minus(q, p)) + norm(minus(r, p)))
    doubt = doubt | (flat & (at_rim | bounding_cone(corners).wide))
    for i in range(3):
        doubt = doubt | (dot(corners[i], corners[(i + 1) % 3]) < _LONGEST) | (dot(corners[i], corners[i]) < 0.5)
    pieces = [piece._replace(valid=piece.valid & finite) for piece in (*first, *last)]
    return pieces, ~doubt


def _either(condition: Array, p: Vector, q: Vector) -> Vector:
    return vector(*(where(condition, p[i], q[i]) for i in range(len(p))))


def _turned(corners: list[Vector], second: Array, third: Array) -> list[Vector]:
    """The corners in the same cyclic order, from the second or the third one on where these masks hold."""
    return [_either(second, corners[(i + 1) % 3], _either(third, corners[(i + 2) % 3], corners[i])) for i in range(3)]


def _along(camera: RadialCamera, p: Vector, toward: Vector, length: Array) -> tuple[Vector, Array, Array]:
    """Where the arc from p towards another direction leaves the view, how far along, and if it is seen in two parts."""
    along = dot(p, toward)
    tangent = normalize(vector(*(toward[i] - p[i] * along for i in range(3))))
    start, span, _, split = visible_part(camera, p, tangent, length)
    end = start + span
    return vector(*(p[i] * cos(end) + tangent[i] * sin(end) for i in range(3))), end, split


def _leaves(camera: RadialCamera, p: Vector, q: Vector) -> tuple[Vector, Array]:
    """Where the edge from p to q leaves the view, and whether it is seen in two parts."""
    point, _, split = _along(camera, p, q, atan2(norm(cross(p, q)), dot(p, q)))
    return point, split


def _around(corners: list[Vector], half: Array, all_in: Array) -> Array:
    """Whether the point behind the eye lies in a triangle with its corners in view, or so near that azimuths are lost.

    half: half the field of view, radians. A view of up to 180 degrees has no such triangles.
    """
    blurred = half > PI - _BEHIND
    normals = [normalize(cross(corners[(i + 1) % 3], corners[(i + 2) % 3])) for i in range(3)]
    facing = where(dot(corners[0], normals[0]) < 0, -1.0, 1.0)
    highest = maximum(maximum(facing * normals[0][2], facing * normals[1][2]), facing * normals[2][2])
    cone = bounding_cone(corners)
    near = (highest <= where(blurred, _BEHIND, 1e-5)) & (cone.wide | (cone.theta + cone.spread >= PI - _BEHIND))
    return (all_in & (half > 0.5 * PI) & near) | (blurred & ~all_in)


def _middle(v: Vector, x: Vector, y: Vector) -> Vector:
    """Where the bisector of the angle at v meets the edge from x to y."""
    to_x, to_y = norm(cross(v, x)), norm(cross(v, y))
    return normalize(vector(*(x[i] * to_y + y[i] * to_x for i in range(3))))


def _inverted(camera: RadialCamera, images: list[Vector], turn: Array) -> Array:
    """Whether the chords run the other way round than the triangle, by more than rounding."""
    x, y = minus(images[1], images[0]), minus(images[2], images[0])
    longest = abs(x[0]) + abs(x[1]) + abs(y[0]) + abs(y[1])
    return turn * area_2d(x, y) < -rounding(camera, longest) * longest


def _inner(camera: RadialCamera, corners: list[Vector], turn: Array) -> _Curved:
    """A triangle of three edges; its largest angle, which is opposite to its longest edge, comes first."""
    sides = [minus(corners[(i + 2) % 3], corners[(i + 1) % 3]) for i in range(3)]
    squares = [dot(side, side) for side in sides]
    second = (squares[1] > squares[0]) & (squares[1] >= squares[2])
    corners = _turned(corners, second, (squares[2] > squares[0]) & ~second)
    cut = _inverted(camera, [image_and_slopes(camera, p)[0] for p in corners], turn)
    return _Curved(corners, _either(cut, _middle(*corners), corners[2]), cut, cut)


def _outer(camera: RadialCamera, corners: list[Vector], turn: Array) -> tuple[_Curved, Array]:
    """A triangle of two edges and the rim, opposite to its first corner, and whether a cut ends at the rim."""
    v, x, y = corners
    acute = dot(x, y) > dot(v, x) * dot(v, y)
    _, angle = rim_hull(camera, _azimuth(x), _azimuth(y), turn, acute)
    cut = (angle > PI) | _inverted(camera, [image_and_slopes(camera, p)[0] for p in corners], turn)
    foot, length, _ = _along(camera, v, _middle(v, x, y), PI + 0.0 * angle)
    return _Curved(corners, _either(cut, foot, y), cut, acute | cut), length < 0.999 * PI


def _azimuth(p: Vector) -> Vector:
    return unit_2d(p, 0.0, (1.0, 0.0))


def _halves(
    camera: RadialCamera, triangle: _Curved, turn: Array, exists: Array, at_rim: bool
) -> tuple[list[Outline], Array]:
    """Both pieces of a triangle, the second one only where it is cut, and whether their outlines are in doubt.

    turn: the sense of its corners. at_rim: whether the side opposite to the first one follows the rim.
    """
    v, x, y = triangle.corners
    foot, cut = triangle.foot, triangle.cut
    steps = [minus(x, v), minus(foot, v), minus(y, v), minus(foot, x), minus(y, foot)]
    image_v, from_v, _ = image_and_slopes(camera, v, steps[0], steps[1], steps[2])
    image_x, from_x, _ = image_and_slopes(camera, x, steps[0], steps[3])
    image_y, from_y, _ = image_and_slopes(camera, y, steps[2], steps[4])
    image_f, from_f, _ = image_and_slopes(camera, foot, steps[1], steps[3], steps[4])
    vx = edge_hull(camera, v, steps[0], (image_v, image_x), (from_v[0], from_x[0]))
    vf = edge_hull(camera, v, steps[1], (image_v, image_f), (from_v[1], from_f[0]))
    vy = edge_hull(camera, v, steps[2], (image_v, image_y), (from_v[2], from_y[0]))
    if not at_rim:
        xf = edge_hull(camera, x, steps[3], (image_x, image_f), (from_x[1], from_f[1]))
        fy = edge_hull(camera, foot, steps[4], (image_f, image_y), (from_f[2], from_y[1]))
    else:
        xf, _ = rim_hull(camera, _azimuth(x), _azimuth(foot), turn, triangle.acute)
        fy, _ = rim_hull(camera, _azimuth(foot), _azimuth(y), turn, triangle.acute)
    pieces = [
        _piece(camera, [image_v, image_x, image_f], [vx, xf, vf.reverse], turn, exists),
        _piece(camera, [image_v, image_f, image_y], [vf, fy, vy.reverse], turn, exists & cut),
    ]
    return pieces, exists & (vx.wild | xf.wild | vf.wild | (cut & (fy.wild | vy.wild)))


def _piece(camera: RadialCamera, corners: list[Vector], hulls: list[Hull], turn: Array, valid: Array) -> Outline:
    """Lines parallel to the chords, and the box, of the control points around a piece.

    A side that bends inwards adds nothing to the convex hull of the piece.
    """
    points = list(corners)
    for hull in hulls:
        points += [_either(hull.turn * turn > 0, point, corners[0]) for point in hull.points]
    pad = rounding(camera, corners[0][0])
    side = where(area_2d(minus(corners[1], corners[0]), minus(corners[2], corners[0])) < 0, -1.0, 1.0)
    lines = []
    for k in range(3):
        chord = unit_2d(minus(corners[(k + 1) % 3], corners[k]), 0.0, (1.0, 0.0))
        a, b = -side * chord[1], side * chord[0]
        inmost = a * points[0][0] + b * points[0][1]
        for point in points[1:]:
            inmost = minimum(inmost, a * point[0] + b * point[1])
        # Nothing reaches farther out than the rim.
        inmost = maximum(inmost, a * camera.cx + b * camera.cy - camera.radius)
        lines.append(vector(a, b, pad - inmost))
    low, high = [], []
    for i, center in enumerate((camera.cx, camera.cy)):
        least, most = points[0][i], points[0][i]
        for point in points[1:]:
            least, most = minimum(least, point[i]), maximum(most, point[i])
        low.append(maximum(least, center - camera.radius) - pad)
        high.append(minimum(most, center + camera.radius) + pad)
    return Outline(vector(*low), vector(*high), valid, (lines[0], lines[1], lines[2]))
