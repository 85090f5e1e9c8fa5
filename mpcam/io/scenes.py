"""Scenes from files and names: a TOML description, a bare mesh file, or a built-in scene."""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mpcam.errors import InputError
from mpcam.io.scene_build import bounds_of, build_scene, default_light
from mpcam.io.scene_camera import default_camera
from mpcam.io.scene_tables import CompareTable, SceneTable
from mpcam.io.scene_text import SceneText
from mpcam.scene.scene import Scene

_VERTICAL_Z = (".stl",)  # what mesh files of this kind are usually modeled with; the others have y up


@dataclass(frozen=True)
class CompareSettings:
    """What a scene asks of `mpcam compare`; None and missing keys leave the choice to it.

    methods: names of rasterization methods. settings: method -> tuple of keyword settings, one per row of the result,
    e.g. {"vertex": ({"level": 0}, {"level": 3})}. shading: as in mpcam.render. repeats: timed runs of each row.
    """

    methods: tuple[str, ...] | None = None
    settings: Mapping[str, tuple[Mapping[str, Any], ...]] = field(default_factory=dict)
    shading: str | None = None
    repeats: int | None = None


@dataclass(frozen=True)
class SceneFile:
    """A scene with its camera, how it wants to be compared, and the file that it came from (None if built in)."""

    scene: Scene
    compare: CompareSettings = field(default_factory=CompareSettings)
    path: Path | None = None

    @property
    def up(self) -> str:
        """The axis, "y" or "z", that points up: z in scenes, y in most mesh files."""
        if self.path is None or self.path.suffix.lower() in (".toml", *_VERTICAL_Z):
            return "z"
        return "y"


def load_scene(path_or_name) -> SceneFile:
    """The scene in a .toml or mesh file, or the built-in scene of that name.

    A mesh file is shown by a paraboloid camera (180 degrees, 512x512) from outside, lit from behind the camera. The
    keys of a TOML file are those of mpcam.io.scene_tables. A file of the same name as a built-in scene is reached as
    ./name. Raises InputError for names that are neither, for mesh files that cannot be read, and for mistakes in a
    TOML file, which are reported as file:line: key = value: what is allowed.
    """
    from mpcam.geometry.builtin import builtin_mesh
    from mpcam.scene.builtin import builtin_scene

    if isinstance(path_or_name, str) and path_or_name in builtin_mesh.names:
        return SceneFile(builtin_scene(path_or_name))
    path = Path(path_or_name)
    try:
        is_file, exists = path.is_file(), path.exists()
    except (OSError, ValueError) as error:  # a name too long, without permission, or with a zero byte
        raise InputError(f"{path}: cannot be read: {error}") from None
    if not exists:
        near = difflib.get_close_matches(str(path), builtin_mesh.names, 1)
        hint = f"did you mean {near[0]}? " if near else ""
        raise InputError(
            f"{path}: no such file, and no built-in scene: {hint}give a .toml or mesh file, or one of "
            f"{', '.join(builtin_mesh.names)}"
        )
    if not is_file:
        raise InputError(f"{path}: not a file: give a .toml or mesh file")
    return _from_toml(path) if path.suffix.lower() == ".toml" else _from_mesh(path)


def _from_toml(path: Path) -> SceneFile:
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise InputError(f"{path}:{line}: not UTF-8 text: save the file as UTF-8") from None
    source = SceneText(str(path), text)
    table = source.read(SceneTable)
    compare = _compare(table.compare, source)
    return SceneFile(build_scene(table, path.parent, path.stem, source), compare, path)


def _from_mesh(path: Path) -> SceneFile:
    from mpcam.geometry.load import load_mesh

    mesh = load_mesh(path)
    bare = SceneFile(Scene((mesh,), name=path.stem), path=path)
    camera = default_camera(bounds_of((mesh,)), bare.up)
    return replace(bare, scene=replace(bare.scene, camera=camera, lights=(default_light(camera),)))


def _compare(table: CompareTable, text: SceneText) -> CompareSettings:
    settings: dict[str, tuple[dict[str, Any], ...]] = {}
    for method, key, parameter in (
        ("vertex", "levels", "level"),
        ("two_pass", "patches", "patch"),
        ("cubemap", "resolutions", "resolution"),
        ("hemicube", "resolutions", "resolution"),
        ("camera_triangles", "triangles", "triangles"),
        ("environment", "sizes", "size"),
        ("depth_image", "sizes", "size"),
    ):
        values = getattr(table, method)
        if values is None:
            continue
        if table.methods is not None and method not in table.methods:
            raise text.error(
                ("compare", method), f"{method} is not among compare.methods: add it there, or leave this out"
            )
        numbers = getattr(values, key)
        if len(set(numbers)) < len(numbers):
            raise text.error(("compare", method, key), "give each number once")
        settings[method] = tuple({parameter: number} for number in numbers)
    if table.methods is not None and len(set(table.methods)) < len(table.methods):
        raise text.error(("compare", "methods"), "give each method once")
    return CompareSettings(
        None if table.methods is None else tuple(table.methods), settings, table.shading, table.repeats
    )
