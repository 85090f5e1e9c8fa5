"""Tables of general linear cameras, each with a frame of its own: what kernels and images of points need of many."""

from typing import Any, NamedTuple, Protocol, Self, runtime_checkable

import numpy as np

from mpcam.cameras.general_linear_map import LinearMap
from mpcam.cameras.types import Ray
from mpcam.math import Array, Vector, normalize, plain, take, vector


@runtime_checkable
class HasPieces(Protocol):
    """A camera that consists of general linear cameras, one or more; of others of its class `pieces` may be None."""

    @property
    def pieces(self) -> "LinearPieces | None":
        """Frames and maps of all pieces."""
        ...

    def locate(self, x: Array, y: Array) -> Any:
        """Piece that pixel positions belong to; -1 for none."""
        ...


def linear_pieces(camera: Any) -> "LinearPieces | None":
    """The general linear cameras that a camera consists of; None if it does not."""
    return camera.pieces if isinstance(camera, HasPieces) else None


class LinearPieces(NamedTuple):
    """Frames of pieces from the camera frame (nine numbers of a rotation by rows, three of a shift), and their maps
    from pixels to rays in these frames; all numbers are tables (N,), or those of one piece."""

    turn: tuple[Array, ...]
    shift: tuple[Array, ...]
    linear: LinearMap

    @classmethod
    def of(cls, frames: Any, numbers: list[Array]) -> Self:
        """From frames (N, 4, 4) and the twelve numbers of a `LinearMap` for each, (N,)."""
        turn = tuple(frames[:, i, j] for i in range(3) for j in range(3))
        return cls(turn, tuple(frames[:, i, 3] for i in range(3)), LinearMap(*numbers))

    def at(self, number: Array) -> Self:
        """The pieces with these numbers."""
        chosen = (tuple(plain(take(table, number)) for table in part) for part in self)
        turn, shift, linear = chosen
        return type(self)(turn, shift, LinearMap(*linear))

    def inward(self, point: Vector) -> Vector:
        """A point of the camera frame in the frame of a piece."""
        x, y, z = point
        turn, shift = self.turn, self.shift
        rows = (turn[3 * i] * x + turn[3 * i + 1] * y + turn[3 * i + 2] * z + shift[i] for i in range(3))
        return vector(*rows)

    def outward(self, direction: Vector) -> Vector:
        """A direction in the frame of a piece, in the camera frame."""
        x, y, z = direction
        turn = self.turn
        return vector(*(turn[i] * x + turn[3 + i] * y + turn[6 + i] * z for i in range(3)))

    def ray(self, x: Array, y: Array, valid: Array) -> Ray:
        """Rays of pixels of a piece, in the camera frame."""
        sigma, tau, u, v = self.linear.at(x, y)
        zero = 0.0 * x
        shift = self.shift
        start = self.outward(vector(u - shift[0] + zero, v - shift[1] + zero, zero - shift[2]))
        return Ray(start, normalize(self.outward(vector(sigma + zero, tau + zero, zero + 1.0))), valid)

    @property
    def count(self) -> int:
        """Number of pieces."""
        return int(np.size(self.linear.u))
