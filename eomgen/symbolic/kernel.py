"""Kernels: a handful of SymPy expressions with named arguments, instantiated on a tape.

Laws are derived with SymPy, once and small; the tape composes them. A kernel never sees a whole equation.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce

import sympy

from eomgen.symbolic.operations import ELEMENTARY, Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.tape import Ref, Tape

_Rule = Callable[[Tape, Mapping[str, Scalar], Sequence[Ref]], Ref]

_FUNCTIONS: dict[type[sympy.Function], Op] = {
    **{getattr(sympy, name): op for op, name in ELEMENTARY.items()},
    sympy.atan2: Op.ATAN2,
    sympy.Abs: Op.ABS,
    sympy.sign: Op.SIGN,
}


@dataclass(frozen=True)
class Kernel:
    """SymPy expressions in named symbols.

    Attributes
    ----------
    results : tuple of sympy.Expr
        What the kernel gives, in order. Their written form decides the operations: collect before you build one.
    """

    results: tuple[sympy.Expr, ...]

    def instantiate(self, algebra: Algebra, values: Mapping[str, Scalar]) -> list[Scalar]:
        """Record the kernel on a tape.

        Parameters
        ----------
        values : mapping from symbol name to Scalar
            Raises KeyError for a symbol of the kernel that has none.
        """
        tape = algebra.tape
        instance = (self, *(values[name].ref for name in self._names))
        if instance not in tape.instances:
            known: list[Ref] = []
            add, mul = tape.add, tape.mul
            for step in self._steps:
                if isinstance(step, tuple):
                    is_sum, left, right = step
                    known.append(add(known[left], known[right]) if is_sum else mul(known[left], known[right]))
                else:
                    known.append(step(tape, values, known))
            tape.instances[instance] = tuple(known[place] for place in self._places)
        return [Scalar(tape, ref) for ref in tape.instances[instance]]

    @cached_property
    def _nodes(self) -> dict[sympy.Basic, int]:
        """The distinct nodes of the expressions, operands first, and the place of each."""
        places: dict[sympy.Basic, int] = {}
        for root in self.results:
            for node in sympy.postorder_traversal(root):
                places.setdefault(node, len(places))
        return places

    @cached_property
    def _steps(self) -> list[_Rule | tuple[bool, int, int]]:
        """How each node is recorded; of sums and products of two, which of them it is and the places of both."""
        places = self._nodes
        return [_step(node, [places[operand] for operand in node.args]) for node in places]

    @cached_property
    def _names(self) -> list[str]:
        """The names of the symbols."""
        return [node.name for node in self._nodes if isinstance(node, sympy.Symbol)]

    @cached_property
    def _places(self) -> list[int]:
        """The places of the results."""
        return [self._nodes[root] for root in self.results]


def _step(node: sympy.Basic, places: Sequence[int]) -> _Rule | tuple[bool, int, int]:
    """Return what records a node, of a tape, the values of symbols and the references of all nodes before it."""
    if isinstance(node, sympy.Add | sympy.Mul) and len(places) == 2:
        return isinstance(node, sympy.Add), places[0], places[1]
    if isinstance(node, sympy.Symbol):
        name = node.name
        return lambda tape, values, known: values[name].ref
    if isinstance(node, sympy.Number | sympy.NumberSymbol):
        number = float(node)
        return lambda tape, values, known: tape.constant(number)
    if isinstance(node, sympy.Add):
        return lambda tape, values, known: reduce(tape.add, [known[place] for place in places])
    if isinstance(node, sympy.Mul):
        return lambda tape, values, known: reduce(tape.mul, [known[place] for place in places])
    op = Op.POW if isinstance(node, sympy.Pow) else _FUNCTIONS.get(type(node))
    if op is None:
        raise TypeError(f"a kernel cannot hold {type(node).__name__}")
    return lambda tape, values, known: tape.call(op, *(known[place] for place in places))
