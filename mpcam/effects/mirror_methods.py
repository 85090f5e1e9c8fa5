"""The register of methods that show what is seen in a mirror: see `mpcam.rendering.registry`."""

from collections.abc import Sequence
from typing import Any, TypedDict

from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.rendering.registry import METHODS, Method, home


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


class OrderSettings(TypedDict, total=False):
    """How often rays are reflected. bounces: 1 to 8, the mirror counts as one; after it rays go on by the normals
    stored in the images, or by the true ones. reflectance: part of the light that the scene's meshes reflect, one
    number, or one for each mesh. own: whether the mirror is seen in itself, by a depth image of it.
    """

    bounces: int
    reflectance: float | Sequence[float]
    own: bool


class DepthImageSettings(OrderSettings, total=False):
    """Of depth images that the true rays are met with (Rosen et al. 2011, section 6.1). size: pixels along a side.

    By default there is one for each mesh: a single-pole occlusion camera aimed from the mirror at a single thing,
    parallel rays onto a flat one, two views back to back from the mirror's middle for what surrounds it. aside: how far
    around things the first reach, in radii; 0: pinholes. images: a list to take instead, of cameras that see the whole
    scene, pairs of a camera and mesh numbers (see `choose_occlusion_camera`; other meshes get theirs as by default),
    and DepthImages, which stay as they are, with no others chosen. coarse, fine: steps, see `DepthImage.intersect`.
    """

    size: int
    aside: float
    images: Any
    coarse: float | None
    fine: float


class MirrorSettings(TriangleSettings, MirrorVertexSettings, EnvironmentSettings, DepthImageSettings, total=False):
    """Of any method; which of them serve depends on it."""


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
    "depth_image": Method(
        home("mpcam.effects.by_depth_image:ByDepthImages", DepthImageSettings),
        knob="size",
        values=(128, 256, 512, 1024),
        style=("#0a7f6b", "o"),
    ),
    "raytrace": Method(home("mpcam.effects.mirror_parts:ByTracing", OrderSettings), style=METHODS["raytrace"].style),
}
