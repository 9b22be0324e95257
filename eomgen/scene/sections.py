"""The register of sections of a scene file, one row for each in the order of the reference page; other distributions
add rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache

from eomgen.base.extensions import broken, extensions, loaded
from eomgen.base.products import placed, rows_of
from eomgen.scene.bodies.shapes import SHAPES
from eomgen.scene.control.sections import CONTROLLERS, REFERENCES
from eomgen.scene.events.sections import EVENTS, MODES
from eomgen.scene.forces.register import ELEMENTS
from eomgen.scene.reading.requirements import BOUNDS, Row, bounds
from eomgen.scene.section import Section
from eomgen.scene.signals.sections import CURVES, DEFINITIONS, INPUTS, OUTPUTS, PARAMETERS, STATES
from eomgen.scene.tree.sections import BASE, BEAMS, BODIES, CONSTRAINTS, FRAMES, JOINTS, POINTS, REACTIONS

#: The group of entry points for sections of other distributions: objects of the class ``Section``, each under the key
#: of the section.
GROUP = "eomgen.sections"
_CORE: tuple[Section, ...] = (
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
    SHAPES,
)
#: Sections of the core and of the installed products.
OWN = placed(_CORE, rows_of(GROUP, Section), lambda row: row.key, lambda row: row.behind)


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
        row = loaded(entry, Section)
        if row.key != entry.name or row.single:
            raise broken(entry, f"is the section [{row.key}]")
        if row.key in rows or any(row.key == own.key for own in OWN):
            raise broken(entry, "is a section that there is already")
        rows[row.key] = row
    return rows


def sections_for(keys: Iterable[str]) -> tuple[Section, ...]:
    """Return eomgen's own sections, and the sections of other distributions whose keys are among ``keys``.

    Entry points are looked for only if a key is none of eomgen's own sections.
    """
    own = {row.key for row in OWN}
    wanted = [key for key in keys if key not in own]
    return (*OWN, *(row for key, row in others().items() if key in wanted)) if wanted else OWN


@cache
def bounds_of(rows: Sequence[Section]) -> dict[str, Row]:
    """Return the requirement of each single value of the sections, by key."""
    given = {f"{row.key}.{key}": bound for row in rows for key, bound in row.bounds.items() if bound is not None}
    return dict(BOUNDS) | bounds(given)
