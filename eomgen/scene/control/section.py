"""The section of controllers: each entry read by its type, the keys that types take, and the names that they make."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from eomgen.scene.control.controllers import Limits, read_controller
from eomgen.scene.control.model import StateFeedback
from eomgen.scene.control.schema import Controller as Written
from eomgen.scene.control.skyhook import read_skyhook
from eomgen.scene.control.state_feedback import made_by_entry, parameters_of, read_state_feedback
from eomgen.scene.forces.schema import Spring as WrittenSpring
from eomgen.scene.reading.values import Values
from eomgen.scene.scene import Controller, Parameter, State
from eomgen.text import key_of

#: Keys beside signal, limits and labels that each type takes; the first ones it must have.
_KEYS: Mapping[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "pi": ((), ("proportional", "integral", "tracking")),
    "pid": (("time_constant",), ("proportional", "integral", "derivative", "tracking", "initial_filtered")),
    "low_pass": (("time_constant",), ("gain",)),
    "lead_lag": (("time_constant", "lead"), ("gain", "initial_filtered")),
    "state_feedback": (
        (),
        (
            "outputs", "coordinates", "signals", "position_references", "signal_references", "position_gains", "velocity_gains",
            "signal_gains", "calibration",
        ),
    ),
    "skyhook": ((), ("spring", "damping", "groundhook", "clipped", "minimum_damping", "maximum_damping", "width")),
}
_OPTIONAL = tuple(dict.fromkeys(field for needed, allowed in _KEYS.values() for field in (*needed, *allowed)))
#: The states that each type makes, by what is put behind the controller's name.
SUFFIXES: Mapping[str, tuple[str, ...]] = {
    "pi": ("integral",), "pid": ("integral", "filtered"), "low_pass": ("filtered",), "lead_lag": ("filtered",),
    "state_feedback": (), "skyhook": (),
}  # fmt: skip


def made_by_controller(name: str, entry: Written) -> dict[str, list[str]]:
    """Return the names that a controller makes beside its own, by the section whose entries they are like."""
    made: dict[str, list[str]] = {"states": [f"{name}_{suffix}" for suffix in SUFFIXES[entry.type]]}
    if entry.type == "state_feedback":
        feedback = made_by_entry(name, entry)
        made["parameters"] = list(feedback.parameters)
        made["controllers"] = [output for output in feedback.outputs if output != name]
    return made


def states_of_controllers(entries: Mapping[str, Written]) -> list[str]:
    """Return the names of the states that controllers make."""
    return [state for name, entry in entries.items() for state in made_by_controller(name, entry)["states"]]


def outputs_of_controllers(entries: Mapping[str, Written]) -> list[str]:
    """Return the names by which formulas call what controllers give."""
    return [
        output
        for name, entry in entries.items()
        for output in made_by_controller(name, entry).get("controllers") or (name,)
    ]


def made_parameters(entries: Mapping[str, Written]) -> list[Parameter]:
    """Return the tunable parameters that controllers make."""
    feedback = [(name, entry) for name, entry in entries.items() if entry.type == "state_feedback"]
    return [parameter for name, entry in feedback for parameter in parameters_of(name, entry)]


@dataclass
class Controllers:
    """What the controllers of a scene are made of."""

    states: list[State] = field(default_factory=list)
    outputs: list[Controller] = field(default_factory=list)
    feedback: list[StateFeedback] = field(default_factory=list)


def read_controllers(
    entries: Mapping[str, Written], springs: Mapping[str, WrittenSpring], outputs: Collection[str], values: Values
) -> Controllers:
    """Return the states and outputs of all controllers; what is wrong is reported.

    Parameters
    ----------
    springs : mapping
        As they are written, for their points.
    outputs : collection of str
        Names of the scene's outputs, for weights.
    """
    found = Controllers()
    ends = {name: (spring.first, spring.second) for name, spring in springs.items()}
    for name, entry in entries.items():
        _check_keys(name, entry, values)
        if SUFFIXES[entry.type]:
            states, controller = read_controller(name, entry, values)
            found.states += states
            found.outputs.append(controller)
            continue
        limits = Limits(key_of("controllers", name), entry, values)
        if entry.type == "state_feedback":
            free, record = read_state_feedback(name, entry, values, outputs)
            found.feedback.append(record)
            for output, formula in zip(record.outputs, free, strict=True):
                found.outputs.append(Controller(output, limits.of(formula), entry.unit, entry.description))
        else:
            formula = limits.of(read_skyhook(name, entry, values, ends))
            found.outputs.append(Controller(name, formula, entry.unit or "N", entry.description))
    return found


def _check_keys(name: str, entry: Written, values: Values) -> None:
    """Report the keys that a type of controller does not take, and those that it needs."""
    key, report = key_of("controllers", name), values.report
    needed, allowed = _KEYS[entry.type]
    given = [option for option in _OPTIONAL if getattr(entry, option) is not None]
    for option in given:
        if option not in (*needed, *allowed):
            kinds = " or ".join(kind for kind, (first, second) in _KEYS.items() if option in (*first, *second))
            report.add(f"{key}.{option}", f"{option} has no meaning for {entry.type}", f"type = {kinds}")
    for option in needed:
        if option not in given:
            report.add(key, f"a {entry.type} controller needs {option}", f"{option} = 0.01")
    if entry.initial and entry.type == "lead_lag":
        report.add(f"{key}.initial", "a lead_lag controller starts from initial_filtered", "initial_filtered = ...")
    if not SUFFIXES[entry.type]:
        for option in ("signal", "initial"):
            if getattr(entry, option) not in (None, 0.0):
                report.add(f"{key}.{option}", f"{option} has no meaning for {entry.type}", f"no {option}")
    elif entry.signal is None:
        report.add(f"{key}.signal", "the key signal is missing", "signal = ...")
