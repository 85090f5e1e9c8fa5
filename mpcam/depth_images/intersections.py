"""What rays met in depth images; fields are worked out when they are first asked for."""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from mpcam.backend import exclusive, types
from mpcam.errors import InputError


class Intersections:
    """First meetings of rays with depth images; fields have the shape of the rays, (...).

    hit: (...) bool. distance: (...) float32 along the unit direction, from the ray's origin, infinite where nothing is
    met. pixel: (..., 2) float32, where in the image; 0 where nothing is met. front: (...) bool, whether the ray came
    from the camera's side of the surface. steps: (...) int32, points of the ray that were projected, for coarse and
    fine steps and for those that were taken again. image: (...) int32, which of several images, -1 where nothing is
    met. color, normal: (..., 3) float32, see the properties. The same on the device, flat: `device_hit` and so on.
    """

    def __init__(self, images: Sequence[Any], found: Any, shape: tuple[int, ...], which: Any = None):
        self.images, self.shape = tuple(images), shape
        self.device_hit, self.device_distance, u, v, self.device_number, self.device_front, self.device_steps = found
        self.device_pixel = (u, v)
        self._which = which

    @property
    def device_image(self) -> Any:
        """Int, which of the images."""
        import drjit as dr

        if dr.width(self.device_hit) == 0:
            return types().Int()
        return dr.select(self.device_hit, types().Int(0) if self._which is None else self._which, -1)

    @functools.cached_property
    @exclusive
    def hit(self) -> np.ndarray:
        """(...) bool."""
        return self._host(self.device_hit)

    @functools.cached_property
    @exclusive
    def distance(self) -> np.ndarray:
        """(...) float32, infinite where nothing is met."""
        return self._host(self.device_distance)

    @functools.cached_property
    @exclusive
    def pixel(self) -> np.ndarray:
        """(..., 2) float32, u right and v down; 0 where nothing is met."""
        return np.stack([self._host(part) for part in self.device_pixel], -1)

    @functools.cached_property
    @exclusive
    def front(self) -> np.ndarray:
        """(...) bool."""
        return self._host(self.device_front)

    @functools.cached_property
    @exclusive
    def steps(self) -> np.ndarray:
        """(...) int32."""
        return self._host(self.device_steps).astype(np.int32)

    @functools.cached_property
    @exclusive
    def image(self) -> np.ndarray:
        """(...) int32, -1 where nothing is met."""
        return self._host(self.device_image)

    @functools.cached_property
    @exclusive
    def device_color(self) -> Any:
        """Array3f; see `color`."""
        return self._mixed("color")

    @functools.cached_property
    @exclusive
    def device_normal(self) -> Any:
        """Array3f; see `normal`."""
        return self._mixed("normals")

    @property
    def color(self) -> np.ndarray:
        """(..., 3) float32, mixed from the four pixels around, those of the same surface; 0 where nothing is met.

        Raises InputError for images without color.
        """
        return self._host_vectors(self.device_color)

    @property
    def normal(self) -> np.ndarray:
        """(..., 3) float32, unit, world, on the side that the image's camera sees; 0 where nothing is met.

        Raises InputError for images without normals.
        """
        return self._host_vectors(self.device_normal)

    @functools.cached_property
    @exclusive
    def device_facing(self) -> Any:
        """Float; see `facing`."""
        import drjit as dr

        if dr.width(self.device_hit) == 0:
            return types().Float()
        result = dr.zeros(types().Float, dr.width(self.device_hit))
        for number, image in enumerate(self.images):
            hit = self.device_hit if self._which is None else self.device_hit & (self._which == number)
            result = _frozen_facing()(hit, self.device_number, image.any_surface().patches, result)
        return result

    @property
    def facing(self) -> np.ndarray:
        """(...) float32, cosine of the angle at which the camera's ray met the surface, 1 face to face, 0 edge-on and
        where nothing is met. By the slopes of the depth, so no normals are needed.
        """
        return self._host(self.device_facing)

    def fade(self, first: float = 1.2, last: float = 1.5) -> np.ndarray:
        """(...) float32, how opaque hits are to be taken: 1 up to the angle `first` between the camera's ray and the
        surface's normal, radians, and down to 0 at `last`, where the sampled part of the surface ends in a jagged edge
        (Rosen et al. 2011, section 7.1). 0 where nothing is met. Raises InputError unless 0 <= first < last <= pi / 2.
        """
        if not 0 <= first < last <= 0.5 * np.pi:
            raise InputError(f"fade(first={first!r}, last={last!r}): 0 <= first < last <= pi / 2 is needed, radians")
        angle = np.arccos(np.clip(self.facing, 0, 1))
        return np.where(self.hit, np.clip((last - angle) / (last - first), 0, 1), 0).astype(np.float32)

    def _mixed(self, name: str) -> Any:
        import drjit as dr

        if dr.width(self.device_hit) == 0:
            return types().Array3f()
        result = types().Array3f(0) + dr.zeros(types().Float, dr.width(self.device_hit))
        for number, image in enumerate(self.images):
            values = getattr(image, f"device_{name}")
            if values is None:
                raise InputError(f"the depth image has no {name}: give it {name}=, or render it with {name}=True")
            hit = self.device_hit if self._which is None else self.device_hit & (self._which == number)
            result = mixed(image, values, hit, self.device_pixel, self.device_number, name == "normals", result)
        return result

    def _host(self, values: Any) -> np.ndarray:
        return np.asarray(values.numpy()).reshape(self.shape)

    def _host_vectors(self, vectors: Any) -> np.ndarray:
        return np.stack([self._host(part) for part in vectors], -1)

    def __repr__(self) -> str:
        return f"Intersections({'x'.join(map(str, self.shape))}, {len(self.images)} depth images)"


def mixed(image: Any, values: Any, hit: Any, pixel: Any, number: Any, unit: bool, otherwise: Any) -> Any:
    """Values of an image, an Array3f, at hits; others keep theirs."""
    size = image.camera.width, image.camera.height
    surface = image.any_surface()
    return _frozen_mixed(size, unit)(hit, pixel, number, surface.patches, values, otherwise)


@functools.lru_cache(maxsize=64)
def _frozen_mixed(size: tuple[int, int], unit: bool) -> Any:
    import drjit as dr

    from mpcam_kernels.depth_colors import mixed_around
    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(hit: Any, pixel: tuple[Any, Any], number: Any, patches: Any, values: Any, otherwise: Any) -> Any:
        found = mixed_around(types(), size, hit, pixel, number, patches, values)
        if unit:
            found = found * dr.rsqrt(dr.maximum(dr.squared_norm(found), 1e-30))
        return dr.select(hit, found, otherwise)

    return kernel


@functools.cache
def _frozen_facing() -> Any:
    import drjit as dr

    from mpcam_kernels.depth_colors import facing
    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(hit: Any, number: Any, patches: Any, otherwise: Any) -> Any:
        return dr.select(hit, facing(types(), hit, number, patches), otherwise)

    return kernel
