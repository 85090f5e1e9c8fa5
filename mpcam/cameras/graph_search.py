"""Where frusta lie: their corners, which of them overlap, and planes that lead from a point to its frustum."""

import itertools
from typing import NamedTuple

import numpy as np

FAR = 1000.0
"""Where frusta that go on for ever are cut off, in units of the scale."""
_NEAR = 1e-7  # of the scale, by which frusta may reach into each other


class Bodies(NamedTuple):
    """Convex bodies: planes (m, 4) of each, n . x + o <= 0 inside, unit normals; corners (n, 3), none of an empty one;
    and a length that is large against errors and not against the bodies."""

    planes: list[np.ndarray]
    corners: list[np.ndarray]
    scale: float

    @classmethod
    def of(cls, planes: list[np.ndarray], known: list[np.ndarray], scale: float) -> "Bodies":
        """From planes, and corners that are known beforehand."""
        return cls(planes, [_corners(*both, scale) for both in zip(planes, known, strict=True)], scale)

    def facets(self, number: int) -> np.ndarray:
        """Which planes of a body are needed: those with a corner in them, each once; all of an empty one."""
        planes, corners = self.planes[number], self.corners[number]
        size = self.scale + np.abs(corners).max(axis=1, initial=0.0)
        on = np.abs(corners @ planes[:, :3].T + planes[:, 3]) <= 1e-9 * size[:, None]
        other = np.abs(planes[:, None] - planes) > 1e-12 * np.array([1.0, 1.0, 1.0, self.scale])
        again = np.tril(~other.any(axis=-1), -1).any(axis=1)
        return (on.any(axis=0) & ~again) | (len(corners) == 0)


class Search(NamedTuple):
    """Cuts as (body, plane), branches (2 C,) and candidates (C L,) as `Frusta` has them; most cuts on a way; L."""

    cuts: list[tuple[int, int] | None]
    branches: list[int]
    candidates: list[int]
    steps: int
    most: int


def _corners(planes: np.ndarray, known: np.ndarray, scale: float) -> np.ndarray:
    """Each known place, and each where three planes meet, that is on the inner side of all others."""
    box = [[*(sign * (axis == i) for i in range(3)), -FAR * scale] for axis in range(3) for sign in (1.0, -1.0)]
    every = np.concatenate([planes, box])
    threes = every[np.array(list(itertools.combinations(range(len(every)), 3)))]
    angle = np.abs(np.linalg.det(threes[:, :, :3]))
    meets = angle > 1e-13  # else there is no telling where
    places = np.linalg.solve(threes[meets][:, :, :3], -threes[meets][:, :, 3:])[:, :, 0]
    doubt = np.concatenate([np.full(len(known), 1e-9), 1e-9 + 1e-15 / angle[meets]])
    places = np.concatenate([known, places])
    off = places @ every[:, :3].T + every[:, 3]
    return places[(off <= (doubt * (scale + np.abs(places).max(axis=1)))[:, None]).all(axis=1)]


def overlap(bodies: Bodies) -> tuple[int, int, np.ndarray] | None:
    """Two bodies that both hold a point, and the point; None if none do.

    Most are told apart by a plane of either; the others by looking for the point that is deepest in both.
    """
    planes, corners, scale = bodies
    known = [number for number, places in enumerate(corners) if len(places)]
    if not known:
        return None
    every, starts = np.concatenate([corners[k] for k in known]), np.cumsum([0, *(len(corners[k]) for k in known)])[:-1]
    apart = np.zeros((len(planes), len(planes)), bool)
    for number in known:
        off = every @ planes[number][:, :3].T + planes[number][:, 3]
        apart[number, known] = (np.minimum.reduceat(off, starts) >= -_NEAR * scale).any(axis=1)
    apart |= apart.T
    for first, second in itertools.combinations(known, 2):
        if not apart[first, second]:
            depth, point = _deepest(np.concatenate([planes[first], planes[second]]), scale)
            if depth > _NEAR * scale:
                return first, second, point
    return None


def _deepest(planes: np.ndarray, scale: float) -> tuple[float, np.ndarray]:
    """How deep the deepest point lies behind all planes, up to the scale, and the point."""
    from scipy.optimize import linprog

    rows = np.column_stack([planes[:, :3], np.ones(len(planes))])
    limits = [(-FAR, FAR)] * 3 + [(None, 1.0)]
    found = linprog([0, 0, 0, -1], A_ub=rows, b_ub=-planes[:, 3] / scale, bounds=limits)
    return (scale * found.x[3], scale * found.x[:3]) if found.status == 0 else (-1.0, np.zeros(3))


def plain_search(count: int) -> Search:
    """No cuts: every body but the first is a candidate for every point."""
    return Search([None], [0, 0], list(range(1, count)) or [-1], 0, count - 1)


def search(bodies: Bodies) -> Search:
    """Cuts along planes of bodies, so that few bodies are left on each side: a binary space partition.

    The first body is no candidate. Bodies that a cut goes through count on both sides.
    """
    cuts: list[tuple[int, int] | None] = []
    branches: list[int] = []
    ends: list[list[int]] = []

    def part(some: list[int]) -> tuple[int, int]:
        """Number of the cut through some bodies, and most cuts from there on."""
        number, cut = len(cuts), _best_cut(bodies, some)
        cuts.append(None)
        branches.extend([number, number])
        ends.append(some)
        if cut is None:
            return number, 0
        cuts[number], ends[number] = cut[0], []
        (low, first), (high, second) = part(cut[1]), part(cut[2])
        branches[2 * number : 2 * number + 2] = low, high
        return number, 1 + max(first, second)

    _, steps = part([number for number in range(1, len(bodies.planes)) if len(bodies.corners[number])])
    most = max(map(len, ends))
    every = [body for some in ends for body in some + [-1] * (most - len(some))]
    return Search(cuts, branches, every or [-1], steps, most)


def _best_cut(bodies: Bodies, some: list[int]) -> tuple[tuple[int, int], list[int], list[int]] | None:
    """The plane that leaves the fewest bodies on its fuller side, and both sides; None where none parts them."""
    if len(some) < 2:
        return None
    corners = np.concatenate([bodies.corners[number] for number in some])
    starts = np.cumsum([0, *(len(bodies.corners[number]) for number in some)])[:-1]
    names = [(number, plane) for number in some for plane in np.flatnonzero(bodies.facets(number)).tolist()]
    planes = np.array([bodies.planes[number][plane] for number, plane in names])
    off = corners @ planes[:, :3].T + planes[:, 3]
    slack = _NEAR * bodies.scale
    below = np.minimum.reduceat(off, starts) < -slack
    above = (np.maximum.reduceat(off, starts) > slack) | ~below  # in the plane: on both sides
    below |= np.maximum.reduceat(off, starts) <= slack
    fuller = np.maximum(below.sum(axis=0), above.sum(axis=0)) + 1e-3 * (below & above).sum(axis=0)
    best = int(fuller.argmin())
    if fuller[best] >= len(some):
        return None
    sides = [[number for number, there in zip(some, side[:, best], strict=True) if there] for side in (below, above)]
    return names[best], sides[0], sides[1]
