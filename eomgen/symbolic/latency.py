"""Critical path of recorded operations, and the time that a processor is expected to take for them.

A processor of today runs independent operations side by side, so the longest chain of operations that wait for each
other decides as much as their number. Latencies are typical of x86-64 and AArch64 cores (Fog, Instruction tables, 2022:
Zen 3, Ice Lake); a product that only one sum takes is fused with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

from eomgen.symbolic.external import Call
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import Ref, Tape

#: Cycles from operands to result.
LATENCIES = dict.fromkeys((Op.ADD, Op.SUB, Op.MUL, Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT), 4)
LATENCIES |= {Op.DIV: 14, Op.SQRT: 18}
#: Of functions that are polynomials with a reduction of the argument before.
FUNCTION = 60
#: Cycles of an operation off the critical path. Measured on forward dynamics of 14 trees of 2 to 18 degrees of freedom
#: (gcc 12, AVX-512, both algorithms): critical path + 0.3 operations fits times to 20 %.
SHARE = 0.3


def critical_path(tape: Tape, outputs: Iterable[Ref]) -> int:
    """Return the cycles of the longest chain of operations before the outputs.

    Elements of a Map run side by side and sums wait for one another; a Map with a carry counts as if each element
    waited for the whole previous element.
    """
    outputs = list(outputs)
    live = tape.live(outputs)
    uses = Counter(abs(ref) for node in live if tape.op[node] is not Op.MAP for ref in tape.operands(node))
    ready: dict[int, int] = {}
    loops: dict[int, int] = {}  # results of a Map have the same operands: one visit keeps this linear

    def last(refs: Iterable[Ref]) -> int:
        return max((ready[abs(ref)] for ref in refs), default=0)

    for node in live:
        op = tape.op[node]
        if op in LEAVES:
            ready[node] = 0
        elif op is Op.MAP:
            number = tape.a[node]
            if number not in loops:
                loop: Any = tape.maps[number]  # a Map or a Call, which know Tape
                whole = FUNCTION
                if not isinstance(loop, Call):
                    one = critical_path(loop.kernel, loop.kernel_refs)
                    whole = loop.count * one if loop.initial else one + LATENCIES[Op.ADD] * loop.count * bool(loop.sums)
                loops[number] = last(tape.operands(node)) + whole
            ready[node] = loops[number]
        elif op in (Op.ADD, Op.SUB):
            x, y = operands = [abs(ref) for ref in tape.operands(node)]
            starts = [last(operands)]
            for product, other in ((x, y), (y, x)):
                if tape.op[product] is Op.MUL and uses[product] == 1:
                    starts.append(max(last(tape.operands(product)), ready[other]))
            ready[node] = min(starts) + LATENCIES[op]
        else:
            ready[node] = last(tape.operands(node)) + LATENCIES.get(op, FUNCTION)
    return max((ready[abs(ref)] for ref in outputs), default=0)


def expected_cycles(tape: Tape, outputs: Iterable[Ref]) -> float:
    """Return the cycles that a call is expected to take, to compare algorithms for the same outputs."""
    outputs = list(outputs)
    return critical_path(tape, outputs) + SHARE * tape.counts(outputs).weight
