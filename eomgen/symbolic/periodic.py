"""Inputs of which every output is a function of period 2 pi, by structure: angles that only sines and cosines see."""

from __future__ import annotations

from collections.abc import Iterable

from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.tape import Ref, Tape


def periodic_inputs(tape: Tape, outputs: Iterable[Ref]) -> set[InputSymbol]:
    """Return the input symbols that outputs depend on and that whole turns (multiples of 2 pi) can be taken off.

    An intermediate may be changed by whole turns when all its uses are sines and cosines, or sums, differences and integer
    multiples that may be themselves. Anything else, an output in the first place, wants the number as it is.
    """
    outputs = [abs(ref) for ref in outputs]
    as_it_is = set(outputs)
    found = set()
    for node in reversed(tape.live(outputs)):
        op = tape.op[node]
        if op is Op.INPUT and node not in as_it_is:
            found.add(tape.inputs[tape.a[node]])
        if op not in (Op.SIN, Op.COS) and (node in as_it_is or not _preserves_period(tape, node)):
            as_it_is.update(abs(ref) for ref in tape.operands(node))
    return found


def _preserves_period(tape: Tape, node: int) -> bool:
    """Return whether whole turns of the operands are whole turns of the result."""
    if tape.op[node] is Op.MUL:
        return any((value := tape.value(ref)) is not None and value == int(value) for ref in tape.operands(node))
    return tape.op[node] in (Op.ADD, Op.SUB)
