"""The orthographic camera at its limits: the camera plane, and scenes of all sizes."""

import numpy as np

from mpcam.cameras.orthographic import Orthographic
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, pose
from mpcam.stress.exact import DIGITS, Exact, Real
from mpcam.stress.inputs import central_points, pixels
from mpcam.stress.projections import image_rows, ray_rows
from mpcam.stress.regions import bound_rows
from mpcam.stress.report import LIMIT as LIMIT
from mpcam.stress.report import Case, Progress, StressRow, check_counts, run_cases

SIZE = 512


def cameras() -> dict[str, Orthographic]:
    """Scenes of two units, of tiny and of huge ones, and an axis far outside of the image."""
    return {
        "usual": Orthographic(SIZE, SIZE),
        "tiny scene": Orthographic(SIZE, SIZE, 1e10),
        "huge scene": Orthographic(SIZE, SIZE, 1e-6),
        "off center": Orthographic(SIZE, SIZE, 300.0, 3000.0, -2000.0),
    }


def definition(camera: Orthographic) -> Exact:
    """u = cx + scale x, v = cy + scale y, for z >= 0, at depth z; every pixel has a ray."""
    import mpmath

    with mpmath.workdps(DIGITS):
        cx, cy, scale = (mpmath.mpf(x) for x in (camera.cx, camera.cy, camera.scale))

    def image(x: Real, y: Real, z: Real) -> tuple[Real, Real]:
        return cx + scale * x, cy + scale * y

    return Exact(
        image, lambda x, y, z: -1 if z >= 0 else 1, lambda u, v: -1, float(abs(cx) + abs(cy)), depth=lambda x, y, z: z
    )


def out_of_range(count: int, seed: int = 4) -> np.ndarray:
    """Points (count, 3) so far from the axis that float32 or float64 may not hold their pixels."""
    rng = np.random.default_rng(seed)
    lowest = rng.choice([28, 298], (count, 1))
    return rng.choice([-1.0, 1.0], (count, 3)) * 10.0 ** rng.uniform(lowest, lowest + 10, (count, 3))


def narrow_view(distance: float, width: float) -> Orthographic:
    """For distant eyes: see `distant`."""
    return Orthographic(VIEW, VIEW, 0.5 * VIEW / width, camera_from_world=pose(distance))


def run(triangles: int = 30_000, points: int = 50, progress: Progress | None = None) -> list[StressRow]:
    """All cases: `points` per kind of point, `triangles` per camera. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    cases: list[Case] = []
    for name, camera in cameras().items():
        cases += _cases(name, camera, points, triangles)
    return run_cases([*cases, *distant_cases(narrow_view)], progress)


def _cases(name: str, camera: Orthographic, points: int, triangles: int) -> list[Case]:
    def projections() -> list[StressRow]:
        exact = definition(camera)
        sets = central_points(camera, 0.5 * np.pi, points) | {"out of range": out_of_range(points)}
        return [
            *image_rows(name, camera, exact, sets),
            *ray_rows(name, camera, exact, pixels(camera, None, points)),
        ]

    return [(name, projections), (f"{name}, bounds", lambda: bound_rows(name, camera, triangles))]
