"""The methods by name, and the two calls that most users need: `rasterize` and `render`."""

import sys
from typing import Any, Protocol

import numpy as np

from mpcam.cameras.base import Camera
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.hits import Hits
from mpcam.rendering.maps import OUTPUTS
from mpcam.rendering.shade import shade
from mpcam.scene.scene import Scene

METHODS = ("invert", "vertex", "cubemap", "hemicube", "raytrace")


class Prepared(Protocol):
    """One camera, mesh and method, ready to give frames."""

    def update(self, vertices: np.ndarray) -> None:
        """New positions (V, 3) of the mesh's vertices, world frame."""
        ...

    def frame(self) -> Any:
        """One frame, evaluated on the device: Hits, DepthMap or CoverageMap."""
        ...

    def stages(self) -> dict[str, float]:
        """Seconds of one frame by stage."""
        ...


def prepare(
    camera: Camera, mesh: Mesh | Scene, method: str = "invert", *, output: str = "hits", **settings: Any
) -> Prepared:
    """A camera, a mesh and a method, ready to give frames: uploads, trees and tessellations are made here.

    output: what frames hold: "hits", or with method "invert" less and faster: "depth" (a DepthMap) or "coverage" (a
    CoverageMap). settings: for invert `bound` ("tight", "triangle" or "quad") and `cull` ("none", "back" or "front":
    the side of triangles that is not shown; corners run counter-clockwise in front); `level` (0 to 7) for vertex;
    `resolution` (pixels per face) for cubemap and hemicube; none for raytrace. Raises InputError for unknown methods
    and settings, and where a method cannot serve the camera.
    """
    if not isinstance(camera, Camera):
        raise InputError(
            f"camera is a {type(camera).__name__}: give one of mpcam's cameras, e.g. mpcam.Radial.paraboloid"
        )
    if not isinstance(mesh, Mesh):
        mesh = Scene.of(mesh).mesh
    alike = camera.ray_geometry != "general"
    invert = ("bound", "cull") if alike else ("bound", "cull", "culling")
    kinds = {"invert": invert, "vertex": ("level",), "cubemap": ("resolution",), "hemicube": ("resolution",)}
    if method not in METHODS:
        raise InputError(f"method={method!r}: allowed are {', '.join(METHODS)}")
    allowed = kinds.get(method, ())
    if "bound" not in allowed and settings.get("bound") == "tight":  # the default is nothing to complain of
        settings = {name: value for name, value in settings.items() if name != "bound"}
    for name in settings:
        if name not in allowed:
            raise InputError(f"method={method!r} has no setting {name!r}: allowed are {', '.join(allowed) or 'none'}")
    if output not in OUTPUTS:
        raise InputError(f"output={output!r}: allowed are {', '.join(OUTPUTS)}")
    if method == "invert":
        settings = {**settings, "output": output}
    elif output != "hits":
        raise InputError(f"method={method!r} gives output='hits' only: use method='invert' for output={output!r}")
    return _kind(method, camera)(camera, mesh, **settings)


def _kind(method: str, camera: Camera) -> Any:
    """The class of a method for a camera; each is imported only when it is asked for."""
    if method == "invert" and camera.ray_geometry == "general":
        from mpcam.rendering.bundled import Bundled

        return Bundled
    if method == "invert":
        from mpcam.rendering.invert import Inverted

        return Inverted
    if method == "vertex":
        from mpcam.rendering.vertex import VertexProjected

        return VertexProjected
    if method == "raytrace":
        from mpcam.truth.raytrace import RayTraced

        return RayTraced
    from mpcam.rendering.cubemap import Cubemapped, Hemicubed

    return Cubemapped if method == "cubemap" else Hemicubed


def rasterize(camera: Camera, mesh: Mesh | Scene, method: str = "invert", **settings: Any) -> Hits:
    """First hits of every pixel's ray on a mesh.

    camera: any of mpcam's cameras. mesh: a Mesh, or a Scene (its meshes as one). method: "invert" (exact: bounds each
    curved triangle and inverts per pixel), "vertex" (projected vertices, straight edges), "cubemap", "hemicube"
    (resampled linear views), "raytrace" (Mitsuba). settings: see `prepare`. Returns Hits with triangle (H, W),
    barycentric (H, W, 2), depth (H, W); fields that are not asked for cost nothing. Raises InputError.
    """
    return prepare(camera, mesh, method, **settings).frame()


def render(
    camera: Camera,
    scene: Any,
    method: str = "invert",
    *,
    shading: str = "light",
    shadows: bool = False,
    shadow_size: int = 1024,
    explain: bool = False,
    **settings: Any,
) -> np.ndarray:
    """An image: (H, W, 3) float32, linear RGB.

    scene: a Scene, a Mesh or several meshes. shading: "color", "normal", "texture" or "light" (see `shade`). shadows:
    whether the scene's lights cast shadows, by a shadow map each (see `shadow_map`) that is tested per pixel; for
    shading "light". shadow_size: pixels along a side of those. method and settings: see `rasterize`. To render many
    frames of a still scene, make the maps once and give them to `shade`. A scene with a mirror is shown with what is
    seen in it: by camera triangles with method "invert", by its vertices' images with "vertex", by rays of the true
    surface with "raytrace", or by an "environment" map; for the settings, and for many frames, see `Reflection`.
    explain: print to standard error which stages run, which are left out and why (see `mpcam.explain`). Raises
    InputError.
    """
    whole = Scene.of(scene)
    if whole.mirror is not None:
        return _mirrored(camera, whole, method, shading, shadow_size if shadows else 0, explain, settings)
    if explain:
        from mpcam.rendering.explain import explain as explained

        found = explained(camera, whole, method, shading=shading, shadows=shadows, **settings)
        sys.stderr.write(f"{found}\n")
    maps: Any = ()
    if shadows:
        from mpcam.effects.shadows import shadow_maps

        maps = shadow_maps(whole, shadow_size, shading)
    return shade(rasterize(camera, whole.mesh, method, **settings), whole, shading, maps)


def _mirrored(
    camera: Camera, scene: Scene, method: str, shading: str, shadow_size: int, explain: bool, settings: dict[str, Any]
) -> np.ndarray:
    """`render` of a scene with a mirror."""
    from mpcam.effects.reflection import SETTINGS, Reflection

    names = {"invert": "camera_triangles"} | {name: name for name in ("vertex", "environment", "raytrace")}
    if method not in names:
        raise InputError(f"method={method!r} shows no mirror: allowed are {', '.join(names)}, or leave the mirror out")
    allowed = [name for name in SETTINGS[names[method]] if name != "cams"]
    for name in settings:
        if name not in allowed:
            raise InputError(
                f"method={method!r} has no setting {name!r} where there is a mirror: allowed are "
                f"{', '.join(allowed) or 'none'}"
            )
    maps: Any = ()
    if shadow_size:
        from mpcam.effects.shadows import shadow_maps

        maps = shadow_maps(scene, shadow_size, shading)
    picture = Reflection(scene, camera, method=names[method], shading=shading, shadows=maps, **settings)
    if explain:
        sys.stderr.write(f"{picture.explanation}\n")
    return picture.image()
