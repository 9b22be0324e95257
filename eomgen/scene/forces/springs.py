"""Springs, dampers and actuators along the line between two points."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Self

from eomgen.base.data import dataclass, replace
from eomgen.base.text import key_of
from eomgen.formula.nodes import ZERO, Formula
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection, Site
from eomgen.scene.formula.scope import PARAMETERS, SPRING_FORCE
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Value
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
    """Return a spring along the line between two points."""
    key, values, formula = key_of("springs", name), site.values, site.values.formula
    known = True
    for field, point in (("first", spring.first), ("second", spring.second)):
        known = values.point(f"{key}.{field}", point) and known
    if known and spring.first == spring.second:
        values.report.add(f"{key}.second", f"the spring connects the point {spring.first} to itself", "another point")
    fields = ("stiffness", "damping", "length")
    stiffness, damping, length = (formula(f"{key}.{field}", getattr(spring, field), PARAMETERS) for field in fields)
    force = formula(f"{key}.force", spring.force, SPRING_FORCE)
    return Spring(name, spring.first, spring.second, stiffness, damping, length, force)


SECTION = ElementSection(
    key="springs",
    entry=SpringEntry,
    model=Spring,
    reader=read_spring,
    bounds={**dict.fromkeys(("stiffness", "damping")), "length": not_below_zero("the length of a spring")},
    offers={"length": "element", "rate": "element", "tension": "tension"},
    positional=("first", "second"),
    documentation="Add a spring, damper or actuator along the line between two points; ``force`` is a tension.",
    always=True,
)
