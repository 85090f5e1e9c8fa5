"""The same least squares driven by Optimistix: Levenberg and Marquardt's method with LSMR inside.

No normal equations and no blocks: products of the Jacobian with vectors alone. Slower to end as low, and written by
others: it checks `levenberg` on small cases.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from mpcam.fitting import blocks
from mpcam.fitting.levenberg import PULL, Outcome, Step
from mpcam.fitting.rays import residual, walk
from mpcam.fitting.state import State

_ROUNDS = 60
_HOPS = 2


def solved_by_optimistix(state: State, stages: list[tuple[str, np.ndarray, int]], budget: int) -> Outcome:
    """As `levenberg.solved`, with one Step for each stage, whose number is that of Optimistix's iterations."""
    import equinox as eqx
    import lineax as lx
    import optimistix as optx

    steps: list[Step] = []
    nodes, status = state.nodes, "converged"
    with jax.enable_x64(True):
        solver = optx.LevenbergMarquardt(
            rtol=1e-5, atol=1e-8, linear_solver=lx.LSMR(rtol=1e-4, atol=1e-12, max_steps=_ROUNDS)
        )

        @eqx.filter_jit
        def run(unknowns: Any, given: Any, most: int) -> Any:
            return optx.least_squares(_residuals(state.kind), solver, unknowns, args=given, max_steps=most, throw=False)

        for name, frames, most in stages:
            most = min(most, budget - sum(step.number for step in steps))
            if not frames.any() or most < 1:
                continue
            given = (nodes, frames, state.face, state.place, state.mesh, state.samples, state.eye)
            solution = run(jnp.zeros(frames.shape[:2]), given, most)
            count, good = int(solution.stats["num_steps"]), solution.result == optx.RESULTS.successful
            moved = np.asarray(nodes + np.einsum("vxk,vk->vx", frames, np.asarray(solution.value)))
            values = jax.jit(_residuals(state.kind))(solution.value, given)
            cost = float(sum((part**2).sum() for part in values))
            if not np.isfinite(cost):
                status = "broken"
                break
            nodes, status = moved, "converged" if bool(good) else "budget"
            steps.append(Step(name, count, float(jnp.sqrt((values[0] ** 2).sum())), cost, 0.0, True))
    return Outcome(np.asarray(nodes), status, tuple(steps))


def _residuals(kind: Any) -> Any:
    """The function of unknowns (V, 6), in the nodes' frames, whose squares are the cost."""

    def function(unknowns: Any, given: Any) -> Any:
        start, frames, face, place, mesh, samples, eye = given
        nodes = start + jnp.einsum("vxk,vk->vx", frames, unknowns)
        held = jax.lax.stop_gradient(nodes)
        face, place = walk(held, mesh.ties, mesh.faces, mesh.neighbors, face, place, samples.point, kind, _HOPS)
        rays = jax.vmap(lambda n, t, w, s: residual(n, t, w, s, eye, kind))(
            nodes[mesh.faces[face]], mesh.ties[mesh.faces[face]], place, samples
        )
        return rays, blocks.barriers(nodes, mesh, kind), jnp.sqrt(PULL / len(start)) * unknowns

    return function
