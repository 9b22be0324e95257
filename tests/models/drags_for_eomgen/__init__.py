"""Another distribution: the section ``drags`` of scenes, quadratic drag at a point, with its law in ``law``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from eomgen.base.text import key_of
from eomgen.formula.nodes import Formula, Vector
from eomgen.scene.forces.element import ForceElement
from eomgen.scene.forces.element_section import ElementSection, Site
from eomgen.scene.formula.scope import PARAMETERS, SPRING_FORCE
from eomgen.scene.reading.key_metadata import Table, key
from eomgen.scene.reading.kinds import Triple, Value
from eomgen.scene.reading.requirements import not_below_zero


class DragEntry(Table):
    """A drag on a point, against its velocity relative to the wind."""

    point: str = key("on which it acts", refers="points")
    coefficient: Value = key("force per squared velocity", unit="kg/m", names=PARAMETERS)
    wind: Triple = key("velocity of the air, in world axes", (0.0, 0.0, 0.0), unit="m/s", names=SPRING_FORCE)


@dataclass(frozen=True)
class Drag(ForceElement):
    """Drag -c v |v| on a point, with v relative to the wind in world axes."""

    section: ClassVar[str] = "drags"
    law: ClassVar[str] = "tests.models.drags_for_eomgen.law:LAW"

    point: str
    coefficient: Formula
    wind: Vector

    def formulas(self) -> Iterator[tuple[Formula, int]]:
        yield from ((formula, 0) for formula in self.wind)

    def passive(self) -> None:
        return None


def read_drag(name: str, entry: DragEntry, site: Site) -> Drag:
    """Return a checked drag."""
    place, values = key_of("drags", name), site.values
    values.point(f"{place}.point", entry.point)
    coefficient = values.formula(f"{place}.coefficient", entry.coefficient, PARAMETERS)
    return Drag(name, entry.point, coefficient, values.vector(f"{place}.wind", entry.wind, SPRING_FORCE))


DRAGS = ElementSection(
    key="drags",
    entry=DragEntry,
    model=Drag,
    reader=read_drag,
    bounds={"coefficient": not_below_zero("the coefficient of a drag")},
    offers={"drag": "element"},
    positional=("point", "coefficient"),
)
