"""Settings of depth images that stand for a scene in a mirror, checked."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.checks import is_number, shown, whole_number
from mpcam.depth_images.depth_image import DepthImage, check_camera
from mpcam.depth_images.rays import side_for
from mpcam.effects.depth_image_views import View, views_of
from mpcam.errors import InputError
from mpcam.scene.scene import Scene

LEAST, MOST = 8, 8192  # pixels along a side
MOST_BOUNCES = 8


@dataclass(frozen=True)
class DepthImageChoice:
    """size, aside, coarse, fine, bounces, own: see `Reflection`. given: depth images to take as they are. cameras:
    views to take in place of chosen ones. chooses: whether meshes that those do not show get chosen ones.
    reflectance: one number for each mesh of the scene.
    """

    size: int
    aside: float
    coarse: float | None
    fine: float
    bounces: int
    own: bool
    reflectance: tuple[float, ...]
    given: tuple[DepthImage, ...]
    cameras: tuple[View, ...]
    chooses: bool

    def views(self, scene: Scene, origins: np.ndarray, directions: np.ndarray) -> list[tuple[View, float]]:
        """The views of a scene, and what their meshes reflect; rays (N, 3): those that the mirror sends on."""
        found = list(self.cameras)
        if self.chooses:
            shown = {number for view in found for number in view.meshes}
            found += views_of(scene, origins, directions, self.size, self.aside, shown)
        parts = []
        for view in found:
            by_part: dict[float, list[int]] = {}
            for number in view.meshes:
                by_part.setdefault(self.reflectance[number], []).append(number)
            parts += [(view._replace(meshes=tuple(numbers)), part) for part, numbers in by_part.items()]
        return parts


def choice_of(
    scene: Scene,
    images: Any = None,
    size: Any = 512,
    aside: Any = 1.0,
    coarse: Any = 6.0,
    fine: Any = 0.25,
    bounces: Any = 1,
    reflectance: Any = 0.0,
    own: Any = False,
) -> DepthImageChoice:
    """The settings; raises InputError for others than `Reflection` allows."""
    size = whole_number("size", size, LEAST, MOST, unit="pixels")
    if not is_number(aside) or aside < 0:
        raise InputError(f"aside={shown(aside)}: a finite number from 0 is needed, in radii of the thing; 0: a pinhole")
    side_for(coarse, fine)
    bounces = whole_number("bounces", bounces, 1, MOST_BOUNCES)
    if not isinstance(own, bool):
        raise InputError(f"own={shown(own)}: give True, for the mirror to be seen in itself, or False")
    parts = _reflectance(reflectance, len(scene.meshes))
    if bounces == 1 and (own or any(parts)):
        asked = "own=True" if own else "reflectance="
        raise InputError(f"{asked} sends rays on a second time: give bounces=2, or more")
    given, cameras, chooses = _given(images, len(scene.meshes))
    return DepthImageChoice(size, float(aside), coarse, float(fine), bounces, own, parts, given, cameras, chooses)


def _reflectance(value: Any, count: int) -> tuple[float, ...]:
    values = (
        [value] * count if is_number(value) else list(value) if isinstance(value, (list, tuple, np.ndarray)) else []
    )
    if len(values) != count or not all(is_number(one) and 0 <= one <= 1 for one in values):
        raise InputError(
            f"reflectance={shown(value)}: give a number from 0 to 1, or one for each of the scene's {count} meshes"
        )
    return tuple(float(one) for one in values)


def _given(images: Any, count: int) -> tuple[tuple[DepthImage, ...], tuple[View, ...], bool]:
    """Depth images and views out of a list of depth images, cameras and pairs of a camera and mesh numbers."""
    if images is None:
        return (), (), True
    if isinstance(images, (Camera, DepthImage)):
        images = [images]
    if not isinstance(images, Sequence) or len(images) == 0:
        raise InputError(f"images={shown(images)}: {_ALLOWED}")
    given, views = [], []
    for entry in images:
        if isinstance(entry, DepthImage):
            given.append(entry)
            continue
        camera, numbers = entry if isinstance(entry, tuple) and len(entry) == 2 else (entry, range(count))
        if not isinstance(camera, Camera):
            raise InputError(f"images: one of them is a {type(camera).__name__}: {_ALLOWED}")
        check_camera(camera)
        numbers = [numbers] if isinstance(numbers, (int, np.integer)) else list(numbers)
        for number in numbers:
            whole_number("images: number of a mesh", number, 0, count - 1)
        if not numbers:
            raise InputError("images: a camera is given with no mesh to see: name one, or give the camera alone")
        views.append(View((camera,), tuple(sorted({int(n) for n in numbers})), "given"))
    return tuple(given), tuple(views), not given


_ALLOWED = "give cameras, mpcam.DepthImages, or pairs of a camera and the numbers of the scene's meshes that it sees"
