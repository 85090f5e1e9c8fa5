"""The built-in scenes: each built-in mesh from a place that shows it, under a sun and a blue sky."""

from typing import NamedTuple

from mpcam.cameras import Radial
from mpcam.geometry.builtin import builtin_mesh
from mpcam.math.pose import look_at
from mpcam.scene.scene import DirectionalLight, Scene


class _View(NamedTuple):
    """Where the camera stands, where it looks, and which way the sunlight travels."""

    eye: tuple[float, float, float] = (0.0, 0.0, 1.6)
    target: tuple[float, float, float] = (1.0, 0.0, 1.6)
    sun: tuple[float, float, float] = (0.4, 0.5, -0.8)


_VIEWS = {
    "facade": _View(target=(1.0, 0.0, 1.95), sun=(0.25, 0.42, -0.87)),
    "temple": _View(target=(1.0, 0.0, 2.1)),
    "characters": _View(target=(0.0, 1.0, 1.25), sun=(-0.4, 0.5, -0.75)),
    "patio": _View(target=(1.0, 0.25, 1.9)),
    "sphere": _View(eye=(0.0, -1.25, 0.0), target=(0.0, 0.0, 0.0)),
    "plane": _View(eye=(0.0, -0.35, 0.5), target=(0.0, 0.0, 0.0)),
    "cube": _View(eye=(-1.3, -1.7, 1.4), target=(0.0, 0.0, 0.0)),
    "knot": _View(eye=(0.3, -2.1, 0.9), target=(0.0, 0.0, 0.0)),
    "teapot": _View(eye=(0.3, -1.25, 0.95), target=(0.0, 0.0, 0.5)),
    "barrel": _View(eye=(0.2, -0.62, 0.95), target=(0.0, 0.0, 0.45)),
    "car": _View(eye=(1.5, -1.5, 1.5), target=(0.0, 0.0, 0.5)),
    "statue": _View(eye=(1.6, -2.3, 1.9), target=(-0.3, 0.0, 1.1)),
    "maze": _View(eye=(0.0, -5.5, 1.2), target=(0.0, 0.0, 1.1)),
}


def builtin_scene(name: str, width: int = 512, height: int = 512, triangles: int | None = None) -> Scene:
    """The mesh of that name with a paraboloid camera (180 degrees) in a good place, a sun, and a blue sky behind.

    width, height: pixels. triangles: see builtin_mesh. Raises InputError as builtin_mesh does.
    """
    mesh = builtin_mesh(name, triangles)
    view = _VIEWS.get(name, _View())
    return Scene(
        (mesh,),
        camera=Radial.paraboloid(width, height, camera_from_world=look_at(view.eye, view.target)),
        lights=(DirectionalLight(view.sun, (0.8, 0.77, 0.7)),),
        ambient=(0.28, 0.3, 0.34),
        background=(0.33, 0.55, 0.86),
        name=name,
    )
