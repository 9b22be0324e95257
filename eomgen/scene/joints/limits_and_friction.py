"""Reading of joint limits (compliant stops) and dry friction."""

from __future__ import annotations

from eomgen.formula.nodes import ZERO, Formula, Number
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints import schema as written
from eomgen.scene.joints.model import ONSETS, Friction, Stop
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values

Given = tuple[float | str | None, ...] | None


class _Coordinates:
    """Reads the keys of a joint that have a value for each coordinate."""

    def __init__(self, key: str, kind: str, values: Values) -> None:
        self.key, self.kind, self.values = key, kind, values
        self.meanings = tuple(JOINTS[kind].coordinates)

    def place(self, field: str, index: int) -> str:
        return f"{self.key}.{field}" if len(self.meanings) == 1 else f"{self.key}.{field}[{index}]"

    def counted(self, field: str, given: Given) -> Given:
        """Return the values if there is one for each coordinate; else None, which is reported."""
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

    def coefficients(self, field: str, given: Given) -> list[Formula]:
        entries = self.counted(field, given)
        if entries is None:
            return [ZERO] * len(self.meanings)
        return [
            self.values.formula(self.place(field, index), 0.0 if entry is None else entry, PARAMETERS)
            for index, entry in enumerate(entries)
        ]


def read_stops(key: str, joint: written.Joint, values: Values) -> tuple[Stop, ...]:
    """Return the stops of a joint: one for each coordinate that has a limit."""
    limits, key = joint.limits, f"{key}.limits"
    if limits is None or not _has_coordinates(key, joint, "limits", values):
        return ()
    each, units = _Coordinates(key, joint.type, values), tuple(JOINTS[joint.type].coordinates.values())
    lowers, uppers = each.bounds("lower", limits.lower), each.bounds("upper", limits.upper)
    if not values.report.concerns(key) and not any(bound is not None for bound in (*lowers, *uppers)):
        values.report.add(key, "limits need lower, upper or both", "lower = -1.0, upper = 1.0")
    stiffness, damping = each.coefficients("stiffness", limits.stiffness), each.coefficients("damping", limits.damping)
    onset = each.coefficients("onset", limits.onset)
    if limits.onset is None:
        onset = [Number(ONSETS[unit]) for unit in units]
    stops = []
    for index, (lower, upper) in enumerate(zip(lowers, uppers, strict=True)):
        if lower is not None and upper is not None:
            place = key if len(units) == 1 else f"{key}[{index}]"
            values.require(place, RELATIONS[f"limits in {units[index]}"], [lower, upper])
        if lower is not None or upper is not None:
            stops.append(Stop(index, lower, upper, stiffness[index], damping[index], onset[index]))
    return tuple(stops)


def read_friction(key: str, joint: written.Joint, values: Values) -> tuple[Friction, ...]:
    """Return the dry friction of a joint: one for each coordinate that has any."""
    friction, key = joint.friction, f"{key}.friction"
    if friction is None or not _has_coordinates(key, joint, "friction", values):
        return ()
    each = _Coordinates(key, joint.type, values)
    coulomb, velocity = each.coefficients("coulomb", friction.coulomb), each.coefficients("velocity", friction.velocity)
    if (friction.static is None) != (friction.stribeck is None):
        given, missing = ("static", "stribeck") if friction.stribeck is None else ("stribeck", "static")
        example = "0.05" if missing == "stribeck" else "the effort that breaks it loose"
        values.report.add(key, f"{given} needs {missing} beside it", f"{missing} = {example}")
    if friction.static is None or friction.stribeck is None:
        pairs = enumerate(zip(coulomb, velocity, strict=True))
        return tuple(Friction(index, *pair) for index, pair in pairs if pair[0] != ZERO)
    static, stribeck = each.coefficients("static", friction.static), each.coefficients("stribeck", friction.stribeck)
    result = [Friction(*parts) for parts in zip(range(len(coulomb)), coulomb, velocity, static, stribeck, strict=True)]
    for index, (level, slow, highest, speed) in enumerate(zip(coulomb, velocity, static, stribeck, strict=True)):
        if not values.report.concerns(key):
            values.require(each.place("static", index), RELATIONS["static friction"], [highest, level])
        if not values.report.concerns(key):
            values.require(each.place("stribeck", index), RELATIONS["Stribeck velocity"], [speed, slow])
    return tuple(result)


def _has_coordinates(key: str, joint: written.Joint, plural: str, values: Values) -> bool:
    result = bool(JOINTS[joint.type].coordinates)
    if not result:
        values.report.add(key, f"a {joint.type} joint has no {plural}", "a bushing, an effort or a force")
    return result
