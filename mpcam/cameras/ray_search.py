"""What a ray map makes of its rays once, and its search for images, for NumPy, JAX and Dr.Jit: always on the host."""

from typing import Any

import numpy as np

from mpcam.cameras.cell_tree import CellTree
from mpcam.cameras.ray_images import images
from mpcam.math import Array, Vector, library


class Made:
    """Tables and search tree of a ray map, each made when it is first needed. origins, directions: (H, W, 3)."""

    def __init__(self, origins: np.ndarray, directions: np.ndarray):
        self.origins, self.directions = origins, directions
        self._tables: dict[type, list[Array]] = {}
        self._tree: CellTree | None = None

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        return Made, (self.origins, self.directions)  # copies and pickles make their own

    def tables(self, kind: type) -> list[Array]:
        """Components of origins and directions, row by row: NumPy arrays, or in device memory for a Dr.Jit type."""
        if np.ndarray not in self._tables:
            flat = (table.reshape(-1, 3).T for table in (self.origins, self.directions))
            self._tables[np.ndarray] = [np.ascontiguousarray(component) for table in flat for component in table]
        if kind not in self._tables:
            self._tables[kind] = [kind(table) for table in self._tables[np.ndarray]]
        return self._tables[kind]

    def images(self, point: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (most, 2, ...) and validity (most, ...) of the images of points (3, ...), the nearest first."""
        if self._tree is None:
            self._tree = CellTree(self.origins, self.directions)
        flat = np.asarray(point, np.float64).reshape(3, -1)
        known = np.isfinite(flat).all(0)
        pixels, valid = np.zeros((most, 2, known.size)), np.zeros((most, known.size), bool)
        pixels[..., known], valid[..., known] = images(self._tree, flat[:, known], most)
        return pixels.reshape(most, 2, *point.shape[1:]), valid.reshape(most, *point.shape[1:])


def search(camera: Any, point: Vector) -> tuple[Any, Any]:
    """Pixels (k, 2, ...) and validity (k, ...) of the images of points (3, ...) in a ray map, without derivatives."""
    if "jax" in (library(point), library(camera.origins, camera.directions)):
        return _from_jax(camera, point)
    if library(point) == "numpy":
        return camera.made.images(point, camera.images)
    import drjit as dr

    point = dr.detach(point)
    number = type(point.x)
    pixels, valid = camera.made.images(point.numpy(), camera.images)
    return [[number(x) for x in pixel] for pixel in pixels], [dr.mask_t(number)(here) for here in valid]


def _from_jax(camera: Any, point: Any) -> tuple[Any, Any]:
    """The search as a callback; maps that are JAX arrays are handed on, and prepared anew each time."""
    import jax
    import jax.numpy as jnp

    point, most = jax.lax.stop_gradient(jnp.asarray(point)), camera.images
    shape, kind = point.shape[1:], point.dtype
    rays: tuple[Any, ...] = ()
    if library(camera.origins, camera.directions) == "jax":
        rays = tuple(jax.lax.stop_gradient(jnp.asarray(table)) for table in (camera.origins, camera.directions))

    def found(point: Any, *rays: Any) -> tuple[np.ndarray, np.ndarray]:
        """Under vmap all arguments have the mapped axes in front, of length 1 where they are not mapped."""
        axes = point.ndim - 1 - len(shape)
        mapped = np.broadcast_shapes(*(values.shape[:axes] for values in (point, *rays)))
        pixels, valid = np.zeros((*mapped, most, 2, *shape), kind), np.zeros((*mapped, most, *shape), bool)
        if all(table.shape[:axes] == (1,) * axes for table in rays):  # one map
            made = Made(*(np.asarray(table).reshape(table.shape[axes:]) for table in rays)) if rays else camera.made
            inward = np.moveaxis(np.asarray(point), axes, 0)
            many, there = made.images(inward, most)
            pixels[...] = np.moveaxis(many, (0, 1), (axes, axes + 1))
            valid[...] = np.moveaxis(there, 0, axes)
            return pixels, valid
        for at in np.ndindex(*mapped):
            one, *tables = (np.broadcast_to(values, (*mapped, *values.shape[axes:]))[at] for values in (point, *rays))
            pixels[at], valid[at] = Made(*tables).images(one, most)
        return pixels, valid

    result = (jax.ShapeDtypeStruct((most, 2, *shape), kind), jax.ShapeDtypeStruct((most, *shape), np.dtype(bool)))
    return jax.pure_callback(found, result, point, *rays, vmap_method="expand_dims")
