"""The register of methods that show what is seen in a mirror: see `mpcam.rendering.registry`."""

from typing import TypedDict

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.rendering.registry import METHODS, Method, NoSettings, home


class TriangleSettings(TypedDict, total=False):
    """triangles, resolution: in place of the mirror's. cams: camera triangles to take instead of decomposing it."""

    triangles: int
    resolution: int
    cams: CameraTriangles


class MirrorVertexSettings(TypedDict, total=False):
    """triangles: of the decomposition in which images are looked for. level: edges are split 2**level times first."""

    triangles: int
    level: int
    cams: CameraTriangles


class EnvironmentSettings(TypedDict, total=False):
    """size: pixels along a side of the two views."""

    size: int


MIRROR_METHODS: dict[str, Method] = {
    "camera_triangles": Method(
        home("mpcam.effects.mirror_parts:ByTriangles", TriangleSettings),
        knob="triangles",
        values=(26, 52, 104, 208, 416, 1664),
        style=("#0b62c4", "v"),
    ),
    "vertex": Method(
        home("mpcam.effects.mirror_parts:ByVertices", MirrorVertexSettings),
        knob="level",
        values=METHODS["vertex"].values,
        style=METHODS["vertex"].style,
    ),
    "environment": Method(
        home("mpcam.effects.mirror_parts:ByEnvironment", EnvironmentSettings),
        knob="size",
        values=(64, 256, 1024),
        style=("#8a3fb0", "D"),
    ),
    "raytrace": Method(home("mpcam.effects.mirror_parts:ByTracing", NoSettings), style=METHODS["raytrace"].style),
}
