"""Tables and pictures for narrow windows: cells carry the heads of their columns, which a style sheet shows if rows are
stacked, and wide pictures are marked."""

from __future__ import annotations

import re
import struct
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

#: Characters of a text from which on its column is long; columns from which on rows are stacked without long texts.
_LONG, _MANY = 28, 5
#: Pixels of a picture from which on its letters are small on a telephone, and smaller still.
_WIDE, _WIDER = 800, 1100


def width_of(path: Path) -> float:
    """Return the width of a PNG or SVG file in pixels; 0 for other files."""
    head = path.read_bytes()[:2000] if path.is_file() else b""
    if path.suffix == ".png" and len(head) > 24:
        return float(struct.unpack(">I", head[16:20])[0])
    width = re.search(rb'<svg[^>]*\swidth="([\d.]+)(pt)?', head)
    return float(width[1]) * (4.0 / 3.0 if width[2] else 1.0) if path.suffix == ".svg" and width else 0.0


def mark_table(table: nodes.table) -> None:
    """Mark the long columns of a table, and put heads into the cells of a table of three columns or more."""
    heads = [entry.astext() for part in table.findall(nodes.thead) for entry in part.findall(nodes.entry)]
    rows = [list(row.findall(nodes.entry)) for part in table.findall(nodes.tbody) for row in part.findall(nodes.row)]
    if not heads or any(len(row) != len(heads) for row in rows):
        return
    long = [max((len(row[place].astext()) for row in rows), default=0) > _LONG for place in range(len(heads))]
    stacked = len(heads) > 2 and (any(long) or len(heads) >= _MANY)
    if stacked:
        table["classes"] += ["stacked", *["many"] * (len(heads) > _MANY)]
    for row in rows:
        for place, entry in enumerate(row):
            if long[place]:
                entry["classes"].append("long")
            if not stacked or place == 0:
                continue
            if not entry.astext().strip():
                entry["classes"].append("empty")
                continue
            target = entry[0] if isinstance(entry[0], nodes.paragraph) else entry
            if heads[place]:
                target.insert(0, nodes.inline("", f"{heads[place]}: ", classes=["cell-head"]))


def _mark(app: Sphinx, doctree: nodes.document, docname: str) -> None:
    for table in doctree.findall(nodes.table):
        mark_table(table)
    for image in doctree.findall(nodes.image):
        width = width_of(Path(app.srcdir) / image["uri"])
        if width >= _WIDE:
            image["classes"].append("wide" if width < _WIDER else "wider")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the function that marks tables and pictures."""
    app.connect("doctree-resolved", _mark)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
