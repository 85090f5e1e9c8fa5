"""The camera that looks at a scene, in place of its own: from a file, from another eye, or both."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mpcam.cameras.change import resized
from mpcam.errors import InputError
from mpcam.io.camera_files import read_camera_file, split_name
from mpcam.io.scene_build import bounds_of, default_light
from mpcam.io.scene_camera import field_of_view, overview
from mpcam.math.pose import look_at

if TYPE_CHECKING:
    from mpcam.cameras import Camera
    from mpcam.io.scenes import SceneFile

_UP = {"y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def viewed(
    loaded: "SceneFile",
    camera: str | Path | None = None,
    eye: Any = None,
    target: Any = None,
    up: Any = None,
    size: tuple[int, int] | None = None,
) -> "SceneFile":
    """The scene, seen by the camera in FILE or FILE:NAME, or by its own, from a point.

    eye, target (3,): scene units; without a target the camera looks at the middle of the meshes. up (3,): direction
    towards the top of the image; default: the scene's axis. size: width and height; the camera is resized to it, and
    has it where its file says none. Without an eye, a camera has the pose of its file, and one whose file has none in
    the world, such as a lens of a calibration, is put where it sees all meshes. Raises InputError for files and names
    that do not lead to a camera, and for poses that are incomplete.
    """
    scene = loaded.scene
    if camera is not None:
        found, placed = read_camera_file(*split_name(camera), size=size)
    elif scene.camera is not None:
        found, placed = scene.camera if size is None else resized(scene.camera, *size), True
    else:
        raise InputError(f"{scene.name}: has no camera: give one")
    bounds = bounds_of(scene.meshes)
    if eye is None and not placed and target is None:
        found = found.with_pose(overview(bounds, field_of_view(found), loaded.up, up))
    else:
        found = placed_at(found, eye, bounds.mean(axis=0), _UP[loaded.up], target, up)
    # Light that was to come from behind the camera still does.
    behind = scene.camera is not None and scene.lights == (default_light(scene.camera),)
    lights = (default_light(found),) if behind else scene.lights
    return replace(loaded, scene=replace(scene, camera=found, lights=lights))


def placed_at(
    camera: "Camera", eye: Any, middle: Any = None, axis: Any = (0.0, 0.0, 1.0), target: Any = None, up: Any = None
) -> "Camera":
    """The camera at an eye, or as it is where that is None; see `viewed`. middle, axis: for what is left out."""
    if eye is None:
        for name, value in (("target", target), ("up", up)):
            if value is not None:
                raise InputError(f"{name} {_shown(value)} goes with an eye: give the eye too")
        return camera
    toward = middle if target is None else target
    if toward is None:
        raise InputError(f"eye {_shown(eye)} needs a target: give the point to look at too")
    if up is not None and not np.any(up):
        raise InputError(f"up {_shown(up)}: give a direction, as 0,0,1")
    if np.array_equal(eye, toward):
        raise InputError(f"eye {_shown(eye)} is where the target is: give another point to look at")
    return camera.with_pose(look_at(eye, toward, axis if up is None else up))


def _shown(point: Any) -> str:
    return ",".join(f"{value:g}" for value in np.asarray(point, np.float64))
