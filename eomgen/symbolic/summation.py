"""Sums of many terms in the order in which the terms are ready, so that no late term waits for a chain of additions.

A sum of n terms takes n - 1 additions in any order. The two terms that are ready first are added first, as in a Huffman
code; the results differ by rounding. On the longest chain of operations a sum then takes one addition in place of all.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from heapq import heapify, heappop, heappush

from eomgen.symbolic.latency import FUNCTION, LATENCIES
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import Ref, Tape, record_node

_ADD, _SUB, _MUL, _MAP = Op.ADD, Op.SUB, Op.MUL, Op.MAP
_SUMS = (_ADD, _SUB)


def sums_by_readiness(tape: Tape, outputs: Sequence[Ref]) -> list[Ref]:
    """Return outputs recorded anew, with sums that take first the terms that are ready first.

    Outputs with loops or calls of external functions are returned unchanged. A sum that another operation or an output
    needs, too, remains one term of larger sums. Sums do not depend on names: the same equations have other names in an
    FMU, and the same bits.
    """
    live = tape.live(outputs)
    if any(tape.op[node] is _MAP for node in live):
        return list(outputs)
    order = _Order(tape, live, outputs)
    for node in live:
        order.take(node)
    return [order.there(ref) for ref in outputs]


class _Order:
    """New references of nodes whose sums are reordered, with the processor cycles at which they are ready.

    Parameters
    ----------
    live : nodes of the outputs, in order
    outputs : references whose sums stay sums of their own
    """

    def __init__(self, tape: Tape, live: Sequence[int], outputs: Sequence[Ref]) -> None:
        self.tape = tape
        self.uses = Counter(abs(ref) for node in live for ref in tape.operands(node))
        kept = {abs(ref) for ref in outputs}
        self.inner = {
            abs(ref)
            for node in live
            if tape.op[node] in _SUMS
            for ref in tape.operands(node)
            if tape.op[abs(ref)] in _SUMS and self.uses[abs(ref)] == 1 and abs(ref) not in kept
        }
        self.alone = {node for node in live if self.uses[node] == 1 and node not in kept}
        self.new: dict[int, Ref] = {}
        self.ready: dict[int, int] = {}

    def there(self, ref: Ref) -> Ref:
        return self.new[ref] if ref > 0 else -self.new[-ref]

    def take(self, node: int) -> None:
        """Record a node on the tape again, with reordered sums, and note the cycle at which it is ready. A sum that is
        a part of a larger sum is not recorded."""
        tape, op = self.tape, self.tape.op[node]
        if op in LEAVES:
            self.new[node], self.ready[node] = node, 0
        elif node in self.inner:
            return
        elif op in _SUMS:
            with tape.block(tape.label(node)):
                self.new[node], self.ready[node] = self._sum(node)
            self._name(node)
        else:
            operands = [self.there(ref) for ref in tape.operands(node)]
            with tape.block(tape.label(node)):
                self.new[node] = record_node(tape, tape, node, operands)
            self.ready[node] = max(self.ready[abs(ref)] for ref in tape.operands(node)) + LATENCIES.get(op, FUNCTION)
            self._name(node)

    def _name(self, node: int) -> None:
        if node in self.tape.names:
            name = self.tape.names[node]
            self.tape.name(self.new[node], name)

    def _terms(self, ref: Ref) -> list[Ref]:
        """Return the terms of a sum, references with signs; sums that only this sum needs are expanded."""
        node, sign = abs(ref), 1 if ref > 0 else -1
        x, y = self.tape.operands(node)
        terms = []
        for term in (sign * x, sign * y if self.tape.op[node] is _ADD else -sign * y):
            terms += self._terms(term) if abs(term) in self.inner else [term]
        return terms

    def _sum(self, node: int) -> tuple[Ref, int]:
        """Return the new reference of a sum, and the cycle at which it is ready. A product that the sum alone needs is
        fused with the addition."""
        tape, step = self.tape, LATENCIES[_ADD]
        waiting: list[tuple[int, int, bool, Ref]] = []
        for rank, ref in enumerate(self._terms(node)):
            fused = tape.op[abs(ref)] is _MUL and abs(ref) in self.alone
            early = LATENCIES[_MUL] if fused else 0
            waiting.append((self.ready[abs(ref)] - early, rank, fused, self.there(ref)))
        heapify(waiting)
        rank = len(waiting)
        while len(waiting) > 1:
            first, _, both, x = heappop(waiting)
            second, _, fused, y = heappop(waiting)
            if both and fused:  # one of two products is a term of its own
                first += LATENCIES[_MUL]
            rank += 1
            heappush(waiting, (max(first, second) + step, rank, False, tape.add(x, y)))
        [(ready, _, _, ref)] = waiting
        return ref, ready
