"""Camera triangles behind camera triangles: which place of the first belongs to which of those behind them."""

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, types
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.errors import InputError


@dataclass(frozen=True, eq=False)
class Chained:
    """Camera triangles behind camera triangles.

    camera: the rays after the second surface, direct, in the world frame. first: the camera triangles before it. parent
    (N,): of the first ones, that to which each of the camera's belongs. hit (F,): first ones of which all rays go on;
    share (F,): the part of their area that does. Rays outside of it are those of `first`, unchained.
    """

    camera: CameraTriangles
    first: CameraTriangles
    parent: np.ndarray
    corner: np.ndarray
    """(N, 2) weights, of corners 2 and 3 of the parent, of corner 1 of each triangle."""
    scale: np.ndarray
    """(N,) size of each triangle along its parent's sides; below 0 where it is turned around."""

    @functools.cached_property
    def share(self) -> np.ndarray:
        """(F,) part of the area of each of the first camera triangles whose rays go on."""
        return np.bincount(self.parent, self.scale**2, minlength=self.first.count)

    @property
    def hit(self) -> np.ndarray:
        """(F,) bool, the first camera triangles of which all rays go on."""
        return self.share > 1.0 - 1e-9

    @functools.cached_property
    def _cells(self) -> tuple[np.ndarray, int]:
        """Number of the triangle in each of the smallest cells of a parent, -1 for none, and cells along a side."""
        side = round(1.0 / float(np.abs(self.scale).min()))
        table = np.full((self.first.count, side, side, 2), -1, np.int32)
        for size in np.unique(np.abs(self.scale)):
            mine = np.flatnonzero(np.abs(self.scale) == size)
            many = round(size * side)
            grown = (a.ravel() for a in np.meshgrid(np.arange(many), np.arange(many), [0, 1], indexing="ij"))
            i, j, upper = (a[None] for a in grown)
            inside = (i + j + upper < many)[0]
            i, j, upper = i[:, inside], j[:, inside], upper[:, inside]
            at = np.rint(self.corner[mine] * side).astype(int)
            turned = (self.scale[mine] < 0)[:, None]
            column = np.where(turned, at[:, :1] - 1 - i, at[:, :1] + i)
            row = np.where(turned, at[:, 1:] - 1 - j, at[:, 1:] + j)
            table[self.parent[mine, None], column, row, np.where(turned, 1 - upper, upper)] = mine[:, None]
        return table, side

    def place(self, face: Any, second: Any, third: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Triangle of `camera` (...), -1 for none, and weights of its corners 2 and 3, of places in `first`.

        face, second, third (...): camera triangles of `first`, and weights of their corners 2 and 3.
        """
        table, side = self._cells
        face, second, third = np.broadcast_arrays(face, second, third)
        x, y = (np.clip(np.asarray(w, np.float64) * side, 0.0, side) for w in (second, third))
        i, j = (np.minimum(v.astype(int), side - 1) for v in (x, y))
        upper = (x - i) + (y - j) > 1.0
        # On the border opposite to corner 1 the cell beyond is another triangle's.
        over = i + j + upper >= side
        upper = upper & ~over
        back = over & (i + j >= side)
        i, j = np.where(back & (i >= j), i - 1, i), np.where(back & (i < j), j - 1, j)
        number = table[face, np.maximum(i, 0), np.maximum(j, 0), upper.astype(int)]
        corner, scale = self.corner[number], self.scale[number]
        weights = [(w - corner[..., k]) / scale for k, w in enumerate((second, third))]
        inside = number >= 0
        return number, np.where(inside, weights[0], 0.0), np.where(inside, weights[1], 0.0)

    @functools.cached_property
    def _taps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """For each pixel of the first atlas: three pixels of the camera's (M, 3), weights (M, 3), and whether (M,)."""
        atlas, own = self.first.atlas, self.camera.atlas
        face, x, y = atlas.places
        used = face >= 0
        last = np.maximum(atlas.sides[face] - 1, 1)
        number, second, third = self.place(np.where(used, face, 0), x / last, y / last)
        used = used & (number >= 0)
        number = np.where(used, number, 0)
        last = own.sides[number] - 1
        x, y = (np.clip(w * last, 0, last) for w in (second, third))
        i, j = (np.clip(np.floor(v + 1e-6), 0, last - 1).astype(int) for v in (x, y))
        i = np.minimum(i, np.maximum(last - 1 - j, 0))
        x, y = x - i, y - j
        upper = (x + y > 1 + 1e-6) & (i + j + 2 <= last)
        weights = np.where(upper[:, None], np.stack([x + y - 1, 1 - x, 1 - y], 1), np.stack([1 - x - y, x, y], 1))
        columns = i[:, None] + np.where(upper[:, None], [1, 0, 1], [0, 1, 0])
        rows = j[:, None] + np.where(upper[:, None], [1, 1, 0], [0, 0, 1])
        weights = np.where(np.abs(weights) < 1e-6, 0.0, weights)
        # A tap without weight may lie outside.
        columns, rows = np.where(weights == 0, i[:, None], columns), np.where(weights == 0, j[:, None], rows)
        sign = own.signs[number][:, None]
        u, v = (own.corners[number, k][:, None] + sign * at for k, at in enumerate((columns, rows)))
        return np.where(used[:, None], v * own.width + u, 0), weights, used

    @property
    def mask(self) -> np.ndarray:
        """(H, W) bool, pixels of the first atlas whose rays go on."""
        return self._taps[2].reshape(self.first.height, self.first.width)

    def resampled(self, image: Any) -> np.ndarray:
        """An image (h, w, ...) of the camera's atlas in the layout of the first (H, W, ...); 0 where rays do not go on.

        Linear between three pixels of the same triangle. Raises InputError for images of another size.
        """
        values = np.asarray(image)
        if values.shape[:2] != (self.camera.height, self.camera.width):
            raise InputError(
                f"the image has shape {values.shape}: give {(self.camera.height, self.camera.width)} pixels, as the "
                "chained camera has"
            )
        pixel, weights, used = self._taps
        flat = values.reshape(len(values) * values.shape[1], -1)
        mixed = sum(flat[pixel[:, k]] * weights[:, k, None] for k in range(3)) * used[:, None]
        return mixed.reshape(self.first.height, self.first.width, *values.shape[2:])

    def combined(self, first: Any, second: Any, depth: Any = None) -> np.ndarray:
        """One image in the first layout: what rays that go on see, and elsewhere what the first ones do.

        first (H, W, ...), second (h, w, ...): images of the two cameras. depth (H, W): of the scene without the second
        surface, through the first camera; what is nearer than the second surface stays in front of it.
        """
        mask = self.mask if depth is None else self.mask & ~(np.asarray(depth) < self.distance)
        before = np.asarray(first)
        return np.where(mask.reshape(mask.shape + (1,) * (before.ndim - 2)), self.resampled(second), before)

    @functools.cached_property
    def distance(self) -> np.ndarray:
        """(H, W) scene units from the first surface to the second along the first camera's rays; infinite for none."""
        rays = []
        for cams in (self.first, self.camera):
            v, u = np.indices((cams.height, cams.width)) + 0.5
            rays.append(np.asarray(cams.ray(np.stack([u, v], axis=-1)).origin))
        return np.where(self.mask, np.linalg.norm(self.resampled(rays[1]) - rays[0], axis=-1), np.inf)

    @exclusive
    def on_device(self, values: Any) -> Any:
        """As `resampled`, for a flat device array (Float or Array3f) with an entry per pixel; frozen."""
        return _mixed()(values, *self._device_taps)

    @functools.cached_property
    def _device_taps(self) -> tuple[Any, Any]:
        import drjit as dr

        t, (pixel, weights, used) = types(), self._taps
        number = [t.UInt(aligned(pixel[:, k], np.uint32)) for k in range(3)]
        parts = [t.Float(aligned(weights[:, k] * used)) for k in range(3)]
        dr.make_opaque(number, parts)
        return number, parts


@functools.cache
def _mixed() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def mixed(values: Any, number: list[Any], weights: list[Any]) -> Any:
        def one(part: Any) -> Any:
            return sum(dr.gather(type(part), part, n) * w for n, w in zip(number, weights, strict=True))

        return one(values) if dr.depth_v(values) == 1 else type(values)(*(one(part) for part in values))

    return mixed
