"""Pixels through the lists of their blocks: the nearest surface in registers, four neighbouring pixels a lane."""

from typing import Any

import drjit as dr

from mpcam_kernels import regions
from mpcam_kernels.blocks import Large, Lists, set_up
from mpcam_kernels.samples import PIXELS, Samples, pixel_of

PER_LANE = 4  # pixels of a lane: a set-up that is gathered serves four tests in registers


def through_lists(
    types: Any,
    test: Any,
    output: Any,
    samples: Samples,
    large: Large,
    lists: Lists,
    buffer: Any,
    size: tuple[int, int],
    bounded: bool,
    count: bool,
) -> tuple[Any, Any, Any]:
    """Keys of all pixels after their lists and what `buffer` holds; and tests and hits of each lane.

    bounded: pixels outside of a triangle's region are not tested.
    """
    lane = dr.arange(types.UInt, dr.width(buffer) // PER_LANE)
    place = lane * PER_LANE
    block, part = place // PIXELS, (place >> 4) & 3
    groups = [dr.gather(types.Array4f, component, lane) for component in samples.pixels]
    views = [type(samples.pixels)(*(group[k] for group in groups)) for k in range(PER_LANE)]
    x, y, _ = pixel_of(types, place, *size)
    four = types.Array4u64 if output.kind(types) is types.UInt64 else types.Array4u
    before = dr.gather(four, buffer, lane)
    start = dr.gather(types.UInt, lists.starts, block)
    end = start + dr.gather(types.UInt, lists.counts, block)

    def allowed(number: Any, mask: Any) -> list[Any]:
        """Which pixels of the lane are in the region of an item."""
        if not bounded:
            return [mask] * PER_LANE
        area, _ = regions.unpack(types, [dr.gather(types.Array4f, row, number) for row in large.regions])
        row = types.Int(y)
        first, last = area.spans(types)(row, row)
        inside = (row >= area.y0) & (row < area.y1)
        return [inside & (types.Int(x + k) >= first) & (types.Int(x + k) < last) for k in range(PER_LANE)]

    def tested(best: Any, owners: Any, tests: Any, hits: Any, index: Any) -> Any:
        number = dr.gather(types.UInt, lists.items, index)
        bits = dr.gather(types.UInt, lists.parts, index)
        mask = ((bits >> part) & 1) != 0
        triangle = dr.reinterpret_array(types.UInt, dr.gather(types.Float, large.regions[2], number * 4 + 3))
        shape = set_up(types, test, large, triangle)
        nearest, first = [], []
        for k, possible in enumerate(allowed(number, mask)):
            if output.depth:
                covered, nearness = test.hit(shape, views[k])
                covered = covered & possible
                better = nearness > best[k]
                if owners:
                    better = better | ((nearness == best[k]) & (triangle < owners[k]))
                    first.append(dr.select(covered & better, triangle, owners[k]))
                nearest.append(dr.select(covered & better, nearness, best[k]))
                covered = covered & (nearness > 0)
            else:
                covered = test.inside(shape, views[k]) & possible
                nearest.append(best[k] | covered)
            if count:
                tests, hits = tests + dr.select(possible, types.UInt(1), 0), hits + dr.select(covered, 1, 0)
        return nearest, first, tests, hits, index

    def body(best: Any, owners: Any, tests: Any, hits: Any, index: Any) -> Any:
        *state, index = tested(best, owners, tests, hits, index)
        return *state, index + 1

    def unfinished(best: Any, owners: Any, tests: Any, hits: Any, index: Any) -> Any:
        return (index < end) if output.depth else (index < end) & ~(best[0] & best[1] & best[2] & best[3])

    # A test of nearness 0 is no hit, but ties with nothing, which has it too: such an owner is masked below.
    owners = [output.triangle(types, key) for key in before] if hasattr(output, "triangle") else []
    best = [output.nearness(types, key) if output.depth else key > 0 for key in before]
    state = (best, owners, types.UInt(0), types.UInt(0), start)
    best, owners, tests, hits, _ = dr.while_loop(state, unfinished, body)
    if output.depth:
        keys = [output.key(types, near, owners[k] if owners else None) for k, near in enumerate(best)]
        keys = [dr.select(near > 0, key, 0) for near, key in zip(best, keys, strict=True)]
    else:
        keys = [dr.select(one, types.UInt(1), 0) for one in best]
    result = dr.empty(type(buffer), dr.width(buffer))
    dr.scatter(result, four(*keys), lane)
    return result, tests, hits
