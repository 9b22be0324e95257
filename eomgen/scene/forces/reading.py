"""Springs between points and between angles, forces on bodies and efforts on joints, from the written form."""

from __future__ import annotations

import math
from collections.abc import Collection

from eomgen.scene.document import checks
from eomgen.scene.forces import schema as written
from eomgen.scene.forces.model import Effort, Force, Spring, TorsionSpring
from eomgen.scene.formula.scope import PARAMETERS, SPRING_FORCE, STATE, VELOCITY_SIZE
from eomgen.scene.joints.model import ANGLES
from eomgen.scene.reading.values import Values
from eomgen.scene.scene import BASE, WORLD
from eomgen.text import key_of


def read_spring(name: str, spring: written.Spring, values: Values) -> Spring:
    """Return a spring along the line between two points."""
    key, formula = key_of("springs", name), values.formula
    known = True
    for field, point in (("first", spring.first), ("second", spring.second)):
        known = checks.check_reference(f"{key}.{field}", point, values.names.points, "point", values.report) and known
    if known and spring.first == spring.second:
        values.report.add(f"{key}.second", f"the spring connects the point {spring.first} to itself", "another point")
    fields = ("stiffness", "damping", "length")
    stiffness, damping, length = (formula(f"{key}.{field}", getattr(spring, field), PARAMETERS) for field in fields)
    force = formula(f"{key}.force", spring.force, SPRING_FORCE)
    return Spring(name, spring.first, spring.second, stiffness, damping, length, force)


def read_torsion_spring(name: str, spring: written.TorsionSpring, values: Values) -> TorsionSpring:
    """Return a torsion spring between the angles of two joints, or of one."""
    key, joints = key_of("torsion_springs", name), values.names.joints
    ends = (("first", spring.first, spring.first_index), ("second", spring.second, spring.second_index))
    for field, joint, index in ends:
        if field == "second" and not joint:
            continue
        known = checks.check_reference(f"{key}.{field}", joint, joints, "joint", values.report)
        angles = ANGLES.get(joints[joint], 0) if known else 0
        if known and joints[joint] and not angles:
            what = f"the joint {joint} is {joints[joint]} and has no angle"
            values.report.add(f"{key}.{field}", what, "a revolute joint")
        elif angles and index >= angles:
            what = f"the {joints[joint]} joint {joint} has no angle {index}"
            values.report.add(f"{key}.{field}_index", what, "0" if angles == 1 else "0 or 1")
    if spring.first == spring.second in joints and spring.first_index == spring.second_index:
        values.report.add(f"{key}.second", f"the spring connects the joint {spring.first} to itself", "another joint, or none")
    fields = ("stiffness", "damping", "rest")
    constants = [values.formula(f"{key}.{field}", getattr(spring, field), PARAMETERS) for field in fields]
    stiffness, damping, rest = constants
    indices = {"first_index": spring.first_index, "second_index": spring.second_index}
    return TorsionSpring(name, spring.first, spring.second, stiffness, damping, rest, **indices)


def read_force(name: str, force: written.Force, bodies: Collection[str], values: Values) -> Force:
    """Return a force and a torque; ``bodies`` are the names of what they can act on."""
    key, vector = key_of("forces", name), values.vector
    if force.body in (BASE, WORLD):
        why = "its motion is prescribed" if force.body == BASE else "it rests"
        values.report.add(f"{key}.body", f"a force on the {force.body} moves nothing: {why}", "a body")
    else:
        checks.check_reference(f"{key}.body", force.body, bodies, "body", values.report)
    point = vector(f"{key}.point", force.point, PARAMETERS)
    force_vector = vector(f"{key}.force", force.force, STATE)
    return Force(name, force.body, point, force_vector, vector(f"{key}.torque", force.torque, STATE), force.axes)


def read_effort(name: str, effort: written.Effort, values: Values) -> Effort:
    """Return a generalized force on a component of a joint."""
    key = key_of("efforts", name)
    if checks.check_reference(f"{key}.joint", effort.joint, values.names.joints, "joint", values.report):
        kind = values.names.joints[effort.joint]
        size = VELOCITY_SIZE.get(kind, math.inf)
        if effort.index >= size:
            hint = f"an index from 0 to {size - 1}" if size else "a moving joint"
            values.report.add(f"{key}.index", f"the {kind} joint {effort.joint} has no component {effort.index}", hint)
    return Effort(name, effort.joint, values.formula(f"{key}.effort", effort.effort, STATE), effort.index)
