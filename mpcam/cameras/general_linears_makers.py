"""Ways to put general linear cameras together: beside each other, along a path, around a thing, over a grid of rays."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from mpcam.checks import is_number, number_table, shown, three_numbers, whole_number
from mpcam.errors import InputError
from mpcam.math import PI
from mpcam.math.pose import look_at

if TYPE_CHECKING:
    from mpcam.cameras.base import Camera


class PiecewiseMakers:
    """The classmethods of `GeneralLinears` that make one."""

    @classmethod
    def beside(cls, cameras: "Sequence[Any]", camera_from_world: Any = None) -> Self:
        """`GeneralLinear` cameras of one height from left to right, each with its own image and pose.

        camera_from_world: 4x4, the frame that carries them all; their poses are from the world to them before it moves.
        Raises InputError where there is no camera, one is of another class, or heights differ.
        """
        from mpcam.cameras.general_linear import GeneralLinear

        given = list(cameras)
        if not given or not all(isinstance(camera, GeneralLinear) for camera in given):
            kinds = sorted({type(camera).__name__ for camera in given})
            raise InputError(f"GeneralLinears.beside: give GeneralLinear cameras, got {', '.join(kinds) or 'none'}")
        heights = {camera.height for camera in given}
        if len(heights) > 1:
            raise InputError(f"GeneralLinears.beside: the cameras are {sorted(heights)} pixels high: give one height")
        ends = np.cumsum([0, *(camera.width for camera in given)])
        image = [
            camera.places * (camera.width, camera.height) + (left, 0)
            for camera, left in zip(given, ends[:-1], strict=True)
        ]
        rays = np.array([camera.rays for camera in given], np.float64)
        frames = np.array([camera.camera_from_world for camera in given])
        return cls._made(rays, image, ends, (0, given[0].height), frames, camera_from_world)

    @classmethod
    def along_path(
        cls,
        path: Any,
        slits: Any,
        width: int,
        height: int,
        slope: tuple[float, float] = (-0.5, 0.5),
        *,
        up: Any = (0.0, 0.0, 1.0),
        away: bool = False,
        columns: Any = None,
        camera_from_world: Any = None,
    ) -> Self:
        """Crossed slits along a path: from each of its points a column of pixels looks at an upright slit, or away.

        path (N + 1, 3): corners of a polyline at one height; the image shows it from left to right or, where that is
        the way the cameras see it, from its end. slits (N, 3): a point of the upright second slit of each segment. The
        image is continuous where the slits of two segments and the corner between them lie in one upright plane; rows
        are fitted so that it is. slope: vertical way over horizontal way of the lowest and the highest row at the first
        corner. up (3,). away: look away from the slits instead of at them. columns (N,): pixels of each segment,
        default as equal as can be. Raises InputError for shapes that do not fit, segments of no length, slits in line
        with their segment, and columns that do not add up to the width.
        """
        points, axes = _rows(path, "path"), _rows(slits, "slits")
        if len(points) < 2 or len(axes) != len(points) - 1:
            raise InputError(
                f"along_path: a path of {len(points)} points has {max(len(points) - 1, 0)} segments: give 2 points or "
                f"more, and a slit for each segment, not {len(axes)}"
            )
        upright = _unit(up, "up")
        low, high = _slopes(slope)
        ends = _ends(columns, whole_number("width", width, len(axes), of="along_path", unit="pixels"), len(axes))
        rise = points @ upright
        if np.ptp(rise) > 1e-9 * max(np.abs(points).max(), 1e-300):
            raise InputError("along_path: the path must stay at one height, at right angles to up")
        rays, frames, scale, last = [], [], None, 1.0
        for number, (p, q, axis) in enumerate(zip(points[:-1], points[1:], axes, strict=True)):
            chord = q - p
            length = np.linalg.norm(chord)
            axis = axis - ((axis - p) @ upright) * upright
            normal = np.cross(upright, chord)
            if length > 0:
                normal /= length
            distance = float((axis - p) @ normal)
            if not abs(distance) > 1e-9 * max(length, np.linalg.norm(axis - p)):
                raise InputError(f"along_path: segment {number} has no length, or its slit lies in line with it")
            normal = normal if (distance > 0) != away else -normal
            toward = [(axis - end) / (-abs(distance) if away else abs(distance)) for end in (p, q)]
            start, stop = (float(np.linalg.norm(direction)) for direction in toward)
            scale = start if scale is None else scale * start / last
            last = stop
            frame = look_at(p, p + normal, upright)
            corners = []
            for end, direction, rows in ((p, toward[0], high), (q, toward[1], high), (p, toward[0], low)):
                place = frame[:3, :3] @ end + frame[:3, 3]
                along = frame[:3, :3] @ (direction + scale * rows * upright)
                corners.append([*(along[:2] / along[2]), *place[:2]])
            rays.append(corners)
            frames.append(frame)
        rays, frames = np.array(rays), np.array(frames)
        image = np.array([[(a, 0), (b, 0), (a, height)] for a, b in zip(ends[:-1], ends[1:], strict=True)], np.float64)
        if (rays[:, 1, 2] < rays[:, 0, 2]).all():  # seen from this side, the path runs from right to left
            widths = np.diff(ends)[::-1]
            ends = np.cumsum([0, *widths])
            rays, frames = rays[::-1], frames[::-1]
            image = np.array([[(b, 0), (a, 0), (b, height)] for a, b in zip(ends[:-1], ends[1:], strict=True)], float)
        return cls._made(rays, image, ends, (0, height), frames, camera_from_world)

    @classmethod
    def around(
        cls,
        center: Any,
        radius: float,
        extent: float,
        width: int,
        height: int,
        pieces: int = 36,
        *,
        turn: tuple[float, float] = (0.0, 2 * PI),
        up: Any = (0.0, 0.0, 1.0),
        outward: bool = False,
        camera_from_world: Any = None,
    ) -> Self:
        """A panorama of crossed slits that share the upright axis of a circle (Yu et al. 2009, section 5.1).

        Each column stands at a place of the circle and looks through the axis, so that the image shows a thing on the
        axis from all sides at once; outward, it shows what is around. center (3,), radius: of the circle, of which each
        piece takes a chord. extent: height of what is seen at the distance of a radius from the circle, scene units.
        turn: angles at which the image begins and ends, radians, from the world axis x (or z, if x is upright). Raises
        InputError for sizes that are not positive, turns of more than a circle, and pieces of half a turn or more.
        """
        middle, upright = three_numbers("center", center), _unit(up, "up")
        for name, value in (("radius", radius), ("extent", extent)):
            if not is_number(value) or not value > 0:
                raise InputError(f"around({name}={shown(value)}): a number above 0 is needed")
        count = whole_number("pieces", pieces, 1, of="around")
        first, last = _slopes(turn, "turn")
        if last - first > 2 * PI * (1 + 1e-12) or (last - first) / count >= 0.999 * PI:
            raise InputError(
                f"around(turn={shown(turn)}, pieces={pieces}): give at most a whole turn, and pieces of less than half"
            )
        ahead = np.array([1.0, 0.0, 0.0]) if abs(upright[0]) < 0.9 else np.array([0.0, 0.0, 1.0])
        ahead = ahead - (ahead @ upright) * upright
        ahead /= np.linalg.norm(ahead)
        side = np.cross(upright, ahead)
        angles = np.linspace(first, last, count + 1)[:, None]
        path = middle + radius * (np.cos(angles) * ahead + np.sin(angles) * side)
        if last - first >= 2 * PI * (1 - 1e-12):
            path[-1] = path[0]
        steep = 0.5 * extent / radius
        return cls.along_path(
            path,
            np.tile(middle, (count, 1)),
            width,
            height,
            (-steep, steep),
            up=upright,
            away=outward,
            camera_from_world=camera_from_world,
        )

    @classmethod
    def over_grid(cls, rays: Any, width: int, height: int, camera_from_world: Any = None) -> Self:
        """Rays at the corners of a grid over the image, and between them a general linear camera over each half tile.

        rays (R + 1, C + 1, 4): (sigma, tau, u, v) in the camera frame, row by row from the upper left corner of the
        image. All in one frame, so the image is continuous. Raises InputError for other shapes, and for more tiles
        along a side than pixels.
        """
        table: Any = np.asarray(rays, np.float64)
        if table.ndim != 3 or table.shape[2] != 4 or min(table.shape[:2]) < 2:
            raise InputError(f"over_grid: rays have shape {table.shape}: give (R + 1, C + 1, 4), R and C 1 or more")
        down, across = table.shape[0] - 1, table.shape[1] - 1
        columns = _ends(None, whole_number("width", width, across, of="over_grid", unit="pixels"), across)
        rows = _ends(None, whole_number("height", height, down, of="over_grid", unit="pixels"), down)
        places = np.stack(np.meshgrid(columns, rows), -1).astype(np.float64)

        def halves(corner: Any) -> np.ndarray:
            """Corners of both halves of all tiles."""
            a, b, c, d = corner[:-1, :-1], corner[:-1, 1:], corner[1:, :-1], corner[1:, 1:]
            both: Any = np.stack([np.stack([a, b, c], 2), np.stack([d, c, b], 2)], 2)
            return both.reshape(-1, 3, corner.shape[-1])

        return cls._made(halves(table), halves(places), columns, rows, None, camera_from_world)

    @classmethod
    def _made(cls, *fields: Any) -> Self:
        """The camera with these fields, in their order."""
        return cls(*fields)

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> "dict[str, Camera]":
        """A thing seen from three sides, and a grid of rays that fan out."""
        s, t = np.meshgrid(np.linspace(-1, 1, 4), np.linspace(-1, 1, 3))
        fan = np.stack([0.6 * s + 0.2 * t * s, 0.5 * t - 0.1 * s * s, 0.5 * s + 0.1 * t * t, 0.4 * t], -1)
        upright, pose = (0.0, -1.0, 0.0), camera_from_world
        middle = (0.0, 0.0, 3.0)
        return {
            "around": cls.around(
                middle, 2.5, 3.0, width, height, 3, turn=(2.0, 5.5), up=upright, camera_from_world=pose
            ),
            "grid": cls.over_grid(fan, max(width, 3), max(height, 2), pose),
        }  # pyright: ignore[reportReturnType]


def _ends(columns: Any, width: int, count: int) -> np.ndarray:
    """Pixels at which pieces begin and end."""
    if columns is None:
        return np.rint(np.linspace(0, width, count + 1)).astype(np.int64)
    given = np.asarray(columns)
    if given.shape != (count,) or given.dtype.kind not in "iu" or given.min() < 1 or given.sum() != width:
        raise InputError(f"columns={shown(columns)}: give {count} whole numbers of pixels that add up to {width}")
    return np.cumsum([0, *given])


def _slopes(value: Any, name: str = "slope") -> tuple[float, float]:
    pair: Any = value if isinstance(value, (tuple, list)) else ()
    if len(pair) != 2 or not all(is_number(end) for end in pair) or not pair[0] < pair[1]:
        raise InputError(f"{name}={shown(value)}: give two finite numbers that rise")
    return float(pair[0]), float(pair[1])


def _rows(value: Any, name: str) -> np.ndarray:
    found = number_table(value)
    if found.ndim != 2 or found.shape[-1] != 3 or not np.isfinite(found).all():
        raise InputError(f"{name} has shape {np.shape(value)}: give finite numbers of shape (N, 3), one row per point")
    return found


def _unit(value: Any, name: str) -> np.ndarray:
    direction = three_numbers(name, value)
    if not direction.any():
        raise InputError(f"{name} is zero: give a direction")
    return direction / np.linalg.norm(direction)
