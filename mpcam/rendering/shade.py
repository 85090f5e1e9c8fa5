"""Colors of first hits: one kernel that gathers what the chosen shading needs, and nothing else."""

import functools
import warnings
import weakref
from collections.abc import Sequence
from typing import Any

import numpy as np

from mpcam.backend import aligned, exclusive, opaque_numbers, opaque_zero, types
from mpcam.errors import InputError
from mpcam.geometry.mesh import Mesh
from mpcam.geometry.moved import MovedMesh
from mpcam.rendering.device import device_mesh
from mpcam.rendering.hits import Hits
from mpcam.scene.scene import DirectionalLight, PointLight, Scene

SHADINGS = ("color", "normal", "texture", "light")


class Attributes:
    """What shading reads of a mesh, on the device, uploaded on first use."""

    def __init__(self, mesh: Mesh):
        # The table must not keep its own key alive: only arrays of the mesh are held, not the mesh.
        self._faces, self._uv, self._colors = mesh.faces, mesh.uv, mesh.colors
        self._materials, self._face_material = mesh.materials, mesh.face_material
        self.textured = any(m.texture is not None for m in mesh.materials) and mesh.uv is not None
        self.tinted = mesh.colors is not None

    @functools.cached_property
    def faces(self) -> Any:
        return types().UInt(aligned(self._faces, np.uint32))

    @functools.cached_property
    def uv(self) -> Any:
        return _upload(self._uv)

    @functools.cached_property
    def colors(self) -> Any:
        return _upload(self._colors)

    @functools.cached_property
    def material(self) -> Any:
        numbers = np.zeros(len(self._faces), np.uint32) if self._face_material is None else self._face_material
        return types().UInt(aligned(numbers, np.uint32))

    @functools.cached_property
    def base(self) -> Any:
        """3 numbers per material."""
        return _upload(np.array([material.color for material in self._materials]))

    @functools.cached_property
    def textures(self) -> tuple[Any, Any]:
        """All texels one after another (3 numbers each), and per material: first texel, width, height (0: none)."""
        table, texels, start = [], [np.zeros((1, 3), np.float32)], 1
        for material in self._materials:
            if material.texture is None:
                table.append((0, 0, 0))
                continue
            height, width, _ = material.texture.shape
            table.append((start, width, height))
            texels.append(material.texture.reshape(-1, 3))
            start += width * height
        return _upload(np.concatenate(texels)), types().UInt(aligned(table, np.uint32))


def _upload(values: Any) -> Any:
    return types().Float(aligned(values))


_attributes: weakref.WeakKeyDictionary[Mesh, Attributes] = weakref.WeakKeyDictionary()


def attributes(mesh: Mesh) -> Attributes:
    """The shading attributes of a mesh on the device."""
    found = _attributes.get(mesh)
    if found is None:
        found = _attributes[mesh] = Attributes(mesh)
    return found


_normals: weakref.WeakKeyDictionary[Mesh, Any] = weakref.WeakKeyDictionary()


def vertex_normals(mesh: Mesh) -> Any:
    """3 numbers per vertex on the device, or None for a mesh that has no shading normals."""
    if mesh not in _normals:
        _normals[mesh] = None if mesh.normals is None else _upload(mesh.normals)
    return _normals[mesh]


@exclusive
def shade(
    hits: Hits, scene: Any = None, shading: str = "light", shadows: Sequence[Any] = (), exposure: Any = None
) -> np.ndarray:
    """Colors of hits: (H, W, 3) float32, linear RGB; the scene's background where nothing is hit.

    scene: the Scene (or Mesh) that the hits were made with; default: the hits' mesh. shading: "color" (material and
    vertex color), "texture" (the same times the texture), "normal" (world shading normal towards the viewer, 0.5 +
    0.5 n), "light" (texture, lit: Lambert's law, both sides, ambient; without lights, one at the viewer). shadows: the
    shadow maps of the scene's lights, in their order (see `shadow_map`), for "light"; default: no shadows. exposure:
    (H, W) share of the ambient light that arrives (see `screen_occlusion`), or a Float of it on the device, for
    "light"; default: all. Raises InputError for another shading, a scene whose mesh the hits do not belong to, shadow
    maps of other lights, and an exposure of another size.
    """
    whole = Scene.of(hits.mesh if scene is None else scene)
    check_shading(shading)
    if whole.mesh.triangle_count != hits.mesh.triangle_count:
        raise InputError(
            f"the scene has {whole.mesh.triangle_count} triangles and the hits are on {hits.mesh.triangle_count}: "
            "give the scene that was rasterized"
        )
    check_shadows(shadows, whole, shading)
    color = shade_device(hits, whole, shading, shadows, _on_device(exposure, hits, shading))
    return np.stack([np.asarray(c.numpy()) for c in color], -1).reshape(hits.camera.height, hits.camera.width, 3)


def check_shading(shading: str) -> None:
    """See that there is such a shading."""
    if shading not in SHADINGS:
        raise InputError(f"shading={shading!r}: allowed are {', '.join(SHADINGS)}")


def _on_device(exposure: Any, hits: Hits, shading: str) -> Any:
    """The exposure as a Float on the device, or None."""
    if exposure is None:
        return None
    if shading != "light":
        raise InputError(f"exposure goes with shading='light', not with {shading!r}: leave one of them out")
    t, shape = types(), (hits.camera.height, hits.camera.width)
    if isinstance(exposure, t.Float):
        return exposure
    values = np.asarray(exposure)
    if values.shape != shape or values.dtype.kind != "f":
        raise InputError(
            f"exposure has shape {values.shape} and type {values.dtype}: floats of shape {shape} are needed"
        )
    return t.Float(aligned(values)) + opaque_zero()


def check_shadow_shading(shading: str) -> None:
    """See that a shading has lights that can cast shadows."""
    if shading != "light":
        raise InputError(f"shadows go with shading='light', not with {shading!r}: leave one of them out")


def check_shadows(shadows: Sequence[Any], scene: Scene, shading: str) -> None:
    """See that shadow maps are those of the scene's lights."""
    if len(shadows) == 0:
        return
    check_shadow_shading(shading)
    if [getattr(one, "light", None) for one in shadows] != list(scene.lights):
        raise InputError(
            f"shadows: {len(shadows)} shadow maps that are not those of the scene's {len(scene.lights)} lights: "
            "give one mpcam.shadow_map(scene, light) for each light, in the scene's order"
        )


@exclusive
def shade_device(
    hits: Hits, scene: Scene, shading: str = "light", shadows: Sequence[Any] = (), exposure: Any = None
) -> Any:
    """As `shade`, but the colors stay on the device: an evaluated Array3f, one entry per pixel."""
    import drjit as dr

    t = types()
    background = opaque_numbers(list(scene.background))
    if hits.mesh.triangle_count == 0:
        data = {"background": background} | (_environment(hits, scene) if scene.environment is not None else {})
        color = _unhit(t, data) + dr.zeros(t.Array3f, dr.width(hits.device_depth))
        dr.eval(color)
        return color
    table, weights = attributes(scene.mesh), hits.device_weights
    if shading == "texture" and not table.textured:
        warnings.warn(f"shading='texture': {scene.name!r} has no texture, so this is 'color'", stacklevel=4)
    data: dict[str, Any] = {"faces": table.faces, "background": background}
    if scene.environment is not None:
        data |= _environment(hits, scene)
    if shading != "normal":
        data |= {"material": table.material, "base": table.base}
        data |= {"colors": table.colors} if table.tinted else {}
        if shading != "color" and table.textured:
            data["texels"], data["textures"] = table.textures
            data["uv"] = table.uv
    smooth = False
    if shading in ("normal", "light"):
        # Where a mesh has moved, its own normals count, else those of the scene, which may be dressed up otherwise.
        normals = vertex_normals(hits.mesh if isinstance(hits.mesh, MovedMesh) else scene.mesh)
        smooth = normals is not None
        data |= {"normals": normals} if smooth else {}
        data |= {"vertices": device_mesh(hits.mesh).vertices, "pose": _rotation(hits)}
        data |= {"direction": hits.view.ray.direction}
    kinds: tuple[str, ...] = ()
    if shading == "light":
        kinds = light_kinds(scene)
        data["ambient"] = opaque_numbers(list(scene.ambient))
        data |= {"exposure": exposure} if exposure is not None else {}
        data["lights"] = [light_numbers(light, device_mesh(hits.mesh).anchor) for light in scene.lights]
        if "point" in kinds or shadows:
            data["scale"] = opaque_numbers([device_mesh(hits.mesh).scale])[0]
        if shadows:
            data["shadows"] = [one.on_device(device_mesh(hits.mesh).anchor) for one in shadows]
    kernel = _kernel(shading, kinds, smooth)
    return kernel(hits.device_triangle, weights, data)


def light_kinds(scene: Scene) -> tuple[str, ...]:
    """Of each light whether it is "directional" or "point"."""
    return tuple("directional" if isinstance(light, DirectionalLight) else "point" for light in scene.lights)


def light_numbers(light: Any, anchor: np.ndarray) -> list[Any]:
    """Direction to the light, or its position from an anchor (3,), in world axes; then its strength."""
    if isinstance(light, DirectionalLight):
        return opaque_numbers([*(-np.asarray(light.direction)), *light.radiance])
    assert isinstance(light, PointLight)
    return opaque_numbers([*(light.position - anchor), *light.intensity])


@functools.cache
def _kernel(shading: str, lights: tuple[str, ...], smooth: bool) -> Any:
    """The frozen kernel of a shading, a row of lights, and a kind of normals."""
    import drjit as dr

    from mpcam_kernels.frozen import frozen

    @frozen
    def kernel(triangle: Any, weights: Any, data: dict[str, Any]) -> Any:
        t = types()
        hit = triangle >= 0
        face = t.UInt(dr.maximum(triangle, 0))
        corners = dr.gather(t.Array3u, data["faces"], face, hit)
        mix = (1 - weights[0] - weights[1], weights[0], weights[1])

        def mixed(kind: Any, values: Any) -> Any:
            return sum(
                dr.gather(kind, values, corner, hit) * weight for corner, weight in zip(corners, mix, strict=True)
            )

        color, normal = t.Array3f(1.0), None
        if shading != "normal":
            material = dr.gather(t.UInt, data["material"], face, hit)
            color = dr.gather(t.Array3f, data["base"], material, hit)
            if "colors" in data:
                color *= mixed(t.Array3f, data["colors"])
            if "uv" in data:
                color *= _texture(t, data, material, mixed(t.Array2f, data["uv"]), hit)
        if shading in ("normal", "light"):
            a, b, c = (dr.gather(t.Array3f, data["vertices"], corner, hit) for corner in corners)
            flat = normal = _unit(dr.cross(b - a, c - a))
            if smooth:
                normal = mixed(t.Array3f, data["normals"])
                normal = dr.select(dr.squared_norm(normal) > 0, _unit(normal), flat)
            pose, d = data["pose"], data["direction"]
            back = t.Array3f(*(-(pose[i] * d[0] + pose[3 + i] * d[1] + pose[6 + i] * d[2]) for i in range(3)))
            normal = dr.select(dr.dot(normal, back) < 0, -normal, normal)
            if shading == "normal":
                color = 0.5 + 0.5 * normal
            elif not lights:
                color *= _ambient(t, data) + dr.maximum(dr.dot(normal, back), 0)
            else:
                # From what is hit, not along the ray, which may be bent; from the anchor, where float32 is dense.
                point = (a * mix[0] + b * mix[1] + c * mix[2]) * data["scale"] if "scale" in data else None
                color *= lit(t, data, lights, normal, point, flat)
        return dr.select(hit, color, _unhit(t, data))

    return kernel


def _unit(vector: Any) -> Any:
    """Of length 1 however small it is; (0, 0, 0) stays."""
    import drjit as dr

    largest = dr.maximum(dr.maximum(abs(vector.x), abs(vector.y)), abs(vector.z))
    scaled = vector * dr.select(largest > 0, 1.0 / largest, 0.0)
    return scaled * dr.rsqrt(dr.maximum(dr.squared_norm(scaled), 1e-30))


def _rotation(hits: Hits) -> list[Any]:
    """The nine numbers of the rotation from the world to the frame of the hits' rays, on the device."""
    return opaque_numbers([*np.asarray(hits.view.pose, np.float64)[:3, :3].ravel()])


def _environment(hits: Hits, scene: Scene) -> dict[str, Any]:
    """What look-ups in the scene's environment need."""
    rays = {"pose": _rotation(hits), "direction": hits.view.ray.direction}
    return {"environment": scene.environment.on_device, **rays}


def _unhit(t: Any, data: dict[str, Any]) -> Any:
    """What is seen where nothing is hit."""
    if "environment" not in data:
        return t.Array3f(*data["background"])
    return data["environment"].lookup(_to_world(t, data["pose"], data["direction"]))


def _texture(t: Any, data: dict[str, Any], material: Any, uv: Any, hit: Any) -> Any:
    """Bilinear look-up with repetition; v runs up, texture rows run down. White where a material has no texture."""
    import drjit as dr

    start, width, height = dr.gather(t.Array3u, data["textures"], material, hit)
    some = hit & (width > 0)
    columns, rows = t.Int(dr.maximum(width, 1)), t.Int(dr.maximum(height, 1))
    u, v = uv.x - dr.floor(uv.x), 1.0 - (uv.y - dr.floor(uv.y))
    x, y = u * t.Float(columns) - 0.5, v * t.Float(rows) - 0.5
    left, top = t.Int(dr.floor(x)), t.Int(dr.floor(y))
    fx, fy = x - t.Float(left), y - t.Float(top)

    def texel(i: int, j: int) -> Any:
        column, row = left + i, top + j
        column = dr.select(column < 0, column + columns, dr.select(column >= columns, column - columns, column))
        row = dr.select(row < 0, row + rows, dr.select(row >= rows, row - rows, row))
        return dr.gather(t.Array3f, data["texels"], start + t.UInt(row * columns + column), some)

    upper, lower = texel(0, 0) * (1 - fx) + texel(1, 0) * fx, texel(0, 1) * (1 - fx) + texel(1, 1) * fx
    return dr.select(some, upper * (1 - fy) + lower * fy, 1.0)


def _ambient(t: Any, data: dict[str, Any]) -> Any:
    """Light from everywhere, as much of it as arrives."""
    ambient = t.Array3f(*data["ambient"])
    return ambient * data["exposure"] if "exposure" in data else ambient


def lit(t: Any, data: dict[str, Any], lights: tuple[str, ...], normal: Any, point: Any, flat: Any) -> Any:
    """Light that arrives, for a white surface: ambient and Lambert's law for each light that is not in shadow."""
    import drjit as dr

    total, reached = _ambient(t, data), [True] * len(lights)
    if "shadows" in data:
        reached = [shadow.visible(point, flat) for shadow in data["shadows"]]
    for kind, numbers, free in zip(lights, data["lights"], reached, strict=True):
        place, strength = t.Array3f(*numbers[:3]), t.Array3f(*numbers[3:])
        if kind == "directional":
            arriving = dr.maximum(dr.dot(normal, place), 0)
        else:
            away = place - point
            squared = dr.maximum(dr.squared_norm(away), 1e-30)
            arriving = dr.maximum(dr.dot(normal, away), 0) * dr.rsqrt(squared) / squared
        total += strength * (arriving if free is True else dr.select(free, arriving, 0.0))
    return total


def _to_world(t: Any, pose: list[Any], vector: list[Any]) -> Any:
    """A vector of the camera frame in world axes."""
    return t.Array3f(*(pose[i] * vector[0] + pose[3 + i] * vector[1] + pose[6 + i] * vector[2] for i in range(3)))
