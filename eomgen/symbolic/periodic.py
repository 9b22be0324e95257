"""Detection of angles: inputs in which all outputs have period 2 pi by structure."""

from __future__ import annotations

from collections.abc import Iterable

from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.tape import Ref, Tape


def periodic_inputs(tape: Tape, outputs: Iterable[Ref]) -> set[InputSymbol]:
    """Return the inputs that may be reduced modulo 2 pi without changing any output.

    A node may be shifted by multiples of 2 pi if all its uses are sines and cosines, or sums, differences and integer
    multiples that may be shifted themselves. Outputs may not.
    """
    as_it_is = {abs(ref) for ref in set(outputs)}
    periodic = set()
    gathered: set[int] = set()  # by Maps, whose results share their operands
    for node in reversed(tape.live(as_it_is)):
        op = tape.op[node]
        if op is Op.MAP:
            if tape.a[node] in gathered:
                continue
            gathered.add(tape.a[node])
        if op is Op.INPUT and node not in as_it_is:
            periodic.add(tape.inputs[tape.a[node]])
        if op not in (Op.SIN, Op.COS) and (node in as_it_is or not _preserves_period(tape, node)):
            as_it_is.update(abs(ref) for ref in tape.operands(node))
    return periodic


def _preserves_period(tape: Tape, node: int) -> bool:
    """Return whether shifts of the operands by multiples of 2 pi shift the result by a multiple of 2 pi."""
    if tape.op[node] is Op.MUL:
        return any((value := tape.value(ref)) is not None and value == int(value) for ref in tape.operands(node))
    return tape.op[node] in (Op.ADD, Op.SUB)
