"""Bracketed root finding with a fixed number of steps and no branches, alike for NumPy, JAX and Dr.Jit arrays."""

import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from mpcam.math.arrays import Array, absolute, detach, epsilon, library, minimum, where

STEPS = 40
"""Steps that bisection alone needs to about 12 digits; Newton's need fewer."""

_NODES = 4096


def invert_increasing(
    function: Callable[[Array], Array], slope: Callable[[Array], Array], value: Array, low: float, high: float
) -> Array:
    """x in [low, high] with function(x) = value, for an increasing function.

    By `bracketed_newton`. Values beyond the ends give the nearer end. The derivative comes from the implicit-function
    theorem (one Newton step on detached arguments), never from the iterations.
    """
    target = detach(value)
    zero = 0.0 * (function(target * 0.0 + low) - target)  # of the type that the result has
    below, above = zero + low, zero + high
    x = bracketed_newton(lambda x: function(x) - target, slope, below, above, 0.5 * (below + above))
    first, last = target <= function(zero + low), target >= function(zero + high)
    x = where(first, zero + low, where(last, zero + high, x))
    x, gradient = detach(x), detach(slope(x))
    inside = ~(first | last)
    step = (function(x) - value) / where(gradient > 0, gradient, 1.0)
    # Only its derivative: where the slope nearly vanishes, the step itself is rounding noise.
    return where(inside & (gradient > 0), x - (step - detach(step)), x)


def bracketed_newton(
    function: Callable[[Array], Array],
    slope: Callable[[Array], Array],
    below: Array,
    above: Array,
    start: Array,
    steps: int = STEPS,
    free: Array | None = None,
) -> Array:
    """Root in [below, above] of an increasing function that changes its sign there, from `start`; no derivative.

    Newton's step where it stays inside the bracket and is at most half the last step but one (of the last, it could
    never be taken to a root at an end of the bracket, since bisection halves its steps too), bisection otherwise. The
    three arrays are of the type and shape that the result has. free: length of steps that need not shrink, by default
    the last places of the bracket's width, since at the root rounding keeps Newton's steps from shrinking; the width
    itself where the start is so good that Newton converges.
    """
    free = 4 * epsilon(below) * (above - below) if free is None else free

    def step(state: tuple[Array, ...]) -> tuple[Array, ...]:
        below, above, x, last, last_but_one = state
        residual = function(x)
        below = where(residual <= 0, x, below)
        above = where(residual > 0, x, above)
        gradient = slope(x)
        newton = x - residual / where(gradient > 0, gradient, 1.0)
        usable = (gradient > 0) & (newton >= below) & (newton <= above)
        usable = usable & (absolute(newton - x) <= 0.5 * last_but_one + free)
        after = where(residual == 0, x, where(usable, newton, 0.5 * (below + above)))
        return below, above, after, absolute(after - x), last

    return repeat(step, (below, above, start, above - below, above - below), steps)[2]


def repeat(step: Callable[[Any], Any], state: Any, steps: int) -> Any:
    """The state, a tuple of arrays, after all steps; JAX compiles one step only."""
    if library(*state) == "jax":
        import jax

        return jax.lax.fori_loop(0, steps, lambda _, state: step(state), state)
    for _ in range(steps):
        state = step(state)
    return state


def counted(step: Callable[[Any, Any], Any], state: Any, steps: int, unrolled: int = 8) -> Any:
    """The state, a tuple of arrays, after step(number, state) for each number below `steps`.

    JAX compiles one step only; Dr.Jit records a loop where there are more than `unrolled`.
    """
    kind = library(*state)
    if kind == "jax" and steps > 1:
        import jax

        return jax.lax.fori_loop(0, steps, lambda number, state: step(number.astype("int32"), state), state)
    if kind == "drjit" and steps > unrolled:
        dr = sys.modules["drjit"]
        first = dr.int32_array_t(dr.leaf_t(type(state[0])))(0)
        return dr.while_loop(
            (first, *state), lambda number, *_: number < steps, lambda number, *now: (number + 1, *step(number, now))
        )[1:]
    for number in range(steps):
        state = step(number, state)
    return state


def central_slope(function: Callable[[Array], Array], low: float, high: float) -> Callable[[Array], Array]:
    """Derivative of a function by central differences, one-sided at the ends of [low, high]."""

    def slope(x: Array) -> Array:
        from mpcam.math.arrays import epsilon, maximum, minimum

        step = epsilon(x) ** (1 / 3) * (high - low)
        right, left = minimum(x + step, high), maximum(x - step, low)
        return (function(right) - function(left)) / (right - left)

    return slope


def polynomial(coefficients: Sequence[Array], x: Array) -> Array:
    """coefficients[0] + coefficients[1] x + ..., by Horner's rule."""
    value = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        value = value * x + coefficient
    return value


def sign_changes(coefficients: Sequence[float], low: float, high: float) -> list[float]:
    """Where a polynomial with Python numbers as coefficients changes its sign in (low, high), in rising order.

    Between two sign changes of its derivative a polynomial is monotone, so bisection misses none. Each result is the
    last number before the change.
    """
    if len(coefficients) < 2:
        return []
    turns = sign_changes([i * c for i, c in enumerate(coefficients)][1:], low, high)
    found = []
    for start, end in zip([low, *turns], [*turns, high], strict=True):
        rising = polynomial(coefficients, start) <= 0
        if (polynomial(coefficients, end) > 0) != rising:
            continue
        while start < (middle := 0.5 * (start + end)) < end:
            if (polynomial(coefficients, middle) > 0) == rising:
                end = middle
            else:
                start = middle
        found.append(start)
    return found


def first_true(condition: Callable[[Array], Array], high: Array) -> Array:
    """Where a condition on a JAX array first holds in (0, high], on ever finer grids; high if it never does.

    At most 1e-14 high smaller. Stretches shorter than 1 / 4096 of high may pass unseen.
    """
    import jax.numpy as jnp

    grid = np.arange(1, _NODES + 1) / _NODES
    start, width = 0.0, high
    for _ in range(4):
        holds = condition(start + width * grid)
        start = start + width * jnp.where(holds.any(), jnp.argmax(holds), _NODES) / _NODES
        width = minimum(width / _NODES, high - start)
    return start
