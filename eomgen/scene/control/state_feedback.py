"""State feedback: its signals, and one tunable gain parameter for each output and signal."""

from __future__ import annotations

import functools
import operator
from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING

from eomgen.base.data import dataclass
from eomgen.base.messages import NAME_RULE, is_legal, key_of, nearest, shown
from eomgen.formula.nodes import Formula, Symbol
from eomgen.scene.control.model import Calibration, StateFeedback
from eomgen.scene.formula.scope import STATE
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.values import Values, percent_of_critical
from eomgen.system.signals import Parameter

if TYPE_CHECKING:
    from eomgen.scene.control.schema import CalibrationEntry as WrittenCalibration
    from eomgen.scene.control.schema import ControllerEntry as Written


@dataclass(frozen=True)
class FeedbackNames:
    """Names of outputs and parameters that a state feedback adds to a scene.

    Attributes
    ----------
    outputs : of the controllers of the feedback.
    gains : of parameters, by output, in the order of signals.
    references : of parameters, by signal; empty for velocities, if the user gives the reference, and without a
        calibration.
    """

    outputs: tuple[str, ...]
    gains: tuple[tuple[str, ...], ...]
    references: tuple[str, ...]

    @property
    def parameters(self) -> tuple[str, ...]:
        return (*(name for row in self.gains for name in row), *filter(None, self.references))


@dataclass(frozen=True)
class _Quantity:
    """A quantity that a state feedback feeds back.

    Attributes
    ----------
    label : text of the quantity
    gain : name of the parameter of its gain, after the name of an output
    gains : as given, by output; empty if not given
    reference : name of the parameter of its reference, after the name of the feedback; empty for velocities
    entry_key : key of the reference in the entry; empty for velocities
    setpoint : reference as given, a number or a text; None if not given, and for velocities
    """

    label: str
    gain: str
    gains: Sequence[float]
    reference: str = ""
    entry_key: str = ""
    setpoint: float | str | None = None


def _quantities(entry: Written) -> list[_Quantity]:
    """Return the quantities that a state feedback feeds back, in this order: coordinates, their velocities, signals.

    Gains and references are as given: gains are empty, and the reference is None, if the user gives none. Velocities
    have no reference: ``reference`` and ``entry_key`` are empty.
    """
    coordinates, signals = entry.coordinates or (), entry.signals or {}
    positions, velocities, others = entry.position_gains or {}, entry.velocity_gains or {}, entry.signal_gains or {}
    of_positions, of_signals = entry.position_references or {}, entry.signal_references or {}
    result = []
    for name in coordinates:
        reference, entry_key = f"position_reference_{name}", f"position_references.{key_of(name)}"
        gain, gains = f"position_gain_{name}", positions.get(name, ())
        result.append(_Quantity(f"q.{name}", gain, gains, reference, entry_key, of_positions.get(name)))
    result += [_Quantity(f"v.{name}", f"velocity_gain_{name}", velocities.get(name, ())) for name in coordinates]
    for name in signals:
        reference, entry_key = f"reference_{name}", f"signal_references.{key_of(name)}"
        result.append(_Quantity(name, f"gain_{name}", others.get(name, ()), reference, entry_key, of_signals.get(name)))
    return result


def feedback_names(name: str, entry: Written) -> FeedbackNames:
    """Return the names of outputs and parameters that the controller ``name``, of type ``state_feedback``, adds to a
    scene."""
    outputs, parts = tuple(f"{name}_{output}" for output in entry.outputs or ()) or (name,), _quantities(entry)
    gains = tuple(tuple(f"{output}_{part.gain}" for part in parts) for output in outputs)
    open_ones = [part.reference if entry.calibration is not None and part.setpoint is None else "" for part in parts]
    return FeedbackNames(outputs, gains, tuple(f"{name}_{reference}" if reference else "" for reference in open_ones))


def parameters_of(name: str, entry: Written) -> list[Parameter]:
    """Return the tunable parameters of a state feedback: gains row by row of outputs, with the user's values or 0, then
    references that a calibration fills, 0 until then. Without a calibration there are no such references.
    """
    made, parts = feedback_names(name, entry), _quantities(entry)
    result = []
    for row, (output, gains) in enumerate(zip(made.outputs, made.gains, strict=True)):
        for parameter, part in zip(gains, parts, strict=True):
            value = part.gains[row] if row < len(part.gains) else 0.0
            result.append(Parameter(parameter, value, True, "", f"gain of {part.label} in {output}"))
    for parameter, part in zip(made.references, parts, strict=True):
        if parameter:
            result.append(Parameter(parameter, 0.0, True, "", f"{part.label} where {name} gives nothing"))
    return result


def read_state_feedback(
    name: str, entry: Written, values: Values, outputs: Collection[str]
) -> tuple[list[Formula], StateFeedback]:
    """Return the formula of each output of a state feedback without limits, -G (y - y_ref), and the record of the
    feedback; faults are reported. ``outputs`` are the names of the scene's outputs, for weights of a calibration."""
    key = key_of("controllers", name)
    coordinates, signals = entry.coordinates or (), entry.signals or {}
    _check_names(key, name, entry, values)
    made, parts = feedback_names(name, entry), _quantities(entry)
    _check_gains(key, entry, len(made.outputs), values)
    measured = [Symbol("q", joint) for joint in coordinates] + [Symbol("v", joint) for joint in coordinates]
    measured += [values.formula(f"{key}.signals.{key_of(signal)}", text, STATE) for signal, text in signals.items()]  # type: ignore[misc]
    each = zip(parts, measured, made.references, strict=True)
    deviations = []
    for part, formula, parameter in each:
        reference: Formula | None = Symbol("parameter", parameter) if parameter else None
        if part.setpoint is not None:
            reference = values.formula(f"{key}.{part.entry_key}", part.setpoint, STATE)
        deviations.append(formula if reference is None else formula - reference)
    free = []
    for gains in made.gains:
        products = [Symbol("parameter", gain) * part for gain, part in zip(gains, deviations, strict=True)]
        free.append(-(functools.reduce(operator.add, products) if products else Symbol("time")))
    table, count = entry.calibration, len(made.outputs)
    calibration = read_calibration(f"{key}.calibration", table, signals, count, values, outputs) if table else None
    labels = tuple(part.label for part in parts)
    return free, StateFeedback(name, made.outputs, tuple(measured), labels, made.gains, made.references, calibration)


def _check_names(key: str, name: str, entry: Written, values: Values) -> None:
    """Report names of coordinates, signals and outputs that are unknown, not legal or given twice."""
    report = values.report
    coordinates, signals = entry.coordinates or (), entry.signals or {}
    if not coordinates and not signals:
        report.add(key, "a state_feedback needs coordinates or signals [E1429]", 'coordinates = ["joint"]')
    for number, joint in enumerate(coordinates):
        _check_coordinate(f"{key}.coordinates[{number}]", joint, coordinates[:number], values)
    for signal in signals:
        if not is_legal(signal):
            report.add(f"{key}.signals.{key_of(signal)}", f"the name {shown(signal)} is not legal [E0715]", NAME_RULE)
    for number, output in enumerate(entry.outputs or ()):
        if output in (entry.outputs or ())[:number]:
            report.add(f"{key}.outputs[{number}]", f"the output {output} is named twice [E1430]", "each output once")
    if entry.outputs == ():
        fault = "the list of outputs is empty [E1431]"
        report.add(f"{key}.outputs", fault, f"no outputs: then there is one, called {name}")
    for table in ("position_gains", "velocity_gains", "position_references"):
        check_known(f"{key}.{table}", getattr(entry, table), coordinates, f"coordinate of {name}", values)
    for table in ("signal_gains", "signal_references"):
        check_known(f"{key}.{table}", getattr(entry, table), signals, f"signal of {name}", values)


def _check_coordinate(key: str, joint: str, before: Sequence[str], values: Values) -> None:
    kinds = values.names.joints
    if joint in values.names.beams:
        hint = f'signals = {{ {joint}_0 = "q.{joint}[0]", {joint}_0_rate = "v.{joint}[0]", ... }}'
        values.report.add(key, f"{shown(joint)} is a beam: signals name its elastic coordinates [E1432]", hint)
    elif joint not in kinds:
        fault = f"there is no joint {shown(joint)} [E1433]"
        values.report.add(key, fault, nearest(joint, kinds) or "a [joints] section")
    elif joint in before:
        values.report.add(key, f"the joint {joint} is named twice [E1434]", "each joint once")
    elif kinds[joint] and (size := JOINTS[kinds[joint]].v_size) != 1:
        count = f"{size} coordinates" if size else "no coordinates"
        hint = f'signals = {{ {joint}_0 = "q.{joint}[0]", ... }}' if size else "a moving joint"
        values.report.add(key, f"the {kinds[joint]} joint {joint} has {count}, not one [E1435]", hint)


def _check_gains(key: str, entry: Written, count: int, values: Values) -> None:
    """Report lists of gains with another length than ``count``, the number of outputs, gains next to a calibration, and
    neither of both."""
    tables = [
        table for table in ("position_gains", "velocity_gains", "signal_gains") if getattr(entry, table) is not None
    ]
    for table in tables:
        for name, gains in getattr(entry, table).items():
            if len(gains) != count:
                fault = f"{len(gains)} gain{'s' * (len(gains) > 1)} given for {count} output{'s' * (count > 1)} [E1436]"
                values.report.add(f"{key}.{table}.{key_of(name)}", fault, "one gain for each output")
    if tables and entry.calibration is not None:
        fault = "gains are given, and a calibration that would find them, too [E1437]"
        values.report.add(f"{key}.{tables[0]}", fault, "one of them")
    if not tables and entry.calibration is None:
        fault = "a state_feedback needs gains or a calibration [E1438]"
        values.report.add(key, fault, f'[{key}.calibration] and method = "lqr"')


#: Keys of each method, besides method and at; needed keys with an example.
_TAKEN = {
    "lqr": "position_weights velocity_weights signal_weights output_weights effort_weights",
    "imsc": "modes effort_weights=1e-3",
    "pole_placement": "modes frequencies damping_ratios poles",
}


def read_calibration(
    key: str,
    written: WrittenCalibration,
    signals: Collection[str],
    count: int,
    values: Values,
    outputs: Collection[str],
) -> Calibration:
    """Return the calibration of a state feedback; faults are reported under the dotted ``key``. ``signals`` and
    ``outputs`` are names that weights may have, ``count`` is the number of the feedback's outputs."""
    report = values.report
    values.check_kind(key, written, "method", _TAKEN)
    _check_weights(key, written, signals, outputs, values)
    _check_lists(key, written, count, values)
    for index, (real, imaginary) in enumerate(written.poles or ()):
        if real >= 0.0:
            fault = f"the pole [{real:g}, {imaginary:g}] does not decay: its real part is not below 0 [E1439]"
            report.add(f"{key}.poles[{index}]", fault, f"[{-real or -1.0:g}, {imaginary:g}]")
    poles = tuple(complex(*pair) for pair in written.poles or ())
    return Calibration(**values.keys(key, written) | {"poles": poles})


def _check_weights(
    key: str, written: WrittenCalibration, signals: Collection[str], outputs: Collection[str], values: Values
) -> None:
    """Report weights of unknown joints, signals and outputs, of joints with several coordinates, and below zero."""
    joints = values.names.joints
    known: tuple[tuple[str, str, Collection[str]], ...] = (
        ("position_weights", "joint", joints),
        ("velocity_weights", "joint", joints),
        ("signal_weights", "signal", signals),
        ("output_weights", "output", outputs),
    )
    for table, noun, names in known:
        check_known(f"{key}.{table}", getattr(written, table), names, noun, values)
    for table in ("position_weights", "velocity_weights"):
        for joint in getattr(written, table) or ():
            kind = joints.get(joint, "")
            if kind and JOINTS[kind].v_size != 1:
                fault = f"the {kind} joint {joint} has not one coordinate [E1440]"
                hint = "an output, and its weight in output_weights"
                values.report.add(f"{key}.{table}.{key_of(joint)}", fault, hint)
    for table, _, _ in known:
        for name, weight in (getattr(written, table) or {}).items():
            if weight < 0.0:
                fault = f"the weight {weight:.6g} is negative [E1441]"
                values.report.add(f"{key}.{table}.{key_of(name)}", fault, "0 or more")


def _check_lists(key: str, written: WrittenCalibration, count: int, values: Values) -> None:
    """Report weights of efforts, frequencies and damping ratios whose number does not fit the outputs, ``count``, or
    the chosen modes, or whose sign is wrong, and lists that the method lacks."""
    report, method = values.report, written.method
    chosen = len(written.modes) if written.modes else count
    efforts = (1, count) if method == "lqr" else (1, chosen)
    for field, numbers in (("effort_weights", efforts), ("frequencies", (chosen,)), ("damping_ratios", (1, chosen))):
        weights = getattr(written, field)
        if weights is not None and len(weights) not in numbers:
            needed = " or ".join(map(str, dict.fromkeys(numbers)))
            of = ("output" if method == "lqr" else "mode") + "s" * (numbers[-1] > 1)
            fault = f"{len(weights)} number{'s' * (len(weights) > 1)} given for {numbers[-1]} {of} [E1442]"
            report.add(f"{key}.{field}", fault, f"a list of {needed}")
        for index, number in enumerate(weights or ()):
            allowed = number >= 0.0 if (method, field) == ("lqr", "effort_weights") else number > 0.0
            if not allowed:
                hint = "0 or more" if method == "lqr" else "a number above 0"
                report.add(f"{key}.{field}[{index}]", f"{field} of {number:.6g} is not allowed [E1444]", hint)
            elif field == "damping_ratios" and (note := percent_of_critical(number)):
                values.notes.append(f"{key}.{field}[{index}]: {note} [W0098]")
    if method == "pole_placement":
        if written.poles is not None and any((written.modes, written.frequencies, written.damping_ratios)):
            fault = "poles are given, and modes, frequencies or damping ratios too [E1447]"
            report.add(f"{key}.poles", fault, "one of both ways")
        elif written.poles is None and written.damping_ratios is None:
            report.add(key, "pole_placement needs damping_ratios of modes, or poles [E1448]", "damping_ratios = 0.3")


def check_known(key: str, table: Iterable[str] | None, known: Collection[str], kind: str, values: Values) -> None:
    """Report names in ``table``, if there is one, that are not in ``known``, with the nearest name; ``kind`` is the
    noun for the names."""
    for name in table or ():
        if name in known:
            continue
        if kind == "joint" and name in values.names.beams:
            hint = f'a signal "q.{name}[0]", or "v.{name}[0]", and its weight in signal_weights'
            values.report.add(f"{key}.{key_of(name)}", f"{shown(name)} is a beam, not a joint [E1449]", hint)
        else:
            hint = nearest(name, known) or f"without {key.rpartition('.')[2]}"
            values.report.add(f"{key}.{key_of(name)}", f"there is no {kind} {shown(name)} [E0100]", hint)
