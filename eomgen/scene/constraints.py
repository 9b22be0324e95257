"""Constraints from the written form: where their frames are, which way their axes point, and what each type may carry.

Two axes say nothing about the angle between two bodies. So where that angle matters (``fixed``, ``prismatic``,
``universal``, a driven ``revolute``), a frame given by its axis needs an ``x_axis`` too: the frame's x is the part of it across
the axis. Nothing is ever taken from the initial state, which need not close the loop.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Literal

from eomgen.scene import schema as written
from eomgen.scene.checks import check_reference
from eomgen.scene.constraint import Constraint, Frame
from eomgen.scene.formula_nodes import Formula, Number
from eomgen.scene.formula_scope import PARAMETERS, TIME
from eomgen.scene.names import key_of, listed
from eomgen.scene.report import Report
from eomgen.scene.rotation import frame_about, rows, sequence
from eomgen.scene.scene import BASE, WORLD, ZERO_VECTOR, Joint, Point
from eomgen.scene.values import Values

Need = Literal["nothing", "z", "x and z"]

#: What the equations of each type use of the first and the second frame, besides the origin.
AXES: Mapping[str, tuple[Need, Need]] = {
    "spherical": ("nothing", "nothing"), "distance": ("nothing", "nothing"), "revolute": ("z", "z"), "cylindrical": ("z", "z"),
    "planar": ("z", "z"), "point_on_line": ("z", "nothing"), "rolling": ("z", "z"), "universal": ("x and z", "x and z"),
    "prismatic": ("x and z", "x and z"), "fixed": ("x and z", "x and z"),
}  # fmt: skip

#: The types that each further key belongs to; ``length`` and ``radius`` are needed there.
KEYS: Mapping[str, tuple[str, ...]] = {
    "drive": ("revolute", "prismatic", "cylindrical"), "length": ("distance",), "radius": ("rolling",), "shape": ("rolling",),
}  # fmt: skip


def read_constraint(
    name: str, entry: written.Constraint, bodies: Collection[str], points: Mapping[str, Point], values: Values
) -> Constraint:
    """Return a checked constraint; what is wrong with it goes to the report of ``values``."""
    key = key_of("constraints", name)
    for field, types in KEYS.items():
        given = getattr(entry, field) is not None
        if given and entry.type not in types:
            values.report.add(f"{key}.{field}", f"a {entry.type} constraint has no {field}", f"type = {' or '.join(types)}")
        elif not given and entry.type in types and field in ("length", "radius"):
            values.report.add(key, f"a {entry.type} constraint needs a {field}", f"{field} = 1.0")
    first, second = (
        _frame(f"{key}.{side}", entry, frame, need, bodies, points, values)
        for side, frame, need in zip(("first", "second"), (entry.first, entry.second), _needs(entry), strict=True)
    )
    return Constraint(
        name=name,
        type=entry.type,
        first=first,
        second=second,
        drive=None if entry.drive is None else values.formula(f"{key}.drive", entry.drive, TIME),
        length=_positive(f"{key}.length", entry.length, values),
        radius=_positive(f"{key}.radius", entry.radius, values),
        shape=entry.shape or "disc",
    )


def _needs(entry: written.Constraint) -> tuple[Need, Need]:
    if entry.type == "revolute" and entry.drive is not None:
        return "x and z", "x and z"
    if entry.type == "rolling" and entry.shape == "sphere":
        return "z", "nothing"
    return AXES[entry.type]


def _positive(key: str, value: float | str | None, values: Values) -> Formula:
    if value is None:
        return Number(0.0)
    formula = values.formula(key, value, PARAMETERS)
    number = values.value(formula)
    if number <= 0.0:
        values.report.add(key, f"{number:.6g} m is not positive", "a length in m")
    return formula


def _frame(
    key: str,
    entry: written.Constraint,
    frame: written.Frame,
    need: Need,
    bodies: Collection[str],
    points: Mapping[str, Point],
    values: Values,
) -> Frame:
    report = values.report
    orientation = _orientation(key, entry, frame, need, values)
    if frame.point is None:
        position = ZERO_VECTOR if frame.position is None else values.vector(f"{key}.position", frame.position, PARAMETERS)
        if frame.body is None:
            report.add(key, "the frame belongs to no body", f'body = "{BASE}", or a point')
            return Frame(BASE, position, orientation)
        check_reference(f"{key}.body", frame.body, [BASE, *bodies], "body", report)
        return Frame(frame.body, position, orientation)
    for field in ("body", "position"):
        if getattr(frame, field) is not None:
            report.add(f"{key}.{field}", f"the point gives the {field} already", f"either point or {field}")
    if frame.point in (BASE, *bodies) and frame.point not in values.names.points:
        report.add(f"{key}.point", f"{frame.point} is a body, not a point", f'{{ body = "{frame.point}" }}')
    else:
        check_reference(f"{key}.point", frame.point, values.names.points, "point", report)
    point = points.get(frame.point, Point(frame.point, "", ZERO_VECTOR))
    return Frame(point.body, point.position, orientation)


def _orientation(
    key: str, entry: written.Constraint, frame: written.Frame, need: Need, values: Values
) -> tuple[tuple[float, float, float], ...]:
    """Return the frame's axes in the body: by rotations, or by z and, where the angle matters, x."""
    report = values.report
    if frame.rotation is not None:
        for field in ("axis", "x_axis"):
            if getattr(frame, field) is not None:
                report.add(f"{key}.{field}", f"{field} and rotation are both given", "one of them")
        return rows(sequence(values.constant_rotations(f"{key}.rotation", frame.rotation) or []))
    if frame.axis is None:
        if frame.x_axis is not None:
            report.add(f"{key}.x_axis", "x_axis has no meaning without axis, the z axis of the frame", "axis = [0, 0, 1]")
        elif need != "nothing" and entry.type != "fixed":
            extra = ", x_axis = [1, 0, 0]" if need == "x and z" else ""
            report.add(key, f"a {_kind(entry)} constraint needs the axes of this frame", f"axis = [0, 0, 1]{extra}, or rotation")
        return rows(sequence([]))
    if need == "nothing":
        report.add(f"{key}.axis", f"a {_kind(entry)} constraint has no axis in this frame", "only where the frame is")
    axis = values.axis(f"{key}.axis", frame.axis)
    if frame.x_axis is None:
        if need == "x and z":
            what = f"the angle about the axis matters to a {_kind(entry)} constraint, and axis does not say it"
            report.add(key, what, "x_axis = [1, 0, 0], in the axes of this body, or rotation")
        return rows(sequence([]) if axis is None else frame_about(axis))
    x_axis = values.axis(f"{key}.x_axis", frame.x_axis)
    if axis is None or x_axis is None:
        return rows(sequence([]))
    if abs(float(axis @ x_axis)) > 1.0 - 1e-9:
        report.add(f"{key}.x_axis", "x_axis is parallel to axis", "a direction across it")
        return rows(sequence([]))
    return rows(frame_about(axis, x_axis))


def _kind(entry: written.Constraint) -> str:
    return f"driven {entry.type}" if entry.drive is not None and entry.type in KEYS["drive"] else entry.type


def check_closings(constraints: Iterable[Constraint], joints: Sequence[Joint], report: Report) -> None:
    """Report constraints between two places of one rigid body, which fixed joints make of several.

    Parameters
    ----------
    joints : sequence of Joint
        Parents first.
    """
    host = {BASE: BASE, WORLD: WORLD}
    for joint in joints:
        host[joint.child] = host.get(joint.parent, joint.parent) if joint.type == "fixed" else joint.child
    for constraint in constraints:
        one, other = constraint.first.body, constraint.second.body
        if one in host and other in host and host[one] == host[other]:
            rigid = one if one == other else listed([one, other]) + ", which fixed joints make one body"
            key = key_of("constraints", constraint.name, "second")
            hint = "frames in two bodies that move against each other"
            report.add(key, f"both frames are in the same rigid body: {rigid}", hint)
