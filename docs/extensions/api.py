"""API entries: fields made of this project's plain docstrings, short signatures, and links by public name."""

import dataclasses
import inspect
import re
from typing import Any

from numpy.typing import ArrayLike
from sphinx.util.typing import stringify_annotation  # pyright: ignore[reportMissingImports]

import mpcam
from extensions.docstrings import as_rst  # pyright: ignore[reportMissingImports]


def process_docstring(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Rewrite a docstring in place; a dataclass without one of its own gets nothing."""
    text = "\n".join(lines).strip()
    if dataclasses.is_dataclass(obj) and text.startswith(f"{getattr(obj, '__name__', '')}("):
        text = ""
    fields = as_rst(text) if text else []
    if what == "class" and not _called_by_users(obj):
        fields = [line.replace(":Parameters:", ":Fields:") for line in fields]
    lines[:] = fields


def process_signature(
    app: Any, what: str, name: str, obj: Any, options: Any, signature: str | None, returned: str | None
) -> tuple[str | None, str | None] | None:
    """Leave out `Any`, which says nothing, and the constructors of what only mpcam itself makes."""
    if what == "class" and not _called_by_users(obj):
        return "", None
    if signature is None:
        return None
    for mode in ("smart", "fully-qualified-except-typing", "fully-qualified"):
        signature = signature.replace(stringify_annotation(ArrayLike, mode), "ArrayLike")
    signature = re.sub(r": (?:~?typing\.)?Any(?= |,|\)|=)", "", signature)
    signature = signature.replace(" = None", "=None").replace("3.141592653589793", "pi")
    return signature, None if returned in ("Any", "~typing.Any") else returned


def _called_by_users(kind: Any) -> bool:
    """Whether users make objects of a class themselves: those that methods return, they only read."""
    made_here = {"Ray", "Projection", "Box", "Domain", "Hits", "Comparison", "Camera", "Row", "Stats", "Quantity"}
    made_here |= {"DepthMap", "CoverageMap", "ShadowMap", "PointShadow", "DirectionalShadow", "DeviceEnvironment"}
    made_here |= {"Explanation", "Step"}
    return getattr(kind, "__name__", "") not in made_here and inspect.isclass(kind)


def resolve(app: Any, environment: Any, node: Any, content: Any) -> Any:
    """A reference to where a class is defined, mpcam.a.b.Name, as one to its public name, mpcam.Name."""
    target = str(node.get("reftarget", ""))
    short = target.rpartition(".")[2]
    if node.get("refdomain") != "py" or short not in mpcam.__all__ or target == f"mpcam.{short}":
        return None
    domain = environment.domains["py"]
    kind = node.get("reftype", "class")
    return domain.resolve_xref(environment, node["refdoc"], app.builder, kind, f"mpcam.{short}", node, content)


def setup(app: Any) -> dict[str, bool]:
    app.connect("autodoc-process-docstring", process_docstring)
    app.connect("autodoc-process-signature", process_signature)
    app.connect("missing-reference", resolve)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
