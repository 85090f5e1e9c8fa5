"""glTF materials: color, texture, and where it lies on the faces."""

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import msgspec
import numpy as np

from mpcam.errors import InputError
from mpcam.geometry.load_gltf_file import GltfFile
from mpcam.geometry.load_gltf_parts import Roughness, Sampler, TextureInfo
from mpcam.geometry.load_image import read_texture
from mpcam.geometry.mesh import Material

_REPEAT = 10497


@dataclass(frozen=True)
class Look:
    """A material, which set of texture coordinates it takes, the (2, 3) matrix that moves them, and its wrap modes."""

    material: Material
    bare: Material
    texcoord: int = 0
    transform: np.ndarray = field(default_factory=lambda: np.eye(2, 3))
    wrap: tuple[int, int] = (_REPEAT, _REPEAT)

    def placed(self, uv: np.ndarray) -> np.ndarray:
        """(V, 2) texture coordinates after the transform, both with v down."""
        return uv @ self.transform[:, :2].T + self.transform[:, 2]


class Looks:
    """The looks of a file, each made once."""

    def __init__(self, file: GltfFile):
        self._file = file
        self._made: dict[int, Look] = {}
        self._none = _plain("", (1.0, 1.0, 1.0))
        self._images: dict[int, tuple[np.ndarray, bool] | None] = {}

    def __getitem__(self, number: int | None) -> Look:
        if number is None:
            return self._none
        if number not in self._made:
            if not 0 <= number < len(self._file.root.materials):
                raise ValueError(f"material {number} of {len(self._file.root.materials)} is named")
            self._made[number] = self._make(number)
        return self._made[number]

    def _make(self, number: int) -> Look:
        part = self._file.root.materials[number]
        name = part.name
        called = name or f"{number}"
        base = part.pbr_metallic_roughness
        gloss = part.extensions.get("KHR_materials_pbrSpecularGlossiness")
        if gloss is not None and (base is None or base.base_color_texture is None):
            base = msgspec.convert(
                {
                    "baseColorFactor": gloss.get("diffuseFactor", [1.0] * 4),
                    "baseColorTexture": gloss.get("diffuseTexture"),
                },
                Roughness,
                strict=False,
            )
        base = base or Roughness()
        *color, alpha = base.base_color_factor
        look = _plain(name, color)
        image = None if base.base_color_texture is None else self._image(base.base_color_texture.index, called)
        if part.alpha_mode != "OPAQUE" and (alpha < 1 or (image is not None and image[1])):
            self._file.say(f"material {called} is transparent ({part.alpha_mode}): it is drawn opaque")
        if base.base_color_texture is None or image is None:
            return look
        texcoord, transform = _placement(base.base_color_texture)
        texture = self._file.root.textures[base.base_color_texture.index]
        sampler = Sampler() if texture.sampler is None else self._file.root.samplers[texture.sampler]
        material = replace(look.material, texture=image[0])
        return Look(material, look.bare, texcoord, transform, (sampler.wrap_s, sampler.wrap_t))

    def _image(self, number: int, material: str) -> tuple[np.ndarray, bool] | None:
        """The image of a texture, linear, and whether some of it is transparent; None, and said, if there is none."""
        if not 0 <= number < len(self._file.root.textures):
            raise ValueError(f"texture {number} of {len(self._file.root.textures)} is named")
        texture = self._file.root.textures[number]
        others = [extension.get("source") for extension in texture.extensions.values() if isinstance(extension, dict)]
        sources = [source for source in (texture.source, *others) if isinstance(source, int)]
        if not sources:
            self._file.say(f"a texture of material {material} has no image that is read: it has no texture")
        for source in sources:
            if source not in self._images:
                self._images[source] = self._read(source, material)
            if self._images[source] is not None:
                return self._images[source]
        return None

    def _read(self, source: int, material: str) -> tuple[np.ndarray, bool] | None:
        data, name = self._file.image(source)
        try:
            if data is None:
                raise InputError(f"texture {name} is not there: put the image beside the file")
            return read_texture(io.BytesIO(data), name)
        except InputError as error:
            self._file.say(f"{error}; material {material} has no texture")
            return None


def _plain(name: str, color: Sequence[float]) -> Look:
    material = Material((max(color[0], 0.0), max(color[1], 0.0), max(color[2], 0.0)), None, name)
    return Look(material, material)


def _placement(info: TextureInfo) -> tuple[int, np.ndarray]:
    """The set of texture coordinates, and the (2, 3) matrix of KHR_texture_transform: scaled, turned, then moved."""
    moved: dict[str, Any] = info.extensions.get("KHR_texture_transform", {})
    (x, y), (sx, sy) = moved.get("offset", (0.0, 0.0)), moved.get("scale", (1.0, 1.0))
    angle = moved.get("rotation", 0.0)
    c, s = math.cos(angle), math.sin(angle)
    matrix = np.array([[c * sx, s * sy, x], [-s * sx, c * sy, y]], np.float64)
    return int(moved.get("texCoord", info.tex_coord)), matrix
