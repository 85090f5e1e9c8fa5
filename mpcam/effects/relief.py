"""Reliefs: a thing kept as a depth image in a box, and many copies of it in a scene (Rosen et al. 2011, section 6.2).

A conventional relief texture is seen along parallel rays: what its camera does not see of the thing is missing. Cameras
that are not pinholes reach around the thing, so that one image holds its top and its sides.
"""

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from mpcam.backend import exclusive, opaque_numbers
from mpcam.cameras.base import Camera
from mpcam.checks import number_table, shown, whole_number
from mpcam.depth_images.depth_image import DepthImage
from mpcam.depth_images.layered import LayeredDepthImage
from mpcam.effects.relief_cameras import relief_camera, top_in_middle
from mpcam.effects.relief_instances import ReliefInstances
from mpcam.effects.relief_texels import Texels, texels_of
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.rendering.shade import attributes
from mpcam.scene.scene import Scene

SAME_COLOR = 1e-4
"""How far texels may be from the key color, each channel."""


class Relief:
    """A relief texture: one depth image, or several layers, of what lies in a box.

    image: a DepthImage with color, and normals where it is to be lit; or a LayeredDepthImage, or several images of the
    same tile, of which the nearest hit counts. box: (2, 3), least and largest x, y, z of the tile, in the frame that
    the images' cameras are placed in: rays are followed within it. key: linear RGB of the texels that instances may
    color anew; mask: those texels, (H, W) bool for each image, where the color alone does not tell. Raises InputError
    for other images, boxes and shapes.
    """

    def __init__(self, image: Any, box: Any, *, key: Any = None, mask: Any = None):
        several = image.layers if isinstance(image, LayeredDepthImage) else image
        images = tuple(several) if isinstance(several, Sequence) else (several,)
        if not images or not all(isinstance(one, DepthImage) for one in images):
            raise InputError("relief: give a mpcam.DepthImage, or several of the same tile")
        for one in images:
            if one.device_color is None:
                raise InputError("relief: the depth image has no color; give it color=, or render it with color=True")
        self.images, self.box = images, _box(box)
        self.key = None if key is None else _color("key", key)
        self._masks = _masks(images, mask)
        if self.key is None and mask is not None:
            self.key = _mean_color(images, self._masks or [])

    @classmethod
    def render(
        cls,
        mesh: Any,
        camera: Any = "single_pole",
        size: int = 512,
        *,
        box: Any = None,
        key: Any = None,
        layers: int = 1,
        method: str = "invert",
        lit: bool = True,
    ) -> "Relief":
        """The relief of a mesh, in whose own coordinates the tile is.

        camera: "single_pole", which sees the top and the sides, from above along -z; "orthographic", the conventional
        relief texture; any camera with one image of a point; or several of these, a layer each. size: pixels along the
        longer side of the image, for cameras by name. box: default the mesh's bounds, a little wider. key: the linear
        RGB, or the name, of the materials that instances may color anew. layers: surfaces behind each other along each
        pixel's ray, of cameras with straight rays; texels of the key are then known by their color alone. method: see
        `prepare`. lit: whether normals are kept, for shading "light" and "normal". Raises InputError.
        """
        whole = Scene.of(mesh).mesh
        bounds = _bounds(whole) if box is None else _box(box)
        several = isinstance(camera, (list, tuple))
        top = top_in_middle(whole, bounds)
        cameras = [relief_camera(one, bounds, size, top=top) for one in (camera if several else [camera])]
        shading = "texture" if attributes(whole).textured else "color"
        if whole_number("layers", layers, 1, 8) > 1:
            if method != "invert":
                raise InputError(f"method={method!r}: layers are traced, so leave it out")
            peeled = [
                LayeredDepthImage.render(one, whole, layers, normals=lit, shading=shading).layers for one in cameras
            ]
            color = None if key is None else _keyed(whole, key)[1]
            return cls([image for images in peeled for image in images], bounds, key=color)
        images = [DepthImage.render(one, whole, method, normals=lit, shading=shading) for one in cameras]
        if key is None:
            return cls(images, bounds)
        materials, color = _keyed(whole, key)
        return cls(images, bounds, key=color, mask=[_faces_of(one, materials) for one in images])

    @property
    def camera(self) -> Camera:
        """The camera of the first image."""
        return self.images[0].camera

    def instances(self, placements: Any, colors: Any = None) -> ReliefInstances:
        """Copies of this relief: see `ReliefInstances`."""
        return ReliefInstances(self, placements, colors)

    @functools.cached_property
    @exclusive
    def texels(self) -> tuple[Texels, ...]:
        """What shading reads of each image, on the device."""
        return tuple(
            texels_of(image, self.key, None if self._masks is None else self._masks[number])
            for number, image in enumerate(self.images)
        )

    @functools.cached_property
    @exclusive
    def device_box(self) -> list[Any]:
        """The box on the device, six numbers."""
        return opaque_numbers([*self.box.ravel()])

    @property
    def lit(self) -> bool:
        """Whether all images have normals."""
        return all(one.device_normals is not None for one in self.images)

    @property
    def bytes(self) -> int:
        """Device memory of the images as they are used: depth, patches and texels."""
        return sum(one.camera.width * one.camera.height * 4 * (1 + 4 + 8) for one in self.images)

    @exclusive
    def update(self, vertices: Any = None, *, normals: Any = None, transform: Any = None) -> None:
        """The thing in another shape, within the same box: its images are rendered anew. See `DepthImage.update`.

        Raises InputError where the images were made from arrays, and where texels are told by a mask, which is not made
        anew.
        """
        if self._masks is not None:
            raise InputError("update(): which texels have the key color would change too: make a new Relief")
        for image in self.images:
            image.update(vertices, normals=normals, transform=transform)
        self.__dict__.pop("texels", None)

    def __repr__(self) -> str:
        sizes = " + ".join(f"{one.camera.width}x{one.camera.height}" for one in self.images)
        return f"Relief({sizes}, {type(self.camera).__name__})"


def _box(box: Any) -> np.ndarray:
    found = number_table(box)
    if found.shape != (2, 3) or not np.isfinite(found).all() or not (found[0] < found[1]).all():
        raise InputError(f"box={shown(box)}: give (2, 3), least and largest x, y, z, the first below the second")
    return found


def _bounds(mesh: Mesh) -> np.ndarray:
    """The bounds of a mesh, wider by what one or two texels make of its outline."""
    low, high = mesh.bounds
    margin = 0.01 * float((high - low).max()) or 1.0
    return np.stack([low - margin, high + margin])


def _color(name: str, value: Any) -> np.ndarray:
    found = number_table(value)
    if found.shape != (3,) or not np.isfinite(found).all() or (found < 0).any():
        raise InputError(f"{name}={shown(value)}: give 3 finite linear RGB numbers, none negative")
    return found


def _mean_color(images: tuple[DepthImage, ...], masks: list[np.ndarray]) -> np.ndarray:
    """The mean of the colors of texels; 1 without any."""
    colors = [np.asarray(image.color)[flags] for image, flags in zip(images, masks, strict=True)]
    together = np.concatenate(colors)
    return together.mean(axis=0, dtype=np.float64) if len(together) else np.ones(3)


def _masks(images: tuple[DepthImage, ...], mask: Any) -> list[np.ndarray] | None:
    if mask is None:
        return None
    masks = mask if isinstance(mask, (list, tuple)) else [mask]
    if len(masks) != len(images):
        raise InputError(f"mask holds {len(masks)} arrays, and there are {len(images)} images: give one for each")
    found = []
    for one, image in zip(masks, images, strict=True):
        flags, shape = np.asarray(one), (image.camera.height, image.camera.width)
        if flags.dtype != bool or flags.shape != shape:
            raise InputError(f"mask has shape {flags.shape} and type {flags.dtype}: give {shape} bool, as the image is")
        found.append(flags)
    return found


def _faces_of(image: DepthImage, materials: list[int]) -> np.ndarray:
    """(H, W) bool, where an image shows one of some materials."""
    hits = image.hits
    assert hits is not None
    mesh = hits.mesh
    numbers = np.zeros(mesh.triangle_count, int) if mesh.face_material is None else mesh.face_material
    return np.append(np.isin(numbers, materials), False)[hits.triangle]


def _keyed(mesh: Mesh, key: Any) -> tuple[list[int], tuple[float, float, float]]:
    """Numbers of the materials of a key, a name or a color, and their color."""
    if isinstance(key, str):
        numbers = [number for number, material in enumerate(mesh.materials) if material.name == key]
    else:
        color = _color("key", key)
        near = [np.abs(np.subtract(material.color, color)).max() <= SAME_COLOR for material in mesh.materials]
        numbers = [number for number, one in enumerate(near) if one]
    if not numbers:
        known = ", ".join(f"{material.name or 'unnamed'} {material.color}" for material in mesh.materials[:6])
        raise InputError(
            f"key={shown(key)}: no material has this {'name' if isinstance(key, str) else 'color'}: {known}"
        )
    return numbers, mesh.materials[numbers[0]].color
