"""The reliefs of a scene file: a mesh, its image, and where the copies are."""

from pathlib import Path
from typing import Any

import numpy as np

from mpcam.geometry.mesh import Mesh
from mpcam.io.scene_place import color, placement
from mpcam.io.scene_tables import MeshTable, ReliefTable
from mpcam.io.scene_text import SceneText

Where = tuple[str | int, ...]


def source_mesh(table: MeshTable | ReliefTable, where: Where, folder: Path, text: SceneText) -> Mesh:
    """The mesh of a table, from a file or built in."""
    if (table.file is None) == (table.builtin is None):
        raise text.error(where, "give either file (a mesh file) or builtin (the name of a built-in mesh)")
    if table.file is None:
        return _builtin(table, where, text)
    if table.triangles is not None:
        raise text.error((*where, "triangles"), "only built-in meshes can be made with a number of triangles")
    from mpcam.geometry.load import load_mesh

    with text.at(*where, "file"):
        return load_mesh(folder / table.file)


def _builtin(table: MeshTable | ReliefTable, where: Where, text: SceneText) -> Mesh:
    from mpcam.geometry.builtin import builtin_mesh

    name = table.builtin
    if name is None or name not in builtin_mesh.names:
        raise text.error((*where, "builtin"), f"allowed are {', '.join(builtin_mesh.names)}")
    with text.at(*where, "triangles" if table.triangles else "builtin"):
        return builtin_mesh(name, triangles=table.triangles)


def build_relief(table: ReliefTable, index: int, folder: Path, text: SceneText) -> Any:
    """The copies that a [[relief]] describes; raises InputError with the line of what is wrong."""
    from mpcam.effects.relief import Relief

    where = ("relief", index)
    mesh = source_mesh(table, where, folder, text)
    if table.layers > 1 and table.camera != "orthographic":
        raise text.error((*where, "layers"), 'only camera = "orthographic" may have layers')
    with text.at(*where, *(() if table.key is None else ("key",))):
        relief = Relief.render(mesh, table.camera, table.size, key=table.key, layers=table.layers)
    placements, colors = _places(table, where, folder, text)
    with text.at(*where):
        return relief.instances(placements, colors)


def _places(table: ReliefTable, where: Where, folder: Path, text: SceneText) -> tuple[np.ndarray, Any]:
    """(N, 4, 4) placements, and (N, 3) colors or None."""
    given = [name for name in ("grid", "placements", "place") if getattr(table, name)]
    if len(given) != 1:
        raise text.error(where, "give one of grid, placements (a .npy file) and [[relief.place]]")
    if given == ["place"]:
        if table.colors is not None:
            raise text.error((*where, "colors"), "each [[relief.place]] has a color of its own: give it there")
        return _listed(table, where, text)
    if given == ["grid"]:
        matrices = _grid(table)
    else:
        with text.at(*where, "placements"):
            matrices = _read(folder / str(table.placements))
    if table.colors is None:
        return matrices, None
    if not table.colors:
        raise text.error((*where, "colors"), "give at least one color")
    colors = [color(one, text, *where, "colors", number) for number, one in enumerate(table.colors)]
    return matrices, np.array(colors)[np.arange(len(matrices)) % len(colors)]


def _listed(table: ReliefTable, where: Where, text: SceneText) -> tuple[np.ndarray, Any]:
    made, colors = [], []
    for number, place in enumerate(table.place):
        own = (*where, "place", number)
        made.append(placement(place.scale, place.rotate, place.translate, own, text))
        colors.append(None if place.color is None else color(place.color, text, *own, "color"))
    some = [one is not None for one in colors]
    if any(some) and not all(some):
        number = some.index(False)
        raise text.error((*where, "place", number), "other copies have a color: give this one too, or none of them")
    return np.array(made), np.array(colors) if all(some) else None


def _grid(table: ReliefTable) -> np.ndarray:
    grid = table.grid
    assert grid is not None
    row, column = (part.ravel() for part in np.indices((grid.rows, grid.columns)))
    matrices = np.tile(np.eye(4), (grid.rows * grid.columns, 1, 1))
    matrices[:, 0, 3] = (row - 0.5 * (grid.rows - 1)) * grid.spacing[0]
    matrices[:, 1, 3] = (column - 0.5 * (grid.columns - 1)) * grid.spacing[1]
    return matrices


def _read(path: Path) -> np.ndarray:
    from mpcam.errors import InputError

    try:
        return np.asarray(np.load(path, allow_pickle=False))
    except (OSError, ValueError, EOFError) as error:
        raise InputError(f"{path}: cannot be read as a .npy file: {error}") from None
