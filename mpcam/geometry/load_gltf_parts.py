"""The objects of a glTF 2.0 file that a mesh is made of, as its JSON names them."""

from typing import Any

import msgspec


class Part(msgspec.Struct, rename="camel", kw_only=True):
    """What all objects of a file may have."""

    extensions: dict[str, Any] = {}
    name: str = ""


class Buffer(Part):
    byte_length: int
    uri: str | None = None


class View(Part):
    buffer: int
    byte_length: int
    byte_offset: int = 0
    byte_stride: int | None = None


class SparseIndices(Part):
    buffer_view: int
    component_type: int
    byte_offset: int = 0


class SparseValues(Part):
    buffer_view: int
    byte_offset: int = 0


class Sparse(Part):
    count: int
    indices: SparseIndices
    values: SparseValues


class Accessor(Part):
    component_type: int
    count: int
    type: str
    buffer_view: int | None = None
    byte_offset: int = 0
    normalized: bool = False
    sparse: Sparse | None = None


class Primitive(Part):
    attributes: dict[str, int]
    indices: int | None = None
    material: int | None = None
    mode: int = 4
    targets: list[dict[str, int]] = []


class MeshPart(Part):
    primitives: list[Primitive]
    weights: list[float] = []


class Node(Part):
    mesh: int | None = None
    skin: int | None = None
    children: list[int] = []
    matrix: list[float] | None = None
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    weights: list[float] = []


class Skin(Part):
    joints: list[int]
    inverse_bind_matrices: int | None = None


class SceneNodes(Part):
    nodes: list[int] = []


class TextureInfo(Part):
    index: int
    tex_coord: int = 0


class Roughness(Part):
    base_color_factor: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0)
    base_color_texture: TextureInfo | None = None


class MaterialPart(Part):
    pbr_metallic_roughness: Roughness | None = None
    alpha_mode: str = "OPAQUE"


class Texture(Part):
    source: int | None = None
    sampler: int | None = None


class Sampler(Part):
    wrap_s: int = 10497
    wrap_t: int = 10497


class Image(Part):
    uri: str | None = None
    buffer_view: int | None = None


class Root(Part):
    asset: dict[str, Any]
    extensions_required: list[str] = []
    extensions_used: list[str] = []
    scene: int | None = None
    scenes: list[SceneNodes] = []
    nodes: list[Node] = []
    meshes: list[MeshPart] = []
    skins: list[Skin] = []
    materials: list[MaterialPart] = []
    textures: list[Texture] = []
    samplers: list[Sampler] = []
    images: list[Image] = []
    accessors: list[Accessor] = []
    buffer_views: list[View] = []
    buffers: list[Buffer] = []
