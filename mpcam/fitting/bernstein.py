"""Bernstein bases over a triangle: 3 nodes (its corners, linear), or 6 (quadratic; node 3 + i lies opposite i)."""

from typing import Any

import jax.numpy as jnp


def basis(second: Any, third: Any, nodes: int) -> Any:
    """(..., nodes) weights at the weights (...) of corners 2 and 3."""
    a, b, c = 1.0 - second - third, second, third
    if nodes == 3:
        return jnp.stack([a, b, c], axis=-1)
    return jnp.stack([a * a, b * b, c * c, 2 * b * c, 2 * c * a, 2 * a * b], axis=-1)


def slopes(second: Any, third: Any, nodes: int) -> Any:
    """(..., nodes, 2) derivatives of `basis` by the weights of corners 2 and 3."""
    a, b, c, zero = 1.0 - second - third, second, third, 0.0 * second
    if nodes == 3:
        one = zero + 1.0
        by_second, by_third = [-one, one, zero], [-one, zero, one]
    else:
        by_second = [-2 * a, 2 * b, zero, 2 * c, -2 * c, 2 * (a - b)]
        by_third = [-2 * a, zero, 2 * c, 2 * b, 2 * (a - c), -2 * b]
    return jnp.stack([jnp.stack(by_second, axis=-1), jnp.stack(by_third, axis=-1)], axis=-1)
