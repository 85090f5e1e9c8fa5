"""Nearest triangle of every pixel, by bounding each curved triangle and inverting per pixel; no rays are traced.

One pass over the triangles bounds each image by a rectangle of pixels. Triangles with a small rectangle are finished
there: their lane walks the rectangle. The others are cut into blocks of 8 x 8 pixels; blocks that one edge excludes are
dropped, and a lane walks each block that is left. Nearest wins by an atomic minimum of depth << 32 | triangle, so the
result does not depend on the order of execution, and ties go to the lower number.

The kernels know arrays and functions only: `box` bounds a triangle's image, `test` is `central` or `planar`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr

from mpcam_kernels.frozen import frozen

BLOCK = 8
SMALL = 96  # pixels in a rectangle that one lane walks by itself
PAIRS = 1 << 18  # triangle-block pairs held at a time; a scene with more is processed in chunks
EMPTY = 0xFFFFFFFFFFFFFFFF


@dataclass(frozen=True)
class Samples:
    """One sample per pixel (ray directions or pixel centres), and per block its centre and the spread around it.

    spread is negative for blocks without a valid pixel.
    """

    pixels: Any
    centres: Any
    spreads: Any


@dataclass(frozen=True)
class Large:
    """Triangles whose rectangles are cut into blocks; rectangles as low | high << 16."""

    triangle: Any
    columns: Any
    rows: Any
    count: Any


class Pipeline:
    """The kernels of one combination of bound, test and image size; frozen, so that a frame records nothing anew.

    Every array whose length depends on the scene comes in as an argument: a frozen function that makes one itself
    replays the length of the recording.

    box(camera, a, b, c) gives (low, high, valid) in pixels. test: module with setup, hit, may_hit, weights. With
    count=True each frame also counts tests and covered samples.
    """

    def __init__(self, types: Any, box: Callable[..., Any], test: Any, width: int, height: int, count: bool = False):
        self.types, self.box, self.test, self.count = types, box, test, count
        self.width, self.height = width, height
        self.block_columns, self.block_rows = -(-width // BLOCK), -(-height // BLOCK)
        self._triangles = frozen(self._triangle_pass)
        self._pairs = frozen(self._pair_pass)
        self._blocks = frozen(self._block_pass)

    def frame(
        self, camera: Any, positions: Any, faces: Any, samples: Samples, done: Callable[[str, Any], None] | None = None
    ) -> tuple[Any, Any]:
        """Depth buffer (UInt64 per pixel: depth bits << 32 | triangle, EMPTY where nothing is) and counters or None.

        positions: 3 Floats per vertex; faces: 3 UInts per triangle. done(stage, arrays) is told after each pass.
        """
        types = self.types
        counters = dr.zeros(types.UInt64, 2) if self.count else None
        buffer = dr.full(types.UInt64, EMPTY, self.width * self.height)
        if dr.width(faces) < 3:
            dr.eval(buffer)
            return buffer, counters
        triangles = dr.arange(types.UInt, dr.width(faces) // 3)
        dr.make_opaque(buffer, triangles)
        lists = [dr.empty(types.UInt, dr.width(triangles)) for _ in range(3)]
        buffer, large, counters = self._triangles(triangles, camera, positions, faces, samples, buffer, counters, lists)
        if done:
            done("triangles", (buffer, large))
        total = large.count[0]
        start, chunk = 0, total
        while start < total:
            chunk = min(chunk, total - start)
            lanes = dr.arange(types.UInt, start * self.block_rows, (start + chunk) * self.block_rows)
            dr.make_opaque(lanes)
            pairs = [dr.empty(types.UInt, PAIRS) for _ in range(2)]
            pairs, found = self._pairs(lanes, positions, faces, samples, large, pairs)
            if done:
                done("bounds", (pairs, found))
            needed = found[0]
            if needed > PAIRS and chunk > 1:
                chunk = max(1, chunk // (1 + needed // PAIRS))
                continue
            if needed:
                lanes = dr.arange(types.UInt, needed)
                dr.make_opaque(lanes)
                buffer, counters = self._blocks(lanes, pairs, positions, faces, samples, large, buffer, counters)
                if done:
                    done("blocks", buffer)
            start += chunk
        return buffer, counters

    def _corners(self, positions: Any, faces: Any, triangle: Any, active: Any = True) -> list[Any]:
        types = self.types
        corners = dr.gather(types.Array3u, faces, triangle, active)
        return [dr.gather(types.Array3f, positions, corner, active) for corner in corners]

    def _triangle_pass(
        self,
        triangle: Any,
        camera: Any,
        positions: Any,
        faces: Any,
        samples: Samples,
        buffer: Any,
        counters: Any,
        lists: list[Any],
    ) -> tuple[Any, Large, Any]:
        types = self.types
        a, b, c = self._corners(positions, faces, triangle)
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
        return buffer, Large(lists[0], lists[1], lists[2], count), counters

    def _pair_pass(
        self, lanes: Any, positions: Any, faces: Any, samples: Samples, large: Large, pairs: list[Any]
    ) -> tuple[Any, Any]:
        """Blocks that each large triangle may cover: one lane per triangle and row of blocks."""
        types = self.types
        item, row = lanes // self.block_rows, types.Int(lanes % self.block_rows)
        columns, rows = dr.gather(types.UInt, large.columns, item), dr.gather(types.UInt, large.rows, item)
        y0, y1 = types.Int(rows & 0xFFFF), types.Int(rows >> 16)
        active = (row * BLOCK < y1) & ((row + 1) * BLOCK > y0)
        triangle = dr.gather(types.UInt, large.triangle, item, active)
        shape = self.test.setup(*self._corners(positions, faces, triangle, active))
        first, last = types.Int(columns & 0xFFFF) // BLOCK, (types.Int(columns >> 16) + BLOCK - 1) // BLOCK
        found = dr.zeros(types.UInt, 1)

        def body(column: Any) -> Any:
            block = types.UInt(row * self.block_columns + column)
            spread = dr.gather(types.Float, samples.spreads, block)
            centre = dr.gather(type(samples.centres), samples.centres, block)
            keep = (spread >= 0) & self.test.may_hit(shape, centre, spread)
            slot: Any = dr.scatter_inc(found, types.UInt(0), keep)
            fits = keep & (slot < PAIRS)
            dr.scatter(pairs[0], item, slot, fits)
            dr.scatter(pairs[1], block, slot, fits)
            return (column + 1,)

        dr.while_loop((dr.select(active, first, last),), lambda column: column < last, body)
        return pairs, found

    def _block_pass(
        self,
        lanes: Any,
        pairs: Any,
        positions: Any,
        faces: Any,
        samples: Samples,
        large: Large,
        buffer: Any,
        counters: Any,
    ) -> tuple[Any, Any]:
        types = self.types
        item, block = dr.gather(types.UInt, pairs[0], lanes), dr.gather(types.UInt, pairs[1], lanes)
        triangle = dr.gather(types.UInt, large.triangle, item)
        columns, rows = dr.gather(types.UInt, large.columns, item), dr.gather(types.UInt, large.rows, item)
        left, top = types.Int(block % self.block_columns) * BLOCK, types.Int(block // self.block_columns) * BLOCK
        x0, x1 = dr.maximum(left, types.Int(columns & 0xFFFF)), dr.minimum(left + BLOCK, types.Int(columns >> 16))
        y0, y1 = dr.maximum(top, types.Int(rows & 0xFFFF)), dr.minimum(top + BLOCK, types.Int(rows >> 16))
        shape = self.test.setup(*self._corners(positions, faces, triangle))
        counters = self._walk(shape, triangle, (x0, y0, x1, y1), True, samples, buffer, counters)
        return buffer, counters

    def _walk(
        self, shape: Any, triangle: Any, rectangle: Any, active: Any, samples: Samples, buffer: Any, counters: Any
    ) -> Any:
        """Test every pixel of a lane's rectangle and keep the nearest; returns the counters."""
        types, (x0, y0, x1, y1) = self.types, rectangle
        identity = types.UInt64(triangle)

        def body(x: Any, y: Any, covered: Any) -> Any:
            pixel = types.UInt(y * self.width + x)
            inside, depth = self.test.hit(shape, dr.gather(type(samples.pixels), samples.pixels, pixel))
            inside = inside & (depth < dr.inf)
            packed = (types.UInt64(dr.reinterpret_array(types.UInt, depth)) << 32) | identity
            dr.scatter_reduce(dr.ReduceOp.Min, buffer, packed, pixel, inside)
            ended = x + 1 >= x1
            covered = covered + dr.select(inside, 1, 0) if self.count else covered
            return dr.select(ended, x0, x + 1), dr.select(ended, y + 1, y), covered

        start = dr.select(active, y0, y1)
        _, _, covered = dr.while_loop((x0, start, types.UInt(0)), lambda x, y, covered: y < y1, body)
        if self.count:
            tests = dr.select(active, types.UInt64((x1 - x0) * (y1 - y0)), 0)
            dr.scatter_reduce(dr.ReduceOp.Add, counters, tests, types.UInt(0))
            dr.scatter_reduce(dr.ReduceOp.Add, counters, types.UInt64(covered), types.UInt(1))
        return counters


def _pixels(types: Any, low: Any, high: Any, size: int) -> tuple[Any, Any]:
    """First and one past the last pixel whose centre lies in [low, high], widened by what rounding can amount to."""
    slack = 2e-6 * size + 1e-3
    first = dr.ceil(dr.maximum(low - (0.5 + slack), 0.0))
    last = dr.floor(dr.minimum(high + (0.5 + slack), float(size)))
    return types.Int(dr.minimum(first, float(size))), types.Int(dr.maximum(last, 0.0))
