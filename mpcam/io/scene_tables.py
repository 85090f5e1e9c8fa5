"""The tables of a scene file, as typed records; docs of each key are here, checks that need numbers in scene_build.

Angles are in degrees, lengths in scene units, colors linear RGB (one number stands for a gray).
"""

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

Vector = tuple[float, float, float]
Positive = Annotated[float, Meta(gt=0)]
# no limits on these: msgspec 0.22 crashes in garbage collection on a limited number that may also be a tuple
Scale = float | Vector
Color = float | Vector


class Table(Struct, forbid_unknown_fields=True, frozen=True, kw_only=True):
    """A table in which every key must be known."""


class RotateTable(Table, frozen=True):
    """Right-handed rotation about an axis through the origin."""

    axis: Vector
    degrees: float


class MeshTable(Table, frozen=True):
    """[[mesh]]: a mesh file (path relative to the scene file) or a built-in mesh; scaled, then rotated, then moved."""

    file: str | None = None
    builtin: str | None = None
    triangles: Annotated[int, Meta(ge=1)] | None = None  # built-in meshes only
    scale: Scale = 1.0
    rotate: RotateTable | None = None
    translate: Vector = (0.0, 0.0, 0.0)
    color: Color | None = None  # replaces the materials of the mesh
    texture: str | None = None  # an image file; replaces the materials too, and is multiplied by color


Share = Annotated[float, Meta(ge=0, le=1)]


class DepthImagesTable(Table, frozen=True):
    """[mirror.depth_images], [refractor.depth_images]: what method depth_image meets the rays that go on with; chosen
    for each mesh, or cameras."""

    size: Annotated[int, Meta(ge=8, le=8192)] = 512  # pixels along a side
    aside: Annotated[float, Meta(ge=0)] = 1.0  # how far around things they reach, in radii; 0: pinholes
    coarse: Annotated[float, Meta(ge=1, le=64)] = 6.0  # pixels of a step through what is empty
    fine: Annotated[float, Meta(ge=0.0625, le=4)] = 0.25  # pixels of a step along the surface
    cameras: Annotated[list[str], Meta(min_length=1)] | None = None  # camera files, which see the whole scene


class ShapeTable(Table, frozen=True):
    """A curved surface: one of surface (exact), file or builtin (a mesh).

    The keys of a surface are those of its function in mpcam.Surface, angle in degrees. Rotated, then moved.
    """

    surface: Literal["sphere", "ellipsoid", "torus", "paraboloid", "cylinder", "saddle", "wave"] | None = None
    file: str | None = None
    builtin: str | None = None
    radius: Positive | None = None
    radii: Vector | None = None
    ring: Positive | None = None
    tube: Positive | None = None
    height: float | None = None
    length: Positive | None = None
    angle: Annotated[float, Meta(gt=0, le=360)] | None = None
    size: Positive | None = None
    waves: Positive | None = None
    rotate: RotateTable | None = None
    translate: Vector = (0.0, 0.0, 0.0)
    scale: Scale = 1.0  # meshes only
    color: Color = 1.0  # what is seen is multiplied by it
    depth_images: DepthImagesTable | None = None


class MirrorTable(ShapeTable, frozen=True):
    """[mirror]: a curved mirror, or with index an interface."""

    index: Positive | None = None  # refractive index behind the surface over that in front; default: a mirror
    triangles: Annotated[int, Meta(ge=1, le=100000)] = 104  # camera triangles
    resolution: Annotated[int, Meta(ge=2, le=8192)] = 64  # pixels along the short sides of each
    mode: Literal["normals", "directions", "general_linear", "continuous"] = "normals"  # how rays run within each
    bounces: Annotated[int, Meta(ge=1, le=8)] = 1  # how often rays are reflected, where a method can
    reflectance: Share | list[Share] = 0.0  # part of the light that the meshes reflect, with more than one bounce
    own: bool = False  # whether the mirror is seen in itself, with more than one bounce
    camera_triangles: str | None = None  # .npz file of `mpcam fit`, for this camera: in place of cutting the mirror


class RefractorTable(ShapeTable, frozen=True):
    """[refractor]: a thing of glass, whose surface is closed."""

    index: Positive = 1.5  # refractive index of the inside over that of the outside
    second: Literal["march", "wyman", "trace", "none"] = "march"  # how the interface is found where rays leave
    inner: Annotated[int, Meta(ge=0, le=8)] = 2  # total reflections inside that are followed
    fresnel: bool = False  # whether the outer surface reflects


class GridTable(Table, frozen=True):
    """Copies in rows along x and columns along y, around the origin."""

    rows: Annotated[int, Meta(ge=1, le=1000)]
    columns: Annotated[int, Meta(ge=1, le=1000)]
    spacing: tuple[float, float]


class PlaceTable(Table, frozen=True):
    """[[relief.place]]: one copy; scaled, then rotated, then moved."""

    scale: Scale = 1.0
    rotate: RotateTable | None = None
    translate: Vector = (0.0, 0.0, 0.0)
    color: Color | None = None  # takes the place of the key color


class ReliefTable(Table, frozen=True):
    """[[relief]]: a mesh kept as a depth image, in many copies: [[relief.place]], grid or placements."""

    file: str | None = None
    builtin: str | None = None
    triangles: Annotated[int, Meta(ge=1)] | None = None
    camera: Literal["single_pole", "orthographic"] = "single_pole"
    size: Annotated[int, Meta(ge=8, le=8192)] = 512
    layers: Annotated[int, Meta(ge=1, le=8)] = 1  # orthographic only
    key: str | Vector | None = None  # name or linear RGB of the materials that copies may color anew
    colors: list[Vector] | None = None  # of the copies in turn, for those of a grid or of placements
    grid: GridTable | None = None
    placements: str | None = None  # a .npy file, (N, 4, 4)
    place: list[PlaceTable] = []


class EnvironmentTable(Table, frozen=True):
    """[environment]: a latitude-longitude picture, linear RGB, that rays see which miss everything."""

    image: str
    size: Annotated[int, Meta(ge=8, le=16384)] | None = None  # pixels along a side of the two views kept of it


class OcclusionTable(Table, frozen=True):
    """[occlusion]: how surfaces keep ambient light from each other, in pictures by pinhole cameras."""

    radius: Positive  # within which they do
    thickness: Positive | None = None  # how far what is seen reaches back; default: without end
    directions: Annotated[int, Meta(ge=1, le=1024)] = 6  # lines from each pixel
    steps: Annotated[int, Meta(ge=1, le=1024)] = 6  # along each
    falloff: Literal["quadratic", "linear", "none"] = "quadratic"  # weight by distance
    blur: Annotated[int, Meta(ge=1, le=255)] = 21  # pixels along a side, odd


class DirectionalTable(Table, tag_field="type", tag="directional", frozen=True):
    """[[light]] type = "directional": direction is the way that the light travels."""

    direction: Vector
    radiance: Color = 1.0


class PointTable(Table, tag_field="type", tag="point", frozen=True):
    """[[light]] type = "point": intensity is what arrives at distance 1."""

    position: Vector
    intensity: Color = 1.0


class LevelsTable(Table, frozen=True):
    levels: Annotated[list[Annotated[int, Meta(ge=0, le=7)]], Meta(min_length=1)]


class ResolutionsTable(Table, frozen=True):
    resolutions: Annotated[list[Annotated[int, Meta(ge=1, le=16384)]], Meta(min_length=1)]


class TrianglesTable(Table, frozen=True):
    triangles: Annotated[list[Annotated[int, Meta(ge=1, le=100000)]], Meta(min_length=1)]


class SizesTable(Table, frozen=True):
    sizes: Annotated[list[Annotated[int, Meta(ge=8, le=16384)]], Meta(min_length=1)]


class PatchesTable(Table, frozen=True):
    patches: Annotated[list[Annotated[int, Meta(ge=2, le=256)]], Meta(min_length=1)]


Method = Literal[
    "invert",
    "vertex",
    "two_pass",
    "cubemap",
    "hemicube",
    "raytrace",
    "camera_triangles",
    "environment",
    "depth_image",
]


class CompareTable(Table, frozen=True):
    """[compare]: what `mpcam compare` runs; a key that is left out is chosen there.

    Scenes with a mirror are compared by camera_triangles, vertex, environment, depth_image and raytrace, scenes with a
    refractor by the last three, others by invert, vertex, two_pass, cubemap, hemicube and raytrace.
    """

    methods: Annotated[list[Method], Meta(min_length=1)] | None = None
    vertex: LevelsTable | None = None
    two_pass: PatchesTable | None = None
    cubemap: ResolutionsTable | None = None
    hemicube: ResolutionsTable | None = None
    camera_triangles: TrianglesTable | None = None
    environment: SizesTable | None = None
    depth_image: SizesTable | None = None
    shading: Literal["color", "normal", "texture", "light"] | None = None
    repeats: Annotated[int, Meta(ge=1)] | None = None


class SceneTable(Table, frozen=True):
    """The whole file. Without `light`, one directional light comes from behind the camera; `light = []` means none."""

    mesh: list[MeshTable]
    camera: Any = None  # read by its own tables: see camera_tables
    light: list[DirectionalTable | PointTable] | None = None
    ambient: Color = 0.15
    background: Color = 0.0
    mirror: MirrorTable | None = None
    refractor: RefractorTable | None = None
    environment: EnvironmentTable | None = None
    occlusion: OcclusionTable | None = None
    relief: list[ReliefTable] = []
    compare: CompareTable = CompareTable()
    name: str | None = None
