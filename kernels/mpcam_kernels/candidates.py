"""Pairs of a bundle of rays and a triangle, or a point, that may meet, in chunks of bounded memory."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import hierarchy, skew
from mpcam_kernels.bundles import Bundle, Cones
from mpcam_kernels.frozen import frozen
from mpcam_kernels.hierarchy import FAN, Chosen, Pairs
from mpcam_kernels.lanes import lanes
from mpcam_kernels.rows import Rows, room

LANES = 1 << 22  # at a time
FLEETING = 1 << 15  # pairs up to which they are worked out again rather than written down
NO_LANE = 0xFFFFFFFF
GROUPED = 64  # triangles of the clusters with which groups of blocks are left for blocks
CULLING = ("objects", "triangles")


@dataclass(frozen=True)
class Task:
    """What is drawn. vertices: 3 numbers each; faces: 3 UInts per triangle, neighbours close together; names: the
    triangles' own numbers; counts: triangles, then clusters level by level; bundle: the rays; fan: most blocks in a
    group.
    """

    vertices: Any
    faces: Any
    names: Any
    counts: tuple[int, ...]
    bundle: Bundle
    fan: int


Known = Pairs | Chosen
Tell = Callable[[str, Any], None]


class Candidates:
    """Steps from all pairs down to those of a block, or a camera triangle, and a triangle or a point; frozen.

    culling: what is left out early (Hou et al. 2006, section 2.4): "objects" holds clusters of triangles against
    bundles of rays, "triangles" each triangle by itself; without them all pairs are looked at.
    """

    def __init__(self, types: Any, culling: tuple[str, ...]):
        self.types, self.culling = types, culling
        self._set_up = frozen(self._set_up_pass)
        self._clusters = frozen(self._cluster_pass)
        self._mark = frozen(self._mark_pass)
        self._keep = frozen(self._keep_pass)
        self._look = frozen(self._look_pass)
        self._write = frozen(self._write_pass)

    def triangles(self, task: Task) -> tuple[Rows, list[Rows]]:
        """Set-ups of the triangles, and the balls around them and, level by level, around clusters."""
        types, counts = self.types, task.counts
        targets = room(types, skew.ROWS, counts[0]), room(types, 1, counts[0])
        setups, balls = self._set_up(lanes(types, 0, counts[0]), task.vertices, task.faces, task.names, targets)
        return setups, self.levels(balls, counts)

    def levels(self, balls: Rows, counts: tuple[int, ...]) -> list[Rows]:
        """Balls and, level by level, those around clusters of them; counts: how many there are of each."""
        levels = [balls]
        for level, count in enumerate(counts[1:] if "objects" in self.culling else ()):
            target = room(self.types, 1, count)
            levels.append(self._clusters(lanes(self.types, 0, count), levels[-1], counts[level], target))
        return levels

    def met(
        self,
        counts: tuple[int, ...],
        cones: Cones,
        levels: list[Rows],
        tell: Tell | None = None,
        split: tuple[Bundle, int] | None = None,
    ) -> Iterator[tuple[Known, int]]:
        """Pairs of a bundle and a ball that may meet, in chunks, and how many there are.

        cones: of the bundles to begin with. split: they are the groups of these rays, with so many blocks at most, and
        blocks take their place on the way down. tell(stage, arrays) is told after each step.
        """
        tell = tell or _untold
        top = len(levels) - 1

        def down(level: int, groups: Any, around: Cones, pairs: Known, number: int) -> Iterator[tuple[Known, int]]:
            if level == 0 and groups is None:
                yield pairs, number
                return
            if groups and (level == 0 or FAN**level <= GROUPED):
                (bundle, fan), below = groups, level
                step, around, groups = ("groups", fan, bundle.first, bundle.count), bundle.cones, None
                found = self._marked(number, fan, step, around, levels[level], pairs, self._culls(level), tell)
            else:
                below = level - 1
                found = self._refined(number, around, levels[below], counts[below], pairs, self._culls(below), tell)
            for after in found:
                yield from down(below, groups, around, *after)

        step, pairs = ("all", counts[top]), cones.items * counts[top]
        for after in self._marked(pairs, 1, step, cones, levels[top], None, self._culls(top), tell):
            yield from down(top, split, cones, *after)

    def _culls(self, level: int) -> bool:
        return "triangles" in self.culling if level == 0 else True

    def _marked(
        self,
        number: int,
        fan: int,
        step: Any,
        cones: Cones,
        balls: Rows,
        before: Known | None,
        cull: bool,
        tell: Tell,
    ) -> Iterator[tuple[Known, int]]:
        """A step with a lane for each of the `fan` bundles of a pair (see `hierarchy.children`), in chunks."""
        many = max(1, LANES // fan)
        for start in range(0, number, many):
            lane = lanes(self.types, start * fan, min(number, start + many) * fan)
            chosen = dr.compress(self._mark(lane, step, cones, balls, before, cull))
            found = dr.width(chosen)
            tell("candidates", chosen)
            if found and start == 0 and found <= FLEETING:
                yield Chosen(chosen, step, before), found
            elif found:
                yield self._keep(chosen, lane, step, before), found

    def _refined(
        self, number: int, cones: Cones, balls: Rows, count: int, before: Known, cull: bool, tell: Tell
    ) -> Iterator[tuple[Known, int]]:
        """A step from clusters to their children, `count` in all, with a lane for each pair, in chunks."""
        types, many = self.types, LANES // FAN
        for start in range(0, number, many):
            lane = lanes(types, start, min(number, start + many))
            masks, found = self._look(lane, cones, before, balls, count, cull)
            ends = dr.cumsum(found)
            total = int(ends[-1])
            tell("candidates", ends)
            if total:
                targets = Pairs(dr.empty(types.UInt, total), dr.empty(types.UInt, total))
                yield self._write(lane, before, masks, ends, targets), total

    def _mark_pass(self, lane: Any, step: Any, cones: Cones, balls: Rows, before: Any, cull: bool) -> Any:
        bundle, ball, exists = hierarchy.children(lane, step, before)
        met = hierarchy.meeting(self.types, cones(self.types, bundle, exists), balls, ball, exists, cull)
        return met & (lane != NO_LANE)  # of one triangle that is not looked at, all marks would be one number

    def _keep_pass(self, chosen: Any, lane: Any, step: Any, before: Any) -> Pairs:
        bundle, ball, _ = hierarchy.children(dr.gather(self.types.UInt, lane, chosen), step, before)
        return Pairs(bundle, ball)

    def _look_pass(self, lane: Any, cones: Cones, before: Any, balls: Rows, count: int, cull: bool) -> tuple[Any, Any]:
        return hierarchy.met_children(self.types, cones, before, lane, balls, count, cull)

    def _write_pass(self, lane: Any, before: Any, masks: Any, ends: Any, targets: Pairs) -> Pairs:
        hierarchy.write_children(self.types, before, lane, masks, ends - dr.popcnt(masks), targets)
        return targets

    def _set_up_pass(self, triangle: Any, vertices: Any, faces: Any, names: Any, targets: Any) -> Any:
        types = self.types
        corners = dr.gather(types.Array3u, faces, triangle)
        a, b, c = (dr.gather(types.Array3f, vertices, corner) for corner in corners)
        shape = skew.setup(a, b, c)
        setups, balls = targets
        setups.store(skew.pack(types, shape, dr.gather(types.UInt, names, triangle)), triangle)
        balls.store([hierarchy.triangle_balls(types, (a, b, c), shape.usable)], triangle)
        return targets

    def _cluster_pass(self, cluster: Any, balls: Rows, count: int, target: Rows) -> Rows:
        target.store([hierarchy.cluster_balls(self.types, cluster, balls, count)], cluster)
        return target


def _untold(stage: str, arrays: Any) -> None:
    """Nobody times the stages."""
