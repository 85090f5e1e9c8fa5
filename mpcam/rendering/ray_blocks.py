"""Rays on the device, block by block, with all that bounds them."""

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import exclusive, types
from mpcam.cameras.base import Camera
from mpcam.cameras.types import PosedRays
from mpcam.rendering.block_layout import BlockLayout
from mpcam.rendering.device_camera import around


@dataclass(frozen=True, eq=False)
class DeviceRays:
    """Rays of a camera's pixels, in the camera's axes, from an anchor, in the unit of a device mesh.

    kind: "central" where all leave from the anchor, "bent" for pieces of bent rays, else "general". anchor (3,): camera
    frame, scene units. blocks: a `mpcam_kernels.ray_blocks.RayBlocks`. rows: gives the rays of the pixels row by row,
    from the anchor, scene units; of bent rays the last pieces.
    """

    layout: BlockLayout
    kind: str
    anchor: np.ndarray
    blocks: Any
    rows: Callable[[], Any]

    @property
    def bent(self) -> bool:
        """Whether these are pieces of bent rays, in layers."""
        return self.kind == "bent"

    def slots(self, keys: Any) -> Any:
        """Int, the slot of each pixel row by row, -1 where there is none; of bent rays the one that keys decide for."""
        return first_hits(self.layout, keys) if self.bent else self.layout.on_device["slots"]

    @exclusive
    def posed(self, camera: Camera) -> PosedRays:
        """The rays in scene units; camera: the one whose rays they are, at any pose."""
        return PosedRays(around(camera, self.anchor), self.rows())


def first_hits(layout: BlockLayout, keys: Any) -> Any:
    """Int, the slot of each pixel's first piece that hits something; of its last one if none does, -1 without any."""
    import drjit as dr

    fixed = layout.on_device
    slots = _frozen_first(type(keys))(fixed["pixels"], fixed["slots"], fixed["layers"], keys)
    dr.eval(slots)
    return slots


@functools.cache
def _frozen_first(kind: type) -> Any:
    """Kernel that finds the first piece with a hit, for one type of keys."""
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.ray_pieces import first_hit

    @frozen
    def first(pixel: Any, slots: Any, layers: tuple[Any, Any], keys: Any) -> Any:
        return first_hit(types(), kind, pixel, slots, *layers, keys)

    return first


def family(kind: str) -> Any:
    """The kernels' module for a kind of rays."""
    from mpcam_kernels.block_pipeline import RAYS

    return RAYS[kind]


def rows_for(kind: str, part: str, layout: BlockLayout, threads: int) -> Any:
    """Rows to be written: of rays, slopes or cones, one for each of the threads."""
    import drjit as dr

    from mpcam_kernels.rows import room

    count = getattr(family(kind), part).ROWS
    return room(types(), count, dr.width(layout.on_device["threads"][threads]))


def bounded(kind: str, rays: Any, layout: BlockLayout, planes: Any = None) -> Any:
    """`RayBlocks` of rays by slot."""
    import drjit as dr

    from mpcam_kernels.ray_blocks import RayBlocks

    fixed, module = layout.on_device, family(kind)
    _, block, group = fixed["threads"]
    first, count, corners = fixed["first"], fixed["count"], (fixed["x"], fixed["y"])
    bound, around = _frozen_bounds(kind)
    cones, slopes = bound(block, rays, *(rows_for(kind, part, layout, 1) for part in ("Cones", "Slopes")))
    cones, slopes = module.Cones(cones), module.Slopes(slopes)
    targets = (rows_for(kind, part, layout, 2) for part in ("Cones", "Slopes"))
    group_cones, group_slopes = around(group, cones, slopes, corners, first, count, *targets)
    group_cones, group_slopes = module.Cones(group_cones), module.Slopes(group_slopes)
    found = RayBlocks(
        rays,
        cones,
        slopes,
        group_cones,
        group_slopes,
        first,
        count,
        fixed["numbers"],
        fixed["exist"],
        fixed["parts"],
        fixed["runs"],
        corners,
        planes,
    )
    dr.eval(found)
    return found


@functools.cache
def _frozen_bounds(kind: str) -> tuple[Any, Any]:
    """Kernels that bound the rays of blocks, and of groups."""
    from mpcam_kernels import ray_blocks
    from mpcam_kernels.frozen import frozen

    module = family(kind)

    @frozen
    def bound(block: Any, rays: Any, cones: Any, slopes: Any) -> tuple[Any, Any]:
        cone, lines = module.block_bounds(types(), rays, block)
        cones.store(cone, block)
        slopes.store(lines, block)
        return cones, slopes

    @frozen
    def around(
        group: Any, cones: Any, slopes: Any, corners: Any, first: Any, count: Any, cone_rows: Any, slope_rows: Any
    ) -> tuple[Any, Any]:
        first, count = (gathered(values, group) for values in (first, count))
        cone_rows.store(cones.joined(types(), first, count), group)
        slope_rows.store(ray_blocks.group_bounds(types(), slopes, corners, first, count), group)
        return cone_rows, slope_rows

    return bound, around


def gathered(values: Any, number: Any) -> Any:
    import drjit as dr

    return dr.gather(type(values), values, number)
