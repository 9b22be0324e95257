"""Reading of joints: keys permitted for each type, placement, axes, initial positions and velocities (orientations,
angular velocities), limits (compliant stops), dry friction and mimic joints; and reading of reactions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from eomgen.base.messages import key_of, shown
from eomgen.base.rounding import WRITTEN
from eomgen.formula.nodes import ZERO, Formula, Number
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.drives import coordinate_keys, driven_start, has_coordinates, read_drives, refuse_start
from eomgen.scene.joints.model import (
    ONSETS,
    Coefficients,
    Friction,
    Joint,
    Mimic,
    Reaction,
    Stop,
)
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import Values, read_orientation
from eomgen.scene.rotations import frame_about, quaternion_of, rows
from eomgen.system.description import BASE, WORLD, Point, WrittenStart

if TYPE_CHECKING:
    from eomgen.scene.joints import schema as written
    from eomgen.scene.joints.constraint_schema import ReactionEntry as WrittenReaction
    from eomgen.scene.section import Reading

Given = tuple[float | str | None, ...] | None


def _formulas(key: str, kind: str, entries: Given, values: Values, missing: Sequence[Formula | None] = ()) -> list[Any]:
    """Return a joint's formula of parameters for each coordinate, from a key's values, else from ``missing``, zeros by
    default; a wrong number of values is reported."""
    keys = [] if entries is None else coordinate_keys(key, kind, entries, values.report)
    missing = missing or [ZERO] * len(JOINTS[kind].coordinates)
    if entries is None or not keys:
        return list(missing)
    return [
        default if entry is None else values.formula(at, entry, PARAMETERS)
        for at, entry, default in zip(keys, entries, missing, strict=True)
    ]


def read_stops(key: str, joint: written.JointEntry, values: Values) -> tuple[Stop, ...]:
    """Return the stops of a joint, one for each coordinate with a lower or an upper limit; empty without limits. Faults
    are reported under the dotted ``key`` of the joint."""
    limits, key = joint.limits, f"{key}.limits"
    if limits is None or not has_coordinates(key, joint.type, values.report):
        return ()
    units = tuple(JOINTS[joint.type].coordinates.values())
    none, onsets = [None] * len(units), [Number(ONSETS[unit]) for unit in units]
    lowers, uppers = (
        _formulas(f"{key}.{end}", joint.type, getattr(limits, end), values, none) for end in ("lower", "upper")
    )
    if not values.report.concerns(key) and not any(bound is not None for bound in (*lowers, *uppers)):
        values.report.add(key, "limits need lower, upper or both [E1645]", "lower = -1.0, upper = 1.0")
    stiffness = _formulas(f"{key}.stiffness", joint.type, limits.stiffness, values)
    damping = _formulas(f"{key}.damping", joint.type, limits.damping, values)
    onset = _formulas(f"{key}.onset", joint.type, limits.onset, values, onsets)
    stops = []
    for index, (lower, upper) in enumerate(zip(lowers, uppers, strict=True)):
        if lower is not None and upper is not None:
            stop_key = key if len(units) == 1 else f"{key}[{index}]"
            values.require(stop_key, RELATIONS[f"limits in {units[index]}"], [lower, upper])
        if lower is not None or upper is not None:
            stops.append(Stop(index, lower, upper, stiffness[index], damping[index], onset[index]))
    return tuple(stops)


#: Relations of two levels and of two speeds of friction.
_RELATIONS = {"static": "static friction", "stribeck": "Stribeck velocity"}


def read_friction(key: str, joint: written.JointEntry, values: Values) -> tuple[Friction, ...]:
    """Return the dry friction of a joint: one for each coordinate, without static friction only for coordinates whose
    level is not zero; empty without friction. Faults are reported under the dotted ``key`` of the joint."""
    friction, key = joint.friction, f"{key}.friction"
    if friction is None or not has_coordinates(key, joint.type, values.report):
        return ()
    fields = ("coulomb", "velocity", "static", "stribeck")
    parts = {name: _formulas(f"{key}.{name}", joint.type, getattr(friction, name), values) for name in fields}
    if (friction.static is None) != (friction.stribeck is None):
        field, missing = ("static", "stribeck") if friction.stribeck is None else ("stribeck", "static")
        example = "0.05" if missing == "stribeck" else "the effort that breaks it loose"
        values.report.add(key, f"{field} also needs {missing} [E1647]", f"{missing} = {example}")
    if friction.static is None or friction.stribeck is None:
        pairs = enumerate(zip(parts["coulomb"], parts["velocity"], strict=True))
        return tuple(Friction(index, *pair) for index, pair in pairs if pair[0] != ZERO)
    result = [Friction(index, *row) for index, row in enumerate(zip(*parts.values(), strict=True))]
    for row in result:
        at = f"[{row.index}]" if len(result) > 1 else ""
        for name, lower_bound in (("static", "coulomb"), ("stribeck", "velocity")):
            if not values.report.concerns(key):
                pair = [getattr(row, name), getattr(row, lower_bound)]
                values.require(f"{key}.{name}{at}", RELATIONS[_RELATIONS[name]], pair)
    return tuple(result)


Direction = tuple[float, float, float]
_NEUTRAL = (1.0, 0.0, 0.0, 0.0)
#: Meaning of the velocity, by group.
_VELOCITY_MEANING = {"SO3": " (angular velocity, body axes)", "SE3": " (angular, then linear velocity, body axes)"}
_COEFFICIENTS = ("stiffness", "damping", "rest", "rotor_inertia")


def read_joint(name: str, joint: written.JointEntry, values: Values) -> Joint:
    """Return the joint of an entry of [joints], placed as written, also in another frame than the parent's; faults go
    to the report of ``values``."""
    key = key_of("joints", name)
    axis, second = _axes(key, joint, values)
    coefficients: dict[str, Any] = {field: _coefficients(key, field, joint, values) for field in _COEFFICIENTS}
    drive = read_drives(key, joint, values)
    start, speed = driven_start(key, drive, values)
    return Joint(
        name=name,
        type=joint.type,
        parent=joint.parent,
        child=joint.child,
        axis=axis,
        second_axis=second,
        **values.keys(key, joint, "pitch", "position"),
        orientation=read_orientation(key, joint.rotation, joint.orientation, values),
        initial_position=start if drive else _initial_position(key, joint, values),
        initial_velocity=speed if drive else _initial_velocity(key, joint, values),
        start=_written_start(name, joint, values),
        stops=read_stops(key, joint, values),
        friction=read_friction(key, joint, values),
        mimic=_mimic(key, joint, values),
        drive=drive,
        **coefficients,
    )


def _axes(key: str, joint: written.JointEntry, values: Values) -> tuple[Direction, Direction]:
    """Return the unit axis and the unit orthogonal second axis, as given or by the default of the type: z and x for
    types without an axis, and after a fault, which is reported."""
    report, kind = values.report, JOINTS[joint.type]
    if kind.coordinates and joint.axis is None:
        report.add(key, f"a {joint.type} joint needs an axis [E1652]", "axis = [0, 0, 1]")
    elif not kind.coordinates and joint.axis is not None:
        report.add(f"{key}.axis", f"a {joint.type} joint has no axis [E1653]", "rotation, for its placement")
    values.check_kind(key, joint, "type", {row.name: row.joint_keys for row in (*JOINTS.values(), kind)})
    neutral = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    axis = None if joint.axis is None or not kind.coordinates else values.axis(f"{key}.axis", joint.axis)
    if axis is None:
        return neutral
    field, required = kind.second_key or "x_axis", kind.second_key == "second_axis"
    written_second = getattr(joint, field)
    second = None if written_second is None else values.axis(f"{key}.{field}", written_second)
    if second is not None and required and abs(float(axis @ second)) > WRITTEN:
        included = math.degrees(math.acos(min(1.0, max(-1.0, float(axis @ second)))))
        fault = f"the axes of a {joint.type} joint are perpendicular, and these include {included:.6g} degrees [E1656]"
        hint = "second_axis across axis, or two revolute joints with a body in between"
        report.add(f"{key}.second_axis", fault, hint)
        return neutral
    if second is not None and abs(float(axis @ second)) > 1.0 - WRITTEN:
        report.add(f"{key}.{field}", f"{field} is parallel to axis [E1657]", "a direction across it")
        return neutral
    x, _, z = rows(frame_about(axis, second).T)
    return z, x


def _coefficients(key: str, field: str, joint: written.JointEntry, values: Values) -> Coefficients:
    """Return the coefficient ``field`` of a joint, such as stiffness: a tuple with a formula for each coordinate, a
    single formula for one coordinate; zero without the key, and after a reported fault."""
    parts: tuple[float | str, ...] | None = getattr(joint, field)
    formulas = () if parts is None else tuple(_formulas(f"{key}.{field}", joint.type, parts, values))
    return formulas if len(formulas) > 1 else next(iter(formulas), ZERO)


def _mimic(key: str, joint: written.JointEntry, values: Values) -> Mimic | None:
    if joint.mimic is None:
        return None
    if (size := JOINTS[joint.type].v_size) != 1:
        fault = f"a {joint.type} joint cannot follow another: it has {size or 'no'} coordinates [E1662]"
        values.report.add(f"{key}.mimic", fault, "a joint with one coordinate")
    hint = f"the initial state of {shown(joint.mimic.joint)}"
    refuse_start(key, joint, "a joint that follows another", hint, values.report)
    return Mimic(**values.keys(f"{key}.mimic", joint.mimic))


def _numbers(
    key: str, entries: Sequence[float | str] | None, count: int, quantity: str, values: Values
) -> list[float] | None:
    """Return ``count`` numbers of fixed parameters; None if not given, for another count, which is reported, or if
    unknown."""
    if entries is None:
        return None
    if len(entries) != count:
        values.report.add(key, f"{quantity} needs {count} number{'s' * (count != 1)}, not {len(entries)} [E1664]", "")
        return None
    numbers = values.constants(key, entries)
    return None if any(math.isnan(number) for number in numbers) else numbers


def _initial_position(key: str, joint: written.JointEntry, values: Values) -> tuple[float, ...]:
    """Return the initial coordinates q of a joint, for SO3 a quaternion (w, x, y, z), for SE3 quaternion and position;
    neutral without an entry, and after a fault, which is reported."""
    initial, table, kind = joint.initial, f"{key}.initial", JOINTS[joint.type]
    for field in ("orientation", "rotation", "position"):
        if getattr(initial, field) is not None and field not in kind.starts:
            hint = "" if field == "position" else "position"
            values.report.add(f"{table}.{field}", f"a {joint.type} joint has no initial {field} [E1665]", hint)
    if not kind.moves:
        return ()
    if kind.group == "R":
        numbers = _numbers(f"{table}.position", initial.position, kind.q_size, f"a {joint.type} joint", values)
        return tuple(numbers or [0.0] * kind.q_size)
    if kind.group == "SO3":
        return _quaternion(table, "position", initial.position, initial, values)
    position = (
        _numbers(f"{table}.position", initial.position, 3, f"the position of a {joint.type} joint", values) or [0.0] * 3
    )
    return (*_quaternion(table, "orientation", initial.orientation, initial, values), *position)


def _quaternion(
    key: str, field: str, entries: Sequence[float | str] | None, initial: written.Initial, values: Values
) -> tuple[float, ...]:
    """Return the initial orientation as a unit quaternion (w, x, y, z), from ``entries`` of the key ``field``,
    or from rotations; the identity without both, and after a fault, which is reported under ``key``."""
    if initial.rotation is not None:
        if entries is not None:
            fault = f"{field} and rotation both give the orientation [E1666]"
            values.report.add(f"{key}.rotation", fault, "one of them")
        return quaternion_of(values.constant_rotations(f"{key}.rotation", initial.rotation) or [])
    numbers = _numbers(f"{key}.{field}", entries, 4, "a quaternion (w, x, y, z)", values)
    if numbers is None:
        return _NEUTRAL
    norm = math.sqrt(sum(number * number for number in numbers))
    if abs(norm - 1.0) > WRITTEN:
        unit = ", ".join(f"{number / norm:.9g}" for number in numbers) if 0.0 < norm < math.inf else "1, 0, 0, 0"
        values.report.add(f"{key}.{field}", f"the quaternion has norm {norm:.6g}, not 1 [E1667]", f"[{unit}]")
        return _NEUTRAL
    return tuple(number / norm for number in numbers)


def _initial_velocity(key: str, joint: written.JointEntry, values: Values) -> tuple[float, ...]:
    kind = JOINTS[joint.type]
    size, quantity = kind.v_size, f"the velocity of a {joint.type} joint{_VELOCITY_MEANING.get(kind.group, '')}"
    return tuple(_numbers(f"{key}.initial.velocity", joint.initial.velocity, size, quantity, values) or [0.0] * size)


def _written_start(name: str, joint: written.JointEntry, values: Values) -> WrittenStart | None:
    """Return a record of an initial state as written: whether position and velocity are given, and whether these are
    held; None if neither is given. Holding without both is reported."""
    initial = joint.initial
    position = any(getattr(initial, field) is not None for field in ("position", "orientation", "rotation"))
    velocity = initial.velocity is not None
    if initial.hold and not (position or velocity):
        fault = "no position or velocity is given that could be held [E2214]"
        values.report.add(f"{key_of('joints', name)}.initial.hold", fault, "a position or a velocity with it")
    return WrittenStart(name, position, velocity, initial.hold) if position or velocity else None


def read_reaction(name: str, entry: WrittenReaction, reading: Reading) -> Reaction:
    """Return the reaction of an entry of [reactions], with None for the default point; unknown names, and an entry with
    both or neither of joint and constraint, are reported."""
    key, report, names = key_of("reactions", name), reading.report, reading.names
    if (entry.joint is None) == (entry.constraint is None):
        got = "none" if entry.joint is None else "both"
        report.add(key, f"a reaction needs one of joint and constraint, not {got} [E1668]", 'joint = "hinge"')
    if entry.joint is not None:
        check_reference(f"{key}.joint", entry.joint, names.joints, "joint", report)
    if entry.constraint is not None:
        check_reference(f"{key}.constraint", entry.constraint, names.constraints, "constraint", report)
    of = entry.joint or entry.constraint or ""
    if of != name and (name in names.joints or name in names.constraints):
        kind = "joint" if name in names.joints else "constraint"
        fault = f"the {kind} {name} has a reaction of that name, and this is one of {of} [E1669]"
        report.add(key, fault, "another name")
    if entry.point is not None:
        check_reference(f"{key}.point", entry.point, names.points, "point", report)
    check_reference(f"{key}.axes", entry.axes, [BASE, WORLD, *reading.bodies], "body", report)
    point: Point | None = reading.items["points"].get(entry.point or "")
    return Reaction(name, "constraints" if entry.joint is None else "joints", of, point, entry.axes)
