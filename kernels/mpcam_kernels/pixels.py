"""Pixels through the lists of their blocks: the nearest surface in registers, eight neighboring pixels a thread."""

import functools
import operator
from collections.abc import Callable
from typing import Any

import drjit as dr

from mpcam_kernels import regions
from mpcam_kernels.blocks import LINK, Large, Lists, set_up
from mpcam_kernels.samples import PARTS, PIXELS

PER_THREAD = 8  # pixels of a thread, two rows of a part: a set-up that is gathered serves eight tests in registers
FOURS = PER_THREAD // 4


def through_lists(
    types: Any,
    test: Any,
    output: Any,
    thread: Any,
    samples: Any,
    large: Large,
    lists: Lists,
    buffer: Any,
    corner: Callable[[Any], tuple[Any, Any]],
    bounded: bool,
    count: bool,
) -> tuple[Any, Any, Any]:
    """Keys of all pixels after their lists and what `buffer` holds; and tests and hits of each thread.

    thread: indices of threads, PER_THREAD pixels each; from outside, since a frozen kernel that counts them itself
    takes its size from any array of a multiple of it, and replays the size that this array has then.
    buffer: keys so far, or the number of slots where there are none yet. corner: from slots to columns and rows, for
    regions. bounded: pixels outside of a triangle's region are not tested.
    """
    slot = thread * PER_THREAD
    block, part = slot // PIXELS, (slot >> 4) % PARTS
    four = types.Array4u64 if output.kind(types) is types.UInt64 else types.Array4u
    fours = [thread * FOURS + k for k in range(FOURS)]
    views: list[Any] = []
    if isinstance(buffer, int):  # nothing was drawn yet
        before, result = [output.kind(types)(0)] * PER_THREAD, dr.empty(output.kind(types), buffer)
    else:
        before = [key for at in fours for key in dr.gather(four, buffer, at)]
        result = dr.empty(type(buffer), dr.width(buffer))
    x, y = corner(slot) if bounded else (slot, slot)

    def allowed(number: Any, mask: Any) -> list[Any]:
        """Which pixels of the thread to test against a triangle."""
        if not bounded:
            return [mask] * PER_THREAD
        area, _ = regions.unpack(types, [dr.gather(types.Array4f, row, number) for row in large.regions])
        spans, inside = area.spans(types), []
        for line in range(FOURS):
            row = types.Int(y + line)
            first, last = spans(row, row)
            within = (row >= area.y0) & (row < area.y1)
            inside += [within & (types.Int(x + k) >= first) & (types.Int(x + k) < last) for k in range(4)]
        return inside

    def sought(number: Any) -> Any:
        """The next entry for the thread's part: looking on is cheap, a test with most threads idle is not."""

        def look(number: Any, found: Any) -> Any:
            link = lists.link(types, number)
            found = ((link >> part) & 1) != 0
            return dr.select(found, number, link // LINK), found

        return dr.while_loop((number, types.Bool(False)), lambda number, found: ~found & (number > 0), look)[0]

    def body(best: Any, owners: Any, tests: Any, hits: Any, number: Any) -> Any:
        name, mask = lists.name(types, number), True
        triangle = name
        if bounded:
            triangle = dr.reinterpret_array(types.UInt, dr.gather(types.Float, large.regions[2], name * 4 + 3))
        shape = set_up(types, test, large, triangle)
        triangle = getattr(shape, "name", triangle)  # set-ups may lie in another order than triangles
        nearest, first = [], []
        for k, possible in enumerate(allowed(name, mask)):
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
        return nearest, first, tests, hits, sought(lists.link(types, number) // LINK)

    def unfinished(best: Any, owners: Any, tests: Any, hits: Any, number: Any) -> Any:
        return (number > 0) if output.depth else (number > 0) & ~functools.reduce(operator.and_, best)

    # A test of nearness 0 is no hit, but ties with nothing, which has it too: such an owner is masked below.
    owners = [output.triangle(types, key) for key in before] if hasattr(output, "triangle") else []
    best = [output.nearness(types, key) if output.depth else key > 0 for key in before]

    start = sought(lists.first(types, block))

    def draw(best: Any, owners: Any, tests: Any, hits: Any) -> Any:
        views[:] = samples.run(types, slot, PER_THREAD)
        return dr.while_loop((best, owners, tests, hits, start), unfinished, body)[:4]

    state = (best, owners, types.UInt(0), types.UInt(0))
    # Many parts of blocks have no triangle: they need no samples.
    best, owners, tests, hits = dr.if_stmt(state, start > 0, draw, lambda *state: state)
    if output.depth:
        keys = [output.key(types, near, owners[k] if owners else None) for k, near in enumerate(best)]
        keys = [dr.select(near > 0, key, 0) for near, key in zip(best, keys, strict=True)]
    else:
        keys = [dr.select(one, types.UInt(1), 0) for one in best]

    # One scatter in a loop: two to one array would be two kernels, each with all of the above.
    def store(k: Any) -> Any:
        chosen = [dr.select(k == 0, keys[i], keys[4 + i]) for i in range(4)]
        dr.scatter(result, four(*chosen), thread * FOURS + k)
        return (k + 1,)

    dr.while_loop((types.UInt(0),), lambda k: k < FOURS, store)
    return result, tests, hits
