"""Docstrings of this project taken apart: plain sentences, some of the form `name, name (shape): what it is.`"""

import re
from dataclasses import dataclass, field

_NAME = r"(?!default\b)[a-z_][A-Za-z0-9_]*"
_SHAPE = r"(?: \((?:[^()]|\([^()]*\))*\))?"
_ITEM = re.compile(rf"(?:^|(?<=[.;] ))({_NAME}(?:(?:,| and) {_NAME})*)({_SHAPE}): ")
_SENTENCE = re.compile(r"(?<=[.)\"]) (?=[A-Z])")
_CLOSING = re.compile(r"(?:^|(?<=\. ))(?:Returns|Raises) ")


@dataclass
class Entry:
    """One or more names that share a description."""

    names: tuple[str, ...]
    shape: str
    text: str


@dataclass
class Parts:
    """A docstring: paragraphs of text before and after the entries, the entries, and what is returned and raised."""

    before: list[str] = field(default_factory=list)
    entries: list[Entry] = field(default_factory=list)
    after: list[str] = field(default_factory=list)
    returns: list[str] = field(default_factory=list)
    raises: list[str] = field(default_factory=list)


def take_apart(docstring: str) -> Parts:
    """The parts of a docstring whose indentation is already removed. Indented paragraphs are kept as they are."""
    parts = Parts()
    for paragraph in re.split(r"\n\s*\n", docstring.strip()):
        loose = parts.after if parts.entries else parts.before
        if paragraph.startswith((" ", "*", "-")):
            loose.append(paragraph)
            continue
        text = _without_closing(" ".join(paragraph.split()), parts)
        items = list(_ITEM.finditer(text))
        lead = text[: items[0].start()].strip() if items else text
        if lead:
            loose.append(lead)
        for item, following in zip(items, [*items[1:], None], strict=False):
            body = text[item.end() : following.start() if following else len(text)].strip()
            if following is None:  # what follows the last entry's first sentence is about the whole
                first, *rest = _SENTENCE.split(body, maxsplit=1)
                body = first
                parts.after += rest
            names = tuple(re.split(r", | and ", item[1]))
            parts.entries.append(Entry(names, item[2].strip(), body.rstrip(" ;")))
    return parts


def _without_closing(text: str, parts: Parts) -> str:
    """The text up to its first sentence that begins with Returns or Raises; those and what follows go to `parts`."""
    found = list(_CLOSING.finditer(text))
    for item, following in zip(found, [*found[1:], None], strict=False):
        sentence = text[item.start() : following.start() if following else len(text)].strip()
        kind, rest = sentence.split(" ", 1)
        (parts.returns if kind == "Returns" else parts.raises).append(rest)
    return text[: found[0].start()].strip() if found else text


def as_rst(docstring: str) -> list[str]:
    """The docstring as lines of reStructuredText: text, then a field list of parameters, returns and raises."""
    parts = take_apart(docstring)
    lines = [line for text in (*parts.before, *parts.after) for line in (*text.split("\n"), "")]
    for entry in parts.entries[:1]:
        lines.append(":Parameters:" if entry else "")
    for entry in parts.entries:
        names = ", ".join(f"**{name}**" for name in entry.names)
        shape = f" {entry.shape}" if entry.shape else ""
        lines.append(f"    * {names}{shape}: {entry.text}")
    for title, texts in (("Returns", parts.returns), ("Raises", parts.raises)):
        lines += [f":{title}: {' '.join(texts)}"] if texts else []
    return [*lines, ""]
