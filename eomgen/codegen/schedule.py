"""One function of a tape -> parts of statements: order, fusion of sine with cosine, nesting of values used once, chunks.

Compilers need time that grows faster than the length of a function (72 600 statements: over 180 s whole, 10 s in chunks), so a
long function becomes parts of nearly equal length; a value that a later part needs waits in a slot of a workspace.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from eomgen.codegen.program import Expression, Part, Statement
from eomgen.symbolic.tape import UNARY, ZERO, Op, Ref, Tape

#: Operations per part at most; a function this long compiles in about a second.
PART_LIMIT = 1500
#: Operations in one statement at most; longer ones are harder to read, not faster.
NEST_LIMIT = 6
#: Structural zeros of an output are stored one by one up to here, by a loop beyond when they are the majority.
FILL_FROM = 9

_NAMES: list[str] = [""] * (max(Op) + 1)
_ARITY = [2] * (max(Op) + 1)
for _op in Op:
    _NAMES[_op] = _op.name
for _op in UNARY:
    _ARITY[_op] = 1
_ARITY[Op.SELECT] = 3
_SIN, _COS, _MAP, _CONST, _INPUT = int(Op.SIN), int(Op.COS), int(Op.MAP), int(Op.CONST), int(Op.INPUT)


@dataclass(frozen=True)
class Schedule:
    """The parts of a function, the size of the workspace between them, the number of operations, and the Maps it runs."""

    parts: tuple[Part, ...]
    workspace: int
    operations: int
    maps: tuple[int, ...]


@dataclass
class _Open:
    """The part that is being written."""

    statements: list[Statement] = field(default_factory=list)
    inputs: set[str] = field(default_factory=set)
    outputs: set[int] = field(default_factory=set)
    workspace: bool = False
    label: str | None = None


class _Scheduler:
    def __init__(self, tape: Tape, outputs: Sequence[Sequence[Ref]], input_order: Sequence[str], part_limit: int, nest_limit: int) -> None:
        self.tape = tape
        self.input_order = input_order
        self.nest_limit = nest_limit
        self.outputs = outputs
        self.live = [node for node in tape.live(ref for refs in outputs for ref in refs) if tape.op[node] not in (_CONST, _INPUT)]
        self.leader = self._leaders()
        self.order = [node for node in self.live if self.leader.get(node, node) == node]
        count = max(1, -(-len(self.order) // part_limit))
        length = max(1, -(-len(self.order) // count))
        self.part_count = count
        self.part_of = {node: position // length for position, node in enumerate(self.order)}
        for node, first in self.leader.items():
            self.part_of[node] = self.part_of[first]
        self.uses = dict.fromkeys(self.live, 0)
        self.last_part = dict(self.part_of)
        self.members: dict[int, list[int]] = {}
        for node, first in self.leader.items():
            self.members.setdefault(first, []).append(node)
        self.stores: dict[int, list[tuple[int, int, int]]] = {}
        self._count_uses()
        self.length = length
        self.expressions: dict[int, Expression] = {}  # of nodes that have been written, or wait to be nested
        self.waiting: dict[int, int] = {}  # node -> operations in its expression
        self.locals = 0
        self.labels = iter([*tape.blocks, (len(tape.op) + 1, "")])
        self.next_label = next(self.labels)
        self.label = ""
        self.open = _Open()
        self.maps: list[int] = []

    def _leaders(self) -> dict[int, int]:
        """Map nodes that are computed together with another one to that one: cosine with sine, results of a Map."""
        op, a = self.tape.op, self.tape.a
        first_of: dict[tuple[int, int], int] = {}
        leader: dict[int, int] = {}
        for node in self.live:
            code = op[node]
            if code == _SIN or code == _COS:
                key = (_SIN, abs(a[node]))
            elif code == _MAP:
                key = (_MAP, a[node])
            else:
                continue
            first = first_of.setdefault(key, node)
            if first != node:
                leader[node] = first
        return leader

    def _count_uses(self) -> None:
        uses, last_part, part_of = self.uses, self.last_part, self.part_of
        op, tape = self.tape.op, self.tape
        for node in self.order:
            part = part_of[node]
            for ref in self._operands(node) if op[node] != _MAP else tape.operands(node):
                operand = abs(ref)
                if operand in uses:
                    uses[operand] += 1
                    if last_part[operand] < part:
                        last_part[operand] = part
        for number, refs in enumerate(self.outputs):
            for component, ref in enumerate(refs):
                node = abs(ref)
                if node in uses:
                    uses[node] += 1
                    self.stores.setdefault(node, []).append((number, component, 1 if ref > 0 else -1))

    def _operands(self, node: int) -> tuple[int, ...]:
        arity = _ARITY[self.tape.op[node]]
        if arity == 2:
            return (self.tape.a[node], self.tape.b[node])
        if arity == 1:
            return (self.tape.a[node],)
        return (self.tape.a[node], self.tape.b[node], self.tape.c[node])

    # -- expressions ----------------------------------------------------------------------------------------------

    def _leaf(self, ref: Ref) -> Expression:
        """Return a leaf, or the expression that stands for a node."""
        node = abs(ref)
        code = self.tape.op[node]
        if code == _CONST:
            value = self.tape.constants[self.tape.a[node]]
            return ("K", value if ref > 0 else -value)
        if code == _INPUT:
            symbol = self.tape.inputs[self.tape.a[node]]
            self.open.inputs.add(symbol.block)
            expression: Expression = ("in", symbol.block, symbol.index)
        else:
            expression = self.expressions[node]
            if isinstance(expression, int):
                return expression if ref > 0 else -expression
            if expression[0] == "w":
                self.open.workspace = True
        return expression if ref > 0 else ("neg", expression)

    def _take(self, refs: Sequence[Ref]) -> tuple[list[Expression], int]:
        """Return operand expressions, nesting waiting ones as far as the limit allows, and their operations."""
        waiting = self.waiting
        nested = sorted((waiting[abs(ref)], abs(ref)) for ref in refs if abs(ref) in waiting) if waiting else []
        total = 1
        for operations, node in nested:
            if total + operations <= self.nest_limit:
                total += operations
                del waiting[node]
            else:
                self._write(node)
        return [self._leaf(ref) for ref in refs], total

    def _write(self, node: int) -> None:
        """Give a waiting node a statement of its own."""
        del self.waiting[node]
        self.locals += 1
        self._emit("let", self.locals, self.expressions[node])
        self.expressions[node] = self.locals

    def _emit(self, kind: str, *data: object) -> None:
        if kind != "fill" and self.open.label != self.label:
            self.open.label = self.label
            if self.label:
                self.open.statements.append(Statement("label", (self.label,)))
        self.open.statements.append(Statement(kind, data))

    def _store(self, node: int) -> None:
        for number, component, sign in self.stores.get(node, ()):
            self.open.outputs.add(number)
            self._emit("out", number, component, self._leaf(sign * node))

    # -- nodes ----------------------------------------------------------------------------------------------------

    def _node(self, node: int) -> None:
        tape = self.tape
        code = tape.op[node]
        if code == _MAP:
            self._map(node)
        elif node in self.members:
            self._sine_and_cosine(node)
        else:
            operands, total = self._take(self._operands(node))
            expression = (_NAMES[code], *operands)
            if self.uses[node] > 1 or self.last_part[node] > self.part_of[node]:
                self.locals += 1
                self._emit("let", self.locals, expression)
                self.expressions[node] = self.locals
                self._store(node)
            elif node in self.stores:
                number, component, sign = self.stores[node][0]
                self.open.outputs.add(number)
                self._emit("out", number, component, expression if sign > 0 else ("neg", expression))
            else:
                self.expressions[node] = expression
                self.waiting[node] = total

    def _sine_and_cosine(self, node: int) -> None:
        tape = self.tape
        (other,) = self.members[node]
        sine, cosine = (node, other) if tape.op[node] == _SIN else (other, node)
        (argument,), _ = self._take((tape.a[sine],))
        self.expressions[sine], self.expressions[cosine] = self.locals + 1, self.locals + 2
        self.locals += 2
        self._emit("sincos", self.locals - 1, self.locals, argument)
        self._store(sine)
        self._store(cosine)

    def _map(self, node: int) -> None:
        tape = self.tape
        number = tape.a[node]
        gathered = tape.operands(node)
        for ref in gathered:
            if abs(ref) in self.waiting:
                self._write(abs(ref))
        results = []
        for result in sorted([node, *self.members.get(node, ())]):
            self.locals += 1
            self.expressions[result] = self.locals
            results.append((tape.b[result], self.locals))
        if number not in self.maps:
            self.maps.append(number)
        self._emit("map", number, tuple(self._leaf(ref) for ref in gathered), tuple(results))
        for result in sorted([node, *self.members.get(node, ())]):
            self._store(result)

    def _leaves_out(self) -> None:
        """Store outputs that are constants or inputs, before everything else."""
        for number, refs in enumerate(self.outputs):
            zeros = sum(ref == ZERO for ref in refs)
            fill = zeros >= FILL_FROM and 2 * zeros > len(refs)
            if fill:
                self.open.outputs.add(number)
                self._emit("fill", number, len(refs))
            for component, ref in enumerate(refs):
                if abs(ref) not in self.uses and not (fill and ref == ZERO):
                    self.open.outputs.add(number)
                    self._emit("out", number, component, self._leaf(ref))

    def run(self) -> Schedule:
        parts: list[Part] = []
        free: list[int] = []
        slots = 0
        slot_of: dict[int, int] = {}
        for number in range(self.part_count):
            self.open = _Open()
            if number == 0:
                self._leaves_out()
            members = self.order[number * self.length : (number + 1) * self.length]
            for node in members:
                while node >= self.next_label[0]:
                    self.label = self.next_label[1]
                    self.next_label = next(self.labels)
                self._node(node)
            for node in [node for node in slot_of if self.last_part[node] <= number]:
                free.append(slot_of.pop(node))
            crossing = [
                each for node in members for each in sorted([node, *self.members.get(node, ())]) if self.last_part[each] > number
            ]
            for node in crossing:
                if not free:
                    free.append(slots)
                    slots += 1
                slot_of[node] = free.pop()
                self._emit("save", slot_of[node], self.expressions[node])
                self.expressions[node] = ("w", slot_of[node])
                self.open.workspace = True
            parts.append(
                Part(
                    tuple(self.open.statements),
                    tuple(block for block in self.input_order if block in self.open.inputs),
                    tuple(sorted(self.open.outputs)),
                    self.open.workspace,
                    len(members),
                )
            )
        return Schedule(tuple(parts), slots, len(self.live), tuple(self.maps))


def schedule(
    tape: Tape,
    outputs: Sequence[Sequence[Ref]],
    input_order: Sequence[str],
    part_limit: int = PART_LIMIT,
    nest_limit: int = NEST_LIMIT,
) -> Schedule:
    """Order the operations that the outputs need.

    Parameters
    ----------
    outputs : for each output array, its references row by row.
    input_order : the order in which parts name the input blocks they read.
    """
    return _Scheduler(tape, outputs, input_order, part_limit, nest_limit).run()
