"""Constraints from the written form: what each type may carry, and what its equations use of its two frames.

Nothing is ever taken from the initial state, which need not close the loop.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

from eomgen.formula.nodes import ZERO, Formula
from eomgen.scene.bodies.model import Point
from eomgen.scene.formula.scope import PARAMETERS, TIME
from eomgen.scene.joints import schema as written
from eomgen.scene.joints.constraint_model import Constraint
from eomgen.scene.joints.frames import Need, check_two_bodies, read_frame
from eomgen.scene.joints.model import Joint
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import Values
from eomgen.scene.signals.curves import check_twice_differentiable
from eomgen.text import key_of

#: What the equations of each type use of the first and the second frame, besides the origin.
AXES: Mapping[str, tuple[Need, Need]] = {
    "spherical": ("nothing", "nothing"), "distance": ("nothing", "nothing"), "revolute": ("z", "z"), "cylindrical": ("z", "z"),
    "planar": ("z", "z"), "point_on_line": ("z", "nothing"), "rolling": ("z", "z"), "universal": ("x and z", "x and z"),
    "prismatic": ("x and z", "x and z"), "helical": ("x and z", "x and z"), "fixed": ("any", "any"),
}  # fmt: skip

#: The types that each further key belongs to; ``length``, ``radius`` and ``pitch`` are needed there.
KEYS: Mapping[str, tuple[str, ...]] = {
    "drive": ("revolute", "prismatic", "cylindrical"), "length": ("distance",), "radius": ("rolling",), "shape": ("rolling",),
    "pitch": ("helical",),
}  # fmt: skip

_EXAMPLES = {"length": "1.0", "radius": "1.0", "pitch": "0.01"}


def read_constraint(
    name: str, entry: written.Constraint, bodies: Collection[str], points: Mapping[str, Point], values: Values
) -> Constraint:
    """Return a checked constraint; what is wrong with it goes to the report of ``values``."""
    key = key_of("constraints", name)
    for field, types in KEYS.items():
        given = getattr(entry, field) is not None
        if given and entry.type not in types:
            values.report.add(f"{key}.{field}", f"a {entry.type} constraint has no {field}", f"type = {' or '.join(types)}")
        elif not given and entry.type in types and field in _EXAMPLES:
            values.report.add(key, f"a {entry.type} constraint needs a {field}", f"{field} = {_EXAMPLES[field]}")
    first, second = (
        read_frame(f"{key}.{side}", f"{_kind(entry)} constraint", frame, need, bodies, points, values)
        for side, frame, need in zip(("first", "second"), (entry.first, entry.second), _needs(entry), strict=True)
    )
    return Constraint(
        name=name,
        type=entry.type,
        first=first,
        second=second,
        drive=_drive(key, entry.drive, values),
        length=_number(f"{key}.length", entry.length, values),
        radius=_number(f"{key}.radius", entry.radius, values),
        shape=entry.shape or "disc",
        pitch=_number(f"{key}.pitch", entry.pitch, values),
    )


def _drive(key: str, drive: float | str | None, values: Values) -> Formula | None:
    if drive is None:
        return None
    formula = values.formula(f"{key}.drive", drive, TIME)
    check_twice_differentiable(f"{key}.drive", [formula], values.report)
    return formula


def _needs(entry: written.Constraint) -> tuple[Need, Need]:
    if entry.type == "revolute" and entry.drive is not None:
        return "x and z", "x and z"
    if entry.type == "rolling" and entry.shape == "sphere":
        return "z", "nothing"
    return AXES[entry.type]


def _number(key: str, value: float | str | None, values: Values) -> Formula:
    return ZERO if value is None else values.formula(key, value, PARAMETERS)


def _kind(entry: written.Constraint) -> str:
    return f"driven {entry.type}" if entry.drive is not None and entry.type in KEYS["drive"] else entry.type


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
