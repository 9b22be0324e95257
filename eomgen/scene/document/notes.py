"""The register of notes of a scene, one row for each kind of doubtful value, and the facts from which notes follow."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import EvaluatesOnce, dataclass
from eomgen.base.limits import doubt_settings
from eomgen.base.products import insert, rows_of
from eomgen.errors import DescriptionError, Message
from eomgen.scene.joints.model import Joint
from eomgen.scene.joints.tree import joint_displacement
from eomgen.scene.reading.values import Values
from eomgen.scene.section import Reading
from eomgen.system.description import BASE

if TYPE_CHECKING:
    from eomgen.base.limits import Limit
    from eomgen.scene.document.schema import SceneDocument


@dataclass(frozen=True)
class SceneFacts(EvaluatesOnce):
    """Data of a scene without problems, from which notes follow.

    Attributes
    ----------
    data : nested data as in a file, with included files
    document : the same, checked
    scene : fields of the Scene
    reading : the state of reading at the end
    """

    data: Mapping[str, Any]
    document: SceneDocument
    scene: Mapping[str, Any]
    reading: Reading

    @property
    def values(self) -> Values:
        return self.reading.values

    @property
    def starts_in_equilibrium(self) -> bool:
        return self.document.simulation.start == "equilibrium"

    def elements(self, section: str) -> list[Any]:
        """Return the force elements of one section."""
        return [element for element in self.scene["elements"] if element.section == section]

    @cached_property
    def places(self) -> Mapping[str, tuple[Array, Array]]:
        """Poses of the bodies at the start, in the world; empty if the joints do not determine the poses."""
        if self.scene["base"] is not None or self.starts_in_equilibrium:
            return {}
        return initial_places(self.scene["joints"], self.values)


@dataclass(frozen=True)
class Note:
    """A kind of note: a row of the register.

    Attributes
    ----------
    name : of the row
    evaluate : from the facts to the texts of the notes, none if there is no doubt
    behind : name of the preceding row, for a row of a product
    limits : thresholds that ``evaluate`` compares with, for the documentation
    """

    name: str
    evaluate: Callable[[SceneFacts], Iterable[str]]
    behind: str = ""
    limits: tuple[Limit, ...] = ()


def initial_places(joints: Sequence[Joint], values: Values) -> dict[str, tuple[Array, Array]]:
    """Return the pose of bodies at the initial state in the frame of the base, by body: orientation (3, 3), body axes
    to base axes, and position (3,), m. Bodies without a pose from joints alone are left out: driven and mimic joints,
    unknown values, and all bodies further out."""
    result: dict[str, tuple[Array, Array]] = {BASE: (np.eye(3), np.zeros(3))}
    for joint in joints:
        if joint.parent not in result or joint.mimic is not None or joint.drive:
            continue
        turned, origin = result[joint.parent]
        axes = turned @ np.array(joint.orientation)
        position = origin + turned @ np.array([values.value(part) for part in joint.position])
        q, kind = joint.initial_position, joint.kind
        if any(q[kind.q_size - kind.v_size :]):  # most nodes of beams are not turned
            turn, shift, _ = joint_displacement(kind, joint.axis, joint.second_axis, q, values.value(joint.pitch))
            axes, position = axes @ turn, position + axes @ shift
        if np.all(np.isfinite(position)):
            result[joint.child] = axes, position
    return {name: position for name, position in result.items() if name != BASE}


def _beyond_stops(facts: SceneFacts) -> Iterator[str]:
    """Yield a note for each initial coordinate beyond a stop; an equilibrium is looked for elsewhere."""
    for joint in facts.scene["joints"]:
        if joint.initial_position and not facts.starts_in_equilibrium:
            for stop, limit in zip(joint.stops, joint.limits, strict=True):
                if note := limit.passed(joint.initial_position[stop.index], facts.values.value):
                    yield note


def _section_notes(facts: SceneFacts) -> Iterator[str]:
    for row in facts.reading.rows:
        yield from row.notes(facts.reading)


#: The group of rows that products add.
GROUP = "eomgen.notes"
#: Notes on faults found while the scene is read, in the order of their listing.
NOTES: tuple[Note, ...] = (
    Note("start beyond a stop", _beyond_stops),
    Note("doubts of single sections", _section_notes),
)
#: The last notes.
LAST = Note("doubtful values", lambda facts: facts.values.notes)


@cache
def every_note() -> tuple[Note, ...]:
    """Return the notes of the core and of products, as listed."""
    return *insert(NOTES, rows_of(GROUP, Note), lambda note: note.name, lambda note: note.behind), LAST


def notes_of(facts: SceneFacts) -> tuple[Message, ...]:
    """Return the notes on doubtful values that the scene file does not silence, in the order of the register. Notes
    that the caller's settings silence are among them: compiled models keep these. Raises DescriptionError if the
    settings make notes errors and any note is not silenced."""
    kept, settings = (doubt_settings(facts.scene["parts"], stored=stored) for stored in (True, False))
    reported = [note for note in every_note() if note.name not in kept.quiet]
    notes = tuple(Message(text, note.name) for note in reported for text in note.evaluate(facts))
    if settings.strict and (doubts := [note for note in notes if note.doubt not in settings.quiet]):
        raise DescriptionError(settings.problems(doubts, facts.reading.report))
    return notes
