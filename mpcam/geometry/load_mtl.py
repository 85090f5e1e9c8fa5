"""MTL, the material files of Wavefront OBJ: color, texture image, and where the image lies on the faces."""

import math
from dataclasses import dataclass
from pathlib import Path

from mpcam.checks import shown
from mpcam.errors import InputError
from mpcam.geometry.load_image import read_texture
from mpcam.geometry.load_text import Say, decode_text, find_file, names_meant
from mpcam.geometry.mesh import Material

# Options of a map_Kd line: how many values follow at least and at most. Those beyond the first are numbers.
_OPTIONS = {"-o": (1, 3), "-s": (1, 3), "-t": (1, 3), "-mm": (2, 2)} | dict.fromkeys(
    ("-blendu", "-blendv", "-boost", "-texres", "-clamp", "-bm", "-imfchan", "-cc", "-type", "-colorspace"), (1, 1)
)


@dataclass(frozen=True)
class Look:
    """A material, and its texture coordinates: (u, v) of the mesh times scale plus offset; clamped: not repeated."""

    material: Material
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)
    clamped: bool = False


@dataclass
class Entry:
    """What an MTL file says of one material; image: the map_Kd line without its key."""

    file: Path
    color: tuple[float, float, float] | None = None
    image: str = ""
    opaque: bool = True


def read_mtl(file: Path) -> dict[str, Entry]:
    """The materials of a file by name, also by the name without a comment. Raises InputError for what is no color."""
    entries: dict[str, Entry] = {}
    entry = None
    for number, line in enumerate(decode_text(file.read_bytes()).split("\n"), 1):
        key, *rest = line.split(None, 1)[:2] or [""]
        key, text = key.lower(), "".join(rest).strip()
        if key == "newmtl":
            entry = Entry(file)
            names = names_meant(text) or [""]
            entries |= {names[0]: entry} | {name: entries.get(name, entry) for name in names[1:]}
        elif entry is None:
            continue
        elif key == "kd":
            entry.color = _color(text, f"{file} line {number}")
        elif key == "map_kd":
            entry.image = text
        elif key == "map_d":
            entry.opaque = False
        elif key == "d":
            entry.opaque = all(value >= 1 for value in _numbers(text.partition("#")[0].split()[-1:]))
    return entries


def look_of(name: str, entry: Entry, say: Say) -> Look:
    """The material with its texture, which is read; say is told of what is missing or not used."""
    if not entry.opaque:
        say(f"material {name} is transparent (d, map_d): it is drawn opaque")
    if not entry.image:
        return Look(Material(entry.color or (0.8, 0.8, 0.8), None, name))
    color = entry.color or (1.0, 1.0, 1.0)
    options, rest = _options(entry.image, name, say)
    # of an option that is not known, the values may stand before the name
    found = (find_file(entry.file.parent, rest.split(None, k)[k]) for k in range(len(rest.split())))
    path = next((path for path in found if path is not None), None)
    try:
        if path is None:
            missing = (names_meant(rest) or [""])[-1]
            raise InputError(f"texture {missing} does not exist: put the image there or correct {entry.file.name}")
        texture, _ = read_texture(path)
    except InputError as error:
        say(f"{error}; material {name} has no texture")
        return Look(Material(color, None, name))
    # exporters write a black Kd beside an image and mean the image
    color = color if any(color) else (1.0, 1.0, 1.0)
    scale = [*_numbers(options.get("-s", [])), *(1.0, 1.0)[len(options.get("-s", [])) :]]
    offset = [*_numbers(options.get("-o", [])), *(0.0, 0.0)[len(options.get("-o", [])) :]]
    clamped = options.get("-clamp", [""])[0].lower() == "on"
    return Look(Material(color, texture, name), (scale[0], scale[1]), (offset[0], offset[1]), clamped)


def _options(text: str, name: str, say: Say) -> tuple[dict[str, list[str]], str]:
    """The options of a map_Kd line with their values, and the file name behind them."""
    words = text.split()
    options: dict[str, list[str]] = {}
    k = 0
    while k < len(words) - 1 and words[k].startswith("-"):
        option = words[k].lower()
        least, most = _OPTIONS.get(option, (0, 0))
        if option not in _OPTIONS:
            say(f"map_Kd of material {name} has the option {option}, which is not known: it is not used")
        end = k + 1 + least
        while end < len(words) - 1 and end < k + 1 + most and len(_numbers(words[end : end + 1])) == 1:
            end += 1
        options[option] = words[k + 1 : end]
        k = end
    if any(_numbers(options.get("-t", []))):
        say(f"map_Kd of material {name} has turbulence (-t): it is not used")
    if _numbers(options.get("-mm", [])) not in ([], [0.0, 1.0]):
        say(f"map_Kd of material {name} changes the range of the image (-mm): it is not used")
    return options, text.split(None, k)[k]


def _numbers(words: list[str]) -> list[float]:
    """The numbers at the start of some words."""
    numbers = []
    for word in words:
        try:
            numbers.append(float(word))
        except ValueError:
            break
    return numbers


def _color(text: str, where: str) -> tuple[float, float, float]:
    words = text.partition("#")[0].split()
    values = [max(value, 0.0) for value in _numbers(words[:3])]
    if len(values) != min(len(words), 3) or len(values) == 0 or not all(map(math.isfinite, values)):
        raise InputError(f"{where}: Kd is {shown(text)}, not numbers: give Kd r g b")
    return values[0], values[len(values) // 2], values[-1]
