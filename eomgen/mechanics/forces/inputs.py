"""What the driver hands in as inputs: formulas of time, and sums of harmonics as one loop over a table."""

from __future__ import annotations

from eomgen.mechanics.expressions.curves import waves
from eomgen.mechanics.forces.symbols import Quantities
from eomgen.scene.formula.piecewise import Waves
from eomgen.scene.scene import Input
from eomgen.symbolic.scalar import Scalar


def input_signal(quantities: Quantities, item: Input) -> Scalar:
    """Return an input as a function of time; zero where the scene does not say what it is."""
    algebra = quantities.algebra
    value = quantities.formula(item.formula) if item.formula is not None else algebra.zero
    if not item.harmonics:
        return value
    time = Scalar(algebra.tape, algebra.tape.input("t"))
    return value + waves(algebra, Waves(f"input {item.name}", item.harmonics), time)
