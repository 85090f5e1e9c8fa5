"""The tables [mirror] and [refractor] of a scene file turned into a Mirror and a Refractor."""

import inspect
import math
from pathlib import Path
from typing import Any

from mpcam.geometry.surfaces import Surface
from mpcam.io.camera_files import read_camera_file
from mpcam.io.scene_place import color, placement
from mpcam.io.scene_tables import MirrorTable, RefractorTable, ShapeTable
from mpcam.io.scene_text import SceneText
from mpcam.scene.mirror import Mirror
from mpcam.scene.refractor import Refractor

_SHAPE = ("radius", "radii", "ring", "tube", "height", "length", "angle", "size", "waves")


def build_mirror(table: MirrorTable, folder: Path, text: SceneText) -> Mirror:
    """The mirror that the table describes. Raises InputError, with the line of the key."""
    surface = _shape(table, "mirror", folder, text)
    with text.at("mirror"):
        tint = color(table.color, text, "mirror", "color")
        triangles = (table.triangles, table.resolution, table.mode)
        orders = (table.bounces, table.reflectance, table.own)
        images, fitted = _depth_images(table, "mirror", folder, text), _camera_triangles(table, folder, text)
        return Mirror(surface, table.index, tint, *triangles, images, *orders, fitted)


def _camera_triangles(table: MirrorTable, folder: Path, text: SceneText) -> Any:
    """Those of a file that `mpcam fit` wrote."""
    if table.camera_triangles is None:
        return None
    from mpcam.io.fits import read_fit

    with text.at("mirror", "camera_triangles"):
        return read_fit(folder / table.camera_triangles)


def build_refractor(table: RefractorTable, folder: Path, text: SceneText) -> Refractor:
    """The thing of glass that the table describes. Raises InputError, with the line of the key."""
    surface = _shape(table, "refractor", folder, text)
    with text.at("refractor"):
        tint = color(table.color, text, "refractor", "color")
        images = _depth_images(table, "refractor", folder, text)
        return Refractor(surface, table.index, tint, table.second, table.inner, table.fresnel, images)


def _shape(table: ShapeTable, key: str, folder: Path, text: SceneText) -> Any:
    """The surface or mesh of a table, by the key of the table."""
    kinds = [name for name in ("surface", "file", "builtin") if getattr(table, name) is not None]
    if len(kinds) != 1:
        raise text.error((key,), "give one of surface, file (a mesh file) and builtin (a built-in mesh)")
    place = placement(table.scale, table.rotate, table.translate, (key,), text)
    return _surface(table, key, place, text) if kinds == ["surface"] else _mesh(table, key, place, folder, text)


def _depth_images(table: ShapeTable, key: str, folder: Path, text: SceneText) -> dict[str, Any] | None:
    """Settings of method "depth_image"."""
    given = table.depth_images
    if given is None:
        return None
    found: dict[str, Any] = {name: getattr(given, name) for name in ("size", "aside", "coarse", "fine")}
    if given.cameras is not None:
        with text.at(key, "depth_images", "cameras"):
            found["images"] = [read_camera_file(folder / name, None, None)[0] for name in given.cameras]
    return found


def _surface(table: ShapeTable, key: str, place: Any, text: SceneText) -> Surface:
    make = getattr(Surface, str(table.surface))
    allowed = [name for name in inspect.signature(make).parameters if name != "center"]
    given = {name: getattr(table, name) for name in _SHAPE if getattr(table, name) is not None}
    for name in given:
        if name not in allowed:
            raise text.error((key, name), f"a {table.surface} has no {name}: it takes {', '.join(allowed)}")
    if table.scale != 1.0:
        raise text.error((key, "scale"), f"a surface is not scaled: give its {', '.join(allowed)}")
    if table.surface == "ellipsoid" and "radii" not in given:
        raise text.error((key, "surface"), "an ellipsoid needs radii, e.g. [1, 0.5, 0.5]")
    if "angle" in given:
        given["angle"] = math.radians(given["angle"])
    with text.at(key, "surface"):
        return make(**given).transformed(place)


def _mesh(table: ShapeTable, key: str, place: Any, folder: Path, text: SceneText) -> Any:
    for name in _SHAPE:
        if getattr(table, name) is not None:
            raise text.error((key, name), f"{name} goes with surface, not with a mesh: use scale")
    if table.file is not None:
        from mpcam.geometry.load import load_mesh

        with text.at(key, "file"):
            return load_mesh(folder / table.file).transformed(place)
    from mpcam.geometry.builtin import builtin_mesh

    if table.builtin not in builtin_mesh.names:
        raise text.error((key, "builtin"), f"allowed are {', '.join(builtin_mesh.names)}")
    with text.at(key, "builtin"):
        return builtin_mesh(str(table.builtin)).transformed(place)
