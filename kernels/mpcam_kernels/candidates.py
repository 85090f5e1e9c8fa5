"""Pairs of a cone of rays and a triangle, or a point, that may meet, in chunks of bounded memory."""

from collections.abc import Callable, Iterator
from typing import Any

import drjit as dr

from mpcam_kernels import hierarchy
from mpcam_kernels.frozen import frozen
from mpcam_kernels.hierarchy import FAN, Marked, Pairs
from mpcam_kernels.rows import Rows, room
from mpcam_kernels.threads import threads

THREADS = 1 << 22  # at a time
NO_THREAD = 0xFFFFFFFF
CULLING = ("objects", "triangles")
FEW = 1 << 15  # pairs up to which all cones are held against all balls of a level
MOST_LEVELS = 5


Found = Pairs | Marked
Tell = Callable[[str, Any], None]


def levels(count: int, cones: int) -> tuple[int, ...]:
    """How many balls there are, and how many clusters of them level by level, for so many cones to begin with."""
    counts = [count]
    while counts[-1] * cones > FEW and counts[-1] > FAN and len(counts) < MOST_LEVELS:
        counts.append(-(-counts[-1] // FAN))
    return tuple(counts)


class Candidates:
    """Steps from all pairs of a cone and a cluster down to those of a cone and a triangle or a point; frozen.

    culling: what is left out early (Hou et al. 2006, section 2.4): "objects" holds clusters of triangles against
    cones, "triangles" each triangle by itself; without them all pairs are looked at.
    """

    def __init__(self, types: Any, culling: tuple[str, ...]):
        self.types, self.culling = types, culling
        self._clusters = frozen(self._cluster_pass)
        self._mark = frozen(self._mark_pass)
        self._look = frozen(self._look_pass)
        self._write = frozen(self._write_pass)

    def levels(self, balls: Rows, counts: tuple[int, ...]) -> list[Rows]:
        """Balls and, level by level, those around clusters of them; counts: how many there are of each."""
        levels = [balls]
        for level, count in enumerate(counts[1:] if "objects" in self.culling else ()):
            target = room(self.types, 1, count)
            levels.append(self._clusters(threads(self.types, 0, count), levels[-1], counts[level], target))
        return levels

    def met(
        self, counts: tuple[int, ...], cones: Any, levels: list[Rows], tell: Tell | None = None
    ) -> Iterator[tuple[Found, int]]:
        """Pairs of a cone and a ball that may meet, in chunks, and how many there are.

        tell(stage, arrays) is told after each step.
        """
        tell = tell or _untold

        def down(level: int, pairs: Found, number: int) -> Iterator[tuple[Found, int]]:
            if level == 0:
                yield pairs, number
                return
            below = level - 1
            for after in self._refined(number, cones, levels[below], counts[below], pairs, self._culls(below), tell):
                yield from down(below, *after)

        top = len(levels) - 1
        for after in self._marked(cones, levels[top], counts[top], self._culls(top), tell):
            yield from down(top, *after)

    def _culls(self, level: int) -> bool:
        return "triangles" in self.culling if level == 0 else True

    def _marked(self, cones: Any, balls: Rows, count: int, cull: bool, tell: Tell) -> Iterator[tuple[Marked, int]]:
        """All pairs, a thread each, in chunks."""
        number = cones.items * count
        for start in range(0, number, THREADS):
            thread = threads(self.types, start, min(number, start + THREADS))
            marked = Marked(dr.compress(self._mark(thread, cones, balls, count, cull)), count)
            tell("candidates", marked)
            if not dr.width(marked.threads):
                continue
            if start:
                marked = Marked(marked.threads + start, count)
            yield marked, dr.width(marked.threads)

    def _refined(
        self, number: int, cones: Any, balls: Rows, count: int, before: Found, cull: bool, tell: Tell
    ) -> Iterator[tuple[Pairs, int]]:
        """A step from clusters to their children, `count` in all, with a thread for each pair, in chunks."""
        many = THREADS // FAN
        for start in range(0, number, many):
            thread = threads(self.types, start, min(number, start + many))
            masks, each = self._look(thread, cones, before, balls, count, cull)
            yield from self.written(thread, before, masks, each, tell, self._write)

    def written(
        self, thread: Any, before: Any, masks: Any, each: Any, tell: Tell, write: Callable[..., Pairs], *rest: Any
    ) -> Iterator[tuple[Pairs, int]]:
        """The pairs that masks with so many bits each stand for, written by a kernel, if there are any."""
        ends = dr.cumsum(each)
        total = int(ends[-1])
        tell("candidates", ends)
        if total:
            targets = Pairs(dr.empty(self.types.UInt, total), dr.empty(self.types.UInt, total))
            yield write(thread, before, masks, ends, targets, *rest), total

    def _mark_pass(self, thread: Any, cones: Any, balls: Rows, count: int, cull: bool) -> Any:
        cone, ball = hierarchy.every_pair(thread, count)
        met = hierarchy.meeting(self.types, cones(self.types, cone), balls, ball, self.types.Bool(True), cull)
        return met & (thread != NO_THREAD)  # of one triangle that is not looked at, all marks would be one number

    def _look_pass(self, thread: Any, cones: Any, before: Any, balls: Rows, count: int, cull: bool) -> tuple[Any, Any]:
        return hierarchy.met_children(self.types, cones, before, thread, balls, count, cull)

    def _write_pass(self, thread: Any, before: Any, masks: Any, ends: Any, targets: Pairs) -> Pairs:
        cone, cluster = before.at(thread)
        hierarchy.write_pairs(lambda bit: (cone, cluster * FAN + bit), masks, ends - dr.popcnt(masks), targets)
        return targets

    def _cluster_pass(self, cluster: Any, balls: Rows, count: int, target: Rows) -> Rows:
        target.store([hierarchy.cluster_balls(self.types, cluster, balls, count)], cluster)
        return target


def _untold(stage: str, arrays: Any) -> None:
    """Nobody times the stages."""
