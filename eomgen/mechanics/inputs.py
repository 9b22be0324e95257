"""What the driver hands in as inputs: formulas of time, and sums of harmonics as one loop over a table."""

from __future__ import annotations

from eomgen.mechanics.quantities import Quantities
from eomgen.scene.scene import Input
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Op, Tape


def input_signal(quantities: Quantities, item: Input) -> Scalar:
    """Return an input as a function of time; zero where the scene does not say what it is."""
    algebra = quantities.algebra
    value = quantities.formula(item.formula) if item.formula is not None else algebra.zero
    if not item.harmonics:
        return value
    kernel = Tape()
    inner = Algebra(kernel)
    amplitude, frequency, phase = inner.block("element", 3)
    wave = amplitude * inner.call(Op.COS, frequency * inner.block("shared", 1)[0] + phase)
    columns = tuple(zip(*item.harmonics, strict=True))
    loop = Map(
        kernel, len(item.harmonics), elements=columns, shared=(algebra.tape.input("t"),), sums=(wave.ref,),
        label=f"harmonics of input {item.name}",
    )  # fmt: skip
    return value + Scalar(algebra.tape, add_map(algebra.tape, loop).sums[0])
