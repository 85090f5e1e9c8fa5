"""Nearest triangle of every pixel, by bounding each curved triangle and inverting per pixel; no rays are traced.

One pass over the triangles bounds each image by a rectangle of pixels. Triangles with a small rectangle are finished
there: their lane walks the rectangle, and the nearest wins by an atomic minimum of depth << 32 | triangle. The others
are cut into blocks of 8 x 8 pixels; blocks that one edge excludes are dropped, the rest are binned by block, and each
lane takes four pixels through their block's list with the nearest in registers. The result does not depend on the
order of execution: ties go to the lower number.

The kernels know arrays and functions only: `box` bounds a triangle's image, `test` is `central`, `planar` or
`projected`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels.frozen import frozen
from mpcam_kernels.samples import BLOCK, Samples, blocks, place

SMALL = 48  # pixels in a rectangle that one lane walks by itself
PER_LANE = 4  # pixels of a lane in the pass over blocks: 16 lanes share a block, and gather a triangle for 64 tests
PAIRS = 1 << 18  # triangle-block pairs held at a time; a scene with more is processed in chunks
LANES = 1 << 22  # of those that look for pairs, at a time
EMPTY = 0xFFFFFFFFFFFFFFFF


@dataclass(frozen=True)
class Large:
    """Triangles whose rectangles are cut into blocks: set-up in four numbers a row, rectangles as low | high << 16."""

    rows: list[Any]
    triangle: Any
    columns: Any
    lines: Any
    count: Any


class Pipeline:
    """The kernels of one combination of bound, test and image size; frozen, so that a frame records nothing anew.

    Every array whose length depends on the scene comes in as an argument: a frozen function that makes one itself
    replays the length of the recording.

    box(camera, a, b, c) gives (low, high, valid) in pixels. test: module with setup, hit, may_hit, weights, pack and
    unpack. With count=True each frame also counts tests and covered samples. With exclude=False no block is dropped
    because of an edge, and all pixels of a box are tested.
    """

    def __init__(
        self,
        types: Any,
        box: Callable[..., Any],
        test: Any,
        width: int,
        height: int,
        count: bool = False,
        exclude: bool = True,
    ):
        self.types, self.box, self.test, self.count, self.exclude = types, box, test, count, exclude
        self.width, self.height = width, height
        self.block_columns, self.block_rows = blocks(width, height)
        self.places = self.block_columns * self.block_rows * BLOCK * BLOCK
        self._triangles = frozen(self._triangle_pass)
        self._pairs = frozen(self._pair_pass)
        self._bins = frozen(self._bin_pass)
        self._pixels = frozen(self._pixel_pass)

    def frame(
        self, camera: Any, positions: Any, faces: Any, samples: Samples, done: Callable[[str, Any], None] | None = None
    ) -> tuple[Any, Any]:
        """Depth buffer (UInt64 per place: depth bits << 32 | triangle, EMPTY where nothing is) and counters or None.

        positions: 3 Floats per vertex; faces: 3 UInts per triangle. done(stage, arrays) is told after each pass.
        """
        types = self.types
        counters = dr.zeros(types.UInt64, 2) if self.count else None
        if dr.width(faces) < 3:
            buffer = dr.full(types.UInt64, EMPTY, self.places)
            dr.eval(buffer)
            return buffer, counters
        triangles = self._lanes(0, dr.width(faces) // 3)
        lists = [dr.empty(types.UInt, dr.width(triangles)) for _ in range(3)]
        rows = [dr.empty(types.Float, 4 * dr.width(triangles)) for _ in range(self.test.ROWS)]
        buffer, large, counters = self._triangles(triangles, camera, positions, faces, samples, counters, lists, rows)
        if done:
            done("triangles", (buffer, large))
        # Lanes are a large triangle and a row of blocks each: the pairs of one row always fit.
        total = large.count[0] * self.block_rows
        start, chunk = 0, min(total, LANES)
        while start < total:
            chunk = min(chunk, total - start)
            lanes = self._lanes(start, start + chunk)
            pairs, found, counts = self._pairs(lanes, samples, large)
            needed = found[0]
            if needed > PAIRS and chunk > 1:
                chunk = max(1, chunk // (1 + needed // PAIRS))
                continue
            if needed:
                starts = dr.prefix_sum(counts)
                bins = self._bins(self._lanes(0, needed), pairs, starts, dr.empty(types.UInt, needed))
                if done:
                    done("bins", bins)
                buffer, counters = self._pixels(samples, large, bins, starts, counts, buffer, counters)
                if done:
                    done("pixels", buffer)
            start += chunk
        return buffer, counters

    def _lanes(self, first: int, last: int) -> Any:
        lanes = dr.arange(self.types.UInt, first, last)
        dr.make_opaque(lanes)
        return lanes

    def _triangle_pass(
        self,
        triangle: Any,
        camera: Any,
        positions: Any,
        faces: Any,
        samples: Samples,
        counters: Any,
        lists: list[Any],
        rows: list[Any],
    ) -> tuple[Any, Large, Any]:
        types = self.types
        buffer = dr.full(types.UInt64, EMPTY, self.places)
        dr.make_opaque(buffer)
        corners = dr.gather(types.Array3u, faces, triangle)
        a, b, c = (dr.gather(types.Array3f, positions, corner) for corner in corners)
        shape = self.test.setup(a, b, c)
        low, high, valid = self.box(camera, a, b, c)
        x0, x1 = _pixels(types, low[0], high[0], self.width)
        y0, y1 = _pixels(types, low[1], high[1], self.height)
        seen = valid & shape.usable & (x0 < x1) & (y0 < y1)
        small = seen & ((x1 - x0) * (y1 - y0) <= SMALL)
        counters = self._walk(shape, triangle, (x0, y0, x1, y1), small, samples, buffer, counters)
        large = seen & ~small
        count = dr.zeros(types.UInt, 1)
        slot = dr.scatter_inc(count, types.UInt(0), large)
        for target, value in zip(lists, (triangle, x0 | (x1 << 16), y0 | (y1 << 16)), strict=True):
            dr.scatter(target, types.UInt(value), slot, large)
        for target, row in zip(rows, self.test.pack(types, shape), strict=True):
            dr.scatter(target, row, slot, large)
        return buffer, Large(rows, lists[0], lists[1], lists[2], count), counters

    def _walk(
        self, shape: Any, triangle: Any, rectangle: Any, active: Any, samples: Samples, buffer: Any, counters: Any
    ) -> Any:
        """Test every pixel of a lane's rectangle and keep the nearest; returns the counters."""
        types, (x0, y0, x1, y1) = self.types, rectangle
        identity = types.UInt64(triangle)

        def body(x: Any, y: Any, covered: Any) -> Any:
            pixel = place(types.UInt(x), types.UInt(y), self.width)
            inside, depth = self.test.hit(shape, dr.gather(type(samples.pixels), samples.pixels, pixel))
            inside = inside & (depth < dr.inf)
            packed = _packed(types, depth, identity)
            # Direct: private copies per thread, the default, cost more to clear and merge than the atomics do.
            dr.scatter_reduce(dr.ReduceOp.Min, buffer, packed, pixel, inside, mode=dr.ReduceMode.Direct)
            ended = x + 1 >= x1
            covered = covered + dr.select(inside, 1, 0) if self.count else covered
            return dr.select(ended, x0, x + 1), dr.select(ended, y + 1, y), covered

        start = dr.select(active, y0, y1)
        _, _, covered = dr.while_loop((x0, start, types.UInt(0)), lambda x, y, covered: y < y1, body)
        return self._counted(counters, dr.select(active, types.UInt64((x1 - x0) * (y1 - y0)), 0), covered)

    def _pair_pass(self, lanes: Any, samples: Samples, large: Large) -> tuple[Any, Any, Any]:
        """Blocks that each large triangle may cover: one lane per triangle and row of blocks."""
        types = self.types
        item, row = lanes // self.block_rows, types.Int(lanes % self.block_rows)
        lines = dr.gather(types.UInt, large.lines, item)
        active = (row * BLOCK < types.Int(lines >> 16)) & ((row + 1) * BLOCK > types.Int(lines & 0xFFFF))
        columns = dr.gather(types.UInt, large.columns, item, active)
        shape = self._unpacked(large, item, active)
        first, last = types.Int(columns & 0xFFFF) // BLOCK, (types.Int(columns >> 16) + BLOCK - 1) // BLOCK
        found = dr.zeros(types.UInt, 1)
        counts = dr.zeros(types.UInt, self.block_columns * self.block_rows)
        dr.make_opaque(counts)
        pairs = [dr.empty(types.UInt, PAIRS) for _ in range(3)]

        def body(column: Any) -> Any:
            block = types.UInt(row * self.block_columns + column)
            spread = dr.gather(types.Float, samples.spreads, block)
            centre = dr.gather(type(samples.centres), samples.centres, block)
            keep = (spread >= 0) & (self.test.may_hit(shape, centre, spread) if self.exclude else True)
            slot: Any = dr.scatter_inc(found, types.UInt(0), keep)
            fits = keep & (slot < PAIRS)
            rank = dr.scatter_inc(counts, block, fits)
            for target, value in zip(pairs, (item, block, rank), strict=True):
                dr.scatter(target, value, slot, fits)
            return (column + 1,)

        dr.while_loop((dr.select(active, first, last),), lambda column: column < last, body)
        return pairs, found, counts

    def _bin_pass(self, lanes: Any, pairs: list[Any], starts: Any, bins: Any) -> Any:
        """Large triangles block by block."""
        item, block, rank = (dr.gather(self.types.UInt, values, lanes) for values in pairs)
        dr.scatter(bins, item, dr.gather(self.types.UInt, starts, block) + rank)
        return bins

    def _pixel_pass(
        self, samples: Samples, large: Large, bins: Any, starts: Any, counts: Any, buffer: Any, counters: Any
    ) -> tuple[Any, Any]:
        """Nearest of each pixel's block's list and of what the buffer holds; neighbours go through the same list."""
        types = self.types
        lane = dr.arange(types.UInt, self.places // PER_LANE)
        block = lane // (BLOCK * BLOCK // PER_LANE)
        parts = [dr.gather(types.Array4f, part, lane) for part in samples.pixels]
        views = [type(samples.pixels)(*(part[k] for part in parts)) for k in range(PER_LANE)]
        before = dr.gather(types.Array4u64, buffer, lane)
        start, length = dr.gather(types.UInt, starts, block), dr.gather(types.UInt, counts, block)
        end = start + length

        def body(index: Any, depths: Any, triangles: Any, covered: Any) -> Any:
            item = dr.gather(types.UInt, bins, index)
            shape = self._unpacked(large, item)
            triangle = dr.gather(types.UInt, large.triangle, item)
            nearest, first = [], []
            for view, depth_before, triangle_before in zip(views, depths, triangles, strict=True):
                inside, depth = self.test.hit(shape, view)
                nearer = (depth < depth_before) | ((depth == depth_before) & (triangle < triangle_before))
                nearest.append(dr.select(inside & nearer, depth, depth_before))
                first.append(dr.select(inside & nearer, triangle, triangle_before))
                covered = covered + dr.select(inside & (depth < dr.inf), 1, 0) if self.count else covered
            return index + 1, nearest, first, covered

        # The largest triangle number at an infinite depth stands for nothing: nothing is nearer than it and infinite.
        depths = [dr.fmin(dr.reinterpret_array(types.Float, types.UInt(value >> 32)), dr.inf) for value in before]
        state = (start, depths, [types.UInt(value) for value in before], types.UInt(0))
        found: Any = dr.while_loop(state, lambda index, depths, triangles, covered: index < end, body)
        _, depths, triangles, covered = found
        values = [_packed(types, depth, types.UInt64(t)) for depth, t in zip(depths, triangles, strict=True)]
        values = [dr.select(depth < dr.inf, v, EMPTY) for depth, v in zip(depths, values, strict=True)]
        result = dr.empty(types.UInt64, self.places)
        dr.scatter(result, types.Array4u64(*values), lane)
        return result, self._counted(counters, types.UInt64(length * PER_LANE), covered)

    def _unpacked(self, large: Large, item: Any, active: Any = True) -> Any:
        return self.test.unpack([dr.gather(self.types.Array4f, row, item, active) for row in large.rows])

    def _counted(self, counters: Any, tests: Any, covered: Any) -> Any:
        """The counters with (tests, covered) of all lanes added."""
        if self.count:
            dr.scatter_reduce(dr.ReduceOp.Add, counters, tests, self.types.UInt(0))
            dr.scatter_reduce(dr.ReduceOp.Add, counters, self.types.UInt64(covered), self.types.UInt(1))
        return counters


def _packed(types: Any, depth: Any, triangle: Any) -> Any:
    """Depth and triangle in one number, which orders by depth, then by triangle."""
    return (types.UInt64(dr.reinterpret_array(types.UInt, depth)) << 32) | triangle


def _pixels(types: Any, low: Any, high: Any, size: int) -> tuple[Any, Any]:
    """First and one past the last pixel whose centre lies in [low, high], widened by what rounding can amount to."""
    slack = 2e-6 * size + 1e-3
    first = dr.ceil(dr.maximum(low - (0.5 + slack), 0.0))
    last = dr.floor(dr.minimum(high + (0.5 + slack), float(size)))
    return types.Int(dr.minimum(first, float(size))), types.Int(dr.maximum(last, 0.0))
