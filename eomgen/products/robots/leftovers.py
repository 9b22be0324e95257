"""Parts of files that are not read."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from configparser import ConfigParser
from pathlib import Path

from eomgen.base.data import dataclass
from eomgen.base.messages import first_of, listed, nearest, shown
from eomgen.scene.reading.xml import Element
from eomgen.scene.rotations import SNAP

#: How elements and attributes of a format are taken, in its table ``coverage.txt``.
READ, IDLE, NOTED, REFUSED = "read", "without effect", "noted", "refused"
Table = Mapping[str, Mapping[str, str]]
#: Numbers that were written with three digits: by how much the length of a quaternion may differ from 1, and an angle,
#: in rad, from a right angle that is meant.
FEW_DIGITS = 1e-3
#: Most pairs of names in a note.
NAMED = 8


def read_table(file: Path) -> dict[str, dict[str, str]]:
    """Return the status of each child and attribute, by element and by name, from a table of a format
    (``coverage.txt``).

    A section ``[names of elements]`` has ``status: names`` for all of them.
    """
    parser = ConfigParser(interpolation=None)
    parser.read_string(file.read_text(encoding="utf-8"))
    table: dict[str, dict[str, str]] = {}
    for elements in parser.sections():
        for key in elements.split():
            row = table.setdefault(key, {})
            for status, names in parser.items(elements):
                row |= dict.fromkeys(names.split(), status)
    return table


@dataclass(frozen=True)
class ElementPlace:
    """Name of the file for messages, and line of an element."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}"


class Leftovers:
    """Elements and attributes of files that are not read, by kind: ``unread`` without a known status, ``noted`` with a
    note, with places and owners; ``idle`` without effect, counted. ``nearly_right`` has angles by the name of their
    element.

    Parameters
    ----------
    table : mapping
        Status by child or attribute (with an ``@`` before the name), of each element.
    """

    def __init__(self, table: Table) -> None:
        self.table = table
        self.unread: dict[str, list[tuple[ElementPlace, str]]] = {}
        self.noted: dict[str, list[tuple[ElementPlace, str]]] = {}
        self.idle: dict[str, int] = {}
        self.nearly_right: dict[str, str] = {}

    def count(self, part: str) -> None:
        """Count a part without effect."""
        self.idle[part] = self.idle.get(part, 0) + 1

    def keep_angles(self, owner: str, angles: Sequence[float]) -> None:
        """Record the first of an owner's angles that is nearly a right angle, but not exact."""
        for angle in angles:
            if SNAP < off_right(angle) <= FEW_DIGITS:
                self.nearly_right.setdefault(owner, f"{angle:.9g}")

    def keep(self, element: Element, key: str, file: str, owner: str) -> None:
        """Record the attributes, texts and children of an element that no reader has requested. `key` is the row of the
        element in the table, `file` the name of the file, `owner` the name in notes."""
        known = self.table.get(key, {})
        attributes = {name[1:]: status for name, status in known.items() if name.startswith("@")}
        children = {name: status for name, status in known.items() if not name.startswith("@")}
        here = ElementPlace(file, element.line), owner
        for name in element.unread_attributes:
            self._keep_part(name, attributes, f"the attribute {shown(name)} of <{element.tag}>", here)
        if element.has_text:
            self.unread.setdefault(f"the text in <{element.tag}>", []).append(here)
        read = {child.tag for child in element.read_children}
        for child in element.unread_children:
            at = ElementPlace(file, child.line), owner or child.get("name")
            if child.tag in read:
                self.unread.setdefault(f"a second <{child.tag}>", []).append(at)
            else:
                self._keep_part(child.tag, children, f"elements <{child.tag[:64]}> of <{element.tag}>", at)

    def _keep_part(self, name: str, known: Mapping[str, str], kind: str, at: tuple[ElementPlace, str]) -> None:
        """Record an unread child or attribute ``name`` by the status in ``known``: counted, noted, or else unread under
        ``kind``. `at` is the place and the owner."""
        status = known.get(name)
        if status == IDLE:
            self.count(name)
        elif status == NOTED:
            self.noted.setdefault(name, []).append(at)
        else:
            self.unread.setdefault(f"{kind}{_suggestion(name, [*known])}", []).append(at)

    def warnings(self) -> list[tuple[ElementPlace, str]]:
        """Return the first place and a note for each kind of part that is not read or not modelled, with number and
        owners."""
        result = []
        for kinds, words in ((self.unread, "not read: {} {} [W0193]"), (self.noted, "not modelled: <{}> {} [W0197]")):
            for kind, places in kinds.items():
                owners = [name for name in dict.fromkeys(name for _, name in places) if name]
                count = f"({len(places)}{': ' if owners else ''}{listed(owners)})"
                result.append((places[0][0], words.format(kind, count)))
        return result

    def notes(self) -> list[str]:
        """Return notes on parts without effect, and on angles that are nearly right angles."""
        result = []
        if self.idle:
            counts = [f"{count} {tag}" for tag, count in self.idle.items()]
            result.append(f"without a part in the equations of motion: {', '.join(counts)} [W0173]")
        if self.nearly_right:
            angles = first_of([f"{name} ({angle})" for name, angle in self.nearly_right.items()], NAMED)
            result.append(
                f"angles near a right angle, but not exact, are kept in the poses of {angles}: pi/2"
                f" written in full, {math.pi / 2!r}, would be made exact and save operations [W0174]"
            )
        return result


def off_right(angle: float) -> float:
    """Return the distance of an angle from the nearest right or straight one; 0 for angles nearest to zero, which
    may be small on purpose."""
    quarters = round(angle / (0.5 * math.pi))
    return abs(angle - quarters * 0.5 * math.pi) if quarters else 0.0


def _suggestion(name: str, known: Sequence[str]) -> str:
    hint = nearest(name, [candidate for candidate in known if candidate != name])
    return "" if hint.startswith("one of ") or not hint else f" (is {hint} meant?)"
