"""The methods by name: `prepare` for many frames, and `rasterize`, `depth_map` and `coverage_map` for one."""

from typing import Any, Literal, Protocol, Unpack, overload

from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import Bends, HasRays, need
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.explanation import Step
from mpcam.rendering.hits import Hits
from mpcam.rendering.maps import OUTPUTS, CoverageMap, DepthMap
from mpcam.rendering.registry import METHODS, CubemapSettings, InvertSettings, TwoPassSettings, VertexSettings
from mpcam.scene.scene import Scene

Output = Literal["hits", "depth", "coverage"]


class Prepared(Protocol):
    """One camera, mesh and method, ready to give frames."""

    def update(self, vertices: Any = None, *, normals: Any = None, transform: Any = None) -> None:
        """The scene elsewhere: new vertices (V, 3), or a list with one array for each of its meshes, and normals to go
        with them; or a rigid 4x4 transform. See `Moving.update`.
        """
        ...

    def move(self, mesh: Mesh) -> None:
        """The mesh as it is now, of the same faces: see `mpcam.geometry.moved.moved`."""
        ...

    def aim(self, camera: Camera) -> None:
        """Another camera of the same kind, or another pose: nothing of the scene is made again."""
        ...

    def frame(self) -> Any:
        """One frame, evaluated on the device: Hits, DepthMap or CoverageMap."""
        ...

    def stages(self) -> dict[str, float]:
        """Seconds of one frame by stage."""
        ...

    def explain(self) -> tuple[Step, ...]:
        """Which stages a frame takes, which are left out, and why; takes one frame to find out."""
        ...


@overload
def prepare(
    camera: Camera,
    mesh: Mesh | Scene,
    method: Literal["invert"] = "invert",
    *,
    output: Output = "hits",
    **settings: Unpack[InvertSettings],
) -> Prepared: ...


@overload
def prepare(
    camera: Camera, mesh: Mesh | Scene, method: Literal["vertex"], **settings: Unpack[VertexSettings]
) -> Prepared: ...


@overload
def prepare(
    camera: Camera, mesh: Mesh | Scene, method: Literal["two_pass"], **settings: Unpack[TwoPassSettings]
) -> Prepared: ...


@overload
def prepare(
    camera: Camera, mesh: Mesh | Scene, method: Literal["cubemap", "hemicube"], **settings: Unpack[CubemapSettings]
) -> Prepared: ...


@overload
def prepare(
    camera: Camera, mesh: Mesh | Scene, method: str = "invert", *, output: str = "hits", **settings: Any
) -> Prepared: ...


def prepare(
    camera: Camera, mesh: Mesh | Scene, method: str = "invert", *, output: str = "hits", **settings: Any
) -> Prepared:
    """A camera, a mesh and a method, ready to give frames: uploads, trees and tessellations are made here.

    output: what frames hold: "hits", or with method "invert" less and faster: "depth" (a DepthMap) or "coverage" (a
    CoverageMap). settings: for invert `bound` ("tight", "triangle" or "quad"; for cameras that give nothing but rays
    "tight", and for camera triangles "triangle" or "nine_point"), `cull` ("none", "back" or "front": the side of
    triangles that is not shown; corners run counter-clockwise in front), and where there is nothing but rays `culling`
    (see `GeneralRasterizer`); `level` (0 to 7) for vertex; `patch` (2 to 256, samples along a side of a triangle) for
    two_pass; `resolution` (pixels per face) for cubemap and hemicube; none for raytrace. Raises InputError for unknown
    methods and settings, and where a camera lacks what a method needs.
    """
    if not isinstance(camera, Camera):
        raise InputError(
            f"camera is a {type(camera).__name__}: give one of mpcam's cameras, e.g. mpcam.Radial.paraboloid"
        )
    need(camera, HasRays, "a frame")
    if isinstance(camera, Bends) and camera.ray_geometry != "general":
        raise InputError(
            f"rays of a {type(camera).__name__} bend, but its ray_geometry is {camera.ray_geometry!r}, not 'general'"
        )
    if not isinstance(mesh, Mesh):
        mesh = Scene.of(mesh).mesh
    if method not in METHODS:
        raise InputError(f"method={method!r}: allowed are {', '.join(METHODS)}")
    entry = METHODS[method]
    home = entry.home(camera)
    if "bound" not in home.names and settings.get("bound") == "tight":  # the default is nothing to complain of
        settings = {name: value for name, value in settings.items() if name != "bound"}
    for name in settings:
        if name not in home.names:
            allowed = ", ".join(home.names) or "none"
            raise InputError(f"method={method!r} has no setting {name!r}: allowed are {allowed}")
    if output not in OUTPUTS:
        raise InputError(f"output={output!r}: allowed are {', '.join(OUTPUTS)}")
    if output not in entry.outputs:
        raise InputError(f"method={method!r} gives output='hits' only: use method='invert' for output={output!r}")
    if len(entry.outputs) > 1:
        settings = {**settings, "output": output}
    return home.load()(camera, mesh, **settings)


@overload
def rasterize(
    camera: Camera,
    mesh: Mesh | Scene,
    method: Literal["invert"] = "invert",
    **settings: Unpack[InvertSettings],
) -> Hits: ...


@overload
def rasterize(
    camera: Camera, mesh: Mesh | Scene, method: Literal["vertex"], **settings: Unpack[VertexSettings]
) -> Hits: ...


@overload
def rasterize(
    camera: Camera, mesh: Mesh | Scene, method: Literal["two_pass"], **settings: Unpack[TwoPassSettings]
) -> Hits: ...


@overload
def rasterize(
    camera: Camera, mesh: Mesh | Scene, method: Literal["cubemap", "hemicube"], **settings: Unpack[CubemapSettings]
) -> Hits: ...


@overload
def rasterize(camera: Camera, mesh: Mesh | Scene, method: str = "invert", **settings: Any) -> Hits: ...


def rasterize(camera: Camera, mesh: Mesh | Scene, method: str = "invert", **settings: Any) -> Hits:
    """First hits of every pixel's ray on a mesh.

    camera: any of mpcam's cameras, or one of your own. mesh: a Mesh, or a Scene (its meshes as one). method: "invert"
    (exact: bounds each curved triangle and inverts per pixel), "vertex" (projected vertices, straight edges),
    "two_pass" (patches of samples, drawn as small triangles), "cubemap", "hemicube" (resampled linear views),
    "raytrace" (Mitsuba). settings: see `prepare`. Returns Hits with triangle (H, W), barycentric (H, W, 2),
    depth (H, W); fields that are not asked for cost nothing. Raises InputError.
    """
    return prepare(camera, mesh, method, **settings).frame()


def depth_map(camera: Camera, mesh: Mesh | Scene, **settings: Any) -> DepthMap:
    """Distance of the first surface along each pixel's ray; finds no triangles and no weights.

    settings: those of method "invert", see `prepare`. Raises InputError.
    """
    return prepare(camera, mesh, output="depth", **settings).frame()


def coverage_map(camera: Camera, mesh: Mesh | Scene, **settings: Any) -> CoverageMap:
    """Which pixels see any surface; finds no depths.

    settings: those of method "invert", see `prepare`. Raises InputError.
    """
    return prepare(camera, mesh, output="coverage", **settings).frame()
