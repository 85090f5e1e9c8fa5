"""Where points appear in camera triangles: every point in every triangle at once."""

import functools
from typing import Any

import numpy as np

from mpcam.cameras import bent_rays, curved_images, three_rays
from mpcam.cameras.plane_sweep import ROUNDINGS, plane_sweep
from mpcam.cameras.types import Projection
from mpcam.math import Array, Vector, detach, epsilon, isfinite, library, maximum, norm, take, vector, where
from mpcam.math.optics import reflect, refract


def images_of(camera: Any, points: Array) -> Projection:
    """`CameraTriangles.project`."""
    from mpcam.cameras.base import components

    with np.errstate(all="ignore"):
        pixel, depth, valid = local_images(camera, camera.local(components(points, 3, "points")))
    kind = library(depth)
    if kind == "jax":
        import jax.numpy as jnp

        return Projection(jnp.moveaxis(pixel, 0, -1), depth, valid)
    return Projection(np.moveaxis(pixel, 0, -1) if kind == "numpy" else pixel, depth, valid)


def images_near(camera: Any, points: np.ndarray, pixels: np.ndarray) -> Projection:
    """`CameraTriangles.project_near`."""
    face, _, _, inside = camera.atlas.locate(pixels[:, 0], pixels[:, 1])
    with np.errstate(all="ignore"):
        found = _in_triangles(camera, face, camera.local(points.T))
    u, v, depth, valid = (np.stack(np.broadcast_arrays(*(image[i] for image in found)), -1) for i in range(4))
    return Projection(np.stack([u, v], -1), depth, valid & inside[:, None])


def local_images(camera: Any, point: Vector) -> tuple[Any, Any, Any]:
    """Pixels, depths and validity of all images of points (3, ...) in the camera frame.

    NumPy and JAX: (2, ..., n), (..., n), (..., n) for n images per point; Dr.Jit: tuples of n.
    """
    if library(point) == "drjit":
        return _on_device(camera, point)
    face = np.arange(camera.count)
    spread = point[..., None]
    found = _in_triangles(camera, face, spread)

    def joined(values: list[Any]) -> Any:
        """One image after the other, triangle by triangle."""
        if library(*values) == "jax":
            import jax.numpy as jnp

            return jnp.stack(jnp.broadcast_arrays(*values), -1).reshape(*point.shape[1:], -1)
        return np.stack(np.broadcast_arrays(*values), -1).reshape(*point.shape[1:], -1)

    u, v, depth, valid = (joined([image[i] for image in found]) for i in range(4))
    return vector(u, v), depth, valid


def _on_device(camera: Any, point: Vector) -> tuple[Any, Any, Any]:
    """The same on Dr.Jit arrays: a lane for each point and triangle."""
    import drjit as dr

    whole, count = dr.uint32_array_t(type(point.x)), camera.count
    lane = dr.arange(whole, dr.width(point) * count)
    face, number = dr.int32_array_t(whole)(lane % count), lane // count
    found = _in_triangles(camera, face, type(point)(*(dr.gather(type(part), part, number) for part in point)))
    first = dr.arange(whole, dr.width(point)) * count
    pixels, depths, valids = [], [], []
    for triangle in range(count):
        for u, v, depth, valid in found:
            at = [dr.gather(type(values), values, first + triangle) for values in (u, v, depth, valid)]
            pixels.append(vector(at[0], at[1]))
            depths.append(at[2])
            valids.append(at[3])
    return tuple(pixels), tuple(depths), tuple(valids)


def _in_triangles(camera: Any, face: Array, point: Vector) -> list[tuple[Array, Array, Array, Array]]:
    """Images of points in camera triangles: u, v, depth, validity of each that there may be."""
    nodes = [camera.node(i) for i in range(camera.nodes)]
    places, rays = (tuple(_at(node[k], face) for node in nodes) for k in range(2))
    if camera.linear:
        found = [_closed_form(places, rays, point)]
    elif camera.directions is not None and camera.degree == 1:
        images = three_rays.project(places, rays, point)
        lengths = []
        for image in images:
            w3 = 1.0 - image.w1 - image.w2
            weights = (image.w1, image.w2, w3)
            lengths.append(
                norm(vector(*(sum(w * ray[k] for w, ray in zip(weights, rays, strict=True)) for k in range(3))))
            )
        found = [(i.w2, 1.0 - i.w1 - i.w2, i.c * length, i.valid) for i, length in zip(images, lengths, strict=True)]
    elif camera.degree > 1:
        found = _curved(camera, places, rays, point)
    else:
        found = bent_rays.project(camera.bend, places, rays, point)
    result = []
    for second, third, depth, valid in found:
        u, v = camera.atlas.pixel(face, second, third)
        result.append((where(valid, u, 0.0), where(valid, v, 0.0), where(valid, depth, 0.0), valid))
    return result


def _curved(camera: Any, places: Any, rays: Any, point: Vector) -> list[tuple[Array, Array, Array, Array]]:
    """In camera triangles of degree 2: searched for on the host in float64, so points must be known; one more step of
    Newton's method in the library of the points gives derivatives.
    """
    kind = library(*point, *places[0])
    numbers = [*(part for one in (*places, *rays, point) for part in one), *(() if camera.eye is None else camera.eye)]
    if camera.index is not None:
        numbers.append(camera.index)
    if kind == "numpy":
        return _searched(*numbers, bends=camera.kind)
    search = functools.partial(_searched, bends=camera.kind)
    if kind == "jax":
        import jax
        import jax.numpy as jnp

        numbers = [jax.lax.stop_gradient(jnp.asarray(part)) for part in numbers]
        shape = jnp.broadcast_shapes(*(part.shape for part in numbers))
        dtype = point[0].dtype

        def host(*given: Any) -> Any:
            found = search(*(np.asarray(part, np.float64) for part in given))
            return [(*(np.asarray(x, dtype) for x in image[:3]), image[3]) for image in found]

        value, there = jax.ShapeDtypeStruct(shape, dtype), jax.ShapeDtypeStruct(shape, np.dtype(bool))
        wanted = [(value, value, value, there)] * curved_images.IMAGES
        starts = jax.pure_callback(host, wanted, *numbers, vmap_method="sequential")
    else:
        import drjit as dr

        number = type(point.x)
        found = search(*(np.asarray(dr.detach(number(part)).numpy(), np.float64) for part in numbers))
        starts = [(*(number(x) for x in image[:3]), dr.mask_t(number)(image[3])) for image in found]
    result = []
    for second, third, depth, valid in starts:
        image = bent_rays.refined(camera.bend, places, rays, point, second, third, depth, steps=1)
        result.append((*image[:3], valid))
    return result


def _searched(*numbers: Any, bends: str) -> list[tuple[Any, Any, Any, Any]]:
    """The images for NumPy numbers: of places, rays and points, and of the eye and the index if there are any."""
    given = [np.asarray(part, np.float64) for part in numbers]
    places, rays, point = given[:18], given[18:36], np.stack(np.broadcast_arrays(*given[36:39]))
    shape = np.broadcast_shapes(*(part.shape for part in given))
    wide: list[Any] = []
    for table in (places, rays):
        wide.append(tuple(np.stack([np.broadcast_to(x, shape) for x in table[k : k + 3]]) for k in range(0, 18, 3)))
    eye: Any = None if bends == "direct" else np.array([float(part.ravel()[0]) for part in given[39:42]])

    def bend(origin: Any, along: Any) -> Any:
        if bends == "direct":
            return along, (along * along).sum(axis=0) > 0
        come = origin - eye.reshape(3, *(1,) * (origin.ndim - 1))
        if bends == "reflection":
            way = reflect(come, along)
            return way, (way * way).sum(axis=0) > 0
        return refract(come, along, float(given[42].ravel()[0]))

    with np.errstate(all="ignore"):
        if bends != "refraction":
            return curved_images.project(bend, wide[0], wide[1], point, eye)
        found = bent_rays.project(bend, wide[0], wide[1], point)
    zero = np.zeros(shape)
    nothing = zero, zero, zero, np.zeros(shape, bool)
    return [*found, *[nothing] * (curved_images.IMAGES - len(found))]


def _closed_form(
    places: tuple[Vector, ...], rays: tuple[Vector, ...], point: Vector
) -> tuple[Array, Array, Array, Array]:
    """The one image where rays have the same part along the triangle's normal: weights, depth and validity."""
    second, third, distance, sure, slack = plane_sweep(places, rays, point)
    first = 1.0 - second - third
    size = sum(norm(place) for place in places) + norm(point)
    behind = ROUNDINGS * epsilon(first) * detach(size) / norm(rays[0])
    inside = (first >= -slack) & (second >= -slack) & (third >= -slack) & (distance >= -behind)
    length = norm(vector(*(first * x + second * y + third * z for x, y, z in zip(*rays, strict=True))))
    valid = sure & inside & isfinite(second) & isfinite(third) & isfinite(distance)
    return second, third, maximum(distance, 0.0) * length, valid


def _at(table: Vector, face: Array) -> Vector:
    """Columns of a table (3, F) by number; all of them, untouched, where no number is needed."""
    return vector(*(take(part, face) for part in table))
