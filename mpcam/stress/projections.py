"""Images of points and rays of pixels in both precisions, against a camera's definition at 50 digits.

float64 is NumPy's. float32 is that of the kernels, with the camera's numbers on the device; the truth is that of the
float32 points and pixels, and of the camera's numbers as they were given.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from mpcam.stress.exact import DIGITS, Exact
from mpcam.stress.inputs import BAD_PIXELS, BAD_POINTS
from mpcam.stress.report import EPS, LIMIT, StressRow


def image_rows(name: str, camera: Any, exact: Exact, points: dict[str, np.ndarray]) -> list[StressRow]:
    """`local_project` of points (N, 3) by kind, for cameras with one image of a point; and of points that are none."""
    rows = []
    for kind, precision, given in rounded(points):
        found = images(camera, given, precision)
        rows.append(judge_images(name, f"images, {kind}", precision, exact, given, found))
    return rows + bad_image_rows(name, camera)


def bad_image_rows(name: str, camera: Any) -> list[StressRow]:
    """`local_project` of points that are none: nothing valid, and finite numbers."""
    rows = []
    for precision in EPS:
        pixel, depth, valid = images(camera, BAD_POINTS, precision)
        invented = int(valid.sum() + (~np.isfinite(pixel)).sum() + (~np.isfinite(depth)).sum())
        rows.append(StressRow(name, "images, not finite", precision, len(valid), float("nan"), 0, invented))
    return rows


def ray_rows(name: str, camera: Any, exact: Exact, pixels: dict[str, np.ndarray]) -> list[StressRow]:
    """`local_ray` of pixels (N, 2) by kind, and of pixels that are none."""
    rows = []
    for kind, precision, given in rounded(pixels):
        found = rays(camera, given, precision)
        rows.append(judge_rays(name, f"rays, {kind}", precision, exact, given, found))
    for precision in EPS:
        origin, direction, valid = rays(camera, BAD_PIXELS, precision)
        invented = int(valid.sum() + (~np.isfinite(origin)).sum() + (~np.isfinite(direction)).sum())
        rows.append(StressRow(name, "rays, not finite", precision, len(valid), float("nan"), 0, invented))
    return rows


def rounded(sets: dict[str, np.ndarray]) -> Iterator[tuple[str, str, np.ndarray]]:
    """Kind, precision and rows as that precision holds them, without those that it cannot."""
    for kind, given in sets.items():
        for precision in EPS:
            with np.errstate(over="ignore"):
                rounded = given.astype(precision).astype(np.float64)
            rounded = rounded[np.isfinite(rounded).all(axis=1)]
            if len(rounded):
                yield kind, precision, rounded


def images(camera: Any, points: np.ndarray, precision: str) -> tuple[np.ndarray, ...]:
    """First image of points (N, 3): pixel (N, 2), depth (N,), valid (N,), as float64."""
    if precision == "float64":
        with np.errstate(all="ignore"):
            image = camera.local_project(points.T)[0]
        return image.pixel.T, image.depth, image.valid
    lens, given = _on_device(camera, points)
    return _numbers(lens.local_project(given)[0], len(points))


def rays(camera: Any, pixels: np.ndarray, precision: str) -> tuple[np.ndarray, ...]:
    """Rays of pixels (N, 2): origin (N, 3), direction (N, 3), valid (N,), as float64."""
    if precision == "float64":
        with np.errstate(all="ignore"):
            ray = camera.local_ray(pixels.T)
        return ray.origin.T, ray.direction.T, ray.valid
    lens, given = _on_device(camera, pixels)
    return _numbers(lens.local_ray(given), len(pixels))


def _on_device(camera: Any, given: np.ndarray) -> tuple[Any, Any]:
    """The camera as kernels have it, and rows as vectors of theirs."""
    from mpcam.backend import opaque_zero, types
    from mpcam.rendering.device_camera import on_device

    lens = on_device(camera)
    kind = getattr(types(), f"Array{given.shape[1]}f")
    # In Dr.Jit's own memory: kernels are compiled anew for NumPy's, by how it happens to be aligned.
    return lens, kind(*np.ascontiguousarray(given.T, np.float32)) + opaque_zero()


def _numbers(found: Any, count: int) -> tuple[np.ndarray, ...]:
    """Device arrays as NumPy's, one row for each input."""
    import drjit as dr

    dr.eval(found)
    parts = [np.asarray(part.numpy()) for part in found]
    return tuple(
        np.broadcast_to(part if part.dtype == bool else part.astype(np.float64).T, (count, *part.shape[:-1]))
        for part in parts
    )


def judge_images(name: str, case: str, precision: str, exact: Exact, points: np.ndarray, found: Any) -> StressRow:
    """Images against their definition: pixel within the condition, depth to its last places, valid in the domain."""
    import mpmath

    eps, worst, missed, invented = EPS[precision], 0.0, 0, 0
    doubt = LIMIT * (eps + EPS["float64"] * exact.edge)
    with mpmath.workdps(DIGITS):
        for point, pixel, depth, claimed in zip(points, *found, strict=True):
            given = [mpmath.mpf(float(x)) for x in point]
            beyond = exact.beyond(*given)
            truth = exact.pixel(point) if beyond <= 0 else None
            too_large = truth is not None and max(map(abs, truth)) > np.finfo(precision).max
            if beyond > doubt or too_large:
                invented += int(claimed)
            elif not claimed:
                missed += int(beyond < -doubt)
            elif truth is not None:
                error = _distance(pixel, truth) / (eps * exact.condition(point))
                length = exact.depth(*given)
                along = abs(_real(depth) - length) / (eps * length) if length else abs(_real(depth)) / eps
                worst = max(worst, float(error), float(along))
    return StressRow(name, case, precision, len(points), worst, missed, invented)


def judge_rays(name: str, case: str, precision: str, exact: Exact, pixels: np.ndarray, found: Any) -> StressRow:
    """Rays against the definition of images: the ray's point has that pixel, within the condition there.

    Where the image hardly depends on the ray, at a fold, that is all that can be asked.
    """
    import mpmath

    eps, worst, missed, invented = EPS[precision], 0.0, 0, 0
    at_edge, at_rim = (LIMIT * (eps + EPS["float64"] * condition) for condition in (exact.edge, exact.rim))
    with mpmath.workdps(DIGITS):
        for pixel, origin, direction, claimed in zip(pixels, *found, strict=True):
            outside = exact.outside(*(mpmath.mpf(float(x)) for x in pixel))
            if outside > at_rim:
                invented += int(claimed)
            elif not claimed:
                missed += int(outside < -at_rim)
            else:
                along = [_real(x) for x in direction]
                point = [_real(x) + y for x, y in zip(origin, along, strict=True)]
                if not all(mpmath.isfinite(x) for x in point) or exact.beyond(*point) > LIMIT * (
                    eps + EPS["float64"] * exact.edge
                ):
                    invented += 1
                    continue
                unit = abs(mpmath.sqrt(sum(x * x for x in along)) - 1) / eps
                point = _off_axis(exact, point, pixel)
                error = _distance(pixel, exact.pixel(point)) / (eps * exact.condition(point))
                worst = max(worst, float(unit), float(error))
    return StressRow(name, case, precision, len(pixels), worst, missed, invented)


def _off_axis(exact: Exact, point: list[Any], pixel: Any) -> list[Any]:
    """The point itself but straight behind, of which the image is a circle: then beside it, on the pixel's side."""
    import mpmath

    x, y, z = point
    if x or y or z >= 0:
        return point
    step = mpmath.mpf(10) ** -40
    center, right, below = (exact.pixel(ahead) for ahead in ((0, 0, 1), (step, 0, 1), (0, step, 1)))
    focal = right[0] - center[0], below[1] - center[1]
    toward = [(_real(a) - b) / c for a, b, c in zip(pixel, center, focal, strict=True)]
    length = mpmath.hypot(*toward) or 1
    return [-z * step * a / length for a in toward] + [z]


def _distance(pixel: Any, truth: tuple[Any, Any]) -> Any:
    return max(abs(_real(x) - y) for x, y in zip(pixel, truth, strict=True))


def _real(x: Any) -> Any:
    """A float as a number of mpmath, infinite where it is none."""
    import mpmath

    return mpmath.mpf(float(x)) if np.isfinite(float(x)) else mpmath.inf
