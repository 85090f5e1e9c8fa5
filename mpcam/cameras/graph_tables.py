"""Graph cameras in scene files: portals as tables, an object with a splitting point, or a maze as a drawing."""

import dataclasses
from typing import Annotated, Any, ClassVar, Self

from mpcam.cameras.fields import Limits, Positive
from mpcam.cameras.graph_portals import Portal
from mpcam.cameras.maze_plan import MazePlan
from mpcam.cameras.pinhole import Pinhole
from mpcam.errors import InputError, KeyProblem

Point = tuple[float, float, float]
Plane = tuple[float, float, float, float]

_WAYS = {
    "portals": ("portals", "box", "planes", "fov", "focal", "center"),
    "splitting_point": ("splitting_point", "shift", "margin", "fov", "focal", "center"),
    "maze": ("maze", "cell", "wall_height", "opening"),
}


@dataclasses.dataclass
class PortalTable:
    """[[camera.portals]]: the fields of a `Portal`, with `box` or `planes` for its ends."""

    polygon: list[Point]
    center: Point | None = None
    parent: int = -1
    into: int | None = None
    box: tuple[Point, Point] | None = None
    planes: list[Plane] | None = None


class GraphTable:
    """The keys of `GraphCamera`: a root pinhole with portals or around a splitting point, in the world; or a maze."""

    placed_by: ClassVar[tuple[str, ...]] = ("maze",)

    @classmethod
    def from_table(
        cls,
        width: int,
        height: int,
        fov: Annotated[float, Limits(above=0, below=180)] | None = None,
        focal: tuple[Positive, Positive] | None = None,
        center: tuple[float, float] | None = None,
        portals: list[PortalTable] | None = None,
        box: tuple[Point, Point] | None = None,
        planes: list[Plane] | None = None,
        splitting_point: Point | None = None,
        shift: Positive | None = None,
        margin: Annotated[float, Limits(at_least=0)] | None = None,
        maze: list[str] | None = None,
        cell: Positive | None = None,
        wall_height: Positive | None = None,
        opening: Positive | None = None,
        camera_from_world: Any = None,
    ) -> Self:
        """`portals`, and `box` or `planes` at which the root's frustum ends; or `splitting_point`, `shift` and `margin`
        of `GraphCamera.around`; both with `fov`, `focal` and `center` of the root, a pinhole. Or `maze`, the lines of a
        drawing (`MazePlan.drawn`), with `cell`, `wall_height` and `opening`, which has a place of its own.

        camera_from_world: the root's pose; the world is what portals and points are in.
        """
        given = {key: value for key, value in locals().items() if key not in ("cls", "width", "height")}
        given = {key: value for key, value in given.items() if value is not None and key != "camera_from_world"}
        way = next((key for key in _WAYS if key in given), None)
        if way is None:
            raise KeyProblem("portals", f"give one of {', '.join(_WAYS)}")
        for key in given:
            if key not in _WAYS[way]:
                raise KeyProblem(key, f"does not go with {way}: allowed are {', '.join(_WAYS[way])}")
        if maze is not None:
            try:
                plan = MazePlan.drawn(maze, cell or 1.0, wall_height or 1.0)
            except InputError as error:
                raise KeyProblem("maze", str(error)) from None
            return cls.through(plan, width, height, opening or 1.0)  # pyright: ignore[reportAttributeAccessIssue]
        root = cls.view_of_table(width, height, fov, focal, center).with_pose(camera_from_world)
        if splitting_point is not None:
            aside = 0.5 if margin is None else margin
            return cls.around(splitting_point, root, shift, aside)  # pyright: ignore[reportAttributeAccessIssue]
        found = []
        for number, table in enumerate(portals or []):
            try:
                ends = _ends(table.box, table.planes)
                found.append(Portal(table.polygon, table.center, table.parent, table.into, ends))
            except InputError as error:
                raise KeyProblem("portals", f"portal {number}: {error}") from None
        return cls(root, found, _ends(box, planes))  # pyright: ignore[reportCallIssue]

    @staticmethod
    def view_of_table(
        width: int, height: int, fov: Any = None, focal: Any = None, center: Any = None, **_: Any
    ) -> Pinhole:
        """The root of a table's camera, unplaced."""
        return Pinhole.from_table(width, height, fov, focal, center)


def _ends(box: Any, planes: Any) -> Any:
    if box is not None and planes is not None:
        raise InputError("give box or planes, not both")
    return box if planes is None else planes
