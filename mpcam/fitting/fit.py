"""Fit camera triangles to a reflector: positions, normals or rays, and their lengths, by the true errors of rays."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.checks import whole_number
from mpcam.decomposition.ray_error import RayError, check_eye, error_beside, in_world
from mpcam.decomposition.reflector import Reflector, reflector_of
from mpcam.decomposition.views import SeenPoints, eye_point
from mpcam.errors import InputError
from mpcam.fitting.frames import RIMS, fixed_parts, frames_of
from mpcam.fitting.levenberg import Outcome, Step, solved
from mpcam.fitting.result import Fit, as_start
from mpcam.fitting.samples import Split, held_by, split_samples
from mpcam.fitting.state import State, padded, state_of
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.surfaces import Surface

_PER_TRIANGLE = {1: 32, 2: 96}
"""True rays to fit for each triangle, by degree."""
_AT_LEAST, _AT_MOST = 6_144, 98_304
_POOL, _LARGEST_POOL = 5, 160_000
"""Rays looked at for each one that is fitted: small triangles keep all of theirs."""
_TEST = 8_000
_FIRST_STAGE = 6
SOLVERS = ("blocks", "optimistix")
EXACT = 1e-9
"""Errors below this many radii are not worth a fit."""


def fit(
    cams: CameraTriangles | Fit,
    *,
    reflector: Mesh | Surface,
    eye: Any,
    fixed: Any = None,
    rim: str = "free",
    solver: str = "blocks",
    iterations: int = 30,
    samples: int | None = None,
    seed: int = 0,
    progress: Callable[[Step], Any] | None = None,
) -> Fit:
    """The camera triangles whose rays are nearest to those that the true surface reflects or refracts.

    cams: where to start, e.g. from `mpcam.decompose`; with normals, or rays of their own; or a Fit to go on with.
    reflector, eye: what they were decomposed for. fixed: what must not move: None, or a mask (V,) of vertices, or a
    dictionary with True or masks for "positions" ("along" the surface, "off" it) and "normals" or "rays" ("turn",
    "length"). rim: border vertices move as others do ("free"), along the border ("along") or not ("fixed").
    solver: "blocks", or "optimistix", which is slower and ends a little higher, to check the first. iterations: at
    most. samples: true rays to fit, default 32 for each triangle (96 for degree 2), at least 6,144. seed: of where they
    lie. progress: called with each iteration's Step. Ctrl-C ends the fit with what is best so far.

    Least squares of the errors in two planes, half a radius and two radii away, by Levenberg and Marquardt's method,
    normals and lengths first, then all. Float64, whatever JAX is set to. Returns a Fit whose error is that on pixels
    that were not fitted, never worse than the start's. Raises InputError for camera triangles with ray_scale "plane",
    which have seams, for another eye than theirs, and for other values.
    """
    start, history = as_start(cams)
    if not isinstance(start, CameraTriangles):
        raise InputError(f"cams is a {type(start).__name__}: give CameraTriangles, e.g. from mpcam.decompose")
    if start.linear:
        raise InputError("fit: ray_scale='plane' has a ray of its own for each triangle: fit mode='continuous' instead")
    if rim not in RIMS:
        raise InputError(f"rim={rim!r}: allowed are {', '.join(RIMS)}")
    if solver not in SOLVERS:
        raise InputError(f"solver={solver!r}: allowed are {', '.join(SOLVERS)}")
    iterations = whole_number("iterations", iterations, 0, 100_000)
    seed = whole_number("seed", seed, 0, 2**31)
    parts = fixed_parts(fixed, len(start.vertices))
    whole, world = reflector_of(reflector), in_world(start)
    check_eye(world, eye_point(eye), whole.radius)
    many = _PER_TRIANGLE[world.degree] * world.count
    wanted = min(max(padded(many), _AT_LEAST), _AT_MOST)
    wanted = wanted if samples is None else whole_number("samples", samples, 16, 10_000_000)
    pool = max(min(_POOL * wanted, _LARGEST_POOL), wanted)
    split = split_samples(whole, eye, pool, max(_TEST, pool // 8), seed)
    fitted, places = held_by(world, whole, split.fitted)
    split = Split(fitted, held_by(world, whole, split.held_out)[0])
    state = state_of(world, whole, fitted, wanted, places)
    stages = _stages(state, parts, rim, iterations, first=not history)
    unknowns = int(sum((np.abs(frames).sum(axis=1) > 0).sum() for _, frames, _ in stages[-1:]))
    scales = np.asarray(state.eye.scales)
    steps: tuple[Step, ...] = ()
    best, status = world, "converged"
    if state.real[2] == 0:
        status = "rank_deficient"
    elif scales.max() > EXACT:
        outcome = _solved(solver, state, stages, progress, iterations)
        steps, status = outcome.steps, outcome.status
        if any(step.taken for step in steps):
            found = _camera(world, state, outcome.nodes, whole)
            best, kept = _better(world, found, whole, split.held_out)
            status = status if kept or status == "interrupted" else "stalled"
        if 4 * state.real[2] < unknowns:
            status = "rank_deficient"
    return _result(start, world, best, whole, split, status, (*history, *steps))


def _solved(solver: str, state: State, stages: Any, progress: Any, iterations: int) -> Outcome:
    if solver == "blocks":
        return solved(state, stages, progress, iterations)
    from mpcam.fitting.dense import solved_by_optimistix

    return solved_by_optimistix(state, stages, iterations)


def _stages(
    state: State, parts: dict[str, np.ndarray], rim: str, iterations: int, first: bool
) -> list[tuple[str, np.ndarray, int]]:
    """Normals and their lengths first, then all: straight to all sticks."""
    everything = frames_of(state, parts, rim)
    held = np.ones(state.real[0], bool)
    turning = frames_of(state, parts | {"along": held, "off": held}, rim)
    stages = [("rays", turning, _FIRST_STAGE)] if first else []
    if np.array_equal(everything, turning):
        return [("rays", turning, iterations)]
    return [*stages, ("all", everything, iterations)]


def _camera(world: CameraTriangles, state: State, nodes: np.ndarray, reflector: Reflector) -> CameraTriangles:
    """Camera triangles in the world with these nodes."""
    nodes = np.asarray(nodes)[: state.real[0]]
    used = np.unique(world.faces)
    values = np.array(world.normals if world.directions is None else world.directions)
    places = np.array(world.vertices)
    places[used] = nodes[used, :3] * (reflector.radius or 1.0) + reflector.center
    values[used] = nodes[used, 3:]
    if world.directions is None:
        return dataclasses.replace(world, vertices=places, normals=values)
    return dataclasses.replace(world, vertices=places, directions=values, ray_scale="near_far")


def _better(
    world: CameraTriangles, found: CameraTriangles, whole: Reflector, held_out: SeenPoints
) -> tuple[CameraTriangles, bool]:
    """The fit where it is better on what was not fitted and misses no more rays, else the start."""
    values = found.normals if found.directions is None else found.directions
    if not (np.isfinite(found.vertices).all() and np.isfinite(values).all() and (values != 0).any(axis=1).all()):
        return world, False
    try:
        before, after = (error_beside(one, whole, held_out, 2.0 * whole.radius) for one in (world, found))
    except InputError:
        return world, False
    good = after.missed <= before.missed and after.rms <= before.rms
    return (found, True) if good else (world, False)


def _result(
    start: CameraTriangles,
    world: CameraTriangles,
    best: CameraTriangles,
    whole: Reflector,
    split: Any,
    status: str,
    history: tuple[Step, ...],
) -> Fit:
    radius = whole.radius or 1.0

    def error(cams: CameraTriangles, points: SeenPoints, distance: float) -> RayError:
        return error_beside(cams, whole, points, distance * radius)

    pose = np.asarray(start.camera_from_world)
    camera = start
    if best is not world:
        turn, move = pose[:3, :3], pose[:3, 3]
        name = "normals" if start.directions is None else "directions"
        camera = dataclasses.replace(
            start,
            vertices=best.vertices @ turn.T + move,
            ray_scale=best.ray_scale,
            **{name: getattr(best, name) @ turn.T},
        )
    return Fit(
        camera=camera,
        error=error(best, split.held_out, 2.0),
        status="stalled" if status == "broken" else status,
        history=history,
        before=error(world, split.held_out, 2.0),
        fitted=error(best, split.fitted, 2.0),
        near=error(best, split.held_out, 0.5),
        far=error(best, split.held_out, 20.0),
    )
