"""Reading of prescribed motions: drives of joints and of constraints, lengths over time, with initial values."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from eomgen.errors import ModelError
from eomgen.formula.discontinuities import SmoothingError, smooth_law
from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import Formula
from eomgen.formula.prescribed_motion import constant
from eomgen.formula.recording import law_and_rate
from eomgen.scene.formula.scope import MOTION, PARAMETERS
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import UNKNOWN, Values
from eomgen.scene.signals.curves import check_twice_differentiable

if TYPE_CHECKING:
    from eomgen.scene.joints import schema as written

#: Hint for a curve that jumps or bends in a law.
SMOOTH_OR_SPLINE = 'interpolation = "quintic", or smooth = "10 ms" with the law'


def read_law(key: str, value: float | str, values: Values, smooth: float | None = None) -> Formula:
    """Return a prescribed motion, a formula of time, in which jumps and kinks of curves are smoothed or reported, so
    that the law has accelerations; ``UNKNOWN`` for a fault.

    Parameters
    ----------
    smooth : duration in s of the transition that replaces jumps and kinks; None: jumps and kinks are refused
    """
    formula = _without_jumps(key, values.formula(key, value, MOTION), values, smooth)
    check_twice_differentiable(key, [formula], values.report, SMOOTH_OR_SPLINE)
    return formula


def read_length(key: str, value: float | str, values: Values, smooth: float | None = None) -> Formula:
    """Return a length as a formula, m, constant or of time; ``UNKNOWN`` for a fault. The length has to be positive, at
    t = 0 if variable; a law over time is treated as by ``read_law``. Faults are reported."""
    formula = values.formula(key, value, MOTION)
    if formula is UNKNOWN:
        return formula
    if constant(formula):
        return values.formula(key, value, PARAMETERS)
    formula = _without_jumps(key, formula, values, smooth)
    check_twice_differentiable(key, [formula], values.report, SMOOTH_OR_SPLINE)
    length, _ = start_of(key, formula, values)
    if length < 0.0:
        values.report.add(key, f"the length is {length:.6g} m at t = 0, which is not positive [E1622]", "a length in m")
    return formula


def read_smoothing(key: str, smooth: float | str | None, law: str, values: Values) -> float | None:
    """Return the duration of the transitions of a law, s; None without the key ``smooth``, and for a refused value,
    which is reported.

    Parameters
    ----------
    law : the key that ``smooth`` needs, if missing; empty if the law is given
    """
    if smooth is None:
        return None
    smooth_key = f"{key}.smooth"
    if law:
        values.report.add(smooth_key, f"smooth needs a {law} over time [E1623]", f"no smooth, or a {law}")
        return None
    duration = values.constant(smooth_key, smooth)
    if math.isnan(duration):
        return None
    if not 0.0 < duration < math.inf:
        fault = f"the duration is {duration:.6g} s, and has to be positive [E1624]"
        values.report.add(smooth_key, fault, 'smooth = "10 ms"')
        return None
    return duration


def _without_jumps(key: str, formula: Formula, values: Values, smooth: float | None) -> Formula:
    if smooth is None or formula is UNKNOWN:
        return formula
    try:
        law = smooth_law(formula, smooth, values.fixed_number)
        if law == formula:
            values.notes.append(f"{key}: smooth has no effect, since the law has no jumps and no kinks [W0133]")
        return law
    except SmoothingError as error:
        values.report.add_error(key, error)
        return UNKNOWN


def refuse_start(key: str, joint: written.JointEntry, owner: str, hint: str, report: Report) -> None:
    """Report the keys of an initial state of a joint that starts as its drive or its leader says."""
    for field in ("position", "orientation", "rotation", "velocity"):
        if getattr(joint.initial, field) is not None:
            report.add(f"{key}.initial.{field}", f"{owner} has no initial state of its own [E1628]", hint)


def coordinate_keys(key: str, kind: str, entries: Sequence[object], report: Report) -> list[str]:
    """Return the dotted key of each coordinate's value for a joint of the type ``kind``; none, after a report, if the
    type has no coordinates, or not as many as values are given."""
    meanings = tuple(JOINTS[kind].coordinates)
    if has_coordinates(key, kind, report) and len(entries) != len(meanings):
        count = f"{len(meanings)} values ({', '.join(meanings)})" if len(meanings) > 1 else "one value"
        report.add(key, f"a {kind} joint needs {count} here, not {len(entries)} [E1644]")
    return _keys_of_each(key, len(entries)) if len(entries) == len(meanings) else []


def has_coordinates(key: str, kind: str, report: Report) -> bool:
    """Return whether a type of joint has coordinates with springs, limits and drives, else report the key."""
    if JOINTS[kind].coordinates:
        return True
    noun = key.rpartition(".")[2]
    report.add(key, f"a {kind} joint has no {noun} [E1650]", "a bushing, an effort or a force; or a revolute joint")
    return False


def _keys_of_each(key: str, count: int) -> list[str]:
    return [key] if count == 1 else [f"{key}[{number}]" for number in range(count)]


def read_drives(key: str, joint: written.JointEntry, values: Values) -> tuple[Formula, ...]:
    """Return the drives of a joint, formulas of time, one for each coordinate; empty without a drive, and for a type
    without coordinates or a wrong number of values. Faults are reported under the dotted ``key`` of the joint."""
    if joint.drive is None:
        read_smoothing(key, joint.smooth, "drive", values)
        return ()
    label = f"{key}.drive"
    keys = coordinate_keys(label, joint.type, joint.drive, values.report)
    if not keys:
        return ()
    if joint.mimic is not None:
        hint = f"the drive of {joint.mimic.joint}"
        values.report.add(label, "a joint that follows another cannot be driven [E1627]", hint)
    refuse_start(key, joint, "a driven joint", "no initial: it starts where its drive is at t = 0", values.report)
    smooth = read_smoothing(key, joint.smooth, "", values)
    noted = len(values.notes)
    laws = tuple(read_law(at, value, values, smooth) for at, value in zip(keys, joint.drive, strict=True))
    if len(values.notes) - noted < len(laws):  # a law was smoothed
        del values.notes[noted:]
    return laws


def driven_start(key: str, drives: Sequence[Formula], values: Values) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the initial position and velocity of a joint driven by the laws ``drives``, their values and rates at t =
    0, as two tuples with one number for each coordinate, rad or m and per s."""
    keys = _keys_of_each(f"{key}.drive", len(drives))
    starts = [start_of(at, law, values) for at, law in zip(keys, drives, strict=True)]
    return tuple(value for value, _ in starts), tuple(rate for _, rate in starts)


def start_of(key: str, law: Formula, values: Values) -> tuple[float, float]:
    """Return the value and the rate of a prescribed motion at t = 0 and default parameters; zeros for unknown laws or
    parameters, and after a report at ``key`` for a law that cannot be evaluated, a value that is not finite, or a rate
    of 1e25 or more."""
    named = {symbol.name for symbol in symbols(law) if symbol.kind == "parameter"}
    if law is UNKNOWN or not named <= values.parameters.keys():
        return 0.0, 0.0
    try:
        value, rate = (float(number[0]) for number in law_and_rate(law, values.parameters)(np.zeros(1)))
    except ModelError as error:
        values.report.add_error(key, error)
        return 0.0, 0.0
    if not (math.isfinite(value) and abs(rate) < 1e25):  # beyond: a complex step of 1e-30 near a pole or root
        fault = "the motion has no finite value and rate at t = 0 [E1629]"
        values.report.add(key, fault, "a law that begins at t = 0 or before")
        return 0.0, 0.0
    return (0.0 if abs(value) < 1e-50 else value), rate  # a remainder of the complex step
