"""Time derivatives of prescribed inputs: of the base's motion, and of inputs given as functions of time."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.symbolic.calculus.jets import jets, time_derivatives
from eomgen.symbolic.operations import InputSymbol
from eomgen.symbolic.scalar import Scalar
from eomgen.symbolic.tape import ONE, Ref, Tape
from eomgen.system.system import RATE_BLOCKS, Block, base_place


def base_rates(tape: Tape, law: Sequence[Scalar], order: int) -> Block:
    """Return the block ``base_rates``: derivatives 2 to order + 1 of the base's twist, (order, 6) row by row."""
    start = base_place("omega_dot")
    paths = _over_time(tape, law[start : start + 6], order)
    refs = tuple(path[k] for k in range(1, order + 1) for path in paths)
    description = "time derivatives of the components of omega and velocity, from the second on"
    return Block("base_rates", (order, 6), refs, description)


def input_rates(tape: Tape, values: Sequence[Scalar], order: int) -> tuple[Block, ...]:
    """Return the blocks ``u_dot``, ``u_ddot`` and ``u_higher``, as many as the order needs."""
    paths = _over_time(tape, values, order)
    first, second, higher = RATE_BLOCKS["u"]
    blocks = [
        Block(name, (len(values),), tuple(path[k] for path in paths), f"time derivative {k} of the inputs")
        for k, name in ((1, first), (2, second))
        if k <= order
    ]
    if order > 2:
        refs = tuple(path[k] for k in range(3, order + 1) for path in paths)
        blocks.append(
            Block(higher, (order - 2, len(values)), refs, "time derivatives of the inputs, from the third on")
        )
    return tuple(blocks)


def _over_time(tape: Tape, values: Sequence[Scalar], order: int) -> list[list[Ref]]:
    time = InputSymbol("t", 0)
    series = jets(tape, [value.ref for value in values], {time: [tape.input("t"), ONE]}, order)
    return [time_derivatives(tape, jet) for jet in series]
