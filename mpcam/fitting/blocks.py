"""Normal equations of a fit, assembled face by face, and solved by conjugate gradients: all in JAX, shapes padded.

Each sample touches the nodes of one face: its Jacobian, by `vmap(jacfwd)`, is small and dense, and so is the sum over a
face's samples. The matrix is never put together: conjugate gradients take its product with a vector face by face, with
the nodes' own blocks as the preconditioner.
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from mpcam.fitting.basis import slopes
from mpcam.fitting.rays import Eye, Kind, Sample, residual, ties_of, unit, walk

BARRIER = 1e-2
"""Weight of the fold barrier, over all faces, where the cost at the start is 1."""
_PRIOR = 1e-9
_ROUNDS, _TOLERANCE = 150, 1e-3
_HOPS = 2
_SHORTER = 8


class Mesh(NamedTuple):
    """The faces of a fit, padded.

    faces (F, m): node numbers. neighbors (F, 3). ties (V, 3). real (F,): which are no padding. least (F, 3): cosine
    between face and tie at each corner below which the barrier rises, 0 for none. side (F,): 1 or -1, which side looks
    along the ties.
    """

    faces: Any
    neighbors: Any
    ties: Any
    real: Any
    least: Any
    side: Any


class Stage(NamedTuple):
    """What a stage of the fit may move: frames (V, 6, 6), columns that are zero do not move; start (V, 6) nodes that
    they are drawn back to, pull how strongly.
    """

    frames: Any
    start: Any
    pull: Any


class Normal(NamedTuple):
    """blocks (F, 6 m, 6 m) and slopes (V, 6) of half the cost, in the nodes' frames."""

    blocks: Any
    slope: Any
    cost: Any
    finite: Any


def cosines(nodes: Any, mesh: Mesh, kind: Kind) -> Any:
    """(F, 3) between the side that a face looks to at each corner and the tie of the node there."""
    return jax.vmap(lambda n, t, s: _cosines(n, ties_of(n, t, kind), kind) * s)(
        nodes[mesh.faces], mesh.ties[mesh.faces], mesh.side
    )


def _cosines(nodes: Any, ties: Any, kind: Kind) -> Any:
    corners = jnp.eye(3)[:, 1:]
    turned = slopes(corners[:, 0], corners[:, 1], kind.nodes)
    sides = jnp.einsum("cmk,mx->ckx", turned, nodes[:, :3])
    return (unit(jnp.cross(sides[:, 0], sides[:, 1])) * ties[:3]).sum(axis=-1)


def _barrier(nodes: Any, ties: Any, least: Any, side: Any, kind: Kind) -> Any:
    """(3,) residuals that grow without limit as a corner of a face turns edge-on to its tie."""
    cosine = _cosines(nodes, ties_of(nodes, ties, kind), kind) * side
    low = (cosine < least) & (cosine > 0)
    return jnp.where(low, least / jnp.where(low, cosine, 1.0) - 1.0, 0.0)


def barriers(nodes: Any, mesh: Mesh, kind: Kind) -> Any:
    """(F, 3) residuals of the fold barrier."""
    values = jax.vmap(lambda n, t, c, s: _barrier(n, t, c, s, kind))(
        nodes[mesh.faces], mesh.ties[mesh.faces], mesh.least, mesh.side
    )
    return values * jnp.sqrt(BARRIER / jnp.maximum(mesh.real.sum(), 1)) * mesh.real[:, None]


def cost_at(nodes: Any, face: Any, place: Any, mesh: Mesh, samples: Sample, eye: Eye, stage: Stage, kind: Kind):
    """Sum of squares, the part of it that is errors of rays, and whether no face has folded."""
    values = jax.vmap(lambda n, t, w, s: residual(n, t, w, s, eye, kind))(
        nodes[mesh.faces[face]], mesh.ties[mesh.faces[face]], place, samples
    )
    rays = (values**2).sum()
    folded = ((mesh.least > 0) & (cosines(nodes, mesh, kind) <= 0) & mesh.real[:, None]).any()
    total = rays + (barriers(nodes, mesh, kind) ** 2).sum() + stage.pull * ((nodes - stage.start) ** 2).sum()
    return jnp.where(folded, jnp.inf, total), rays


@functools.partial(jax.jit, static_argnames="kind")
def placed(nodes, face, place, mesh, samples, eye, stage, kind):
    """Faces, places and cost after the walk to where nodes have gone."""
    face, place = walk(nodes, mesh.ties, mesh.faces, mesh.neighbors, face, place, samples.point, kind, _HOPS)
    return face, place, *cost_at(nodes, face, place, mesh, samples, eye, stage, kind)


@functools.partial(jax.jit, static_argnames="kind")
def assembled(nodes, face, place, mesh, samples, eye, stage, kind) -> Normal:
    """The normal equations at nodes (V, 6)."""
    count, width = len(mesh.faces), 6 * kind.nodes

    def of_rays(n: Any, t: Any, w: Any, sample: Any) -> Any:
        return residual(n, t, w, sample, eye, kind)

    def of_folds(n: Any, t: Any, least: Any, side: Any) -> Any:
        return _barrier(n, t, least, side, kind)

    nodal, tied = nodes[mesh.faces], mesh.ties[mesh.faces]
    given = nodal[face], tied[face], place, samples
    values = jax.vmap(of_rays)(*given)
    slope = jax.vmap(jax.jacfwd(of_rays))(*given).reshape(len(face), -1, width)
    blocks = jax.ops.segment_sum(jnp.einsum("nra,nrb->nab", slope, slope), face, count)
    right = jax.ops.segment_sum(jnp.einsum("nra,nr->na", slope, values), face, count)
    given = nodal, tied, mesh.least, mesh.side
    fold = jax.vmap(of_folds)(*given)
    bent = jax.vmap(jax.jacfwd(of_folds))(*given).reshape(count, 3, width)
    share = BARRIER / jnp.maximum(mesh.real.sum(), 1) * mesh.real
    blocks += jnp.einsum("f,fra,frb->fab", share, bent, bent)
    right += jnp.einsum("f,fra,fr->fa", share, bent, fold)
    frames = stage.frames[mesh.faces]
    turned = jnp.einsum("fixk,fixjy->fikjy", frames, blocks.reshape(count, kind.nodes, 6, kind.nodes, 6))
    turned = jnp.einsum("fikjy,fjyl->fikjl", turned, frames).reshape(count, width, width)
    local = jnp.einsum("fixk,fix->fik", frames, right.reshape(count, kind.nodes, 6))
    drawn = stage.pull * jnp.einsum("vxk,vx->vk", stage.frames, nodes - stage.start)
    slope = drawn.at[mesh.faces].add(local)
    return Normal(turned, slope, (values**2).sum(), jnp.isfinite(turned).all() & jnp.isfinite(slope).all())


@functools.partial(jax.jit, static_argnames="kind")
def stepped(nodes, normal: Normal, damping, mesh, stage, kind):
    """Nodes after one step, shorter where a face would fold."""
    faces, wide = mesh.faces, kind.nodes
    count = len(nodes)
    six = normal.blocks.reshape(len(faces), wide, 6, wide, 6)
    own = jnp.zeros((count, 6, 6)).at[faces].add(jnp.einsum("fikil->fikl", six))
    diagonal = jnp.einsum("vkk->vk", own)
    free = (stage.frames**2).sum(axis=1) > 0
    typical = jnp.nanmedian(jnp.where(free & (diagonal > 0), diagonal, jnp.nan))
    typical = jnp.where(jnp.isfinite(typical) & (typical > 0), typical, 1.0)
    extra = jnp.where(free, damping * diagonal + stage.pull + _PRIOR * typical, 1.0)
    inverse = jnp.linalg.inv(jnp.where(free[:, :, None] & free[:, None], own, 0.0) + jax.vmap(jnp.diag)(extra))

    def product(x: Any) -> Any:
        taken = x[faces].reshape(len(faces), 6 * wide)
        mixed = jnp.einsum("fab,fb->fa", normal.blocks, taken).reshape(len(faces), wide, 6)
        return (extra * x).at[faces].add(mixed)

    found, _ = jax.scipy.sparse.linalg.cg(
        product, -normal.slope, M=lambda x: jnp.einsum("vab,vb->va", inverse, x), tol=_TOLERANCE, maxiter=_ROUNDS
    )
    move = jnp.einsum("vxk,vk->vx", stage.frames, found)
    limit = jnp.where(mesh.least > 0, 0.3 * cosines(nodes, mesh, kind), -2.0)

    def shortened(_: int, part: Any) -> Any:
        bad = (cosines(nodes + part[:, None] * move, mesh, kind) < limit).any(axis=1) & mesh.real
        hit = jnp.zeros(count).at[faces].max(jnp.broadcast_to(bad[:, None], faces.shape).astype(part.dtype))
        return jnp.where(hit > 0, 0.5 * part, part)

    part = jax.lax.fori_loop(0, _SHORTER, shortened, jnp.ones(count))
    bad = (cosines(nodes + part[:, None] * move, mesh, kind) < limit).any(axis=1) & mesh.real
    hit = jnp.zeros(count).at[faces].max(jnp.broadcast_to(bad[:, None], faces.shape).astype(part.dtype))
    return nodes + jnp.where(hit > 0, 0.0, part)[:, None] * move
