"""Environment maps of scenes: all that is seen from a point (Gascuel et al. 2008, section 5.3)."""

from dataclasses import replace
from typing import Any

from mpcam.effects.environment import EnvironmentMap
from mpcam.effects.lookup import back_to_back, check_size
from mpcam.effects.vectors import as_vector
from mpcam.pictures.render import render
from mpcam.scene.scene import Scene


def environment_map(
    scene: Any, position: Any, size: int = 512, shading: str = "light", method: str = "invert", **settings: Any
) -> EnvironmentMap:
    """Colors of a scene in all directions from a point: two paraboloid views (Gascuel et al. 2008, section 5.3).

    scene: a Scene, a Mesh or several meshes; its mirror or refractor is left out. position (3,): world, away from
    surfaces. size: pixels along a side of each view, 8 to 16384. shading, method and settings: see `render`.
    Raises InputError.
    """
    cameras = back_to_back(as_vector(position, "position"), check_size(size))
    whole = replace(Scene.of(scene), mirror=None, refractor=None)
    front, back = (render(camera, whole, method, shading=shading, **settings) for camera in cameras)
    return EnvironmentMap(position, (front, back))
