"""Generalized forces on components of joints, by formulas."""

from __future__ import annotations

from eomgen.formula.nodes import Symbol
from eomgen.mechanics.forces.loads import Law, Loads, add_effort
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.scene.forces.efforts import Effort


def record_effort(loads: Loads, item: Effort, quantities: Quantities) -> None:
    """Add an effort and its power."""
    value = quantities.formula(item.effort)
    add_effort(loads, quantities, item.joint, value, item.index)
    loads.power = loads.power + value * quantities(Symbol("v", item.joint, item.index))


LAW = Law(Effort, record_effort)
