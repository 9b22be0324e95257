"""Docstrings as Sphinx takes them: bars of absolute values, ``|x|``, are text and no substitutions; classes that
callers do not construct, whose docstrings have no section Parameters, have no signature."""

from __future__ import annotations

import inspect
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sphinx.application import Sphinx

#: Before and after numpydoc, which reads sections of the docstring.
_EARLY, _LATE = 100, 900


def escaped(line: str) -> str:
    """Return a line with a backslash before each bar outside of code."""
    pieces = re.split(r"(``.*?``|`[^`]*`)", line)
    return "".join(piece if number % 2 else re.sub(r"(?<!\\)\|", r"\\|", piece) for number, piece in enumerate(pieces))


def _escape(app: Sphinx, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    code = False  # examples, and blocks after two colons
    for number, line in enumerate(lines):
        code = line.lstrip().startswith((">>>", "..")) or (code and bool(line.strip()))
        if not code and "|" in line:
            lines[number] = escaped(line)


def _signature(
    app: Sphinx, what: str, name: str, obj: Any, options: Any, signature: str, returned: str
) -> tuple[str, str] | None:
    documented = "Parameters\n---" in (inspect.getdoc(obj) or "")
    return ("", "") if what == "class" and signature and not documented else None


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the functions for docstrings and signatures."""
    app.connect("autodoc-process-signature", _signature, priority=_EARLY)
    app.connect("autodoc-process-docstring", _escape, priority=_LATE)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
