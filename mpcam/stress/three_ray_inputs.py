"""Cameras with three rays, and points, at their limits: random inputs by kind."""

from collections.abc import Callable
from typing import Any

import numpy as np

Inputs = tuple[np.ndarray, np.ndarray, np.ndarray]


def _seen(rng: np.random.Generator, v: np.ndarray, d: np.ndarray, decades: tuple[float, float] = (-1, 1)) -> Inputs:
    """With points that appear inside; half of the inputs turned and moved, so that their structure is rounded."""
    count = len(v)
    w, c = rng.dirichlet((1, 1, 1), count), 10 ** rng.uniform(*decades, count)
    return _turned(rng, v, d, np.einsum("ni,nij->nj", w, v + c[:, None, None] * d))


def _turned(rng: np.random.Generator, v: np.ndarray, d: np.ndarray, q: np.ndarray) -> Inputs:
    half = len(v) // 2
    turn = np.linalg.qr(rng.normal(size=(half, 3, 3)))[0]
    move = rng.normal(size=(half, 3))
    v[:half] = v[:half] @ turn + move[:, None]
    d[:half] = d[:half] @ turn
    q[:half] = np.einsum("nj,njk->nk", q[:half], turn) + move
    return v, d, q


def _lattice(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Random multiples of 1/16, so that their sums and products are exact in float32."""
    return np.round(16 * rng.normal(size=shape)) / 16


def _flat(rng: np.random.Generator, count: int) -> np.ndarray:
    """Corners in the plane z = 0, of triangles that are not too thin."""
    v = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]) + 0.3 * _lattice(rng, count, 3, 3)
    v = np.round(16 * v) / 16
    v[:, :, 2] = 0
    return v


def _with_z(d: np.ndarray, z: Any) -> np.ndarray:
    d[:, :, 2] = z
    return d


def prescribed(rng: np.random.Generator, w: np.ndarray, c: np.ndarray) -> Inputs:
    """Directions for which a point has given images, w (count, 3, 3) and c (count, 3), since D is affine."""
    v, q = rng.normal(size=(len(w), 3, 3)), 2 * rng.normal(size=(len(w), 3))
    d = np.linalg.solve(w, (q[:, None] - w @ v) / c[:, :, None])
    return v, d, q


def _near_fold(rng: np.random.Generator, count: int) -> Inputs:
    w, c = rng.dirichlet((1, 1, 1), (count, 3)), 10 ** rng.uniform(-1, 1, (count, 3))
    apart = 10 ** rng.uniform(-9, -1, count)
    w[:, 1] = w[:, 0] + apart[:, None] * (w[:, 1] - w[:, 0])
    c[:, 1] = c[:, 0] + apart * (c[:, 1] - c[:, 0])
    return prescribed(rng, w, c)


def _pinhole(rng: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    v, center = _flat(rng, count), np.round(16 * (np.array([0.5, 0.5, -2]) + 0.3 * rng.normal(size=(count, 3)))) / 16
    return v, v - center[:, None], center


def _collapsed(rng: np.random.Generator, count: int) -> Inputs:
    """The point is the center, or on a slit: points of the swept triangle, which has no area."""
    v, d, q = _pinhole(rng, count)
    half = count // 2
    start, along = _lattice(rng, half, 1, 3), _lattice(rng, half, 1, 3)
    start[..., 2], along[..., 2] = 1, 0
    d[:half] = start + along * np.array([[0.0], [2], [5]]) - v[:half]
    q[:half] = (start + along)[:, 0]
    d[half:] = -d[half:]
    return v, d, q


def _families(rng: np.random.Generator, count: int) -> Inputs:
    """All rays in the camera's plane, points off it and on it."""
    v, d = _flat(rng, count), _with_z(_lattice(rng, count, 3, 3), 0)
    q = _lattice(rng, count, 3)
    q[::2, 2] = 0
    return v, d, q


def _scaled(rng: np.random.Generator, count: int, scale: float) -> Inputs:
    v, d, q = KINDS["everywhere"](rng, count)
    return v * scale, d * scale, q * scale


def _unit(d: np.ndarray) -> np.ndarray:
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def _tiny(rng: np.random.Generator, count: int) -> np.ndarray:
    return 10 ** rng.uniform(-8, -1, (count, 1, 1)) * rng.normal(size=(count, 3, 3))


def _general(rng: np.random.Generator, count: int) -> np.ndarray:
    return rng.normal(size=(count, 3, 3))


def _coplanar(rng: np.random.Generator, count: int) -> Inputs:
    d = _lattice(rng, count, 3, 3)
    d[:, 2] = 0.5 * d[:, 0] + rng.choice([-0.5, 0.5, 1.5], (count, 1)) * d[:, 1]
    return _seen(rng, _lattice(rng, count, 3, 3), d)


def _on_plane(rng: np.random.Generator, count: int) -> Inputs:
    v, d = _flat(rng, count), _lattice(rng, count, 3, 3)
    d[:, :, 2] = np.abs(d[:, :, 2]) + 0.25
    return _turned(rng, v, d, np.einsum("ni,nij->nj", rng.dirichlet((1, 1, 1), count), v))


def _needles(rng: np.random.Generator, count: int) -> Inputs:
    v = _flat(rng, count)
    v[:, 1] = v[:, 0] + 10 ** rng.uniform(-5, -1, (count, 1)) * (v[:, 1] - v[:, 0])
    return _seen(rng, v, np.array([0, 0, 1]) + 0.3 * _general(rng, count))


KINDS: dict[str, Callable[[np.random.Generator, int], Inputs]] = {
    "everywhere": lambda r, n: _seen(r, _general(r, n), _general(r, n)),
    "three images": lambda r, n: prescribed(r, r.dirichlet((1, 1, 1), (n, 3)), 10 ** r.uniform(-1, 1, (n, 3))),
    "near a fold": _near_fold,
    "parallel rays": lambda r, n: _seen(r, _flat(r, n), (_lattice(r, n, 3, 1) ** 2 + 0.5) * _lattice(r, n, 1, 3)),
    "nearly parallel rays": lambda r, n: _seen(r, _flat(r, n), r.normal(size=(n, 1, 3)) + _tiny(r, n)),
    "general linear": lambda r, n: _seen(r, _flat(r, n), _with_z(_lattice(r, n, 3, 3), 1)),
    "pinhole": lambda r, n: _seen(r, *_pinhole(r, n)[:2]),
    "pinhole, from behind": lambda r, n: _seen(r, (p := _pinhole(r, n))[0], -p[1]),
    "pinhole, unit directions": lambda r, n: _seen(r, (p := _pinhole(r, n))[0], _unit(p[1])),
    "nearly concurrent rays": lambda r, n: _seen(r, (p := _pinhole(r, n))[0], _tiny(r, n) - p[1]),
    "collapsed on the point": _collapsed,
    "coplanar directions": _coplanar,
    "one ray in the plane": lambda r, n: _seen(r, _flat(r, n), _with_z(_lattice(r, n, 3, 3), [0, 1, 2])),
    "nearly in the plane": lambda r, n: _seen(r, _flat(r, n), _with_z(_general(r, n), _tiny(r, n)[:, :, 2])),
    "mixed signs": lambda r, n: _seen(r, _flat(r, n), _with_z(_lattice(r, n, 3, 3), [-1, 1, 0.5])),
    "all rays in the plane": _families,
    "on the plane": _on_plane,
    "near the plane": lambda r, n: _seen(r, _general(r, n), _general(r, n), (-8, -3)),
    "far points": lambda r, n: _seen(r, _general(r, n), np.array([0, 0, 2]) + _general(r, n), (2, 5)),
    "far from the origin": lambda r, n: _seen(r, _general(r, n) + 10 ** r.uniform(1, 4, (n, 1, 1)), _general(r, n)),
    "needles": _needles,
    "rays of unequal length": lambda r, n: _seen(r, _general(r, n), _general(r, n) * 10 ** r.uniform(-2, 2, (n, 3, 1))),
    "scale 1e-8": lambda r, n: _scaled(r, n, 1e-8),
    "scale 1e8": lambda r, n: _scaled(r, n, 1e8),
}
"""Camera triangles and points by kind: v, d (count, 3, 3) and q (count, 3)."""
