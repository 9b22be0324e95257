"""Sections of signals: parameters, curves, inputs, internal states and outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from eomgen.base.text import NAME_LENGTH, key_of
from eomgen.scene.section import Entries, Reading, Section
from eomgen.scene.signals import schema
from eomgen.scene.signals.curves import Curves
from eomgen.scene.signals.reading import piece_of, read_input, read_motion, read_output, read_state
from eomgen.system.motions import Motion, motion_parameters
from eomgen.system.signals import Output, Parameter


class _Parameters(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {}  # with the parameters of all sections

    def parameters(self, entries: Mapping[str, Any]) -> Sequence[Parameter]:
        written: Mapping[str, schema.Parameter] = entries
        return [
            Parameter(name, entry.value, entry.tunable, entry.unit, entry.description)
            for name, entry in written.items()
        ]


class _Curves(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        entries: Mapping[str, schema.Curve] = reading.document.section("curves")
        units = {name: entry.argument_unit for name, entry in entries.items() if entry.argument_unit}
        return {"curves": {}, "curve_arguments": units}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        curves = Curves(reading.values, reading.folder)
        for name, entry in reading.document.section("curves").items():
            reading.tables["curves"][name] = curves.curve(key_of("curves", name), name, entry)
        return {}

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"curves": tuple(reading.tables["curves"].values())}


class _Inputs(Section):
    """Inputs that are motions of their caller are polynomials of time, whose coefficients are tunable parameters."""

    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        """Return the fault of the names of the parameters that a motion has."""
        entries = document.section("inputs")
        if name not in entries or not entries[name].motion:
            return "", ""
        others = {entry: row.bare for row in rows if row.bare for entry in document.section(row.key)}
        for row in rows:
            others |= {} if row.single else row.made_names(document.section(row.key))
        for parameter in motion_parameters(name):
            if len(parameter) > NAME_LENGTH:
                return f"the motion {name} has the parameter {parameter}, whose name is too long", "a shorter name"
            if parameter in others:
                fault = (
                    f"the motion {name} has the parameter {parameter}, and there is {others[parameter]} of that name"
                )
                return fault, "another name for one of them"
        return "", ""

    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"inputs": reading.names_in("inputs"), "motions": {}}

    def prepare(self, reading: Reading) -> None:
        entries: Mapping[str, schema.Input] = reading.document.section("inputs")
        motions = [read_motion(name, entry, reading.report) for name, entry in entries.items() if entry.motion]
        reading.tables["motions"] |= {motion.name: piece_of(motion) for motion in motions}
        reading.add_parameters([item for motion in motions for item in _parameters_of(motion)])
        reading.items["motions"] = {motion.name: motion for motion in motions}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        curves, read = Curves(reading.values, reading.folder), {}
        for name, entry in reading.document.section("inputs").items():
            if name not in reading.items["motions"]:
                read[name], made = read_input(name, entry, curves, reading.values)
                reading.tables["curves"] |= made
        return read

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {
            "inputs": tuple(reading.items["inputs"].values()),
            "motions": tuple(reading.items["motions"].values()),
        }


def _parameters_of(motion: Motion) -> list[Parameter]:
    """Return the tunable parameters of a motion at rest."""
    begin, *coefficients = motion.parameters
    made = [Parameter(begin, 0.0, True, "s", f"when the present piece of the motion {motion.name} begins")]
    for k, name in enumerate(coefficients):
        unit = f"{motion.unit}/s^{k}" if motion.unit and k > 1 else f"{motion.unit}/s" if motion.unit and k else ""
        meaning = f"of (t - {begin})^{k} in the motion {motion.name}" if k else f"where the motion {motion.name} begins"
        made.append(Parameter(name, 0.0 if k else motion.initial, True, unit or motion.unit, meaning))
    return made


class _States(Section):
    def read(self, reading: Reading) -> Mapping[str, Any]:
        entries = reading.document.section("states").items()
        states = [state for name, entry in entries for state in read_state(name, entry, reading.values)]
        return {state.name: state for state in states}


class _Outputs(Section):
    def read_entry(self, name: str, entry: schema.Output, reading: Reading) -> Output:
        return read_output(name, entry, reading.section_formulas, reading.values)


PARAMETERS = _Parameters(
    key="parameters",
    entry=schema.Parameter,
    bare="a parameter",
    always=True,
    positional=("value",),
    documentation="""
    Add a named number, or a text of a number and its unit; a tunable one can be changed without recompiling.""",
)
CURVES = _Curves(
    key="curves",
    entry=schema.Curve,
    bare="a curve",
    after=("parameters",),
    always=True,
    documentation="""
    Add a function of one number: table, points, wave, bump or road as in a scene file, interpolation and
    outside.""",
)
INPUTS = _Inputs(
    key="inputs",
    entry=schema.Input,
    bare="an input",
    after=("constraints",),
    always=True,
    positional=("formula",),
    documentation="""
    Add an input; the given formula is its value unless the caller specifies another.

    ``formula`` is of time and parameters; ``road`` has the keys speed (m/s), if needed offset (m), and one
    of class (A to H, ISO 8608), table, points and bump; in addition, one of table, points and wave gives its shape.""",
)
STATES = _States(
    key="states",
    entry=schema.State,
    scene_field="states",
    bare="a state",
    after=("inputs",),
    always=True,
    positional=("rate",),
    documentation="""
    Add an internal state: ``rate``, a formula of everything but accelerations, is its time derivative; or
    ``sample`` in s and ``formula`` of one that is sampled.""",
)
OUTPUTS = _Outputs(
    key="outputs",
    entry=schema.Output,
    scene_field="outputs",
    after=("events",),
    last=True,
    always=True,
    documentation="""
    Add an output: formulas, a point's position, velocity or acceleration (world axes), or an energy.""",
)
