"""The pinhole at its limits: the camera plane, narrow and wide views, and images that no number holds."""

import numpy as np

from mpcam.cameras.pinhole import Pinhole
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, focal_length, pose
from mpcam.stress.exact import DIGITS, Exact, Real
from mpcam.stress.inputs import central_points, pixels
from mpcam.stress.projections import image_rows, ray_rows
from mpcam.stress.regions import bound_rows
from mpcam.stress.report import LIMIT as LIMIT
from mpcam.stress.report import Case, Progress, StressRow, check_counts, run_cases

SIZE = 512


def cameras() -> dict[str, Pinhole]:
    """Usual, narrow, wide, and with a principal point far outside of the image."""
    return {
        "90 degrees": Pinhole(SIZE, SIZE),
        "narrow": Pinhole(SIZE, SIZE, 1e6, 1.1e6, 250.0, 260.0),
        "wide": Pinhole(SIZE, SIZE, 1.0, 1.3),
        "off center": Pinhole(SIZE, SIZE, 300.0, 300.0, 3000.0, -2000.0),
    }


def definition(camera: Pinhole) -> Exact:
    """u = cx + fx x / z, v = cy + fy y / z, for z > 0; every pixel has a ray."""
    import mpmath

    with mpmath.workdps(DIGITS):
        cx, cy, fx, fy = (mpmath.mpf(x) for x in (camera.cx, camera.cy, camera.fx, camera.fy))

    def image(x: Real, y: Real, z: Real) -> tuple[Real, Real]:
        return cx + fx * x / z, cy + fy * y / z

    return Exact(image, lambda x, y, z: -1 if z > 0 else 1, lambda u, v: -1, float(fx + fy))


def out_of_range(count: int, seed: int = 4) -> np.ndarray:
    """Points (count, 3) hardly in front of the camera plane, whose pixels float32 or float64 cannot hold."""
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    lowest = rng.choice([-37, -307], count)  # below, numbers lose their digits
    points[:, 2] = 10.0 ** rng.uniform(lowest, lowest + 14)
    return points


def narrow_view(distance: float, width: float) -> Pinhole:
    """For distant eyes: see `distant`."""
    return Pinhole(VIEW, VIEW, focal_length(distance, width), camera_from_world=pose(distance))


def run(triangles: int = 30_000, points: int = 50, progress: Progress | None = None) -> list[StressRow]:
    """All cases: `points` per kind of point, `triangles` per camera. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    cases: list[Case] = []
    for name, camera in cameras().items():
        cases += _cases(name, camera, points, triangles)
    return run_cases([*cases, *distant_cases(narrow_view)], progress)


def _cases(name: str, camera: Pinhole, points: int, triangles: int) -> list[Case]:
    def projections() -> list[StressRow]:
        exact = definition(camera)
        sets = central_points(camera, 0.5 * np.pi, points) | {"out of range": out_of_range(points)}
        return [
            *image_rows(name, camera, exact, sets),
            *ray_rows(name, camera, exact, pixels(camera, None, points)),
        ]

    return [(name, projections), (f"{name}, bounds", lambda: bound_rows(name, camera, triangles))]
