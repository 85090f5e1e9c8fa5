"""General linear cameras at their limits: slits, near-ties of kinds, generators on a line, scenes of all sizes."""

from typing import Any

import numpy as np

from mpcam.cameras.general_linear import GeneralLinear
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, focal_length, pose
from mpcam.stress.exact import DIGITS
from mpcam.stress.general_linear_kinds import kind_rows
from mpcam.stress.general_linear_truth import Truth
from mpcam.stress.inputs import BAD_PIXELS
from mpcam.stress.projections import bad_image_rows, images, rays, rounded
from mpcam.stress.regions import bound_rows
from mpcam.stress.report import EPS, Case, Progress, StressRow, check_counts, run_cases
from mpcam.stress.report import LIMIT as LIMIT

SIZE = 512
CORNERS = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
_KNOWABLE = 1 / 64  # of the image: images that rounding of the input moves by more may come back invalid


def of_slopes(matrix: Any, middle: Any = (0.125, -0.25), scale: float = 1.0, steep: float = 1.0) -> GeneralLinear:
    """(sigma, tau) = steep (M (u, v) + middle), over an image that shows u and v from 0 to scale."""
    places = np.array(CORNERS)
    slopes = steep * (places @ np.asarray(matrix, np.float64).T + middle)
    return GeneralLinear(np.concatenate([slopes, scale * places], axis=1), SIZE, SIZE, CORNERS)


def cameras() -> dict[str, GeneralLinear]:
    """Each kind, slits at exact depths in the scene, near-ties of two kinds, and everything tiny and huge."""
    ahead = [[-0.5, 0], [0, -0.25]]
    found = {f"{kind}": camera for kind, camera in GeneralLinear.examples(SIZE, SIZE).items()}
    found |= {
        "slits at 2 and 4": of_slopes(ahead),
        "slanted slits at 2 and 4": of_slopes([[-0.5, 0.125], [0, -0.25]]),
        "slit at 2, parallel": of_slopes([[-0.5, 0], [0, 0]]),
        "center at 2": of_slopes([[-0.5, 0], [0, -0.5]]),
        "pencil at 2": of_slopes([[-0.5, 1], [0, -0.5]]),
        "generators on a line at 1": GeneralLinear(
            [[0, 0, 0, 0], [1, 0.5, 0, 0.5], [0.25, 1, 1.75, 0]], SIZE, SIZE, CORNERS
        ),
        "off center": of_slopes([[0.5, 0.1], [-0.2, 0.3]], (300.0, -700.0)),
    }
    for power in (4, 8, 12):
        tiny = 10.0**-power
        found |= {
            f"slits 1e-{power} apart": of_slopes([[-0.5, 0], [0, -0.5 * (1 + tiny)]]),
            f"pencil but 1e-{power}": of_slopes([[-0.5, 1], [-tiny, -0.5]]),
            f"bilinear but 1e-{power}": of_slopes([[-0.5, 1], [tiny, -0.5]]),
            f"nearly parallel, 1e-{power}": of_slopes([[tiny, 0], [0, 2 * tiny]]),
        }
    for scale in (1e-8, 1e8):
        found |= {
            f"slits, image of {scale:g}": of_slopes(ahead, scale=scale),
            f"bilinear, image of {scale:g}": of_slopes([[0.5, -1], [1, 0.5]], scale=scale),
            f"slits, depths of {scale:g}": of_slopes(ahead, steep=1 / scale),
        }
    return found


def inputs(camera: GeneralLinear, count: int, seed: int = 5) -> dict[str, np.ndarray]:
    """Points (count, 3) by kind, in the camera frame."""
    rng = np.random.default_rng(seed)
    table, side = np.asarray(camera.rays), camera.width
    extent = float(np.abs(table[:, 2:]).max()) or 1.0
    depths = [float(f"{z:.12g}") for z in camera.domain.slit_depths]  # exact where they are short numbers
    deep = max([abs(z) for z in depths if z] or [extent / max(float(np.abs(table[:, :2]).max()), 1e-3)])
    sign = rng.choice([-1.0, 1.0], count)

    def beside(z: np.ndarray) -> np.ndarray:
        """Points at depths, where pixels see them or anywhere."""
        ray = camera.local_ray(rng.uniform(0, side, (2, count)))
        there = ray.origin + ray.direction / ray.direction[2] * z
        away = extent * rng.normal(size=(2, count)) * 10.0 ** rng.uniform(-3, 1, count)
        there[:2] += away * rng.choice([0, 1], count)
        there[2] = z
        return there.T

    found = {
        "in the image": beside(deep * 10.0 ** rng.uniform(-2, 2, count)),
        "everywhere": (extent * rng.normal(size=(3, count)) * 10.0 ** rng.uniform(-2, 2, count)).T,
        "before the plane": beside(-deep * 10.0 ** rng.uniform(-3, 2, count)),
        "on the plane": beside(np.zeros(count)),
        "near the plane": beside(deep * 10.0 ** rng.uniform(-16, -3, count)),
        "far away": beside(deep * 10.0 ** rng.uniform(3, 8, count)),
    }
    for number, z in enumerate(depths):
        near = z + sign * 10.0 ** rng.uniform(-17, -1, count) * (abs(z) or deep)
        found[f"near slit {number + 1}"] = beside(near)
        found[f"in the plane of slit {number + 1}"] = beside(np.full(count, z))
    for number, slit in enumerate(camera.with_pose(np.eye(4)).slits):
        along = extent * rng.normal(size=(count, 1)) * 10.0 ** rng.uniform(-2, 1, (count, 1))
        found[f"on slit {number + 1}"] = slit.point + along * slit.direction
    return found


def image_rows(name: str, camera: GeneralLinear, points: dict[str, np.ndarray]) -> list[StressRow]:
    """`local_project` in both precisions."""
    truth, rows = Truth(camera), []
    for kind, precision, given in rounded(points):
        rows.append(judge(name, f"images, {kind}", precision, truth, given, images(camera, given, precision)))
    return rows + bad_image_rows(name, camera)


def judge(name: str, case: str, precision: str, truth: Truth, points: np.ndarray, found: Any) -> StressRow:
    """Images of points against their definition: within the condition, none before z = 0 and in planes of slits."""
    import mpmath

    eps, (pixel, depth, claimed) = EPS[precision], found
    with mpmath.workdps(DIGITS):
        exact = [truth.image(point) for point in points]
        some = np.array([image is not None for image in exact])
        off, deep, areas, weights = np.zeros(len(points)), np.zeros(len(points)), np.ones(len(points)), []
        for i, image in enumerate(exact):
            if image is not None:
                off[i] = max(abs(mpmath.mpf(float(pixel[i][k])) - image.pixel[k]) for k in range(2))
                deep[i] = abs(mpmath.mpf(float(depth[i])) - image.depth)
                areas[i] = float(image.area)
            weights.append([0.0, 0.0, 0.0] if image is None else [float(w) for w in image.weights])
    seen = some & (points[:, 2] >= 0)
    with np.errstate(all="ignore"):
        condition, along = truth.condition(points, areas, np.array(weights))
        largest = max(float(np.abs(truth.places).max()), 1.0)
        knowable = seen & (eps * condition < _KNOWABLE * largest) & (condition < 0.01 * np.finfo(precision).max)
        kept = claimed & seen
        worst = max(_worst(off[kept] / (eps * condition[kept])), _worst(deep[kept] / (eps * along[kept])))
    missed, invented = int((knowable & ~claimed).sum()), int((claimed & ~seen).sum())
    return StressRow(name, case, precision, len(points), worst, missed, invented)


def _worst(errors: np.ndarray) -> float:
    """The largest, infinite where one is no number; 0 / 0 is no error."""
    return float(np.where(np.isnan(errors), 0.0, errors).max(initial=0.0))


def ray_rows(name: str, camera: GeneralLinear, pixels: dict[str, np.ndarray]) -> list[StressRow]:
    """`local_ray` in both precisions."""
    import mpmath

    truth, rows = Truth(camera), []
    for kind, precision, given in rounded(pixels):
        eps, worst, missed = EPS[precision], 0.0, 0
        with mpmath.workdps(DIGITS):
            for pixel, origin, direction, valid in zip(given, *rays(camera, given, precision), strict=True):
                (sigma, tau, u, v), sizes = truth.ray(pixel)
                length = mpmath.sqrt(sigma * sigma + tau * tau + 1)
                missed += int(not valid)
                allowed = [eps * max(size, mpmath.mpf(10) ** -300) for size in (sizes[2], sizes[3])]
                errors = [abs(float(origin[0]) - u) / allowed[0], abs(float(origin[1]) - v) / allowed[1]]
                slant = eps * (1 + (sizes[0] + sizes[1]) / length)
                exact = (sigma / length, tau / length, 1 / length)
                errors += [abs(float(direction[k]) - exact[k]) / slant for k in range(3)]
                worst = max(worst, *map(float, errors), float(abs(origin[2])) / eps)
        rows.append(StressRow(name, f"rays, {kind}", precision, len(given), worst, missed, 0))
    for precision in EPS:
        origin, direction, valid = rays(camera, BAD_PIXELS, precision)
        invented = int(valid.sum() + (~np.isfinite(origin)).sum() + (~np.isfinite(direction)).sum())
        rows.append(StressRow(name, "rays, not finite", precision, len(valid), float("nan"), 0, invented))
    return rows


def pixels(count: int, seed: int = 6) -> dict[str, np.ndarray]:
    """Pixels (count, 2), in the image and far outside of it."""
    rng = np.random.default_rng(seed)
    return {
        "in the image": rng.uniform(0, SIZE, (count, 2)),
        "far outside": SIZE * rng.normal(size=(count, 2)) * 10.0 ** rng.uniform(0, 6, (count, 1)),
    }


def narrow_view(distance: float, width: float) -> GeneralLinear:
    """For distant eyes: see `distant`."""
    return GeneralLinear.pinhole(VIEW, VIEW, focal_length(distance, width), camera_from_world=pose(distance))


def run(triangles: int = 30_000, points: int = 50, progress: Progress | None = None) -> list[StressRow]:
    """All cases: `points` per kind of point, `triangles` per camera. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    cases: list[Case] = [("kinds", lambda: kind_rows(points))]
    for name, camera in cameras().items():
        cases += _cases(name, camera, points, triangles)
    return run_cases([*cases, *distant_cases(narrow_view)], progress)


def _cases(name: str, camera: GeneralLinear, points: int, triangles: int) -> list[Case]:
    def projections() -> list[StressRow]:
        return [*image_rows(name, camera, inputs(camera, points)), *ray_rows(name, camera, pixels(points))]

    return [(name, projections), (f"{name}, bounds", lambda: bound_rows(name, camera, triangles))]
