"""Sections of events and of the modes that they change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.scene.events.model import Event
from eomgen.scene.events.reading import read_event
from eomgen.scene.events.schema import Event as WrittenEvent
from eomgen.scene.events.schema import Mode
from eomgen.scene.section import Entries, Reading, Section
from eomgen.system.events import mode_parameter
from eomgen.system.signals import Parameter


class _Modes(Section):
    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        parameter = mode_parameter(name)
        if parameter in document.section("parameters"):
            return f"the mode {name} is the parameter {parameter}, and there is one of that name", "another name"
        return "", ""

    def made_names(self, entries: Mapping[str, Any]) -> Mapping[str, str]:
        return {mode_parameter(name): f"that of the mode {name}" for name in entries}

    def parameters(self, entries: Mapping[str, Any]) -> Sequence[Parameter]:
        return [
            Parameter(mode_parameter(name), mode.value, True, "", mode.description) for name, mode in entries.items()
        ]

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"modes": tuple(reading.document.section("modes"))}


class _Events(Section):
    def read_entry(self, name: str, entry: WrittenEvent, reading: Reading) -> Event:
        joints, modes = reading.items["joints"], reading.names.modes
        return read_event(name, entry, joints, modes, reading.document.coordinates == "absolute", reading.values)


MODES = _Modes(
    key="modes",
    entry=Mode,
    positional=("value",),
    documentation="Add a number that only events change, ``mode.name`` in formulas.",
)
EVENTS = _Events(
    key="events",
    entry=WrittenEvent,
    scene_field="events",
    last=True,
    positional=("when",),
    documentation="Add an event at the roots of a formula.",
)
