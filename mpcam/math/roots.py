"""Bracketed root finding with a fixed number of steps and no branches, alike for NumPy, JAX and Dr.Jit arrays."""

from collections.abc import Callable

from mpcam.math.arrays import Array, absolute, detach, where

_STEPS = 40


def invert_increasing(
    function: Callable[[Array], Array], slope: Callable[[Array], Array], value: Array, low: float, high: float
) -> Array:
    """x in [low, high] with function(x) = value, for an increasing function.

    Newton's step where it stays inside the bracket and at least halves the residual, bisection otherwise. Values
    beyond the ends give the nearer end. The derivative comes from the implicit-function theorem (one Newton step on
    detached arguments), never from the iterations.
    """
    target = detach(value)
    zero = target * 0.0
    below, above = zero + low, zero + high
    x = 0.5 * (below + above)
    residual_before = zero + 1e30
    for _ in range(_STEPS):
        residual = function(x) - target
        below = where(residual <= 0, x, below)
        above = where(residual > 0, x, above)
        gradient = slope(x)
        newton = x - residual / where(gradient > 0, gradient, 1.0)
        usable = (gradient > 0) & (newton > below) & (newton < above)
        usable = usable & (absolute(residual) < 0.5 * residual_before)
        residual_before = absolute(residual)
        x = where(residual == 0, x, where(usable, newton, 0.5 * (below + above)))
    first, last = target <= function(zero + low), target >= function(zero + high)
    x = where(first, zero + low, where(last, zero + high, x))
    x, gradient = detach(x), detach(slope(x))
    inside = ~(first | last)
    step = (function(x) - value) / where(gradient > 0, gradient, 1.0)
    return where(inside & (gradient > 0), x - step, x)


def central_slope(function: Callable[[Array], Array], low: float, high: float) -> Callable[[Array], Array]:
    """Derivative of a function by central differences, one-sided at the ends of [low, high]."""

    def slope(x: Array) -> Array:
        from mpcam.math.arrays import epsilon, maximum, minimum

        step = epsilon(x) ** (1 / 3) * (high - low)
        right, left = minimum(x + step, high), maximum(x - step, low)
        return (function(right) - function(left)) / (right - left)

    return slope
