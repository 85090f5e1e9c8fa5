"""Stand-ins for the relief scenes of Rosen et al. 2011: cars and barrels on gently curved ground (Figs. 2, 13, 20)."""

from dataclasses import dataclass, replace

import numpy as np

from mpcam.cameras.pinhole import Pinhole
from mpcam.errors import InputError
from mpcam.experiments.hou2006_scenes import AMBIENT
from mpcam.geometry.builtin import builtin_mesh
from mpcam.geometry.car import BODY_COLOR
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.shapes import Builder, surface, unit
from mpcam.geometry.textures import plaster, rgb, textured
from mpcam.math.pose import look_at
from mpcam.scene.scene import DirectionalLight, Scene

KINDS = ("cars", "barrels", "small cars")
PAINTS = ("#f2c21a", "#c8352b", "#2f6fb3", "#3f8f55", "#e9e5da", "#d97c2b", "#6a4c93", "#39424a")
"""Of bodies; the first is the relief's own."""
# thing, rows, columns, spacing along and across, scale
_LAYOUTS = {
    "cars": ("car", 8, 5, (3.0, 5.4), 1.0),
    "barrels": ("barrel", 10, 6, (1.25, 1.25), 1.0),
    "small cars": ("car", 16, 10, (1.5, 2.7), 0.5),
}


@dataclass(frozen=True, eq=False)
class ReliefScene:
    """Instances of one thing on coarse ground.

    tile: the thing, on z = 0 around the origin. box: (2, 3) its tile's corners: the relief lies within, its foot on
    z = 0. matrices: (N, 4, 4) world from tile, similarities. colors: (N, 3) linear RGB that take the place of `keyed`,
    the color of the tile's material that may be painted anew; or None. scene: the ground, with camera and light.
    """

    tile: Mesh
    box: np.ndarray
    matrices: np.ndarray
    colors: np.ndarray | None
    keyed: tuple[float, float, float]
    scene: Scene

    def whole(self) -> Scene:
        """The scene with every instance as triangles: what relief is to look like."""
        made = []
        for number, matrix in enumerate(self.matrices):
            mesh = self.tile
            if self.colors is not None:
                color = tuple(float(part) for part in self.colors[number])
                painted = tuple(
                    replace(material, color=color) if material.color == self.keyed else material
                    for material in mesh.materials
                )
                mesh = replace(mesh, materials=painted)
            made.append(mesh.transformed(matrix))
        return replace(self.scene, meshes=(*self.scene.meshes, *made))


def relief_scene(
    kind: str = "cars", triangles: int | None = None, count: int | None = None, width: int = 640, height: int = 480
) -> ReliefScene:
    """40 "cars", 60 "barrels" or 160 "small cars" of half the size.

    triangles: of one thing; default: its own. count: the first so many instances alone. Raises InputError for other
    kinds and counts.
    """
    if kind not in KINDS:
        raise InputError(f"relief_scene({kind!r}): allowed are {', '.join(KINDS)}")
    thing, rows, columns, spacing, scale = _LAYOUTS[kind]
    most = rows * columns
    if count is not None and not 1 <= count <= most:
        raise InputError(f"relief_scene({kind!r}, count={count}): 1 to {most}")
    tile = builtin_mesh(thing, triangles)
    low, high = tile.bounds
    margin = 0.02 * (high - low).max()
    box = np.array([low - margin, high + margin])
    box[0, 2] = min(low[2], 0.0)
    matrices = _places(rows, columns, spacing, scale)[:count]
    colors = None
    if thing == "car":
        colors = np.array([rgb(code) for code in PAINTS])[_mixed(most)[:count]]
    extent = np.array((rows * spacing[0], columns * spacing[1]))
    scene = Scene(
        (relief_ground(0.62 * extent.max()),),
        _camera(extent, width, height),
        (DirectionalLight((0.55, 0.35, -0.75), (0.85, 0.82, 0.74)),),
        ambient=AMBIENT,
        background=(0.55, 0.68, 0.82),
        name=f"{most if count is None else count} {kind}",
    )
    return ReliefScene(tile, box, matrices, colors, BODY_COLOR, scene)


def relief_ground(half: float, cells: int = 24) -> Mesh:
    """The coarse ground, 2 half wide, of 2 cells**2 triangles."""
    v, u = np.meshgrid(np.linspace(-half, half, cells + 1), np.linspace(-half, half, cells + 1), indexing="ij")
    points = np.stack([u, v, _height(u, v)], axis=2)
    builder = Builder()
    part = surface(points, np.stack([u, v], axis=2) / 4.0, _normal(u, v))
    builder.add(part, textured("ground", plaster("#a9a18c", 19, contrast=0.05)))
    return builder.mesh("ground")


def _height(x, y):
    """A gentle swell: up to 10 degrees steep."""
    return 0.8 * np.sin(0.16 * x + 0.4) * np.cos(0.13 * y - 0.3) + 0.004 * (x * x - 0.5 * y * y) * np.exp(
        -(x * x + y * y) / 400.0
    )


def _normal(x, y):
    step = 1e-4
    along = (_height(x + step, y) - _height(x - step, y)) / (2 * step)
    across = (_height(x, y + step) - _height(x, y - step)) / (2 * step)
    return unit(np.stack([-along, -across, np.ones_like(along)], axis=-1))


def _places(rows: int, columns: int, spacing: tuple[float, float], scale: float) -> np.ndarray:
    """(N, 4, 4) matrices on the ground, upright on its slope, each turned a little; those of a lane face one way."""
    random = np.random.default_rng(40)
    row, column = (part.ravel() for part in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    shake = random.uniform(-0.06, 0.06, (2, rows * columns)) * np.array(spacing)[:, None]
    y = (row - 0.5 * (rows - 1)) * spacing[0] + shake[0]
    x = (column - 0.5 * (columns - 1)) * spacing[1] + shake[1]
    turn = np.where(row % 2 == 0, 0.0, np.pi) + random.uniform(-0.08, 0.08, rows * columns)
    up = _normal(x, y)
    ahead = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    ahead = unit(ahead - (ahead * up).sum(axis=1, keepdims=True) * up)
    matrices = np.zeros((rows * columns, 4, 4))
    matrices[:, :3, :3] = scale * np.stack([ahead, np.cross(up, ahead), up], axis=2)
    matrices[:, :3, 3] = np.stack([x, y, _height(x, y)], axis=1)
    matrices[:, 3, 3] = 1.0
    # From the middle outwards, so that few are a fair sample.
    return matrices[np.argsort(np.hypot(x / spacing[1], y / spacing[0]), kind="stable")]


def _mixed(count: int) -> np.ndarray:
    """Numbers of paints, each as often as the others, in no order."""
    return np.random.default_rng(7).permutation(np.arange(count) % len(PAINTS))


def _camera(extent: np.ndarray, width: int, height: int) -> Pinhole:
    far = float(np.hypot(*extent))
    eye = look_at((0.42 * far, -0.6 * far, 0.36 * far), (0.0, 0.0, -0.02 * far))
    return Pinhole.from_fov(width, height, np.radians(46.0), camera_from_world=eye)
