"""`render`: an image of a scene, with or without a mirror, by any method."""

import sys
from typing import Any

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.effects.horizon_occlusion import check_screen, screen_occlusion_device
from mpcam.effects.mirror_methods import MIRROR_METHODS
from mpcam.effects.reflection import Reflection
from mpcam.effects.refraction import Refraction
from mpcam.effects.refractor_methods import REFRACTOR_METHODS
from mpcam.effects.relief_picture import ReliefPicture
from mpcam.effects.shadows import shadow_maps
from mpcam.errors import InputError
from mpcam.pictures.explain import explain as explained
from mpcam.rendering.methods import rasterize
from mpcam.rendering.shade import shade
from mpcam.scene.occlusion import Occlusion
from mpcam.scene.scene import Scene


def render(
    camera: Camera,
    scene: Any,
    method: str = "invert",
    *,
    shading: str = "light",
    shadows: bool = False,
    shadow_size: int = 1024,
    occlusion: float | Occlusion | None = None,
    explain: bool = False,
    **settings: Any,
) -> np.ndarray:
    """An image: (H, W, 3) float32, linear RGB.

    scene: a Scene, a Mesh or several meshes. shading: "color", "normal", "texture" or "light" (see `shade`). shadows:
    whether the scene's lights cast shadows, by a shadow map each (see `shadow_map`) that is tested per pixel; for
    shading "light". shadow_size: pixels along a side of those. occlusion: the radius, scene units, within which
    surfaces keep ambient light from each other, by the frame's own depths (see `screen_occlusion`), or an `Occlusion`;
    default the scene's. For Pinhole cameras and shading "light". method and settings: see `rasterize`. To render many
    frames of a still scene, make the maps once and give them to `shade`. A scene with a mirror is shown with what is
    seen in it: by camera triangles with method "invert", by its vertices' images with "vertex", by rays of the true
    surface with "raytrace", by those rays and depth images with "depth_image", or by an "environment" map; for the
    settings, and for many frames, see `Reflection`. Through a refractor the rest is seen by "depth_image", which is
    "invert" too, "environment" or "raytrace"; see `Refraction`. A scene with reliefs is shown with them, by any method
    for the rest; for many frames see `ReliefPicture`. explain: print to standard error which stages run, which are left
    out and why (see
    `mpcam.explain`). Raises InputError.
    """
    named: dict[str, Any] = {"shading": shading, "shadows": shadows, "shadow_size": shadow_size}
    return image_and_depth(camera, scene, method, False, **named, occlusion=occlusion, explain=explain, **settings)[0]


def image_and_depth(
    camera: Camera,
    scene: Any,
    method: str,
    depth: bool,
    *,
    shading: str,
    shadows: bool,
    shadow_size: int,
    occlusion: float | Occlusion | None,
    explain: bool,
    **settings: Any,
) -> tuple[np.ndarray, np.ndarray | None]:
    """The same as `render`, and if wanted the distances (H, W) along the rays; None with a mirror or a refractor."""
    whole = Scene.of(scene)
    if occlusion is None:
        occlusion = whole.occlusion
    elif not isinstance(occlusion, Occlusion):
        occlusion = Occlusion(occlusion)
    seen_on = "mirror" if whole.mirror is not None else "refractor" if whole.refractor is not None else ""
    if seen_on and occlusion is not None:
        raise InputError(f"occlusion is not known for scenes with a {seen_on}: leave one of them out")
    if whole.reliefs and seen_on:
        raise InputError(f"a {seen_on} shows no reliefs: leave one of them out, or give the reliefs as meshes")
    if seen_on:
        return _on_surface(
            camera, whole, seen_on, method, shading, shadow_size if shadows else 0, explain, settings
        ), None
    if whole.reliefs and occlusion is not None:
        raise InputError("occlusion is not known for scenes with reliefs: leave one of them out")
    if occlusion is not None:
        check_screen(camera)
    if explain:
        found = explained(camera, whole, method, shading=shading, shadows=shadows, **settings)
        sys.stderr.write(f"{found}\n")
    maps: Any = ()
    if shadows:
        maps = shadow_maps(whole, shadow_size, shading)
    if whole.reliefs:
        picture = ReliefPicture(whole, camera, method, shading=shading, shadows=maps, **settings)
        return picture.image(), picture.depth() if depth else None
    hits = rasterize(camera, whole.mesh, method, **settings)
    exposure = None if occlusion is None else screen_occlusion_device(hits, occlusion)
    return shade(hits, whole, shading, maps, exposure), hits.depth if depth else None


def _on_surface(
    camera: Camera,
    scene: Scene,
    what: str,
    method: str,
    shading: str,
    shadow_size: int,
    explain: bool,
    settings: dict[str, Any],
) -> np.ndarray:
    """`render` of a scene with a mirror or a refractor."""
    register, make, usual = (
        (MIRROR_METHODS, Reflection, "camera_triangles")
        if what == "mirror"
        else (REFRACTOR_METHODS, Refraction, "depth_image")
    )
    names = {"invert": usual} | {name: name for name in register if name != "camera_triangles"}
    if method not in names:
        raise InputError(f"method={method!r} shows no {what}: allowed are {', '.join(names)}, or leave the {what} out")
    allowed = [name for name in register[names[method]].home(camera).names if name != "cams"]
    for name in settings:
        if name not in allowed:
            raise InputError(
                f"method={method!r} has no setting {name!r} where there is a {what}: allowed are "
                f"{', '.join(allowed) or 'none'}"
            )
    maps: Any = ()
    if shadow_size:
        maps = shadow_maps(scene, shadow_size, shading)
    picture = make(scene, camera, method=names[method], shading=shading, shadows=maps, **settings)
    if explain:
        sys.stderr.write(f"{picture.explanation}\n")
    return picture.image()
