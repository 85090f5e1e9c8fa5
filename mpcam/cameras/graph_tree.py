"""Which frusta of a graph camera follow upon which: all ways from the root through portals, as a tree."""

from collections.abc import Sequence
from typing import NamedTuple

from mpcam.cameras.graph_portals import Portal
from mpcam.errors import InputError

MOST = 256
"""Frusta of one camera."""


class Tree(NamedTuple):
    """A node for each way from the root through portals; node 0 is the root itself, and parents come first.

    parents: node before each, -1 for the root. portals: number of the portal that each enters by, -1 for the root.
    owners: number of the portal that has the center, another one where frusta merge. levels: portals on the way.
    """

    parents: tuple[int, ...]
    portals: tuple[int, ...]
    owners: tuple[int, ...]
    levels: tuple[int, ...]

    @property
    def depth(self) -> int:
        """Portals on the longest way."""
        return max(self.levels)

    def children(self, node: int) -> list[int]:
        """Nodes that follow upon a node."""
        return [number for number, parent in enumerate(self.parents) if parent == node]

    def way(self, node: int) -> list[int]:
        """Nodes from the root to a node, both with it."""
        nodes = [node]
        while self.parents[nodes[-1]] >= 0:
            nodes.append(self.parents[nodes[-1]])
        return nodes[::-1]


def owner(portals: Sequence[Portal], number: int) -> int:
    """The portal whose center and ends belong to the frustum behind a portal."""
    into = portals[number].into
    return number if into is None else into


def grown(portals: Sequence[Portal]) -> Tree:
    """The tree of these portals, level by level.

    Raises InputError for parents and merges that name no portal, for circles, and for more than MOST frusta.
    """
    _check_numbers(portals)
    parents, entered, owners, levels = [-1], [-1], [-1], [0]
    node = 0
    while node < len(parents):
        for number, portal in enumerate(portals):
            leaves = -1 if portal.parent < 0 else owner(portals, portal.parent)
            if leaves == owners[node]:
                parents.append(node)
                entered.append(number)
                owners.append(owner(portals, number))
                levels.append(levels[node] + 1)
        if len(parents) > MOST:
            raise InputError(
                f"GraphCamera: more than {MOST} frusta, counted by the ways that lead to them: give fewer portals, or "
                "fewer merges after each other"
            )
        node += 1
    return Tree(tuple(parents), tuple(entered), tuple(owners), tuple(levels))


def _check_numbers(portals: Sequence[Portal]) -> None:
    count = len(portals)
    for number, portal in enumerate(portals):
        if not -1 <= portal.parent < count:
            raise InputError(
                f"GraphCamera: portal {number}: parent={portal.parent}: there are portals 0 to {count - 1}; -1 is the "
                "root"
            )
        if portal.into is not None:
            if not 0 <= portal.into < count:
                raise InputError(
                    f"GraphCamera: portal {number}: into={portal.into}: there are portals 0 to {count - 1}"
                )
            if portals[portal.into].into is not None:
                raise InputError(
                    f"GraphCamera: portal {number}: into={portal.into}, which has no center of its own: name "
                    f"portal {portals[portal.into].into}"
                )
    before = {number: set() for number in range(count)}  # frusta that the frustum of a portal follows upon
    for number, portal in enumerate(portals):
        if portal.parent >= 0:
            before[owner(portals, number)].add(owner(portals, portal.parent))
    free: set[int] = set()
    while True:
        more = {number for number, others in before.items() if number not in free and others <= free}
        if not more:
            break
        free |= more
    if len(free) < count:
        circle = next(number for number in range(count) if owner(portals, number) not in free)
        raise InputError(
            f"GraphCamera: portal {circle} can be reached through itself: follow parent and into from portal to "
            "portal, and end each way at the root, parent = -1"
        )
