"""What a function's statements are written with: expressions for values, nesting of those used once, workspace and outputs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from eomgen.codegen.program import Expression, Statement
from eomgen.codegen.scheduling.plan import Plan
from eomgen.symbolic.tape import Op, Ref

_CONST, _INPUT = Op.CONST, Op.INPUT


@dataclass
class Open:
    """The part that is being written."""

    statements: list[Statement] = field(default_factory=list)
    inputs: set[str] = field(default_factory=set)
    outputs: set[int] = field(default_factory=set)
    workspace: bool = False
    label: str | None = None


class Writer:
    """The state of a function that is being written, part after part."""

    def __init__(
        self,
        plan: Plan,
        outputs: Sequence[Sequence[Ref]],
        input_order: Sequence[str],
        nest_limit: int,
        loop_numbers: dict[int, int],
        curve_numbers: dict[int, int],
    ) -> None:
        self.plan = plan
        self.tape = plan.tape
        self.outputs = outputs
        self.input_order = input_order
        self.nest_limit = nest_limit
        self.loop_numbers = loop_numbers
        self.curve_numbers = curve_numbers
        self.expressions: dict[int, Expression] = {}  # of nodes that have been written, or wait to be nested
        self.waiting: dict[int, int] = {}  # node -> operations in its expression
        self.locals = 0
        self.slots = 0
        self.kept: dict[int, int] = {}  # node -> slot that loops read it from, besides its local
        self.labels = iter([*self.tape.blocks, (len(self.tape.op) + 1, "")])
        self.next_label = next(self.labels)
        self.label = ""
        self.open = Open()
        self.circular: set[int] = set()  # sines and cosines that were taken beforehand

    # -- expressions ----------------------------------------------------------------------------------------------

    def _leaf(self, ref: Ref) -> Expression:
        """Return a leaf, or the expression that stands for a node."""
        node = abs(ref)
        code = self.tape.op[node]
        if code is _CONST:
            value = self.tape.constants[self.tape.a[node]]
            return ("K", value if ref > 0 else -value)
        if code is _INPUT:
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
        nested = [abs(ref) for ref in refs if abs(ref) in waiting]
        if len(nested) > 1:
            nested.sort(key=waiting.__getitem__)  # the shortest first: most of them fit
        total = 1
        for node in nested:
            if total + waiting[node] <= self.nest_limit:
                total += waiting.pop(node)
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
        for number, component, sign in self.plan.stores.get(node, ()):
            self.open.outputs.add(number)
            self._emit("out", number, component, self._leaf(sign * node))
