"""Nearest triangle of every pixel for rays that need no common centre: candidates by a hierarchy, then exact per pixel.

Balls around the triangles and clusters of them meet cones around groups and blocks of rays. What is left are pairs of a
block and a triangle; edges exclude parts of the block. Triangles that may cover few places are finished at once, a lane
each; the others go through lists. Nothing is kept from frame to frame but the order of the triangles, so scenes move
freely.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels import blocks, cover, pixels, planes, skew
from mpcam_kernels.blocks import Large, Lists
from mpcam_kernels.candidates import CULLING, LANES, Candidates, Task, Tell
from mpcam_kernels.frozen import frozen
from mpcam_kernels.lanes import lanes
from mpcam_kernels.outputs import OUTPUTS
from mpcam_kernels.rows import Rows
from mpcam_kernels.samples import PIXELS, of_block

ROOM = 1 << 20  # pairs of a block and a triangle at a time
MANY = 1024  # triangles, from which on some may be small


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

    output: "hits", "depth" or "coverage". count: also count tests and hits. culling: see `Candidates`.
    """

    def __init__(
        self, types: Any, blocks: int, *, output: str = "hits", count: bool = False, culling: tuple[str, ...] = CULLING
    ):
        self.types, self.blocks = types, blocks
        self.output, self.count = OUTPUTS[output], count
        self.candidates = Candidates(types, culling)
        self._cover = frozen(self._cover_pass)
        self._walk = frozen(self._walk_pass)
        self._pixels = frozen(self._pixel_pass)

    def frame(self, task: Task, done: Tell | None = None) -> tuple[Any, Any]:
        """Keys of all places (see `outputs`), and counters (tests, hits) or None.

        done(stage, arrays) is told after each pass.
        """
        types, tell = self.types, done or (lambda stage, arrays: None)
        canvas = Canvas(State(None, dr.zeros(types.UInt64, 2) if self.count else None))
        if task.counts[0]:
            setups, levels = self.candidates.triangles(task)
            tell("triangles", (setups, levels))
            everywhere = lanes(types, 0, self.blocks * PIXELS // pixels.PER_LANE)
            bundle = task.bundle
            for lists, rows in self.lists(task, setups, levels, canvas, tell):
                tell("lists", lists)
                large = Large(rows, setups, None)
                canvas.state = self._pixels(everywhere, bundle.pixels, bundle.corners, large, lists, canvas.state)
                tell("pixels", canvas.state)
        buffer = self._blank() if canvas.state.buffer is None else canvas.state.buffer
        return buffer, canvas.state.counters

    def lists(
        self, task: Task, setups: Rows, levels: list[Rows], canvas: Canvas, tell: Tell
    ) -> Iterator[tuple[Lists, list[Any]]]:
        """Lists of triangles by block, for some at a time, and what rows of regions they name (none here).

        Small triangles go onto the canvas at once.
        """
        types, bundle, walking = self.types, task.bundle, task.counts[0] > MANY
        for found, number in self.candidates.met(task.counts, bundle.groups, levels, tell, (bundle, task.fan)):
            for start in range(0, number, ROOM):
                lane = lanes(types, start, min(number, start + ROOM))
                empty = blocks.room(types, dr.width(lane), self.blocks)
                small, lists = self._cover(lane, bundle.slopes, setups, found, walking, ROOM, empty)
                few = dr.compress(small) if walking else types.UInt()
                if dr.width(few):
                    canvas.state = self._walk(few, lane, bundle.pixels, bundle.slopes, setups, found, canvas.state)
                    tell("small", canvas.state)
                yield lists, []

    def _blank(self) -> Any:
        """Keys of places where nothing is hit."""
        buffer = dr.zeros(self.output.kind(self.types), self.blocks * PIXELS)
        dr.make_opaque(buffer)
        return buffer

    def _cover_pass(
        self, lane: Any, slopes: Rows, setups: Rows, pairs: Any, walking: bool, room: int, lists: Lists
    ) -> tuple[Any, Lists]:
        return cover.covered(self.types, skew, lane, slopes, setups, pairs, walking, room, lists)

    def _walk_pass(
        self, chosen: Any, lane: Any, rays: Any, slopes: Rows, setups: Rows, pairs: Any, state: State
    ) -> State:
        buffer = self._blank() if state.buffer is None else state.buffer
        number = dr.gather(self.types.UInt, lane, chosen)
        counted = cover.walk_small(
            self.types, skew, self.output, number, rays, slopes, setups, pairs, buffer, self.count
        )
        return State(buffer, self._counted(state.counters, counted))

    def _pixel_pass(self, lane: Any, rays: Any, corners: Any, large: Large, lists: Lists, state: State) -> State:
        buffer = self.blocks * PIXELS if state.buffer is None else state.buffer

        def corner(place: Any) -> tuple[Any, Any]:
            """Column and row of places within their camera triangle."""
            x, y = (dr.gather(self.types.UInt, values, place // PIXELS) for values in corners)
            column, row = of_block(place)
            return x + column, y + row

        keys, *counted = pixels.through_lists(
            self.types, skew, self.output, lane, rays, large, lists, buffer, corner, bool(large.regions), self.count
        )
        return State(keys, self._counted(state.counters, counted))

    def _counted(self, counters: Any, counted: Any) -> Any:
        """The counters with tests and hits of all lanes added."""
        if self.count:
            for slot, value in enumerate(counted):
                dr.scatter_reduce(dr.ReduceOp.Add, counters, self.types.UInt64(value), self.types.UInt(slot))
        return counters


class PlanePipeline(BundlePipeline):
    """Candidates by the bounds of Hou et al. 2006 on the camera triangles' planes; all pixels inside are tested.

    bound: "triangle" or "nine_point". With "objects" in `culling`, camera triangles are held against clusters first;
    with "triangles", regions that hold no pixel of the camera triangle are dropped before anything else is done.
    """

    def __init__(self, types: Any, blocks: int, bound: str, **settings: Any):
        super().__init__(types, blocks, **settings)
        self.bound = bound
        self._items = frozen(self._item_pass)
        self._chosen = frozen(self._chosen_pass)
        self._reached = frozen(self._reached_pass)

    def lists(
        self, task: Task, setups: Rows, levels: list[Rows], canvas: Canvas, tell: Tell
    ) -> Iterator[tuple[Lists, list[Any]]]:
        """Lists of items by block, for some at a time, and the items' rows."""
        types, found_planes, bundle = self.types, task.bundle.planes, task.bundle
        fan, cull = found_planes.fan, "triangles" in self.candidates.culling
        most, step = LANES // fan * fan, min(ROOM, (1 << 32) // fan)  # lanes are numbered with 32 bits
        for found, number in self.candidates.met(task.counts, found_planes.cones, levels, tell):
            # Regions are large, so few at a time.
            for start in range(0, number, step):
                lane = lanes(types, start, min(number, start + step))
                rows, some = self._items(lane, found_planes, task.vertices, task.faces, found, cull)
                chosen = dr.compress(some)
                tell("bounds", chosen)
                many = dr.width(chosen)
                if not many:
                    continue
                targets = [dr.empty(types.Float, 4 * many) for _ in rows]
                items = self._chosen(lanes(types, 0, many), chosen, lane, rows, found, targets)
                for first in range(0, many * fan, most):
                    lane = lanes(types, first, min(many * fan, first + most))
                    empty = blocks.room(types, dr.width(lane), self.blocks)
                    yield self._reached(lane, fan, most, found_planes, items, bundle.corners, empty), items.rows

    def _item_pass(self, lane: Any, found: Any, vertices: Any, faces: Any, pairs: Any, cull: bool) -> Any:
        return planes.items(self.types, self.bound, lane, found, vertices, faces, pairs, cull)

    def _chosen_pass(
        self, item: Any, chosen: Any, lane: Any, rows: list[Any], pairs: Any, targets: list[Any]
    ) -> planes.Items:
        face, _ = pairs.at(dr.gather(self.types.UInt, lane, chosen))
        for target, row in zip(targets, rows, strict=True):
            dr.scatter(target, dr.gather(self.types.Array4f, row, chosen), item)
        return planes.Items(targets, face)

    def _reached_pass(
        self, lane: Any, fan: int, most: int, found: Any, items: Any, corners: Any, lists: Lists
    ) -> Lists:
        item, block, bits = planes.reached(self.types, lane, fan, found, items, corners)
        lists.add(self.types, lane % most, block, item, bits, bits != 0)
        return lists
