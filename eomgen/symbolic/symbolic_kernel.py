"""Kernels from SymPy's expressions."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from eomgen.symbolic.kernel import Kernel, Step
from eomgen.symbolic.operations import NAMES

_NAMES: dict[type[sympy.Basic], str] = {
    **{getattr(sympy, name): name for name in NAMES.values() if name != "sqrt"},  # which is a Pow
    sympy.Add: "add",
    sympy.Mul: "mul",
    sympy.Pow: "pow",
    sympy.atan2: "atan2",
    sympy.Abs: "abs",
    sympy.sign: "sign",
}


def kernel_of(results: Sequence[sympy.Expr]) -> Kernel:
    """Return the kernel that gives some expressions, in order.

    The form of the expressions determines the operations: collect terms first. Raises TypeError for an expression that
    a tape cannot hold.
    """
    places: dict[sympy.Basic, int] = {}
    steps: list[Step] = []
    for root in results:
        for node in sympy.postorder_traversal(root):
            if node not in places:
                steps.append(_step(node, [places[operand] for operand in node.args]))
                places[node] = len(places)
    return Kernel(tuple(steps), tuple(places[root] for root in results))


def _step(node: sympy.Basic, operands: Sequence[int]) -> Step:
    if isinstance(node, sympy.Symbol):
        return "symbol", node.name
    if isinstance(node, sympy.Number | sympy.NumberSymbol):
        return "number", float(node)
    name = _NAMES.get(type(node))
    if name is None:
        raise TypeError(f"a kernel cannot hold {type(node).__name__}")
    return name, *operands
