"""Radial cameras at their limits: projections against 50 digits, boxes against dense sampling."""

from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras.outline import outline
from mpcam.cameras.radial import Radial
from mpcam.errors import InputError
from mpcam.stress.report import Case

LIMIT = 16.0
"""Largest error that passes, in units of eps times the condition number."""

SIZE = 512
Progress = Callable[[int, int, str], None]


def cameras() -> dict[str, Radial]:
    """The four profiles, and the wide views that they allow."""
    wide = {"fov": 1.5 * np.pi}
    return {
        "paraboloid": Radial.paraboloid(SIZE, SIZE),
        "cosine_sphere": Radial.cosine_sphere(SIZE, SIZE),
        "equisolid": Radial.equisolid(SIZE, SIZE),
        "equidistant": Radial.equidistant(SIZE, SIZE),
        "paraboloid 270": Radial.paraboloid(SIZE, SIZE, **wide),
        "equisolid 270": Radial.equisolid(SIZE, SIZE, **wide),
        "equidistant 270": Radial.equidistant(SIZE, SIZE, **wide),
    }


def run(triangles: int = 1_000_000, points: int = 200, progress: Progress | None = None) -> list[Case]:
    """All cases: `points` per kind of projection, `triangles` per camera for the boxes. Raises InputError below 1."""
    if triangles < 1 or points < 1:
        raise InputError(f"stress: triangles={triangles}, points={points}: at least 1 of each is needed")
    cases, views = [], cameras()
    for number, (name, camera) in enumerate(views.items()):
        if progress:
            progress(number, len(views), name)
        cases += projection_cases(name, camera, points)
        cases += bound_cases(name, camera, triangles)
    if progress:
        progress(len(views), len(views), "done")
    return cases


def point_sets(camera: Radial, count: int, seed: int = 1) -> dict[str, np.ndarray]:
    """Points (count, 3) in the camera frame by kind: everywhere, and where something degenerates."""
    rng = np.random.default_rng(seed)

    def at(theta: Any, distance: Any = 1.0) -> np.ndarray:
        phi = rng.uniform(-np.pi, np.pi, count)
        unit = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], -1)
        return unit * np.broadcast_to(distance, (count,))[:, None]

    tiny, sign = 10.0 ** rng.uniform(-12, -2, count), rng.choice([-1.0, 1.0], count)
    half = 0.5 * camera.fov
    return {
        "everywhere": at(rng.uniform(0, np.pi, count), 10.0 ** rng.uniform(-2, 2, count)),
        "near the axis": at(tiny),
        "near the rim": at(half * (1 + sign * tiny)),
        "near the horizon": at(np.pi / 2 + sign * tiny),
        "behind": at(np.pi - tiny),
        "scale 1e-8": at(rng.uniform(0, np.pi, count), 1e-8),
        "scale 1e8": at(rng.uniform(0, np.pi, count), 1e8),
    }


def projection_cases(name: str, camera: Radial, count: int) -> list[Case]:
    """`Camera.local_project` in both precisions against mpmath at 50 digits."""
    from mpcam.backend import types

    cases = []
    for kind, points in point_sets(camera, count).items():
        for precision in ("float64", "float32"):
            if precision == "float64":
                given = points
                image = camera.local_project(given.T)[0]
                pixel, valid, eps = image.pixel.T, image.valid, 2.0**-52
            else:
                given = points.astype(np.float32).astype(np.float64)
                image = camera.local_project(types().Array3f(*given.T.astype(np.float32)))[0]
                pixel, valid, eps = image.pixel.numpy().T, image.valid.numpy(), 2.0**-23
            cases.append(_judged(name, kind, precision, camera, given, pixel.astype(np.float64), valid, eps))
    bad = np.array([[np.nan, 0, 1], [np.inf, 0, 1], [0, -np.inf, 1], [0, 0, 0], [np.inf, np.nan, -np.inf]])
    with np.errstate(invalid="ignore", over="ignore"):
        image = camera.local_project(bad.T)[0]
    invented = int(image.valid.sum() + (~np.isfinite(image.pixel)).sum())
    cases.append(Case(name, "not finite, or the centre", "float64", len(bad), float("nan"), 0, invented))
    return cases


def _judged(
    name: str, kind: str, precision: str, camera: Radial, points: np.ndarray, pixel: Any, valid: Any, eps: float
) -> Case:
    worst, missed, invented = 0.0, 0, 0
    for point, found, claimed in zip(points, pixel, valid, strict=True):
        exact, theta, condition = _exact(camera, point)
        beyond = theta - 0.5 * camera.fov
        doubt = LIMIT * eps * np.pi
        if beyond > doubt:
            invented += int(claimed)
        elif not claimed:
            missed += int(beyond < -doubt)
        else:
            worst = max(worst, float(np.abs(found - exact).max()) / (eps * condition))
    return Case(name, kind, precision, len(points), worst, missed, invented)


def _exact(camera: Radial, point: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Pixel and angle of a point from 50 digits, and the condition number of the pixel in pixels.

    The condition is what an error of one part in the point's coordinates and in the image's scale makes of the pixel.
    """
    import mpmath

    with mpmath.workdps(50):
        formula = {
            "paraboloid": lambda t: mpmath.tan(t / 2),
            "cosine_sphere": mpmath.sin,
            "equisolid": lambda t: mpmath.sqrt(2) * mpmath.sin(t / 2),
            "equidistant": lambda t: 2 * t / mpmath.pi,
        }[camera.profile.name]
        scale = mpmath.mpf(float(camera.radius)) / formula(mpmath.mpf(float(camera.fov)) / 2)

        def image(x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
            rho = mpmath.hypot(x, y)
            theta = mpmath.atan2(rho, z)
            factor = scale * formula(theta) / rho if rho else mpmath.mpf(0)
            return camera.cx + factor * x, camera.cy + factor * y, theta

        p = [mpmath.mpf(float(c)) for c in point]
        u, v, theta = image(*p)
        condition = abs(u) + abs(v) + abs(scale)
        step = mpmath.mpf(10) ** -25
        for i in range(3):
            moved = list(p)
            moved[i] *= 1 + step
            a, b, _ = image(*moved)
            condition += (abs(a - u) + abs(b - v)) / step
        return np.array([float(u), float(v)]), float(theta), float(condition)


def bound_cases(name: str, camera: Radial, count: int, seed: int = 3, chunk: int = 250_000) -> list[Case]:
    """All bounds of random triangles, as the kernels compute them (float32), against samples in float64."""
    missed = dict.fromkeys(BOUNDS, 0)
    rng, done = np.random.default_rng(seed), 0
    while done < count:
        now = min(chunk, count - done)
        centre = rng.normal(size=(now, 1, 3))
        corners = centre + 10 ** rng.uniform(-3, 0.8, (now, 1, 1)) * rng.normal(size=(now, 3, 3))
        corners = corners.astype(np.float32)
        for kind, wrong in _missed(camera, corners).items():
            missed[kind] += wrong
        done += now
    return [Case(name, kind, "float32", count, float("nan"), missed[kind], 0) for kind in BOUNDS]


def _missed(camera: Radial, corners: np.ndarray) -> dict[str, int]:
    """How many triangles have a sampled point, along the edges or inside, that a bound leaves out."""
    import drjit as dr

    from mpcam.backend import types

    t = types()
    exact = [t.Array3f64(*corners[:, i].T.astype(np.float64)) for i in range(3)]
    single = [t.Array3f(*corners[:, i].T) for i in range(3)]
    regions = {kind: [_Region(t, region) for region in bound(camera, *single)] for kind, bound in BOUNDS.items()}
    out = {kind: t.Bool(False) for kind in regions}
    dr.eval([region.arrays for several in regions.values() for region in several])
    for weights in _weights():
        point = exact[0] * weights[0] + exact[1] * weights[1] + exact[2] * weights[2]
        image = camera.local_project(point)[0]
        for kind, several in regions.items():
            held = t.Bool(False)
            for region in several:
                held |= region.holds(image.pixel)
            out[kind] = out[kind] | (image.valid & ~held)
        dr.eval(out)
    counts = {kind: dr.count(wrong) for kind, wrong in out.items()}
    return {kind: int(many[0]) for kind, many in counts.items()}  # pyright: ignore[reportIndexIssue]


class _Region:
    """A box with three lines, widened as the kernels widen it, in float64."""

    def __init__(self, types: Any, region: Any):
        self.low, self.high = types.Array2f64(region[0]), types.Array2f64(region[1])
        self.valid, self.lines = region[2], [types.Array3f64(*line) for line in region[3]]
        self.arrays = (self.low, self.high, self.valid, self.lines)

    def holds(self, pixel: Any) -> Any:
        slack = 2e-6 * SIZE + 1e-3
        inside = self.valid & (pixel.x >= self.low.x - slack) & (pixel.y >= self.low.y - slack)
        inside &= (pixel.x <= self.high.x + slack) & (pixel.y <= self.high.y + slack)
        for a, b, c in self.lines:
            inside &= a * pixel.x + b * pixel.y + c >= -slack
        return inside


def _pieces(camera: Radial, a: Any, b: Any, c: Any) -> list[Any]:
    return [(piece.low, piece.high, piece.valid, piece.lines) for piece in camera.local_bound_triangles(a, b, c)]


BOUNDS: dict[str, Callable[..., list[Any]]] = {
    "box": lambda camera, a, b, c: [(*camera.local_bound(a, b, c), ())],
    "outline": lambda camera, a, b, c: [outline(camera, a, b, c)],
    "bounding triangles": _pieces,
    "box of quads": lambda camera, a, b, c: [(*camera.local_bound_quads(a, b, c), ())],
}
"""Regions of which one holds each point of a triangle's image: low, high, valid, lines."""


def _weights() -> list[tuple[float, float, float]]:
    """Barycentric weights of the samples: 33 along each edge, denser at its ends, and a few inside."""
    s = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, 33))
    edges = [(1 - a, a, 0.0) for a in s] + [(0.0, 1 - a, a) for a in s] + [(a, 0.0, 1 - a) for a in s]
    inside = [(0.34, 0.33, 0.33), (0.8, 0.1, 0.1), (0.1, 0.8, 0.1), (0.1, 0.1, 0.8)]
    return [*edges, *inside]
