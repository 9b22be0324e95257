"""Reading of springs, forces, efforts, bushings and tyres."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from eomgen.formula.evaluate import symbols
from eomgen.formula.nodes import ZERO, ZERO_VECTOR, Formula, Number
from eomgen.scene.forces import schema as written
from eomgen.scene.forces.model import Bushing, Effort, Force, Slip, Spring, TorsionSpring, Tyre
from eomgen.scene.formula.scope import PARAMETERS, ROAD, SPRING_FORCE, STATE
from eomgen.scene.geometry.rotations import rows, sequence
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.frames import read_frame
from eomgen.scene.reading import report
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.values import Values
from eomgen.system.description import BASE, WORLD, Point
from eomgen.text import key_of


def read_spring(name: str, spring: written.Spring, values: Values) -> Spring:
    """Return a spring along the line between two points."""
    key, formula = key_of("springs", name), values.formula
    known = True
    for field, point in (("first", spring.first), ("second", spring.second)):
        known = report.check_reference(f"{key}.{field}", point, values.names.points, "point", values.report) and known
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
        known = report.check_reference(f"{key}.{field}", joint, joints, "joint", values.report)
        angles = JOINTS[joints[joint]].angles if known and joints[joint] else 0
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
        report.check_reference(f"{key}.body", force.body, bodies, "body", values.report)
    point = vector(f"{key}.point", force.point, PARAMETERS)
    force_vector = vector(f"{key}.force", force.force, STATE)
    return Force(name, force.body, point, force_vector, vector(f"{key}.torque", force.torque, STATE), force.axes)


def read_effort(name: str, effort: written.Effort, values: Values) -> Effort:
    """Return a generalized force on a component of a joint."""
    key = key_of("efforts", name)
    if report.check_reference(f"{key}.joint", effort.joint, values.names.joints, "joint", values.report):
        kind = values.names.joints[effort.joint]
        size = JOINTS[kind].v_size if kind else math.inf
        if effort.index >= size:
            hint = f"an index from 0 to {size - 1}" if size else "a moving joint"
            values.report.add(f"{key}.index", f"the {kind} joint {effort.joint} has no component {effort.index}", hint)
    return Effort(name, effort.joint, values.formula(f"{key}.effort", effort.effort, STATE), effort.index)


Rows = tuple[tuple[Formula, ...], ...]


def read_bushing(
    name: str, entry: written.Bushing, bodies: Collection[str], points: Mapping[str, Point], values: Values
) -> Bushing:
    """Return a checked bushing; what is wrong with it goes to the report of ``values``."""
    key = key_of("bushings", name)
    first, second = (
        read_frame(f"{key}.{side}", "bushing", frame, "any", bodies, points, values)
        for side, frame in (("first", entry.first), ("second", entry.second))
    )
    stiffness, damping = _rows(key, entry, "stiffness", values), _rows(key, entry, "damping", values)
    rotational = values.vector(f"{key}.rotational_preload", entry.rotational_preload, PARAMETERS)
    preload = (*rotational, *values.vector(f"{key}.preload", entry.preload, PARAMETERS))
    parts = [entry for row in (*stiffness, *damping, preload) for entry in row]
    if not values.report.concerns(key) and all(part in (ZERO, Number(-0.0)) for part in parts):
        values.report.add(key, "the bushing has no stiffness, damping or preload", "stiffness = [1e5, 1e5, 1e5]")
    return Bushing(
        name=name,
        first=first,
        second=second,
        stiffness=stiffness,
        damping=damping,
        rest=values.vector(f"{key}.rest", entry.rest, PARAMETERS),
        rest_orientation=rows(sequence(values.constant_rotations(f"{key}.rest_rotation", entry.rest_rotation) or [])),
        preload=preload,
    )


def _rows(key: str, entry: written.Bushing, what: str, values: Values) -> Rows:
    """Return the six rows of the stiffness or the damping, rotations first."""
    fields = (f"rotational_{what}", what)
    matrix = getattr(entry, f"{what}_matrix")
    if matrix is None:
        diagonal: list[Formula] = []
        for field in fields:
            given = getattr(entry, field)
            diagonal += ZERO_VECTOR if given is None else values.vector(f"{key}.{field}", given, PARAMETERS)
        return tuple(tuple(diagonal[i] if i == j else ZERO for j in range(6)) for i in range(6))
    for field in fields:
        if getattr(entry, field) is not None:
            values.report.add(f"{key}.{field}", f"{field} and {what}_matrix are both given", "one of them")
    _check_matrix(f"{key}.{what}_matrix", matrix, what, values)
    return tuple(tuple(Number(number) for number in row) for row in matrix)


def _check_matrix(key: str, rows_given: Sequence[Sequence[float]], what: str, values: Values) -> None:
    """Report a stiffness without a potential, and a stiffness or damping that would hand out energy."""
    matrix = np.array(rows_given)
    size = float(np.max(np.abs(matrix)))
    for row, column in zip(*np.nonzero(np.abs(matrix - matrix.T) > 1e-9 * size), strict=True):
        if what == "stiffness" and row < column:
            fault = f"the matrix is not symmetric, so it has no potential: entry [{row}][{column}] differs from [{column}][{row}]"
            values.report.add(key, fault, "the mean of both")
            return
    smallest = float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[0])
    if smallest < -1e-9 * size:
        fault = f"the {what} is negative in some direction: the smallest eigenvalue of the matrix is {smallest:.6g}"
        values.report.add(key, fault, "a positive semidefinite matrix")


def read_tyre(name: str, entry: written.Tyre, points: Mapping[str, Point], values: Values) -> Tyre:
    """Return a checked tyre; what is wrong with it goes to the report of ``values``."""
    key, report = key_of("tyres", name), values.report
    known = check_reference(f"{key}.center", entry.center, values.names.points, "point", report)
    if known and entry.center in points and points[entry.center].body in (BASE, WORLD):
        what = f"the point {entry.center} is on the {points[entry.center].body}, where a wheel's force moves nothing"
        report.add(f"{key}.center", what, "a point of the wheel's body")
    damping = values.formula(f"{key}.damping", entry.damping, PARAMETERS)
    road = _height(f"{key}.road", entry.road, entry.center, values)
    kinds = {symbol.kind for symbol in symbols(road)}
    moving = bool(kinds & {"time", "input"})
    rate = None
    if entry.road_rate is not None:
        rate = _height(f"{key}.road_rate", entry.road_rate, entry.center, values)
        if not moving and not report.concerns(f"{key}.road"):
            what = "neither time nor an input moves the road, so it has no rate of its own"
            report.add(f"{key}.road_rate", what, "a road that moves, or no road_rate")
    elif "input" in kinds and damping != Number(0.0):
        what = "the damping needs the rate of the road, which does not follow from an input"
        report.add(key, what, 'road_rate = "...", a second input for instance, or no damping')
    return Tyre(
        name=name,
        center=entry.center,
        radius=values.formula(f"{key}.radius", entry.radius, PARAMETERS),
        stiffness=values.formula(f"{key}.stiffness", entry.stiffness, PARAMETERS),
        damping=damping,
        onset=values.formula(f"{key}.onset", entry.onset, PARAMETERS),
        road=road,
        road_rate=rate,
        moving_road=moving,
        slip=_slip(f"{key}.slip", entry.slip, values) if entry.slip is not None else None,
    )


def _height(key: str, value: float | str, center: str, values: Values) -> Formula:
    """Return the height of a road or its rate; of all positions it may use its own wheel's x and y only."""
    formula = values.formula(key, value, ROAD)
    for symbol in sorted((s for s in symbols(formula) if s.kind == "position"), key=lambda s: (s.name, s.index)):
        if symbol.name != center or symbol.index == 2:
            what = f"position.{symbol.name}[{symbol.index}] cannot be used here: a road has a height over its own wheel's x and y"
            values.report.add(key, what, f"position.{center}[0] or position.{center}[1]")
            break
    return formula


def _slip(key: str, slip: written.Slip, values: Values) -> Slip | None:
    axis = values.axis(f"{key}.axis", slip.axis)
    if len(slip.stiffness) not in (1, 2):
        what = f"one stiffness, or a longitudinal and a lateral one, are needed here, not {len(slip.stiffness)}"
        values.report.add(f"{key}.stiffness", what, "[15, 12]")
        return None
    places = [f"{key}.stiffness[{place}]" for place in range(len(slip.stiffness))]
    stiffness = [values.formula(place, value, PARAMETERS) for place, value in zip(places, slip.stiffness, strict=True)]
    friction = values.formula(f"{key}.friction", slip.friction, PARAMETERS)
    velocity = values.formula(f"{key}.velocity", slip.velocity, PARAMETERS)
    if axis is None:
        return None
    return Slip((float(axis[0]), float(axis[1]), float(axis[2])), (stiffness[0], stiffness[-1]), friction, velocity)
