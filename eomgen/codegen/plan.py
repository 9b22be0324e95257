"""Before one statement is written: what outputs need, what is computed together, in which part, and who uses it."""

from __future__ import annotations

from collections.abc import Sequence

from eomgen.symbolic.tape import LEAVES, UNARY, Op, Ref, Tape

_ARITY = [2] * (max(Op) + 1)
for _op in UNARY:
    _ARITY[_op] = 1
_ARITY[Op.SELECT] = 3
_ARITY[Op.CURVE] = 1
_CIRCULAR = (Op.SIN, Op.COS)
_MAP = Op.MAP


def operands(tape: Tape, node: int) -> tuple[int, ...]:
    """Return the operand references of an operation that is no result of a Map (faster than ``Tape.operands``)."""
    arity = _ARITY[tape.op[node]]
    if arity == 2:
        return (tape.a[node], tape.b[node])
    return (tape.a[node],) if arity == 1 else (tape.a[node], tape.b[node], tape.c[node])


class Plan:
    """The operations behind some outputs, cut into parts of nearly equal length.

    Attributes
    ----------
    live : all operations, in order; ``order`` : without those that are computed together with an earlier one.
    members : from an operation to those computed together with it: cosine with sine, results of a Map.
    part_of, last_part : the part that computes an operation, and the last one that reads it.
    uses : how often an operation is read or stored.
    stores : where an operation is stored: output number, component, sign.
    """

    def __init__(self, tape: Tape, outputs: Sequence[Sequence[Ref]], part_limit: int) -> None:
        self.tape = tape
        self.live = [node for node in tape.live(ref for refs in outputs for ref in refs) if tape.op[node] not in LEAVES]
        leader = self._leaders()
        self.order = [node for node in self.live if node not in leader]
        self.members: dict[int, list[int]] = {}
        for node, first in leader.items():
            self.members.setdefault(first, []).append(node)
        self.parts = max(1, -(-len(self.order) // part_limit))
        self.length = max(1, -(-len(self.order) // self.parts))
        self.part_of = {node: position // self.length for position, node in enumerate(self.order)}
        for node, first in leader.items():
            self.part_of[node] = self.part_of[first]
        self.last_part = dict(self.part_of)
        self.uses = dict.fromkeys(self.live, 0)
        self._count_reads()
        self.stores: dict[int, list[tuple[int, int, int]]] = {}
        for number, refs in enumerate(outputs):
            for component, ref in enumerate(refs):
                if abs(ref) in self.uses:
                    self.uses[abs(ref)] += 1
                    self.stores.setdefault(abs(ref), []).append((number, component, 1 if ref > 0 else -1))

    def part(self, number: int) -> list[int]:
        """Return the operations of a part."""
        return self.order[number * self.length : (number + 1) * self.length]

    def group(self, node: int) -> list[int]:
        """Return an operation and those computed together with it, in order."""
        others = self.members.get(node)
        return [node] if others is None else sorted([node, *others])

    def crossing(self, number: int) -> list[int]:
        """Return the operations of a part that a later one reads; results of Maps stay where they are anyway."""
        return [
            node
            for first in self.part(number)
            if self.tape.op[first] is not Op.MAP
            for node in self.group(first)
            if self.last_part[node] > number
        ]

    def _leaders(self) -> dict[int, int]:
        op, a = self.tape.op, self.tape.a
        first_of: dict[tuple[bool, int], int] = {}
        leader: dict[int, int] = {}
        for node in self.live:
            code = op[node]
            if code in _CIRCULAR or code is _MAP:
                first = first_of.setdefault((code is _MAP, abs(a[node])), node)
                if first != node:
                    leader[node] = first
        return leader

    def _count_reads(self) -> None:
        tape, uses, last_part = self.tape, self.uses, self.last_part
        for node in self.order:
            part = self.part_of[node]
            for ref in tape.operands(node) if tape.op[node] is _MAP else operands(tape, node):
                operand = abs(ref)
                if operand in uses:
                    uses[operand] += 1
                    last_part[operand] = max(part, last_part[operand])
