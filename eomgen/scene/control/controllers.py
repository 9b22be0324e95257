"""Controllers: reading of their section, and the control laws as formulas, among them skyhook and groundhook.

``tests.oracles.semi_active`` has the same laws, with their sources.
"""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.messages import key_of, listed, nearest, shown
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ONE, ZERO, Formula, Number, Operation, Symbol, distinct_nodes
from eomgen.scene.control.model import Controller
from eomgen.scene.control.sampled import read_sampled_controller, sampled_names
from eomgen.scene.control.state_feedback import feedback_names, read_state_feedback
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import UNKNOWN, Values
from eomgen.system.signals import State

if TYPE_CHECKING:
    from eomgen.scene.control.schema import ControllerEntry as Written
    from eomgen.scene.forces.springs import SpringEntry

_LIMITS = ("minimum_damping", "maximum_damping", "width")


def read_skyhook(name: str, entry: Written, values: Values, springs: Mapping[str, SpringEntry]) -> Formula:
    """Return the tension that a skyhook controller demands of the spring, N, a formula, limited to a damper's tensions
    if clipped; ``UNKNOWN`` after a fault, which is reported. ``springs`` are the entries of [springs]."""
    key, report = key_of("controllers", name), values.report
    if entry.spring is None:
        return UNKNOWN
    if entry.spring not in springs:
        hint = nearest(entry.spring, springs) or "a [springs] section"
        report.add(f"{key}.spring", f"there is no spring {shown(entry.spring)} [E1412]", hint)
        return UNKNOWN
    if entry.damping is None and entry.groundhook is None:
        report.add(key, "a skyhook controller needs damping or groundhook [E1413]", "damping = 2000")
        return UNKNOWN
    options = values.keys(key, entry, "damping", "groundhook", *_LIMITS)
    if not entry.clipped:
        for field in _LIMITS:
            if field in options:
                fault = f"{field} has no meaning for a skyhook that is not clipped [E1414]"
                report.add(f"{key}.{field}", fault, "clipped = true")
    elif "maximum_damping" not in options:
        fault = "a clipped skyhook needs maximum_damping: no damper is infinitely hard [E1415]"
        report.add(key, fault, "maximum_damping = 4000")
        return UNKNOWN
    first, second = springs[entry.spring].first, springs[entry.spring].second
    terms: list[Formula] = []
    if "damping" in options:
        terms.append(options["damping"] * _along(entry.spring, first, second, second))
    if "groundhook" in options:
        terms.append(-(options["groundhook"] * _along(entry.spring, first, second, first)))
    tension = functools.reduce(operator.add, terms)
    if not entry.clipped:
        return tension
    least, most = options.get("minimum_damping", Number(0.0)), options["maximum_damping"]
    field = "minimum_damping" if "minimum_damping" in options else "maximum_damping"
    values.require(f"{key}.{field}", RELATIONS["limits of a damper"], [least, most])
    rate = Symbol("rate", entry.spring)
    if "width" not in options:
        return _clip(tension, rate, least, most)
    return _clip_smoothly(tension, rate, least, most, options["width"])


def _along(spring: str, first: str, second: str, point: str) -> Formula:
    """Return the velocity of a point, m/s, along the line from the first to the second point of a spring, as a
    formula."""
    reach = [Symbol("position", second, axis) - Symbol("position", first, axis) for axis in range(3)]
    parts = [Symbol("velocity", point, axis) * part for axis, part in enumerate(reach)]
    return functools.reduce(operator.add, parts) / Symbol("length", spring)


def _clip(wanted: Formula, rate: Formula, least: Formula, most: Formula) -> Formula:
    """Return the tension ``wanted``, limited to the tensions of dampers between ``least`` and ``most``, N s/m, at the
    spring's rate ``rate``, m/s."""
    soft, hard = least * rate, most * rate
    high = Operation("max", (soft, hard))
    return Operation("max", (Operation("min", (soft, hard)), Operation("min", (high, wanted))))


def _clip_smoothly(wanted: Formula, rate: Formula, least: Formula, most: Formula, width: Formula) -> Formula:
    """Return the tension ``wanted`` limited as by ``_clip``, with corners that are round over the rate ``width``, m/s;
    see ``tests.oracles.semi_active.rounded``. ``least`` and ``most`` are dampings, N s/m, ``rate`` is the spring's,
    m/s."""
    half, mean = 0.5 * (most - least), 0.5 * (least + most)
    beside = wanted - mean * rate
    floor = mean * width * (mean * width)
    first, second = (_root(side * side + floor) for side in (beside + half * rate, beside - half * rate))
    share = 2.0 * beside / (first + second) * (rate / _root(rate * rate + width * width))
    return rate * (mean + half * share)


def _root(x: Formula) -> Formula:
    return Operation("sqrt", (x,))


def read_controller(name: str, entry: Written, values: Values) -> tuple[list[State], Formula]:
    """Return the internal states and the output, a formula within the limits, of a controller of the type pi, pid,
    low_pass or lead_lag; faults are reported."""
    key = key_of("controllers", name)
    options = values.keys(key, entry, "signal", "time_constant")
    e, T = options.get("signal", UNKNOWN), options.get("time_constant", UNKNOWN)
    x, f = (Symbol("state", f"{name}_{suffix}") for suffix in ("integral", "filtered"))
    limits = OutputLimits(key, entry, values)
    parts = ("proportional", "integral", "derivative", "lead")
    options = values.keys(key, entry, *parts, "gain", "initial_filtered", "initial", "tracking")
    kp, ki, kd, lead = (options.get(part, ZERO) for part in parts)
    gain, filtered = options.get("gain", ONE), options.get("initial_filtered", 0.0)
    rates: dict[str, tuple[Formula, float]] = {}
    if entry.type in ("pi", "pid"):
        free = kp * e + x
        if entry.type == "pid":
            rate = (e - f) / T
            free = free + kd * rate
            rates["filtered"] = rate, filtered
        rate = ki * e
        if limits.bounds:
            if "tracking" not in options:
                values.require(key, RELATIONS["integral time"], [kp, ki])
            tracking = options["tracking"] if "tracking" in options else kp / ki
            rate = rate + (limits.of(free) - free) / tracking
        rates = {"integral": (rate, options["initial"]), **rates}
    elif entry.type == "low_pass":
        rates["filtered"] = (gain * e - f) / T, options["initial"]
        free = f
    else:
        rates["filtered"] = (e - f) / T, filtered
        free = gain * (f + lead / T * (e - f))
    state_words = {"integral": "integral", "filtered": "filtered signal"}
    states = [
        State(
            f"{name}_{suffix}",
            rate,
            initial,
            entry.unit if suffix == "integral" or entry.type == "low_pass" else "",
            f"{state_words[suffix]} of the controller {name}",
        )
        for suffix, (rate, initial) in rates.items()
    ]
    return states, limits.of(free)


class OutputLimits:
    """The limits ``minimum`` and ``maximum`` of a controller's output, formulas of parameters; a minimum above the
    maximum is reported."""

    def __init__(self, key: str, entry: Written, values: Values) -> None:
        operations = {"minimum": "max", "maximum": "min"}
        self.bounds = {operations[end]: bound for end, bound in values.keys(key, entry, *operations).items()}
        if len(self.bounds) == 2:
            values.require(f"{key}.minimum", RELATIONS["limits of an output"], [self.bounds["max"], self.bounds["min"]])

    def of(self, formula: Formula) -> Formula:
        """Return a formula held between the limits."""
        for operation, bound in self.bounds.items():
            formula = Operation(operation, (bound, formula))
        return formula


def check_loops(controllers: Sequence[Controller], elements: Sequence[ForceElement], values: Values) -> None:
    """Report outputs of controllers that depend on themselves at the same instant, directly or through forces of force
    elements."""
    forces = {kind: row.section for kind, row in values.names.offered.items() if row.scope == "tension"}
    sections = {"controller": "controllers", **forces}
    depends = {f"controllers.{item.name}": _used_entries([item.output], sections) for item in controllers}
    for item in elements:
        own, used = f"{item.section}.{item.name}", _used_entries((formula for formula, _ in item.formulas()), sections)
        depends[own] = [name for name in used if name != own]
    try:
        TopologicalSorter(depends).prepare()
    except CycleError as error:
        loop = error.args[1][::-1]
        chain = " uses ".join(part.replace("springs.", "tension.") for part in loop)
        formulas = [item.output for item in controllers if f"controllers.{item.name}" in loop]
        parts = [part for formula in formulas for part in distinct_nodes(formula) if isinstance(part, Operation)]
        if names := listed(
            dict.fromkeys(part.label for part in parts if part.label and _used_entries([part], sections))
        ):
            chain += f" (in the definition {names})"
        fault = f"an algebraic loop: {chain}, with no state between [E1416]"
        values.report.add(loop[0], fault, "a low_pass controller, or a state, somewhere in the loop")


def _used_entries(formulas: Iterable[Formula], sections: Mapping[str, str]) -> list[str]:
    used = (symbol for formula in formulas for symbol in symbols(formula) if symbol.kind in sections)
    return sorted({f"{sections[symbol.kind]}.{symbol.name}" for symbol in used})


#: Keys of each type in addition to labels; needed keys with an example.
_KEYS: Mapping[str, str] = {
    "pi": 'signal="1-q.hinge" initial minimum maximum proportional integral tracking',
    "pid": 'signal="1-q.hinge" initial minimum maximum time_constant=0.01 proportional integral derivative tracking'
    " initial_filtered",
    "low_pass": 'signal="1-q.hinge" initial minimum maximum time_constant=0.01 gain',
    "lead_lag": 'signal="1-q.hinge" minimum maximum time_constant=0.01 lead=0.01 gain initial_filtered',
    "state_feedback": "minimum maximum outputs coordinates signals position_references signal_references position_gains"
    " velocity_gains signal_gains calibration",
    "sampled": "initial sample=0.01 signals outputs delay quantum source function memory",
    "skyhook": 'minimum maximum spring="suspension" damping groundhook clipped minimum_damping maximum_damping width',
}
#: The states that each type makes, by the suffix after the controller's name.
SUFFIXES: Mapping[str, tuple[str, ...]] = {
    "pi": ("integral",), "pid": ("integral", "filtered"), "low_pass": ("filtered",), "lead_lag": ("filtered",),
    "state_feedback": (), "skyhook": (), "sampled": (),
}  # fmt: skip  # a table


def made_by_controller(name: str, entry: Written) -> dict[str, list[str]]:
    """Return the names that a controller adds to a scene in addition to the controller's, by section: states, and of
    some types parameters and further outputs as controllers."""
    made: dict[str, list[str]] = {"states": [f"{name}_{suffix}" for suffix in SUFFIXES[entry.type]]}
    if entry.type == "sampled":
        sampled = sampled_names(name, entry)
        made["states"] = sampled.states
        made["controllers"] = [output for output in sampled.outputs if output != name]
    if entry.type == "state_feedback":
        feedback = feedback_names(name, entry)
        made["parameters"] = list(feedback.parameters)
        made["controllers"] = [output for output in feedback.outputs if output != name]
    return made


def states_of_controllers(entries: Mapping[str, Written]) -> list[str]:
    """Return the names of the states that controllers make."""
    return [state for name, entry in entries.items() for state in made_by_controller(name, entry)["states"]]


def outputs_of_controllers(entries: Mapping[str, Written]) -> list[str]:
    """Return the names of controller outputs in formulas."""
    made = {name: made_by_controller(name, entry).get("controllers") for name, entry in entries.items()}
    return [output for name, outputs in made.items() for output in outputs or (name,)]


def read_controllers(section: Callable[[str], Mapping[str, Any]], values: Values, folder: Path) -> dict[str, list[Any]]:
    """Return internal states, outputs and records of all controllers, by the fields ``states``, ``controllers``,
    ``feedback`` and ``sampled`` of the Scene; faults are reported.

    Parameters
    ----------
    section : function from the key of a section to its entries by name
    folder : from which the paths of C files start
    """
    entries: Mapping[str, Written] = section("controllers")
    made: dict[str, list[Any]] = {"states": [], "controllers": [], "feedback": [], "sampled": []}
    for name, entry in entries.items():
        key, unit = key_of("controllers", name), entry.unit
        values.check_kind(key, entry, "type", _KEYS)
        if SUFFIXES[entry.type]:
            states, formula = read_controller(name, entry, values)
            made["states"] += states
            outputs = {name: formula}
        elif entry.type == "sampled":
            OutputLimits(key, entry, values)
            states, called = read_sampled_controller(name, entry, values, folder)
            made["states"] += states
            made["sampled"].append(called)
            names = sampled_names(name, entry)
            outputs = {output: Symbol("state", held) for output, held in zip(names.outputs, names.values, strict=True)}
        elif entry.type == "state_feedback":
            limits = OutputLimits(key, entry, values)
            free, record = read_state_feedback(name, entry, values, section("outputs"))
            made["feedback"].append(record)
            outputs = {output: limits.of(formula) for output, formula in zip(record.outputs, free, strict=True)}
        else:
            limits, unit = OutputLimits(key, entry, values), entry.unit or "N"
            outputs = {name: limits.of(read_skyhook(name, entry, values, section("springs")))}
        made["controllers"] += [Controller(output, law, unit, entry.description) for output, law in outputs.items()]
    return made
