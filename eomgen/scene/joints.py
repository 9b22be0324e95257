"""Joints from the written form: what each type may carry, its constant placement and its initial state."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from eomgen.scene import schema as written
from eomgen.scene.formula_nodes import Formula, Number
from eomgen.scene.formula_scope import CONFIGURATION_SIZE, PARAMETERS, VELOCITY_SIZE
from eomgen.scene.joint_limits import read_friction, read_stops
from eomgen.scene.names import key_of
from eomgen.scene.rotation import is_rotation, quaternion_of, rows, sequence, snapped
from eomgen.scene.scene import Joint
from eomgen.scene.values import Values

_ONE_DEGREE = ("revolute", "prismatic")
_NEUTRAL = (1.0, 0.0, 0.0, 0.0)
_QUATERNION_TOLERANCE = 1e-6
_VELOCITY_MEANING = {3: " (angular velocity, body axes)", 6: " (angular, then linear velocity, body axes)"}


def read_joint(name: str, joint: written.Joint, values: Values) -> Joint:
    """Return a checked joint; what is wrong with it goes to the report of ``values``."""
    key, report = key_of("joints", name), values.report
    axis = (0.0, 0.0, 1.0)
    extras: dict[str, Formula] = {}
    for field in ("stiffness", "damping", "rest", "rotor_inertia"):
        value = getattr(joint, field)
        if value is None:
            extras[field] = Number(0.0)
        elif joint.type not in _ONE_DEGREE:
            report.add(f"{key}.{field}", f"a {joint.type} joint has no {field}", "an effort or a force")
            extras[field] = Number(0.0)
        else:
            extras[field] = values.formula(f"{key}.{field}", value, PARAMETERS)
    if values.value(extras["rotor_inertia"]) < 0.0:
        report.add(f"{key}.rotor_inertia", "the rotor inertia is negative", "0 or more")
    if joint.type in _ONE_DEGREE and joint.axis is None:
        report.add(key, f"a {joint.type} joint needs an axis", "axis = [0, 0, 1]")
    elif joint.type not in _ONE_DEGREE and joint.axis is not None:
        report.add(f"{key}.axis", f"a {joint.type} joint has no axis", "rotation, for its placement")
    elif joint.axis is not None and (unit := values.axis(f"{key}.axis", joint.axis)) is not None:
        axis = (float(unit[0]), float(unit[1]), float(unit[2]))
    return Joint(
        name=name,
        type=joint.type,
        parent=joint.parent,
        child=joint.child,
        axis=axis,
        position=values.vector(f"{key}.position", joint.position, PARAMETERS),
        orientation=_orientation(key, joint, values),
        initial_position=_initial_position(key, joint, values),
        initial_velocity=_initial_velocity(key, joint, values),
        stops=read_stops(key, joint, values),
        friction=read_friction(key, joint, values),
        **extras,
    )


def _orientation(key: str, joint: written.Joint, values: Values) -> tuple[tuple[float, float, float], ...]:
    if joint.orientation is not None and joint.rotation is not None:
        values.report.add(f"{key}.orientation", "orientation and rotation are both given", "one of them")
    if joint.orientation is not None:
        matrix = snapped(np.array(joint.orientation))
        if not is_rotation(matrix):
            what = "the matrix is not a rotation: orthonormal and right-handed to 1e-9"
            values.report.add(f"{key}.orientation", what, "rotation")
        return rows(matrix)
    return rows(sequence(values.constant_rotations(f"{key}.rotation", joint.rotation or ()) or []))


def _known(key: str, given: Sequence[float | str] | None, count: int, what: str, values: Values) -> list[float] | None:
    """Return ``count`` constants; None where they are not given or not known."""
    if given is None:
        return None
    if len(given) != count:
        values.report.add(key, f"{what} needs {count} number{'s' * (count != 1)}, not {len(given)}", "")
        return None
    numbers = values.constants(key, given)
    return None if any(math.isnan(number) for number in numbers) else numbers


def _initial_position(key: str, joint: written.Joint, values: Values) -> tuple[float, ...]:
    initial, place, size = joint.initial, f"{key}.initial", CONFIGURATION_SIZE[joint.type]
    for field, types in (("orientation", ("free",)), ("rotation", ("spherical", "free"))):
        if getattr(initial, field) is not None and joint.type not in types:
            values.report.add(f"{place}.{field}", f"a {joint.type} joint has no initial {field}", "position")
    if joint.type in ("fixed", *_ONE_DEGREE):
        if joint.type == "fixed" and initial.position is not None:
            values.report.add(f"{place}.position", "a fixed joint has no initial position", "")
            return ()
        return tuple(_known(f"{place}.position", initial.position, size, f"a {joint.type} joint", values) or [0.0] * size)
    if joint.type == "spherical":
        return _quaternion(place, "position", initial.position, initial, values)
    position = _known(f"{place}.position", initial.position, 3, "the position of a free joint", values) or [0.0] * 3
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
    size = VELOCITY_SIZE[joint.type]
    what = f"the velocity of a {joint.type} joint{_VELOCITY_MEANING.get(size, '')}"
    return tuple(_known(f"{key}.initial.velocity", joint.initial.velocity, size, what, values) or [0.0] * size)
