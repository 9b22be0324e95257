"""Springs in scene files, keys and data: springs, dampers and actuators along the line between two points, and
torsional springs between the angles of joints."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Self

from eomgen.base.data import dataclass, replace
from eomgen.base.messages import key_of
from eomgen.formula.nodes import ZERO, Formula
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection
from eomgen.scene.formula.scope import PARAMETERS, SPRING_FORCE
from eomgen.scene.joint_types import JOINTS
from eomgen.scene.joints.frames import Site
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Value
from eomgen.scene.reading.report import check_reference
from eomgen.scene.reading.requirements import not_below_zero
from eomgen.system.description import Line


class SpringEntry(Table):
    """A spring, damper or actuator along the line between two points."""

    first: str = key("one end", refers="points")
    second: str = key("the other end", refers="points")
    stiffness: Value = key("tension by length beyond `length`", 0.0, unit="N/m", names=PARAMETERS)
    damping: Value = key("tension by rate of length", 0.0, unit="N s/m", names=PARAMETERS)
    length: Value = key("length at which the spring is slack", 0.0, unit="m", names=PARAMETERS)
    force: Value = key("an actuator in parallel", 0.0, unit="N", names=SPRING_FORCE)


@dataclass(frozen=True)
class Spring(ForceElement):
    """Spring-damper along the line between two points: tension = stiffness (l - length) + damping l' + force.

    ``force`` is a formula of everything (an actuator in parallel), a tension: positive pulls the points together.
    Stiffness, damping and free length are formulas of parameters.
    """

    section: ClassVar[str] = "springs"
    law: ClassVar[str] = "eomgen.mechanics.forces.springs:LAW"

    first: str
    second: str
    stiffness: Formula
    damping: Formula
    length: Formula
    force: Formula = ZERO

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield self.force, 0

    def passive(self) -> Self:
        return replace(self, force=ZERO)

    def lengths(self) -> tuple[Formula, ...]:
        return (self.length,)

    def drawn(self) -> Line:
        return Line(self.name, self.first, self.second, self.stiffness != ZERO, self.length)


def read_spring(name: str, spring: SpringEntry, site: Site) -> Spring:
    """Return the spring of an entry of [springs]; unknown points, and a spring from a point to itself, are reported."""
    key, values = key_of("springs", name), site.values
    known = True
    for field, point in (("first", spring.first), ("second", spring.second)):
        known = values.point(f"{key}.{field}", point) and known
    if known and spring.first == spring.second:
        fault = f"the spring connects the point {spring.first} to itself [E1502]"
        values.report.add(f"{key}.second", fault, "another point")
    return Spring(name, **values.keys(key, spring))


SECTION = ElementSection(
    key="springs",
    entry=SpringEntry,
    model=Spring,
    reader=read_spring,
    bounds={**dict.fromkeys(("stiffness", "damping")), "length": not_below_zero("the length of a spring [E1761]")},
    offers={"length": "element", "rate": "element", "tension": "tension"},
    positional=("first", "second"),
    documentation="Add a spring, damper or actuator along the line between two points; ``force`` is a tension.",
)


class TorsionSpringEntry(Table):
    """A spring and damper between the angles of two joints."""

    first: str = key("one angle", refers="joints", kind="joint that has an angle")
    second: str = key(
        "the other angle", "", refers="joints", kind="joint that has an angle", shown_default='`""`, none'
    )
    stiffness: Value = key("effort by angle", 0.0, unit="N m/rad", names=PARAMETERS)
    damping: Value = key("effort by rate", 0.0, unit="N m s/rad", names=PARAMETERS)
    rest: Value = key("difference of the angles at which the spring is slack", 0.0, unit="rad", names=PARAMETERS)
    first_index: int = key("index of the angle of a joint with two, as a universal one", 0, ge=0, le=1)
    second_index: int = key("the same of the second joint", 0, ge=0, le=1)


@dataclass(frozen=True)
class TorsionSpring(ForceElement):
    """Torsional spring-damper between two angles, coordinates of joints (or one angle and a rest angle, ``second``
    empty).

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
    """Return the torsion spring of an entry of [torsion_springs], between two angles or on one angle; joints without
    the angle, and a spring from an angle to itself, are reported."""
    key, values, joints = key_of("torsion_springs", name), site.values, site.values.names.joints
    ends = (("first", spring.first, spring.first_index), ("second", spring.second, spring.second_index))
    for field, joint, index in ends:
        if field == "second" and not joint:
            continue
        known = check_reference(f"{key}.{field}", joint, joints, "joint", values.report)
        angles = JOINTS[joints[joint]].angles if known and joints[joint] else 0
        if known and joints[joint] and not angles:
            fault = f"the joint {joint} is {joints[joint]} and has no angle [E1503]"
            values.report.add(f"{key}.{field}", fault, "a revolute joint")
        elif angles and index >= angles:
            fault = f"the {joints[joint]} joint {joint} has no angle {index} [E1504]"
            values.report.add(f"{key}.{field}_index", fault, "0" if angles == 1 else "0 or 1")
    if spring.first == spring.second in joints and spring.first_index == spring.second_index:
        fault = f"the spring connects the joint {spring.first} to itself [E1505]"
        values.report.add(f"{key}.second", fault, "another joint, or none")
    return TorsionSpring(name, **values.keys(key, spring))


TORSION_SECTION = ElementSection(
    key="torsion_springs",
    entry=TorsionSpringEntry,
    model=TorsionSpring,
    reader=read_torsion_spring,
    bounds=dict.fromkeys(("stiffness", "damping", "rest")),
    positional=("first", "second"),
    documentation="Add a torsion spring between two joints' angles, or between one and its rest angle.",
)
