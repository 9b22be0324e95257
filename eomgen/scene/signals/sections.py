"""Sections of signals: parameters, curves, inputs, internal states and outputs, with their reading and the units of
outputs.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from eomgen.base.messages import NAME_LENGTH, key_of, shown
from eomgen.base.random_inputs import Harmonic
from eomgen.formula.curves import AnyCurve
from eomgen.formula.discontinuities import applications
from eomgen.formula.nodes import Formula, Symbol
from eomgen.formula.units.conversion import misplaced_kind, unit_fault
from eomgen.formula.units.parser import Dimension, dimension_of, factors_of, read_unit
from eomgen.formula.units.table import names
from eomgen.scene.formula.definitions import named_expressions
from eomgen.scene.formula.namespaces import in_order_of_mention
from eomgen.scene.formula.scope import (
    ANYWHERE,
    ANYWHERE_ALONG_A_BEAM,
    ENERGIES,
    EVERYTHING,
    PLACE,
    REACTION_PARTS,
    STATE,
    TIME,
    SceneNames,
)
from eomgen.scene.reading import report
from eomgen.scene.reading.formula_units import (
    FACTOR,
    SECOND,
    dimension_of_formula,
    disagreement,
    labelled_dimension,
    unit_of_symbol,
)
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import UNKNOWN, Values
from eomgen.scene.section import Entries, Reading, Section, UnusedEntries
from eomgen.scene.signals.curves import Curves
from eomgen.scene.signals.sampling import read_sampled_state
from eomgen.scene.signals.tables import note_of_label
from eomgen.system.motions import Motion, motion_parameters
from eomgen.system.signals import Definition, Input, Output, Parameter, State

if TYPE_CHECKING:
    from eomgen.scene.signals import curve_schema, schema


def unit_of_formulas(formulas: Sequence[Formula], names: SceneNames) -> str:
    """Return the SI unit that all formulas share; empty if units differ or one is unknown. A single name has its own
    unit, other formulas the unit that follows from labels (``labelled_dimension``)."""
    result = {
        unit_of_symbol(formula, names.joints, names.labels)
        if isinstance(formula, Symbol)
        else str(labelled_dimension(formula, names) or "")
        for formula in formulas
    }
    return result.pop() if len(result) == 1 else ""


def doubtful_label(label: str, unit: str) -> str:
    """Return a note on the label of a signal whose values are in the SI unit ``unit``, if the label is another unit;
    empty for the same unit, and for a label that is not a unit."""
    factors, known = factors_of(label), factors_of(unit)
    if not known or not factors or factors == known:
        return ""
    if not all(names()[name].is_coherent for name, _ in factors):
        return f"its unit {label} is a label, and its values are in {unit}: labels do not convert values [W0140]"

    note = f"its unit {label} is a label, and its values are in {unit} [W0141]"
    return note if misplaced_kind(label, unit) else ""


def read_motion(name: str, entry: curve_schema.InputEntry, report: Report) -> Motion:
    """Return the motion of an entry of [inputs] with motion = true, whose caller gives value, rate and acceleration;
    keys for a value over time are reported."""
    key = key_of("inputs", name)
    for word in ("formula", "table", "points", "wave", "road", "interpolation", "outside"):
        if getattr(entry, word) is not None:
            fault = f"a motion is given by its caller, and takes no {word} [E1872]"
            report.add(f"{key}.{word}", fault, "no motion; a drive takes formulas and curves of t themselves")
    return Motion(name, entry.initial or 0.0, entry.unit, entry.description)


def piece_of(motion: Motion) -> Formula:
    """Return the formula of a motion between two steps of the caller: a polynomial in the time since the step began,
    with tunable parameters as coefficients."""
    begin, *coefficients = (Symbol("parameter", parameter) for parameter in motion.parameters)
    since = Symbol("time") - begin
    result: Formula = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        result = result * since + coefficient
    return result


def read_input(
    name: str, entry: curve_schema.InputEntry, curves: Curves, values: Values
) -> tuple[Input, dict[str, AnyCurve]]:
    """Return the input of an entry of [inputs], the sum of all parts that the keys give, and the curves in these parts
    by name; faults are reported."""
    key = key_of("inputs", name)
    if entry.initial is not None:
        fault = "initial belongs to an input that is a motion, and this input is not [E1873]"
        values.report.add(f"{key}.initial", fault, "formula, or motion = true")
    parts: list[Formula] = []
    if entry.formula is not None:
        parts.append(values.formula(f"{key}.formula", entry.formula, TIME))
    parts += curves.signal(key, entry)
    harmonics: tuple[Harmonic, ...] = ()
    under_wheel = None
    if entry.road is not None:
        road = curves.road(f"{key}.road", entry.road)
        parts += [] if isinstance(road, tuple) else [road]
        harmonics = road if isinstance(road, tuple) else ()
        under_wheel = curves.under_wheel(f"{key}.road", entry.road) if harmonics else None
        if entry.unit and (note := doubtful_label(entry.unit, "m")):
            values.note([f"{key}: {note}"])
    table = {at.curve.name: at.curve for part in parts for at in applications(part)}
    formula = functools.reduce(operator.add, parts) if parts else None
    return Input(name, formula, entry.unit, entry.description, harmonics, under_wheel), table


def read_state(name: str, entry: schema.StateEntry, values: Values) -> list[State]:
    """Return the internal state of an entry of [states]; a sampled state follows states that hold the value during a
    delay. Empty after a fault, which is reported: neither a rate nor a sample with a formula."""
    key = key_of("states", name)
    if entry.rate is None or entry.sample is not None:
        words = [word for word in ("rate", "sample", "formula") if getattr(entry, word) is not None]
        if words == ["sample", "formula"]:
            return read_sampled_state(name, entry, values)
        fault = f"a state needs its rate, or a sample and a formula, and has {' and '.join(words) or 'none'} [E1874]"
        values.report.add(key, fault, 'rate = "..."; or sample = "1 ms" and formula = "..."')
        return []
    for word in ("formula", "delay", "quantum"):
        if getattr(entry, word) is not None:
            fault = f"{word} belongs to a sampled state, and this state has a rate [E1875]"
            values.report.add(f"{key}.{word}", fault, 'sample = "1 ms" in place of the rate')
    rate = values.formula(f"{key}.rate", entry.rate, STATE)
    dimension, label = dimension_of(unit_of_formulas((rate,), values.names)), dimension_of(entry.unit)
    expected = label and label.times(SECOND, -1.0)
    if not values.note_unit(f"{key}.rate", dimension, expected):
        values.note_hidden_unit(f"{key}.rate", rate, expected, by_time=True)
    initial = values.constant(f"{key}.initial", entry.initial)
    return [State(name, rate, initial, entry.unit, entry.description)]


#: Default units of outputs by kind; energies are in J, powers in W.
_UNITS = {
    "position": "m",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "reaction_force": "N",
    "reaction_moment": "N m",
    "section_force": "N",
    "section_moment": "N m",
    "section_strain": "1",
    "section_curvature": "1/m",
}


def _formulas(key: str, kind: str, output: schema.OutputEntry, reading: Reading) -> tuple[Formula, ...]:
    """Return the formulas of the components of an output, whose key ``kind`` is given: one or several for ``formula``,
    one for ``energy``, else three. Unknown names are reported."""
    values = reading.values
    if output.formula is not None:
        if not output.formula:
            values.report.add(f"{key}.formula", "the list of formulas is empty [E1876]", "a formula")
        written = enumerate(output.formula)
        return tuple(values.formula(f"{key}.formula[{number}]", entry, EVERYTHING) for number, entry in written)
    if output.energy is not None:
        report.check_reference(f"{key}.energy", output.energy, ENERGIES, "energy", values.report)
        return (Symbol("energy", output.energy),)
    if kind.startswith("section"):
        return reading.section_formulas(key, kind, output)
    name = str(getattr(output, kind))
    if kind.startswith("reaction"):
        if fault := values.names.fault_of_reaction(name):
            values.report.add(f"{key}.{kind}", *fault)
        first = REACTION_PARTS[kind.removeprefix("reaction_")]
        return tuple(Symbol("reaction", name, first + index) for index in range(3))
    values.point(f"{key}.{kind}", name)
    return tuple(Symbol(kind, name, index) for index in range(3))


def read_output(name: str, output: schema.OutputEntry, reading: Reading) -> Output:
    """Return the output of an entry of [outputs], by default in the unit of the kind or the formulas. Faults are
    reported; an entry without exactly one kind of output has no formulas."""
    key, values = key_of("outputs", name), reading.values
    kinds = (*_UNITS, "formula", "energy")
    output_kinds = [kind for kind in kinds if getattr(output, kind) is not None]
    formulas: tuple[Formula, ...] = ()
    if len(output_kinds) != 1:
        got = " and ".join(output_kinds) or "none"
        values.report.add(key, f"an output needs one of {', '.join(kinds)}, not {got} [E1880]", 'position = "tip"')
    else:
        formulas = _formulas(key, output_kinds[0], output, reading)
    if output.at is not None and not any(kind.startswith("section") for kind in output_kinds):
        fault = "at is a place on a beam, of outputs of its sections [E1881]"
        values.report.add(f"{key}.at", fault, 'section_moment = "NAME"')
    unit = _UNITS.get(output_kinds[0], "") if len(output_kinds) == 1 else ""
    if output.energy is not None:
        unit = "W" if output.energy.endswith("power") else "J"
    label = unit or unit_of_formulas(formulas, values.names)
    if output.unit and (note := doubtful_label(output.unit, label)):
        values.note([f"{key}: {note}"])
    if not label:
        for formula in formulas:
            values.note_hidden_unit(key, formula, dimension_of(output.unit))
    return Output(name, formulas, output.unit or label, output.description)


class _Parameters(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {}  # with the parameters of all sections

    def parameters(self, entries: Mapping[str, Any]) -> Sequence[Parameter]:
        written: Mapping[str, schema.ParameterEntry] = entries
        return [Parameter(name, **dict(entry)) for name, entry in written.items()]


class _Curves(Section):
    def names(self, reading: Reading) -> Mapping[str, Any]:
        entries: Mapping[str, curve_schema.CurveEntry] = reading.document.section("curves")
        units = {name: entry.argument_unit for name, entry in entries.items() if entry.argument_unit}
        return {"curves": {}, "curve_arguments": units}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        curves = Curves(reading.values, reading.folder)
        for name, entry in reading.document.section("curves").items():
            key = key_of("curves", name)
            reading.tables["curves"][name] = curves.curve(key, name, entry)
            remedy = "value_unit in the table" if entry.table else f'points with units, [0, "1 {entry.unit}"]'
            reading.values.note(note_of_label(key, entry.unit, remedy))
        return {}

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        return {"curves": tuple(reading.tables["curves"].values())}


def _unit_fault(label: str, expected: Dimension) -> tuple[str, str] | None:
    """Return the fault of a label that is a unit of another kind than ``expected``, and a hint; None for a label of
    this kind, and for a label that is not a unit."""
    unit = dimension_of(label)
    if unit is None or unit == expected or (expected.angle is None and unit.powers == expected.powers):
        return None
    if expected.is_number:
        return f"the unit {shown(label)} is not of a plain number, as its formula is [E1883]", "no unit"

    fault = unit_fault(label, read_unit(label), str(expected))
    return fault and (fault[0], f'"{expected}", the unit of its formula in SI')


class _Definitions(Section):
    """Named expressions: a formula that mentions a definition reads it in the formula's scope; here definitions are
    read alone."""

    def names(self, reading: Reading) -> Mapping[str, Any]:
        entries: Mapping[str, schema.DefinitionEntry] = reading.document.section("definitions")
        return {"definitions": named_expressions({name: entry.formula for name, entry in entries.items()})}

    def read(self, reading: Reading) -> Mapping[str, Any]:
        entries: Mapping[str, schema.DefinitionEntry] = reading.document.section("definitions")
        read: dict[str, Definition | None] = {}
        for name in in_order_of_mention(reading.names.definitions):
            read[name] = self.read_entry(name, entries[name], reading)
        return {name: read[name] for name in entries}

    def read_entry(self, name: str, entry: schema.DefinitionEntry, reading: Reading) -> Definition | None:
        """Return a definition read alone, with the unit; None, after a report, if the formula is refused. A wrong unit
        is reported or noted."""
        values, where, text = reading.values, key_of("definitions", name), reading.names.definitions[name].text
        if values.mentions_refused(text):  # a fault that is reported already
            values.refused = {*values.refused, name}
            return None
        taken = PLACE in reading.names.parameters or PLACE in reading.names.definitions
        scope = ANYWHERE if taken else ANYWHERE_ALONG_A_BEAM
        formula = values.formula(f"{where}.formula", text, scope)
        if formula is UNKNOWN:
            values.refused = {*values.refused, name}
            return None
        dimension = dimension_of_formula(formula, reading.names)
        known = "" if dimension is None else str(dimension)
        if entry.unit and (terms := disagreement(formula, reading.names)):
            reading.report.add(f"{where}.formula", terms.text, FACTOR)
        elif entry.unit and dimension and (fault := _unit_fault(entry.unit, dimension)):
            reading.report.add(f"{where}.unit", *fault)
        elif note := doubtful_label(entry.unit, known):
            values.note([f"{where}.unit: {note}"])
        return Definition(name, text, formula, entry.unit or known, entry.description)

    def unused(self, reading: Reading) -> UnusedEntries:
        names = [name for name, item in reading.names.definitions.items() if not item.used]
        return UnusedEntries("definition", "definitions", names)

    def fields(self, reading: Reading) -> Mapping[str, Any]:
        made = tuple(item for item in reading.items["definitions"].values() if item is not None)
        return {"parts": {"definitions": made}}


class _Inputs(Section):
    """Inputs that are motions of their caller are polynomials of time, whose coefficients are tunable parameters."""

    def fault_of_name(self, name: str, document: Entries, rows: Sequence[Section]) -> tuple[str, str]:
        """Return the fault of the names of the tunable parameters that a motion adds, and a hint; two empty texts for
        other inputs and names that are free."""
        entries = document.section("inputs")
        if name not in entries or not entries[name].motion:
            return "", ""
        others = {entry: row.bare for row in rows if row.bare for entry in document.section(row.key)}
        for row in rows:
            others |= {} if row.single else row.made_names(document.section(row.key))
        for parameter in motion_parameters(name):
            if len(parameter) > NAME_LENGTH:
                fault = f"the motion {name} has the parameter {parameter}, whose name is too long [E1458]"
                return fault, "a shorter name"
            if noun := others.get(parameter):
                fault = f"the motion {name} has the parameter {parameter}, and there is {noun} of that name [E1457]"
                return fault, "another name for one of them"
        return "", ""

    def names(self, reading: Reading) -> Mapping[str, Any]:
        return {"inputs": reading.names_in("inputs"), "motions": {}}

    def prepare(self, reading: Reading) -> None:
        entries: Mapping[str, curve_schema.InputEntry] = reading.document.section("inputs")
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
        return {field: tuple(reading.items[field].values()) for field in ("inputs", "motions")}


def _parameters_of(motion: Motion) -> list[Parameter]:
    """Return the tunable parameters of a motion at rest: the time at which the present piece begins, and the
    coefficients of the polynomial, of which the first is the motion's initial value."""
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


PARAMETERS = _Parameters(
    key="parameters",
    entry="eomgen.scene.signals.schema:ParameterEntry",
    bare="a parameter",
    positional=("value",),
    documentation="""
    Add a named number, or a text of a number and its unit; a tunable one can be changed without recompiling.""",
)
CURVES = _Curves(
    key="curves",
    entry="eomgen.scene.signals.curve_schema:CurveEntry",
    bare="a curve",
    after=("parameters",),
    documentation="""
    Add a function of one number: table, points, wave, bump or road as in a scene file, interpolation and
    outside.""",
)
DEFINITIONS = _Definitions(
    key="definitions",
    entry="eomgen.scene.signals.schema:DefinitionEntry",
    bare="a definition",
    after=("curves",),
    positional=("formula",),
    documentation="""
    Add a named expression: formulas mention it by its name, and it is computed once.""",
)
INPUTS = _Inputs(
    key="inputs",
    entry="eomgen.scene.signals.curve_schema:InputEntry",
    bare="an input",
    after=("constraints",),
    positional=("formula",),
    documentation="""
    Add an input; the given formula is its value unless the caller specifies another.

    ``formula`` is of time and parameters; ``road`` has the keys speed (m/s), if needed offset (m), and one
    of class (A to H, ISO 8608), table, points and bump; in addition, one of table, points and wave gives its shape.""",
)
STATES = _States(
    key="states",
    entry="eomgen.scene.signals.schema:StateEntry",
    scene_field="states",
    bare="a state",
    after=("inputs",),
    positional=("rate",),
    documentation="""
    Add an internal state: ``rate``, a formula of everything but accelerations, is its time derivative; or
    ``sample`` in s and ``formula`` of one that is sampled.""",
)
OUTPUTS = Section(
    key="outputs",
    entry="eomgen.scene.signals.schema:OutputEntry",
    scene_field="outputs",
    after=("events",),
    last=True,
    item=read_output,
    documentation="""
    Add an output: formulas, a point's position, velocity or acceleration (world axes), or an energy.""",
)
