"""Nearest triangle of every pixel from the pixels' own rays: candidates by a hierarchy, then exact per pixel.

Balls around clusters of triangles, and around the triangles, meet cones around groups of blocks. Each pair of a group
and a triangle is one thread, which marks the blocks of the group that no edge excludes. What is left are pairs of a
block and a triangle; there edges exclude parts of the block. Where triangles are many and small, those that may cover
few pixels are finished at once, a thread each; the others go through lists. Nothing is kept from frame to frame but the
order of the triangles, so scenes move freely.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import blocks, central_rays, cover, general_rays, hierarchy, pixels, ray_pieces
from mpcam_kernels.blocks import Large, Lists
from mpcam_kernels.candidates import CULLING, Candidates, Tell
from mpcam_kernels.frozen import frozen
from mpcam_kernels.hierarchy import Pairs
from mpcam_kernels.outputs import OUTPUTS
from mpcam_kernels.poses import placed
from mpcam_kernels.ray_blocks import GROUP, RayBlocks, blocks_covered
from mpcam_kernels.rows import Rows, room
from mpcam_kernels.samples import PIXELS, of_block
from mpcam_kernels.threads import threads

ROOM = 1 << 20  # pairs of a block and a triangle at a time
SPLIT = 1 << 19  # pairs of a group and a triangle at a time; each becomes at most GROUP pairs, 8 bytes each
PIXELS_PER_TRIANGLE = 16  # where there are fewer, and lists would be long, a thread each finishes small triangles
LONG_LIST = 16  # triangles of a block, on average
RAYS = {"central": central_rays, "general": general_rays, "bent": ray_pieces}


@dataclass(frozen=True)
class Task:
    """What is drawn. vertices: 3 numbers each; faces: 3 UInts per triangle, neighbors close together; names: the
    triangles' own numbers; counts: triangles, then clusters level by level; pose: twelve numbers that bring vertices to
    the frame of the rays; rays: the blocks.
    """

    vertices: Any
    faces: Any
    names: Any
    counts: tuple[int, ...]
    pose: list[Any]
    rays: RayBlocks


@dataclass(frozen=True)
class State:
    """Keys of all slots so far, None while nothing was drawn; tests and hits so far, or None."""

    buffer: Any
    counters: Any


class Canvas:
    """Holds the state while pairs are drawn that come in chunks."""

    def __init__(self, state: State):
        self.state = state


class BlockPipeline:
    """The kernels of one output for so many blocks; frozen.

    rays: "central", "general" or "bent", what the blocks hold. output: "hits", "depth" or "coverage". cull: "none", or
    "back" or "front", the side of triangles that is not shown. count: also count tests and hits. culling: see
    `Candidates`.
    """

    def __init__(
        self,
        types: Any,
        blocks: int,
        rays: str,
        *,
        output: str = "hits",
        cull: str = "none",
        count: bool = False,
        culling: tuple[str, ...] = CULLING,
    ):
        self.types, self.blocks, self.test = types, blocks, RAYS[rays].test
        if cull != "none":
            self.test = self.test.OneSided(cull)
        self.output, self.count = OUTPUTS[output], count
        self.candidates = Candidates(types, culling)
        self._set_up = frozen(self._set_up_pass)
        self._split = frozen(self._split_pass)
        self._write_blocks = frozen(self._write_blocks_pass)
        self._cover = frozen(self._cover_pass)
        self._walk = frozen(self._walk_pass)
        self._pixels = frozen(self._pixel_pass)

    def frame(self, task: Task, done: Tell | None = None) -> tuple[Any, Any]:
        """Keys of all slots (see `outputs`), and counters (tests, hits) or None.

        done(stage, arrays) is told after each pass.
        """
        types, tell = self.types, done or (lambda stage, arrays: None)
        canvas = Canvas(State(None, dr.zeros(types.UInt64, 2) if self.count else None))
        if task.counts[0]:
            setups, levels = self.triangles(task)
            tell("triangles", (setups, levels))
            rays = task.rays
            for lists, rows in self.lists(task, setups, levels, canvas, tell):
                tell("lists", lists)
                large = Large(rows, setups, None)
                canvas.state = self._pixels(rays.runs, rays.rays, rays.corners, large, lists, canvas.state)
                tell("pixels", canvas.state)
        buffer = self._blank() if canvas.state.buffer is None else canvas.state.buffer
        return buffer, canvas.state.counters

    def triangles(self, task: Task) -> tuple[Rows, list[Rows]]:
        """Set-ups of the triangles, and the balls around them and, level by level, around clusters."""
        types, count = self.types, task.counts[0]
        targets = room(types, self.test.ROWS, count), room(types, 1, count)
        setups, balls = self._set_up(
            threads(types, 0, count), task.vertices, task.faces, task.names, task.pose, targets
        )
        return setups, self.candidates.levels(balls, task.counts)

    def lists(
        self, task: Task, setups: Rows, levels: list[Rows], canvas: Canvas, tell: Tell
    ) -> Iterator[tuple[Lists, list[Any]]]:
        """Lists of triangles by block, for some at a time, and what rows of regions they name (none here).

        Small triangles go onto the canvas at once.
        """
        types, rays = self.types, task.rays
        tiny = task.counts[0] * PIXELS_PER_TRIANGLE > self.blocks * PIXELS
        for pairs, number in self.pairs(task, setups, levels, tell):
            walking = tiny and number > LONG_LIST * self.blocks
            for start in range(0, number, ROOM):
                thread = threads(types, start, min(number, start + ROOM))
                empty = blocks.room(types, dr.width(thread), self.blocks)
                small, lists = self._cover(thread, rays, setups, pairs, walking, ROOM, empty)
                few = dr.compress(small) if walking else types.UInt()
                if dr.width(few):
                    canvas.state = self._walk(few, thread, rays.rays, rays.slopes, setups, pairs, canvas.state)
                    tell("small", canvas.state)
                yield lists, []

    def pairs(self, task: Task, setups: Rows, levels: list[Rows], tell: Tell) -> Iterator[tuple[Pairs, int]]:
        """Pairs of a block and a triangle, in chunks, and how many there are."""
        rays = task.rays
        cull = "triangles" in self.candidates.culling
        for groups, number in self.candidates.met(task.counts, rays.group_cones, levels, tell):
            for start in range(0, number, SPLIT):
                thread = threads(self.types, start, min(number, start + SPLIT))
                masks, each = self._split(thread, rays, setups, levels[0], groups, cull)
                yield from self.candidates.written(thread, groups, masks, each, tell, self._write_blocks, rays.numbers)

    def _blank(self) -> Any:
        """Keys of slots where nothing is hit."""
        buffer = dr.zeros(self.output.kind(self.types), self.blocks * PIXELS)
        dr.make_opaque(buffer)
        return buffer

    def _set_up_pass(self, triangle: Any, vertices: Any, faces: Any, names: Any, pose: Any, targets: Any) -> Any:
        types = self.types
        corners = dr.gather(types.Array3u, faces, triangle)
        a, b, c = (placed(types, pose, dr.gather(types.Array3f, vertices, corner)) for corner in corners)
        shape = self.test.setup(a, b, c)
        setups, balls = targets
        setups.store(self.test.pack(types, shape, dr.gather(types.UInt, names, triangle)), triangle)
        balls.store([hierarchy.triangle_balls(types, (a, b, c), shape.usable)], triangle)
        return targets

    def _split_pass(
        self, thread: Any, rays: RayBlocks, setups: Rows, balls: Rows, groups: Any, cull: bool
    ) -> tuple[Any, Any]:
        """Which blocks of the groups of pairs the triangles may cover, as masks, and how many."""
        types = self.types
        group, triangle = groups.at(thread)
        mask = dr.gather(types.UInt, rays.exist, group)
        if cull:
            shape = self.test.unpack(setups.at(types, triangle))
            mask &= blocks_covered(types, shape, rays.group_slopes, group)
            (ball,) = balls.at(types, triangle)

            def body(left: Any, kept: Any) -> tuple[Any, Any]:
                block = dr.gather(types.UInt, rays.numbers, group * GROUP + dr.tzcnt(left))
                met = rays.cones(types, block).may_meet(ball)
                return left & (left - 1), kept | dr.select(met, left & (~left + 1), 0)

            _, mask = dr.while_loop((mask, types.UInt(0)), lambda left, kept: left != 0, body)
        return mask, dr.popcnt(mask)

    def _write_blocks_pass(
        self, thread: Any, groups: Any, masks: Any, ends: Any, targets: Pairs, numbers: Any
    ) -> Pairs:
        group, triangle = groups.at(thread)

        def pair(place: Any) -> tuple[Any, Any]:
            return dr.gather(self.types.UInt, numbers, group * GROUP + place), triangle

        hierarchy.write_pairs(pair, masks, ends - dr.popcnt(masks), targets)
        return targets

    def _cover_pass(
        self, thread: Any, rays: RayBlocks, setups: Rows, pairs: Any, walking: bool, room: int, lists: Lists
    ) -> tuple[Any, Lists]:
        return cover.covered(self.types, self.test, thread, rays, setups, pairs, walking, room, lists)

    def _walk_pass(
        self, chosen: Any, thread: Any, rays: Any, slopes: Any, setups: Rows, pairs: Any, state: State
    ) -> State:
        buffer = self._blank() if state.buffer is None else state.buffer
        number = dr.gather(self.types.UInt, thread, chosen)
        counted = cover.walk_small(
            self.types, self.test, self.output, number, rays, slopes, setups, pairs, buffer, self.count
        )
        return State(buffer, self._counted(state.counters, counted))

    def _pixel_pass(self, thread: Any, rays: Any, corners: Any, large: Large, lists: Lists, state: State) -> State:
        buffer = self.blocks * PIXELS if state.buffer is None else state.buffer

        def corner(slot: Any) -> tuple[Any, Any]:
            """Column and row of slots within their camera triangle."""
            x, y = (dr.gather(self.types.UInt, values, slot // PIXELS) for values in corners)
            column, row = of_block(slot)
            return x + column, y + row

        keys, *counted = pixels.through_lists(
            self.types,
            self.test,
            self.output,
            thread,
            rays,
            large,
            lists,
            buffer,
            corner,
            bool(large.regions),
            self.count,
        )
        return State(keys, self._counted(state.counters, counted))

    def _counted(self, counters: Any, counted: Any) -> Any:
        """The counters with tests and hits of all threads added."""
        if self.count:
            for number, value in enumerate(counted):
                dr.scatter_reduce(dr.ReduceOp.Add, counters, self.types.UInt64(value), self.types.UInt(number))
        return counters
