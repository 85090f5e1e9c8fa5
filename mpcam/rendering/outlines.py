"""The bounds that can be asked for, as the kernels want them: outlines of triangles from the rows of their corners."""

from collections.abc import Callable
from typing import Any

from mpcam.cameras.chords import chord_pieces
from mpcam.cameras.outline import HIDDEN, VertexView, without_lines
from mpcam_kernels.regions import PixelOutline

ROWS = {"tight": 2, "quad": 1, "triangle": 1, "straight": 1}
"""Rows of four numbers per vertex that each bound reads."""

PIECES = {"triangle": 4}
"""Most outlines of one triangle, where it is not one."""


def tight(camera: Any, rows: list[list[Any]]) -> list[PixelOutline]:
    """By the tangents at the corners; the camera's rough box where these are not enough."""
    points = [row[0].xyz for row in rows]
    views = [VertexView(row[1].x, row[1].y, row[1].z, row[0].w) for row in rows]
    quick, sure = camera.local_outline(points, views)
    return [_or_box(points, quick, sure, camera.local_bound_rough)]


def quad(camera: Any, rows: list[list[Any]]) -> list[PixelOutline]:
    """The box of the quads around the curved edges."""
    return [_kernel_outline(without_lines(camera.local_bound_quads(*(row[0].xyz for row in rows))))]


def triangle(camera: Any, rows: list[list[Any]]) -> list[PixelOutline]:
    """Up to four bounding triangles; the camera's own box where these are not sure."""
    points = [row[0].xyz for row in rows]
    (first, *others), sure = chord_pieces(camera, *points)
    rest = [PixelOutline(piece.low, piece.high, piece.valid & sure, piece.lines) for piece in others]
    return [_or_box(points, first, sure, camera.local_bound), *rest]


def straight(camera: Any, rows: list[list[Any]]) -> list[PixelOutline]:
    """Straight-edged image triangles; without an image where a corner is not finite."""
    import drjit as dr

    from mpcam_kernels import pixel_triangle

    a, b, c = (row[0].xyz for row in rows)
    low, high = dr.minimum(dr.minimum(a, b), c), dr.maximum(dr.maximum(a, b), c)
    area = pixel_triangle.turn(a, b, c)
    lines = []
    for p, q in ((a, b), (b, c), (c, a)):
        step = q.xy - p.xy
        length = dr.sqrt(dr.squared_norm(step))
        # Far from the image, rounding of a corner moves a line by more than the pixel that it is to spare.
        usable = (area != 0) & (length > 0) & (dr.abs(p.x) + dr.abs(p.y) + length < 1e5)
        inverse = dr.select(area < 0, -1.0, 1.0) / dr.select(usable, length, 1.0)
        u, v = -step.y * inverse, step.x * inverse
        kept = (dr.select(usable, u, 0), dr.select(usable, v, 0), dr.select(usable, -(u * p.x + v * p.y), 1))
        lines.append(type(a)(*kept))
    finite = dr.isfinite(a.x + b.x + c.x + a.y + b.y + c.y + a.z + b.z + c.z)
    return [PixelOutline(low.xy, high.xy, finite, (lines[0], lines[1], lines[2]))]


def hidden_by_view(first: list[Any]) -> Any:
    """Whether all corners lie in the convex region that no pixel sees."""
    import drjit as dr

    return dr.minimum(dr.minimum(first[0].w, first[1].w), first[2].w) >= HIDDEN


def hidden_never(first: list[Any]) -> Any:
    """For bounds that know it from the outline only."""
    return first[0].w != first[0].w


HIDDEN_TESTS = {"tight": hidden_by_view}
OUTLINES = {"tight": tight, "quad": quad, "triangle": triangle, "straight": straight}


def _or_box(points: list[Any], outline: Any, sure: Any, bound: Callable[..., Any]) -> PixelOutline:
    """The outline, or where it is not sure a box, which is worked out only there."""
    import drjit as dr

    kind = type(points[0].x)

    def box(a: Any, b: Any, c: Any, *_: Any) -> tuple[Any, ...]:
        return _flat(kind, without_lines(bound(a, b, c)))

    def keep(a: Any, b: Any, c: Any, *rest: Any) -> tuple[Any, ...]:
        return rest

    return _nested(dr.if_stmt((*points, *_flat(kind, outline)), ~sure, box, keep))


def _flat(kind: Any, outline: Any) -> tuple[Any, ...]:
    """An outline as plain arrays, which a branch of a kernel can return."""
    numbers = [*outline.low, *outline.high, *(n for line in outline.lines for n in line)]
    return (*(kind(n) for n in numbers), outline.valid)


def _nested(values: Any) -> PixelOutline:
    """The outline at the end of what a branch returned."""
    *numbers, valid = values[-14:]
    first, second, third = (numbers[k : k + 3] for k in (4, 7, 10))
    return PixelOutline(numbers[0:2], numbers[2:4], valid, (first, second, third))


def _kernel_outline(outline: Any) -> PixelOutline:
    return PixelOutline(outline.low, outline.high, outline.valid, outline.lines)
