"""Reading of joints, constraints and reactions: permitted keys of each type, placement, initial state, limits
(compliant stops) and dry friction.

Reading of constraints: permitted keys of each type, and the axes of the two frames that its equations use; reading
of reactions.

Frames never depend on the initial state, which need not close the loop. Formulas of constraints need two derivatives
along a motion, so curves that jump or bend and functions with a corner are refused.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

from eomgen.base.text import key_of, shown
from eomgen.formula.discontinuities import applications
from eomgen.formula.evaluate import symbols
from eomgen.formula.features import changes
from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Application, Formula, Number, Operation, Symbol
from eomgen.scene.formula.scope import BETWEEN_FRAMES, PARAMETERS, POSITIONS, VELOCITIES
from eomgen.scene.geometry import frame_about, quaternion_of, rows
from eomgen.scene.joint_types import CONSTRAINTS, JOINTS, TYPES, Need
from eomgen.scene.joints import schema as written
from eomgen.scene.joints.drives import driven_start, read_drives, read_law, read_length, read_smoothing
from eomgen.scene.joints.frames import check_two_bodies, read_frame
from eomgen.scene.joints.model import (
    ONSETS,
    Coefficients,
    Constraint,
    EquationUnit,
    Frame,
    Friction,
    Joint,
    Mimic,
    Reaction,
    Shape,
    Stop,
)
from eomgen.scene.reading.report import Report, check_reference
from eomgen.scene.reading.requirements import RELATIONS
from eomgen.scene.reading.values import UNKNOWN, Values, read_orientation, unit_of
from eomgen.system.description import BASE, WORLD, Point

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


Direction = tuple[float, float, float]
_NEUTRAL = (1.0, 0.0, 0.0, 0.0)
_QUATERNION_TOLERANCE = 1e-6
#: Meaning of the velocity, by group.
_VELOCITY_MEANING = {"SO3": " (angular velocity, body axes)", "SE3": " (angular, then linear velocity, body axes)"}
#: Keys of some types only, each with an example of its value.
_KEYS = {"second_axis": "[0, 1, 0]", "x_axis": "", "pitch": "0.01, in m/rad"}
_COEFFICIENTS = ("stiffness", "damping", "rest", "rotor_inertia")
_PERPENDICULAR = 1e-6


def read_joint(name: str, joint: written.Joint, values: Values) -> Joint:
    """Return a checked joint; faults go to the report of ``values``."""
    key = key_of("joints", name)
    axis, second = _axes(key, joint, values)
    coefficients = {field: _coefficients(key, field, joint, values) for field in _COEFFICIENTS}
    drive = read_drives(key, joint, values)
    start, speed = driven_start(key, drive, values)
    return Joint(
        name=name,
        type=joint.type,
        parent=joint.parent,
        child=joint.child,
        axis=axis,
        second_axis=second,
        pitch=Number(0.0) if joint.pitch is None else values.formula(f"{key}.pitch", joint.pitch, PARAMETERS),
        position=values.vector(f"{key}.position", joint.position, PARAMETERS),
        orientation=read_orientation(key, joint.rotation, joint.orientation, values),
        initial_position=start if drive else _initial_position(key, joint, values),
        initial_velocity=speed if drive else _initial_velocity(key, joint, values),
        stops=read_stops(key, joint, values),
        friction=read_friction(key, joint, values),
        mimic=_mimic(key, joint, values),
        drive=drive,
        stiffness=coefficients["stiffness"],
        damping=coefficients["damping"],
        rest=coefficients["rest"],
        rotor_inertia=coefficients["rotor_inertia"],
    )


def _axes(key: str, joint: written.Joint, values: Values) -> tuple[Direction, Direction]:
    """Return the axis and the direction across it, as given or by the default of the type."""
    report, kind = values.report, JOINTS[joint.type]
    if kind.coordinates and joint.axis is None:
        report.add(key, f"a {joint.type} joint needs an axis", "axis = [0, 0, 1]")
    elif not kind.coordinates and joint.axis is not None:
        report.add(f"{key}.axis", f"a {joint.type} joint has no axis", "rotation, for its placement")
    for field, example in _KEYS.items():
        given = getattr(joint, field) is not None
        if given and field not in (kind.second_key, *kind.needed):
            first = next(row.name for row in JOINTS.values() if field in (row.second_key, *row.needed))
            report.add(f"{key}.{field}", f"a {joint.type} joint has no {field}", f"type = {first}")
        elif not given and field in kind.needed:
            report.add(key, f"a {joint.type} joint needs a {field}", f"{field} = {example}")
    neutral = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0))
    axis = None if joint.axis is None or not kind.coordinates else values.axis(f"{key}.axis", joint.axis)
    if axis is None:
        return neutral
    field, required = kind.second_key or "x_axis", kind.second_key == "second_axis"
    written_second = getattr(joint, field)
    second = None if written_second is None else values.axis(f"{key}.{field}", written_second)
    if second is not None and required and abs(float(axis @ second)) > _PERPENDICULAR:
        included = math.degrees(math.acos(min(1.0, max(-1.0, float(axis @ second)))))
        fault = f"the axes of a {joint.type} joint are perpendicular, and these include {included:.6g} degrees"
        report.add(
            f"{key}.second_axis", fault, "second_axis across axis, or two revolute joints with a body in between"
        )
        return neutral
    if second is not None and abs(float(axis @ second)) > 1.0 - _PERPENDICULAR:
        report.add(f"{key}.{field}", f"{field} is parallel to axis", "a direction across it")
        return neutral
    x, _, z = rows(frame_about(axis, second).T)
    return z, x


def _coefficients(key: str, field: str, joint: written.Joint, values: Values) -> Coefficients:
    """Return a coefficient of a joint by coordinate; a single formula for one coordinate."""
    given: tuple[float | str, ...] | None = getattr(joint, field)
    place, meaning = f"{key}.{field}", tuple(JOINTS[joint.type].coordinates)
    if given is None:
        return Number(0.0)
    if not meaning:
        values.report.add(place, f"a {joint.type} joint has no {field}", "an effort or a force")
        return Number(0.0)
    if len(given) != len(meaning):
        count = f"{len(meaning)} values ({', '.join(meaning)})" if len(meaning) > 1 else "one value"
        values.report.add(place, f"the {field} of a {joint.type} joint needs {count}, not {len(given)}", "")
        return Number(0.0)
    keys = [place] if len(given) == 1 else [f"{place}[{number}]" for number in range(len(given))]
    formulas = tuple(values.formula(at, value, PARAMETERS) for at, value in zip(keys, given, strict=True))
    return formulas[0] if len(formulas) == 1 else formulas


def _mimic(key: str, joint: written.Joint, values: Values) -> Mimic | None:
    if joint.mimic is None:
        return None
    if (size := JOINTS[joint.type].v_size) != 1:
        fault = f"a {joint.type} joint cannot follow another: it has {size or 'no'} coordinates"
        values.report.add(f"{key}.mimic", fault, "a joint with one coordinate")
    for field in ("position", "orientation", "rotation", "velocity"):
        if getattr(joint.initial, field) is not None:
            fault = "a joint that follows another has no initial state of its own"
            values.report.add(f"{key}.initial.{field}", fault, f"the initial state of {shown(joint.mimic.joint)}")
    multiplier = values.formula(f"{key}.mimic.multiplier", joint.mimic.multiplier, PARAMETERS)
    return Mimic(joint.mimic.joint, multiplier, values.formula(f"{key}.mimic.offset", joint.mimic.offset, PARAMETERS))


def _known(
    key: str, given: Sequence[float | str] | None, count: int, quantity: str, values: Values
) -> list[float] | None:
    """Return ``count`` constants; None if they are not given or not known."""
    if given is None:
        return None
    if len(given) != count:
        values.report.add(key, f"{quantity} needs {count} number{'s' * (count != 1)}, not {len(given)}", "")
        return None
    numbers = values.constants(key, given)
    return None if any(math.isnan(number) for number in numbers) else numbers


def _initial_position(key: str, joint: written.Joint, values: Values) -> tuple[float, ...]:
    initial, place, kind = joint.initial, f"{key}.initial", JOINTS[joint.type]
    for field in ("orientation", "rotation", "position"):
        if getattr(initial, field) is not None and field not in kind.starts:
            hint = "" if field == "position" else "position"
            values.report.add(f"{place}.{field}", f"a {joint.type} joint has no initial {field}", hint)
    if not kind.moves:
        return ()
    if kind.group == "R":
        given = _known(f"{place}.position", initial.position, kind.q_size, f"a {joint.type} joint", values)
        return tuple(given or [0.0] * kind.q_size)
    if kind.group == "SO3":
        return _quaternion(place, "position", initial.position, initial, values)
    position = (
        _known(f"{place}.position", initial.position, 3, f"the position of a {joint.type} joint", values) or [0.0] * 3
    )
    return (*_quaternion(place, "orientation", initial.orientation, initial, values), *position)


def _quaternion(
    place: str, field: str, given: Sequence[float | str] | None, initial: written.Initial, values: Values
) -> tuple[float, ...]:
    """Return the initial orientation, from a quaternion under ``field`` or from rotations."""
    if initial.rotation is not None:
        if given is not None:
            values.report.add(f"{place}.rotation", f"{field} and rotation both give the orientation", "one of them")
        return quaternion_of(values.constant_rotations(f"{place}.rotation", initial.rotation) or [])
    numbers = _known(f"{place}.{field}", given, 4, "a quaternion (w, x, y, z)", values)
    if numbers is None:
        return _NEUTRAL
    norm = math.sqrt(sum(number * number for number in numbers))
    if abs(norm - 1.0) > _QUATERNION_TOLERANCE:
        unit = ", ".join(f"{number / norm:.9g}" for number in numbers) if 0.0 < norm < math.inf else "1, 0, 0, 0"
        values.report.add(f"{place}.{field}", f"the quaternion has norm {norm:.6g}, not 1", f"[{unit}]")
        return _NEUTRAL
    return tuple(number / norm for number in numbers)


def _initial_velocity(key: str, joint: written.Joint, values: Values) -> tuple[float, ...]:
    kind = JOINTS[joint.type]
    size, quantity = kind.v_size, f"the velocity of a {joint.type} joint{_VELOCITY_MEANING.get(kind.group, '')}"
    return tuple(_known(f"{key}.initial.velocity", joint.initial.velocity, size, quantity, values) or [0.0] * size)


#: Keys of some types only, in the order in which they are looked at.
_CONSTRAINT_KEYS = (
    "drive",
    "length",
    "radius",
    "shape",
    "semi_axes",
    "tube_radius",
    "pitch",
    "equation",
    "velocity_equation",
    "unit",
)
#: Keys that surfaces need beside their shape.
_OF_SHAPES: Mapping[str, Mapping[str, str]] = {
    "disc": {"radius": "1.0"},
    "sphere": {"radius": "1.0"},
    "ellipsoid": {"semi_axes": "[0.2, 0.03, 0.02]"},
    "torus": {"radius": "0.3", "tube_radius": "0.05"},
}
_EQUATION = 'equation = "q.rod - lift(q.cam)", which is 0 on the constraint'
_VELOCITIES = ("v", "velocity")
#: Functions that jump or have a corner, with the noun of it.
_ROUGH = {"abs": "a corner", "min": "a corner", "max": "a corner", "sign": "a jump", "lt": "a jump", "le": "a jump"}
_COUNTS = {1: "one derivative", 2: "two derivatives"}
#: Degree in velocities of formulas that are not linear.
_NONLINEAR = 2
_EXAMPLES = {"length": "1.0", "pitch": "0.01"}


def read_constraint(
    name: str, entry: written.Constraint, bodies: Collection[str], points: Mapping[str, Point], values: Values
) -> Constraint:
    """Return a checked constraint; faults go to the report of ``values``."""
    key = key_of("constraints", name)
    for field in _CONSTRAINT_KEYS:
        given, types = (
            getattr(entry, field) is not None,
            [row.name for row in TYPES.values() if field in row.constraint_keys],
        )
        if given and entry.type not in types:
            values.report.add(
                f"{key}.{field}", f"a {entry.type} constraint has no {field}", f"type = {' or '.join(types)}"
            )
        elif not given and entry.type in types and field in _EXAMPLES:
            values.report.add(key, f"a {entry.type} constraint needs a {field}", f"{field} = {_EXAMPLES[field]}")
    shape = entry.shape or Constraint.shape
    if "shape" in CONSTRAINTS[entry.type].keys:
        _check_shape(key, shape, entry, values)
    framed = entry.type != "formula" or entry.first is not None or entry.second is not None
    first, second = (
        _frame(f"{key}.{side}", entry, getattr(entry, side), need, bodies, points, values) if framed else Frame(BASE)
        for side, need in zip(("first", "second"), _needs(entry), strict=True)
    )
    equation, unit = read_equation(key, entry, points, values) if entry.type == "formula" else (None, Constraint.unit)
    law = "length" if entry.type == "distance" else "drive"
    smooth = read_smoothing(key, entry.smooth, law if getattr(entry, law) is None else "", values)
    return Constraint(
        name=name,
        type=entry.type,
        first=first,
        second=second,
        drive=None if entry.drive is None else read_law(f"{key}.drive", entry.drive, values, smooth),
        length=ZERO if entry.length is None else read_length(f"{key}.length", entry.length, values, smooth),
        radius=_number(f"{key}.radius", entry.radius, values),
        shape=shape,
        pitch=_number(f"{key}.pitch", entry.pitch, values),
        semi_axes=ZERO_VECTOR
        if entry.semi_axes is None
        else values.vector(f"{key}.semi_axes", entry.semi_axes, PARAMETERS),
        tube_radius=_number(f"{key}.tube_radius", entry.tube_radius, values),
        equation=equation,
        at_velocity=entry.velocity_equation is not None,
        unit=unit,
        framed=framed,
    )


def _frame(
    key: str,
    entry: written.Constraint,
    frame: written.Frame | None,
    need: Need,
    bodies: Collection[str],
    points: Mapping[str, Point],
    values: Values,
) -> Frame:
    """Return the first or the second frame of a joint; a missing frame is reported."""
    if frame is None:
        side = key.rpartition(".")[2]
        values.report.add(key, f"the key {side} is missing", f"{side} = ...")
        return Frame("")
    return read_frame(key, f"{_kind(entry)} constraint", frame, need, bodies, points, values)


def _check_shape(key: str, shape: Shape, entry: written.Constraint, values: Values) -> None:
    """Report keys that a shape needs, and keys that it does not have."""
    for field in ("radius", "semi_axes", "tube_radius"):
        given, example = getattr(entry, field) is not None, _OF_SHAPES[shape].get(field)
        if example is not None and not given:
            article = "an" if shape == "ellipsoid" else "a"
            fault = (
                f"a {entry.type} constraint needs a {field}"
                if field == "radius"
                else f"{article} {shape} needs {field}"
            )
            values.report.add(key, fault, f"{field} = {example}")
        elif given and example is None:
            having = [f'"{name}"' for name, keys in _OF_SHAPES.items() if field in keys]
            values.report.add(f"{key}.{field}", f"the shape {shape} has no {field}", f"shape = {' or '.join(having)}")


def _needs(entry: written.Constraint) -> tuple[Need, Need]:
    if CONSTRAINTS[entry.type].drive == "angle" and entry.drive is not None:
        return "x and z", "x and z"
    if "shape" in CONSTRAINTS[entry.type].keys and entry.shape in ("sphere", "ellipsoid"):
        return "z", "nothing" if entry.shape == "sphere" else "any"
    return CONSTRAINTS[entry.type].uses


def _number(key: str, value: float | str | None, values: Values) -> Formula:
    return ZERO if value is None else values.formula(key, value, PARAMETERS)


def _kind(entry: written.Constraint) -> str:
    return f"driven {entry.type}" if entry.drive is not None and CONSTRAINTS[entry.type].drive else entry.type


def read_equation(
    key: str, entry: written.Constraint, points: Mapping[str, Point], values: Values
) -> tuple[Formula | None, EquationUnit]:
    """Return the equation of a constraint and its unit; faults go to the report of ``values``.

    Returns
    -------
    tuple
        The formula, ``UNKNOWN`` for a refused one and None for a missing one, and its unit in SI.
    """
    report, at_velocity = values.report, entry.velocity_equation is not None
    text = entry.velocity_equation if at_velocity else entry.equation
    if text is None or (at_velocity and entry.equation is not None):
        got = "both" if at_velocity else "none"
        report.add(key, f"a formula constraint needs one of equation and velocity_equation, not {got}", _EQUATION)
        return None, "m"
    framed = entry.first is not None or entry.second is not None
    if at_velocity and framed:
        hint = "velocities of points and joints, and no first and second"
        report.add(f"{key}.velocity_equation", "an equation between two frames holds positions alone", hint)
        return UNKNOWN, "m"
    place = f"{key}.velocity_equation" if at_velocity else f"{key}.equation"
    formula = values.formula(place, text, VELOCITIES if at_velocity else BETWEEN_FRAMES if framed else POSITIONS)
    if formula is UNKNOWN:
        return UNKNOWN, "m"
    still = {name for name, point in points.items() if point.body in (BASE, WORLD)}
    if not _holds(place, formula, values, still, framed=framed, at_velocity=at_velocity):
        return UNKNOWN, "m"
    _check_smooth(place, formula, values, 1 if at_velocity else 2)
    return formula, _unit(key, formula, entry.unit, values, at_velocity=at_velocity)


def _holds(
    place: str, formula: Formula, values: Values, still: Collection[str], *, framed: bool, at_velocity: bool
) -> bool:
    """Return whether an equation holds a motion, linear in velocities; faults are reported.

    Parameters
    ----------
    still : points that never move
    """
    kinds = {symbol.kind for symbol in symbols(formula)}
    report = values.report
    if at_velocity and not kinds.intersection(_VELOCITIES):
        if kinds.intersection(("q", "position")):
            report.add(place, "the equation names no velocity", "equation = ... for positions")
        else:
            report.add(place, "the equation names no velocity, so it holds no motion", "v.JOINT or velocity.POINT[0]")
        return False
    if at_velocity and degree(formula) >= _NONLINEAR:
        hint = "a sum of velocities times factors of positions and time"
        report.add(place, "the equation is not linear in velocities", hint)
        return False
    if not at_velocity and not kinds.intersection(("q", "position", "local")):
        hint = "x, y or z" if framed else "q.JOINT or position.POINT[0]"
        report.add(place, "the equation names no coordinate, so it holds no motion", hint)
        return False
    named = {symbol for symbol in symbols(formula) if symbol.kind in ("q", "v", "position", "velocity", "local")}
    if all(symbol.kind in ("position", "velocity") and symbol.name in still for symbol in named):
        fault = "the equation names points of the base and of the world alone, so it holds no motion"
        report.add(place, fault, "a point of a moving body")
        return False
    return True


def _check_smooth(place: str, formula: Formula, values: Values, derivatives: int) -> None:
    """Report curves and functions without so many derivatives; note choices, whose branches have to fit."""
    needs = f"a constraint needs {_COUNTS[derivatives]} of its equation"
    for used in applications(formula):
        rough = [
            (at, order - used.derivative) for at, order in used.curve.kinks() if order - used.derivative < derivatives
        ]
        if rough:
            at, order = rough[0]
            does = "jumps" if order <= 0 else "bends"
            name = used.curve.name if not used.derivative else f"a derivative of {used.curve.name}"
            fault = f"{needs}, and {name} {does} at {at:.6g}"
            values.report.add(place, fault, 'interpolation = "quintic"')
    for name in dict.fromkeys(_rough(formula)):
        if derivatives == 1 and _ROUGH[name] == "a corner":
            continue
        hint = "a smooth function, such as sqrt(x**2 + d**2) for abs(x), or two constraints"
        fault = f"{needs}, and {_words(name)} has {_ROUGH[name]}"
        values.report.add(place, fault, hint)
    if any(part.name == "select" and changes(part.arguments[0]) for part in _operations(formula)):
        equal = "values, slopes and curvatures" if derivatives > 1 else "values and slopes"
        values.note([f"{place}: the equation has an if, whose branches have to meet with equal {equal}"])


def _words(name: str) -> str:
    return "a comparison" if name in ("lt", "le") else name


def _rough(formula: Formula) -> Iterator[str]:
    """Yield the functions with jumps and corners in the motion, but for the comparisons of choices."""
    if isinstance(formula, Application):
        yield from _rough(formula.argument)
    elif isinstance(formula, Operation):
        if formula.name in _ROUGH and changes(formula):
            yield formula.name
        for argument in formula.arguments[1:] if formula.name == "select" else formula.arguments:
            yield from _rough(argument)


def _operations(formula: Formula) -> Iterator[Operation]:
    if isinstance(formula, Application):
        yield from _operations(formula.argument)
    elif isinstance(formula, Operation):
        yield formula
        for argument in formula.arguments:
            yield from _operations(argument)


def degree(formula: Formula) -> int:
    """Return the degree of a formula in velocities: 0, 1, or 2 for all that is not linear."""
    if isinstance(formula, Symbol):
        return int(formula.kind in _VELOCITIES)
    if isinstance(formula, Application):
        return _NONLINEAR if degree(formula.argument) else 0
    if not isinstance(formula, Operation):
        return 0
    degrees = [degree(argument) for argument in formula.arguments]
    match formula.name:
        case "add" | "sub" | "neg":
            return max(degrees)
        case "mul":
            return min(sum(degrees), _NONLINEAR)
        case "div":
            return _NONLINEAR if degrees[1] else degrees[0]
        case "select":
            return _NONLINEAR if degrees[0] else max(degrees[1:])
    return _NONLINEAR if any(degrees) else 0


def _unit(key: str, formula: Formula, given: EquationUnit | None, values: Values, *, at_velocity: bool) -> EquationUnit:
    """Return the unit of an equation; a missing or a wrong one is reported, and a sum of several units."""
    report, joints = values.report, values.names.joints
    choice: tuple[EquationUnit, EquationUnit] = ("m/s", "rad/s") if at_velocity else ("m", "rad")
    place = f"{key}.velocity_equation" if at_velocity else f"{key}.equation"
    added = next(_added(formula, joints), None)
    if added is not None:
        report.add(place, f"the equation adds {added[0]} and {added[1]}", "factors that turn one unit into the other")
        return given or choice[0]
    known = unit_of(formula, joints)
    by_choice = {unit: unit for unit in choice}
    if given is not None and given not in choice:
        level = "velocities" if at_velocity else "positions"
        report.add(f"{key}.unit", f"an equation of {level} is in {' or '.join(choice)}, not in {given}", choice[0])
    elif known and known not in choice:
        report.add(place, f"the equation is in {known}", f"an equation in {' or '.join(choice)}")
    elif given is not None and known and given != known:
        report.add(f"{key}.unit", f"the equation is in {known}, not in {given}", f'"{known}"')
    elif given is None and not known:
        fault = "the unit of the equation does not follow from its text"
        report.add(key, fault, f'unit = "{choice[0]}", or "{choice[1]}" of angles and numbers')
    return given or by_choice.get(known, choice[0])  # type: ignore[call-overload]  # known is any text


def _added(formula: Formula, joints: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield pairs of different units that a formula adds or subtracts."""
    for part in _operations(formula):
        if part.name in ("add", "sub"):
            first, second = (unit_of(argument, joints) for argument in part.arguments)
            if first and second and first != second:
                yield first, second


def check_closings(
    constraints: Iterable[Constraint], joints: Sequence[Joint], beams: Collection[str], report: Report
) -> None:
    """Report constraints between two places of one rigid body, which fixed joints make of several.

    Parameters
    ----------
    joints : sequence of Joint
        Parents first.
    beams : collection of str
        Bodies that are not rigid.
    """
    for constraint in constraints:
        if constraint.framed:
            check_two_bodies("constraints", constraint.name, constraint.first, constraint.second, joints, beams, report)


def read_reaction(
    name: str, entry: written.Reaction, bodies: Collection[str], points: Mapping[str, Point], values: Values
) -> Reaction:
    """Return a reaction; faults go to the report of ``values``."""
    key, report, names = key_of("reactions", name), values.report, values.names
    if (entry.joint is None) == (entry.constraint is None):
        got = "none" if entry.joint is None else "both"
        report.add(key, f"a reaction needs one of joint and constraint, not {got}", 'joint = "hinge"')
    if entry.joint is not None:
        check_reference(f"{key}.joint", entry.joint, names.joints, "joint", report)
    if entry.constraint is not None:
        check_reference(f"{key}.constraint", entry.constraint, names.constraints, "constraint", report)
    of = entry.joint or entry.constraint or ""
    if of != name and (name in names.joints or name in names.constraints):
        kind = "joint" if name in names.joints else "constraint"
        report.add(key, f"the {kind} {name} has a reaction of that name, and this is one of {of}", "another name")
    if entry.point is not None:
        check_reference(f"{key}.point", entry.point, names.points, "point", report)
    check_reference(f"{key}.axes", entry.axes, [BASE, WORLD, *bodies], "body", report)
    return Reaction(
        name, "constraints" if entry.joint is None else "joints", of, points.get(entry.point or ""), entry.axes
    )
