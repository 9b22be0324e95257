"""How each attribute of MJCF is taken: a table over MuJoCo's grammar, by element, from ``coverage.txt``.

Elements have the keys of ``key_of_path``. An attribute without a status is one of a newer MuJoCo.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from eomgen.products.robots.leftovers import ElementPlace, read_table
from eomgen.products.robots.mjcf.draft import MjcfDraft


def key_of_path(path: str) -> str:
    """Return the row in the table for an element, from the tags joined by ``/``: bodies, frames and replicates within
    one another count once, as ``body/geom``."""
    tags = [tag for tag in path.split("/") if tag not in ("worldbody", "body", "frame", "replicate")]
    last = path.rpartition("/")[2]
    if path.startswith(("worldbody", "body")):
        if not tags:
            return "body" if last == "worldbody" else last
        return "/".join(["body", *tags])
    if tags and tags[0] == "default":
        tags = ["default", *(tag for tag in tags if tag != "default")]
    return "/".join(tags)


#: Status by attribute, of each element.
STATUSES: Mapping[str, Mapping[str, str]] = read_table(Path(__file__).with_name("coverage.txt"))


def note_unknown_attributes(draft: MjcfDraft) -> None:
    """Note attributes that are neither read nor in the table: attributes of a newer MuJoCo than the table's."""
    for path, element, file in draft.elements.every:
        known = STATUSES.get(key_of_path(path), {})
        for name in element.unread_attributes:
            if name not in known:
                note = f"not read: the attribute {name} of <{element.tag}>, which this version does not know [W0153]"
                draft.leave_out(ElementPlace(file, element.line), note)
