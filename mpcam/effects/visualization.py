"""Multi-perspective visualization: camera triangles around a walker, laid out as one picture (Hou et al. 2006, 3.4).

The rays of a cylindrical strip look inwards, so that one picture shows all sides of what stands in it, or outwards.
The strip is a mesh in its own frame: free navigation is another pose, given to a prepared frame by `aim`.
"""

import dataclasses
import functools
from typing import Any, NamedTuple

import numpy as np

from mpcam.backend import exclusive, types
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.checks import is_number, shown, whole_number
from mpcam.effects.vectors import as_vector
from mpcam.errors import InputError
from mpcam.math.pose import as_pose
from mpcam.scene.scene import DirectionalLight, Scene

MOST = 1_000
"""Columns or rows at most."""
TURN = 2 * np.pi


def surround(
    center: Any,
    radius: float = 2.0,
    height: float = 2.0,
    columns: int = 20,
    rows: int = 10,
    *,
    inward: bool = True,
    slant: Any = 0.0,
    twist: Any = 0.0,
    start: float = 0.0,
    angle: float = TURN,
    resolution: int = 64,
) -> CameraTriangles:
    """A cylindrical strip of 2 x columns x rows direct camera triangles around an upright axis; default: 400.

    center (3,): world, the middle of the strip; the axis is world z. radius, height: scene units. columns, rows: cells
    of the strip, each two camera triangles. inward: rays look at the axis (the strip is seen from outside), else away
    from it. slant: radians that rays are tilted up, one number or those of the lowest and the highest row. twist:
    radians that rays are turned about the axis, counter-clockwise from above, one number or two. start: bearing of the
    left end, radians from +x; seen from where the rays come, the strip goes on to the right. angle: how much of a turn,
    at most 2 pi. resolution: pixels along a cell. Frame: that of the strip, moved by `camera_from_world`. Raises
    InputError.
    """
    middle = as_vector(center, "center")
    for name, value in (("radius", radius), ("height", height), ("angle", angle)):
        _number(name, value, above=True)
    _number("start", start)
    if angle > TURN * (1 + 1e-12):
        raise InputError(f"surround(angle={angle:g}): radians, at most 2 pi")
    for name, value in (("columns", columns), ("rows", rows)):
        whole_number(name, value, 1, MOST, of="surround")
    wraps = angle > TURN * (1 - 1e-12)
    if wraps and columns < 3:
        raise InputError(f"surround(columns={columns}): a full turn takes 3 at least, or give a smaller angle")
    across = np.arange(columns if wraps else columns + 1) / columns
    # To the right of the picture: counter-clockwise for rays that look in, clockwise for those that look out.
    bearing = start + (angle if inward else -angle) * across
    up = np.linspace(1.0, 0.0, rows + 1)
    lift, turn = (_pair(name, value) for name, value in (("slant", slant), ("twist", twist)))
    if np.abs(lift).max() >= 0.5 * np.pi:
        raise InputError(f"surround(slant={shown(slant)}): radians between -pi/2 and pi/2")
    lift, turn = (low + (high - low) * up[:, None] for low, high in (lift, turn))
    way = bearing + turn + (np.pi if inward else 0.0)
    places = np.stack(
        np.broadcast_arrays(radius * np.cos(bearing), radius * np.sin(bearing), height * (up[:, None] - 0.5)), axis=-1
    )
    along = np.stack(np.broadcast_arrays(np.cos(lift) * np.cos(way), np.cos(lift) * np.sin(way), np.sin(lift)), axis=-1)
    pose = np.eye(4)
    pose[:3, 3] = -middle
    return CameraTriangles(
        places.reshape(-1, 3),
        _cells(columns, rows, wraps),
        directions=along.reshape(-1, 3),
        resolution=resolution,
        camera_from_world=pose,
    )


def moved(cams: CameraTriangles, world_from_camera: Any) -> CameraTriangles:
    """The same camera triangles at another rigid pose (4, 4), for `prepared.aim`: nothing but the rays is made anew."""
    return dataclasses.replace(cams, camera_from_world=np.linalg.inv(as_pose(world_from_camera)))


def _cells(columns: int, rows: int, wraps: bool) -> np.ndarray:
    """Faces of a grid of vertices: two per cell, with corner 1 at its upper left and at its lower right."""
    wide = columns if wraps else columns + 1
    row, column = np.divmod(np.arange(rows * columns), columns)
    right = (column + 1) % wide
    a, b, c, d = row * wide + column, row * wide + right, (row + 1) * wide + column, (row + 1) * wide + right
    return np.stack([a, b, c, d, c, b], axis=1).reshape(-1, 3)


class Grid(NamedTuple):
    """Cells of a strip: columns, rows, pixels along a cell, and whether the last column meets the first."""

    columns: int
    rows: int
    side: int
    wraps: bool


def grid_of(cams: CameraTriangles) -> Grid:
    """The grid that camera triangles from `surround` form. Raises InputError for others."""
    wide, count = int(cams.faces[0, 2]), cams.count
    rows = len(cams.vertices) // wide - 1 if wide else 0
    columns = count // (2 * rows) if rows > 0 else 0
    fits = columns > 0 and np.ndim(cams.resolution) == 0 and wide in (columns, columns + 1)
    if not fits or not np.array_equal(cams.faces, _cells(columns, rows, wide == columns)):
        raise InputError(
            f"unrolled: {count} camera triangles that are no grid of equal cells: give those of mpcam.surround"
        )
    return Grid(columns, rows, int(cams.resolution), wide == columns)


class Unrolled:
    """Lays an atlas of `surround` out as one continuous panorama; made once, it serves all frames and poses.

    width, height: pixels; neighboring cells share the pixels of their common edge, and a full turn ends one pixel
    before it begins again. pixel: (height, width) atlas pixel, row by row, of each; no pixel is mixed from others.
    """

    width: int
    height: int
    pixel: np.ndarray

    def __init__(self, cams: CameraTriangles):
        grid, atlas = grid_of(cams), cams.atlas
        step = grid.side - 1
        self.width, self.height = grid.columns * step + (not grid.wraps), grid.rows * step + 1
        self.shape = (atlas.height, atlas.width)
        row, y = self._split(np.arange(self.height), step, grid.rows)
        column, x = self._split(np.arange(self.width), step, grid.columns)
        lower = x + y[:, None] > step
        face = 2 * (row[:, None] * grid.columns + column) + lower
        local = [np.where(lower, step - v, v) for v in np.broadcast_arrays(x, y[:, None])]
        u, v = (atlas.corners[face, i] + atlas.signs[face] * local[i] for i in range(2))
        self.pixel = (v * atlas.width + u).astype(np.uint32)

    @staticmethod
    def _split(place: np.ndarray, step: int, cells: int) -> tuple[np.ndarray, np.ndarray]:
        cell = np.minimum(place // step, cells - 1)
        return cell, place - cell * step

    @functools.cached_property
    @exclusive
    def _number(self) -> Any:
        from mpcam.backend import aligned, opaque_zero

        return types().UInt(aligned(self.pixel, np.uint32)) + types().UInt(opaque_zero())

    def __call__(self, image: Any) -> np.ndarray:
        """The panorama (height, width, ...) of an image or any other field (H, W, ...) of the atlas."""
        values = np.asarray(image)
        if values.shape[:2] != self.shape:
            raise InputError(
                f"unrolled: the image has shape {values.shape}: give {self.shape} pixels, as the atlas has"
            )
        return values.reshape(-1, *values.shape[2:])[self.pixel]

    @exclusive
    def on_device(self, values: Any) -> Any:
        """The same for a flat device array with an entry per atlas pixel (Float, Int, Array3f, ...); frozen."""
        return _gathered()(values, self._number)


@functools.cache
def _gathered() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def gathered(values: Any, number: Any) -> Any:
        if dr.depth_v(values) == 1:
            return dr.gather(type(values), values, number)
        parts = [dr.gather(type(part), part, number) for part in values]
        return type(values)(*parts)

    return gathered


def unrolled(cams: CameraTriangles, image: Any) -> np.ndarray:
    """An atlas image (H, W, ...) of the camera triangles of `surround` as one panorama (h, w, ...).

    Every pixel is one of the atlas. For many frames keep an `Unrolled`. Raises InputError for other camera triangles
    and for images of another size.
    """
    return Unrolled(cams)(image)


def walker_scene(triangles: int = 6_841) -> Scene:
    """A walking person in a ring of columns on a plain ground: about so many triangles (Hou et al. 2006, Table 1).

    The walker stands at the origin and goes along -y; meters, z up. triangles: 3,000 to 200,000; met within 3 %.
    """
    from mpcam.geometry.character_body import Look, Sizes, figure
    from mpcam.geometry.shapes import Builder, copies, lathe, placements, quads
    from mpcam.geometry.textures import painted, plaster, textured

    triangles = whole_number("triangles", triangles, 3_000, 200_000, of="walker_scene")
    builder = Builder()
    corners = np.array([(-9.0, -9.0, 0.0), (9.0, -9.0, 0.0), (9.0, 9.0, 0.0), (-9.0, 9.0, 0.0)])
    builder.add(quads(corners, corners[:, :2] / 3.0), textured("ground", plaster("#b7b09c", 51, contrast=0.07)))
    around = TURN * np.arange(12) / 12
    profile = [(0.24, 0.0), (0.24, 0.12), (0.17, 0.2), (0.14, 2.5), (0.22, 2.65), (0.22, 2.8), (0.0, 2.8)]
    column = lathe(profile[:-1], 12, smooth=False)
    places = placements(np.stack([4.2 * np.cos(around), 4.2 * np.sin(around), 0.0 * around], axis=1))
    for number, color in enumerate(("#b5493a", "#d8c9a3", "#3f6b8f")):
        builder.add(copies(column, places[number::3]), painted(f"column {number}", color))
    look = Look("#e2b08c", "#3a2a20", "#b23a3a", "#2f3f5f", "walk", hat="#4b3a2a")
    sizes = Sizes(1.0)
    figure(look, sizes)
    for part, material in figure(look, Sizes(sizes.resolution_for(triangles - builder.count))):
        builder.add(part, material)
    sun = DirectionalLight((0.5, 0.4, -0.8), (0.75, 0.72, 0.66))
    return Scene(
        (builder.mesh("walker"),), None, (sun,), ambient=(0.3, 0.32, 0.36), background=(0.33, 0.55, 0.86), name="walker"
    )


def _pair(name: str, value: Any) -> np.ndarray:
    """The values at the lowest and the highest row."""
    try:
        given = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        given = np.full(3, np.nan)
    if given.shape not in ((), (2,)) or not np.isfinite(given).all():
        raise InputError(
            f"surround({name}={shown(value)}): give one finite number, or those of the lowest and highest row"
        )
    return np.broadcast_to(given, (2,))


def _number(name: str, value: Any, above: bool = False) -> None:
    if not is_number(value) or (above and value <= 0):
        raise InputError(f"surround({name}={shown(value)}): give a finite number{' above 0' if above else ''}")
