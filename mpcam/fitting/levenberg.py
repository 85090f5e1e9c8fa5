"""Levenberg and Marquardt's method over the blocks: stages, damping, and when to stop."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mpcam.fitting import blocks
from mpcam.fitting.state import State

STILL = 1e-3
"""Relative gain of the cost below which a step is still."""
_PATIENCE = {"rays": 1, "all": 3}
"""Still steps in a row after which a stage is over."""
PULL = 1e-6
"""Of the median diagonal at the start: draws nodes back to where they were."""
_TRIES = 6
_FIRST, _LEAST, _MOST = 1e-3, 1e-8, 1e8


class Step(NamedTuple):
    """One iteration: which stage, error of rays (root mean square of both planes, over that at the start), cost with
    barrier and pull, damping, whether it was taken.
    """

    stage: str
    number: int
    error: float
    cost: float
    damping: float
    taken: bool


class Outcome(NamedTuple):
    nodes: np.ndarray
    status: str
    steps: tuple[Step, ...]


def solved(
    state: State, stages: list[tuple[str, np.ndarray, int]], progress: Callable[[Step], Any] | None, budget: int
) -> Outcome:
    """The nodes after stages: (name, frames (V, 6, 6), most iterations) each. A KeyboardInterrupt ends the fit with
    what is best so far, "interrupted".
    """
    import jax

    steps: list[Step] = []
    nodes, best, status, told = state.nodes, state.nodes, "converged", 0
    with jax.enable_x64(True):
        try:
            for name, frames, most in stages:
                if not frames.any():
                    continue
                for reached in _stage(state, nodes, name, frames, min(most, budget - len(steps)), steps):
                    best, status = reached
                    if progress is not None and len(steps) > told:
                        told = len(steps)
                        progress(steps[-1])
                nodes = best
                if status == "broken":
                    break
        except KeyboardInterrupt:
            status = "interrupted"
    return Outcome(np.asarray(best), status, tuple(steps))


def _stage(state: State, start: Any, name: str, frames: np.ndarray, most: int, steps: list[Step]) -> Any:
    """Yields nodes and a status after each iteration."""
    mesh, samples, eye, kind = state.mesh, state.samples, state.eye, state.kind
    nodes, face, place, error = start, state.face, state.place, np.float64(1.0)
    stage = blocks.Stage(frames, nodes, np.float64(0.0))
    damping, quiet, status = _FIRST, 0, "budget"
    for number in range(most + 1):
        if number == 0:
            face, place, cost, error = blocks.placed(nodes, face, place, mesh, samples, eye, stage, kind)
            cost = float(cost)
        normal = blocks.assembled(nodes, face, place, mesh, samples, eye, stage, kind)
        if not bool(normal.finite) or not np.isfinite(cost):
            yield nodes, "broken"
            return
        if number == 0:
            stage = stage._replace(pull=np.float64(PULL * _typical(normal, mesh, frames)))
        if number == most:
            break
        if float(normal.cost) < 1e-16:
            status = "converged"
            break
        taken, after = False, np.inf
        for _ in range(_TRIES):
            trial = blocks.stepped(nodes, normal, np.float64(damping), mesh, stage, kind)
            there = blocks.placed(trial, face, place, mesh, samples, eye, stage, kind)
            after = float(there[2])
            if np.isfinite(after) and after < cost:
                taken = True
                break
            damping = min(damping * 8.0, _MOST)
        if taken:
            gain = 1.0 - after / cost
            nodes, face, place, cost, error = trial, there[0], there[1], after, there[3]
            quiet = quiet + 1 if gain < STILL else 0
        steps.append(Step(name, number + 1, float(np.sqrt(error)), cost, damping, taken))
        if not taken:
            status = "stalled" if number == 0 else "converged"
            break
        damping = max(damping / 5.0, _LEAST)
        if quiet >= _PATIENCE[name]:
            status = "converged"
            yield nodes, status
            break
        yield nodes, "budget"
    yield nodes, status


def _typical(normal: Any, mesh: Any, frames: np.ndarray) -> float:
    """The median diagonal of the nodes that move."""
    faces, count = np.asarray(mesh.faces), len(frames)
    wide = faces.shape[1]
    own = np.einsum("faa->fa", np.asarray(normal.blocks)).reshape(-1, wide, 6)
    diagonal = np.zeros((count, 6))
    np.add.at(diagonal, faces, own)
    some = diagonal[diagonal > 0]
    return float(np.median(some)) if some.size else 1.0
