"""Stops and dry friction of joints from the written form, and what is wrong with them."""

from __future__ import annotations

from collections.abc import Mapping

from eomgen.scene import schema_joints as written
from eomgen.scene.force_elements import Friction, Stop
from eomgen.scene.formula_nodes import Formula, Number
from eomgen.scene.formula_scope import PARAMETERS
from eomgen.scene.values import Values

#: Joints whose coordinates are plain numbers: the unit of each coordinate by its meaning.
COORDINATES: Mapping[str, Mapping[str, str]] = {
    "revolute": {"angle": "rad"}, "prismatic": {"travel": "m"}, "helical": {"angle": "rad"},
    "cylindrical": {"angle": "rad", "travel": "m"}, "universal": {"first angle": "rad", "second angle": "rad"},
    "planar": {"angle": "rad", "x": "m", "y": "m"},
}  # fmt: skip

#: Penetration over which a stop that says nothing about it reaches its full stiffness, by unit of the coordinate.
ONSETS: Mapping[str, float] = {"rad": 1e-3, "m": 1e-4}

Given = tuple[float | str | None, ...] | None


class _Coordinates:
    """Reads what belongs to each coordinate of a joint."""

    def __init__(self, key: str, kind: str, values: Values) -> None:
        self.key, self.kind, self.values = key, kind, values
        self.meanings = tuple(COORDINATES[kind])

    def place(self, field: str, index: int) -> str:
        return f"{self.key}.{field}" if len(self.meanings) == 1 else f"{self.key}.{field}[{index}]"

    def counted(self, field: str, given: Given) -> Given:
        """Return the values where there is one for each coordinate; else none, which is reported."""
        if given is None or len(given) == len(self.meanings):
            return given
        count = f"{len(self.meanings)} values ({', '.join(self.meanings)})" if len(self.meanings) > 1 else "one value"
        self.values.report.add(f"{self.key}.{field}", f"a {self.kind} joint needs {count} here, not {len(given)}", "")
        return None

    def bounds(self, field: str, given: Given) -> list[Formula | None]:
        entries = self.counted(field, given) or (None,) * len(self.meanings)
        return [
            None if entry is None else self.values.formula(self.place(field, index), entry, PARAMETERS)
            for index, entry in enumerate(entries)
        ]

    def positive(self, field: str, given: Given, what: str, *, default: float = 0.0, or_zero: bool = False) -> list[Formula]:
        entries = self.counted(field, given)
        if entries is None:
            return [Number(default)] * len(self.meanings)
        return [
            positive(self.place(field, index), default if entry is None else entry, what, self.values, or_zero=or_zero)
            for index, entry in enumerate(entries)
        ]


def read_stops(key: str, joint: written.Joint, values: Values) -> tuple[Stop, ...]:
    """Return the stops of a joint: one for each coordinate that has a limit."""
    limits, key = joint.limits, f"{key}.limits"
    if limits is None or not _has_coordinates(key, joint, "limits", values):
        return ()
    each, units = _Coordinates(key, joint.type, values), tuple(COORDINATES[joint.type].values())
    lowers, uppers = each.bounds("lower", limits.lower), each.bounds("upper", limits.upper)
    if not values.report.concerns(key) and not any(bound is not None for bound in (*lowers, *uppers)):
        values.report.add(key, "limits need lower, upper or both", "lower = -1.0, upper = 1.0")
    stiffness = each.positive("stiffness", limits.stiffness, "the stiffness of a stop")
    damping = each.positive("damping", limits.damping, "the damping of a stop", or_zero=True)
    onset = each.positive("onset", limits.onset, "the onset of a stop")
    if limits.onset is None:
        onset = [Number(ONSETS[unit]) for unit in units]
    stops = []
    for index, (lower, upper) in enumerate(zip(lowers, uppers, strict=True)):
        if lower is not None and upper is not None and values.value(lower) >= values.value(upper):
            place, unit = key if len(units) == 1 else f"{key}[{index}]", units[index]
            low, high = values.value(lower), values.value(upper)
            what = f"the lower limit {low:.6g} {unit} is not below the upper one, {high:.6g} {unit}"
            values.report.add(place, what, "lower below upper")
        if lower is not None or upper is not None:
            stops.append(Stop(index, lower, upper, stiffness[index], damping[index], onset[index]))
    return tuple(stops)


def read_friction(key: str, joint: written.Joint, values: Values) -> tuple[Friction, ...]:
    """Return the dry friction of a joint: one for each coordinate that has any."""
    friction, key = joint.friction, f"{key}.friction"
    if friction is None or not _has_coordinates(key, joint, "friction", values):
        return ()
    each = _Coordinates(key, joint.type, values)
    coulomb = each.positive("coulomb", friction.coulomb, "the Coulomb friction", or_zero=True)
    velocity = each.positive("velocity", friction.velocity, "the regularisation velocity")
    if (friction.static is None) != (friction.stribeck is None):
        given, missing = ("static", "stribeck") if friction.stribeck is None else ("stribeck", "static")
        example = "0.05" if missing == "stribeck" else "the effort that breaks it loose"
        values.report.add(key, f"{given} needs {missing} beside it", f"{missing} = {example}")
    if friction.static is None or friction.stribeck is None:
        pairs = enumerate(zip(coulomb, velocity, strict=True))
        return tuple(Friction(index, *pair) for index, pair in pairs if pair[0] != Number(0.0))
    static = each.positive("static", friction.static, "the static friction", or_zero=True)
    stribeck = each.positive("stribeck", friction.stribeck, "the Stribeck velocity")
    found = []
    for index, parts in enumerate(zip(coulomb, velocity, static, stribeck, strict=True)):
        level, slow, highest, speed = (values.value(part) for part in parts)
        if highest < level and not values.report.concerns(key):
            what = f"the static friction {highest:.6g} is below the Coulomb friction {level:.6g}"
            values.report.add(each.place("static", index), what, "static above coulomb")
        if speed <= slow and not values.report.concerns(key):
            what = f"the Stribeck velocity {speed:.6g} is not above the regularisation velocity {slow:.6g}"
            values.report.add(each.place("stribeck", index), what, "velocity = stribeck / 10")
        found.append(Friction(index, *parts))
    return tuple(found)


def _has_coordinates(key: str, joint: written.Joint, what: str, values: Values) -> bool:
    if joint.type not in COORDINATES:
        values.report.add(key, f"a {joint.type} joint has no {what}", "a bushing, an effort or a force")
    return joint.type in COORDINATES


def positive(key: str, value: float | str, what: str, values: Values, *, or_zero: bool = False) -> Formula:
    """Return a formula of parameters whose default is above zero, or zero where that is allowed too."""
    formula = values.formula(key, value, PARAMETERS)
    number = values.value(formula)
    if number < 0.0 or (number == 0.0 and not or_zero):
        wanted = "0 or more" if or_zero else "a number above 0"
        values.report.add(key, f"{what} is {number:.6g}", wanted)
    return formula
