"""The calibration of a state feedback as it is written: what each method takes, weights and numbers that can be."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from eomgen.scene.control.model import Calibration
from eomgen.scene.control.schema import Calibration as WrittenCalibration
from eomgen.scene.formula.scope import VELOCITY_SIZE
from eomgen.scene.reading.values import Values
from eomgen.text import key_of, nearest, shown

#: Keys of each method, besides method and at.
_TAKEN = {
    "lqr": ("position_weights", "velocity_weights", "signal_weights", "output_weights", "effort_weights"),
    "imsc": ("modes", "effort_weights"),
    "pole_placement": ("modes", "frequencies", "damping_ratios", "poles"),
}


def read_calibration(
    key: str, written: WrittenCalibration, signals: Collection[str], count: int, values: Values, outputs: Collection[str]
) -> Calibration:
    """Return a calibration; what is wrong with it is reported."""
    report, method = values.report, written.method
    for field in dict.fromkeys(field for fields in _TAKEN.values() for field in fields):
        if getattr(written, field) is not None and field not in _TAKEN[method]:
            kinds = " or ".join(kind for kind, fields in _TAKEN.items() if field in fields)
            report.add(f"{key}.{field}", f"{field} has no meaning for {method}", f"method = {kinds}")
    check_known(f"{key}.position_weights", written.position_weights, values.names.joints, "joint", values)
    check_known(f"{key}.velocity_weights", written.velocity_weights, values.names.joints, "joint", values)
    check_known(f"{key}.signal_weights", written.signal_weights, signals, "signal", values)
    check_known(f"{key}.output_weights", written.output_weights, outputs, "output", values)
    for table in ("position_weights", "velocity_weights"):
        for joint in getattr(written, table) or ():
            if VELOCITY_SIZE.get(values.names.joints.get(joint, ""), 1) != 1:
                what = f"the {values.names.joints[joint]} joint {joint} has not one coordinate"
                report.add(f"{key}.{table}.{key_of(joint)}", what, "an output, and its weight in output_weights")
    for table in ("position_weights", "velocity_weights", "signal_weights", "output_weights"):
        for name, weight in (getattr(written, table) or {}).items():
            if weight < 0.0:
                report.add(f"{key}.{table}.{key_of(name)}", f"the weight {weight:.6g} is negative", "0 or more")
    _check_lists(key, written, count, values)
    for place, (real, imaginary) in enumerate(written.poles or ()):
        if real >= 0.0:
            what = f"the pole [{real:g}, {imaginary:g}] does not decay: its real part is not below 0"
            report.add(f"{key}.poles[{place}]", what, f"[{-real or -1.0:g}, {imaginary:g}]")
    poles = tuple(complex(*pair) for pair in written.poles or ())
    return Calibration(
        method, written.at, written.position_weights or {}, written.velocity_weights or {}, written.signal_weights or {},
        written.output_weights or {}, written.effort_weights or (), written.modes or (), written.frequencies or (),
        written.damping_ratios or (), poles,
    )  # fmt: skip


def _check_lists(key: str, written: WrittenCalibration, count: int, values: Values) -> None:
    report, method = values.report, written.method
    chosen = len(written.modes) if written.modes else count
    efforts = (1, count) if method == "lqr" else (1, chosen)
    for field, numbers in (("effort_weights", efforts), ("frequencies", (chosen,)), ("damping_ratios", (1, chosen))):
        given = getattr(written, field)
        if given is not None and len(given) not in numbers:
            needed = " or ".join(map(str, dict.fromkeys(numbers)))
            of = ("output" if method == "lqr" else "mode") + "s" * (numbers[-1] > 1)
            what = f"{len(given)} number{'s' * (len(given) > 1)} given for {numbers[-1]} {of}"
            report.add(f"{key}.{field}", what, f"a list of {needed}")
        for place, number in enumerate(given or ()):
            allowed = number >= 0.0 if (method, field) == ("lqr", "effort_weights") else number > 0.0
            if not allowed:
                hint = "0 or more" if method == "lqr" else "a number above 0"
                report.add(f"{key}.{field}[{place}]", f"{field} of {number:.6g} cannot be", hint)
    if method == "imsc" and written.effort_weights is None:
        report.add(key, "imsc needs effort_weights", "effort_weights = 1e-3")
    if method == "pole_placement":
        if written.poles is not None and (written.modes or written.frequencies or written.damping_ratios):
            report.add(f"{key}.poles", "poles are given, and modes, frequencies or damping ratios too", "one of both ways")
        elif written.poles is None and written.damping_ratios is None:
            report.add(key, "pole_placement needs damping_ratios of modes, or poles", "damping_ratios = 0.3")


def check_known(key: str, table: Mapping[str, object] | None, known: Collection[str], what: str, values: Values) -> None:
    """Report the names in a table that there are not."""
    for name in table or ():
        if name in known:
            continue
        if what == "joint" and name in values.names.beams:
            hint = f'a signal "q.{name}[0]", or "v.{name}[0]", and its weight in signal_weights'
            values.report.add(f"{key}.{key_of(name)}", f"{shown(name)} is a beam, not a joint", hint)
        else:
            hint = nearest(name, known) or f"without {key.rpartition('.')[2]}"
            values.report.add(f"{key}.{key_of(name)}", f"there is no {what} {shown(name)}", hint)
