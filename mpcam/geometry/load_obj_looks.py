"""The materials of an OBJ file's faces: which library each name is in, and where its texture lies."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from mpcam.geometry.load_mtl import Entry, Look, look_of, read_mtl
from mpcam.geometry.load_text import Say, find_file, names_meant
from mpcam.geometry.mesh import Material


def dress(
    path: Path,
    libraries: list[str],
    names: dict[str, int],
    used: list[int],
    counts: np.ndarray,
    texcoord: np.ndarray,
    index: np.ndarray,
    plain: Material,
    say: Say,
) -> tuple[np.ndarray, tuple[Material, ...], np.ndarray]:
    """Texture coordinates with those that materials move added, the materials, and (P,) that of each polygon.

    libraries: what stands on the mtllib lines. names: what stands on usemtl lines, and its number; used: (P,) that of
    each polygon, -1 for the plain one. index: (C, 3) numbers of the corners, whose second column is changed to name
    the moved texture coordinates.
    """
    known, complete = _libraries(path, libraries, say)
    looks = [_look(text, known, complete, plain, say) for text in names]
    material_of = np.array(used)
    if (material_of < 0).any():
        material_of = np.where(material_of < 0, len(looks), material_of)
        looks.append(Look(plain))
    owner = np.repeat(np.arange(len(counts)), counts)
    bare = np.bincount(owner[index[:, 1] < 0], minlength=len(counts)) > 0
    tables = [texcoord]
    for k, look in enumerate(looks):
        mine = material_of == k
        if look.material.texture is None or not mine.any():
            continue
        without = mine & bare
        if without.any():
            say(
                f"{np.count_nonzero(without)} faces of material {look.material.name} have no texture coordinates: "
                "they are drawn without its texture"
            )
            material_of[without] = len(looks)
            looks.append(Look(replace(look.material, texture=None)))
        corners = (mine & ~bare)[owner]
        if not corners.any():
            continue
        if look.scale != (1.0, 1.0) or look.offset != (0.0, 0.0):
            index[corners, 1] += sum(map(len, tables))
            tables.append(texcoord * look.scale + look.offset)
        placed = texcoord[index[corners, 1] % len(texcoord)] * look.scale + look.offset
        if look.clamped and (placed.min() < -1e-6 or placed.max() > 1 + 1e-6):
            say(
                f"the texture of material {look.material.name} is clamped (-clamp on), but texture coordinates run "
                "outside of 0 to 1: it is repeated there"
            )
    kept = [k for k in range(len(looks)) if k < len(names) or (material_of == k).any()]
    material_of = np.searchsorted(kept, material_of)
    return np.concatenate(tables), tuple(looks[k].material for k in kept), material_of


def _look(text: str, known: dict[str, Entry], complete: bool, plain: Material, say: Say) -> Look:
    """The look that a usemtl line asks for; where it is in no library, the plain one by that name."""
    meant = names_meant(text) or [""]
    for name in meant:
        if name in known:
            return look_of(name, known[name], say)
    if complete and meant != [""]:
        say(f"material {meant[-1]} is in no material file (usemtl, mtllib): its faces are gray")
    return Look(replace(plain, name=meant[-1]))


def _libraries(path: Path, libraries: list[str], say: Say) -> tuple[dict[str, Entry], bool]:
    """The materials of all libraries by name, and whether all libraries are there."""
    known: dict[str, Entry] = {}
    complete = True
    for line in libraries:
        for name, file in _files(path.parent, line):
            try:
                entries = read_mtl(file) if file is not None else None
            except OSError:
                entries = None
            if entries is None:
                say(f"material file {name} not found, or not to be read: its materials are gray")
                complete = False
            else:
                known = {**entries, **known}
    return known, complete


def _files(folder: Path, line: str) -> list[tuple[str, Path | None]]:
    """The files on a mtllib line: names with spaces between, which may have spaces and quotes themselves."""
    whole = find_file(folder, line, moved=False)
    if whole is not None:
        return [(line, whole)]
    words = line.split()
    found: list[tuple[str, Path | None]] = []
    while words and not words[0].startswith("#"):
        for count in range(len(words), 0, -1):
            name = " ".join(words[:count])
            file = find_file(folder, name, moved=False)
            if file is not None:
                break
        else:
            # up to where a name plainly ends
            ends = [k for k, word in enumerate(words, 1) if word.strip("\"'").lower().endswith(".mtl")]
            count = ends[0] if ends else len(words)
            name = " ".join(words[:count])
            file = find_file(folder, name)
        found.append(((names_meant(name) or [name])[-1], file))
        words = words[count:]
    return found
