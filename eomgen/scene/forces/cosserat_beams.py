"""Geometrically exact beams as force elements: the elastic forces in a chain of equal frames on SE(3).

The nodes are bodies of the scene; this is the elasticity between neighbours.
"""

from __future__ import annotations

from typing import ClassVar

from eomgen.base.data import dataclass
from eomgen.formula.nodes import Formula, Number
from eomgen.scene.bodies.cosserat import Cosserat
from eomgen.scene.forces.element import ForceElement


@dataclass(frozen=True)
class CosseratBeam(ForceElement):
    """Elasticity and damping of a geometrically exact beam."""

    section: ClassVar[str] = "beams"
    law: ClassVar[str] = "eomgen.mechanics.forces.cosserat_beams:LAW"

    beam: Cosserat

    def lengths(self) -> tuple[Formula, ...]:
        return (Number(self.beam.length),)
