"""Sections of controllers and of reference motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.scene.control.controllers import (
    Controllers,
    check_loops,
    made_parameters,
    outputs_of_controllers,
    read_controllers,
    states_of_controllers,
)
from eomgen.scene.control.references import ReferenceEntry, read_reference
from eomgen.scene.control.schema import Controller
from eomgen.scene.section import Reading, Section
from eomgen.system.signals import Parameter


class _Controllers(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        entries, refused = reading.document.section("controllers"), sorted(reading.refused["controllers"])
        return {
            "controllers": (*outputs_of_controllers(entries), *refused),
            "states": tuple(states_of_controllers(entries)),
        }

    def parameters(self, entries: Mapping[str, Any]) -> Sequence[Parameter]:
        return made_parameters(entries)

    def read(self, reading: Reading) -> Mapping[str, Any]:
        section = reading.document.section
        read = read_controllers(
            section("controllers"), section("springs"), section("outputs"), reading.values, reading.folder
        )
        reading.keep(read)
        return {}

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        read = reading.kept(Controllers)
        return {
            "states": tuple(read.states),
            "controllers": tuple(read.outputs),
            "feedback": tuple(read.feedback),
            "sampled": tuple(read.sampled),
        }


def check_controllers(reading: Reading) -> None:
    """Report algebraic loops among controllers and tensions of springs."""
    check_loops(reading.kept(Controllers).outputs, tuple(reading.items["springs"].values()), reading.values)


class _References(Section):
    def read(self, reading: Reading) -> Mapping[str, Any]:
        followers = frozenset(joint.name for joint in reading.items["joints"].values() if joint.mimic is not None)
        return {
            name: read_reference(name, entry, followers, reading.values)
            for name, entry in reading.document.section("references").items()
        }

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"references": tuple(reading.items["references"].values())}


CONTROLLERS = _Controllers(
    key="controllers",
    entry=Controller,
    bare="a controller",
    after=("states",),
    always=True,
    positional=("type", "signal"),
    documentation="""
    Add a controller, filter or actuator of type pi, pid, low_pass, lead_lag, state_feedback, skyhook or
    sampled.

    Formulas use its output by its name.""",
)
REFERENCES = _References(
    key="references",
    entry=ReferenceEntry,
    after=("reactions",),
    last=True,
    documentation="""
    Add a reference motion of joints, for which formulas ask the inverse dynamics: ``tau.elbow(name)``.""",
)
