"""Nearest triangle of every pixel for rays that need no common centre: candidates by a hierarchy, then exact per pixel.

Balls around the triangles and clusters of them meet cones around groups and blocks of rays. What is left are pairs of a
block and a triangle; where no edge excludes all rays of a part of the block, its pixels are tested. Nothing is kept from
frame to frame but the order of the triangles, so scenes move freely.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import hierarchy, pixels, skew
from mpcam_kernels.blocks import Large, Lists, Pairs, list_pairs
from mpcam_kernels.bundles import Bundle
from mpcam_kernels.frozen import frozen
from mpcam_kernels.lanes import lanes
from mpcam_kernels.outputs import OUTPUTS
from mpcam_kernels.samples import PIXELS, Samples

LANES = 1 << 22  # at a time
GROUPED = 64  # triangles of the clusters with which groups of blocks are left for blocks


@dataclass(frozen=True)
class Tree:
    """order: numbers of the triangles, neighbours close together; counts: triangles, then clusters level by level."""

    order: Any
    counts: tuple[int, ...]


class BundlePipeline:
    """The kernels of one output; frozen. output: "hits", "depth" or "coverage". count: also count tests and hits."""

    def __init__(self, types: Any, *, output: str = "hits", count: bool = False):
        self.types, self.output, self.count = types, OUTPUTS[output], count
        self._set_up = frozen(self._set_up_pass)
        self._clusters = frozen(self._cluster_pass)
        self._first = frozen(self._first_pass)
        self._groups = frozen(self._group_pass)
        self._children = frozen(self._child_pass)
        self._blocks = frozen(self._block_pass)
        self._list = frozen(self._list_pass)
        self._pixels = frozen(self._pixel_pass)

    def frame(
        self,
        vertices: Any,
        faces: Any,
        tree: Tree,
        bundle: Bundle,
        blocks: int,
        fan: int,
        done: Callable[[str, Any], None] | None = None,
    ) -> tuple[Any, Any]:
        """Keys of all places (see `outputs`), and counters (tests, hits) or None.

        vertices: 3 numbers each. faces: 3 UInts per triangle. blocks: how many there are; fan: most of them in a group.
        done(stage, arrays) is told after each pass.
        """
        types = self.types
        tell = done or (lambda stage, arrays: None)
        counters = dr.zeros(types.UInt64, 2) if self.count else None
        buffer = dr.zeros(self.output.kind(types), blocks * PIXELS)
        dr.make_opaque(buffer)
        if not tree.counts[0] or not blocks:
            return buffer, counters
        rows = [dr.empty(types.Float, 4 * tree.counts[0]) for _ in range(skew.ROWS + 1)]
        *setups, balls = self._set_up(lanes(types, 0, tree.counts[0]), vertices, faces, rows)
        levels = [balls]
        for level, count in enumerate(tree.counts[1:]):
            room = dr.empty(types.Float, 4 * count)
            order = tree.order if level == 0 else None
            levels.append(self._clusters(lanes(types, 0, count), levels[-1], order, tree.counts[level], room))
        tell("triangles", (setups, levels))
        groups = dr.width(bundle.first)
        state = [buffer, counters]

        def finish(found: Any, number: int) -> None:
            step = hierarchy.ROOM
            for start in range(0, number, step):
                pairs = self._blocks(
                    lanes(types, start, min(number, start + step)), bundle, setups, found, dr.zeros(types.UInt, blocks)
                )
                many = pairs.found[0]
                tell("blocks", pairs)
                if not many:
                    continue
                lists = Lists(dr.empty(types.UInt, 2 * many), dr.prefix_sum(pairs.counts), pairs.counts)
                lists = self._list(lanes(types, 0, many), pairs, lists)
                tell("lists", lists)
                everywhere = lanes(types, 0, blocks * PIXELS // pixels.PER_LANE)
                state[:] = self._pixels(everywhere, bundle, setups, lists, *state)
                tell("pixels", state[0])

        def down(level: int, by_group: bool, found: Any, number: int) -> None:
            """From pairs with balls of a level on."""
            if level == 0 and not by_group:
                finish(found, number)
                return
            split = by_group and (level == 0 or hierarchy.FAN**level <= GROUPED)
            fan_out = fan if split else hierarchy.FAN
            start, step = 0, max(1, LANES // fan_out)
            while start < number:
                step = min(step, number - start)
                lane = lanes(types, start * fan_out, (start + step) * fan_out)
                if split:
                    after = self._groups(lane, fan, bundle, levels[level], found)
                else:
                    cones = bundle.groups if by_group else bundle.cones
                    order = tree.order if level == 1 else None
                    after = self._children(lane, cones, levels[level - 1], tree.counts[level - 1], found, order)
                many = after.found[0]
                if many > hierarchy.ROOM and step > 1:
                    step = max(1, step // (1 + many // hierarchy.ROOM))
                    continue
                tell("candidates", after)
                if many:
                    down(level if split else level - 1, by_group and not split, after, many)
                start += step

        top = len(levels) - 1
        start, step, total = 0, LANES, groups * tree.counts[top]
        while start < total:
            step = min(step, total - start)
            found = self._first(lanes(types, start, start + step), bundle.groups, levels[top], tree.counts[top])
            many = found.found[0]
            if many > hierarchy.ROOM:
                step = max(1, step // (1 + many // hierarchy.ROOM))
                continue
            tell("candidates", found)
            if many:
                down(top, True, found, many)
            start += step
        return state[0], state[1]

    def _set_up_pass(self, triangle: Any, vertices: Any, faces: Any, rows: list[Any]) -> list[Any]:
        types = self.types
        corners = dr.gather(types.Array3u, faces, triangle)
        points = [dr.gather(types.Array3f, vertices, corner) for corner in corners]
        shape = skew.setup(*points)
        ball = hierarchy.triangle_balls(types, tuple(points), shape.usable)  # pyright: ignore[reportArgumentType]
        for target, row in zip(rows, (*skew.pack(types, shape), ball), strict=True):
            dr.scatter(target, row, triangle)
        return rows

    def _cluster_pass(self, cluster: Any, balls: Any, order: Any, count: int, room: Any) -> Any:
        dr.scatter(room, hierarchy.cluster_balls(self.types, cluster, balls, order, count), cluster)
        return room

    def _first_pass(self, lane: Any, cones: Any, balls: Any, clusters: int) -> hierarchy.Found:
        return hierarchy.first_pairs(self.types, lane, cones, balls, clusters)

    def _group_pass(self, lane: Any, fan: int, bundle: Bundle, balls: Any, before: hierarchy.Found) -> hierarchy.Found:
        return hierarchy.refine_groups(self.types, lane, fan, bundle, balls, before)

    def _child_pass(
        self, lane: Any, cones: Any, balls: Any, count: int, before: hierarchy.Found, order: Any
    ) -> hierarchy.Found:
        return hierarchy.refine_clusters(self.types, lane, cones, balls, count, before, order)

    def _block_pass(
        self, lane: Any, bundle: Bundle, setups: list[Any], before: hierarchy.Found, counts: Any
    ) -> Pairs:
        return hierarchy.block_pairs(self.types, skew, lane, bundle, setups, before, counts)

    def _list_pass(self, lane: Any, pairs: Pairs, lists: Lists) -> Lists:
        return list_pairs(self.types, lane, pairs, lists)

    def _pixel_pass(
        self, lane: Any, bundle: Bundle, setups: list[Any], lists: Lists, buffer: Any, counters: Any
    ) -> tuple[Any, Any]:
        samples = Samples(bundle.pixels, None, None)  # pyright: ignore[reportArgumentType]
        keys, *counted = pixels.through_lists(
            self.types, skew, self.output, lane, samples, Large([], setups, None), lists, buffer, (1, 1), False, self.count
        )
        if self.count:
            for slot, value in enumerate(counted):
                dr.scatter_reduce(dr.ReduceOp.Add, counters, self.types.UInt64(value), self.types.UInt(slot))
        return keys, counters
