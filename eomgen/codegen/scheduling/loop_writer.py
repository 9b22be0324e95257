"""Loops of a function, and what they take: places in the workspace that can be counted through, stores of many values at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from eomgen.codegen.program import Expression
from eomgen.codegen.scheduling.iterations import Left, copies, turn_of
from eomgen.codegen.scheduling.maps import runs
from eomgen.codegen.scheduling.rerolling import Roll, is_circular
from eomgen.codegen.scheduling.writer import Writer
from eomgen.symbolic.tape import Op, Ref

#: Values stored in one loop, where a function has loops, from this many on.
COPIED_FROM = 8


class LoopWriter(Writer):
    """Writes the loops that ``rolling`` found; it is the ``turns.Values`` of each."""

    def _circular(self) -> None:
        """Take sines and cosines of all angles that are inputs into the workspace, where loops can count through them."""
        tape = self.tape
        nodes = [node for node in self.plan.live if is_circular(tape, node)]
        angles = sorted({abs(tape.a[node]) for node in nodes}, key=self._symbol)
        slot = {leaf: self.slots + number for number, leaf in enumerate(angles)}
        places: dict[str, list[tuple[int, int]]] = {}
        for leaf in angles:
            block, index = self._symbol(leaf)
            places.setdefault(block, []).append((slot[leaf], index))
        for block, found in places.items():
            self.open.inputs.add(block)
            for to, start, _, step, length in runs(found, shortest=1):
                self._emit("circular", to, to + len(angles), block, start, step, length)
        self.slots += 2 * len(angles)
        self.open.workspace = self.open.workspace or bool(angles)
        for node in nodes:
            self.circular.add(node)
            self.expressions[node] = ("w", slot[abs(tape.a[node])] + (len(angles) if tape.op[node] is Op.COS else 0))
        self._store_all((*place, node) for node in nodes for place in self.plan.stores.get(node, ()))

    def _symbol(self, leaf: int) -> tuple[str, int]:
        symbol = self.tape.inputs[self.tape.a[leaf]]
        return symbol.block, symbol.index

    def reserve(self, count: int) -> int:
        """Return the first of so many new slots of the workspace."""
        self.slots += count
        return self.slots - count

    def leaf(self, ref: Ref) -> Expression:
        """Return what stands for a value that does not change from turn to turn."""
        return self._leaf(ref)

    def slot(self, node: int) -> int:
        """Return where the workspace has a value, putting it there if it has to."""
        expression = self.expressions[node]
        if isinstance(expression, tuple) and expression[0] == "w":
            return int(expression[1])
        if node not in self.kept:
            self.kept[node] = self.reserve(1)
            self._emit("save", self.kept[node], self._leaf(node))
        return self.kept[node]

    def _repeat(self, loop: Roll) -> None:
        """Write a loop; what others need of it stays in the workspace, turn by turn."""
        turn = turn_of(self.tape, loop, self.plan.read_outside, self.plan.stores, self)
        for k, nodes in enumerate(loop.turns):
            for number, position in enumerate(turn.exports):
                self.expressions[nodes[position]] = ("w", turn.first + k * len(turn.exports) + number)
        for expression in turn.read:
            plain = expression[1] if isinstance(expression, tuple) and expression[0] == "neg" else expression
            if isinstance(plain, tuple) and plain[0] == "row" and plain[1] != "w":
                self.open.inputs.add(plain[1])
        self.open.outputs |= {item[1] for item in turn.given if isinstance(item, tuple) and item[1] != "w"}
        self.open.workspace = True
        self._emit("repeat", len(loop.turns), turn.statements, turn.read, turn.given)
        self._store_all(turn.left)

    def _store_all(self, stores: Iterable[Left]) -> None:
        """Store values of the workspace, by loops where they are many."""
        groups: dict[tuple[int, int], list[tuple[int, Ref]]] = {}
        for number, component, sign, node in stores:
            groups.setdefault((number, sign), []).append((component, sign * node))
        for (number, _), items in groups.items():
            if not self._copy(number, items):
                for component, ref in items:
                    self.open.outputs.add(number)
                    self._emit("out", number, component, self._leaf(ref))

    def _copy(self, number: int, items: Sequence[tuple[int, Ref]]) -> bool:
        """Store many values that are there already in one loop; return False where they are few, or of different kinds."""
        if len(items) < COPIED_FROM:
            return False
        data = copies([self._leaf(ref) for _, ref in items], number, [component for component, _ in items])
        if data is None:
            return False
        self.open.outputs.add(number)
        self._emit("repeat", *data)
        return True
