"""The register of methods: a new one is a class in a file of its own and an entry here.

From here methods are found by name, their settings are checked and shown by editors, comparisons know what to vary, and
plots how to draw them.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any, Literal, TypedDict, get_args

from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Images, Outlines
from mpcam.cameras.linear_pieces import linear_pieces

Cull = Literal["none", "back", "front"]
Culling = Literal["objects", "triangles"]
OutlineBound = Literal["tight", "triangle", "quad"]
RayBound = Literal["tight", "triangle", "nine_point"]


class OutlineSettings(TypedDict, total=False):
    """Of `invert` where a camera outlines triangles. bound: see `Inverted`. cull: the side that is not shown."""

    bound: OutlineBound
    cull: Cull


class RaySettings(TypedDict, total=False):
    """Of `invert` where a camera gives nothing but rays. bound, cull and culling: see `GeneralRasterizer`."""

    bound: RayBound
    cull: Cull
    culling: Sequence[Culling]


class InvertSettings(TypedDict, total=False):
    """Of `invert` for any camera; which of them serve depends on the camera."""

    bound: Literal["tight", "triangle", "quad", "nine_point"]
    cull: Cull
    culling: Sequence[Culling]


class VertexSettings(TypedDict, total=False):
    """level: every edge is split 2**level times first, 0 to 7."""

    level: int


class TwoPassSettings(TypedDict, total=False):
    """patch: samples along each side of a triangle, 2 to 256."""

    patch: int


class CubemapSettings(TypedDict, total=False):
    """resolution: pixels along the sides of a face, 1 to 16384."""

    resolution: int


class NoSettings(TypedDict, total=False):
    """Nothing can be set."""


@dataclass(frozen=True)
class Home:
    """Where a method lives, as "module:class", and the TypedDict of its settings."""

    path: str
    settings: type

    @property
    def names(self) -> tuple[str, ...]:
        """The settings by name."""
        return tuple(self.settings.__annotations__)

    def load(self) -> Any:
        """The class, imported when it is asked for."""
        module, _, name = self.path.partition(":")
        return getattr(import_module(module), name)


@dataclass(frozen=True)
class Method:
    """A method of rasterizing, or of showing a mirror.

    home: for a camera. outputs: what frames may hold. knob: the setting that trades time for error, and the values of
    it that comparisons try; None where there is none. style: color and marker in plots. usual: whether comparisons try
    it for a camera without being asked.
    """

    home: Callable[[Camera], Home]
    outputs: tuple[str, ...] = ("hits",)
    knob: str | None = None
    values: tuple[int, ...] = ()
    style: tuple[str, str] = ("#8a6d00", "P")
    usual: Callable[[Camera], bool] = lambda camera: True


def outlined(camera: Camera) -> bool:
    """Whether images of triangles are outlined from their corners, which is faster than from the pixels' rays."""
    capability = {"central": Outlines, "parallel": Images, "general": None}[camera.ray_geometry]
    return capability is not None and isinstance(camera, capability)


def _invert(camera: Camera) -> Home:
    if outlined(camera):
        return Home("mpcam.rendering.invert:Inverted", OutlineSettings)
    return Home("mpcam.rendering.general:GeneralRasterizer", RaySettings)


def home(path: str, settings: type) -> Callable[[Camera], Home]:
    """One home for all cameras; the class refuses those that lack what it needs."""
    return lambda camera: Home(path, settings)


CULLS, CULLING = get_args(Cull), get_args(Culling)
OUTLINE_BOUNDS, RAY_BOUNDS = get_args(OutlineBound), get_args(RayBound)

# Colors that stay apart for color-blind readers (after Okabe and Ito), darkened for white paper; shapes tell too.
METHODS: dict[str, Method] = {
    "invert": Method(_invert, ("hits", "depth", "coverage"), style=("#0b62c4", "o")),
    "vertex": Method(
        home("mpcam.rendering.vertex:VertexProjected", VertexSettings),
        knob="level",
        values=(0, 1, 2, 3, 4),
        style=("#c2560b", "^"),
    ),
    "two_pass": Method(
        home("mpcam.rendering.two_pass:TwoPass", TwoPassSettings),
        knob="patch",
        values=(5, 10, 20),
        style=("#b0306a", "v"),
        usual=lambda camera: linear_pieces(camera) is not None,
    ),
    "cubemap": Method(
        home("mpcam.rendering.cubemap:Cubemapped", CubemapSettings),
        knob="resolution",
        values=(64, 128, 256, 512),
        style=("#0a7f6b", "s"),
    ),
    "hemicube": Method(
        home("mpcam.rendering.cubemap:Hemicubed", CubemapSettings),
        knob="resolution",
        values=(64, 128, 256, 512),
        style=("#8a3fb0", "D"),
    ),
    "raytrace": Method(home("mpcam.rendering.raytrace:RayTraced", NoSettings), style=("#3c4043", "X")),
}
