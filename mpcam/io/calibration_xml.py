"""XML as OpenCV's FileStorage writes it, as the tree that its YAML would give."""

from typing import Any
from xml.etree import ElementTree

from mpcam.checks import reads_as_number
from mpcam.errors import InputError


def read_xml(text: str, name: str) -> dict[str, Any]:
    """Elements by name: numbers as texts, matrices as dictionaries with rows, cols, dt and data, <_> as a list.

    name: the file's, for messages. Raises InputError, with the line, for a text that is no XML.
    """
    try:
        root = ElementTree.fromstring(text.encode())
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        line = getattr(error, "position", (None,))[0]
        raise InputError(f"{name}{'' if line is None else f':{line}'}: not XML: {error}") from None
    if root.tag != "opencv_storage":
        return {root.tag: _value(root)}
    found = _value(root)
    return found if isinstance(found, dict) else {}


def _value(element: ElementTree.Element) -> Any:
    children = list(element)
    if not children:
        text = (element.text or "").strip()
        words = text.split()
        return words if len(words) > 1 and all(map(reads_as_number, words)) else text.strip('"')
    if all(child.tag == "_" for child in children):
        return [_value(child) for child in children]
    found: dict[str, Any] = {}
    for child in children:
        found[child.tag] = _value(child)
    if "data" in found:  # a matrix, whose lists may have one number or none
        for key in {"data", "sizes"} & found.keys():
            value = found[key]
            found[key] = value if isinstance(value, list) else ([value] if value else [])
    return found
