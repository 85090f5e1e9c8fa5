"""Depth images: what a camera sees, kept as depth and color per pixel, for rays to meet (Rosen et al. 2011).

A depth image stands for a scene where rays are asked, one by one, what they hit first: reflected or refracted rays,
rays towards lights, rays of other eyes. Any camera with one image of a point serves; those that are not pinholes reach
around what they look at, so that fewer of the rays' true hits are missing.
"""

from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.capabilities import HasRays, Projects, need
from mpcam.depth_images.intersections import Intersections
from mpcam.depth_images.march import marched
from mpcam.depth_images.pieces import straight_surface, walked, with_frusta
from mpcam.depth_images.rays import far_of, rays_of, side_for
from mpcam.depth_images.slopes import plane_slopes
from mpcam.depth_images.surface import device_surface
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.registry import METHODS
from mpcam.rendering.shade import check_shading, shade_device
from mpcam.scene.scene import Scene

Walk = Literal["march", "pieces"]
WALKS = get_args(Walk)


class DepthImage:
    """Depth, and if wanted color and normals, of each pixel of a camera.

    camera: any with one image for each point (`images_per_point` 1). depth: (H, W), length along the pixel's ray, scene
    units; infinite, or anything that is not a finite number from 0 on: nothing there. color: (H, W, 3), linear RGB.
    normals: (H, W, 3), world, any length, 0 where there is none. Raises InputError for cameras that have no image of a
    point, or more than one, and for other shapes.
    """

    def __init__(self, camera: Camera, depth: Any, color: Any = None, normals: Any = None):
        check_camera(camera)
        self.camera = camera
        self._source: Any = None
        self._frame: Any = None
        self._kept: dict[Any, Any] = {}
        values = _numbers("depth", depth, (camera.height, camera.width))
        with np.errstate(invalid="ignore"):
            values = np.where(np.isfinite(values) & (values >= 0), values, np.inf)
        self.device_depth = _upload(values)
        self._color, self._normals = (
            None if given is None else _vectors(name, given, (camera.height, camera.width, 3))
            for name, given in (("color", color), ("normals", normals))
        )

    @classmethod
    def render(
        cls,
        camera: Camera,
        scene: Any,
        method: str = "invert",
        *,
        color: bool = True,
        normals: bool = False,
        planes: bool = True,
        shading: str = "light",
        shadows: Any = (),
        **settings: Any,
    ) -> "DepthImage":
        """A depth image of a Scene, a Mesh or several meshes, all on the device.

        method: see `prepare`; "invert" is exact, "vertex" (straight edges between projected corners) is the paper's.
        color: whether hits shall have colors, by `shading` and `shadows` (see `shade`). normals: whether they shall
        have shading normals, which face the camera. planes: whether the surface goes on to the edges of its pixels by
        the planes of the triangles; without, by the differences of depths, which is a little faster and less exact
        along silhouettes and creases. settings: of the method. Raises InputError as `prepare` and `shade` do.
        """
        check_camera(camera)
        check_shading(shading)
        whole = Scene.of(scene)
        image = cls.__new__(cls)
        image.camera, image._kept = camera, {}
        alone = not (color or normals or planes) and method in METHODS and "depth" in METHODS[method].outputs
        settings = {**settings, "output": "depth"} if alone else settings
        prepared: Any = prepare(camera, whole.mesh, method, **settings)
        image._source = _Source(whole, prepared, color, normals, planes, shading, shadows)
        image._take()
        return image

    @exclusive
    def _take(self) -> None:
        """The frame as the source has it now."""
        self._kept = {}
        self._frame = self._source.prepared.frame()
        self.device_depth = self._frame.device_depth

    @exclusive
    def update(self, vertices: Any = None, *, normals: Any = None, transform: Any = None) -> None:
        """The scene elsewhere: the image is rendered anew, and is what `render` makes of the moved scene, to the bit.

        vertices, normals, transform: see `Prepared.update`. Raises InputError for an image that was not rendered from a
        scene, and as `Prepared.update` does.
        """
        if self._source is None:
            raise InputError(
                "update() moves the scene that a depth image was rendered from, and this one was made from arrays: "
                "use DepthImage.render(camera, scene), or make a new DepthImage"
            )
        self._source.prepared.update(vertices, normals=normals, transform=transform)
        self._take()

    @exclusive
    def move(self, mesh: Mesh, shadows: Any = None, camera: Camera | None = None) -> None:
        """The mesh as it is now, of the same faces: see `Prepared.move`. shadows: the maps as they are now. camera:
        another, of the same kind. Raises InputError as `update`.
        """
        if self._source is None:
            raise InputError("move() renders a scene anew, and this depth image was made from arrays: make a new one")
        if shadows is not None:
            self._source = replace(self._source, shadows=shadows)
        if camera is not None:
            check_camera(camera)
            self._source.prepared.aim(camera)
            self.camera = camera
        self._source.prepared.move(mesh)
        self._take()

    @exclusive
    def aim(self, camera: Camera) -> None:
        """The view of another camera of the same kind, or from another pose. Raises InputError as `update` does."""
        if self._source is None:
            raise InputError("aim() renders a scene anew, and this depth image was made from arrays: make a new one")
        check_camera(camera)
        self._source.prepared.aim(camera)
        self.camera = camera
        self._take()

    @property
    def hits(self) -> Hits | None:
        """The first hits that the image was rendered from; None for depth alone, and for images from arrays."""
        return self._frame if self._source is not None and isinstance(self._frame, Hits) else None

    @property
    def depth(self) -> np.ndarray:
        """(H, W) float32, length along the pixel's ray, infinite where nothing is."""
        return np.asarray(self.device_depth.numpy()).reshape(self.camera.height, self.camera.width)

    @property
    def color(self) -> np.ndarray | None:
        """(H, W, 3) float32, linear RGB; None for an image without."""
        return self._image(self.device_color)

    @property
    def normals(self) -> np.ndarray | None:
        """(H, W, 3) float32, world; None for an image without."""
        return self._image(self.device_normals)

    @property
    def device_color(self) -> Any:
        """Array3f, one entry per pixel; None for an image without. Shaded when it is first asked for."""
        if self._source is None:
            return self._color
        return self._shaded("color", self._source.shading) if self._source.color else None

    @property
    def device_normals(self) -> Any:
        """Array3f, one entry per pixel, world; None for an image without. Worked out when first asked for."""
        if self._source is None:
            return self._normals
        return self._shaded("normals", "normal") if self._source.normals else None

    @exclusive
    def _shaded(self, name: str, shading: str) -> Any:
        if name not in self._kept:
            import drjit as dr

            source = self._source
            found = shade_device(self._frame, source.scene, shading, source.shadows if name == "color" else ())
            if name == "normals":
                found = dr.select(dr.isfinite(self.device_depth), found * 2 - 1, 0.0)
                dr.eval(found)
            self._kept[name] = found
        return self._kept[name]

    def _image(self, vectors: Any) -> np.ndarray | None:
        if vectors is None:
            return None
        shape = (self.camera.height, self.camera.width, 3)
        return np.stack([np.asarray(part.numpy()) for part in vectors], -1).reshape(shape)

    @exclusive
    def surface(self, side: int = 4) -> Any:
        """The surface that rays meet, on the device; side: pixels along the smallest squares of its ranges of depth."""
        key = "surface", side
        if key not in self._kept:
            planes = self._source is not None and self._source.planes and self._frame.mesh.triangle_count > 0
            slopes = plane_slopes(self._frame) if planes else None
            self._kept[key] = device_surface(self.camera, self.device_depth, side, slopes)
        return self._kept[key]

    def any_surface(self) -> Any:
        """The surface as it was last asked for: patches are the same in all of them."""
        known = next((value for key, value in self._kept.items() if key[0] == "surface"), None)
        return self.surface() if known is None else known

    @exclusive
    def intersect(
        self,
        origins: Any,
        directions: Any = None,
        coarse: float | None = 6.0,
        fine: float = 0.25,
        far: Any = None,
        walk: Walk = "march",
        leaving: bool = True,
    ) -> Intersections:
        """Where rays first meet the image's surface.

        origins, directions: (..., 3) each, world, directions of any length above 0; or Dr.Jit Array3f, whose results
        stay on the device until they are asked for; or, in place of both, PosedRays. Rays that hold what is no finite
        number, or a zero direction, hit nothing. coarse: pixels that a step through what is empty may span, 1 to 64;
        None: fine steps alone, all along. fine: pixels that a step may span near the surface, 1/16 to 4; between coarse
        steps, and farther from the surface, it is one pixel. far: lengths beyond which nothing is a hit, scene units,
        one for all or one for each ray; None: no limit. walk: "march", or for a GraphCamera "pieces": from frustum to
        frustum, in each of which rays are straight in the image. leaving: whether rays may start on the surface, which
        they do not meet where they leave it; by "march" False, the nearest point counts. Returns Intersections. Raises
        InputError for other shapes and settings.
        """
        side, coarse, fine = side_for(coarse, fine)
        rays, shape = rays_of(origins, directions)
        limit = far_of(far, shape)
        found = self.followed(rays, side, coarse, fine, limit, walk, leaving)
        return Intersections((self,), found, shape)

    def followed(
        self, rays: Any, side: int, coarse: float, fine: float, limit: Any, walk: str, leaving: bool = True
    ) -> Any:
        """As `intersect`, from rays on the device to hits there."""
        if walk not in WALKS:
            raise InputError(f"walk={walk!r}: allowed are {', '.join(WALKS)}")
        if walk == "march":
            surface, planes = self.surface(side), self._around()
            return marched(self.camera, surface, rays, coarse, fine, limit, planes=planes, leaving=leaving)
        camera, key = with_frusta(self.camera), ("straight", side)
        if key not in self._kept:
            self._kept[key] = straight_surface(camera, self.device_depth, side)
        return walked(camera, self._kept[key], rays, coarse, fine, limit)

    def _around(self) -> np.ndarray | None:
        """Six planes (6, 4) around the mesh that was rendered: steep patches, and so steps, would reach out of it."""
        if self._source is None:
            return None
        if "around" not in self._kept:
            mesh = self._source.prepared.mesh
            low, high = mesh.bounds if len(mesh.vertices) == 0 else (mesh.vertices.min(0), mesh.vertices.max(0))
            if not np.isfinite((low, high)).all():  # the bounds of the finite ones take longer to find
                low, high = mesh.bounds
            room = 1e-3 * float(np.linalg.norm(high - low)) + 1e-6 * float(np.abs((low, high)).max())
            sides = [np.column_stack([-np.eye(3), low - room]), np.column_stack([np.eye(3), -high - room])]
            self._kept["around"] = np.concatenate(sides)
        return self._kept["around"]

    def __repr__(self) -> str:
        return f"DepthImage({self.camera.width}x{self.camera.height}, {type(self.camera).__name__})"


@dataclass(frozen=True)
class _Source:
    """What a depth image is rendered from."""

    scene: Scene
    prepared: Any
    color: bool
    normals: bool
    planes: bool
    shading: str
    shadows: Any


def check_camera(camera: Any) -> None:
    """See that a camera has one image of each point; raises InputError with its name otherwise."""
    if not isinstance(camera, Camera):
        raise InputError(f"camera is a {type(camera).__name__}: give one of mpcam's cameras, e.g. mpcam.Pinhole")
    need(camera, HasRays, "a depth image")
    need(camera, Projects, "a depth image", "rays are followed along their images")
    if camera.images_per_point != 1:
        raise InputError(
            f"a depth image needs one image for each point; a {type(camera).__name__} has up to "
            f"{camera.images_per_point}: use a Pinhole, an Orthographic, a GeneralLinear, a fisheye or a Panorama"
        )


def _numbers(name: str, values: Any, shape: tuple[int, ...]) -> np.ndarray:
    try:
        found = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: numbers of shape {shape} are needed, got {type(values).__name__}") from None
    if found.shape != shape:
        raise InputError(f"{name} has shape {found.shape}: {shape} is needed for a camera of {shape[1]}x{shape[0]}")
    return found


def _vectors(name: str, values: Any, shape: tuple[int, ...]) -> Any:
    found = _numbers(name, values, shape)
    columns = np.ascontiguousarray(np.nan_to_num(found, posinf=0.0, neginf=0.0).reshape(-1, 3).T, np.float32)
    return types().Array3f(columns) + opaque_zero()


def _upload(values: np.ndarray) -> Any:
    return types().Float(aligned(values)) + opaque_zero()
