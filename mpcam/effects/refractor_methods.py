"""The register of methods that show what is seen through glass: see `mpcam.rendering.registry`."""

from typing import Any, TypedDict

from mpcam.effects.mirror_methods import MIRROR_METHODS
from mpcam.rendering.registry import METHODS, Method, home


class InsideSettings(TypedDict, total=False):
    """second, inner, fresnel: in place of the refractor's, see `Refraction`. inside: cameras, one or a list, whose
    depth images of the surface rays inside are met with, for second "march"; chosen where not given."""

    second: str
    inner: int
    fresnel: bool
    inside: Any


class GlassEnvironmentSettings(InsideSettings, total=False):
    """size: pixels along a side of the two views."""

    size: int


class GlassDepthImageSettings(InsideSettings, total=False):
    """size, aside, images, coarse, fine: of depth images of the scene, see `DepthImageSettings`; size, coarse and fine
    are those of depth images inside the glass too."""

    size: int
    aside: float
    images: Any
    coarse: float | None
    fine: float


class RefractorSettings(GlassEnvironmentSettings, GlassDepthImageSettings, total=False):
    """Of any method; which of them serve depends on it."""


REFRACTOR_METHODS: dict[str, Method] = {
    "environment": Method(
        home("mpcam.effects.mirror_parts:ByEnvironment", GlassEnvironmentSettings),
        knob="size",
        values=MIRROR_METHODS["environment"].values,
        style=MIRROR_METHODS["environment"].style,
    ),
    "depth_image": Method(
        home("mpcam.effects.by_depth_image:ByDepthImages", GlassDepthImageSettings),
        knob="size",
        values=MIRROR_METHODS["depth_image"].values,
        style=MIRROR_METHODS["depth_image"].style,
    ),
    "raytrace": Method(home("mpcam.effects.mirror_parts:ByTracing", InsideSettings), style=METHODS["raytrace"].style),
}
