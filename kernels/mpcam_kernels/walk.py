"""Small triangles: a thread walks the pixels of a region row by row; the nearest surface wins by an atomic maximum."""

from collections.abc import Callable
from typing import Any

import drjit as dr

from mpcam_kernels.regions import Region


def walk(
    types: Any,
    test: Any,
    output: Any,
    shape: Any,
    triangle: Any,
    area: Region,
    active: Any,
    samples: Any,
    slot: Callable[[Any, Any], Any],
    buffer: Any,
    count: bool,
) -> tuple[Any, Any]:
    """Raise `buffer` to the triangle's keys at the pixels that it covers; returns tests and hits of each thread.

    slot: of a column and a row of the region.
    """

    spans = area.spans(types)

    def body(x: Any, end: Any, y: Any, tests: Any, hits: Any) -> Any:
        pixel = slot(types.UInt(x), types.UInt(y))
        within = x < end
        sample = samples.at(types, pixel, within)
        if output.depth:
            covered, nearness = test.hit(shape, sample)
            covered = covered & within & (nearness > 0)
            # Direct: private copies per thread, the default, cost more to clear and merge than the atomics do.
            key = output.key(types, nearness, triangle)
            dr.scatter_reduce(dr.ReduceOp.Max, buffer, key, pixel, covered, mode=dr.ReduceMode.Direct)
        else:
            covered = test.inside(shape, sample) & within
            dr.scatter(buffer, output.kind(types)(1), pixel, covered)
        if count:
            tests, hits = tests + dr.select(within, 1, 0), hits + dr.select(covered, 1, 0)
        ended = x + 1 >= end
        start, stop = spans(y + 1, y + 1)
        return dr.select(ended, start, x + 1), dr.select(ended, stop, end), dr.select(ended, y + 1, y), tests, hits

    first = dr.select(active, area.y0, area.y1)
    start, stop = spans(first, first)
    state = (start, stop, first, types.UInt(0), types.UInt(0))
    *_, tests, hits = dr.while_loop(state, lambda x, end, y, tests, hits: y < area.y1, body)
    return tests, hits
