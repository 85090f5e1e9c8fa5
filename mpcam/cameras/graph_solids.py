"""Frusta as convex bodies: their corners, and which of them overlap."""

import itertools

import numpy as np

FAR = 1000.0
"""Where bodies that go on for ever are cut off, in units of the scale."""


def body_corners(planes: np.ndarray, scale: float) -> np.ndarray:
    """Corners (n, 3) of what lies where n . x + o <= 0 for all planes (m, 4), unit normals; none where that is empty.

    Each place where three planes meet that is on the inner side of all others.
    """
    box = [[*(sign * (axis == i) for i in range(3)), -FAR * scale] for axis in range(3) for sign in (1.0, -1.0)]
    every = np.concatenate([planes, box])
    threes = every[np.array(list(itertools.combinations(range(len(every)), 3)))]
    meets = np.abs(np.linalg.det(threes[:, :, :3])) > 1e-9
    places = np.linalg.solve(threes[meets][:, :, :3], -threes[meets][:, :, 3:])[:, :, 0]
    off = places @ every[:, :3].T + every[:, 3]
    return places[(off <= 1e-9 * (scale + np.abs(places).max(axis=1, keepdims=True))).all(axis=1)]


def overlaps(bodies: list[np.ndarray], corners: list[np.ndarray], scale: float) -> tuple[int, int, np.ndarray] | None:
    """Two bodies, given by their planes and their corners, that both hold a point, and the point; None if none do.

    Most are told apart by a plane of either; the others by looking for the point that is deepest in both.
    """
    known = [number for number, places in enumerate(corners) if len(places)]
    every = np.concatenate([corners[number] for number in known]) if known else np.zeros((0, 3))
    starts = np.cumsum([0, *(len(corners[number]) for number in known)])[:-1]
    apart = np.zeros((len(bodies), len(bodies)), bool)
    for number in known:
        off = every @ bodies[number][:, :3].T + bodies[number][:, 3]
        apart[number, known] = (np.minimum.reduceat(off, starts) >= -1e-7 * scale).any(axis=1)
    apart |= apart.T
    for first, second in itertools.combinations(known, 2):
        if not apart[first, second]:
            depth, point = _deepest(np.concatenate([bodies[first], bodies[second]]), scale)
            if depth > 1e-7 * scale:
                return first, second, point
    return None


def _deepest(planes: np.ndarray, scale: float) -> tuple[float, np.ndarray]:
    """How deep the deepest point lies behind all planes, up to the scale, and the point."""
    from scipy.optimize import linprog

    rows = np.column_stack([planes[:, :3], np.ones(len(planes))])
    limits = [(-FAR, FAR)] * 3 + [(None, 1.0)]
    found = linprog([0, 0, 0, -1], A_ub=rows, b_ub=-planes[:, 3] / scale, bounds=limits)
    return (scale * found.x[3], scale * found.x[:3]) if found.status == 0 else (-1.0, np.zeros(3))
