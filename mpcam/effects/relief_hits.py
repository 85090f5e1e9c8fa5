"""What a camera's pixels see of reliefs first."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_numbers, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.depth_images.march import opaque_most, projection
from mpcam.depth_images.rays import side_for
from mpcam.effects.relief_instances import ReliefInstances
from mpcam.errors import InputError
from mpcam.math.pose import frame_origin
from mpcam.rendering.block_layout import BlockLayout
from mpcam.rendering.device_camera import around, device_camera
from mpcam.rendering.device_rays import device_rays
from mpcam.rendering.ray_blocks import DeviceRays, first_hits

CHUNK = 1024
"""Copies at a time: each block of pixels has a place for every one of them in its list."""


@dataclass(frozen=True)
class Part:
    """One image of one relief, as the camera met it. met: of a `mpcam_kernels.relief.Met`, by slot of the rays."""

    instances: ReliefInstances
    image: int
    rays: DeviceRays
    pose: list[Any]
    met: tuple[Any, ...]


class ReliefHits:
    """First hits of a camera's pixels on reliefs; fields are worked out when they are first asked for.

    depth: (H, W) float32 along the pixel's ray, scene units, infinite where no relief is met. relief: (H, W) int32,
    which of the given reliefs, -1 for none. instance: (H, W) int32, which of its copies, -1 for none. steps: (H, W),
    points of the pixel's ray that were projected into depth images. The same flat on the device: `device_depth`,
    `device_part`, `device_slot`, `device_steps`. parts: what was met by each image of each relief.
    """

    def __init__(self, camera: Camera, reliefs: Sequence[ReliefInstances], found: Any, parts: list[Part]):
        self.camera, self.reliefs, self.parts = camera, tuple(reliefs), parts
        self.device_depth, self.device_part, self.device_slot, self.device_instance, self.device_steps = found

    @functools.cached_property
    @exclusive
    def depth(self) -> np.ndarray:
        """(H, W) float32, infinite where no relief is met."""
        return self._image(self.device_depth)

    @functools.cached_property
    @exclusive
    def instance(self) -> np.ndarray:
        """(H, W) int32, -1 where no relief is met."""
        return self._image(self.device_instance)

    @functools.cached_property
    @exclusive
    def relief(self) -> np.ndarray:
        """(H, W) int32, -1 where no relief is met."""
        numbers = np.array([self.reliefs.index(part.instances) for part in self.parts] + [-1], np.int32)
        return numbers[self._image(self.device_part)]

    @functools.cached_property
    @exclusive
    def steps(self) -> np.ndarray:
        """(H, W) int32."""
        return self._image(self.device_steps).astype(np.int32)

    @property
    def mask(self) -> np.ndarray:
        """(H, W) bool, where a relief is met."""
        return np.isfinite(self.depth)

    def _image(self, values: Any) -> np.ndarray:
        return np.asarray(values.numpy()).reshape(self.camera.height, self.camera.width)

    def __repr__(self) -> str:
        return f"ReliefHits({self.camera.width}x{self.camera.height}, {len(self.reliefs)} reliefs)"


@exclusive
def relief_hits(
    camera: Camera, reliefs: Any, depth: Any = None, *, coarse: float | None = 3.0, fine: float = 0.5
) -> ReliefHits:
    """What a camera's pixels see first of reliefs.

    camera: any of mpcam's cameras. reliefs: ReliefInstances, one or several. depth: lengths along the pixels' rays
    beyond which nothing counts, such as those of other things in the scene: (H, W), or a Float on the device.
    coarse, fine: steps in pixels of the depth images, see `DepthImage.intersect`. Raises InputError for anything else.
    """
    import drjit as dr

    several = _several(reliefs)
    side, coarse, fine = side_for(coarse, fine)
    count = camera.width * camera.height
    limit = _limit(depth, count)
    t = types()
    found: tuple[Any, ...] = (limit, *(dr.full(t.Int, -1, count) for _ in range(3)), dr.zeros(t.UInt, count))
    parts: list[Part] = []
    for instances in several:
        if len(instances) == 0:
            continue
        placed, relief = instances.device, instances.relief
        rays = device_rays(camera, placed.mesh)
        matrix = around(camera, rays.anchor)
        back, pose = _poses(matrix, placed.mesh), placed.mesh.pose(matrix)
        order = placed.order(frame_origin(matrix))
        for first in range(0, len(order), CHUNK):
            chosen = t.UInt(aligned(order[first : first + CHUNK], np.uint32)) + t.UInt(opaque_zero())
            size = dr.opaque(t.UInt, min(CHUNK, len(order) - first))
            copies = placed.poses, placed.balls, chosen, size
            lists = _lists(rays, pose, copies, min(CHUNK, len(order) - first))
            for number, image in enumerate(relief.images):
                met = _met(rays, back, copies, lists, found[0], placed.mesh.scale, image, relief, side, (coarse, fine))
                slots = first_hits(rays.layout, met[5]) if rays.bent else rays.layout.on_device["slots"]
                name, unit = dr.opaque(t.Int, len(parts)), opaque_numbers([placed.mesh.scale])[0]
                found = _frozen_nearest()(found, slots, met, unit, name)
                parts.append(Part(instances, number, rays, back, met))
    limit = dr.select(found[1] >= 0, found[0], dr.inf)
    dr.eval(limit, found)
    return ReliefHits(camera, several, (limit, *found[1:]), parts)


def _several(reliefs: Any) -> tuple[ReliefInstances, ...]:
    found = (reliefs,) if isinstance(reliefs, ReliefInstances) else tuple(reliefs)
    if not all(isinstance(one, ReliefInstances) for one in found):
        raise InputError("reliefs: give mpcam.ReliefInstances, such as relief.instances(placements)")
    return found


def _limit(depth: Any, count: int) -> Any:
    import drjit as dr

    t = types()
    if depth is None:
        limit = dr.full(t.Float, dr.inf, count)
        dr.make_opaque(limit)
        return limit
    if not dr.is_array_v(depth):
        values = np.asarray(depth, np.float64)
        if values.size != count:
            raise InputError(
                f"depth has shape {values.shape}: a length for each of the camera's {count} pixels is needed"
            )
        depth = t.Float(aligned(values)) + opaque_zero()
    if dr.width(depth) != count:
        raise InputError(
            f"depth holds {dr.width(depth)} lengths: one for each of the camera's {count} pixels is needed"
        )
    return depth


def _poses(matrix: np.ndarray, mesh: Any) -> list[Any]:
    """From the frame of the rays to that of a device mesh, in its unit. matrix: the rays' frame from the world."""
    rotation = matrix[:3, :3]
    shift = (rotation @ mesh.anchor + matrix[:3, 3]) / mesh.scale
    return opaque_numbers([*rotation.T.ravel(), *(-rotation.T @ shift)])


def _lists(rays: DeviceRays, pose: list[Any], copies: tuple[Any, ...], most: int) -> tuple[Any, Any]:
    """Which copies the rays of each block may meet, and how many."""
    import drjit as dr

    blocks = rays.layout.on_device["threads"][1]
    entries = dr.empty(types().UInt, rays.layout.blocks * most)
    counts = _frozen_lists(rays.kind)(blocks, rays.blocks.cones, pose, copies, entries)
    return entries, counts


@functools.cache
def _frozen_lists(kind: str) -> Any:
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.relief import Copies, listed
    from mpcam_kernels.rows import Rows

    @frozen
    def lists(block: Any, cones: Any, pose: list[Any], copies: tuple[Any, ...], entries: Any) -> Any:
        poses, *rest = copies
        return listed(types(), cones, block, pose, Copies(Rows(poses, 3), *rest), entries)

    return lists


def _met(
    rays: DeviceRays,
    pose: list[Any],
    copies: tuple[Any, ...],
    lists: tuple[Any, Any],
    limit: Any,
    scale: float,
    image: Any,
    relief: Any,
    side: int,
    steps: tuple[float, float],
) -> tuple[Any, ...]:
    """First hits of the rays, by slot, and whether there are any, as UInt."""
    camera, surface = image.camera, image.surface(side)
    static: tuple[Any, ...] = tuple(getattr(camera, name) for name in camera.static_fields)
    kernel = _frozen_met(type(camera), static, surface.size, side, surface.curved, rays.kind)
    matrix = np.asarray(camera.camera_from_world, np.float64)
    inner: list[Any] = opaque_numbers([*matrix[:3, :3].ravel(), *matrix[:3, 3], *steps, 1.0 / scale])
    most = opaque_most(surface.size, steps[1])
    data = surface.patches, surface.ranges, surface.box
    eyes = rays.blocks.rays, pose, pixels_of(rays.layout), limit
    slots = rays.layout.on_device["threads"][0]
    known = device_camera(camera).on_device
    return kernel(slots, known, data, relief.device_box, inner, copies, lists, eyes, most)


@functools.lru_cache(maxsize=64)
def _frozen_met(
    model: type, static: tuple[Any, ...], size: tuple[int, int], side: int, curved: float, kind: str
) -> Any:
    import drjit as dr

    from mpcam_kernels.depth_tiles import Levels
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.marching import Surface
    from mpcam_kernels.relief import Copies, Eyes, block_of, first_met, ray_of
    from mpcam_kernels.rows import Rows

    levels = Levels.of(*size, side)

    @frozen
    def kernel(
        slot: Any,
        camera: Any,
        data: tuple[Any, ...],
        box: list[Any],
        inner: list[Any],
        copies: tuple[Any, ...],
        lists: tuple[Any, Any],
        eyes: tuple[Any, ...],
        most: Any,
    ) -> tuple[Any, ...]:
        t = types()
        poses, *rest = copies
        patches, ranges, bounds = data

        surface = Surface(patches, ranges, bounds, size, levels, curved)
        ray = ray_of(t, kind == "bent", Eyes(*eyes), slot, inner[14])
        steps = inner[12], inner[13], most
        placed = Copies(Rows(poses, 3), *rest)
        met = first_met(t, projection(camera), surface, box, inner[:12], placed, lists, ray, block_of(slot), steps)
        return *met[:5], dr.select(met.copy >= 0, t.UInt(1), 0), met.steps

    return kernel


@functools.lru_cache(maxsize=16)
def pixels_of(layout: BlockLayout) -> Any:
    """Int on the device: the pixel of each slot, -1 for none."""
    from mpcam_kernels.samples import PIXELS

    pixels = np.full(layout.blocks * PIXELS, -1, np.int32)
    there = np.flatnonzero(layout.slots >= 0)
    pixels[layout.slots[there]] = there % layout.pixels
    return types().Int(aligned(pixels, np.int32)) + types().Int(opaque_zero())


@functools.cache
def _frozen_nearest() -> Any:
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def nearest(found: tuple[Any, ...], slots: Any, met: tuple[Any, ...], unit: Any, name: Any) -> tuple[Any, ...]:
        t = types()
        depth, part, slot, copy, steps = found
        length, _, _, _, number, _, taken = met
        some, at = slots >= 0, t.UInt(dr.maximum(slots, 0))
        new = dr.gather(t.Float, length, at, some) * unit
        nearer = some & (dr.gather(t.Int, number, at, some) >= 0) & (new < depth)
        steps = steps + dr.gather(t.UInt, taken, at, some)
        chosen = ((depth, new), (part, name), (slot, slots), (copy, dr.gather(t.Int, number, at, some)))
        return *(dr.select(nearer, b, a) for a, b in chosen), steps

    return nearest
