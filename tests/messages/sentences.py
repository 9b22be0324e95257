"""Texts of messages without a code."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator

from eomgen.base.message_codes import CODE, written_text

_ERRORS = ("Usage", "Description", "Model", "Toolchain", "Numerical", "File")
#: A call whose text needs a code; a file without one has no such text.
_MESSAGE = re.compile(rf"\b(?:Problem|warn|(?:{'|'.join(_ERRORS)})\w{{5}})\s*\(")
#: Letters of a text at least; one with fewer is part of another.
_FEWEST = 6


def unmarked(source: str, nodes: Iterable[ast.AST]) -> Iterator[str]:
    """Yield line and text of each error, problem or warning that has a literal without a code, in the nodes of a
    source."""
    for node in nodes if _MESSAGE.search(source) else ():
        name = getattr(node.func, "id", getattr(node.func, "attr", "")) if isinstance(node, ast.Call) else ""
        if not isinstance(node, ast.Call) or not (name in {"Problem", "warn"} or name[:-5] in _ERRORS):
            continue
        for given in node.args[int(name == "Problem") :][:1]:
            parts = [given.body, given.orelse] if isinstance(given, ast.IfExp) else [given]
            for written in map(written_text, parts):
                if letters(written) >= _FEWEST and not CODE.search(written):
                    yield f"{node.lineno}: {written}"


def letters(text: str) -> int:
    """Return the number of letters of a text."""
    return sum(map(str.isalpha, text))
