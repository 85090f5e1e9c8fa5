"""Candidates by the bounds of Hou et al. 2006 on the planes of camera triangles; all pixels inside are tested."""

from collections.abc import Iterator
from typing import Any

import drjit as dr

from mpcam_kernels import blocks, planes
from mpcam_kernels.block_pipeline import ROOM, BlockPipeline, Canvas, Task
from mpcam_kernels.blocks import Lists
from mpcam_kernels.candidates import THREADS, Tell
from mpcam_kernels.frozen import frozen
from mpcam_kernels.rows import Rows
from mpcam_kernels.threads import threads


class PlanePipeline(BlockPipeline):
    """bound: "triangle" or "nine_point". With "objects" in `culling`, camera triangles are held against clusters first;
    with "triangles", regions that hold no pixel of the camera triangle are dropped before anything else is done.
    """

    def __init__(self, types: Any, blocks: int, bound: str, **settings: Any):
        super().__init__(types, blocks, "general", **settings)
        self.bound = bound
        self._items = frozen(self._item_pass)
        self._chosen = frozen(self._chosen_pass)
        self._reached = frozen(self._reached_pass)

    def lists(
        self, task: Task, setups: Rows, levels: list[Rows], canvas: Canvas, tell: Tell
    ) -> Iterator[tuple[Lists, list[Any]]]:
        """Lists of items by block, for some at a time, and the items' rows."""
        types, found_planes, rays = self.types, task.rays.planes, task.rays
        fan, cull = found_planes.fan, "triangles" in self.candidates.culling
        most, step = THREADS // fan * fan, min(ROOM, (1 << 32) // fan)  # threads are numbered with 32 bits
        for pairs, number in self.candidates.met(task.counts, found_planes.cones, levels, tell):
            # Regions are large, so few at a time.
            for start in range(0, number, step):
                thread = threads(types, start, min(number, start + step))
                rows, some = self._items(thread, found_planes, task.vertices, task.faces, task.pose, pairs, cull)
                chosen = dr.compress(some)
                tell("bounds", chosen)
                many = dr.width(chosen)
                if not many:
                    continue
                targets = [dr.empty(types.Float, 4 * many) for _ in rows]
                items = self._chosen(threads(types, 0, many), chosen, thread, rows, pairs, targets)
                for first in range(0, many * fan, most):
                    thread = threads(types, first, min(many * fan, first + most))
                    empty = blocks.room(types, dr.width(thread), self.blocks)
                    yield self._reached(thread, fan, most, found_planes, items, rays.corners, empty), items.rows

    def _item_pass(self, thread: Any, found: Any, vertices: Any, faces: Any, pose: Any, pairs: Any, cull: bool) -> Any:
        return planes.items(self.types, self.bound, thread, found, vertices, faces, pose, pairs, cull)

    def _chosen_pass(
        self, item: Any, chosen: Any, thread: Any, rows: list[Any], pairs: Any, targets: list[Any]
    ) -> planes.Items:
        face, _ = pairs.at(dr.gather(self.types.UInt, thread, chosen))
        for target, row in zip(targets, rows, strict=True):
            dr.scatter(target, dr.gather(self.types.Array4f, row, chosen), item)
        return planes.Items(targets, face)

    def _reached_pass(
        self, thread: Any, fan: int, most: int, found: Any, items: Any, corners: Any, lists: Lists
    ) -> Lists:
        item, block, bits = planes.reached(self.types, thread, fan, found, items, corners)
        lists.add(self.types, thread % most, block, item, bits, bits != 0)
        return lists
