"""Equations as MathML, which browsers show by themselves: no script and no font has to be fetched."""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

_NAMED = r"\\(?:(?:arc)?(?:sin|cos|tan)|cot|operatorname\{\w+\})(?![a-zA-Z])"


def spaced(tex: str) -> str:
    """TeX with the thin spaces around named functions that TeX would set by itself."""
    tex = re.sub(rf"(?<=[\w}}])\s*(?={_NAMED})", r"\\,", tex)
    return re.sub(rf"({_NAMED}(?:\^\w)?)\s*(?=[a-zA-Z]|\\(?!left|,))", r"\1\\,", tex)


def visit_inline(translator: Any, node: Any) -> None:
    """`$...$` in a line of text."""
    translator.body.append(tex2mathml(spaced(node.astext())))
    raise nodes.SkipNode


def visit_block(translator: Any, node: Any) -> None:
    """`$$...$$` on lines of its own, with a number where it has a label."""
    number = node.get("number")
    attributes = {"CLASS": "math-block"} | ({"ids": [f"equation-{node['label']}"]} if node.get("label") else {})
    translator.body.append(translator.starttag(node, "div", **attributes))
    translator.body.append(tex2mathml(spaced(node.astext()), as_block=True))
    translator.body.append(f'<span class="eqno">({number})</span></div>\n' if number else "</div>\n")
    raise nodes.SkipNode


def setup(app: Any) -> dict[str, bool]:
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
