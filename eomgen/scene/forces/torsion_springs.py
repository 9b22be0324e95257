"""Torsional springs and dampers between the angles of joints."""

from __future__ import annotations

from typing import ClassVar

from eomgen.base.data import dataclass
from eomgen.base.text import key_of
from eomgen.formula.nodes import ZERO, Formula
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection, Site
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.report import check_reference


class TorsionSpringEntry(Table):
    """A spring and damper between the angles of two joints."""

    first: str = key("one angle", refers="joints", kind="joint that has an angle")
    second: str = key(
        "the other angle", "", refers="joints", kind="joint that has an angle", shown_default='`""`, none'
    )
    stiffness: Value = key("effort by angle", 0.0, unit="N m/rad", names=PARAMETERS)
    damping: Value = key("effort by rate", 0.0, unit="N m s/rad", names=PARAMETERS)
    rest: Value = key("difference of the angles at which the spring is slack", 0.0, unit="rad", names=PARAMETERS)
    first_index: int = key("of the angle of a joint with two, as a universal one", 0, ge=0, le=1)
    second_index: int = key("the same of the second", 0, ge=0, le=1)


@dataclass(frozen=True)
class TorsionSpring(ForceElement):
    """Torsional spring-damper between two angles, coordinates of joints (or one and its rest angle, ``second`` empty).

    Effort on ``first``: -(stiffness (q1 - q2 - rest) + damping (v1 - v2)), opposite on ``second``.
    """

    section: ClassVar[str] = "torsion_springs"
    law: ClassVar[str] = "eomgen.mechanics.forces.springs:TORSION_LAW"

    first: str
    second: str
    stiffness: Formula
    damping: Formula
    rest: Formula
    first_index: int = 0
    second_index: int = 0

    def angles(self) -> tuple[tuple[str, int], ...]:
        return () if self.stiffness == ZERO else ((self.first, self.first_index), (self.second, self.second_index))


def read_torsion_spring(name: str, spring: TorsionSpringEntry, site: Site) -> TorsionSpring:
    """Return a torsion spring between the angles of two joints, or of one."""
    key, values, joints = key_of("torsion_springs", name), site.values, site.values.names.joints
    ends = (("first", spring.first, spring.first_index), ("second", spring.second, spring.second_index))
    for field, joint, index in ends:
        if field == "second" and not joint:
            continue
        known = check_reference(f"{key}.{field}", joint, joints, "joint", values.report)
        angles = JOINTS[joints[joint]].angles if known and joints[joint] else 0
        if known and joints[joint] and not angles:
            fault = f"the joint {joint} is {joints[joint]} and has no angle"
            values.report.add(f"{key}.{field}", fault, "a revolute joint")
        elif angles and index >= angles:
            fault = f"the {joints[joint]} joint {joint} has no angle {index}"
            values.report.add(f"{key}.{field}_index", fault, "0" if angles == 1 else "0 or 1")
    if spring.first == spring.second in joints and spring.first_index == spring.second_index:
        values.report.add(
            f"{key}.second", f"the spring connects the joint {spring.first} to itself", "another joint, or none"
        )
    fields = ("stiffness", "damping", "rest")
    constants = [values.formula(f"{key}.{field}", getattr(spring, field), PARAMETERS) for field in fields]
    stiffness, damping, rest = constants
    indices = {"first_index": spring.first_index, "second_index": spring.second_index}
    return TorsionSpring(name, spring.first, spring.second, stiffness, damping, rest, **indices)


SECTION = ElementSection(
    key="torsion_springs",
    entry=TorsionSpringEntry,
    model=TorsionSpring,
    reader=read_torsion_spring,
    bounds=dict.fromkeys(("stiffness", "damping", "rest")),
    positional=("first", "second"),
    documentation="Add a torsion spring between two joints' angles, or between one and its rest angle.",
    always=True,
)
