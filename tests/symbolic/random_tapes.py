"""Random tapes and the two foreign roads to their derivatives: complex step on NumPy, and mpmath at fifty digits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from hypothesis import strategies
from numpy.typing import NDArray

from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import UNARY, Op
from eomgen.symbolic.tape import ONE, Ref, Tape

#: Operations of two arguments, and all whose derivatives have no jump.
BINARY = (Op.ADD, Op.SUB, Op.MUL, Op.DIV, Op.POW, Op.ATAN2, Op.MIN, Op.MAX, Op.LT, Op.LE)
SMOOTH = (*BINARY[:6], *sorted(UNARY - {Op.ABS, Op.SIGN}))
EVERY = (*sorted(UNARY), *BINARY)


def record(tape: Tape, op: Op, x: Ref, y: Ref) -> Ref:
    """Record an operation of one argument or of two."""
    if op in UNARY:
        return tape.call(op, x)
    special = {Op.ADD: tape.add, Op.SUB: tape.sub, Op.MUL: tape.mul, Op.DIV: tape.div}
    return special[op](x, y) if op in special else tape.call(op, x, y)


def apply_tamed(tape: Tape, op: Op, x: Ref, y: Ref) -> Ref:
    """Record an operation on arguments brought into its domain and kept of size one, so that any chain of them stays
    tame."""
    if op in (Op.ADD, Op.SUB, Op.MUL):
        return {Op.ADD: tape.add, Op.SUB: tape.sub, Op.MUL: tape.mul}[op](tape.call(Op.SIN, x), y)
    inside = tape.mul(tape.constant(0.75), tape.call(Op.SIN, x))  # in (-0.75, 0.75)
    above = tape.add(tape.constant(1.5), tape.call(Op.COS, y))  # in (0.5, 2.5)
    if op is Op.DIV:
        return tape.div(inside, above)
    if op in (Op.SQRT, Op.LOG):
        return tape.call(op, above)
    if op is Op.POW:
        return tape.call(op, above, inside)
    if op is Op.ATAN2:
        return tape.call(op, tape.sub(inside, ONE), tape.sub(above, tape.constant(3.0)))
    if op in (Op.MIN, Op.MAX, Op.LT, Op.LE):
        return tape.call(op, x, y)
    if op is Op.SELECT:
        return tape.select(tape.call(Op.LT, x, y), inside, above)
    return tape.call(op, inside)


def build(program: Sequence[tuple[Op, int, int, bool]], inputs: int = 3) -> tuple[Tape, list[Ref], list[Ref]]:
    """Return a tape, its inputs ``x`` and its outputs (the last three results) from a list of instructions."""
    tape = Tape()
    symbols = [tape.input("x", k) for k in range(inputs)]
    refs = list(symbols)
    for op, first, second, negative in program:
        x, y = refs[first % len(refs)], refs[second % len(refs)]
        refs.append(apply_tamed(tape, op, -x if negative else x, y))
    return tape, symbols, refs[-3:]


programs = strategies.lists(
    strategies.tuples(
        strategies.sampled_from(SMOOTH), strategies.integers(0, 40), strategies.integers(0, 40), strategies.booleans()
    ),
    min_size=1,
    max_size=14,
)
points = strategies.lists(strategies.floats(-2.0, 2.0, allow_subnormal=False), min_size=3, max_size=3)


def complex_step(
    tape: Tape, refs: Sequence[Ref], inputs: Mapping[str, Sequence[float]], block: str
) -> NDArray[np.float64]:
    """Return the Jacobian of references with respect to a block, one row per reference."""
    size = len(inputs[block])
    step = 1e-40
    batch = {name: np.asarray(value, dtype=complex) for name, value in inputs.items()}
    batch[block] = batch[block] + 1j * step * np.eye(size)
    return np.asarray(evaluate(tape, refs, batch).imag.T / step)
