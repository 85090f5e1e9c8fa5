"""Several general linear cameras in one image: panoramas, cameras that turn around things, hinged cameras."""

import dataclasses
import functools
from typing import Any, ClassVar

import numpy as np

from mpcam.cameras.base import Camera, register_pytrees
from mpcam.cameras.general_linear import GeneralLinear
from mpcam.cameras.general_linear_map import linear_numbers
from mpcam.cameras.general_linear_tables import PiecewiseTable
from mpcam.cameras.general_linears_makers import PiecewiseMakers
from mpcam.cameras.linear_pieces import LinearPieces
from mpcam.cameras.symmetric import finite_pixel
from mpcam.cameras.types import Projection, Ray
from mpcam.errors import InputError
from mpcam.math import Array, Vector, library, maximum, minimum, take, vector, where, whole
from mpcam.math.pose import as_pose

MOST = 1 << 15  # pixels along a side


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class GeneralLinears(PiecewiseMakers, PiecewiseTable, Camera):
    """General linear cameras in the tiles of a grid: columns, rows, or both; a tile may be cut into two by a diagonal.

    rays (N, 3, 4): generators of each piece, (sigma, tau, u, v) in the frame of the piece. image (N, 3, 2): where they
    lie in the image, pixels. columns (C + 1,), rows (R + 1,): pixels at which tiles begin and end, from 0 on. Pieces go
    tile by tile, row by row; N is R C, or 2 R C where each tile is cut from its lower left to its upper right corner,
    the upper left half first. frames (N, 4, 4): frame of each piece from the camera's frame, rigid; identities if left
    out. camera_from_world: 4x4.

    Depth is the distance along the ray from the plane z = 0 of the piece. A point has up to one image in each piece.
    Where rays of neighbors agree along their border, the image has no seam: pieces of one frame do if they share
    generators, those of different frames if the border is a flat pencil of both.

    Easier ways to make one: `beside`, `around`, `over_grid`. Raises InputError for shapes that do not fit, numbers that
    are not finite, places that lie on one line, borders that do not rise, and frames that are not rigid.
    """

    rays: Any
    image: Any
    columns: Any
    rows: Any
    frames: Any = None
    camera_from_world: Any = None

    static_fields: ClassVar[tuple[str, ...]] = ("columns", "rows")

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "camera_from_world", as_pose(self.camera_from_world))
        for name in ("columns", "rows"):
            set_(self, name, _borders(getattr(self, name), name))
        set_(self, "rays", _table(self.rays, "rays", (3, 4)))
        set_(self, "image", _table(self.image, "image", (3, 2)))
        if self.frames is None:
            set_(self, "frames", np.tile(np.eye(4), (len(self.rays), 1, 1)))
        set_(self, "frames", _table(self.frames, "frames", (4, 4)))
        tiles = (len(self.columns) - 1) * (len(self.rows) - 1)
        if len(self.rays) not in (tiles, 2 * tiles):
            raise InputError(
                f"GeneralLinears: rays hold {len(self.rays)} pieces: the grid has {tiles} tiles, so give {tiles}, or "
                f"{2 * tiles} for tiles that are cut"
            )
        for name in ("image", "frames"):
            if len(getattr(self, name)) != len(self.rays):
                raise InputError(f"GeneralLinears: {name} holds {len(getattr(self, name))} pieces, rays {self.count}")
        if library(self.rays, self.image, self.frames) == "numpy":
            self._check_pieces()
        register_pytrees()

    def _check_pieces(self) -> None:
        sides = self.image[:, 1:] - self.image[:, :1]
        area, size = np.abs(np.linalg.det(sides)), (sides * sides).sum(axis=(1, 2))
        flat = area <= 1e-9 * size
        if flat.any():
            raise InputError(
                f"GeneralLinears: the three places of piece {int(np.argmax(flat))} lie on one line: give three corners "
                "of a triangle"
            )
        turn = self.frames[:, :3, :3]
        off = np.abs(turn @ turn.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
        bad = (off > 1e-6) | (np.linalg.det(turn) < 0) | (self.frames[:, 3] != [0, 0, 0, 1]).any(axis=1)
        if bad.any():
            raise InputError(
                f"GeneralLinears: frame {int(np.argmax(bad))} is not rigid: give rotations and shifts, last row 0 0 0 1"
            )

    @property
    def count(self) -> int:
        """Number of pieces."""
        return len(self.rays)

    @property
    def width(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Pixels of all columns."""
        return int(self.columns[-1])

    @property
    def height(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Pixels of all rows."""
        return int(self.rows[-1])

    @property
    def images_per_point(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Most images of a point: image number n lies in piece n."""
        return self.count

    @property
    def cut(self) -> bool:
        """Whether a diagonal cuts each tile into two pieces."""
        return self.count != (len(self.columns) - 1) * (len(self.rows) - 1)

    @functools.cached_property
    def pieces(self) -> LinearPieces:
        """Maps and frames of all pieces."""
        numbers = linear_numbers(np.moveaxis(self.rays, 0, -1), np.moveaxis(self.image, 0, -1), 1, 1)
        return LinearPieces.of(self.frames, numbers)

    def piece(self, number: int) -> GeneralLinear:
        """A piece as a camera of its own, with the whole image."""
        image = np.asarray(self.image[number]) / (self.width, self.height)
        pose = np.asarray(self.frames[number]) @ np.asarray(self.camera_from_world)
        return GeneralLinear(self.rays[number], self.width, self.height, image, camera_from_world=pose)

    def locate(self, x: Array, y: Array) -> Array:
        """Piece of pixel positions; those at the border of the image go on beyond it."""
        column, row = (
            take(table, whole(minimum(maximum(at, 0.0), len(table) - 0.5)))
            for table, at in zip(self._tiles, (x, y), strict=True)
        )
        tile = row * (len(self.columns) - 1) + column
        if not self.cut:
            return tile
        left, right = (take(self.columns[part], column) for part in (slice(None, -1), slice(1, None)))
        top, bottom = (take(self.rows[part], row) for part in (slice(None, -1), slice(1, None)))
        lower = (x - left) * (bottom - top) + (y - top) * (right - left) > (right - left) * (bottom - top)
        return 2 * tile + where(lower, 1, 0)

    @functools.cached_property
    def _tiles(self) -> tuple[np.ndarray, np.ndarray]:
        """Tile of each column of pixels, and of each row."""
        first, second = (
            np.repeat(np.arange(len(ends) - 1, dtype=np.int32), np.diff(ends)) for ends in (self.columns, self.rows)
        )
        return first, second

    def local_ray(self, pixel: Vector) -> Ray:
        """Ray of a pixel in the camera frame."""
        x, y, valid = finite_pixel(pixel)
        return self.pieces.at(self.locate(x, y)).ray(x, y, valid)

    def local_project(self, point: Vector) -> tuple[Projection, ...]:
        """Images of a point in the camera frame, one for each piece: valid where the pixel belongs to the piece."""
        found = []
        for number in range(self.count):
            piece = self.pieces.at(number)
            image = piece.linear.solve(piece.linear.coefficients(piece.inward(point)))
            x, y = image.pixel
            inside = image.valid & (self.locate(x, y) == number)
            pixel = vector(where(inside, x, 0.0), where(inside, y, 0.0))
            found.append(Projection(pixel, where(inside, image.depth, 0.0), inside))
        return tuple(found)

    def __repr__(self) -> str:
        return f"GeneralLinears({self.width}x{self.height}, {self.count} pieces)"


def _borders(value: Any, name: str) -> np.ndarray:
    given = np.asarray(value)
    good = given.ndim == 1 and len(given) >= 2 and given.dtype.kind in "iuf" and np.array_equal(given, np.rint(given))
    if not good or given[0] != 0 or (np.diff(given) < 1).any() or given[-1] > MOST:
        raise InputError(
            f"GeneralLinears({name}={given.tolist()!r:.60}): give whole numbers that rise from 0 to at most {MOST}"
        )
    borders = given.astype(np.int32)
    borders.flags.writeable = False
    return borders


def _table(values: Any, name: str, shape: tuple[int, int]) -> Any:
    """A table (N, *shape) of finite numbers; other libraries' arrays pass."""
    if library(values) != "numpy" or type(values) is object:
        return values
    try:
        table = np.array(values, np.float64)
    except (TypeError, ValueError):
        raise InputError(
            f"GeneralLinears: {name} is not an array of numbers: give shape (N, {shape[0]}, {shape[1]})"
        ) from None
    if table.ndim != 3 or table.shape[1:] != shape or len(table) == 0:
        raise InputError(f"GeneralLinears: {name} has shape {table.shape}: give (N, {shape[0]}, {shape[1]})")
    if not np.isfinite(table).all():
        raise InputError(f"GeneralLinears: {name} holds NaN or infinity: give finite numbers")
    table.flags.writeable = False
    return table
