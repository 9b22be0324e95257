"""Names of values that mechanics leaves without a name: a product by its factors, ``q1_q2``, another value by its
paragraph and a number, ``spring_12``."""

from __future__ import annotations

import re
from collections import defaultdict
from itertools import count

from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ZERO, Ref, Tape

#: Inputs that are called by the letter of their block and a number, and words of a label.
_INPUT, _WORD = re.compile(r"[qvauz]|lam"), re.compile(r"[a-z]+")


class Roles:
    """Names of the values of a function on a tape, by node; ``names`` has the names that were asked for."""

    def __init__(self, tape: Tape) -> None:
        self.tape = tape
        self.names: dict[int, str] = {}
        self._numbers: defaultdict[str, count[int]] = defaultdict(lambda: count(1))

    def name(self, node: int, label: str) -> str:
        """Return the name of a value in the paragraph of a label, empty for a value without a role."""
        if node not in self.names:
            name, word = self.tape.names.get(node) or self._product(node), _WORD.search(label.lower())
            if word and not name:
                name = f"{word[0]}_{next(self._numbers[word[0]])}"
            self.names[node] = name
        return self.names[node]

    def _product(self, node: int) -> str:
        """Return the name of a product of values with names, in which words that both begin with stand once."""
        first, second = map(self._operand, self.tape.operands(node) if self.tape.op[node] is Op.MUL else (ZERO, ZERO))
        start, _, last = second.rpartition("_")
        name = f"{first}_{last if start and first.startswith(f'{start}_') else second}"
        return name if first and second and len(name) <= 16 else ""

    def _operand(self, ref: Ref) -> str:
        if (symbol := self.tape.symbol(ref)) and ref > 0 and _INPUT.fullmatch(symbol.block):
            return f"{symbol.block}{symbol.index}"
        return self.names.get(ref, "")
