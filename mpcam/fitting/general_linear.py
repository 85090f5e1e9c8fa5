"""The general linear camera that comes nearest to given rays, in closed form, and its plane's tilt by Optimistix.

A ray is four numbers: where it crosses two parallel planes. General linear cameras are the flat families of dimension
two among them (Yu and McMillan 2004), so that the best one is what principal components say: the middle of all rays,
and the two directions in which they spread most. Which planes matter: families that are flat for one tilt are not for
others. If none is given, they lie at right angles to the mean direction.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.general_linear import GeneralLinear
from mpcam.checks import is_number, shown, three_numbers, whole_number
from mpcam.errors import InputError

_STEEP = 0.05
"""Least part of a unit ray along the planes' normal: others do not cross them properly."""
_FLAT = 1e-9


@dataclass(frozen=True, eq=False)
class GeneralLinearFit:
    """A general linear camera and how well it does.

    camera: the GeneralLinear, in the world; its image is the box that the rays fill in one of the two planes. kind,
    margin: the camera's. residual: root mean square of the distances between rays and the camera's nearest ones where
    they cross the two planes, scene units; worst: the largest. used (N,): which rays cross the planes. status:
    "converged", or "rank_deficient" where rays are no family of two dimensions, and "stalled" where tilting found
    nothing better or failed.
    """

    camera: GeneralLinear
    kind: str
    margin: float
    residual: float
    worst: float
    used: np.ndarray
    normal: np.ndarray
    status: str

    def __repr__(self) -> str:
        return f"GeneralLinearFit({self.kind}, margin {self.margin:.3g}, residual {self.residual:.3g}, {self.status})"


def fit_general_linear(
    origins: Any,
    directions: Any,
    *,
    normal: Any = None,
    depth: float | None = None,
    width: int = 64,
    height: int = 64,
) -> GeneralLinearFit:
    """The best single general linear camera for rays.

    origins, directions (N, 3): world, directions of any length but zero. normal: of its planes (3,); None for the mean
    direction, "free" to fit it too, from there. depth: distance of the two planes where errors count, from the middle
    of the origins on along the normal; default: how far the rays spread in the first. width, height: of its image.
    With independent errors of the same size in both planes this is the estimate of maximum likelihood. Raises
    InputError for shapes that do not fit, numbers that are not finite and zero directions.
    """
    starts, ways = (_table(name, values) for name, values in (("origins", origins), ("directions", directions)))
    if starts.shape != ways.shape:
        raise InputError(f"origins has {len(starts)} rows, directions {len(ways)}: give one direction for each")
    length = np.linalg.norm(ways, axis=1, keepdims=True)
    if (length == 0).any():
        raise InputError(f"directions: row {int(np.flatnonzero(length[:, 0] == 0)[0])} is zero: give a direction")
    if depth is not None and (not is_number(depth) or depth <= 0):
        raise InputError(f"depth={shown(depth)}: give a finite number above 0, in scene units")
    width, height = (whole_number(n, v, 1, 1 << 20) for n, v in (("width", width), ("height", height)))
    ways = ways / length
    mean = ways.mean(axis=0)
    free = isinstance(normal, str) and normal == "free"
    axis = mean if normal is None or free else three_numbers("normal", normal, ', or "free"')
    if np.linalg.norm(axis) <= _FLAT:
        axis = np.linalg.svd(ways)[2][0]
    axis = axis / np.linalg.norm(axis)
    bundle = _Bundle(starts, ways, depth)
    status = "converged"
    if free and bundle.enough(axis):
        axis, status = _tilted(bundle, axis)
    return bundle.fit(axis, status, width, height)


class _Bundle:
    """Rays, their middle and the distance of the planes."""

    def __init__(self, starts: np.ndarray, ways: np.ndarray, depth: float | None):
        self.starts, self.ways, self.given = starts, ways, depth
        self.middle = starts.mean(axis=0)

    def axes(self, normal: np.ndarray) -> np.ndarray:
        """Rows right, down and forward."""
        helper = np.eye(3)[np.abs(normal).argmin()]
        right = np.cross(normal, helper)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(normal, right), normal])

    def crossings(self, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
        """(N, 4) places in both planes, which rays cross them, and the distance of the planes."""
        axes = self.axes(normal)
        start, way = (self.starts - self.middle) @ axes.T, self.ways @ axes.T
        used = np.abs(way[:, 2]) > _STEEP
        slope = way[:, :2] / np.where(used, way[:, 2], 1.0)[:, None]
        near = start[:, :2] - start[:, 2:] * slope
        size = float(np.sqrt(((near[used] - near[used].mean(axis=0)) ** 2).sum(axis=1).mean())) if used.any() else 0.0
        depth = self.given or size or 1.0
        return np.concatenate([near, near + depth * slope], axis=1), used, depth

    def enough(self, normal: np.ndarray) -> bool:
        places, used, _ = self.crossings(normal)
        return _spread(places[used])[2] and int(used.sum()) >= 5

    def fit(self, normal: np.ndarray, status: str, width: int, height: int) -> GeneralLinearFit:
        places, used, depth = self.crossings(normal)
        chosen = places[used] if used.any() else np.zeros((1, 4))
        mean, ways, flat = _spread(chosen)
        rest = chosen - mean
        rest = rest - rest @ ways.T @ ways
        miss = np.sqrt(0.5 * (rest**2).sum(axis=1))
        corners, image = _corners(chosen, mean, ways)
        generators = np.concatenate([(corners[:, 2:] - corners[:, :2]) / depth, corners[:, :2]], axis=1)
        pose = np.eye(4)
        pose[:3, :3] = self.axes(normal)
        pose[:3, 3] = -pose[:3, :3] @ self.middle
        camera = GeneralLinear(generators, width, height, image, pose)
        return GeneralLinearFit(
            camera=camera,
            kind=camera.kind,
            margin=camera.margin,
            residual=float(np.sqrt((miss**2).mean())),
            worst=float(miss.max()),
            used=used,
            normal=normal,
            status=status if flat else "rank_deficient",
        )


def _spread(places: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool]:
    """Mean (4,), the two directions (2, 4) of largest spread, and whether rays spread along both."""
    if not len(places):
        return np.zeros(4), np.eye(4)[:2], False
    mean = places.mean(axis=0)
    _, sizes, ways = np.linalg.svd(np.concatenate([places - mean, np.zeros((4, 4))]), full_matrices=False)
    scale = np.abs(places).max()
    return mean, ways[:2], bool(sizes[1] > _FLAT * max(sizes[0], scale * 1e-3) and len(places) >= 3)


def _corners(places: np.ndarray, mean: np.ndarray, ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rays (3, 4) at the corners of the box that the family's rays fill in the plane where it is widest."""
    planes = [np.linalg.svd(ways[:, i : i + 2], compute_uv=False)[1] for i in (0, 2)]
    first = 2 * int(planes[1] > planes[0])
    to_place = ways[:, first : first + 2]
    image = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    if max(planes) <= _FLAT:  # in each plane it is a line at most: the box is one of its own coordinates
        own = (places - mean) @ ways.T
        low, high = own.min(axis=0), own.max(axis=0)
        return mean + (low + image * np.where(high > low, high - low, 1.0)) @ ways, image
    seen = mean + (places - mean) @ ways.T @ ways
    low, high = (end(seen[:, first : first + 2], axis=0) for end in (np.min, np.max))
    corner = low + image * np.where(high > low, high - low, 1.0)
    return mean + np.linalg.solve(to_place.T, (corner - mean[first : first + 2]).T).T @ ways, image


def _tilted(bundle: _Bundle, normal: np.ndarray) -> tuple[np.ndarray, str]:
    """The normal near a given one for which rays are nearest to a flat family, by Optimistix's dense LM."""
    import jax
    import jax.numpy as jnp
    import optimistix as optx

    axes = bundle.axes(normal)
    places, used, depth = bundle.crossings(normal)
    start, way = ((values[used]) @ axes.T for values in (bundle.starts - bundle.middle, bundle.ways))
    mean, ways, _ = _spread(places[used])
    swap = bool(np.linalg.svd(ways[:, 2:])[1][1] > np.linalg.svd(ways[:, :2])[1][1])
    one, other = (ways[:, 2:], ways[:, :2]) if swap else (ways[:, :2], ways[:, 2:])
    if np.linalg.svd(one)[1][1] <= 1e-6:
        return normal, "stalled"
    slope = np.linalg.solve(one, other).T  # the other plane's place from this one's
    low = mean[2:] if swap else mean[:2]
    high = mean[:2] if swap else mean[2:]
    guess = np.concatenate([np.zeros(2), slope.ravel(), high - slope @ low])

    def residuals(y: Any, given: Any) -> Any:
        start, way, depth = given
        forward = jnp.array([y[0], y[1], 1.0]) / jnp.sqrt(1.0 + y[0] ** 2 + y[1] ** 2)
        right = jnp.array([1.0, 0.0, 0.0]) - forward[0] * forward
        right = right / jnp.sqrt(right @ right)
        turn = jnp.stack([right, jnp.cross(forward, right), forward])
        o, d = start @ turn.T, way @ turn.T
        steep = jnp.where(jnp.abs(d[:, 2:]) > _STEEP, d[:, 2:], _STEEP)
        near = o[:, :2] - o[:, 2:] * d[:, :2] / steep
        far = near + depth * d[:, :2] / steep
        a, b = (far, near) if swap else (near, far)
        matrix = y[2:6].reshape(2, 2)
        gap = b - a @ matrix.T - y[6:]
        # The distance to the family at right angles to it, in both planes together.
        root = jnp.linalg.cholesky(jnp.eye(2) + matrix @ matrix.T)
        return jax.scipy.linalg.solve_triangular(root, gap.T, lower=True) / depth

    with jax.enable_x64(True):
        solver = optx.LevenbergMarquardt(rtol=1e-10, atol=1e-12)
        given = (jnp.asarray(start), jnp.asarray(way), jnp.float64(depth))
        found = optx.least_squares(residuals, solver, jnp.asarray(guess), args=given, max_steps=200, throw=False)
        value = np.asarray(found.value)
        before, after = (float((residuals(jnp.asarray(y), given) ** 2).sum()) for y in (guess, value))
    if not np.isfinite(value).all() or not after < before:
        return normal, "stalled"
    tilted = np.array([value[0], value[1], 1.0]) @ axes
    return tilted / np.linalg.norm(tilted), "converged"


def _table(name: str, values: Any) -> np.ndarray:
    try:
        table = np.array(values, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} is not an array of numbers: give shape (N, 3)") from None
    if table.ndim != 2 or table.shape[1] != 3 or not len(table):
        raise InputError(f"{name} has shape {table.shape}: give (N, 3), one row for each ray")
    if not np.isfinite(table).all():
        raise InputError(f"{name} holds NaN or infinity in row {int(np.flatnonzero(~np.isfinite(table).all(1))[0])}")
    return table
