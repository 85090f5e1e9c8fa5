"""A scene: meshes, lights, and the camera that looks at them."""

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mpcam.checks import number_table, shown
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.scene.mirror import Mirror
from mpcam.scene.occlusion import Occlusion
from mpcam.scene.refractor import Refractor

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel light. direction: the way that the light travels, in world axes, stored with length 1.

    radiance: linear RGB that a white diffuse surface facing the light shows. Raises InputError for a zero direction or
    negative radiance.
    """

    direction: Vector
    radiance: Vector = (1.0, 1.0, 1.0)

    def __post_init__(self):
        direction = np.array(_vector(self.direction, "light direction"))
        largest = np.abs(direction).max()
        if largest == 0:
            raise InputError("light direction is (0, 0, 0): give the way the light travels, e.g. (0, 0, -1) for down")
        direction /= largest
        x, y, z = direction / np.sqrt(direction @ direction)
        object.__setattr__(self, "direction", (float(x), float(y), float(z)))
        object.__setattr__(self, "radiance", _vector(self.radiance, "light radiance", positive=True))


@dataclass(frozen=True)
class PointLight:
    """Light from a point. position: world. intensity: linear RGB at distance 1; it falls with the distance squared.

    Raises InputError for anything that is not 3 finite numbers, and for negative intensity.
    """

    position: Vector
    intensity: Vector = (1.0, 1.0, 1.0)

    def __post_init__(self):
        object.__setattr__(self, "position", _vector(self.position, "light position"))
        object.__setattr__(self, "intensity", _vector(self.intensity, "light intensity", positive=True))


Light = DirectionalLight | PointLight


@dataclass(frozen=True, eq=False)
class Scene:
    """What is rendered: meshes in world coordinates, lights, and a camera.

    meshes: one Mesh or several. camera: any mpcam camera, or None. lights: one or several. ambient and background:
    linear RGB. mirror: a curved surface in which `render` and `reflection` show the rest. refractor: a thing of glass
    through which `render` and `refraction` do; a scene has one of the two at most. environment: an
    EnvironmentMap that rays see which miss everything, in place of the background. reliefs: one ReliefInstances or
    several, which `render`, `ReliefPicture` and shadow maps show beside the meshes, and nothing else. occlusion: how
    surfaces keep ambient light from each other in what `render` shows. Raises InputError where a field has the wrong
    kind.
    """

    meshes: tuple[Mesh, ...]
    camera: Any = None
    lights: tuple[Light, ...] = ()
    ambient: Vector = (0.15, 0.15, 0.15)
    background: Vector = (0.0, 0.0, 0.0)
    name: str = "scene"
    mirror: Mirror | None = None
    environment: Any = None
    reliefs: tuple[Any, ...] = ()
    refractor: Refractor | None = None
    occlusion: Occlusion | None = None

    def __post_init__(self):
        object.__setattr__(self, "meshes", _several(self.meshes, Mesh, "meshes", "Mesh"))
        object.__setattr__(self, "lights", _several(self.lights, Light, "lights", "DirectionalLight or PointLight"))
        object.__setattr__(self, "ambient", _vector(self.ambient, "ambient", positive=True))
        object.__setattr__(self, "background", _vector(self.background, "background", positive=True))
        if self.mirror is not None and not isinstance(self.mirror, Mirror):
            raise InputError(f"scene mirror is a {type(self.mirror).__name__}: give mpcam.Mirror(surface)")
        if self.refractor is not None and not isinstance(self.refractor, Refractor):
            raise InputError(f"scene refractor is a {type(self.refractor).__name__}: give mpcam.Refractor(surface)")
        if self.mirror is not None and self.refractor is not None:
            raise InputError("a scene with a mirror and a refractor: neither shows the other, leave one of them out")
        if self.environment is not None and not hasattr(self.environment, "on_device"):
            raise InputError(f"scene environment is a {type(self.environment).__name__}: give an mpcam.EnvironmentMap")
        if self.occlusion is not None and not isinstance(self.occlusion, Occlusion):
            raise InputError(f"scene occlusion is a {type(self.occlusion).__name__}: give mpcam.Occlusion(radius)")
        reliefs = self.reliefs if isinstance(self.reliefs, (list, tuple)) else (self.reliefs,)
        for one in reliefs:
            if not hasattr(one, "placements"):
                raise InputError(
                    f"scene reliefs: a {type(one).__name__} is none: give mpcam.ReliefInstances, such as "
                    "relief.instances(placements)"
                )
        object.__setattr__(self, "reliefs", tuple(reliefs))

    @cached_property
    def mesh(self) -> Mesh:
        """All meshes as one, faces in order; built once. Textures of meshes without uv are left out, with a warning."""
        return Mesh.concatenate(map(_drawable, self.meshes), name=self.name)

    @staticmethod
    def of(x) -> "Scene":
        """x itself if it is a Scene; a Mesh or a sequence of Mesh as a scene without lights; else InputError."""
        if isinstance(x, Scene):
            return x
        if isinstance(x, Mesh):
            return Scene((x,), name=x.name or "scene")
        if isinstance(x, (list, tuple)):
            return Scene(tuple(x))
        raise InputError(f"a {type(x).__name__} is not a scene: give a Scene, a Mesh or a list of Mesh (see load_mesh)")


def _drawable(mesh: Mesh) -> Mesh:
    """The mesh, without textures if it has no texture coordinates: put together with others, it would get some."""
    if mesh.uv is not None or all(material.texture is None for material in mesh.materials):
        return mesh
    warnings.warn(
        f"mesh {mesh.name!r} has a texture, but no texture coordinates (uv): it is drawn without the texture",
        stacklevel=4,
    )
    return replace(mesh, materials=tuple(replace(material, texture=None) for material in mesh.materials))


def _several(value, kind, name: str, allowed: str) -> tuple:
    items = (value,) if isinstance(value, kind) else value
    if not isinstance(items, (list, tuple)) or not all(isinstance(item, kind) for item in items):
        raise InputError(f"scene {name} is a {type(value).__name__}: give a tuple of {allowed}")
    return tuple(items)


def _vector(value, name: str, positive: bool = False) -> Vector:
    array = number_table(value)
    if array.shape != (3,) or not np.all(np.isfinite(array)) or (positive and np.any(array < 0)):
        raise InputError(f"{name} is {shown(value)}: give 3 finite numbers{', none negative' if positive else ''}")
    return (float(array[0]), float(array[1]), float(array[2]))
