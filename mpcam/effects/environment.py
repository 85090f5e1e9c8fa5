"""Environment maps: what is seen from one point, in all directions, as two paraboloid views (Gascuel et al. 2008)."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_zero, types
from mpcam.cameras.radial import Radial
from mpcam.effects.lookup import back_to_back, check_size, four_texels, place
from mpcam.effects.vectors import as_vector, as_vectors
from mpcam.errors import InputError


@dataclass(frozen=True)
class DeviceEnvironment:
    """An environment map in device memory, an argument for kernels.

    texels: Float, 3 numbers per pixel, front view, then back view. size: pixels along a side.
    """

    texels: Any
    size: int

    def lookup(self, direction: Any) -> Any:
        """Colors (Array3f) of world directions (Array3f, any length), bilinear."""
        import drjit as dr

        u, v, start = place(direction, dr.norm(direction), self.size)
        color = types().Array3f(0.0)
        for column, row, weight in four_texels(u, v, self.size, self.size):
            number = types().UInt(start + row * self.size + column)
            color += dr.gather(types().Array3f, self.texels, number) * weight
        return color


class EnvironmentMap:
    """Colors in all directions from one point.

    position (3,): world. images: two (H, W, 3) float32 pictures, linear RGB: the half-space towards world +x, and that
    towards -x, +z up. cameras: the two paraboloid cameras that they were taken with; each sees a little more than 180
    degrees, and what lies in the corners beyond that means nothing.
    """

    def __init__(self, position: Any, images: tuple[np.ndarray, np.ndarray]):
        self.position = as_vector(position, "position")
        shapes = [np.shape(image) for image in images]
        if len(shapes) != 2 or shapes[0] != shapes[1] or shapes[0] != (*shapes[0][:1] * 2, 3):
            raise InputError(f"images have shapes {shapes}: give two pictures of one square size, (N, N, 3) each")
        check_size(shapes[0][0])
        self.images = images

    @classmethod
    def from_panorama(cls, image: Any, size: int | None = None) -> "EnvironmentMap":
        """The map of a latitude-longitude picture (H, W, 3), linear RGB: infinitely far surroundings.

        Its middle column is world +x, columns to the left are towards +y, the top row is +z. size: pixels along a side
        of each view; default: half of the picture's width. Raises InputError for other shapes.
        """
        picture = np.asarray(image, np.float32)
        if picture.ndim != 3 or picture.shape[2] != 3 or min(picture.shape[:2]) < 2:
            raise InputError(f"panorama has shape {picture.shape}: give (H, W, 3), twice as wide as high")
        height, width, _ = picture.shape
        size = check_size(max(8, width // 2) if size is None else size)
        u, v = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5)
        views = []
        for camera in back_to_back((0.0, 0.0, 0.0), size):
            x, y, z = np.moveaxis(camera.ray(np.stack([u, v], -1)).direction, -1, 0)
            column = (0.5 - np.arctan2(y, x) / (2 * np.pi)) * width - 0.5
            row = np.clip(np.arccos(np.clip(z, -1, 1)) / np.pi * height - 0.5, 0, height - 1)
            left, top = np.floor(column).astype(int), np.minimum(np.floor(row).astype(int), height - 2)
            fx, fy = (column - left)[..., None], (row - top)[..., None]
            here, there = left % width, (left + 1) % width
            upper = picture[top, here] * (1 - fx) + picture[top, there] * fx
            lower = picture[top + 1, here] * (1 - fx) + picture[top + 1, there] * fx
            views.append((upper * (1 - fy) + lower * fy).astype(np.float32))
        return cls((0.0, 0.0, 0.0), (views[0], views[1]))

    @functools.cached_property
    def cameras(self) -> tuple[Radial, Radial]:
        """The cameras of the two pictures."""
        return back_to_back(self.position, len(self.images[0]))

    @functools.cached_property
    @exclusive
    def on_device(self) -> DeviceEnvironment:
        """The map in device memory, with a `lookup` for kernels."""
        flat = np.concatenate([np.asarray(image, np.float32).ravel() for image in self.images])
        return DeviceEnvironment(types().Float(aligned(flat)) + opaque_zero(), len(self.images[0]))

    @exclusive
    def lookup(self, directions: Any) -> np.ndarray:
        """Colors (..., 3) float32 that arrive from world directions, bilinear between pixels.

        directions (..., 3): away from the position, any length above 0. Raises InputError for other shapes, and for
        directions that are zero or not finite.
        """
        unit = as_vectors(directions, "directions", unit=True)
        if unit.size == 0:
            return np.zeros(unit.shape, np.float32)
        columns = np.ascontiguousarray(unit.reshape(-1, 3).T, np.float32)
        color = self.on_device.lookup(types().Array3f(columns))
        return np.stack([np.asarray(part.numpy()) for part in color], -1).reshape(unit.shape)

    def __repr__(self) -> str:
        size = len(self.images[0])
        return f"EnvironmentMap(2 x {size}x{size}, position={self.position.tolist()})"
