"""Colors of reliefs where they are met, over those of what is behind."""

import functools
from collections.abc import Sequence
from typing import Any

from mpcam.backend import opaque_numbers, types
from mpcam.effects.relief_hits import Part, ReliefHits
from mpcam.errors import InputError
from mpcam.rendering.shade import check_shading, light_kinds, light_numbers
from mpcam.scene.scene import Scene


def shade_reliefs(found: ReliefHits, behind: Any, scene: Scene, shading: str, shadows: Sequence[Any] = ()) -> Any:
    """The colors with the reliefs over them: an Array3f on the device, one entry per pixel, row by row.

    behind: Array3f, what is seen where no relief is. shading: as in `shade`; "color" and "texture" are the same.
    shadows: maps of the scene's lights. Raises InputError for reliefs without the normals that the shading needs.
    """
    check_shading(shading)
    color = behind
    for name, part in enumerate(found.parts):
        color = _shaded(found, name, part, color, scene, shading, shadows)
    return color


def _shaded(
    found: ReliefHits, name: int, part: Part, behind: Any, scene: Scene, shading: str, shadows: Sequence[Any]
) -> Any:
    import drjit as dr

    instances, mesh = part.instances, part.instances.device.mesh
    relief, image = instances.relief, instances.relief.images[part.image]
    texels, lit = relief.texels[part.image], shading in ("light", "normal")
    if lit and texels.normals is None:
        raise InputError(
            f"shading={shading!r} needs normals, and the relief has none: give its image normals=, or use 'texture'"
        )
    data: dict[str, Any] = {"patches": image.any_surface().patches, "key": texels.key}
    if shading != "normal":
        data["colors"] = texels.colors
        data |= {} if instances.colors is None else {"paint": instances.device_colors}
    kinds: tuple[str, ...] = ()
    if lit:
        data |= {"normals": texels.normals, "poses": instances.device.poses, "pose": part.pose}
        data |= {"rays": part.rays.blocks.rays, "unit": opaque_numbers([mesh.scale, 1.0 / mesh.scale])}
    if shading == "light":
        kinds = light_kinds(scene)
        data["ambient"] = opaque_numbers(list(scene.ambient))
        data["lights"] = [light_numbers(light, mesh.anchor) for light in scene.lights]
        if shadows:
            data["shadows"] = [one.on_device(mesh.anchor) for one in shadows]
    size = image.camera.width, image.camera.height
    hits = found.device_part, found.device_slot, found.device_instance, found.device_depth
    kernel = _kernel(size, shading, kinds, part.rays.kind)
    return kernel(hits, part.met[1:4], dr.opaque(types().Int, name), behind, data)


@functools.lru_cache(maxsize=64)
def _kernel(size: tuple[int, int], shading: str, kinds: tuple[str, ...], kind: str) -> Any:
    import drjit as dr

    from mpcam.rendering.shade import lit as lit_by
    from mpcam_kernels.frozen import frozen
    from mpcam_kernels.relief import turned_back, way_of
    from mpcam_kernels.relief_colors import looks
    from mpcam_kernels.rows import Rows

    @frozen
    def kernel(hits: tuple[Any, ...], met: tuple[Any, ...], name: Any, behind: Any, data: dict[str, Any]) -> Any:
        t = types()
        part, slot, copy, depth = hits
        hit, at = part == name, t.UInt(dr.maximum(slot, 0))
        u, v = (dr.gather(t.Float, values, at, hit) for values in met[:2])
        number = dr.gather(t.UInt, met[2], at, hit)
        which, paint = t.UInt(dr.maximum(copy, 0)), t.Array3f(*data["key"])
        if "paint" in data:
            paint = dr.gather(t.Array3f, data["paint"], which, hit)
        tables = data.get("colors"), data.get("normals")
        seen = looks(t, size, hit, (u, v), number, data["patches"], *tables, paint)
        color = seen.color
        if shading in ("light", "normal"):
            rows = Rows(data["poses"], 3).at(t, which, hit)
            normal, flat = (turned_back(t, rows, one) for one in (seen.normal, seen.flat))
            origin, direction, start = way_of(t, kind == "bent", data["rays"], data["pose"], at, hit)
            normal = dr.select(dr.dot(normal, direction) > 0, -normal, normal)
            if shading == "normal":
                color = 0.5 + 0.5 * normal
            elif not kinds:
                color = color * (t.Array3f(*data["ambient"]) + dr.maximum(-dr.dot(normal, direction), 0))
            else:
                unit, inverse = data["unit"]
                point = (origin + direction * (dr.select(hit, depth, 0.0) * inverse - start)) * unit
                color = color * lit_by(t, data, kinds, normal, point, flat)
        return dr.select(hit, color, behind)

    return kernel
