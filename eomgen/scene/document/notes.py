"""The register of notes of a scene, one row for each kind of doubtful value, and the facts from which notes follow."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.messages import key_of
from eomgen.base.products import placed, rows_of
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.recording import law_and_rate
from eomgen.scene.document.checks import efforts_on_drives, loads_without_size, unused_names
from eomgen.scene.document.doubtful_elements import (
    doubtful_beams,
    initial_places,
    negative_laws,
    shapes_that_leave_points,
    springs_within_bodies,
    springs_without_laws,
    tyres_in_the_road,
)
from eomgen.scene.document.out_of_scale import (
    angles_against_numbers,
    angles_of_several_turns,
    doubtful_times,
    lengths_against_numbers,
    out_of_scale,
    size_of_scene,
)
from eomgen.scene.formula.namespaces import read_as_written
from eomgen.scene.formula.scope import ANYWHERE
from eomgen.scene.reading.values import Values
from eomgen.scene.section import Reading
from eomgen.system.description import BASE

if TYPE_CHECKING:
    from eomgen.base.limits import Limit
    from eomgen.scene.document.schema import Document


@dataclass(frozen=True)
class SceneFacts:
    """Data of a scene without problems, from which notes follow.

    Attributes
    ----------
    data : nested data as in a file, with included files
    document : the same, checked
    scene : fields of the Scene
    reading : the state of reading at the end
    """

    data: Mapping[str, Any]
    document: Document
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
    def size(self) -> float:
        """Largest length of the scene, m; 0 if the scene gives none."""
        scene = self.scene
        frames = [frame.name for frame in scene["frames"]]
        return size_of_scene(scene["bodies"], scene["joints"], scene["points"], frames, scene["elements"], self.values)

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


def _beyond_stops(facts: SceneFacts) -> Iterator[str]:
    """Yield a note for each initial coordinate beyond a stop; an equilibrium is looked for elsewhere."""
    for joint in facts.scene["joints"]:
        if joint.initial_position and not facts.starts_in_equilibrium:
            for stop, limit in zip(joint.stops, joint.limits, strict=True):
                if note := limit.passed(joint.initial_position[stop.index], facts.values.value):
                    yield note


def _of_sections(facts: SceneFacts) -> Iterator[str]:
    for row in facts.reading.rows:
        yield from row.notes(facts.reading)


def _out_of_scale(facts: SceneFacts) -> Iterable[str]:
    scene, beams = facts.scene, facts.document.section("beams")
    return out_of_scale(
        scene["bodies"],
        scene["joints"],
        scene["points"],
        [frame.name for frame in scene["frames"]],
        scene["elements"],
        [name for name, beam in beams.items() if beam.section is not None and beam.section.shape],
        scene.get("shapes", ()),
        facts.values,
        facts.reading.parameters,
        scene["constraints"],
    )


def _doubtful_beams(facts: SceneFacts) -> Iterable[str]:
    scene = facts.scene
    return doubtful_beams(facts.document, scene["bodies"], scene["points"], scene["elements"], facts.values)


def _tyres_in_the_road(facts: SceneFacts) -> Iterable[str]:
    tyres = facts.elements("tyres")
    return tyres_in_the_road(tyres, facts.scene["points"], facts.places, facts.values) if tyres else ()


def _below_planes(facts: SceneFacts) -> Iterator[str]:
    """Yield a note on each body that starts below the plane on which a constraint lets it roll or slide."""
    places, value = {BASE: (np.eye(3), np.zeros(3)), **facts.places}, facts.values.value
    for item in facts.scene["constraints"] if facts.places else ():
        if item.type not in ("rolling", "sliding") or item.surface is not None:
            continue
        if not {item.first.body, item.second.body} <= places.keys():
            continue
        (turned, origin), (of_second, second) = places[item.first.body], places[item.second.body]
        origin = origin + turned @ [value(part) for part in item.first.position]
        second = second + of_second @ [value(part) for part in item.second.position]
        normal = turned @ np.array(item.first.orientation)[:, 2]
        if (height := float(normal @ (second - origin))) < 0.0:
            fault = f"{item.second.body} starts {-height:.3g} m below the plane, and is moved to the side of its z axis"
            remedy = "first.axis in the opposite direction, or a start on this side"
            yield f"{key_of('constraints', item.name)}: {fault}; try: {remedy}"


def _base_with_gravity(facts: SceneFacts) -> Iterator[str]:
    """Note an acceleration of the base that equals the gravity of the scene."""
    given, gravity = (facts.data.get("base") or {}).get("acceleration"), facts.document.gravity
    if given is None or tuple(given) != gravity or not any(gravity):
        return
    fault = "base.acceleration is the gravity of the scene: the base falls freely, and bodies in it have no weight"
    yield f"{fault}; try: no acceleration, if gravity alone is meant"


#: Difference between a mean acceleration and gravity, as a part of gravity, up to which they are taken to be equal.
_SAME = 0.02
#: Number of times at which motions of the base are looked at.
_TIMES = 257


def _base_against_gravity(facts: SceneFacts) -> Iterator[str]:
    """Note a mean acceleration of the base that is opposite to gravity, and motions of one axis given twice."""
    written, base = facts.data.get("base", {}), facts.scene["base"]
    if base is None or written.get("acceleration") is None:
        return
    positions = written.get("position", (0.0, 0.0, 0.0))
    duration = facts.document.simulation.duration or 1.0
    times = np.linspace(0.0, duration, _TIMES)
    for axis, gravity in enumerate(facts.document.gravity):
        if written["acceleration"][axis] == 0.0:
            continue
        speeds = law_and_rate(base.position[axis], facts.values.parameters)(times)[1]
        mean = float(speeds[-1] - speeds[0]) / duration
        key = f"base.acceleration[{axis}]"
        if isinstance(gravity, int | float) and gravity and abs(mean + gravity) <= _SAME * abs(gravity):
            fault = f"{key} has a mean of {mean:.4g} m/s^2, opposite to gravity: an accelerometer at rest reads this"
            yield f"{fault}, and the base moves away; try: the readings with {gravity:+.6g} added"
        position = positions[axis]
        names = facts.values.names
        if isinstance(position, str) and Symbol("time") in symbols(read_as_written(position, names, ANYWHERE)):
            fault = f"base.position[{axis}] and {key} both move the base over time, and their motions add"
            yield f"{fault}; try: one of the two, if they describe the same motion"


#: Range of a to and fro motion of the base, in sizes of the scene, and acceleration, m/s^2, that are doubted together.
_RANGE, _SHOCK = 10.0, 100.0
#: Time over which a base without a duration is looked at, s.
_WHILE = 10.0


def _base_out_of_scale(facts: SceneFacts) -> Iterator[str]:
    """Note rotations of the base to and fro over more than a turn, and shaking over many times the scene's size."""
    base = facts.scene["base"]
    if base is None:
        return
    times = np.linspace(0.0, facts.document.simulation.duration or _WHILE, 8 * _TIMES)
    for place, rotation in enumerate(base.rotations[len(base.added_by) :]):
        angle, _ = _to_and_fro(rotation.angle, times, facts)
        if angle > 2.0 * np.pi:
            fault = f"goes to and fro over {angle:.4g} rad, {angle / (2.0 * np.pi):.3g} turns"
            remedy = 'angles in formulas are radians; try: a parameter of "30 deg" as the amplitude'
            yield f"base.rotation[{place}].angle {fault}: {remedy}"
    for axis, law in enumerate(base.position):
        travel, acceleration = _to_and_fro(law, times, facts)
        if facts.size > 0.0 and travel > _RANGE * facts.size and acceleration > _SHOCK:
            fault = f"shakes the base over {travel:.4g} m, and the size of the scene is {facts.size:.3g} m"
            remedy = "numbers without a unit are in m; try: the unit of the curve's values, or a factor of 0.001"
            yield f"base.position[{axis}] {fault}: {remedy}"


def _to_and_fro(law: Formula, times: Array, facts: SceneFacts) -> tuple[float, float]:
    """Return range and largest second derivative of a law of time that turns round; 0 and 0 for any other law."""
    used = symbols(law)
    if not any(symbol.kind == "time" for symbol in used) or any(
        symbol.kind not in ("time", "parameter") for symbol in used
    ):
        return 0.0, 0.0
    values, rates = law_and_rate(law, facts.values.parameters)(times)
    defined = np.isfinite(values) & np.isfinite(rates)
    values, rates, times = values[defined], rates[defined], times[defined]
    if len(times) < 2 or not np.min(rates) < 0.0 < np.max(rates):
        return 0.0, 0.0
    return float(np.ptp(values)), float(np.max(np.abs(np.gradient(rates, times))))


#: The group of rows that products add.
GROUP = "eomgen.notes"
#: Notes of the core, in the order of their listing.
NOTES: tuple[Note, ...] = (
    Note("start beyond a stop", _beyond_stops),
    Note("doubts of single sections", _of_sections),
    Note("unused names", lambda facts: unused_names(facts.document, facts.reading)),
    Note("plain angles", lambda facts: angles_of_several_turns(facts.data, facts.reading.rows)),
    Note("plain angles in formulas", lambda facts: angles_against_numbers(facts.data, facts.values)),
    Note(
        "plain lengths in formulas",
        lambda facts: lengths_against_numbers(facts.data, facts.values, lambda: facts.size),
    ),
    Note("plain times", lambda facts: doubtful_times(facts.data, facts.document)),
    Note(
        "negative stiffness or damping",
        lambda facts: negative_laws(facts.scene["joints"], facts.scene["elements"], facts.values),
    ),
    Note("springs without laws", lambda facts: springs_without_laws(facts.scene["elements"], facts.values.mentioned)),
    Note("springs within a body", lambda facts: springs_within_bodies(facts.document)),
    Note("shapes that leave their points", lambda facts: shapes_that_leave_points(facts.document, facts.reading)),
    Note("values out of scale", _out_of_scale),
    Note("efforts on drives", lambda facts: efforts_on_drives(facts.document)),
    Note("loads without a size or a component", lambda facts: loads_without_size(facts.document)),
    Note("doubtful beams", _doubtful_beams),
    Note("tyres in the road", _tyres_in_the_road),
    Note("bodies below planes of contact", _below_planes),
    Note("base that falls freely", _base_with_gravity),
    Note("base opposite to gravity or moved twice", _base_against_gravity),
    Note("base with motions far beyond the scene", _base_out_of_scale),
    Note("doubtful values", lambda facts: facts.values.notes),
)


@cache
def _every_note() -> tuple[Note, ...]:
    return placed(NOTES, rows_of(GROUP, Note), lambda note: note.name, lambda note: note.behind)


def notes_of(facts: SceneFacts) -> tuple[str, ...]:
    """Return all notes of a scene in the order of the register."""
    return tuple(text for note in _every_note() for text in note.evaluate(facts))
