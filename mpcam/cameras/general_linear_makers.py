"""Ways to make general linear cameras: from three rays in space, and one for each kind, in terms of what it is for."""

from typing import Any, Self

import numpy as np

from mpcam.cameras.general_linear_given import (
    a_nonzero,
    a_number,
    a_slit,
    axis_pixel,
    focal_lengths,
    pixels_per_unit,
    ray_rows,
    seen_extent,
)
from mpcam.checks import three_numbers
from mpcam.errors import InputError
from mpcam.math.pose import look_at

CORNERS = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
"""Where makers put the three rays in the image, in widths and heights: left top, right top, left bottom."""


_ROUNDING = 64 * np.finfo(np.float64).eps
"""By how much rays that are parallel, or meet in one point, may differ there, relative to what they come from."""


class Makers:
    """The classmethods of `GeneralLinear` that make one. All images have square pixels unless two scales are given."""

    @classmethod
    def from_rays(
        cls,
        origins: Any,
        directions: Any,
        width: int = 512,
        height: int = 512,
        *,
        normal: Any = None,
        image: Any = CORNERS,
    ) -> Self:
        """The camera of three rays in the world.

        origins, directions (3, 3): by rows, scene units; directions of any length but zero. normal (3,): at right
        angles to the plane of the image; rays between the three are affine combinations of where they meet that plane
        and a parallel one, so it decides which camera it is. Default: the mean of the directions, brought to length 1.
        image (3, 2): where the three lie in the image, in widths and heights. The plane runs through the mean of the
        origins, and all rays start there. Raises InputError where rays run along the plane, or leave on both sides.
        """
        start, along = ray_rows(origins, "origins"), ray_rows(directions, "directions")
        lengths = np.linalg.norm(along, axis=1)
        if not lengths.all():
            raise InputError(f"from_rays: direction {int(np.argmin(lengths))} is zero: give a direction")
        along = along / lengths[:, None]
        axis = along.mean(axis=0) if normal is None else three_numbers("normal", normal)
        if not np.linalg.norm(axis) > 1e-12:
            raise InputError("from_rays: the directions cancel out, which leaves no normal: give normal=, a direction")
        axis = axis / np.linalg.norm(axis)
        axis = -axis if (along @ axis).sum() < 0 else axis
        slant = along @ axis
        if slant.min() <= 1e-12:
            number = int(np.argmin(slant))
            raise InputError(
                f"from_rays: direction {number} does not leave on the same side of the plane at right angles to the "
                f"normal {np.round(axis, 6).tolist()} as the others: give another normal="
            )
        reach = np.abs(start).max()
        pose = _frame(start.mean(axis=0), axis, start[0] - start[2])
        start, along = start @ pose[:3, :3].T + pose[:3, 3], along @ pose[:3, :3].T
        slopes = along[:, :2] / along[:, 2:]
        places = start[:, :2] - start[:, 2:] * slopes
        rays = np.concatenate([_same(slopes, 1.0), _same(places, reach)], axis=1)
        return cls(rays, width, height, image, camera_from_world=pose)  # pyright: ignore[reportCallIssue]

    @classmethod
    def pinhole(
        cls,
        width: int,
        height: int,
        fx: float | None = None,
        fy: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        camera_from_world: Any = None,
    ) -> Self:
        """The same rays as `Pinhole`, and the same parameters."""
        x, y = axis_pixel(width, height, cx, cy)
        fx, fy = focal_lengths(width, fx, fy)
        return cls._made(width, height, camera_from_world, lambda px, py: ((px - x) / fx, (py - y) / fy, 0.0, 0.0))

    @classmethod
    def orthographic(
        cls,
        width: int,
        height: int,
        scale: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        camera_from_world: Any = None,
    ) -> Self:
        """The same rays as `Orthographic`, and the same parameters. scale: pixels per scene unit."""
        (x, y), s = axis_pixel(width, height, cx, cy), pixels_per_unit(width, height, scale)
        return cls._made(width, height, camera_from_world, lambda px, py: (0.0, 0.0, (px - x) / s, (py - y) / s))

    @classmethod
    def pushbroom(
        cls,
        width: int,
        height: int,
        step: float,
        focal: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        camera_from_world: Any = None,
    ) -> Self:
        """An upright row of pixels that is carried along x while it looks along z, as on aircraft and over conveyors.

        step: scene units from one column to the next. focal: pixels, of the row, default width / 2. cx, cy: pixel of
        the axis. The slit is the path, the x axis of the camera frame.
        """
        (x, y), f = axis_pixel(width, height, cx, cy), focal_lengths(width, focal, None)[0]
        step = a_nonzero("step", step)
        return cls._made(width, height, camera_from_world, lambda px, py: (0.0, (py - y) / f, (px - x) * step, 0.0))

    @classmethod
    def cross_slit(
        cls,
        width: int,
        height: int,
        first: Any,
        second: Any,
        target: Any,
        extent: Any,
        up: Any = (0.0, 0.0, 1.0),
    ) -> Self:
        """All rays that leave from one line and pass through another (Zomet et al. 2003); the pose follows from them.

        first, second: slits in the world, each a point (3,) and a direction (3,), not parallel to each other. target
        (3,): what the center of the image shows, off both slits' planes. extent: width of what the image shows in the
        plane through the target that is parallel to both slits, scene units; or width and height. up (3,): direction
        that points up in the image. Rays start on the first slit; the second may lie before or behind it.
        """
        (p1, d1), (p2, d2) = (a_slit(line, name) for line, name in ((first, "first"), (second, "second")))
        goal = three_numbers("target", target)
        axis = np.cross(d1, d2)
        if np.linalg.norm(axis) < 1e-9:
            raise InputError("cross_slit: the two slits are parallel, so that no plane lies along both: turn one")
        axis /= np.linalg.norm(axis)
        axis = axis if (goal - p1) @ axis > 0 else -axis
        depth, other = float((goal - p1) @ axis), float((p2 - p1) @ axis)
        size = max(abs(depth), abs(other))
        if min(depth, abs(other), abs(depth - other)) <= 1e-12 * size:
            raise InputError(
                f"cross_slit: along the normal of the slits, the second lies at {other:g} and the target at {depth:g} "
                "from the first: no two of these may be equal"
            )
        pose = _frame(goal - depth * axis, axis, three_numbers("up", up))
        turn, shift = pose[:3, :3], pose[:3, 3]
        q1, q2, e1, e2 = ((turn @ p1 + shift)[:2], (turn @ p2 + shift)[:2], (turn @ d1)[:2], (turn @ d2)[:2])
        wide, high = seen_extent(extent, width, height)
        part = other / depth

        def ray(px: float, py: float) -> tuple[float, float, float, float]:
            there = np.array([(px / width - 0.5) * wide, (py / height - 0.5) * high])
            gap = q2 - part * there - (1.0 - part) * q1
            start = q1 + e1 * (_turn(e2, gap) / ((1.0 - part) * _turn(e2, e1)))
            return (*((there - start) / depth), *start)

        return cls._made(width, height, pose, ray)

    @classmethod
    def pencil(
        cls,
        width: int,
        height: int,
        slide: float,
        fx: float | None = None,
        fy: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        camera_from_world: Any = None,
    ) -> Self:
        """A pinhole that is carried along x from row to row, as a camera with a rolling shutter in a train.

        slide: scene units from one row to the next. The others are those of `Pinhole`, for the row through cy. The slit
        is the x axis; rays of one row meet in a point of it and lie in a plane with it.
        """
        (x, y), (fx, fy) = axis_pixel(width, height, cx, cy), focal_lengths(width, fx, fy)
        slide = a_nonzero("slide", slide)
        return cls._made(
            width, height, camera_from_world, lambda px, py: ((px - x) / fx, (py - y) / fy, (py - y) * slide, 0.0)
        )

    @classmethod
    def twisted_orthographic(
        cls,
        width: int,
        height: int,
        twist: float,
        scale: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        camera_from_world: Any = None,
    ) -> Self:
        """Rays that are parallel in each row, and turn to the side from row to row.

        twist: slope of the rays toward x, per scene unit along y. scale: pixels per scene unit. cx, cy: pixel of z.
        """
        (x, y), s = axis_pixel(width, height, cx, cy), pixels_per_unit(width, height, scale)
        k = a_nonzero("twist", twist) / s
        return cls._made(
            width, height, camera_from_world, lambda px, py: ((py - y) * k, 0.0, (px - x) / s, (py - y) / s)
        )

    @classmethod
    def bilinear(
        cls,
        width: int,
        height: int,
        twist: float,
        spread: float = 0.0,
        scale: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        camera_from_world: Any = None,
    ) -> Self:
        """Rays that wind about the axis like the strands of a rope; no two of them meet.

        twist: slope across the way from the axis, per scene unit from it; not zero. spread: the same along that way.
        scale: pixels per scene unit in the plane z = 0. cx, cy: pixel of the axis.
        """
        (x, y), s = axis_pixel(width, height, cx, cy), pixels_per_unit(width, height, scale)
        k, m = a_nonzero("twist", twist), a_number("spread", spread)

        def ray(px: float, py: float) -> tuple[float, float, float, float]:
            u, v = (px - x) / s, (py - y) / s
            return m * u - k * v, k * u + m * v, u, v

        return cls._made(width, height, camera_from_world, ray)

    @classmethod
    def epi(
        cls,
        width: int,
        height: int,
        step: float,
        focal: float | None = None,
        cx: float | None = None,
        cy: float | None = None,
        camera_from_world: Any = None,
    ) -> Self:
        """All rays of the plane y = 0: what one row of a pinhole sees (across) while it is carried along x (down), an
        epipolar plane image (Bolles et al. 1987).

        step: scene units along x from one row to the next. focal: pixels. Points have no image: those of the plane have
        a line of them, others none.
        """
        (x, y), f = axis_pixel(width, height, cx, cy), focal_lengths(width, focal, None)[0]
        step = a_nonzero("step", step)
        return cls._made(width, height, camera_from_world, lambda px, py: ((px - x) / f, 0.0, (py - y) * step, 0.0))

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> dict[str, Self]:
        """One of each kind whose points have images, and crossed slits of which one lies in the scene."""
        pose, side = camera_from_world, min(width, height)
        scale, focal = 0.3 * side, 0.6 * side

        def crossed(near: float, far: float) -> Self:
            made = cls.cross_slit(
                *(width, height),
                *(((0.0, 0.0, near), (1.0, 0.2, 0.0)), ((0.1, 0.0, far), (-0.1, 1.0, 0.0))),
                *((0.0, 0.0, 3.0), 3.0, (0.0, -1.0, 0.0)),
            )
            return made.with_pose(pose)  # type: ignore[attr-defined]

        return {
            "pinhole": cls.pinhole(width, height, focal, 0.95 * focal, camera_from_world=pose),
            "orthographic": cls.orthographic(width, height, scale, camera_from_world=pose),
            "pushbroom": cls.pushbroom(width, height, 2.0 / width, focal, camera_from_world=pose),
            "cross slit": crossed(-1.0, -0.4),
            "cross slit in the scene": crossed(-0.5, 1.3),
            "pencil": cls.pencil(width, height, 1.0 / height, focal, camera_from_world=pose),
            "twisted orthographic": cls.twisted_orthographic(width, height, 0.4, scale, camera_from_world=pose),
            "bilinear": cls.bilinear(width, height, 0.35, 0.2, scale, camera_from_world=pose),
        }

    @classmethod
    def _made(cls, width: int, height: int, pose: Any, ray: Any) -> Self:
        """The camera with (sigma, tau, u, v) = ray(x, y) at three corners of the image."""
        rays = [ray(x * width, y * height) for x, y in CORNERS]
        return cls(rays, width, height, CORNERS, camera_from_world=pose)  # pyright: ignore[reportCallIssue]


def _frame(origin: np.ndarray, axis: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Pose of a frame by its origin, its z axis, and what points up in the image."""
    pose = look_at((0.0, 0.0, 0.0), axis, up)
    pose[:3, 3] = -pose[:3, :3] @ origin
    return pose


def _same(rows: np.ndarray, size: float) -> np.ndarray:
    """Rows that differ by no more than rounding of numbers of some size: made equal."""
    middle = rows.mean(axis=0)
    return np.broadcast_to(middle, rows.shape) if np.abs(rows - middle).max() <= _ROUNDING * size else rows


def _turn(a: np.ndarray, b: np.ndarray) -> float:
    return float(a[0] * b[1] - a[1] * b[0])
