"""Radial cameras at their limits: all profiles, from narrow views to the whole sphere."""

from typing import Any

import numpy as np

from mpcam.cameras.radial import Radial
from mpcam.math import tan
from mpcam.stress.distant import SIZE as VIEW
from mpcam.stress.distant import distant_cases, pose
from mpcam.stress.exact import Real, parameters
from mpcam.stress.lenses import Definition, lens_cases
from mpcam.stress.regions import BoundOf, known_bounds
from mpcam.stress.report import LIMIT as LIMIT
from mpcam.stress.report import Progress, StressRow, check_counts, run_cases

SIZE = 512


def cameras() -> dict[str, Radial]:
    """The four profiles and two of a user's own, and the narrowest and widest views that they allow."""
    return {
        "paraboloid": Radial.paraboloid(SIZE, SIZE),
        "cosine_sphere": Radial.cosine_sphere(SIZE, SIZE),
        "equisolid": Radial.equisolid(SIZE, SIZE),
        "equidistant": Radial.equidistant(SIZE, SIZE),
        "paraboloid 270": Radial.paraboloid(SIZE, SIZE, fov=1.5 * np.pi),
        "equisolid 270": Radial.equisolid(SIZE, SIZE, fov=1.5 * np.pi),
        "equidistant 270": Radial.equidistant(SIZE, SIZE, fov=1.5 * np.pi),
        "paraboloid 359": Radial.paraboloid(SIZE, SIZE, fov=np.radians(359.0)),
        "equisolid 360": Radial.equisolid(SIZE, SIZE, fov=2 * np.pi),
        "equidistant 360": Radial.equidistant(SIZE, SIZE, fov=2 * np.pi),
        "paraboloid, narrow": Radial.paraboloid(SIZE, SIZE, fov=1e-6),
        "third of a tangent": Radial.from_function(SIZE, SIZE, lambda t: tan(t / 3), name="third of a tangent"),
        "with a cube": Radial.from_function(SIZE, SIZE, lambda t: t + t * t * t, name="with a cube"),
        "equidistant, narrow": Radial.equidistant(SIZE, SIZE, fov=1e-3, radius=1e3, cx=100.0, cy=-20.0),
    }


def definition(camera: Radial) -> Definition:
    """Gascuel et al. 2008, Table 1, and the users' own, scaled to 1 at the rim."""
    import mpmath

    profile = {
        "paraboloid": lambda t: mpmath.tan(t / 2),
        "cosine_sphere": mpmath.sin,
        "equisolid": lambda t: mpmath.sqrt(2) * mpmath.sin(t / 2),
        "equidistant": lambda t: 2 * t / mpmath.pi,
        "third of a tangent": lambda t: mpmath.tan(t / 3),
        "with a cube": lambda t: t + t**3,
    }[camera.profile.name]

    def radius(rho: Real, z: Real, fov: Real) -> Real:
        return profile(mpmath.atan2(rho, z)) / profile(fov / 2)

    return Definition(radius, lambda fov: fov / 2, parameters(camera.fov))


def bounds(camera: Radial) -> dict[str, BoundOf]:
    """The bounds of every camera, and the paper's."""
    return known_bounds(camera) | {"bounding triangles": _pieces, "box of quads": _quads}


def _pieces(camera: Any, a: Any, b: Any, c: Any) -> list[Any]:
    return [(piece.low, piece.high, piece.valid, piece.lines) for piece in camera.local_bound_triangles(a, b, c)]


def _quads(camera: Any, a: Any, b: Any, c: Any) -> list[Any]:
    return [(*camera.local_bound_quads(a, b, c), ())]


def narrow_view(distance: float, width: float) -> Radial:
    """For distant eyes: see `distant`."""
    return Radial.equidistant(VIEW, VIEW, pose(distance), fov=2 * np.arctan(width / distance))


def run(triangles: int = 30_000, points: int = 50, progress: Progress | None = None) -> list[StressRow]:
    """All cases: `points` per kind of point, `triangles` per camera. Raises InputError below 1."""
    check_counts(triangles=triangles, points=points)
    cases = []
    for name, camera in cameras().items():
        cases += lens_cases(name, camera, definition(camera), points, triangles, bounds(camera))
    return run_cases([*cases, *distant_cases(narrow_view)], progress)
