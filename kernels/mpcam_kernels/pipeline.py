"""Nearest triangle of every pixel, by bounding each curved triangle and inverting per pixel; no rays are traced.

One pass over the triangles outlines each image by a box and three lines. Triangles with few pixels inside are finished
there: their thread walks the spans between the lines. The others are listed by block of 16 x 8 pixels, with the parts
of 4 x 4 that they may cover; blocks and parts outside of the lines, and those that one edge excludes, are dropped. Then
each thread takes eight pixels through their block's list with the nearest in registers. The result does not depend on
the order of execution.

The kernels know arrays and functions only: `outline` bounds a triangle's image, `test` is `ray_triangle`,
`pixel_triangle` or `screen_triangle`, `output` says what is kept of a pixel.
"""

from collections.abc import Callable
from typing import Any

import drjit as dr

from mpcam_kernels import blocks, pixels, walk
from mpcam_kernels.frozen import frozen
from mpcam_kernels.outputs import OUTPUTS
from mpcam_kernels.regions import PixelOutline, region
from mpcam_kernels.samples import COARSE, PIXELS, Samples, pixel_of, slot_of
from mpcam_kernels.samples import blocks as blocks_of
from mpcam_kernels.threads import threads

SMALL = 96  # pixels in a region that one thread walks by itself
# Pairs of an item and a block held at a time, or PER_BLOCK for each block if these are more; the rest comes in chunks.
PAIRS = 1 << 18
PER_BLOCK = 4
THREADS = 1 << 22  # of those that look for pairs, at a time


class Pipeline:
    """The kernels of one combination of outline, test, output and image size; frozen: a frame records nothing anew.

    Every array whose length depends on the scene comes in as an argument: a frozen function that makes one itself
    replays the length of the recording.

    outline(camera, rows) gives the `PixelOutline`s of triangles, of which rows[corner][row] holds four numbers each;
    the first three of a corner's first row are its position. hidden(first) tells from the first rows where triangles
    are surely not seen. test: module with corner, setup, hit, inside, may_hit, pack and unpack. output: "hits", "depth"
    or "coverage". cull: "none", or "back" or "front" to leave out triangles that turn this side to the eye. bounded:
    test all pixels inside of the outlines and none outside, as papers count them; else, edges drop parts of blocks
    too. pieces: most outlines of a triangle. count: each frame also counts tests and hits. small: most pixels of a box
    that one thread walks.
    """

    def __init__(
        self,
        types: Any,
        outline: Callable[..., list[PixelOutline]],
        hidden: Callable[..., Any],
        test: Any,
        size: tuple[int, int],
        *,
        output: str = "hits",
        cull: str = "none",
        bounded: bool = False,
        pieces: int = 1,
        count: bool = False,
        small: int = SMALL,
    ):
        self.types, self.outline, self.hidden = types, outline, hidden
        self.test, self.output = test, OUTPUTS[output]
        self.width, self.height = size
        self.cull, self.bounded, self.pieces, self.count, self.small = cull, bounded, pieces, count, small
        self.columns, self.rows = blocks_of(*size)
        self.pairs = min(max(PAIRS, PER_BLOCK * self.columns * self.rows), blocks.MOST)
        self._triangles = frozen(self._triangle_pass)
        self.squares = (-(-self.width // COARSE), -(-self.height // COARSE))
        self._find = frozen(self._find_pass)
        self._list = frozen(self._list_pass)
        self._pixels = frozen(self._pixel_pass)

    def thaw(self) -> None:
        """Record every frame anew, to see what freezing is worth."""
        self._triangles, self._find = self._triangle_pass, self._find_pass
        self._list, self._pixels = self._list_pass, self._pixel_pass

    @property
    def slots(self) -> int:
        """Slots of the buffer."""
        return self.columns * self.rows * PIXELS

    def frame(
        self,
        camera: Any,
        vertices: list[Any],
        faces: Any,
        samples: Samples,
        done: Callable[[str, Any], None] | None = None,
    ) -> tuple[Any, Any]:
        """Keys of all slots (see `outputs`), and counters (tests, hits) or None.

        vertices: arrays of four numbers per vertex; faces: 3 UInts per triangle. done(stage, arrays) is told after
        each pass.
        """
        types = self.types
        counters = dr.zeros(types.UInt64, 2) if self.count else None
        if dr.width(faces) < 3:
            buffer = dr.zeros(self.output.kind(types), self.slots)
            dr.eval(buffer)
            return buffer, counters
        triangles = threads(types, 0, dr.width(faces) // 3)
        numbers = 4 * dr.width(triangles)
        rows = [
            [dr.empty(types.Float, numbers * self.pieces) for _ in range(3)],
            [dr.empty(types.Float, numbers) for _ in range(self.test.ROWS)],
        ]
        buffer, large, counters = self._triangles(triangles, camera, vertices, faces, samples, counters, rows)
        if done:
            done("triangles", (buffer, large))
        items = large.count[0]
        per_item = blocks.share(items, *self.squares, self.pairs // blocks.BLOCKS)
        total = items * per_item
        start, chunk = 0, min(total, THREADS)
        while start < total:
            chunk = min(chunk, total - start)
            squares = self._find(threads(types, start, start + chunk), per_item, samples, large)
            needed = squares.found[0] * blocks.BLOCKS
            if needed > self.pairs and chunk > 1:
                chunk = max(1, chunk // (1 + needed // self.pairs))
                continue
            if needed:
                candidates = threads(types, 0, needed)
                room = blocks.room(types, needed, self.columns * self.rows)
                lists = self._list(candidates, samples, large, squares, room)
                if done:
                    done("lists", lists)
                everywhere = threads(types, 0, self.slots // pixels.PER_THREAD)
                buffer, counters = self._pixels(everywhere, samples, large, lists, buffer, counters)
                if done:
                    done("pixels", buffer)
            start += chunk
        return buffer, counters

    def _triangle_pass(
        self,
        triangle: Any,
        camera: Any,
        vertices: list[Any],
        faces: Any,
        samples: Samples,
        counters: Any,
        rows: list[list[Any]],
    ) -> tuple[Any, blocks.Large, Any]:
        types, test = self.types, self.test
        buffer = dr.zeros(self.output.kind(types), self.slots)
        dr.make_opaque(buffer)
        large = blocks.Large(rows[0], rows[1], dr.zeros(types.UInt, 1))
        corners = dr.gather(types.Array3u, faces, triangle)
        first = [dr.gather(types.Array4f, vertices[0], corner) for corner in corners]
        points = [test.corner(row) for row in first]
        shown = ~self.hidden(first)
        if self.cull != "none":
            turn = test.turn(*points)
            shown = shown & ((turn < 0) if self.cull == "back" else (turn > 0))

        def outlined(tests: Any, hits: Any) -> tuple[Any, Any]:
            given = [
                [row, *(dr.gather(types.Array4f, r, n) for r in vertices[1:])]
                for row, n in zip(first, corners, strict=True)
            ]
            for outline in self.outline(camera, given):
                area, seen = region(types, outline, self.width, self.height)

                def covered(tests: Any, hits: Any, area: Any = area, seen: Any = seen) -> tuple[Any, Any]:
                    shape = test.setup(*points)
                    usable = seen & shape.usable
                    small = usable & (area.pixels <= self.small)
                    more = walk.walk(
                        types, test, self.output, shape, triangle, area, small, samples, self._place, buffer, self.count
                    )
                    blocks.append(types, test, area, shape, triangle, usable & ~small, large)
                    return tests + more[0], hits + more[1]

                tests, hits = dr.if_stmt((tests, hits), seen, covered, lambda tests, hits: (tests, hits))
            return tests, hits

        none = (types.UInt(0), types.UInt(0))
        counted = dr.if_stmt(none, shown, outlined, lambda tests, hits: (tests, hits))
        return buffer, large, self._counted(counters, *counted)

    def _place(self, x: Any, y: Any) -> Any:
        return slot_of(x, y, self.width)

    def _find_pass(self, threads: Any, per_item: int, samples: Samples, large: blocks.Large) -> blocks.Squares:
        most = self.pairs // blocks.BLOCKS
        return blocks.find_squares(self.types, self._picker, threads, per_item, samples, large, self.squares[0], most)

    def _list_pass(
        self, threads: Any, samples: Samples, large: blocks.Large, squares: blocks.Squares, lists: blocks.Lists
    ) -> blocks.Lists:
        grid = (self.columns, self.rows)
        return blocks.list_blocks(self.types, self._picker, threads, samples, large, grid, squares, lists, self.bounded)

    @property
    def _picker(self) -> Any:
        return _Everything(self.test) if self.bounded else self.test

    def _pixel_pass(
        self, thread: Any, samples: Samples, large: blocks.Large, lists: blocks.Lists, buffer: Any, counters: Any
    ) -> tuple[Any, Any]:
        def corner(slot: Any) -> tuple[Any, Any]:
            return pixel_of(self.types, slot, self.width, self.height)[:2]

        keys, *counted = pixels.through_lists(
            self.types, self.test, self.output, thread, samples, large, lists, buffer, corner, self.bounded, self.count
        )
        return keys, self._counted(counters, *counted)

    def _counted(self, counters: Any, tests: Any, hits: Any) -> Any:
        """The counters with tests and hits of all threads added."""
        if self.count:
            for slot, value in enumerate((tests, hits)):
                dr.scatter_reduce(dr.ReduceOp.Add, counters, self.types.UInt64(value), self.types.UInt(slot))
        return counters


class _Everything:
    """A test that no edge excludes a block from."""

    def __init__(self, test: Any):
        self.unpack = test.unpack

    def may_hit(self, shape: Any, *bounds: Any) -> Any:
        return True
