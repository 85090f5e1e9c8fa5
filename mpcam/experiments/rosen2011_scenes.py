"""Stand-ins for the scenes of Rosen et al. 2011: things before mirrors and lenses, a maze, a statue.

The paper's models are not public: these are made by formula. Metres, z up; each scene's first mesh is the thing that a
depth image is made of.
"""

import numpy as np

from mpcam.cameras.pinhole import Pinhole
from mpcam.errors import InputError
from mpcam.experiments.hou2006_scenes import AMBIENT, SUN, checker, sky
from mpcam.geometry.builtin import builtin_mesh
from mpcam.geometry.maze import Maze
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, placements, quads
from mpcam.geometry.surfaces import Surface
from mpcam.geometry.textures import plaster, textured
from mpcam.math.pose import look_at
from mpcam.scene.mirror import Mirror
from mpcam.scene.refractor import Refractor
from mpcam.scene.scene import DirectionalLight, Scene

COUNTS = (2_000, 20_000, 330_000)
"""Triangles of the thing before the mirror, about."""
MIRRORS = ("bumpy", "bowl", "teapot")
CENTER = np.array((0.0, 0.0, 1.2))
"""Where the middle of that thing is."""
_SILVER = (0.93, 0.95, 0.96)


def reflection_scene(
    triangles: int = COUNTS[1], thing: str = "teapot", mirror: str = "bumpy", width: int = 640, height: int = 480
) -> Scene:
    """A teapot or a knot close to a mirror, above a floor of checks (Fig. 1; 11 for "bowl", 17 for "teapot").

    triangles: of the thing, about. mirror: "bumpy" (a standing patch of waves, which shows it from many sides), "bowl"
    (hollow: several images of it) or "teapot" (a large one). meshes: the thing, the floor. Raises InputError for other
    names.
    """
    if thing not in ("teapot", "knot") or mirror not in MIRRORS:
        raise InputError(
            f"reflection_scene(thing={thing!r}, mirror={mirror!r}): things are teapot and knot, mirrors "
            f"{', '.join(MIRRORS)}"
        )
    surface, eye, target = {
        "bumpy": (_standing(Surface.wave(4.4, 0.06, 1.5), 1.45, 1.55, 4.0), (3.3, -4.1, 2.6), (0.35, 0.55, 1.3)),
        "bowl": (_standing(Surface.paraboloid(2.2, 0.95), 3.5, 1.6), (2.9, -4.6, 3.0), (0.3, 1.2, 1.3)),
        "teapot": (
            builtin_mesh("teapot", 20_000).transformed(placements([(0.1, 2.7, 0.0)], -2.2, 2.2)[0]),
            *((3.7, -3.4, 2.2), (0.35, 1.2, 1.15)),
        ),
    }[mirror]
    return Scene(
        (placed_thing(thing, triangles), floor()),
        Pinhole.from_fov(width, height, np.radians(44.0), camera_from_world=look_at(eye, target)),
        (SUN,),
        ambient=AMBIENT,
        name=f"{thing} before a {mirror} mirror",
        mirror=Mirror(surface, color=_SILVER),
        environment=sky(),
    )


def refraction_scene(triangles: int = COUNTS[1], width: int = 640, height: int = 480) -> Scene:
    """The teapot behind a glass ellipsoid, whose far side bends rays a second time (Fig. 5)."""
    eye = look_at((0.4, -5.4, 1.7), (0.0, 0.0, 1.15))
    glass = Surface.ellipsoid((1.15, 0.55, 0.9), (0.15, -2.1, 1.3))
    return Scene(
        (placed_thing("teapot", triangles), floor()),
        Pinhole.from_fov(width, height, np.radians(40.0), camera_from_world=eye),
        (SUN,),
        ambient=AMBIENT,
        name="teapot behind glass",
        refractor=Refractor(glass, index=1.3, color=(0.95, 0.98, 0.97)),
        environment=sky(),
    )


def placed_thing(thing: str = "teapot", triangles: int = COUNTS[1], turn: float = 0.0) -> Mesh:
    """The teapot or the knot around CENTER, tilted and turned by an angle in radians: its middle is CENTER."""
    mesh = builtin_mesh(thing, triangles)
    middle = mesh.bounds.mean(axis=0)
    c, s = np.cos(0.35), np.sin(0.35)
    tilt = np.array([(1.0, 0, 0), (0, c, -s), (0, s, c)])
    matrix = np.eye(4)
    matrix[:3, :3] = tilt @ placements([(0.0, 0.0, 0.0)], turn + 0.5, 0.85)[0, :3, :3]
    matrix[:3, 3] = CENTER - matrix[:3, :3] @ middle
    return mesh.transformed(matrix)


def floor(half: float = 7.0) -> Mesh:
    """Two triangles with checks, at z = 0."""
    corners = np.array([(-half, -half, 0.0), (half, -half, 0.0), (half, half, 0.0), (-half, half, 0.0)])
    builder = Builder()
    builder.add(quads(corners, corners[:, :2] / 1.2), textured("floor", checker("#e9e4d6", "#54636f")))
    return builder.mesh("floor")


def maze_scene(
    cell: tuple[int, int] = (1, 5), mirror: str = "teapot", triangles: int = 20_000, width: int = 640, height: int = 480
) -> tuple[Scene, Maze]:
    """The maze with a mirror in an open cell (row, column), seen along the longest way there; the maze itself (Fig. 6).

    mirror: "teapot" or "sphere". meshes: the maze alone. Raises InputError for other mirrors and walled cells.
    """
    maze = Maze.drawn()
    camera, place = maze_camera(maze, cell, width, height), maze.center(*cell)
    if mirror == "teapot":
        pose = placements([place + (0.0, 0.0, 0.25)], -0.9, 0.72)[0]
        surface = builtin_mesh("teapot", 20_000).transformed(pose)
    elif mirror == "sphere":
        surface = Surface.sphere(0.75, place + (0.0, 0.0, 0.95))
    else:
        raise InputError(f"maze_scene(mirror={mirror!r}): allowed are teapot and sphere")
    scene = Scene(
        (maze.mesh(triangles),),
        camera,
        (DirectionalLight((0.35, 0.5, -1.0), (0.75, 0.72, 0.66)),),
        ambient=(0.36, 0.38, 0.42),
        name=f"maze, {mirror} at {cell}",
        mirror=Mirror(surface, color=_SILVER),
        environment=sky(),
    )
    return scene, maze


def maze_camera(maze: Maze, cell: tuple[int, int], width: int = 640, height: int = 480) -> Pinhole:
    """A camera in open cells that looks at what stands in a cell (row, column), along the longest way there.

    Raises InputError for cells that are not open.
    """
    rows, columns = maze.open.shape
    if not (0 <= cell[0] < rows and 0 <= cell[1] < columns and maze.open[cell]):
        raise InputError(f"maze cell {cell}: give the row and column of an open cell")
    place, (away, run) = maze.center(*cell), _longest(maze, cell)
    sight = min(1.7, run + 0.4) * maze.cell
    eye = look_at(place + sight * away + (0.0, 0.0, 1.55), place + (0.0, 0.0, 0.7))
    return Pinhole.from_fov(width, height, np.radians(40.0), camera_from_world=eye)


def _longest(maze: Maze, cell: tuple[int, int]) -> tuple[np.ndarray, int]:
    """The direction (x, y, 0) in which most cells are open from a cell on, and how many; outside all is open."""
    rows, columns = maze.open.shape
    best = np.zeros(3), -1
    for down, right in ((-1, 0), (0, 1), (0, -1), (1, 0)):
        row, column, run = cell[0] + down, cell[1] + right, 0
        while not (0 <= row < rows and 0 <= column < columns) or maze.open[row, column]:
            row, column, run = row + down, column + right, run + 1
            if run > max(rows, columns):
                break
        if run > best[1]:
            best = np.array((float(right), float(down), 0.0)), run
    return best


def statue_scene(triangles: int = 60_000, time: float = 0.0, width: int = 512, height: int = 512) -> Scene:
    """The statue on a large ground, for ambient occlusion (Fig. 3). meshes: the statue, the ground (two triangles)."""
    ground = Builder()
    corners = np.array([(-12.0, -12.0, 0.0), (12.0, -12.0, 0.0), (12.0, 12.0, 0.0), (-12.0, 12.0, 0.0)])
    ground.add(quads(corners, corners[:, :2] / 6.0), textured("ground", plaster("#cdc8bd", 3, contrast=0.02)))
    return Scene(
        (builtin_mesh("statue", triangles), ground.mesh("ground")),
        statue_camera(time, width, height),
        (DirectionalLight((-0.5, 0.6, -0.9), (0.42, 0.4, 0.36)),),
        ambient=(0.6, 0.61, 0.63),
        background=(0.78, 0.83, 0.88),
        name="statue",
    )


def statue_camera(time: float = 0.0, width: int = 512, height: int = 512) -> Pinhole:
    """The camera of the path around the statue at a time from 0 to 1: once round, rising and sinking a little."""
    angle = 2 * np.pi * time - 0.9
    eye = np.array((6.6 * np.cos(angle), 6.6 * np.sin(angle), 2.6 + 0.5 * np.sin(4 * np.pi * time)))
    target = (-0.3, 0.0, 0.95)
    return Pinhole.from_fov(width, height, np.radians(42.0), camera_from_world=look_at(eye, target))


def _standing(surface: Surface, y: float, z: float, lean: float = 0.0) -> Surface:
    """A patch that stands upright and looks to -y; its middle at (0, y, z). lean: degrees that it tilts back."""
    c, s = np.cos(np.radians(lean)), np.sin(np.radians(lean))
    pose = np.array([(1.0, 0, 0, 0.0), (0, s, -c, y), (0, c, s, z), (0, 0, 0, 1)])
    return surface.transformed(pose)
