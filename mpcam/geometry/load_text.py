"""Text files as other programs write them: their encoding, their line ends, and the file names in them."""

import codecs
import re
from collections.abc import Callable
from pathlib import Path

Say = Callable[[str], None]
"""Takes one sentence about what a file holds and the mesh has not; `load_mesh` makes a warning of it."""

# of 32 bits before 16, whose mark is how the longer one begins
_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32-le"),
    (codecs.BOM_UTF32_BE, "utf-32-be"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)


def decode_text(data: bytes) -> str:
    """A file as text, all lines ended by a newline alone.

    The encoding is that of the byte-order mark, which is no part of the text; without one, UTF-16 where every second
    byte at the start is 0, else UTF-8, else Latin-1.
    """
    for mark, encoding in _MARKS:
        if data.startswith(mark):
            text = data[len(mark) :].decode(encoding, errors="replace")
            break
    else:
        if data[1:8:2] and not any(data[1:8:2]) and any(data[0:8:2]):
            text = data.decode("utf-16-le", errors="replace")
        elif data[1:8:2] and not any(data[0:8:2]) and any(data[1:8:2]):
            text = data.decode("utf-16-be", errors="replace")
        else:
            try:
                text = data.decode("utf-8")
            except UnicodeDecodeError:
                text = data.decode("latin-1")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def names_meant(text: str) -> list[str]:
    """What a name at the end of a line may be, likeliest first: all of it, or all before a comment; without quotes."""
    whole = text.strip()
    ends = [len(whole), *(found.start() for found in reversed(list(re.finditer(r"(?<!\S)#", whole))))]
    names = []
    for end in ends:
        name = whole[:end].strip()
        if len(name) > 1 and name[0] == name[-1] and name[0] in "\"'":
            name = name[1:-1].strip()
        names += [name] if name else []
    return names


def find_file(folder: Path, text: str, moved: bool = True) -> Path | None:
    """The file that a name at the end of a line means, as seen from the folder; None if there is none.

    Either slash will do, and so will letters in another case. moved: of a path that is not there, as one of another
    machine, the last part is looked for in the folder.
    """
    for name in names_meant(text):
        written = Path(name.replace("\\", "/"))
        for path in (folder / written, folder / written.name)[: 1 + moved]:
            found = _in_any_case(path) if path.name else None
            if found is not None:
                return found
    return None


def _in_any_case(path: Path) -> Path | None:
    try:
        if path.is_file():
            return path
        same = [other for other in path.parent.iterdir() if other.name.lower() == path.name.lower()]
        return next((other for other in sorted(same) if other.is_file()), None)
    except (OSError, ValueError):  # no such folder, not to be read, or a name that no file can have
        return None
