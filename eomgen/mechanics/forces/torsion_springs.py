"""Torsional springs and dampers between the angles of joints."""

from __future__ import annotations

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.forces.loads import Law, Loads, add_effort
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.scene.forces.torsion_springs import TorsionSpring


def add_torsion_spring(loads: Loads, torsion: TorsionSpring, quantities: Quantities) -> None:
    """Add opposite efforts on both angles, their potential and the power of damping."""
    angle, rate = (quantities(Symbol(kind, torsion.first, torsion.first_index)) for kind in "qv")
    if torsion.second:
        other_angle, other_rate = (quantities(Symbol(kind, torsion.second, torsion.second_index)) for kind in "qv")
        angle, rate = angle - other_angle, rate - other_rate
    stretch, stiffness = angle - quantities.formula(torsion.rest), quantities.formula(torsion.stiffness)
    damping = quantities.formula(torsion.damping)
    effort = stiffness * stretch + damping * rate
    add_effort(loads, quantities, torsion.first, -effort, torsion.first_index)
    if torsion.second:
        add_effort(loads, quantities, torsion.second, effort, torsion.second_index)
    loads.potential = loads.potential + 0.5 * (stiffness * (stretch * stretch))
    loads.power = loads.power - damping * (rate * rate)


LAW = Law(TorsionSpring, add_torsion_spring)
