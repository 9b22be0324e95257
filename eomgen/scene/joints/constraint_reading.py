"""Reading of constraints: permitted keys of each type, and the axes of the two frames that its equations use; reading
of reactions.

Frames never depend on the initial state, which need not close the loop.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from eomgen.base.text import key_of
from eomgen.formula.nodes import ZERO, Formula
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joint_types import CONSTRAINTS, TYPES, Need
from eomgen.scene.joints import schema as written
from eomgen.scene.joints.constraint_model import Constraint, Reaction
from eomgen.scene.joints.drives import read_law, read_length, read_smoothing
from eomgen.scene.joints.frames import check_two_bodies, read_frame
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.report import Report, check_reference
from eomgen.scene.reading.values import Values
from eomgen.system.description import BASE, WORLD, Point

#: Keys of some types only, in the order in which they are looked at.
_KEYS = ("drive", "length", "radius", "shape", "pitch")
_EXAMPLES = {"length": "1.0", "radius": "1.0", "pitch": "0.01"}


def read_constraint(
    name: str, entry: written.Constraint, bodies: Collection[str], points: Mapping[str, Point], values: Values
) -> Constraint:
    """Return a checked constraint; faults go to the report of ``values``."""
    key = key_of("constraints", name)
    for field in _KEYS:
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
    first, second = (
        read_frame(f"{key}.{side}", f"{_kind(entry)} constraint", frame, need, bodies, points, values)
        for side, frame, need in zip(("first", "second"), (entry.first, entry.second), _needs(entry), strict=True)
    )
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
        shape=entry.shape or Constraint.shape,
        pitch=_number(f"{key}.pitch", entry.pitch, values),
    )


def _needs(entry: written.Constraint) -> tuple[Need, Need]:
    if CONSTRAINTS[entry.type].drive == "angle" and entry.drive is not None:
        return "x and z", "x and z"
    if entry.shape == "sphere" and "shape" in CONSTRAINTS[entry.type].keys:
        return "z", "nothing"
    return CONSTRAINTS[entry.type].uses


def _number(key: str, value: float | str | None, values: Values) -> Formula:
    return ZERO if value is None else values.formula(key, value, PARAMETERS)


def _kind(entry: written.Constraint) -> str:
    return f"driven {entry.type}" if entry.drive is not None and CONSTRAINTS[entry.type].drive else entry.type


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
