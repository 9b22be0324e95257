"""Kernels from SymPy's expressions, and modules that hold derived kernels, so that no build imports SymPy."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence

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


_HEAD = """# fmt: off
from __future__ import annotations

from collections.abc import Mapping

from eomgen.symbolic.kernel import Kernel
"""
_WIDTH = 120


def module_of(about: str, table: str, kernels: Mapping[str, Kernel]) -> str:
    """Return the text of a Python module that holds kernels by name.

    Parameters
    ----------
    about : docstring of the module
    table : name of the mapping
    kernels : by name, in the order of the text
    """
    text = f'"""{about}"""\n\n{_HEAD}\n{table}: Mapping[str, Kernel] = {{\n'
    for name, kernel in kernels.items():
        steps = _lines(f"{_tuple(map(json.dumps, step))}," for step in kernel.steps)
        results = _tuple(map(str, kernel.results))
        text += f'    "{name}": Kernel(\n        (\n{steps}        ),\n        {results},\n    ),\n'
    return text + "}\n"


def _tuple(entries: Iterable[str]) -> str:
    """Return Python's text of a tuple."""
    listed = list(entries)
    return f"({', '.join(listed)}{',' * (len(listed) == 1)})"


def _lines(items: Iterable[str]) -> str:
    """Return the text of items separated by spaces, in indented lines of limited width."""
    lines, indent = [""], " " * 12
    for item in items:
        if lines[-1] and len(indent) + len(lines[-1]) + 1 + len(item) > _WIDTH:
            lines.append("")
        lines[-1] += f" {item}" if lines[-1] else item
    return "".join(f"{indent}{line}\n" for line in lines)
