"""Periodic functions on a tape: sums of harmonics as loops, and inputs in which all outputs have period 2 pi by
structure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from eomgen.symbolic.map import Map
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.scalar import Algebra
from eomgen.symbolic.tape import Ref, Tape

#: Columns a, w, b of the sum of a cos(w x) + b sin(w x).
Columns = tuple[tuple[float, ...], ...]


def harmonic_sum(columns: Sequence[Sequence[float]], along: Ref, label: str = "") -> Map:
    """Return the loop that sums a cos(w x) + b sin(w x) over all harmonics. ``columns`` are the numbers a, w and b of
    all harmonics, ``along`` is the reference of x."""
    kernel = Tape()
    inner = Algebra(kernel)
    in_phase, frequency, quadrature = inner.block("element", 3)
    angle = frequency * inner.block("shared", 1)[0]
    wave = in_phase * inner.call(Op.COS, angle) + quadrature * inner.call(Op.SIN, angle)
    elements = tuple(tuple(column) for column in columns)
    return Map(kernel, len(elements[0]), elements=elements, shared=(along,), sums=(wave.ref,), label=label)


def harmonics_in(tape: Tape, ref: Ref, symbol: InputSymbol) -> Columns | None:
    """Return the columns a, w and b if a reference is a sum of harmonics a cos(w x) + b sin(w x) of the input
    ``symbol``. None for any other expression."""
    node = abs(ref)
    if tape.op[node] is not Op.MAP or tape.b[node] != 0:
        return None
    loop = tape.maps[tape.a[node]]
    if (
        not isinstance(loop, Map)
        or len(loop.shared) != 1
        or len(loop.elements) != 3
        or tape.symbol(loop.shared[0]) != symbol
    ):
        return None
    if harmonic_sum(loop.elements, loop.shared[0]).key != loop.key:
        return None
    in_phase, frequencies, quadrature = loop.elements
    sign = 1.0 if ref > 0 else -1.0
    return tuple(sign * a for a in in_phase), frequencies, tuple(sign * b for b in quadrature)


def periodic_inputs(tape: Tape, outputs: Iterable[Ref]) -> set[InputSymbol]:
    """Return the inputs that may be reduced modulo 2 pi without changing any output. A node may be shifted by multiples
    of 2 pi if all its uses are sines and cosines, or sums, differences and integer multiples that may also be shifted.
    Outputs may not be shifted."""
    as_it_is = {abs(ref) for ref in set(outputs)}
    periodic = set()
    gathered: set[int] = set()  # by Maps, whose results have the same operands
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
