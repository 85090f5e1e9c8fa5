"""The tables of a scene file turned into meshes, lights and a camera."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mpcam.geometry.mesh import Material, Mesh
from mpcam.io.camera_tables import CameraFile, any_camera_table
from mpcam.io.images import read_image
from mpcam.io.scene_camera import build_camera, default_camera
from mpcam.io.scene_mirror import build_mirror, build_refractor
from mpcam.io.scene_place import color, placement
from mpcam.io.scene_relief import build_relief, source_mesh
from mpcam.io.scene_tables import (
    DirectionalTable,
    EnvironmentTable,
    MeshTable,
    OcclusionTable,
    PointTable,
    SceneTable,
)
from mpcam.io.scene_text import SceneText
from mpcam.scene.occlusion import Occlusion
from mpcam.scene.scene import DirectionalLight, Light, PointLight, Scene


def build_scene(table: SceneTable, folder: Path, name: str, text: SceneText) -> Scene:
    """The scene that the tables describe; file names are relative to folder, name is used where the file gives none.

    Raises InputError, with the line of the key, for what the tables' types do not rule out.
    """
    meshes = tuple(_mesh(entry, index, folder, text) for index, entry in enumerate(table.mesh))
    reliefs = tuple(build_relief(entry, index, folder, text) for index, entry in enumerate(table.relief))
    bounds = bounds_of((*meshes, *(one.boxes for one in reliefs)))
    if table.camera is None:
        with text.at("mesh"):
            camera = default_camera(bounds)
    else:
        named = isinstance(table.camera, dict) and "file" in table.camera
        camera = build_camera(text.read(CameraFile if named else any_camera_table(), "camera"), bounds, folder, text)
    if table.light is None:
        lights: tuple[Light, ...] = (default_light(camera),)
    else:
        lights = tuple(_light(entry, index, text) for index, entry in enumerate(table.light))
    if table.mirror is not None and table.refractor is not None:
        raise text.error(("refractor",), "a scene has a mirror or a refractor: leave one of them out")
    return Scene(
        meshes,
        camera=camera,
        lights=lights,
        ambient=color(table.ambient, text, "ambient"),
        background=color(table.background, text, "background"),
        name=table.name or name,
        mirror=None if table.mirror is None else build_mirror(table.mirror, folder, text),
        refractor=None if table.refractor is None else build_refractor(table.refractor, folder, text),
        environment=None if table.environment is None else _environment(table.environment, folder, text),
        reliefs=reliefs,
        occlusion=None if table.occlusion is None else _occlusion(table.occlusion, text),
    )


def bounds_of(meshes: tuple[Mesh, ...]) -> np.ndarray:
    """(2, 3) smallest and largest coordinates of all meshes that have vertices; zeros if there are none."""
    boxes = [mesh.bounds for mesh in meshes if len(mesh.vertices)]
    if not boxes:
        return np.zeros((2, 3))
    return np.stack([np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)])


def _occlusion(table: OcclusionTable, text: SceneText) -> Occlusion:
    fields = {name: getattr(table, name) for name in ("thickness", "directions", "steps", "falloff", "blur")}
    with text.at("occlusion"):
        return Occlusion(table.radius, **fields)


def _environment(table: EnvironmentTable, folder: Path, text: SceneText) -> Any:
    from mpcam.effects.environment import EnvironmentMap

    with text.at("environment", "image"):
        return EnvironmentMap.from_panorama(read_image(folder / table.image)[..., :3], table.size)


def default_light(camera: Any) -> DirectionalLight:
    """White light from behind the camera, to its left and above, so that what it sees is lit but not flatly."""
    right, down, forward = np.asarray(camera.camera_from_world)[:3, :3]
    x, y, z = forward + 0.5 * right + 0.6 * down
    return DirectionalLight((float(x), float(y), float(z)))


def _mesh(table: MeshTable, index: int, folder: Path, text: SceneText) -> Mesh:
    where = ("mesh", index)
    mesh = source_mesh(table, where, folder, text)
    with text.at(*where):
        mesh = mesh.transformed(placement(table.scale, table.rotate, table.translate, where, text))
    if table.color is None and table.texture is None:
        return mesh
    texture = None if table.texture is None else _texture(folder / table.texture, mesh, text, (*where, "texture"))
    tint = (1.0, 1.0, 1.0) if table.color is None else color(table.color, text, *where, "color")
    return replace(mesh, materials=(Material(tint, texture),), face_material=None)


def _texture(path: Path, mesh: Mesh, text: SceneText, where: tuple[str | int, ...]) -> np.ndarray:
    if mesh.uv is None:
        raise text.error(where, "the mesh has no texture coordinates: leave texture out, or give a mesh with uv")
    with text.at(*where):
        image = read_image(path)
    return np.repeat(image, 3, axis=2) if image.shape[2] == 1 else image[..., :3]


def _light(table: DirectionalTable | PointTable, index: int, text: SceneText) -> Light:
    with text.at("light", index):
        if isinstance(table, DirectionalTable):
            return DirectionalLight(table.direction, color(table.radiance, text, "light", index, "radiance"))
        return PointLight(table.position, color(table.intensity, text, "light", index, "intensity"))
