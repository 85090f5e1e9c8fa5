"""Depth images of the inner side of a thing of glass, which rays that have entered it are met with.

Where the middle of the glass sees all of its inner side, as in anything convex, two views back to back from there hold
the whole of it. Else parallel rays do, from both ends of three axes, those faces that turn to them and those that turn
away apart: of each the surfaces that lie foremost.
"""

from collections.abc import Iterable

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.cameras.orthographic import Orthographic
from mpcam.depth_images.depth_image import DepthImage
from mpcam.effects.depth_image_views import MARGIN, ball_of, used_vertices
from mpcam.effects.lookup import back_to_back
from mpcam.effects.refractor_solid import Solid
from mpcam.math.pose import look_at


def inner_cameras(solid: Solid, size: int) -> tuple[Camera, ...]:
    """The cameras that are chosen; size: pixels along a side."""
    if solid.middle_sees_all:
        return back_to_back(solid.reflector.center, size)
    center, radius = ball_of(used_vertices(solid.mesh))
    scale = size / (2 * MARGIN * radius)
    ends = ((axis, up) for axis, up in zip(np.eye(3), np.roll(np.eye(3), 1, axis=0), strict=True))
    poses = [look_at(center + side * 2 * radius * axis, center, up) for axis, up in ends for side in (-1, 1)]
    return tuple(Orthographic(size, size, scale, camera_from_world=pose) for pose in poses)


def inner_images(solid: Solid, cameras: Iterable[Camera]) -> list[DepthImage]:
    """Of each camera what it sees of the surface from inside and, where there is any, from outside."""
    images = []
    for camera in cameras:
        for cull in ("front", "back"):
            image = DepthImage.render(camera, solid.mesh, color=False, normals=True, cull=cull)
            if np.isfinite(image.depth).any():
                images.append(image)
    return images
