"""Ways to make graph cameras: around an object, and through a maze."""

from typing import TYPE_CHECKING, Any, Self

import numpy as np

from mpcam.cameras.graph_maze import through
from mpcam.cameras.graph_portals import Portal
from mpcam.cameras.maze_plan import MazeLike, MazePlan
from mpcam.cameras.pinhole import Pinhole
from mpcam.checks import is_number, shown, three_numbers, whole_number
from mpcam.errors import InputError

if TYPE_CHECKING:
    from mpcam.cameras.base import Camera

_MOST = 1 << 15  # pixels along a side
_CORNERS = ["#####", "#   #", "### #", "#   #", "#E###"]


class GraphMakers:
    """The classmethods of `GraphCamera` that make one."""

    @classmethod
    def around(cls, splitting_point: Any, root: Pinhole, shift: float | None = None, margin: float = 0.5) -> Self:
        """Three frusta that see an object from its front, its left and its right (Rosen et al. 2011, section 6.3).

        The root's frustum ends at the plane through the splitting point at right angles to the view. Behind it the part
        of the image to the left of the point belongs to a frustum with its center to the left of the root's, the part
        to its right to one with its center to the right: their rays close in behind the object. They end at the plane
        through the root's center and the upright line through the splitting point in the image, so none sees what the
        other one sees.

        splitting_point (3,): world, in the root's image; inside of the object or behind it. shift: how far the two
        centers lie aside, scene units; by default half of the depth of the splitting point. margin: how far the two
        frusta reach beyond the sides of the image, in image sizes, for triangles that cross them. Raises InputError for
        points that the root does not see, and numbers that are not positive.
        """
        given = three_numbers("around: splitting_point", splitting_point)
        if not isinstance(root, Pinhole):
            raise InputError(f"around: root={shown(root)}: give an mpcam.Pinhole")
        pose = np.asarray(root.camera_from_world)
        x, y, z = pose[:3, :3] @ given + pose[:3, 3]
        seen = root.project(given)
        if not seen.valid[0] or not root.contains(seen.pixel[0]) or not 0 < seen.pixel[0, 0] < root.width:
            raise InputError(
                f"around: the splitting point {given.tolist()} is not in the root's image: give one before it"
            )
        aside = 0.5 * z if shift is None else shift
        for name, value, least in (("shift", aside, 0.0), ("margin", margin, -1e-300)):
            if not is_number(value) or not value > least:
                raise InputError(f"around({name}={shown(value)}): a number above 0 is needed")
        ends = np.array([-margin, 1.0 + margin])
        u, v = ends * root.width, ends * root.height
        left, right = z * (u - root.cx) / root.fx
        top, bottom = z * (v - root.cy) / root.fy
        portals = []
        for near, far, sign in ((left, x, -1.0), (x, right, 1.0)):
            corners = np.array([(near, top, z), (far, top, z), (far, bottom, z), (near, bottom, z)])
            middle = np.array([-sign, 0.0, sign * x / z, 0.0])
            portals.append(
                Portal(
                    (corners - pose[:3, 3]) @ pose[:3, :3],
                    (np.array([sign * aside, 0.0, 0.0]) - pose[:3, 3]) @ pose[:3, :3],
                    ends=[middle @ pose],
                )
            )
        return cls(root, portals)  # pyright: ignore[reportCallIssue]

    @classmethod
    def through(cls, maze: MazeLike, width: int, height: int, opening: float = 1.0) -> Self:
        """A whole maze in one image, breadth first from its entrance (Rosen et al. 2011, section 5).

        maze: a `MazePlan`, or anything with its fields. Each cell with openings beside it is a frustum, and each part
        of a corridor between such cells, entered by a doorway from the one before. Rays come from a point before the
        doorway: near at openings, so that they fan out into them; far along corridors, so that most of the image is
        left for what comes after. The image shows the entrance from side to side and from floor to ceiling. Nearer
        cells come first; where ways lead round in a ring, each cell is seen by the first one.

        opening: distance of those points before openings, in cells; before corridors four times their length. The
        smaller, the more of the image is for openings and walls, the less for what is straight ahead. Raises InputError
        for a maze without an open entrance in its border, and numbers that are not positive.
        """
        size = [
            whole_number(name, value, 1, _MOST, of="through", unit="pixels")
            for name, value in (("width", width), ("height", height))
        ]
        if not is_number(opening) or not opening > 0:
            raise InputError(f"through(opening={shown(opening)}): a number above 0 is needed")
        return cls(*through(maze, *size, float(opening)))  # pyright: ignore[reportCallIssue]

    @classmethod
    def examples(cls, width: int, height: int, camera_from_world: Any = None) -> "dict[str, Camera]":
        """One bend, an object from three sides, a merge, and a small maze."""
        made = {
            "bend": _bend(cls, width, height),
            "three sides": cls.around((0.1, 0.0, 2.0), Pinhole(width, height), 0.8),
            "merge": _merge(cls, width, height),
            "maze": cls.through(MazePlan.drawn(_CORNERS, 6.0, 5.0), width, height, 0.25),
        }
        if camera_from_world is None:
            return made
        return {name: camera.with_pose(camera_from_world) for name, camera in made.items()}  # pyright: ignore


def _rectangle(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> list[tuple[float, ...]]:
    """Corners of a face in the root's frame that is upright, and deeper on its right where z rises."""
    return [(x[0], y[0], z[0]), (x[1], y[0], z[1]), (x[1], y[1], z[1]), (x[0], y[1], z[0])]


def _bend(make: Any, width: int, height: int) -> Any:
    """A face across the whole image, turned, and another one behind it."""
    first = Portal(_rectangle((-3.0, 3.0), (-3.0, 3.0), (1.8, 2.4)), (-0.9, 0.2, 0.3))
    second = Portal(_rectangle((-1.0, 2.5), (-2.0, 2.0), (4.0, 3.4)), (0.4, 0.0, -0.5), 0)
    return make(Pinhole(width, height, 0.7 * width, 0.65 * width, 0.47 * width, 0.52 * height), [first, second])


def _merge(make: Any, width: int, height: int) -> Any:
    """Around both sides of a block into one frustum behind it, and on from there."""
    left = Portal(_rectangle((-2.0, -0.3), (-2.0, 2.0), (2.0, 2.0)), (0.0, 0.0, 0.6))
    right = Portal(_rectangle((0.3, 2.0), (-2.0, 2.0), (2.0, 2.0)), into=0)
    behind = Portal(_rectangle((-2.5, 2.5), (-2.5, 2.5), (4.0, 4.5)), (0.4, 0.1, 0.2), parent=0)
    return make(Pinhole(width, height), [left, right, behind])
