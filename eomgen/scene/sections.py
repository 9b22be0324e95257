"""The register of sections of a scene file, one row for each in the order of the reference page; other distributions
add rows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import cast

from eomgen.base.extensions import broken, extensions, load_row
from eomgen.base.products import LateRow, import_target, insert, rows_of
from eomgen.scene.control.sections import CONTROLLERS, REFERENCES
from eomgen.scene.events.sections import EVENTS, MODES
from eomgen.scene.forces.register import ELEMENTS, LateElement
from eomgen.scene.reading.requirements import BOUNDS, Row, bounds
from eomgen.scene.section import Section
from eomgen.scene.signals.sections import CURVES, DEFINITIONS, INPUTS, OUTPUTS, PARAMETERS, STATES
from eomgen.scene.tree.sections import BASE, BEAMS, BODIES, CONSTRAINTS, FRAMES, JOINTS, POINTS, REACTIONS

#: The group of entry points for sections of other distributions: objects of the class ``Section``, each under the key
#: of the section.
GROUP = "eomgen.sections"
_CORE: tuple[Section | LateRow, ...] = (
    PARAMETERS,
    CURVES,
    DEFINITIONS,
    INPUTS,
    STATES,
    CONTROLLERS,
    BASE,
    BODIES,
    BEAMS,
    JOINTS,
    CONSTRAINTS,
    REACTIONS,
    POINTS,
    FRAMES,
    *ELEMENTS,
    REFERENCES,
    OUTPUTS,
    MODES,
    EVENTS,
    LateRow("shapes", "eomgen.scene.bodies.shapes:SHAPES"),
)
#: Sections of the core and of the installed products; rows of some are imported for scenes that have the section.
_ROWS = insert(_CORE, rows_of(GROUP, LateRow), lambda row: row.key, lambda row: getattr(row, "behind", ""))
#: Keys of these sections, in order.
KEYS = tuple(row.key for row in _ROWS)
#: Quantities of force elements for formulas, by section.
OFFERED: Mapping[str, Mapping[str, str]] = {row.key: row.offers for row in _ROWS if isinstance(row, LateElement)}


@cache
def others() -> dict[str, Section]:
    """Return the sections of other distributions by key.

    Raises
    ------
    UsageError
        Naming the distribution of a section that cannot be taken.
    """
    rows: dict[str, Section] = {}
    for entry in extensions(GROUP):
        row = load_row(entry, Section)
        if row.key != entry.name or row.single:
            raise broken(entry, f"is the section [{row.key}]")
        if row.key in rows or row.key in KEYS:
            raise broken(entry, "is a section that there is already")
        rows[row.key] = row
    return rows


def sections_for(keys: Iterable[str]) -> tuple[Section, ...]:
    """Return the sections that files with some keys need: of late rows, and of sections of other distributions, only
    rows with these keys.

    Entry points are looked for only if a key is none of eomgen's own sections.
    """
    wanted = frozenset(keys)
    core, further = _own(wanted.intersection(KEYS)), wanted.difference(KEYS)
    return (*core, *(row for key, row in others().items() if key in further)) if further else core


def own_sections() -> tuple[Section, ...]:
    """Return all sections of the core and of the installed products."""
    return _own(frozenset(KEYS))


@cache
def _own(wanted: frozenset[str]) -> tuple[Section, ...]:
    rows = (row for row in _ROWS if not isinstance(row, LateRow) or row.key in wanted)
    return tuple(cast("Section", import_target(row.target)) if isinstance(row, LateRow) else row for row in rows)


@cache
def bounds_of(rows: Sequence[Section]) -> dict[str, Row]:
    """Return the requirement of each single value of the sections, by key."""
    limits = {f"{row.key}.{key}": bound for row in rows for key, bound in row.bounds.items() if bound is not None}
    return dict(BOUNDS) | bounds(limits)
