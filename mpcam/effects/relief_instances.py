"""Copies of a relief in a scene: where they are, and in which color."""

import functools
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_zero, types
from mpcam.checks import number_table, shown
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.device import DeviceMesh, device_mesh

_CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)])
_SIDES = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
_FACES = np.array([(a, b, c) for a, b, c, _ in _SIDES] + [(a, c, d) for a, _, c, d in _SIDES])
LARGEST = 1e12
"""Of a placement, how much more it may stretch one direction than another."""


class ReliefInstances:
    """Copies of one relief. They move by `update`, all at once.

    placements: (N, 4, 4), world from tile: any affine matrices that keep space, mirrors and uneven scales too. colors:
    (N, 3), linear RGB that takes the place of the relief's key color; default: that color. Raises InputError for other
    shapes, matrices that are not affine or flatten space, and colors for a relief without a key.
    """

    def __init__(self, relief: Any, placements: Any, colors: Any = None):
        if not hasattr(relief, "texels"):
            raise InputError(f"relief is a {type(relief).__name__}: give a mpcam.Relief")
        self.relief = relief
        self.colors: np.ndarray | None = None
        self.update(placements, colors)

    @exclusive
    def update(self, placements: Any = None, colors: Any = None) -> None:
        """The copies elsewhere, or in other colors, or another number of them; None: as they are.

        Raises InputError as for new ones, and where there is another number of placements than of colors.
        """
        matrices = self.placements if placements is None else _matrices(placements)
        given = self.colors if colors is None else _colors(colors, self.relief)
        if given is not None and len(given) != len(matrices):
            raise InputError(f"colors holds {len(given)} rows and placements {len(matrices)}: give one for each")
        self.placements, self.colors = matrices, given
        for name in ("boxes", "device", "device_colors"):
            self.__dict__.pop(name, None)

    def __len__(self) -> int:
        return len(self.placements)

    @functools.cached_property
    def boxes(self) -> Mesh:
        """The copies' boxes as a mesh, 8 vertices and 12 triangles each, sides outwards."""
        low, high = self.relief.box
        corners = low + _CORNERS * (high - low)
        vertices = np.einsum("nij,kj->nki", self.placements[:, :3, :3], corners) + self.placements[:, None, :3, 3]
        faces = np.repeat(_FACES[None], len(self), axis=0)
        mirrored = np.linalg.det(_even(self.placements)) < 0
        faces[mirrored] = faces[mirrored][:, :, [0, 2, 1]]
        faces = faces + 8 * np.arange(len(self))[:, None, None]
        return Mesh(vertices.reshape(-1, 3), faces.reshape(-1, 3), name="boxes")

    @functools.cached_property
    def device(self) -> "Placed":
        """Where the copies are, on the device."""
        return Placed(self)

    @functools.cached_property
    def device_colors(self) -> Any:
        """Float, 3 numbers per copy; None: all have the key color."""
        return None if self.colors is None else _upload(self.colors)

    def __repr__(self) -> str:
        return f"ReliefInstances({len(self)} of {self.relief!r})"


class Placed:
    """Copies on the device, around the anchor of their boxes and in the unit of these.

    mesh: the boxes there. poses: 12 numbers per copy, from that frame to the tile's. balls: 4 per copy, around its box.
    centers (N, 3): of the boxes, world.
    """

    def __init__(self, instances: ReliefInstances):
        boxes, matrices = instances.boxes, instances.placements
        self.mesh: DeviceMesh = device_mesh(boxes)
        anchor, scale = self.mesh.anchor, self.mesh.scale
        inverse = np.linalg.inv(matrices)
        linear = inverse[:, :3, :3] * scale
        shift = np.einsum("nij,j->ni", inverse[:, :3, :3], anchor) + inverse[:, :3, 3]
        self.poses = _upload(np.concatenate([linear, shift[:, :, None]], axis=2))
        corners = boxes.vertices.reshape(-1, 8, 3)
        self.centers = corners.mean(axis=1)
        radius = np.linalg.norm(corners - self.centers[:, None], axis=2).max(axis=1)
        balls = np.concatenate([(self.centers - anchor) / scale, radius[:, None] / scale * (1 + 1e-6)], axis=1)
        self.balls = _upload(balls)

    def order(self, point: np.ndarray) -> np.ndarray:
        """Numbers of the copies, those near a point (3,) first."""
        return np.argsort(((self.centers - point) ** 2).sum(axis=1), kind="stable").astype(np.uint32)


def _upload(values: np.ndarray) -> Any:
    return types().Float(aligned(values)) + opaque_zero() if values.size else types().Float()


def _even(matrices: np.ndarray) -> np.ndarray:
    """Linear parts with entries near 1, whose products neither overflow nor vanish."""
    linear = matrices[:, :3, :3]
    largest = np.abs(linear).max(axis=(1, 2), keepdims=True, initial=0.0)
    return linear / np.where(largest > 0, largest, 1.0)


def _matrices(placements: Any) -> np.ndarray:
    try:
        found = np.array(placements, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"placements={shown(placements)}: give 4x4 matrices, (N, 4, 4)") from None
    if found.size == 0:
        return np.zeros((0, 4, 4))
    found = found[None] if found.shape == (4, 4) else found
    if found.ndim != 3 or found.shape[1:] != (4, 4):
        raise InputError(f"placements have shape {found.shape}: give (N, 4, 4), world from tile")
    affine = np.isfinite(found).all(axis=(1, 2)) & (found[:, 3] == (0, 0, 0, 1)).all(axis=1)
    if not affine.all():
        number = int(np.argmin(affine))
        raise InputError(f"placements[{number}] is not affine: give finite 4x4 matrices with last row 0 0 0 1")
    stretch = np.linalg.svd(_even(found), compute_uv=False)
    flat = ~(stretch[:, 2] * LARGEST > stretch[:, 0])
    if flat.any():
        raise InputError(f"placements[{int(np.argmax(flat))}] flattens the relief: its three axes must be independent")
    found.flags.writeable = False
    return found


def _colors(colors: Any, relief: Any) -> np.ndarray:
    found = number_table(colors)
    if found.ndim != 2 or found.shape[1:] != (3,) or not np.isfinite(found).all() or (found < 0).any():
        raise InputError(f"colors={shown(colors)}: give (N, 3) linear RGB numbers, none negative")
    if relief.key is None:
        raise InputError("colors: the relief has no key color that they could replace: give it key= or mask=")
    return found
