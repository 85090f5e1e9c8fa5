"""Pictures of scenes seen through a thing of glass, by two interfaces (Wyman 2005; Rosen et al. 2011, section 6.1).

Where the eye's pixels see the glass, rays are bent at its first interface, and again where they leave through a second
one. The leaving rays are looked up in depth images of the scene, or in an environment map, or traced.
"""

import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Unpack

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.ray_map import RayMap
from mpcam.cameras.types import Ray
from mpcam.depth_images.depth_image import check_camera
from mpcam.effects.by_depth_image import ByDepthImages
from mpcam.effects.depth_image_choice import DepthImageChoice, choice_of
from mpcam.effects.lookup import check_size
from mpcam.effects.mirror_parts import ByEnvironment, ByTracing, MirrorPart
from mpcam.effects.refracted_rays import Inside, refracted_rays
from mpcam.effects.refractor_methods import REFRACTOR_METHODS, RefractorSettings
from mpcam.effects.refractor_rays import RefractorRays
from mpcam.effects.refractor_solid import solid_of
from mpcam.effects.surface_picture import SurfacePicture
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.explanation import Step
from mpcam.scene.refractor import Refractor, check_inside
from mpcam.scene.scene import Scene

SECOND_SAID = {
    "march": "met in depth images of the glass's inner side",
    "wyman": "guessed from the thickness, its normal looked up in the eye's view of the inner side",
    "trace": "traced, as the first one",
    "none": "none: light is bent once",
}


class Refraction(SurfacePicture):
    """Frames of a scene with a thing of glass; what does not change with the scene's vertices is made here.

    scene: its meshes are seen through the glass and beside it. refractor: default the scene's. camera: with a common
    center, outside of the glass; default the scene's. method: what leaving rays see: "depth_image", depth images of
    the scene that they are met with; "environment", an environment map from the middle of the glass, two views of
    `size` (512) pixels; "raytrace", the scene, traced by Mitsuba. shading, shadows: as for `Reflection`; the glass
    throws no shadow. settings: of the method, see `GlassDepthImageSettings`, `GlassEnvironmentSettings` and
    `InsideSettings`.

    How rays come to leave the glass is told by `second`. "march": they are met with depth images of its inner side, and
    follow `inner` total reflections there. "wyman": the second interface is guessed from the thickness of the glass
    along the eye's ray and along the normal, and its normal is looked up where the eye would see it (Wyman 2005); it is
    the quickest, knows no inner reflections, and needs a camera with one image for each point. "none": rays are bent
    once. "trace": Mitsuba's hits on the true surface, in double precision, for both interfaces; this is the default of
    method "raytrace", and with it the truth. The others rasterize the first interface.

    Where light cannot get in, or is still inside after `inner` total reflections, a pixel is black. Where no second
    interface is found, a ray runs on as it is. Light that leaves the glass is not bent by it again. With fresnel=True
    each pixel is the sum of what is seen through the glass and of what its outer side reflects.

    Raises InputError for a scene without refractor or camera, a surface that is not closed, an eye inside of it, and
    other values.
    """

    @exclusive
    def __init__(
        self,
        scene: Scene,
        camera: Camera | None = None,
        refractor: Refractor | None = None,
        *,
        method: str = "depth_image",
        shading: str = "light",
        shadows: Sequence[Any] = (),
        **settings: Unpack[RefractorSettings],
    ):
        found = refractor if refractor is not None else scene.refractor
        if found is None:
            raise InputError(
                f"scene {scene.name!r} has no refractor: give it one, mpcam.Refractor(surface), or pass refractor="
            )
        if not isinstance(found, Refractor):
            raise InputError(f"refractor is a {type(found).__name__}: give mpcam.Refractor(surface)")
        super().__init__(scene, camera, method, shading, shadows, REFRACTOR_METHODS, settings, "refractor")
        self.refractor = found
        self.solid = solid_of(found.surface)
        if self.solid.holds(np.asarray(self.camera.eye)):
            raise InputError("the camera is inside of the refractor: put it outside, or use mpcam.Mirror(index=...)")
        self.choice = self._choice()
        self.inside = self._inside()
        self.part = self._part()

    def _choice(self) -> DepthImageChoice:
        """The depth images: the refractor's, and what was given instead."""
        of_scene = ("size", "aside", "images", "coarse", "fine")
        given = {name: value for name, value in self._settings.items() if name in of_scene}
        if self.method == "environment" and "size" in given:
            check_size(given.pop("size"))
        return choice_of(self.scene, **(dict(self.refractor.depth_images or {}) | given))

    def _inside(self) -> Inside:
        """How rays come through the glass."""
        glass, given = self.refractor, self._settings
        own = "trace" if self.method == "raytrace" else glass.second
        second = given.get("second", own)
        inner, fresnel = given.get("inner", glass.inner), given.get("fresnel", glass.fresnel)
        check_inside(second, inner, fresnel)
        cameras = given.get("inside")
        if cameras is not None:
            if second != "march":
                raise InputError(f"inside= goes with second='march', not with {second!r}: leave one of them out")
            cameras = (cameras,) if isinstance(cameras, Camera) else tuple(cameras)
            if not cameras:
                raise InputError("inside=[]: give cameras, or leave it out for some to be chosen")
            for one in cameras:
                check_camera(one)
        choice = self.choice
        return Inside(glass.index, second, inner, fresnel, cameras, choice.size, choice.coarse, choice.fine)

    def _part(self) -> MirrorPart:
        """What is seen along the leaving rays, and along those that the outer side reflects."""
        found, camera, mesh = self.rays, self.camera, self.scene.mesh
        ray, weights = found.ray, [np.where(found.ray.valid, found.share, 0.0)[:, None] * self.refractor.color]
        if found.reflected is not None:
            ray = Ray(*(np.concatenate(both) for both in zip(ray, found.reflected, strict=True)))
            weights.append(np.repeat(found.part[:, None], 3, axis=1))
        if self.method == "depth_image":
            shadows: Callable[[], Sequence[Any]] = lambda: self.shadows  # noqa: E731
            rays = camera.eye, ray, camera.width
            part: MirrorPart = ByDepthImages(self.scene, self.refractor, *rays, self.shading, shadows, self.choice)
        elif self.method == "environment":
            size = self._settings.get("size", 512)
            part = ByEnvironment(mesh, self.refractor.surface, ray, size, self.shaded)
        else:
            shape = len(weights) * camera.height, camera.width, 3
            pixels = RayMap(np.reshape(ray.origin, shape), np.reshape(ray.direction, shape))
            part = ByTracing(pixels, mesh, ray, self.shaded)
        return Weighted(part, weights)

    @property
    def tint(self) -> tuple[float, float, float]:
        return 1.0, 1.0, 1.0  # the weights of the parts have it

    def _steps(self) -> Iterator[Step]:
        traced = self.inside.second == "trace"
        yield Step("first interface", True, "traced" if traced else "rasterized, bent per pixel; made once")
        second, lost = self.inside.second, int(self.rays.missing.sum())
        yield Step("second interface", second != "none", f"{SECOND_SAID[second]}; {lost} rays find none")
        why = "of the outer side, by Fresnel's equations" if self.inside.fresnel else "fresnel=True asks for it"
        yield Step("reflection", self.inside.fresnel, why)
        for name, text in self.part.stages.items():
            yield Step(name.replace("the true surface", "the glass"), True, text)

    @functools.cached_property
    def rays(self) -> RefractorRays:
        """The rays that leave the glass."""
        return refracted_rays(self.camera, self.solid, self.inside)


class Weighted:
    """A part whose rays are one or several for each pixel, one set after the other: their sum, with weights (N, 3)."""

    def __init__(self, part: MirrorPart, weights: Sequence[np.ndarray]):
        import drjit as dr

        from mpcam_kernels.threads import threads

        self.part, self.stages, count = part, part.stages, len(weights[0])
        self._pixels = threads(types(), 0, count), dr.opaque(types().UInt, count)
        self._weights = [
            types().Array3f(*(types().Float(aligned(part)) for part in w.T)) + opaque_zero() for w in weights
        ]

    def move(self, mesh: Mesh) -> None:
        self.part.move(mesh)

    def colors(self) -> list[Any]:
        return list(_sum()(*self._pixels, self.part.colors(), self._weights))


@functools.cache
def _sum() -> Any:
    """Kernel for any number of pixels: it comes in, since what a kernel counts itself is kept from the first call."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(pixel: Any, count: Any, colors: list[Any], weights: list[Any]) -> Any:
        t, result = types(), types().Array3f(0.0)
        for number, weight in enumerate(weights):
            result += weight * t.Array3f(*(dr.gather(t.Float, part, pixel + number * count) for part in colors))
        return result

    return kernel


def refraction(
    scene: Scene, camera: Camera | None = None, refractor: Refractor | None = None, **settings: Any
) -> np.ndarray:
    """A picture of a scene seen through a thing of glass: (H, W, 3) float32, linear RGB.

    settings: see `Refraction`, which is to be kept for many frames. Raises InputError as it does.
    """
    if isinstance(scene, (Mesh, list, tuple)):
        scene = Scene.of(scene)
    return Refraction(scene, camera, refractor, **settings).image()
