"""Critical path of recorded operations, and the time that a processor is expected to take for them.

A processor of today runs independent operations side by side, so the longest chain of operations that wait for each
other decides as much as their number. Latencies are typical of x86-64 and AArch64 cores (Fog, Instruction tables, 2022:
Zen 3, Ice Lake); a product that only one sum takes is fused with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

from eomgen.symbolic.external import Call
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import Ref, Tape

#: Cycles from operands to result.
LATENCIES = dict.fromkeys((Op.ADD, Op.SUB, Op.MUL, Op.ABS, Op.SIGN, Op.MIN, Op.MAX, Op.LT, Op.LE, Op.SELECT), 4)
LATENCIES |= {Op.DIV: 14, Op.SQRT: 18}
#: Of functions that are polynomials with a reduction of the argument before.
FUNCTION = 60
_SUM, _PRODUCT = LATENCIES[Op.ADD], LATENCIES[Op.MUL]
#: Operations as globals: looking a member up in an enumeration takes five times as long.
_ADD, _SUB, _MUL, _MAP = Op.ADD, Op.SUB, Op.MUL, Op.MAP
#: Cycles of an operation off the critical path. Measured on forward dynamics of 14 trees of 2 to 18 degrees of freedom
#: (gcc 12, AVX-512, both algorithms): critical path + 0.3 operations fits times to 20 %.
SHARE = 0.3


def critical_path(tape: Tape, outputs: Iterable[Ref]) -> int:
    """Return the expected processor cycles of the longest chain of operations that the outputs depend on. Elements of a
    Map run side by side and sums wait for one another; a Map with a carry counts as if each element waited for the
    whole previous element."""
    outputs = list(outputs)
    ops, a, b = tape.op, tape.a, tape.b
    live = tape.live(outputs)
    uses = Counter(abs(ref) for node in live if ops[node] is not _MAP for ref in tape.operands(node))
    ready = [0] * len(ops)
    loops: dict[int, int] = {}  # results of a Map have the same operands: one visit keeps this linear

    def last(refs: Iterable[Ref]) -> int:
        return max((ready[abs(ref)] for ref in refs), default=0)

    for node in live:  # without calls for most nodes: forward dynamics of a humanoid have 20 000
        op = ops[node]
        if op is _ADD or op is _SUB:
            x, y = abs(a[node]), abs(b[node])
            of_x, of_y = ready[x], ready[y]
            start = of_x if of_x > of_y else of_y
            for product, of_other in ((x, of_y), (y, of_x)):
                if ops[product] is _MUL and uses[product] == 1:
                    fused = max(ready[abs(a[product])], ready[abs(b[product])], of_other)
                    start = min(start, fused)
            ready[node] = start + _SUM
        elif op is _MUL:
            of_x, of_y = ready[abs(a[node])], ready[abs(b[node])]
            ready[node] = (of_x if of_x > of_y else of_y) + _PRODUCT
        elif op is _MAP:
            number = a[node]
            if number not in loops:
                loop: Any = tape.maps[number]  # a Map or a Call, which know Tape
                whole = FUNCTION
                if not isinstance(loop, Call):
                    element = critical_path(loop.kernel, loop.kernel_refs)
                    whole = loop.count * element if loop.initial else element + _SUM * loop.count * bool(loop.sums)
                loops[number] = last(tape.operands(node)) + whole
            ready[node] = loops[number]
        elif op not in LEAVES:
            ready[node] = last(tape.operands(node)) + LATENCIES.get(op, FUNCTION)
    return max((ready[abs(ref)] for ref in outputs), default=0)


def waits(tape: Tape, outputs: Sequence[Ref]) -> bool:
    """Return whether the critical path dominates the time of the operations, so that shortening the path saves time.
    False for large functions, from a weight of 2500 on."""
    weight = tape.counts(outputs).weight
    # From a weight of 2500 on functions repeat themselves body by body, and share the text of these repeats. Forward
    # dynamics of chains of 3 to 10 rods, UR5 and Panda take 9 to 18 % less time with shorter paths, in lanes 8 to 17 %;
    # of a humanoid, with more values than registers hold, 10 % more.
    return weight < 2500 and critical_path(tape, outputs) > 0.5 * SHARE * weight


def fastest(tape: Tape, algorithms: Sequence[Sequence[Ref]], ratio: float) -> int:
    """Return the index of the algorithm with the fewest operations, or of another one that takes less than ``ratio`` of
    that one's expected cycles.

    Parameters
    ----------
    algorithms : references of the same outputs by each algorithm
    """
    weights = [tape.counts(outputs).weight for outputs in algorithms]
    best = min(range(len(algorithms)), key=weights.__getitem__)
    limit = ratio * (critical_path(tape, algorithms[best]) + SHARE * weights[best])
    for number, outputs in enumerate(algorithms):
        if number != best and SHARE * weights[number] < limit:  # critical paths of long functions take a while
            cycles = critical_path(tape, outputs) + SHARE * weights[number]
            if cycles < limit:
                best, limit = number, cycles
    return best
