"""From the atlas of camera triangles to the eye's picture of the reflector (Hou et al. 2006, sections 2.3 and 3.1)."""

import functools
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.checks import shown
from mpcam.decomposition.ray_error import bent, check_eye, in_world, vertex_normals
from mpcam.decomposition.reflector import pixel_hits, reflector_of
from mpcam.decomposition.shooting import Locator
from mpcam.decomposition.views import eye_point
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface

FILTERS = ("linear", "nearest")


class Resolver:
    """Atlas images to pictures of the reflector: all geometry is done once, a frame only gathers texels.

    cams: CameraTriangles. reflector: the Mesh or Surface that they stand for. camera: any camera with a common center,
    which must be the eye of `cams` (those with directions hold no eye: there it is taken on trust). filter: "linear"
    between texels of the same triangle, never of another or of the gutter between them, or "nearest".

    mask: (H, W) bool, pixels of the reflector. triangle: (H, W) int32 camera triangle of each, -1 beside the reflector.
    direction: (H, W, 3) float32 unit direction in the world of the true reflected or refracted ray, for look-ups in an
    environment; for `cams` with directions that of their own ray; 0 where there is none, as at total reflection.
    points: (H, W, 3) float64 points of the reflector, 0 beside it. Raises InputError for another eye, a camera without
    a common center, and other filters.
    """

    mask: np.ndarray
    triangle: np.ndarray
    direction: np.ndarray
    points: np.ndarray

    def __init__(self, cams: CameraTriangles, reflector: Mesh | Surface, camera: Camera, filter: str = "linear"):
        if not isinstance(cams, CameraTriangles):
            raise InputError(f"cams is a {type(cams).__name__}: give CameraTriangles, e.g. from mpcam.decompose")
        if not isinstance(camera, Camera):
            raise InputError(f"camera is a {type(camera).__name__}: give one of mpcam's cameras")
        if filter not in FILTERS:
            raise InputError(f"filter={shown(filter)}: allowed are {', '.join(FILTERS)}")
        whole = reflector_of(reflector)
        eye, world = eye_point(camera), in_world(cams)
        check_eye(world, eye, whole.radius)
        self.cams, self.camera, self.filter = cams, camera, filter
        found = pixel_hits(camera, whole)
        self.mask = found.hit.reshape(camera.height, camera.width)
        points, normals = found.points[found.hit], found.normals[found.hit]
        self._place = Locator(world.vertices, vertex_normals(world, whole), world.faces).locate(points, normals)
        if world.normals is not None:
            ways, passes = bent(points - eye, normals, world.index)
        else:
            _, ways, passes = world.ray_at(self._place.face, self._place.second, self._place.third)
            ways = (ways / np.linalg.norm(ways, axis=0)).T
        shape = self.mask.shape
        self.triangle = np.full(shape, -1, np.int32)
        self.triangle[self.mask] = self._place.face
        self.direction, self.points = np.zeros((*shape, 3), np.float32), np.zeros((*shape, 3))
        self.direction[self.mask] = np.where(passes[:, None], ways, 0.0)
        self.points[self.mask] = points

    @functools.cached_property
    @exclusive
    def _texels(self) -> dict[str, Any]:
        """Of each pixel: its first texel (-1: none), the step to the next along the rows, and weights of the others."""
        atlas, place = self.cams.atlas, self._place
        face, side = place.face, atlas.sides[place.face]
        column, row, weights = texel_weights(place.second, place.third, side, self.filter)
        sign = atlas.signs[face].astype(np.int64)
        first = (atlas.corners[face, 1] + sign * row) * atlas.width + atlas.corners[face, 0] + sign * column
        count, t = self.mask.size, types()
        lanes = np.flatnonzero(self.mask)

        def spread(values: np.ndarray, kind: Any, other: Any, rest: float) -> Any:
            whole = np.full(count, rest, other)
            whole[lanes] = values
            return kind(aligned(whole, other)) + kind(opaque_zero())

        result = {
            "first": spread(first, t.Int, np.int32, -1),
            "step": spread(sign, t.Int, np.int32, 0),
            "width": t.Int(opaque_numbers([atlas.width])[0]),
        }
        if self.filter == "linear":
            result["weights"] = [spread(part, t.Float, np.float32, 0.0) for part in weights]
        return result

    @exclusive
    def __call__(self, image: Any, background: Any = 0.0) -> np.ndarray:
        """The eye's picture (H, W, C) float32 of an atlas image (cams.height, cams.width, C).

        background: beside the reflector; one number, C of them, or a picture (H, W, C). Raises InputError for shapes
        that do not fit.
        """
        atlas = _numbers(image, "image")
        expected = (self.cams.height, self.cams.width)
        if atlas.ndim != 3 or atlas.shape[:2] != expected or atlas.shape[2] == 0:
            raise InputError(
                f"the atlas image has shape {atlas.shape}: give ({expected[0]}, {expected[1]}, C), as the camera "
                "triangles have"
            )
        channels = atlas.shape[2]
        behind = _numbers(background, "background")
        shape = (*self.mask.shape, channels)
        if behind.ndim != 3 and behind.shape not in ((), (channels,)) or behind.ndim == 3 and behind.shape != shape:
            raise InputError(f"background has shape {behind.shape}: give one number, {channels}, or a picture {shape}")
        t = types()
        if behind.ndim == 3:
            back = [t.Float(aligned(behind[..., c])) + opaque_zero() for c in range(channels)]
        else:
            back = opaque_numbers([float(value) for value in np.broadcast_to(behind, channels)])
        color = self.on_device(t.Float(aligned(atlas)) + opaque_zero(), back)
        return np.stack([np.asarray(part.numpy()) for part in color], axis=-1).reshape(shape)

    @exclusive
    def on_device(self, texels: Any, background: list[Any]) -> list[Any]:
        """The same without leaving the device: Floats, one per channel, evaluated.

        texels: Float, the C numbers of each atlas pixel, row by row. background: C Floats of one entry, or one per
        pixel of the camera.
        """
        return _kernel(self.filter, len(background))(texels, background, self._texels)

    def __repr__(self) -> str:
        height, width = self.mask.shape
        return f"Resolver({self.cams.count} camera triangles to {width}x{height} pixels, filter={self.filter!r})"


def resolve(
    cams: CameraTriangles,
    image: Any,
    reflector: Mesh | Surface,
    camera: Camera,
    background: Any = 0.0,
    filter: str = "linear",
) -> np.ndarray:
    """The picture (H, W, C) float32 that a camera sees of a reflector, from the atlas image of its camera triangles.

    Each pixel's point on the true surface belongs to a point of the camera triangles (inverse normal shooting), whose
    texels are interpolated. image: (cams.height, cams.width, C). background: beside the reflector; a number, C of them,
    or a picture. filter: "linear" or "nearest". For many frames keep a `Resolver`. Raises InputError as that does.
    """
    return Resolver(cams, reflector, camera, filter)(image, background)


def texel_weights(
    second: np.ndarray, third: np.ndarray, side: np.ndarray, filter: str
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Which texels of a triangle with `side` of them along its short sides make up the values at weights 2 and 3.

    Returns column and row of the first, counted from corner 1, and for "linear" the weights of its neighbors: at the
    next column, the next row, and both (the first has the rest to 1). Across the hypotenuse there is no fourth texel:
    there the other three are taken as a triangle.
    """
    last = side - 1
    x, y = second * last, third * last
    if filter == "nearest":
        column, row = np.floor(x + 0.5), np.floor(y + 0.5)
        beyond = column + row > last  # both were rounded up at the hypotenuse: the lesser one goes back
        across = beyond & (x - np.floor(x) < y - np.floor(y))
        column, row = column - across, row - (beyond & ~across)
        return column.astype(np.int64), row.astype(np.int64), []
    column = np.clip(np.floor(x), 0, last - 1)
    row = np.clip(np.floor(y), 0, last - 1 - column)
    fx, fy = np.clip(x - column, 0.0, 1.0), np.clip(y - row, 0.0, 1.0)
    square = column + row + 2 <= last
    both = np.where(square, fx * fy, 0.0)
    # Rounding may leave a sum of a hair above 1, which no texel may take with a negative weight.
    over = np.maximum(fx + fy - both, 1.0)
    return column.astype(np.int64), row.astype(np.int64), [(fx - both) / over, (fy - both) / over, both / over]


@functools.cache
def _kernel(filter: str, channels: int) -> Any:
    """The frozen kernel of a filter and a number of channels."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(texels: Any, background: list[Any], data: dict[str, Any]) -> list[Any]:
        t = types()
        hit = data["first"] >= 0
        offsets = [(data["first"], 1.0)]
        if filter == "linear":
            right, down, both = data["weights"]
            below = data["step"] * data["width"]
            offsets = [
                (data["first"], 1.0 - right - down - both),
                (data["first"] + data["step"], right),
                (data["first"] + below, down),
                (data["first"] + below + data["step"], both),
            ]
        color = []
        for channel in range(channels):
            total = t.Float(0.0)
            for number, weight in offsets:
                # Where the weight is nothing the texel may be another's, or hold no number.
                some = hit & (t.Float(weight) > 0)
                total += dr.gather(t.Float, texels, t.UInt(number * channels + channel), some) * weight
            color.append(dr.select(hit, total, background[channel]))
        return color

    return kernel


def _numbers(values: Any, name: str) -> np.ndarray:
    try:
        return np.ascontiguousarray(values, np.float32) if np.ndim(values) else np.asarray(values, np.float32)
    except (TypeError, ValueError):
        raise InputError(f"{name} is not an array of numbers: give floats") from None
