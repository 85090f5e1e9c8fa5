"""Points and pixels by kind: everywhere, and where something degenerates."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.stress.exact import focal_lengths

BAD_POINTS = np.array(
    [[np.nan, 0, 1], [np.inf, 0, 1], [0, -np.inf, 1], [0, 0, np.nan], [0, 0, np.inf], [np.inf, np.nan, -np.inf]]
)
"""Points that are none."""

BAD_PIXELS = np.array([[np.nan, 0], [0, np.inf], [-np.inf, 0], [np.inf, np.nan]])
"""Pixels that are none."""


def unit_vectors(rng: np.random.Generator, theta: Any) -> np.ndarray:
    """Unit vectors (count, 3) at angles (count,) from the axis, of random azimuth."""
    theta = np.asarray(theta, np.float64)
    phi = rng.uniform(-np.pi, np.pi, theta.shape)
    side = np.sin(theta)
    return np.stack([side * np.cos(phi), side * np.sin(phi), np.cos(theta)], -1)


def central_points(camera: Any, limit: float, count: int, seed: int = 1) -> dict[str, np.ndarray]:
    """Points (count, 3) in the frame of a camera with one center, which sees up to `limit` radians from its axis."""
    rng = np.random.default_rng(seed)
    tiny, sign = 10.0 ** rng.uniform(-12, -2, count), rng.choice([-1.0, 1.0], count)
    everywhere: Callable[[], np.ndarray] = lambda: rng.uniform(0, np.pi, count)  # noqa: E731
    axis = 10.0 ** rng.uniform(-40, -13, (count, 3)) * [1, 1, 0] * rng.choice([-1, 0, 1], (count, 1)) + [0, 0, 1]
    image = rng.uniform(0, 1, (2, count)) * [[camera.width], [camera.height]]
    beyond = limit + (np.pi - limit) * rng.uniform(0, 1, count)
    return {
        "everywhere": unit_vectors(rng, everywhere()) * 10.0 ** rng.uniform(-2, 2, (count, 1)),
        "in the image": in_the_image(camera, image) * 10.0 ** rng.uniform(-2, 2, (count, 1)),
        "on the axis": axis * 10.0 ** rng.uniform(-2, 2, (count, 1)),
        "near the axis": unit_vectors(rng, min(limit, 1.0) * tiny),
        "near the rim": unit_vectors(rng, np.minimum(limit * (1 + sign * tiny), np.pi)),
        "beyond the rim": unit_vectors(rng, beyond),
        "at 90 degrees": unit_vectors(rng, np.pi / 2 + sign * tiny * rng.choice([0, 1], count)),
        "behind": unit_vectors(rng, np.pi - tiny),
        "at the center": np.zeros((1, 3)),
        "straight behind": np.outer(10.0 ** rng.uniform(-8, 8, count), [0, 0, -1.0]),
        "scale 1e-8": unit_vectors(rng, everywhere()) * 1e-8,
        "scale 1e8": unit_vectors(rng, everywhere()) * 1e8,
    }


def in_the_image(camera: Any, pixels: np.ndarray) -> np.ndarray:
    """Points (count, 3) on the rays of pixels (2, count) at distance 1, on the axis for pixels without a ray."""
    ray = camera.local_ray(pixels)
    return np.where(ray.valid, ray.origin + ray.direction, [[0.0], [0.0], [1.0]]).T


def pixels(camera: Any, radius: float | None, count: int, seed: int = 2) -> dict[str, np.ndarray]:
    """Pixels (count, 2) of a camera with cx and cy; radius: of its image circle in pixels, None where it has none.

    The circle is an ellipse of half axes radius fx / max(fx, fy) and radius fy / max(fx, fy) where the two differ.
    """
    rng = np.random.default_rng(seed)
    center, size = np.array([camera.cx, camera.cy]), np.array([camera.width, camera.height])
    tiny, sign = 10.0 ** rng.uniform(-12, -2, (count, 1)), rng.choice([-1.0, 1.0], (count, 1))
    phi = rng.uniform(-np.pi, np.pi, count)
    round_about = np.stack([np.cos(phi), np.sin(phi)], -1)
    found = {
        "everywhere": rng.uniform(0, 1, (count, 2)) * size,
        "corners": rng.integers(0, 2, (count, 2)) * size,
        "near the center": center + tiny * round_about * size * rng.integers(0, 2, (count, 1)),
        "far outside": center + 10.0 ** rng.uniform(0, 8, (count, 1)) * round_about * size,
    }
    if radius is not None:
        focal = np.array(focal_lengths(camera))
        rim = radius * focal / focal.max() * round_about
        found["near the rim"] = center + rim * (1 + sign * tiny)
        found["beyond the rim"] = center + rim * (1 + 10.0 ** rng.uniform(-2, 2, (count, 1)))
    return found
