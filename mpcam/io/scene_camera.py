"""The camera of a scene file: the model that its table names, and a place from which it sees the meshes."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.radial import Radial
from mpcam.cameras.registry import MODELS, snake_case
from mpcam.cameras.serialize import camera_to_dict
from mpcam.cameras.tables import fits_a_table, from_table, table_keys, to_table
from mpcam.errors import InputError
from mpcam.io.calibration_parts import Section
from mpcam.io.calibration_poses import Poses
from mpcam.io.camera_files import read_camera_file
from mpcam.io.camera_tables import CameraFile, CameraTable, model_of
from mpcam.io.scene_text import SceneText
from mpcam.math.pose import look_at

# Half the angle that the meshes may take up: near enough for a fisheye to show its curvature, and outside of them.
_WIDEST = math.radians(65)
_SAMPLES = 65  # along each side of an image


def default_camera(bounds: np.ndarray, up: str = "z", size: tuple[int, int] = (512, 512)) -> Radial:
    """A paraboloid camera (180 degrees) outside the bounding box of the meshes that looks at its center.

    bounds: (2, 3) smallest and largest coordinates. up: "y" or "z", the vertical axis; the view is from the front, the
    right and above, where the front is -y with z up and +z with y up. size: width, height in pixels.
    """
    return Radial.paraboloid(*size, camera_from_world=overview(bounds, math.pi, up))


def build_camera(table: CameraTable | CameraFile, bounds: np.ndarray, folder: Path, text: SceneText) -> Camera:
    """The camera that a [camera] table describes; bounds (2, 3) of the meshes place it where it gives no pose.

    Raises InputError, with the line of the key, for poses that are incomplete or given twice, for fields of view that
    the projection cannot reach, and for what the camera itself refuses.
    """
    if isinstance(table, CameraFile):
        return _from_file(table, bounds, folder, text)
    model = model_of(table)
    given = {key: value for key in table_keys(model) if (value := getattr(table, key)) is not None}
    with text.at("camera"):
        if model.ray_geometry == "parallel" and "scale" not in given:  # no place makes their view wider
            given["scale"] = _fitting_scale(bounds, table.size)
        placed = any(key in given for key in getattr(model, "placed_by", ()))
        view = getattr(model, "view_of_table", None)  # of models that are described in the world around them
        if view is not None and not placed:
            pose = _pose(table, bounds, view(*table.size, **given), text)
            return from_table(model, *table.size, {**given, "camera_from_world": pose})
        camera = from_table(model, *table.size, given)
        if placed:
            return _placed(table, camera, text)
        return camera.with_pose(_pose(table, bounds, camera, text))


def _placed(table: CameraTable, camera: Camera, text: SceneText) -> Camera:
    """A camera that its own keys place."""
    for key in ("eye", "target", "up", "camera_from_world"):
        if getattr(table, key) is not None:
            raise text.error(("camera", key), "the other keys place this camera: leave it out")
    return camera


def camera_to_toml(camera: Camera) -> str:
    """A camera as the table [camera] of a scene file, which makes an equal one (angles: but for rounding of degrees).

    Raises InputError for models that consist of arrays, which a table names a file of, and for cameras that no file can
    hold.
    """
    table = camera_to_dict(camera)
    model = MODELS[table["model"]]
    if not fits_a_table(model):
        raise InputError(
            f"a {model.__name__} is too large for a table: write camera_to_json(camera) to a file, and name that, "
            f'model = "{snake_case(model.__name__)}", file = "camera.json"'
        )
    size, pose = [camera.width, camera.height], table["camera_from_world"]
    keys = {"model": snake_case(model.__name__), "size": size, **to_table(camera), "camera_from_world": pose}
    # JSON's texts, lists and numbers are TOML's, too
    return "\n".join(["[camera]", *(f"{key} = {json.dumps(value)}" for key, value in keys.items())]) + "\n"


def _from_file(table: CameraFile, bounds: np.ndarray, folder: Path, text: SceneText) -> Camera:
    path = folder / table.file
    with text.at("camera", "file" if table.name is None else "name"):
        camera, placed = read_camera_file(path, table.name, table.size)
    own = snake_case(type(camera).__name__)
    if table.model not in (None, own):
        raise text.error(("camera", "model"), f"{path} holds a {type(camera).__name__}: give model = {own!r}, or none")
    others = [key for key in ("eye", "target", "up", "camera_from_world") if getattr(table, key) is not None]
    if table.pose is not None:
        if others:
            raise text.error(("camera", others[0]), f"give pose or {others[0]}, not both")
        return camera if table.pose == "file" else camera.with_pose(_rigid(table.pose, text))
    if placed and (not others or others == ["up"]):
        if others:
            raise text.error(("camera", "up"), "the camera has the pose of its file: give eye and target too")
        return camera
    with text.at("camera"):
        return camera.with_pose(_pose(table, bounds, camera, text))


def _rigid(rows: Any, text: SceneText) -> np.ndarray:
    """A pose as rows, put right where it is rounded."""
    poses = Poses()
    with text.at("camera", "pose"):
        found = poses.read(Section(text.name, {"pose": [list(row) for row in rows]}), "pose")
    if found is None:
        raise text.error(("camera", "pose"), poses.lost[0][1])
    poses.warn()
    return found


def _pose(table: CameraTable | CameraFile, bounds: np.ndarray, camera: Camera, text: SceneText) -> Any:
    if table.up is not None and not any(table.up):
        raise text.error(("camera", "up"), "give a direction, e.g. [0, 0, 1]")
    if table.camera_from_world is not None:
        for key in ("eye", "target", "up"):
            if getattr(table, key) is not None:
                raise text.error(("camera", key), f"give camera_from_world or eye and target, not {key} with it")
        return np.array(table.camera_from_world)
    up = table.up or (0.0, 0.0, 1.0)
    if table.eye is None and table.target is None:
        return overview(bounds, field_of_view(camera), "z", up)
    if table.eye is None or table.target is None:
        given, other = ("eye", "target") if table.target is None else ("target", "eye")
        raise text.error(("camera", given), f"give camera.{other} too, or neither of them")
    if table.eye == table.target:
        raise text.error(("camera", "target"), "this is where the eye is: give a point to look at")
    return look_at(table.eye, table.target, up)


def field_of_view(camera: Camera) -> float:
    """Full angle of the cone around the axis that the image shows, radians; 0 for parallel rays.

    Its border is seen at the border of the image, or where the view ends within it.
    """
    if camera.ray_geometry == "parallel":
        return 0.0
    along, (width, height) = np.linspace(0.0, 1.0, _SAMPLES), (camera.width, camera.height)
    u, v = np.meshgrid(width * along, height * along)
    ray = camera.with_pose(np.eye(4)).ray(np.stack([u, v], -1))
    angle = np.arccos(np.clip(np.where(ray.valid, ray.direction[..., 2], 1.0), -1.0, 1.0))
    border = ray.valid & ((u == 0) | (u == width) | (v == 0) | (v == height))
    return 2.0 * float(angle[border].min() if border.any() else angle.max())


def overview(bounds: np.ndarray, fov: float, axis: str, up: Any = None) -> np.ndarray:
    """Pose that looks at the center of the box from where all of it lies within fov (radians; 0: parallel rays)."""
    toward = np.array([0.6, 0.5, 1.0] if axis == "y" else [0.6, -1.0, 0.5])
    toward /= np.linalg.norm(toward)
    center, corners = _box(bounds)
    along = corners @ toward
    distance = np.max(along + _off_axis(corners, toward) / math.tan(min(_WIDEST, 0.475 * fov) or _WIDEST))
    # a camera that is far away compared to the size of what it sees would round the two to one point
    eye = center + max(distance, 1e-9 * np.abs(center).max()) * toward
    return look_at(eye, center, ((0.0, 1.0, 0.0) if axis == "y" else (0.0, 0.0, 1.0)) if up is None else up)


def _fitting_scale(bounds: np.ndarray, size: tuple[int, int]) -> float:
    """Pixels per unit with which parallel rays of the overview see the whole box, and a little around it."""
    toward = np.array([0.6, -1.0, 0.5]) / np.linalg.norm([0.6, -1.0, 0.5])
    return 0.475 * min(size) / float(np.max(_off_axis(_box(bounds)[1], toward)))


def _off_axis(points: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Distance of each point from the line through the origin along a unit axis."""
    return np.linalg.norm(points - (points @ axis)[:, None] * axis, axis=1)


def _box(bounds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Center (3,) and corners (8, 3) relative to it; a unit cube stands for a box that is a point."""
    center = 0.5 * bounds[0] + 0.5 * bounds[1]
    half = 0.5 * bounds[1] - 0.5 * bounds[0]
    if not half.max() < 1e150:  # whose square would be infinite
        raise InputError("the meshes are too large to place a camera: give camera.eye and camera.target")
    half = half if half.max() > 1e-150 else np.full(3, 0.5)
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return center, signs * half
