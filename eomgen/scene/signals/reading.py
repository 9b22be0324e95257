"""Reading of inputs, internal states and outputs."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable

from eomgen.base.random_roads import Harmonic
from eomgen.base.text import key_of
from eomgen.formula.curves import AnyCurve
from eomgen.formula.discontinuities import applications
from eomgen.formula.nodes import Formula, Symbol
from eomgen.scene.formula.scope import ENERGIES, EVERYTHING, REACTION_PARTS, STATE, TIME
from eomgen.scene.reading import report
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import Values
from eomgen.scene.signals import schema as written
from eomgen.scene.signals.curves import Curves
from eomgen.scene.signals.output_units import doubtful_label, units_of_symbols
from eomgen.scene.signals.sampling import read_sampled_state
from eomgen.scene.signals.schema import State as WrittenState
from eomgen.system.motions import Motion
from eomgen.system.signals import Input, Output, State


def read_motion(name: str, entry: written.Input, report: Report) -> Motion:
    """Return an input with a motion that others follow; keys of its value over time are reported."""
    key = key_of("inputs", name)
    for word in ("formula", "table", "points", "wave", "road", "interpolation", "outside"):
        if getattr(entry, word) is not None:
            fault = f"a motion is given by its caller, and takes no {word}"
            report.add(f"{key}.{word}", fault, "no motion; a drive takes formulas and curves of t themselves")
    return Motion(name, entry.initial or 0.0, entry.unit, entry.description)


def piece_of(motion: Motion) -> Formula:
    """Return the polynomial of time that a motion is from one step of its caller to the next."""
    begin, *coefficients = (Symbol("parameter", parameter) for parameter in motion.parameters)
    since = Symbol("time") - begin
    result: Formula = coefficients[-1]
    for coefficient in reversed(coefficients[:-1]):
        result = result * since + coefficient
    return result


def read_input(name: str, entry: written.Input, curves: Curves, values: Values) -> tuple[Input, dict[str, AnyCurve]]:
    """Return an input, and the curves that it is made of."""
    key = key_of("inputs", name)
    if entry.initial is not None:
        values.report.add(f"{key}.initial", "initial is of motions, and this is none", "formula, or motion = true")
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
    table = {at.curve.name: at.curve for part in parts for at in applications(part)}
    formula = functools.reduce(operator.add, parts) if parts else None
    return Input(name, formula, entry.unit, entry.description, harmonics, under_wheel), table


def read_state(name: str, entry: WrittenState, values: Values) -> list[State]:
    """Return an internal state; for a delayed sampled state also the states that hold its values."""
    key = key_of("states", name)
    if entry.rate is None or entry.sample is not None:
        given = [word for word in ("rate", "sample", "formula") if getattr(entry, word) is not None]
        if given == ["sample", "formula"]:
            return read_sampled_state(name, entry, values)
        fault = f"a state needs its rate, or a sample and a formula, and has {' and '.join(given) or 'none of them'}"
        values.report.add(key, fault, 'rate = "..."; or sample = "1 ms" and formula = "..."')
        return []
    for word in ("formula", "delay", "quantum"):
        if getattr(entry, word) is not None:
            values.report.add(f"{key}.{word}", f"{word} is of sampled states", 'sample = "1 ms" in place of the rate')
    rate = values.formula(f"{key}.rate", entry.rate, STATE)
    initial = values.constant(f"{key}.initial", entry.initial)
    return [State(name, rate, initial, entry.unit, entry.description)]


#: Units of outputs that do not say theirs; energies are J, powers W.
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


#: From the key, the kind and the entry of an output of sections to its components.
Sections = Callable[[str, str, written.Output], tuple[Formula, ...]]


def read_output(name: str, output: written.Output, sections: Sections, values: Values) -> Output:
    """Return an output; without a given unit, in its kind's unit."""
    key = key_of("outputs", name)
    kinds = (*_UNITS, "formula", "energy")
    given = [kind for kind in kinds if getattr(output, kind) is not None]
    formulas: tuple[Formula, ...] = ()
    if len(given) != 1:
        got = " and ".join(given) or "none"
        values.report.add(key, f"an output needs one of {', '.join(kinds)}, not {got}", 'position = "tip"')
    elif output.formula is not None:
        if not output.formula:
            values.report.add(f"{key}.formula", "the list of formulas is empty", "a formula")
        formulas = tuple(
            values.formula(f"{key}.formula[{place}]", entry, EVERYTHING) for place, entry in enumerate(output.formula)
        )
    elif output.energy is not None:
        report.check_reference(f"{key}.energy", output.energy, ENERGIES, "energy", values.report)
        formulas = (Symbol("energy", output.energy),)
    elif given[0].startswith("section"):
        formulas = sections(key, given[0], output)
    elif given[0].startswith("reaction"):
        part, of = given[0].removeprefix("reaction_"), str(getattr(output, given[0]))
        if fault := values.names.fault_of_reaction(of):
            values.report.add(f"{key}.{given[0]}", *fault)
        formulas = tuple(Symbol("reaction", of, REACTION_PARTS[part] + index) for index in range(3))
    else:
        kind, point = given[0], str(getattr(output, given[0]))
        values.point(f"{key}.{kind}", point)
        formulas = tuple(Symbol(kind, point, index) for index in range(3))
    if output.at is not None and not any(kind.startswith("section") for kind in given):
        values.report.add(f"{key}.at", "at is a place on a beam, of outputs of its sections", 'section_moment = "NAME"')
    unit = _UNITS.get(given[0], "") if len(given) == 1 else ""
    if output.energy is not None:
        unit = "W" if output.energy.endswith("power") else "J"
    own = unit or units_of_symbols(formulas, values.names.joints)
    if output.unit and (note := doubtful_label(output.unit, own)):
        values.note([f"{key}: {note}"])
    return Output(name, formulas, output.unit or unit, output.description)
