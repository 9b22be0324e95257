"""State feedback in a scene: signals, and for each output and signal a gain that is a tunable parameter with its own name."""

from __future__ import annotations

import functools
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from eomgen.scene.control.calibrations import check_known, read_calibration
from eomgen.scene.control.model import StateFeedback
from eomgen.scene.control.schema import Controller as Written
from eomgen.scene.formula.nodes import Formula, Operation, Symbol
from eomgen.scene.formula.scope import STATE, VELOCITY_SIZE
from eomgen.scene.reading.values import Values
from eomgen.scene.scene import Parameter
from eomgen.text import NAME_RULE, is_legal, key_of, nearest, shown


@dataclass(frozen=True)
class Made:
    """Names that a state feedback makes, beside that of its entry.

    Attributes
    ----------
    outputs : of its controllers.
    gains : of parameters, by output, in the order of signals.
    references : of parameters, by signal; empty for velocities, and where the user gives the reference.
    """

    outputs: tuple[str, ...]
    gains: tuple[tuple[str, ...], ...]
    references: tuple[str, ...]

    @property
    def parameters(self) -> tuple[str, ...]:
        return (*(name for row in self.gains for name in row), *filter(None, self.references))


def made_by(
    name: str,
    outputs: Sequence[str],
    coordinates: Sequence[str],
    signals: Sequence[str],
    referred: tuple[Collection[str], Collection[str]],
    calibrated: bool,
) -> Made:
    """Return the names that a state feedback makes; ``referred`` are coordinates, and signals, whose reference is given."""
    given = tuple(f"{name}_{output}" for output in outputs) or (name,)
    parts = [f"position_gain_{joint}" for joint in coordinates] + [f"velocity_gain_{joint}" for joint in coordinates]
    parts += [f"gain_{signal}" for signal in signals]
    references = ["" if joint in referred[0] else f"{name}_position_reference_{joint}" for joint in coordinates]
    references += [""] * len(coordinates)
    references += ["" if signal in referred[1] else f"{name}_reference_{signal}" for signal in signals]
    gains = tuple(tuple(f"{output}_{part}" for part in parts) for output in given)
    return Made(given, gains, tuple(references) if calibrated else ("",) * len(parts))


def made_by_entry(name: str, entry: Written) -> Made:
    """Return the names that an entry of type ``state_feedback`` makes."""
    return made_by(
        name,
        entry.outputs or (),
        entry.coordinates or (),
        tuple(entry.signals or ()),
        (entry.position_references or {}, entry.signal_references or {}),
        entry.calibration is not None,
    )


def parameters_of(name: str, entry: Written) -> list[Parameter]:
    """Return the tunable parameters of a state feedback, gains that the user gives as their values."""
    made = made_by_entry(name, entry)
    tables = [(entry.position_gains or {}, joint) for joint in entry.coordinates or ()]
    tables += [(entry.velocity_gains or {}, joint) for joint in entry.coordinates or ()]
    tables += [(entry.signal_gains or {}, signal) for signal in entry.signals or ()]
    labels = _labels(entry)
    found = []
    for row, (output, gains) in enumerate(zip(made.outputs, made.gains, strict=True)):
        for parameter, (table, what), label in zip(gains, tables, labels, strict=True):
            values = table.get(what, ())
            value = values[row] if row < len(values) else 0.0
            found.append(Parameter(parameter, value, True, "", f"gain of {label} in {output}"))
    for parameter, label in zip(made.references, labels, strict=True):
        if parameter:
            found.append(Parameter(parameter, 0.0, True, "", f"{label} where {name} gives nothing"))
    return found


def read_state_feedback(
    name: str, entry: Written, values: Values, outputs: Collection[str]
) -> tuple[list[Formula], StateFeedback]:
    """Return what each output of a state feedback is, and its record; ``outputs`` are those of the scene."""
    key, report = key_of("controllers", name), values.report
    coordinates, signals = entry.coordinates or (), entry.signals or {}
    if not coordinates and not signals:
        report.add(key, "a state_feedback needs coordinates or signals", 'coordinates = ["joint"]')
    for number, joint in enumerate(coordinates):
        _check_coordinate(f"{key}.coordinates[{number}]", joint, coordinates[:number], values)
    for signal in signals:
        if not is_legal(signal):
            report.add(f"{key}.signals.{key_of(signal)}", f"the name {shown(signal)} is not legal", NAME_RULE)
    for number, output in enumerate(entry.outputs or ()):
        if output in (entry.outputs or ())[:number]:
            report.add(f"{key}.outputs[{number}]", f"the output {output} is named twice", "each output once")
    if entry.outputs == ():
        report.add(f"{key}.outputs", "the list of outputs is empty", f"no outputs: then there is one, called {name}")
    for table in ("position_gains", "velocity_gains", "position_references"):
        check_known(f"{key}.{table}", getattr(entry, table), coordinates, f"coordinate of {name}", values)
    for table in ("signal_gains", "signal_references"):
        check_known(f"{key}.{table}", getattr(entry, table), signals, f"signal of {name}", values)
    made = made_by_entry(name, entry)
    _check_gains(key, entry, len(made.outputs), values)
    measured = [Symbol("q", joint) for joint in coordinates] + [Symbol("v", joint) for joint in coordinates]
    measured += [values.formula(f"{key}.signals.{key_of(signal)}", text, STATE) for signal, text in signals.items()]  # type: ignore[misc]
    parts: list[Formula] = []
    of_positions, of_signals = entry.position_references or {}, entry.signal_references or {}
    given = [(f"{key}.position_references.{key_of(joint)}", of_positions.get(joint)) for joint in coordinates]
    given += [("", None)] * len(coordinates)
    given += [(f"{key}.signal_references.{key_of(signal)}", of_signals.get(signal)) for signal in signals]
    for formula, (place, text), parameter in zip(measured, given, made.references, strict=True):
        reference = Symbol("parameter", parameter) if parameter else None
        off = values.formula(place, text, STATE) if text is not None else reference
        parts.append(formula if off is None else Operation("sub", (formula, off)))
    free = []
    for gains in made.gains:
        products = [Operation("mul", (Symbol("parameter", gain), part)) for gain, part in zip(gains, parts, strict=True)]
        total = functools.reduce(lambda x, y: Operation("add", (x, y)), products) if products else Symbol("time")
        free.append(Operation("neg", (total,)))
    calibration = None
    if entry.calibration is not None:
        calibration = read_calibration(f"{key}.calibration", entry.calibration, signals, len(made.outputs), values, outputs)
    record = StateFeedback(
        name, made.outputs, tuple(measured), tuple(_labels(entry)), made.gains, made.references, calibration
    )
    return free, record  # type: ignore[return-value]


def _labels(entry: Written) -> list[str]:
    coordinates = entry.coordinates or ()
    return [*(f"q.{joint}" for joint in coordinates), *(f"v.{joint}" for joint in coordinates), *(entry.signals or ())]


def _check_coordinate(key: str, joint: str, before: Sequence[str], values: Values) -> None:
    kinds = values.names.joints
    if joint in values.names.beams:
        hint = f'signals = {{ {joint}_0 = "q.{joint}[0]", {joint}_0_rate = "v.{joint}[0]", ... }}'
        values.report.add(key, f"{shown(joint)} is a beam: signals name its elastic coordinates", hint)
    elif joint not in kinds:
        values.report.add(key, f"there is no joint {shown(joint)}", nearest(joint, kinds) or "a [joints] section")
    elif joint in before:
        values.report.add(key, f"the joint {joint} is named twice", "each joint once")
    elif VELOCITY_SIZE.get(kinds[joint], 1) != 1:
        size = VELOCITY_SIZE[kinds[joint]]
        count = f"{size} coordinates" if size else "no coordinates"
        hint = f'signals = {{ {joint}_0 = "q.{joint}[0]", ... }}' if size else "a moving joint"
        values.report.add(key, f"the {kinds[joint]} joint {joint} has {count}, not one", hint)


def _check_gains(key: str, entry: Written, count: int, values: Values) -> None:
    """Report gains of another number than there are outputs, and gains that are missing or given twice."""
    tables = [table for table in ("position_gains", "velocity_gains", "signal_gains") if getattr(entry, table) is not None]
    for table in tables:
        for name, gains in getattr(entry, table).items():
            if len(gains) != count:
                what = f"{len(gains)} gain{'s' * (len(gains) > 1)} given for {count} output{'s' * (count > 1)}"
                values.report.add(f"{key}.{table}.{key_of(name)}", what, "one gain for each output")
    if tables and entry.calibration is not None:
        values.report.add(f"{key}.{tables[0]}", "gains are given, and a calibration that would find them, too", "one of them")
    if not tables and entry.calibration is None:
        values.report.add(key, "a state_feedback needs gains or a calibration", f'[{key}.calibration] and method = "lqr"')
