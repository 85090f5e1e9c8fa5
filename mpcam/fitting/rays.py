"""Errors of rays of camera triangles as functions of their nodes, in JAX: one sample at a time, `vmap` does the rest.

A node is six numbers: a position, and a normal or ray of any length. All are in radii of the reflector, from its
center. A point X of the true surface belongs to the place w where X = p(w) + c L(w): p from the positions, L from the
ties, which are the nodes' unit normals, or with rays of their own fixed ones.
"""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.lax import stop_gradient

from mpcam.decomposition.crossing import FAR, NEAR, crossing
from mpcam.fitting.basis import basis, slopes
from mpcam.math.optics import reflect, refract

INSIDE = 1e-9
LEAST = 0.05
"""Smallest part along the true ray that rays count with: see `crossing`."""
BEYOND = 0.5
"""Weights so far below zero that places are held: they say nothing about the border any more."""
NEWTON = 4


class Kind(NamedTuple):
    """What is the same for all samples: nodes of a face (3 or 6), and how rays come about: "direct", "reflection" or
    "refraction".
    """

    nodes: int
    bends: str


class Sample(NamedTuple):
    """True rays: points (3,), unit directions (3,), two unit axes across them (2, 3), and weights (), 0 for padding."""

    point: Any
    true: Any
    across: Any
    weight: Any


class Eye(NamedTuple):
    """Where light comes from (3,), the refractive index (1 for mirrors), and the scales of the two planes (2,)."""

    place: Any
    index: Any
    scales: Any


def unit(vectors: Any) -> Any:
    """Vectors (..., 3) of length 1; zero stays zero, with a derivative of zero."""
    square = (vectors * vectors).sum(axis=-1, keepdims=True)
    good = square > 0
    return jnp.where(good, vectors / jnp.sqrt(jnp.where(good, square, 1.0)), 0.0)


def ties_of(nodes: Any, ties: Any, kind: Kind) -> Any:
    """(..., 3) directions that tie points of the surface to the nodes (..., 6)."""
    return ties if kind.bends == "direct" else unit(nodes[..., 3:])


def miss_and_step(nodes: Any, ties: Any, place: Any, point: Any, kind: Kind) -> tuple[Any, Any]:
    """How far p(w) + c L(w) is from a point (3,), and Newton's step (3,) for its place: weights 2 and 3, and c.

    nodes (m, 6), ties (m, 3). The step's matrix is held constant.
    """
    mixed, turned = basis(place[0], place[1], kind.nodes), slopes(place[0], place[1], kind.nodes)
    along = mixed @ ties
    gap = mixed @ nodes[:, :3] + place[2] * along - point
    sides = turned.T @ (nodes[:, :3] + place[2] * ties)
    fixed = stop_gradient(jnp.stack([sides[0], sides[1], along]))
    across = jnp.cross(fixed[1], fixed[2]), jnp.cross(fixed[2], fixed[0]), jnp.cross(fixed[0], fixed[1])
    volume = fixed[0] @ across[0]
    inverse = jnp.where(volume == 0, 0.0, 1.0 / jnp.where(volume == 0, 1.0, volume))
    return gap, -jnp.stack([gap @ across[0], gap @ across[1], gap @ across[2]]) * inverse


def newton(nodes: Any, ties: Any, place: Any, point: Any, kind: Kind, steps: int = NEWTON) -> Any:
    """The place of a point in one face, also outside of it."""

    def step(_: int, place: Any) -> Any:
        place = place + miss_and_step(nodes, ties, place, point, kind)[1]
        return jnp.concatenate([jnp.clip(place[:2], -3.0, 4.0), jnp.clip(place[2:], -4.0, 4.0)])

    return jax.lax.fori_loop(0, steps, step, place)


def residual(nodes: Any, ties: Any, place: Any, sample: Sample, eye: Eye, kind: Kind) -> Any:
    """(4,) where the ray of nodes (m, 6) misses the true one in the near plane and in the far one, over their scales.

    The place's derivative is that of the implicit function, also beyond a border, where weights are cut to the nearest.
    """
    held = stop_gradient(place)
    _, step = miss_and_step(nodes, ties_of(nodes, ties, kind), held, sample.point, kind)
    near = jnp.minimum(jnp.minimum(held[0], held[1]), 1.0 - held[0] - held[1]) >= -BEYOND
    second, third = held[:2] + jnp.where(near, (step - stop_gradient(step))[:2], 0.0)
    weights = jnp.maximum(jnp.stack([1.0 - second - third, second, third]), 0.0)
    weights = weights / weights.sum()
    mixed = basis(weights[1], weights[2], kind.nodes)
    origin, along = mixed @ nodes[:, :3], mixed @ nodes[:, 3:]
    if kind.bends == "reflection":
        along = reflect(origin - eye.place, along)
    elif kind.bends == "refraction":
        along = refract(origin - eye.place, along, eye.index)[0]
    misses = [
        sample.across @ crossing(origin, along, sample.point, sample.true, distance, LEAST).miss / eye.scales[i]
        for i, distance in enumerate((NEAR, FAR))
    ]
    return jnp.concatenate(misses) * jnp.sqrt(sample.weight)


def walk(nodes: Any, ties: Any, faces: Any, neighbors: Any, face: Any, place: Any, points: Any, kind: Kind, hops: int):
    """Faces (N,) and places (N, 3) of points (N, 3), from those before: across the edge of the most negative weight."""
    near = ties_of(nodes, ties, kind)
    solve = jax.vmap(lambda n, t, w, x: newton(n, t, w, x, kind))

    def hop(_: int, now: tuple[Any, Any]) -> tuple[Any, Any]:
        face, place = now
        place = solve(nodes[faces[face]], near[faces[face]], place, points)
        weights = jnp.stack([1.0 - place[:, 0] - place[:, 1], place[:, 0], place[:, 1]], axis=1)
        beyond = neighbors[face]
        toward = jnp.where((weights < -INSIDE) & (beyond >= 0), weights, jnp.inf)
        edge = toward.argmin(axis=1)[:, None]
        go = jnp.isfinite(jnp.take_along_axis(toward, edge, axis=1)[:, 0])
        after = jnp.take_along_axis(beyond, edge, axis=1)[:, 0]
        start = jnp.array([1 / 3, 1 / 3, 0.0], place.dtype)
        return jnp.where(go, after, face), jnp.where(go[:, None], start, place)

    face, place = jax.lax.fori_loop(0, hops, hop, (face, place))
    place = solve(nodes[faces[face]], near[faces[face]], place, points)
    return face, jnp.where(jnp.isfinite(place), place, 1 / 3)
