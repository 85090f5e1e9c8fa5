"""The cases of lenses that are symmetric about their axis, whatever their r = f(theta)."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from mpcam.cameras.calibrated import FARTHEST
from mpcam.stress.distant import Factory, distant_cases
from mpcam.stress.exact import DIGITS, Exact, Parameter, Real, focal_lengths
from mpcam.stress.inputs import central_points, pixels
from mpcam.stress.projections import image_rows, ray_rows
from mpcam.stress.regions import BoundOf, bound_rows
from mpcam.stress.report import EPS, Case, Progress, StressRow, check_counts, run_cases


@dataclass(frozen=True)
class Definition:
    """What a lens is, in numbers of mpmath.

    radius: r in focal lengths of rho, z and the values of `numbers`, for a direction (rho, z) of any length. largest:
    the end of the domain of those values, radians.
    """

    radius: Callable[..., Real]
    largest: Callable[..., Real]
    numbers: tuple[Parameter, ...] = ()

    def rim(self, theta: Real, *values: Real) -> Real:
        """r of an angle."""
        import mpmath

        return self.radius(mpmath.sin(theta), mpmath.cos(theta), *values)


@dataclass(frozen=True)
class End:
    """The end of a domain: largest angle, radius in focal lengths, and by how many parts one part in them changes it.

    The radius is taken at the largest angle as a float64, so its condition is for a step of that size, at folds too.
    """

    limit: Real
    rim: Real
    limit_condition: float
    rim_condition: float


def lens_cases(
    name: str,
    camera: Any,
    definition: Definition,
    points: int,
    triangles: int,
    bounds: dict[str, BoundOf] | None = None,
) -> list[Case]:
    """Domain, images, rays and bounds of one camera with cx, cy and focal lengths, called `name` in the table."""

    def projections() -> list[StressRow]:
        end = end_of_domain(definition)
        exact = exact_lens(camera, definition, end)
        return [
            domain_row(name, camera, end),
            *image_rows(name, camera, exact, central_points(camera, float(end.limit), points)),
            *ray_rows(name, camera, exact, pixels(camera, camera.domain.image_radius, points)),
        ]

    return [(name, projections), (f"{name}, bounds", lambda: bound_rows(name, camera, triangles, bounds))]


def lens_suite(
    cameras: Callable[[], Mapping[str, Any]], definition: Callable[[Any], Definition], narrow_view: Factory
) -> Callable[..., list[StressRow]]:
    """The `run` of the suite of a lens: all its cameras by name, each with its definition, and its distant eyes."""

    def run(triangles: int = 30_000, points: int = 50, progress: Progress | None = None) -> list[StressRow]:
        """All cases: `points` per kind of point, `triangles` per camera. Raises InputError below 1."""
        check_counts(triangles=triangles, points=points)
        cases: list[Case] = []
        for name, camera in cameras().items():
            cases += lens_cases(name, camera, definition(camera), points, triangles)
        return run_cases([*cases, *distant_cases(narrow_view)], progress)

    return run


def end_of_domain(definition: Definition) -> End:
    """By the definition, and once more for each of its numbers, changed a little."""
    import mpmath

    with mpmath.workdps(DIGITS):
        values, step = [mpmath.mpf(number.value) for number in definition.numbers], mpmath.mpf(10) ** -15
        limit = definition.largest(*values)
        rim = definition.rim(limit, *values)
        rounded = definition.rim(limit * (1 - mpmath.mpf(EPS["float64"])), *values)
        by_limit, by_rim = mpmath.mpf(1), 1 + abs(rounded / rim - 1) / EPS["float64"]
        for i, number in enumerate(definition.numbers):
            moved = list(values)
            moved[i] += step * mpmath.mpf(number.size)
            other = definition.largest(*moved)
            by_limit += abs(other / limit - 1) / step
            by_rim += abs(definition.rim(other, *moved) / rim - 1) / step
        return End(limit, rim, float(by_limit), float(by_rim))


def exact_lens(camera: Any, definition: Definition, end: End) -> Exact:
    """The camera by its definition: pixel = c + f r (cos phi, sin phi)."""
    import mpmath

    with mpmath.workdps(DIGITS):
        cx, cy, fx, fy = (mpmath.mpf(float(x)) for x in (camera.cx, camera.cy, *focal_lengths(camera)))

    def image(x: Real, y: Real, z: Real, *values: Real) -> tuple[Real, Real]:
        rho = mpmath.sqrt(x * x + y * y)
        if rho == 0 and z < 0:  # the whole circle; by convention its point to the right
            x = rho = -z * mpmath.mpf(10) ** -40
        factor = definition.radius(rho, z, *values) / rho if rho else mpmath.mpf(0)
        return cx + fx * factor * x, cy + fy * factor * y

    def beyond(x: Real, y: Real, z: Real) -> Real:
        return mpmath.atan2(mpmath.sqrt(x * x + y * y), z) / end.limit - 1 if x or y or z else mpmath.mpf(1)

    def outside(u: Real, v: Real) -> Real:
        return mpmath.sqrt(((u - cx) / fx) ** 2 + ((v - cy) / fy) ** 2) / end.rim - 1

    return Exact(
        image, beyond, outside, float(fx + fy), definition.numbers, edge=end.limit_condition, rim=end.rim_condition
    )


def domain_row(name: str, camera: Any, end: End) -> StressRow:
    """`Camera.domain` against the definition: largest angle, and the radius of the image there."""
    import mpmath

    domain, worst = camera.domain, 0.0
    with mpmath.workdps(DIGITS):
        radius = max(focal_lengths(camera)) * end.rim
        truths = ((end.limit, end.limit_condition), (radius, end.rim_condition))
        for found, (truth, condition) in zip((domain.max_angle, domain.image_radius), truths, strict=True):
            if found is not None:
                worst = max(worst, float(abs(mpmath.mpf(float(found)) / truth - 1) / (EPS["float64"] * condition)))
        wrong = int((domain.image_radius is None) != (end.rim > 0.9 * FARTHEST))
    return StressRow(name, "domain", "float64", 2, worst, wrong, 0)
