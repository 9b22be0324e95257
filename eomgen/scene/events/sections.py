"""Sections of events and of the modes that they change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.scene.events.reading import read_event
from eomgen.scene.events.schema import Event, Mode
from eomgen.scene.section import Reading, Section
from eomgen.system.events import mode_parameter
from eomgen.system.signals import Parameter


class _Modes(Section):
    def parameters(self, entries: Mapping[str, Any]) -> Sequence[Parameter]:
        return [
            Parameter(mode_parameter(name), mode.value, True, "", mode.description) for name, mode in entries.items()
        ]

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"modes": tuple(reading.document.section("modes"))}


class _Events(Section):
    def read(self, reading: Reading) -> Mapping[str, Any]:
        joints, modes = reading.items["joints"], reading.names.modes
        absolute = reading.document.coordinates == "absolute"
        return {
            name: read_event(name, entry, joints, modes, absolute, reading.values)
            for name, entry in reading.document.section("events").items()
        }

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"events": tuple(reading.items["events"].values())}


MODES = _Modes(
    key="modes",
    entry=Mode,
    positional=("value",),
    documentation="Add a number that only events change, ``mode.name`` in formulas.",
)
EVENTS = _Events(
    key="events",
    entry=Event,
    last=True,
    positional=("when",),
    documentation="Add an event at the roots of a formula.",
)
