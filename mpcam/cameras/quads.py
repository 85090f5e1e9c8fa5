"""The paper's quads: a quadrilateral around each curved edge, and the box of all three (Gascuel et al. 2008, 3.4, 4).

Cheap to set up and loose. The cosine-sphere's ellipse arcs are held by a rectangle along the ellipse's axes, the
paraboloid's circle arcs by the chord, its perpendiculars at the ends and the parallel tangent; other profiles take the
generic strategy of 4.6: the outer side is the tangent, at the middle azimuth, of the circle with the largest radius.
"""

from mpcam.cameras.arcs import RadialCamera, arc_box, image_and_slopes, radial_bound, visible_part
from mpcam.cameras.profiles import COSINE_SPHERE, PARABOLOID
from mpcam.cameras.types import Box
from mpcam.math import (
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

_FAR = 1e9  # pixels; stands for infinity


def radial_bound_quads(camera: RadialCamera, a: Vector, b: Vector, c: Vector) -> Box:
    """Box of a triangle (camera frame): union of the boxes of its edges' quads, and of rim points inside it."""
    return radial_bound(camera, a, b, c, quad_box)


def quad_box(camera: RadialCamera, a: Vector, b: Vector) -> Box:
    """Box of the quad around the image of the great-circle arc between unit directions a and b."""
    along = dot(a, b)
    tangent = normalize(vector(*(b[i] - a[i] * along for i in range(3))))
    start, span, valid, twice = visible_part(camera, a, tangent, atan2(norm(cross(a, b)), along))

    def direction(s: Array) -> Vector:
        return vector(*(a[i] * cos(s) + tangent[i] * sin(s) for i in range(3)))

    ends = [direction(start), direction(start + span)]
    images = [image_and_slopes(camera, end)[0] for end in ends]
    if camera.profile is COSINE_SPHERE:
        corners = _ellipse_rectangle(camera, ends)
    elif camera.profile is PARABOLOID:
        corners = _circle_quad(camera, ends, images)
    else:
        corners = _generic_quad(camera, ends, images)
    low, high = [], []
    for i in (0, 1):
        values = [corner[i] for corner in (*corners, *images)]
        small, large = values[0], values[0]
        for value in values[1:]:
            small, large = minimum(small, value), maximum(large, value)
        low.append(maximum(small, -_FAR))
        high.append(minimum(large, _FAR))
    # Quads hold arcs in front of the camera plane, which is all that the paper has; others get their tight box.
    tight = arc_box(camera, a, b)
    front = (ends[0][2] > -1e-6) & (ends[1][2] > -1e-6) & ~twice
    return Box(
        vector(*(where(front, low[i], tight.low[i]) for i in (0, 1))),
        vector(*(where(front, high[i], tight.high[i]) for i in (0, 1))),
        valid,
    )


def _axes(ends: list[Vector]) -> tuple[Vector, Vector, Array, Array]:
    """Image axes of an arc's great circle: towards its highest point, across, and sine and cosine of the angle there.

    A great circle in the camera plane has no highest point; any axis serves.
    """
    normal = normalize(cross(ends[0], ends[1]))
    level = sqrt(normal[0] * normal[0] + normal[1] * normal[1])
    flat = level < 1e-6
    safe = where(flat, 1.0, level)
    # The highest point of the circle is the camera axis projected onto its plane.
    side = where(normal[2] > 0, -1.0, 1.0)
    toward = vector(where(flat, 1.0, side * normal[0] / safe), where(flat, 0.0, side * normal[1] / safe))
    return toward, vector(-toward[1], toward[0]), abs(normal[2]), level


def _ellipse_rectangle(camera: RadialCamera, ends: list[Vector]) -> list[Vector]:
    """Rectangle along the axes of the ellipse arc; r = sin(theta) is an orthographic view of the unit sphere."""
    toward, across, short, _ = _axes(ends)
    low, high = [], []
    for axis in (toward, across):
        values = [end[0] * axis[0] + end[1] * axis[1] for end in ends]
        low.append(minimum(values[0], values[1]))
        high.append(maximum(values[0], values[1]))
    # The arc crosses the short axis where its ends lie on both sides of it.
    crosses = (low[1] <= 0) & (high[1] >= 0)
    high[0] = where(crosses, maximum(high[0], short), high[0])
    scale = camera.pixels_per_radius
    return [
        vector(camera.cx + scale * (u * toward[0] + v * across[0]), camera.cy + scale * (u * toward[1] + v * across[1]))
        for u in (low[0], high[0])
        for v in (low[1], high[1])
    ]


def _circle_quad(camera: RadialCamera, ends: list[Vector], images: list[Vector]) -> list[Vector]:
    """Chord, and the tangent parallel to it: the image of the arc is less than half a circle of radius 1 / sin(b).

    b is the angle of the great circle's highest point from the axis (equation 6 of the paper, whose sign is mended).
    The height over the chord comes from its length, not from the circle's center: a short chord of a large circle would
    lose all its digits there.
    """
    _, _, sine, _ = _axes(ends)
    radius = camera.pixels_per_radius / maximum(sine, 1e-12)  # hardly bent where the circle passes through the axis
    middle = vector(0.5 * (images[0][0] + images[1][0]), 0.5 * (images[0][1] + images[1][1]))
    chord = vector(images[1][0] - images[0][0], images[1][1] - images[0][1])
    squared = chord[0] * chord[0] + chord[1] * chord[1]
    length = sqrt(squared)
    out = vector(-chord[1] / where(length > 0, length, 1.0), chord[0] / where(length > 0, length, 1.0))
    # Outwards is where the arc's middle direction lands.
    arc_middle, _, _ = image_and_slopes(camera, vector(*(ends[0][i] + ends[1][i] for i in range(3))))
    side = where((arc_middle[0] - middle[0]) * out[0] + (arc_middle[1] - middle[1]) * out[1] < 0, -1.0, 1.0)
    # Near half a circle the height changes fast with the chord: a chord a little longer errs to the safe side.
    rest = sqrt(maximum(radius * radius - 0.25 * squared * (1 + 8 * epsilon(squared)), 0.0))
    height = 0.25 * squared / (radius + rest)
    shift = vector(side * out[0] * height, side * out[1] * height)
    return [vector(image[0] + shift[0], image[1] + shift[1]) for image in images]


def _generic_quad(camera: RadialCamera, ends: list[Vector], images: list[Vector]) -> list[Vector]:
    """Chord, its perpendiculars at the ends, and the tangent of the circle of the largest radius at the middle azimuth.

    Where the circle's tangent hardly faces the perpendiculars (an edge nearly through the axis), the quad is endless.
    """
    centered = [vector(image[0] - camera.cx, image[1] - camera.cy) for image in images]
    lengths = [sqrt(p[0] * p[0] + p[1] * p[1]) for p in centered]
    largest = maximum(lengths[0], lengths[1])
    units = [
        vector(p[0] / where(r > 0, r, 1.0), p[1] / where(r > 0, r, 1.0)) for p, r in zip(centered, lengths, strict=True)
    ]
    middle = vector(units[0][0] + units[1][0], units[0][1] + units[1][1])
    size = sqrt(middle[0] * middle[0] + middle[1] * middle[1])
    middle = vector(middle[0] / where(size > 0, size, 1.0), middle[1] / where(size > 0, size, 1.0))
    chord = vector(centered[1][0] - centered[0][0], centered[1][1] - centered[0][1])
    length = sqrt(chord[0] * chord[0] + chord[1] * chord[1])
    out = vector(-chord[1] / where(length > 0, length, 1.0), chord[0] / where(length > 0, length, 1.0))
    facing = out[0] * middle[0] + out[1] * middle[1]
    out = vector(where(facing < 0, -out[0], out[0]), where(facing < 0, -out[1], out[1]))
    facing = abs(facing)
    wild = (size < 1e-3) | (facing < 1e-3) | (length == 0)
    corners = []
    for p, image in zip(centered, images, strict=True):
        t = (largest - (p[0] * middle[0] + p[1] * middle[1])) / where(wild, 1.0, facing)
        t = maximum(t, 0.0)
        corners.append(vector(image[0] + t * out[0], image[1] + t * out[1]))
    for sign in (-1.0, 1.0):
        corners.append(
            vector(
                where(wild, camera.cx + sign * camera.radius, corners[0][0]),
                where(wild, camera.cy + sign * camera.radius, corners[0][1]),
            )
        )
    return corners
