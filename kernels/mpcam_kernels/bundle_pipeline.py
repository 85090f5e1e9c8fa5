"""Nearest triangle of every pixel for rays that need no common centre: candidates by a hierarchy, then exact per pixel.

Balls around the triangles and clusters of them meet cones around groups and blocks of rays. What is left are pairs of a
block and a triangle; where no edge excludes all rays of a part of the block, its pixels are tested. Nothing is kept
from frame to frame but the order of the triangles, so scenes move freely.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import cover, hierarchy, pixels, planes, skew
from mpcam_kernels.blocks import Large, Lists, Pairs, list_pairs
from mpcam_kernels.bundles import Bundle, Cones, joined
from mpcam_kernels.frozen import frozen
from mpcam_kernels.hierarchy import FAN, ROOM, SHARE, Found
from mpcam_kernels.lanes import lanes
from mpcam_kernels.outputs import OUTPUTS
from mpcam_kernels.rows import Rows, room
from mpcam_kernels.samples import PIXELS

LANES = 1 << 22  # at a time
MANY = 1024  # triangles, from which on some may be small
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


@dataclass(frozen=True)
class State:
    """Keys of all places so far, None while nothing was drawn; tests and hits so far, or None."""

    buffer: Any
    counters: Any


class Canvas:
    """Holds the state while pairs are drawn that come in chunks."""

    def __init__(self, state: State):
        self.state = state


class BundlePipeline:
    """The kernels of one output for so many blocks; frozen.

    output: "hits", "depth" or "coverage". count: also count tests and hits. culling: what is left out early (Hou et al.
    2006, section 2.4): "objects" holds clusters of triangles against bundles of rays, "triangles" each triangle by
    itself; without them all pairs are looked at.
    """

    def __init__(
        self, types: Any, blocks: int, *, output: str = "hits", count: bool = False, culling: tuple[str, ...] = CULLING
    ):
        self.types, self.blocks, self.culling = types, blocks, culling
        self.output, self.count = OUTPUTS[output], count
        self._set_up = frozen(self._set_up_pass)
        self._clusters = frozen(self._cluster_pass)
        self._first = frozen(self._first_pass)
        self._groups = frozen(self._group_pass)
        self._children = frozen(self._child_pass)
        self._blocks = frozen(self._block_pass)
        self._walk = frozen(self._walk_pass)
        self._list = frozen(self._list_pass)
        self._pixels = frozen(self._pixel_pass)

    def frame(self, task: Task, done: Callable[[str, Any], None] | None = None) -> tuple[Any, Any]:
        """Keys of all places (see `outputs`), and counters (tests, hits) or None.

        done(stage, arrays) is told after each pass.
        """
        types, tell = self.types, done or (lambda stage, arrays: None)
        canvas = Canvas(State(None, dr.zeros(types.UInt64, 2) if self.count else None))
        if task.counts[0]:
            setups, levels = self._triangles(task)
            tell("triangles", (setups, levels))
            everywhere = lanes(types, 0, self.blocks * PIXELS // pixels.PER_LANE)
            for pairs, rows in self.pairs(task, setups, levels, canvas, tell):
                many = pairs.found[0]
                tell("blocks", (pairs, canvas.state))
                if many:
                    lists = Lists(dr.empty(types.UInt, 2 * many), dr.prefix_sum(pairs.counts), pairs.counts)
                    lists = self._list(lanes(types, 0, many), pairs, lists)
                    tell("lists", lists)
                    large, bundle = Large(rows, setups, None), task.bundle
                    canvas.state = self._pixels(everywhere, bundle.pixels, bundle.corners, large, lists, canvas.state)
                    tell("pixels", canvas.state)
        buffer = self._blank() if canvas.state.buffer is None else canvas.state.buffer
        return buffer, canvas.state.counters

    def _blank(self) -> Any:
        """Keys of places where nothing is hit."""
        buffer = dr.zeros(self.output.kind(self.types), self.blocks * PIXELS)
        dr.make_opaque(buffer)
        return buffer

    def _triangles(self, task: Task) -> tuple[Rows, list[Rows]]:
        """Set-ups of the triangles, and the balls around them and, level by level, around clusters."""
        types, counts = self.types, task.counts
        targets = room(types, skew.ROWS, counts[0]), room(types, 1, counts[0])
        setups, balls = self._set_up(lanes(types, 0, counts[0]), task.vertices, task.faces, task.names, targets)
        levels = [balls]
        for level, count in enumerate(counts[1:] if "objects" in self.culling else ()):
            target = room(types, 1, count)
            levels.append(self._clusters(lanes(types, 0, count), levels[-1], counts[level], target))
        return setups, levels

    def pairs(
        self, task: Task, setups: Rows, levels: list[Rows], canvas: "Canvas", tell: Any
    ) -> Iterator[tuple[Pairs, list[Any]]]:
        """Pairs of a block and a triangle, in chunks, and what rows of regions they name (none here).

        Small triangles go onto the canvas at once.
        """
        bounds, walking = (task.bundle.cones, task.bundle.slopes), task.counts[0] > MANY
        for found, number in self.met(task, task.bundle.groups, levels, True, tell):
            for start in range(0, number, ROOM):
                lane = lanes(self.types, start, min(number, start + ROOM))
                zeros = dr.zeros(self.types.UInt, self.blocks)
                pairs, few = self._blocks(lane, bounds, setups, found, zeros, walking)
                many = few.found[0] if few else 0
                if many:
                    canvas.state = self._walk(lanes(self.types, 0, many), task.bundle.pixels, setups, few, canvas.state)
                    tell("small", canvas.state)
                yield pairs, []

    def met(self, task: Task, cones: Cones, levels: list[Rows], split: bool, tell: Any) -> Iterator[tuple[Found, int]]:
        """Pairs of a bundle and a triangle that may meet, in chunks, and how many there are.

        cones: of the bundles to begin with; split: they are groups, and blocks take their place on the way down.
        """
        types, top = self.types, len(levels) - 1
        bundles = dr.width(cones.rows.flat) // (4 * cones.rows.count)
        blocks = (task.bundle.cones, task.bundle.first, task.bundle.count)

        def passed(fan: int, number: int, step: Callable[[Any], Found]) -> Iterator[tuple[Found, int]]:
            """A step over all pairs, a lane for each of their `fan` children, in chunks that there is room for."""
            start, many = 0, max(1, LANES // fan)
            while start < number:
                many = min(many, number - start)
                found = step(lanes(types, start * fan, (start + many) * fan))
                kept = found.found[0]
                if kept > ROOM:
                    many = max(1, many // (1 + kept // ROOM))
                    continue
                tell("candidates", found)
                if kept:
                    yield found, kept
                start += many

        def down(level: int, groups: bool, found: Found, number: int) -> Iterator[tuple[Found, int]]:
            if level == 0 and not groups:
                yield found, number
                return
            if groups and (level == 0 or FAN**level <= GROUPED):
                balls, cull = levels[level], self._culls(level)
                for after in passed(
                    task.fan, number, lambda lane: self._groups(lane, task.fan, blocks, balls, found, cull)
                ):
                    yield from down(level, False, *after)
                return
            around = task.bundle.groups if groups else task.bundle.cones if split else cones
            below, count = levels[level - 1], task.counts[level - 1]
            cull = self._culls(level - 1)
            for after in passed(SHARE, number, lambda lane: self._children(lane, around, below, count, found, cull)):
                yield from down(level - 1, groups, *after)

        count, cull = task.counts[top], self._culls(top)
        for after in passed(1, bundles * count, lambda lane: self._first(lane, cones, levels[top], count, cull)):
            yield from down(top, split, *after)

    def _culls(self, level: int) -> bool:
        return "triangles" in self.culling if level == 0 else True

    def _set_up_pass(self, triangle: Any, vertices: Any, faces: Any, names: Any, targets: Any) -> Any:
        types = self.types
        corners = dr.gather(types.Array3u, faces, triangle)
        a, b, c = (dr.gather(types.Array3f, vertices, corner) for corner in corners)
        shape = skew.setup(a, b, c)
        ball = hierarchy.triangle_balls(types, (a, b, c), shape.usable)
        setups, balls = targets
        setups.store(skew.pack(types, shape, dr.gather(types.UInt, names, triangle)), triangle)
        balls.store([ball], triangle)
        return targets

    def _cluster_pass(self, cluster: Any, balls: Any, count: int, target: Any) -> Any:
        target.store([hierarchy.cluster_balls(self.types, cluster, balls, count)], cluster)
        return target

    def _first_pass(self, lane: Any, cones: Any, balls: Any, clusters: int, cull: bool) -> Found:
        return hierarchy.first_pairs(self.types, lane, cones, balls, clusters, cull)

    def _group_pass(self, lane: Any, fan: int, blocks: Any, balls: Any, before: Found, cull: bool) -> Found:
        return hierarchy.refine_groups(self.types, lane, fan, *blocks, balls, before, cull)

    def _child_pass(self, lane: Any, cones: Any, balls: Any, count: int, before: Found, cull: bool) -> Found:
        return hierarchy.refine_clusters(self.types, lane, cones, balls, count, before, cull)

    def _block_pass(
        self, lane: Any, bounds: Any, setups: Rows, before: Found, counts: Any, walking: bool
    ) -> tuple[Pairs, cover.Small | None]:
        return cover.block_pairs(self.types, skew, lane, *bounds, setups, before, counts, walking)

    def _walk_pass(self, lane: Any, rays: Any, setups: Rows, few: cover.Small, state: "State") -> "State":
        buffer = self._blank() if state.buffer is None else state.buffer
        counted = cover.walk_small(self.types, skew, self.output, lane, rays, setups, few, buffer, self.count)
        return State(buffer, self._counted(state.counters, counted))

    def _counted(self, counters: Any, counted: Any) -> Any:
        """The counters with tests and hits of all lanes added."""
        if self.count:
            for slot, value in enumerate(counted):
                dr.scatter_reduce(dr.ReduceOp.Add, counters, self.types.UInt64(value), self.types.UInt(slot))
        return counters

    def _list_pass(self, lane: Any, pairs: Pairs, lists: Lists) -> Lists:
        return list_pairs(self.types, lane, pairs, lists)

    def _pixel_pass(self, lane: Any, rays: Any, corners: Any, large: Large, lists: Lists, state: "State") -> "State":
        buffer = self._blank() if state.buffer is None else state.buffer

        def corner(place: Any) -> tuple[Any, Any]:
            """Column and row of places within their camera triangle."""
            block = place // PIXELS
            x, y = (dr.gather(self.types.UInt, values, block) for values in corners)
            return x + ((place >> 4) & 3) * 4 + (place & 3), y + ((place >> 6) & 1) * 4 + ((place >> 2) & 3)

        keys, *counted = pixels.through_lists(
            self.types, skew, self.output, lane, rays, large, lists, buffer, corner, bool(large.regions), self.count
        )
        return State(keys, self._counted(state.counters, counted))


class PlanePipeline(BundlePipeline):
    """Candidates by the bounds of Hou et al. 2006 on the camera triangles' planes; all pixels inside are tested.

    bound: "triangle" or "nine_point". With "objects" in `culling`, camera triangles are held against clusters first;
    with "triangles", regions that hold no pixel of the camera triangle are dropped before anything else is done.
    """

    def __init__(self, types: Any, blocks: int, bound: str, **settings: Any):
        super().__init__(types, blocks, **settings)
        self.bound = bound
        self._around = frozen(self._around_pass)
        self._items = frozen(self._item_pass)
        self._item_blocks = frozen(self._item_block_pass)

    def pairs(
        self, task: Task, setups: Rows, levels: list[Rows], canvas: "Canvas", tell: Any
    ) -> Iterator[tuple[Pairs, list[Any]]]:
        """Pairs of a block and an item, in chunks, and the items' rows."""
        types, found_planes, bundle = self.types, task.bundle.planes, task.bundle
        faces = lanes(types, 0, dr.width(found_planes.first))
        target = room(types, 2, dr.width(faces))
        cones = Cones(self._around(faces, bundle.cones, found_planes.first, found_planes.count, target))
        fan = int(dr.max(found_planes.count)[0])
        for found, number in self.met(task, cones, levels, False, tell):
            cull = "triangles" in self.culling
            items = self._items(lanes(types, 0, number), found_planes, task.vertices, task.faces, found, cull)
            many = items.found[0]
            tell("bounds", items)
            start, step = 0, max(1, LANES // fan)
            while start < many:
                step = min(step, many - start)
                lane = lanes(types, start * fan, (start + step) * fan)
                zeros = dr.zeros(types.UInt, self.blocks)
                pairs = self._item_blocks(lane, fan, found_planes, items, bundle.corners, zeros)
                if pairs.found[0] > ROOM and step > 1:
                    step = max(1, step // (1 + pairs.found[0] // ROOM))
                    continue
                yield pairs, items.rows
                start += step

    def _around_pass(self, number: Any, cones: Cones, first: Any, count: Any, target: Rows) -> Rows:
        target.store(joined(self.types, cones, first, count), number)
        return target

    def _item_pass(self, lane: Any, found: Any, vertices: Any, faces: Any, before: Found, cull: bool) -> planes.Items:
        return planes.items(self.types, self.bound, lane, found, vertices, faces, before, cull)

    def _item_block_pass(self, lane: Any, fan: int, found: Any, items: Any, corners: Any, counts: Any) -> Pairs:
        return planes.block_pairs(self.types, lane, fan, found, items, corners, counts)
