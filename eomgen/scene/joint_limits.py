"""Stops and dry friction of joints from the written form, and what is wrong with them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from eomgen.scene import schema as written
from eomgen.scene.force_elements import Friction, Stop
from eomgen.scene.formula_nodes import Formula
from eomgen.scene.formula_scope import PARAMETERS
from eomgen.scene.names import key_of
from eomgen.scene.report import Report
from eomgen.scene.scene import Joint
from eomgen.scene.values import Values

#: Unit of the coordinate of the types that can have stops and friction.
UNITS: Mapping[str, str] = {"revolute": "rad", "prismatic": "m", "helical": "rad"}

#: Penetration over which a stop that says nothing about it reaches its full stiffness, by unit of the coordinate.
ONSETS: Mapping[str, float] = {"rad": 1e-3, "m": 1e-4}


def read_stops(key: str, joint: written.Joint, values: Values) -> tuple[Stop, ...]:
    """Return the stops of a joint."""
    limits, key = joint.limits, f"{key}.limits"
    if limits is None or not _has_coordinate(key, joint, "limits", values):
        return ()
    unit = UNITS[joint.type]
    bounds = {name: getattr(limits, name) for name in ("lower", "upper")}
    if all(bound is None for bound in bounds.values()):
        values.report.add(key, "limits need lower, upper or both", "lower = -1.0, upper = 1.0")
    formulas = {
        name: None if bound is None else values.formula(f"{key}.{name}", bound, PARAMETERS) for name, bound in bounds.items()
    }
    lower, upper = formulas["lower"], formulas["upper"]
    if lower is not None and upper is not None and values.value(lower) >= values.value(upper):
        what = f"the lower limit {values.value(lower):.6g} {unit} is not below the upper one, {values.value(upper):.6g} {unit}"
        values.report.add(key, what, "lower below upper")
    onset = ONSETS[unit] if limits.onset is None else limits.onset
    return (
        Stop(
            index=0,
            lower=lower,
            upper=upper,
            stiffness=positive(f"{key}.stiffness", limits.stiffness, "the stiffness of a stop", values),
            damping=positive(f"{key}.damping", limits.damping, "the damping of a stop", values, or_zero=True),
            onset=positive(f"{key}.onset", onset, "the onset of a stop", values),
        ),
    )


def read_friction(key: str, joint: written.Joint, values: Values) -> tuple[Friction, ...]:
    """Return the dry friction of a joint."""
    friction, key = joint.friction, f"{key}.friction"
    if friction is None or not _has_coordinate(key, joint, "friction", values):
        return ()
    coulomb = positive(f"{key}.coulomb", friction.coulomb, "the Coulomb friction", values, or_zero=True)
    velocity = positive(f"{key}.velocity", friction.velocity, "the regularisation velocity", values)
    if (friction.static is None) != (friction.stribeck is None):
        given, missing = ("static", "stribeck") if friction.stribeck is None else ("stribeck", "static")
        example = "0.05" if missing == "stribeck" else "the effort that breaks it loose"
        values.report.add(key, f"{given} needs {missing} beside it", f"{missing} = {example}")
    if friction.static is None or friction.stribeck is None:
        return (Friction(0, coulomb, velocity),)
    static = positive(f"{key}.static", friction.static, "the static friction", values, or_zero=True)
    stribeck = positive(f"{key}.stribeck", friction.stribeck, "the Stribeck velocity", values)
    if values.value(static) < values.value(coulomb):
        what = f"the static friction {values.value(static):.6g} is below the Coulomb friction {values.value(coulomb):.6g}"
        values.report.add(f"{key}.static", what, "static above coulomb")
    if values.value(stribeck) <= values.value(velocity):
        what = f"the Stribeck velocity {values.value(stribeck):.6g} is not above the regularisation velocity"
        values.report.add(f"{key}.stribeck", f"{what} {values.value(velocity):.6g}", "velocity = stribeck / 10")
    return (Friction(0, coulomb, velocity, static, stribeck),)


def _has_coordinate(key: str, joint: written.Joint, what: str, values: Values) -> bool:
    if joint.type not in UNITS:
        values.report.add(key, f"a {joint.type} joint has no {what}", "a bushing, an effort or a force")
    return joint.type in UNITS


def positive(key: str, value: float | str, what: str, values: Values, *, or_zero: bool = False) -> Formula:
    """Return a formula of parameters whose default is above zero, or zero where that is allowed too."""
    formula = values.formula(key, value, PARAMETERS)
    number = values.value(formula)
    if number < 0.0 or (number == 0.0 and not or_zero):
        wanted = "0 or more" if or_zero else "a number above 0"
        values.report.add(key, f"{what} is {number:.6g}", wanted)
    return formula


def check_within_half_a_turn(joints: Iterable[Joint], values: Values, report: Report) -> None:
    """Report limits of angles that absolute coordinates cannot see: they measure within half a turn."""
    for joint in joints:
        for stop in joint.stops:
            for name, bound in (("lower", stop.lower), ("upper", stop.upper)):
                number = values.value(bound) if bound is not None else 0.0
                if joint.type == "revolute" and abs(number) >= math.pi:
                    what = f"absolute coordinates measure angles within half a turn, and {number:.6g} rad is beyond"
                    hint = "a limit between -pi and pi, or joint coordinates"
                    report.add(key_of("joints", joint.name, "limits", name), what, hint)
