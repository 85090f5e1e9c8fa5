"""Caustics: light that a curved mirror or lens gathers on what is near (Hou et al. 2006, section 3.3).

The light is the eye of camera triangles. What they see of the receivers, looked up for each pixel of the light's view,
is the photon-location map: where the pixel's light lands. Three neighboring photons make a triangle; the ratio of its
solid angle to that of the landed one is the concentration (Wyman and Davis 2006). Its flux, that of its photons, is
dropped into the eye's picture at as many points as it covers pixels, so that neither folds nor wide triangles lose any,
and spread there by a normalized kernel: irradiance times area, summed over the picture, is the flux that landed in it.
"""

import dataclasses
import functools
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_zero, types
from mpcam.cameras.base import Camera
from mpcam.cameras.camera_triangles import CameraTriangles
from mpcam.decomposition.chained import Chained
from mpcam.decomposition.chaining import chained
from mpcam.decomposition.decompose import decompose
from mpcam.decomposition.reflector import reflector_of
from mpcam.effects import caustic_kernels as kernels
from mpcam.effects.caustic_map import Energy, PhotonMap, concentration
from mpcam.effects.caustic_photons import Photons, photons, pixel_solid_angles
from mpcam.effects.caustic_settings import Settings
from mpcam.effects.shadows import shadow_map
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.moved import begun_anew, moved
from mpcam.geometry.surfaces import Surface
from mpcam.rendering.device_camera import device_camera
from mpcam.rendering.hits import Hits
from mpcam.rendering.methods import prepare
from mpcam.rendering.shade import attributes, shade
from mpcam.scene.scene import PointLight, Scene

CHUNK = 1 << 22
"""Points that flux is dropped at, at a time."""


class Caustics:
    """Prepared caustics of one light, reflector and eye; what moves costs frames, not preparations.

    irradiance: (H, W, 3) float32 linear RGB, in the units of `shade`: a white surface shows what falls on it, so that a
    flat mirror gives what a second light behind it would. energy: an `Energy`. photon_map: a `PhotonMap`. hits: what
    the eye sees, of the scene's meshes and, if it is shown, the reflector behind them. cams: the camera triangles;
    chained: those behind them, of a lens with two faces, or None.
    """

    cams: CameraTriangles
    chained: Chained | None

    @exclusive
    def __init__(self, scene: Scene, reflector: Mesh | Surface, light: PointLight, camera: Camera, settings: Settings):
        self.scene, self.light, self.settings = scene, light, settings
        self._given, self._reflector = reflector, reflector_of(reflector)
        self.cams = decompose(
            reflector,
            light.position,
            settings.triangles,
            resolution=settings.resolution,
            index=settings.index,
        )
        self._atlas: Any = None
        self._mesh = scene.mesh
        self._objects = _objects(scene)
        self._shine()
        self.aim(camera)

    def _shine(self) -> None:
        """Photons of the light where it is, and the camera triangles that they go through."""
        settings, behind = self.settings, None
        self.chained = None
        if settings.back is not None and settings.index is not None:
            self.chained = chained(self.cams, settings.back, 1.0 / settings.index, reflector=self._given)
            behind = self.chained, reflector_of(settings.back)
        last = self.cams if self.chained is None else self.chained.camera
        place = np.asarray(self.light.position)
        self.photons: Photons = photons(place, self._reflector, self.cams, settings.photons, behind, settings.fresnel)
        if self._atlas is None or behind is not None:
            self._atlas = prepare(last, self.scene.mesh)
            self._atlas.move(self._mesh)
        else:
            self._atlas.aim(last)
        self._shade: Any = prepare(self.photons.camera, self.scene.mesh, output="depth")
        self._shade.move(self._mesh)
        self._rays = self.photons.on_device(self._atlas.device, self.scene.mesh.triangle_count)
        self._forget()

    @functools.cached_property
    def seen_scene(self) -> Scene:
        """What the eye sees: the scene, with the light among its lights, and the reflector if it is shown."""
        scene = self.scene
        lights = scene.lights if self.light in scene.lights else (*scene.lights, self.light)
        meshes = scene.meshes
        if self.settings.show:
            meshes = (scene.mesh, self._given if isinstance(self._given, Mesh) else self._reflector.mesh)
        return dataclasses.replace(scene, meshes=meshes, lights=lights)

    @exclusive
    def aim(self, camera: Camera) -> None:
        """Another eye. Raises InputError for a camera without a common center."""
        if not isinstance(camera, Camera) or camera.ray_geometry != "central":
            raise InputError(
                f"caustics: camera is a {type(camera).__name__}: give one of mpcam's cameras with a common center"
            )
        self.camera = camera
        self._eye: Any = prepare(camera, self.seen_scene.mesh)
        self._angles = types().Float(aligned(pixel_solid_angles(camera))) + opaque_zero()
        self._place_eye()

    def _place_eye(self) -> None:
        whole = self.seen_scene.mesh
        self._eye.move(whole if self._mesh is self.scene.mesh else begun_anew(whole, self._mesh))
        self._forget("hits", "_surface")

    @exclusive
    def update(self, vertices: Any = None, *, normals: Any = None, transform: Any = None) -> None:
        """Receivers elsewhere: positions (V, 3) of the vertices of `scene.mesh`, or a list with one array for each of
        the scene's meshes, or a rigid transform; see `Moving.update`. Raises InputError as that does.
        """
        self._mesh, before = moved(self.scene.mesh, vertices, normals, transform), self._atlas.device
        self._atlas.move(self._mesh)
        self._shade.move(self._mesh)
        if not self._atlas.device.same_frame(before):
            self._rays = self.photons.on_device(self._atlas.device, self.scene.mesh.triangle_count)
        self._place_eye()
        self._forget()

    @exclusive
    def move_light(self, light: PointLight) -> None:
        """The light elsewhere; the camera triangles stay, with another eye, and the photons are looked up anew.

        They are those that the first place saw: `photons.lost` tells what part of the light falls beside them.
        """
        if not isinstance(light, PointLight):
            raise InputError(f"caustics: light is a {type(light).__name__}: give a PointLight")
        moved = light.position != self.light.position
        self.light = light
        self._forget("seen_scene", "_maps")
        if moved:
            self.cams = dataclasses.replace(self.cams, eye=light.position)
            self._shine()

    def _forget(self, *names: str) -> None:
        """Drop what no longer holds; without names what the photons decide."""
        for name in names or ("_landed", "_maps"):
            self.__dict__.pop(name, None)
        self.__dict__.pop("_frame", None)

    # A frame, part by part.

    @functools.cached_property
    @exclusive
    def hits(self) -> Hits:
        return self._eye.frame()

    @functools.cached_property
    @exclusive
    def _landed(self) -> Any:
        """Where photons land, on the device: place (Array3f, receivers' frame), normal, receiver (-1: none)."""
        seen, lit, device = self._atlas.frame(), self._shade.frame(), self._atlas
        triangle, depth = seen.device_triangle, seen.device_depth
        return kernels.land()(self._rays, triangle, depth, lit.device_depth, device.vertices, device.faces, self._table)

    @functools.cached_property
    def _table(self) -> Any:
        """Number of the mesh of each face, on the device."""
        return types().Int(aligned(self._objects, np.int32)) + types().Int(opaque_zero())

    @functools.cached_property
    @exclusive
    def _surface(self) -> dict[str, Any]:
        """What photons need to know of the eye's pixels."""
        device, pose = self._atlas, self._atlas.device.pose(self.camera.camera_from_world)
        seen = self.hits.device_triangle, self.hits.device_depth, device_camera(self.camera).ray.direction
        return kernels.surface()(seen, self._angles, pose, self._rays, device.vertices, device.faces, self._table)

    @functools.cached_property
    @exclusive
    def _frame(self) -> tuple[Any, float]:
        """Irradiance of each pixel for a light of intensity 1, and the flux in view."""
        import drjit as dr

        from mpcam_kernels.threads import threads

        t, size = types(), self.photons.camera.width
        width, height = self.camera.width, self.camera.height
        eye, pose = device_camera(self.camera).on_device, self._atlas.device.pose(self.camera.camera_from_world)
        many, flux, unit, surface = 2 * (size - 1) ** 2, self._rays["flux"], self._rays["unit"], self._surface
        model = (type(self.camera), tuple(getattr(self.camera, name) for name in self.camera.static_fields))
        plan = kernels.plan(size, width, height, model)
        counts, smooth = plan(threads(t, 0, many), self._landed, flux, eye, pose)
        starts = dr.prefix_sum(counts)
        total = int(starts[many - 1] + counts[many - 1])
        dropped = dr.zeros(t.Float, width * height)
        dr.make_opaque(dropped, starts)
        drop = kernels.drop(size, width, height, model)
        for first in range(0, total, CHUNK):
            number = threads(t, first, min(total, first + CHUNK))
            dropped = drop(number, starts, counts, smooth, self._landed, flux, eye, pose, unit, surface, dropped)
        irradiance = kernels.spread(width, height, self.settings.radius)(
            threads(t, 0, width * height), surface, dropped
        )
        whole: Any = dr.sum(t.Float64(dropped))
        return irradiance, float(whole[0])

    # What a frame gives.

    @property
    def _strength(self) -> np.ndarray:
        return np.asarray(self.light.intensity) * np.asarray(self.settings.reflectance)

    @property
    @exclusive
    def irradiance(self) -> np.ndarray:
        shape = (self.camera.height, self.camera.width, 1)
        return (np.asarray(self._frame[0].numpy()).reshape(shape) * self._strength).astype(np.float32)

    @property
    @exclusive
    def area(self) -> np.ndarray:
        """(H, W) of the receivers' surface that each pixel shows, scene units squared; 0 where it shows none."""
        return np.asarray(self._surface["area"].numpy(), np.float64).reshape(self.camera.height, self.camera.width)

    @property
    @exclusive
    def photon_map(self) -> PhotonMap:
        size, device = self.photons.camera.width, self._atlas.device
        place, _, receiver = self._landed
        receiver = np.asarray(receiver.numpy()).reshape(size, size)
        position = np.stack([np.asarray(part.numpy(), np.float64) for part in place], -1) * device.scale + device.anchor
        landed = receiver >= 0
        return PhotonMap(
            np.where(landed[..., None], position.reshape(size, size, 3), 0.0),
            receiver,
            np.where(landed, self.photons.flux, 0.0),
        )

    @property
    def energy(self) -> Energy:
        found = self.photons
        whole = (found.solid_angle * (found.reach > 0)).sum()
        return Energy(*(self._strength * float(part) for part in (whole, self.photon_map.flux.sum(), self._frame[1])))

    def concentration(self) -> np.ndarray:
        """(2, P - 1, P - 1) solid angle of each triangle of photons over that of the landed one, from the light.

        That is the irradiance over what the light alone would give at the same place (Hou et al. 2006, Figure 10), less
        the losses in `photons.share`; 0 where the three do not lie on one receiver. First the triangles at the upper
        left of four photons, then those at the lower right.
        """
        return concentration(self.photon_map, self.photons.camera, np.asarray(self.light.position))

    @exclusive
    def render(self, shading: str = "light", *, shadows: bool = True, shadow_size: int = 1024) -> np.ndarray:
        """The scene with its caustics: (H, W, 3) float32, linear RGB; what `shade` gives plus albedo times irradiance.

        The light counts as one of the scene's. shading: see `shade`. shadows: whether lights cast shadows, for shading
        "light". The reflector casts one even where it is not shown: the light that it took comes back as caustics.
        shadow_size: pixels along a side of the shadow maps. Raises InputError.
        """
        hits, scene = self.hits, self.seen_scene
        maps = self._shadows(shadow_size) if shadows and shading == "light" else ()
        receives = (hits.triangle >= 0) & (hits.triangle < self.scene.mesh.triangle_count)
        albedo = shade(hits, scene, "texture" if attributes(scene.mesh).textured else "color")
        added = np.where(receives[..., None], albedo * self.irradiance, 0.0)
        return shade(hits, scene, shading, maps) + added.astype(np.float32)

    def _shadows(self, size: int) -> tuple[Any, ...]:
        """Shadow maps of the lights, of receivers and reflector where they are; kept until something moves."""
        found = self.__dict__.get("_maps")
        if found is None or found[0] != size:
            parts = (self._mesh, self._reflector.mesh)
            solid = Mesh.concatenate([Mesh(part.vertices, part.faces) for part in parts])
            maps = tuple(shadow_map(solid, light, size) for light in self.seen_scene.lights)
            found = self.__dict__["_maps"] = size, maps
        return found[1]


def _objects(scene: Scene) -> np.ndarray:
    """(F,) int32 number of the mesh that each face of the scene belongs to."""
    counts = [mesh.triangle_count for mesh in scene.meshes]
    return np.repeat(np.arange(len(counts), dtype=np.int32), counts)


def caustics(
    scene: Scene | Mesh,
    reflector: Mesh | Surface,
    light: PointLight,
    camera: Camera,
    *,
    triangles: int = 400,
    resolution: Any = 64,
    photons: int = 512,
    radius: float = 2.0,
    index: float | None = None,
    back: Mesh | Surface | None = None,
    reflectance: Any = 1.0,
    fresnel: bool = True,
    show: bool | None = None,
) -> Caustics:
    """Caustics that a curved mirror, or with `index` a lens, throws on a scene, as an eye sees them.

    scene: the receivers, a Scene, a Mesh or several meshes; each mesh is a surface of its own, over whose border no
    light spreads. reflector: a Mesh or Surface, not part of the scene; both of its sides count. light: a PointLight.
    camera: the eye, any camera with a common center. triangles, resolution: camera triangles, and pixels along the
    short sides of each in their atlas (Hou et al. 2006: 400 of 64). photons: pixels along a side of the light's view, 2
    to 4096. radius: pixels of the eye's picture that a photon is spread over, 0 to 8. index: refractive index behind
    the reflector over that on the light's side, None for a mirror. back: where the light leaves the lens again, its
    other face or the same closed surface; None: what lies behind is all of the same matter. reflectance: of a mirror,
    or tint of a lens, one number or RGB. fresnel: whether refraction loses what interfaces reflect. show: whether the
    eye sees the reflector, as an opaque body that hides what is behind; default: a mirror, and not a lens.

    Light is followed from the light to the first receiver, over one mirror or one lens; light that meets the mirror
    again stops there. Raises InputError.
    """
    whole = Scene.of(scene)
    if not isinstance(light, PointLight):
        raise InputError(f"caustics: light is a {type(light).__name__}: give a PointLight")
    settings = Settings(
        triangles=triangles,
        resolution=resolution,
        photons=photons,
        radius=radius,
        index=index,
        back=back,
        reflectance=reflectance,
        fresnel=bool(fresnel),
        show=index is None if show is None else bool(show),
    )
    if whole.mesh.triangle_count == 0:
        raise InputError("caustics: the scene has no triangles that light could fall on: give receivers")
    return Caustics(whole, reflector, light, camera, settings)
