"""Sections of controllers and of reference motions, for which formulas read inverse dynamics: ``tau.elbow(servo)``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from eomgen.base.messages import NAME_LENGTH, NAME_RULE, is_legal, key_of, shown
from eomgen.formula.nodes import Formula
from eomgen.scene.control.controllers import (
    made_by_controller,
    outputs_of_controllers,
    read_controllers,
    states_of_controllers,
)
from eomgen.scene.control.model import Reference
from eomgen.scene.control.state_feedback import parameters_of
from eomgen.scene.formula.scope import SPRING_FORCE
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.report import check_reference
from eomgen.scene.section import Entries, Reading, Section
from eomgen.system.signals import Parameter

if TYPE_CHECKING:
    from eomgen.scene.control.schema import ControllerEntry, ReferenceEntry


def read_reference(name: str, entry: ReferenceEntry, reading: Reading) -> Reference:
    """Return the reference motion of an entry of [references]. Joints that are unknown are left out; these, joints with
    several coordinates and mimic joints are reported."""
    values, joints = reading.values, reading.items["joints"].values()
    followers = frozenset(joint.name for joint in joints if joint.mimic is not None)
    parts: dict[str, tuple[tuple[str, Formula], ...]] = {}
    for part in ("position", "velocity", "acceleration"):
        formulas = []
        for joint, text in getattr(entry, part).items():
            entry_key = key_of("references", name, part, joint)
            if not check_reference(entry_key, joint, values.names.joints, "joint", values.report):
                continue
            kind = JOINTS.get(values.names.joints[joint])
            if kind is not None and kind.v_size != 1:
                fault = f"a {kind.name} joint has not one coordinate [E1427]"
                values.report.add(entry_key, fault, "a joint of one coordinate")
            if joint in followers:
                values.report.add(entry_key, f"the joint {joint} follows another [E1428]", "the joint that it follows")
            formulas.append((joint, values.formula(entry_key, text, SPRING_FORCE)))
        parts[part] = tuple(formulas)
    return Reference(name, **parts)


class _Controllers(Section):
    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        """Return the fault of the names that a controller adds for states, parameters and outputs, and a hint; two
        empty texts if all are legal and free."""
        entries: Mapping[str, ControllerEntry] = document.section("controllers")
        if name not in entries:
            return "", ""
        others = {made: entry for entry in entries if entry != name for _, made in _added_names(entry, entries[entry])}
        nouns = {row.key: row.bare for row in rows if row.bare}
        for section, made in _added_names(name, entries[name]):
            maker = f"the controller makes {nouns[section]}"
            if not is_legal(made):
                why, hint = ("too long", "a shorter name") if len(made) > NAME_LENGTH else ("not legal", NAME_RULE)
                return f"{maker} {shown(made)}, whose name is {why} [E1455]", hint
            if made in others:
                fault = f"the controllers {name} and {others[made]} both make {nouns[section]} {made} [E1456]"
                return fault, "another name for one of them"
            for word, noun in nouns.items():
                if made in document.section(word):
                    return f"{maker} {made}, and there is {noun} of that name [E1457]", "another name for one of them"
        return "", ""

    def made_names(self, entries: Mapping[str, Any]) -> Mapping[str, str]:
        names = ((name, made) for name, entry in entries.items() for _, made in _added_names(name, entry))
        return {made: f"what the controller {name} makes" for name, made in names}

    def names(self, reading: Reading) -> Mapping[str, Any]:
        entries, refused = reading.document.section("controllers"), sorted(reading.refused["controllers"])
        return {
            "controllers": (*outputs_of_controllers(entries), *refused),
            "states": tuple(states_of_controllers(entries)),
        }

    def parameters(self, entries: Mapping[str, Any]) -> Sequence[Parameter]:
        feedback = [(name, entry) for name, entry in entries.items() if entry.type == "state_feedback"]
        return [parameter for name, entry in feedback for parameter in parameters_of(name, entry)]

    def read(self, reading: Reading) -> Mapping[str, Any]:
        return read_controllers(reading.document.section, reading.values, reading.folder)

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {field: tuple(items) for field, items in reading.items["controllers"].items()}


def _added_names(name: str, entry: ControllerEntry) -> list[tuple[str, str]]:
    """Return the names that a controller adds besides its name, each with a section."""
    return [(section, made) for section, names in made_by_controller(name, entry).items() for made in names]


CONTROLLERS = _Controllers(
    key="controllers",
    entry="eomgen.scene.control.schema:ControllerEntry",
    bare="a controller",
    after=("states",),
    positional=("type", "signal"),
    documentation="""
    Add a controller, filter or actuator of type pi, pid, low_pass, lead_lag, state_feedback, skyhook or
    sampled.

    Formulas use its output by its name.""",
)
REFERENCES = Section(
    key="references",
    entry="eomgen.scene.control.schema:ReferenceEntry",
    scene_field="references",
    after=("reactions",),
    last=True,
    item=read_reference,
    documentation="""
    Add a reference motion of joints, for which formulas ask the inverse dynamics: ``tau.elbow(name)``.""",
)
