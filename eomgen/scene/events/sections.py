"""Sections of events and of the modes that they change, and their reading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from eomgen.base.messages import key_of, shown
from eomgen.formula.discontinuities import is_condition
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula, Number, Operation, Symbol
from eomgen.scene.events.model import Event
from eomgen.scene.formula.scope import EVERYTHING, Scope
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading import report
from eomgen.scene.reading.requirements import Outside, Row
from eomgen.scene.reading.values import UNKNOWN
from eomgen.scene.section import Entries, Reading, Section
from eomgen.system.events import mode_parameter
from eomgen.system.signals import Parameter

if TYPE_CHECKING:
    from eomgen.scene.events.schema import EventEntry as WrittenEvent

#: Quantities that a reset may set.
_TARGETS = Scope('coordinates, velocities and internal states: "q.joint", "v.joint"', frozenset({"q", "v", "state"}))
#: Keys that the actions need, each with an example.
_KEYS = {"reset": 'reset={"v.joint"=0}', "impact": "restitution=0.8", "switch": 'mode="gear" to=1'}


def _restitution_fault(number: float) -> str:
    if number > 1.0:
        return f"the restitution is {number:.6g}, and every impact would add energy [E1770]"
    return f"the restitution is {number:.6g} [E1770]"


#: Of a restitution that parameters decide.
_RESTITUTION = Row(
    ("events.restitution",),
    Outside(0.0, 1.0),
    _restitution_fault,
    "a number from 0 to 1",
    stage=0,
)


def read_event(name: str, entry: WrittenEvent, reading: Reading) -> Event:
    """Return the event of an entry of [events]; faults are reported: a formula without roots in time, targets that
    cannot be set, and keys that do not fit the action."""
    key, values = key_of("events", name), reading.values
    when = values.formula(f"{key}.when", entry.when, EVERYTHING)
    if isinstance(when, Number) and when is not UNKNOWN:
        message = "a number has no roots in time [E1481]"
        values.report.add(f"{key}.when", message, 'a formula such as "q.ball" or "t - 2"')
    if isinstance(when, Operation) and is_condition(when):
        message = "a comparison is 1 or 0 and does not pass zero [E1482]"
        values.report.add(f"{key}.when", message, 'the difference of its sides, "q.ball - 0.5", and a direction')
    values.check_kind(key, entry, "action", _KEYS)
    if entry.mode is not None:
        report.check_reference(f"{key}.mode", entry.mode, reading.names.modes, "mode", values.report)
    resets = []
    if entry.action == "reset" and entry.reset is not None:
        if not entry.reset:
            values.report.add(f"{key}.reset", "the reset is empty [E1485]", 'reset = { "v.joint" = 0 }')
        for target, value in entry.reset.items():
            target_key = f"{key}.reset.{key_of(target)}"
            symbol = values.formula(target_key, target, _TARGETS)
            formula = values.formula(target_key, value, EVERYTHING)
            if fault := _fault(symbol, target, reading):
                values.report.add(target_key, *fault)
            elif isinstance(symbol, Symbol):
                resets.append((symbol, formula))
    parts = values.keys(key, entry, "direction", "action", "least_interval", "restitution", "mode", "to", "description")
    least, restitution = parts.get("least_interval", 0.0), parts.get("restitution", UNKNOWN)
    if least < 0.0:
        values.report.add(f"{key}.least_interval", f"{least:.6g} s is negative [E1490]", "a small positive time")
    if restitution is not UNKNOWN and all(symbol.kind == "parameter" for symbol in symbols(restitution)):
        values.require(f"{key}.restitution", _RESTITUTION, [restitution])  # else a run refuses negative values
    return Event(name, when, resets=tuple(resets), place=values.report.where(f"{key}.when"), **parts)


def _fault(symbol: Formula, target: str, reading: Reading) -> tuple[str, str] | None:
    """Return the reason why a reset cannot set a quantity, ``target`` as text and ``symbol`` as read, and a hint; None
    if the quantity can be set, or was refused before."""
    if symbol is UNKNOWN:
        return None
    if not isinstance(symbol, Symbol) or symbol.kind not in ("q", "v", "state"):
        fault = f"{shown(target)} is not a number of the state [E1486]"
        return fault, 'one of "q.joint", "v.joint" or the name of a state'
    if symbol.kind == "state":
        return None
    if reading.document.coordinates == "absolute":  # joints have no coordinates
        fault = f"{shown(target)} cannot be set: joints have none in absolute coordinates [E1487]"
        return fault, 'action = "impact", or coordinates = "joint"'
    joint: Joint | None = reading.items["joints"].get(symbol.name)
    if joint is None:
        return None
    if joint.mimic is not None:
        fault = f"{shown(target)} cannot be set: the joint follows {joint.mimic.joint} [E1489]"
        return fault, f'"{symbol.kind}.{joint.mimic.joint}"'
    if symbol.kind == "q" and JOINTS[joint.type].group != "R":
        fault = f"{shown(target)} cannot be set: an orientation has no components that are free of each other [E1488]"
        return fault, f'"v.{symbol.name}[0]", or joints that turn about one axis each'
    return None


class _Modes(Section):
    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        parameter = mode_parameter(name)
        if parameter in document.section("parameters"):
            fault = f"the mode {name} is the parameter {parameter}, and there is one of that name [E1457]"
            return fault, "another name"
        return "", ""

    def made_names(self, entries: Mapping[str, Any]) -> Mapping[str, str]:
        return {mode_parameter(name): f"that of the mode {name}" for name in entries}

    def parameters(self, entries: Mapping[str, Any]) -> Sequence[Parameter]:
        return [
            Parameter(mode_parameter(name), mode.value, True, "", mode.description) for name, mode in entries.items()
        ]

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"modes": tuple(reading.document.section("modes"))}


MODES = _Modes(
    key="modes",
    entry="eomgen.scene.events.schema:ModeEntry",
    positional=("value",),
    documentation="Add a number that only events change, ``mode.name`` in formulas.",
)
EVENTS = Section(
    key="events",
    entry="eomgen.scene.events.schema:EventEntry",
    scene_field="events",
    last=True,
    item=read_event,
    positional=("when",),
    documentation="Add an event at the roots of a formula.",
)
