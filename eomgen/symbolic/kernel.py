"""Kernels: a handful of SymPy expressions with named arguments, instantiated on a tape.

Laws are derived with SymPy, once and small; the tape composes them. A kernel never sees a whole equation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import sympy

from eomgen.symbolic.operations import ELEMENTARY, Op
from eomgen.symbolic.scalar import Algebra, Scalar

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
        known: dict[sympy.Basic, Scalar] = {}
        for root in self.results:
            for node in sympy.postorder_traversal(root):
                if node not in known:
                    known[node] = _translate(algebra, node, known, values)
        return [known[root] for root in self.results]


def _translate(
    algebra: Algebra, node: sympy.Basic, known: Mapping[sympy.Basic, Scalar], values: Mapping[str, Scalar]
) -> Scalar:
    if isinstance(node, sympy.Symbol):
        return values[node.name]
    if isinstance(node, sympy.Number | sympy.NumberSymbol):
        return algebra.scalar(float(node))
    arguments = [known[argument] for argument in node.args]
    if isinstance(node, sympy.Add):
        return _sum(arguments)
    if isinstance(node, sympy.Mul):
        product = arguments[0]
        for argument in arguments[1:]:
            product = product * argument
        return product
    if isinstance(node, sympy.Pow):
        return algebra.call(Op.POW, arguments[0], arguments[1])
    op = _FUNCTIONS.get(type(node))
    if op is None:
        raise TypeError(f"a kernel cannot hold {type(node).__name__}")
    return algebra.call(op, *arguments)


def _sum(terms: Sequence[Scalar]) -> Scalar:
    total = terms[0]
    for term in terms[1:]:
        total = total + term
    return total
