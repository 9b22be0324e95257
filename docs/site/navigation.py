"""The list of pages at the side: all parts, and of the present page's part all pages.

The theme asks for a tree of all pages on every page, which takes most of the time of a build with hundreds of pages.
"""

from __future__ import annotations

from functools import partial
from html import escape
from typing import Any

from sphinx.application import Sphinx

#: Before the theme's own function, which reads ``toctree`` of the context.
_BEFORE = 100


def _branch(page: str, above: dict[str, list[str]]) -> list[str]:
    """Return a page and the pages above it."""
    found = [page]
    while found[-1] in above and above[found[-1]][0] not in found:
        found.append(above[found[-1]][0])
    return found


def _list(app: Sphinx, page: str, branch: list[str], here: str, level: int) -> str:
    env, items = app.env, []
    for below in dict.fromkeys(env.toctree_includes.get(page, ())):
        opened = below in branch
        marks = f"toctree-l{level}{' current' if opened else ''}"
        title = escape(env.titles[below].astext())
        link = "#" if below == here else app.builder.get_relative_uri(here, below)
        inner = _list(app, below, branch, here, level + 1) if opened else ""
        shown = f'<a class="{"current " if opened else ""}reference internal" href="{link}">{title}</a>'
        items.append(f'<li class="{marks}">{shown}{inner}</li>')
    return f"<ul>{''.join(items)}</ul>" if items else ""


def _put(app: Sphinx, pagename: str, templatename: str, context: dict[str, Any], doctree: Any) -> None:
    if "toctree" not in context:
        return
    above: dict[str, list[str]] = {}
    for page, listed in app.env.toctree_includes.items():
        for below in listed:
            above.setdefault(below, []).append(page)
    tree = partial(_list, app, app.config.root_doc, _branch(pagename, above), pagename, 1)
    context["toctree"] = lambda **options: tree()


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the function that makes the list."""
    app.connect("html-page-context", _put, priority=_BEFORE)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
