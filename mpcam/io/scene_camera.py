"""The camera of a scene file: the model that its table names, and a place from which it sees the meshes."""

import math
from typing import Any

import numpy as np

from mpcam.cameras import DoubleSphere, KannalaBrandt, Orthographic, Pinhole, Radial, UnifiedOmni
from mpcam.cameras.profiles import PROFILES
from mpcam.errors import InputError
from mpcam.io.scene_tables import (
    CameraTable,
    DoubleSphereTable,
    KannalaBrandtTable,
    LensTable,
    OrthographicTable,
    PinholeTable,
    RadialTable,
    UnifiedOmniTable,
)
from mpcam.io.scene_text import SceneText
from mpcam.math.pose import look_at

# Half the angle that the meshes may take up: near enough for a fisheye to show its curvature, and outside of them.
_WIDEST = math.radians(65)

Frame = tuple[int, int, float, float, float, float]  # width, height, fx, fy, cx, cy


def default_camera(bounds: np.ndarray, up: str = "z", size: tuple[int, int] = (512, 512)) -> Radial:
    """A paraboloid camera (180 degrees) outside the bounding box of the meshes that looks at its centre.

    bounds: (2, 3) smallest and largest coordinates. up: "y" or "z", the vertical axis; the view is from the front, the
    right and above, where the front is -y with z up and +z with y up. size: width, height in pixels.
    """
    return Radial.paraboloid(*size, camera_from_world=_overview(bounds, math.pi, up))


def build_camera(table: CameraTable, bounds: np.ndarray, text: SceneText) -> Any:
    """The camera that a [camera] table describes; bounds (2, 3) of the meshes place it where it gives no pose.

    Raises InputError, with the line of the key, for poses that are incomplete or given twice, for fields of view that
    the projection cannot reach, and for what the camera itself refuses.
    """
    width, height = table.size
    with text.at("camera"):
        if isinstance(table, RadialTable):
            _check_field_of_view(table, text)
            pose = _pose(table, bounds, math.radians(table.fov), text)
            return Radial(width, height, table.projection, camera_from_world=pose, fov=math.radians(table.fov))
        if isinstance(table, PinholeTable):
            return _pinhole(table, bounds, text)
        if isinstance(table, OrthographicTable):
            scale = table.scale or _fitting_scale(bounds, table.size)
            return Orthographic(width, height, scale=scale, camera_from_world=_pose(table, bounds, 0.0, text))
        if isinstance(table, LensTable):
            return _lens(table, bounds, text)
        raise NotImplementedError(f"no camera for {type(table).__name__}")


def _pinhole(table: PinholeTable, bounds: np.ndarray, text: SceneText) -> Pinhole:
    width, height = table.size
    if table.focal is None:
        if table.center is not None:
            raise text.error(("camera", "center"), "give camera.focal too, or leave center out")
        focal = 0.5 * width / math.tan(0.5 * math.radians(60.0 if table.fov is None else table.fov))
        fx, fy = focal, focal
    elif table.fov is not None:
        raise text.error(("camera", "fov"), "give fov or focal, not both")
    else:
        fx, fy = table.focal
    cx, cy = table.center or (0.5 * width, 0.5 * height)
    narrowest = 2 * math.atan(min(0.5 * width / fx, 0.5 * height / fy))
    return Pinhole(width, height, fx, fy, cx, cy, _pose(table, bounds, narrowest, text))


def _lens(table: LensTable, bounds: np.ndarray, text: SceneText) -> Any:
    width, height = table.size
    center = table.center or (0.5 * width, 0.5 * height)
    frame: Frame = (width, height, *table.focal, *center)
    rest: dict[str, Any] = {"max_angle": math.radians(0.5 * table.fov)}
    if isinstance(table, KannalaBrandtTable):
        camera = KannalaBrandt(*frame, table.k, **rest)
    elif isinstance(table, DoubleSphereTable):
        camera = DoubleSphere(*frame, table.xi, table.alpha, **rest)
    elif isinstance(table, UnifiedOmniTable):
        camera = _unified(table, frame, rest, text)
    else:
        raise NotImplementedError(f"no camera for {type(table).__name__}")
    nearest = [min(c, size - c) / f for c, size, f in zip(center, table.size, table.focal, strict=True)]
    narrowest = 2 * float(camera.angle_at(max(min(nearest), 0.0)))
    return camera.with_pose(_pose(table, bounds, narrowest, text))


def _unified(table: UnifiedOmniTable, frame: Frame, rest: dict[str, Any], text: SceneText) -> UnifiedOmni:
    if (table.alpha is None) == (table.xi is None):
        raise text.error(("camera",), "give either alpha (and beta) or xi")
    if table.xi is None:
        return UnifiedOmni(*frame, table.alpha, 1.0 if table.beta is None else table.beta, **rest)
    if table.beta is not None:
        raise text.error(("camera", "beta"), "give alpha with it, not xi")
    return UnifiedOmni.mei(*frame, table.xi, **rest)


def _check_field_of_view(table: RadialTable, text: SceneText) -> None:
    profile = PROFILES[table.projection]
    limit = 2 * math.degrees(profile.limit)
    if table.fov > limit or (table.fov == limit and not profile.limit_included):
        end = "up to" if profile.limit_included else "below"
        problem = f"the projection {table.projection} reaches {end} {limit:g} degrees"
        raise text.error(("camera", "fov"), problem)


def _pose(table: CameraTable, bounds: np.ndarray, fov: float, text: SceneText) -> Any:
    if table.up is not None and not any(table.up):
        raise text.error(("camera", "up"), "give a direction, e.g. [0, 0, 1]")
    if table.camera_from_world is not None:
        for key in ("eye", "target", "up"):
            if getattr(table, key) is not None:
                raise text.error(("camera", key), f"give camera_from_world or eye and target, not {key} with it")
        return np.array(table.camera_from_world)
    up = table.up or (0.0, 0.0, 1.0)
    if table.eye is None and table.target is None:
        return _overview(bounds, fov, "z", up)
    if table.eye is None or table.target is None:
        given, other = ("eye", "target") if table.target is None else ("target", "eye")
        raise text.error(("camera", given), f"give camera.{other} too, or neither of them")
    if table.eye == table.target:
        raise text.error(("camera", "target"), "this is where the eye is: give a point to look at")
    return look_at(table.eye, table.target, up)


def _overview(bounds: np.ndarray, fov: float, axis: str, up: Any = None) -> np.ndarray:
    """Pose that looks at the centre of the box from where all of it lies within fov (radians; 0: parallel rays)."""
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
    """Centre (3,) and corners (8, 3) relative to it; a unit cube stands for a box that is a point."""
    center = 0.5 * bounds[0] + 0.5 * bounds[1]
    half = 0.5 * bounds[1] - 0.5 * bounds[0]
    if not half.max() < 1e150:  # whose square would be infinite
        raise InputError("the meshes are too large to place a camera: give camera.eye and camera.target")
    half = half if half.max() > 1e-150 else np.full(3, 0.5)
    signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    return center, signs * half
