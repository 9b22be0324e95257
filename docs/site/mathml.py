"""Formulas as MathML, which browsers draw themselves: Sphinx's other ways need a script from elsewhere, or LaTeX."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import latex2mathml
from sphinx.application import Sphinx

#: A subscript of a letter with an accent, which the converter sets below the letter in a display.
_BELOW = re.compile(
    r'<munderover>\s*(<m\w+>[^<]*</m\w+>)\s*(<mrow>.*?</mrow>|<m\w+>[^<]*</m\w+>)\s*(<mo stretchy="false">[^<]*</mo>)'
    r"\s*</munderover>",
    re.DOTALL,
)


def beside(tree: str) -> str:
    """Return MathML with subscripts of letters with accents beside the letters, as in a line."""
    return _BELOW.sub(r'<msub><mover accent="true">\1\3</mover>\2</msub>', tree)


def _visit(translator: Any, node: nodes.math | nodes.math_block) -> None:
    block = isinstance(node, nodes.math_block)
    tree = beside(latex2mathml.tex2mathml(node.astext(), as_block=block))
    translator.body.append(f'<div class="math">{tree}</div>\n' if block else tree)
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the writer of formulas."""
    app.add_html_math_renderer("mathml", (_visit, None), (_visit, None))
    app.config.html_math_renderer = "mathml"
    return {"parallel_read_safe": True, "parallel_write_safe": True}
