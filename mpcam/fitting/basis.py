"""What nodes of a face weigh at a place in it, in JAX: `cameras.triangle_nodes`, stacked."""

from typing import Any

import jax.numpy as jnp

from mpcam.cameras import triangle_nodes


def basis(second: Any, third: Any, nodes: int) -> Any:
    """(..., nodes) weights at the weights (...) of corners 2 and 3."""
    return jnp.stack(triangle_nodes.weights(second, third, nodes), axis=-1)


def slopes(second: Any, third: Any, nodes: int) -> Any:
    """(..., nodes, 2) derivatives of `basis` by the weights of corners 2 and 3."""
    return jnp.stack([jnp.stack(by, axis=-1) for by in triangle_nodes.slopes(second, third, nodes)], axis=-1)
