"""Frusta as convex bodies, and as the tables that rays and images are worked out from."""

from typing import Any

import numpy as np

from mpcam.cameras.graph_frusta import Counts, Frusta
from mpcam.cameras.graph_images import ROWS
from mpcam.cameras.graph_numbers import Numbers, image_sides
from mpcam.cameras.graph_search import Bodies, plain_search, search
from mpcam.cameras.graph_tree import Tree
from mpcam.cameras.pinhole import Pinhole
from mpcam.math import detach, library

_NEVER = np.array([[0.0, 0.0, 0.0, -1.0]])  # a plane that nothing is behind


def bodies_of(root: Pinhole, numbers: Numbers) -> Bodies:
    """The frusta as bodies, that of the root with the sides of its image."""
    planes = [np.asarray(numbers.planes(number)) for number in range(len(numbers.bounds))]
    planes[0] = np.concatenate([planes[0], image_sides(root)])
    scale = max(float(np.abs(numbers.corners).max()), float(np.abs(numbers.centers).max())) or 1.0
    return Bodies.of(planes, [np.zeros((0, 3)), *np.asarray(numbers.corners[1:])], scale)


def tables(root: Pinhole, numbers: Numbers, tree: Tree, bodies: Bodies | None) -> Frusta:
    """The frusta as arrays, of JAX if any number is; bodies: if they are known."""
    count, depth = len(tree.parents), tree.depth
    ways = [(tree.way(number) + [-1] * depth)[: depth + 1] for number in range(count)]
    needed, found = [np.ones(len(rows), bool) for rows in numbers.bounds], plain_search(count)
    if bodies is not None:
        needed[1:], found = [bodies.facets(number) for number in range(1, count)], search(bodies)
    kept = [
        [row for row, there in zip(*both, strict=True) if there] for both in zip(numbers.bounds, needed, strict=True)
    ]
    exits = [
        [row for row, there in zip(rows[:last], some, strict=False) if there]
        for rows, last, some in zip(numbers.bounds, numbers.ends, needed, strict=True)
    ]
    x: Any = np
    if library(numbers.faces, numbers.pool, root.fx, root.fy, root.cx, root.cy) == "jax":
        import jax.numpy as x  # pyright: ignore[reportAssignmentType]
    never = len(numbers.pool)
    pool = x.concatenate([numbers.pool, _NEVER])
    inner, most = _padded(kept[1:], never)
    out, ways_out = _padded(exits, never)
    cuts = [never if cut is None else numbers.bounds[cut[0]][cut[1]] for cut in found.cuts]
    nodes = x.concatenate(
        [numbers.faces[:, None], x.pad(numbers.centers, ((0, 0), (0, 1)))[:, None], numbers.unbend], 1
    )
    edges = x.pad(numbers.images, ((0, 0), (0, 0), (0, 1)))
    return Frusta(
        *(root.fx, root.fy, root.cx, root.cy),
        nodes.reshape(ROWS * count, 4),
        detach(pool[np.array([*kept[0], *inner], int)]),
        pool[np.array(out, int)],
        detach(edges.reshape(-1, 4)),
        detach(pool[np.array(cuts, int)]),
        np.array(tree.parents, np.int32),
        np.array(ways, np.int32).ravel(),
        np.array(found.branches, np.int32),
        np.array(found.candidates, np.int32),
        Counts(count, depth, len(kept[0]), most, ways_out, edges.shape[1], found.steps, found.most),
        root.width,
        root.height,
    )


def _padded(rows: list[list[int]], never: int) -> tuple[list[int], int]:
    """All rows, each list filled up to the length of the longest by its last one, and that length."""
    most = max([1, *map(len, rows)])
    return [row for some in rows for row in (some + [some[-1] if some else never] * (most - len(some)))], most
