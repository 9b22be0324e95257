"""Kernels from SymPy's expressions, and modules that hold derived kernels, so that no build imports SymPy."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

import sympy

from eomgen.symbolic.kernel import Kernel
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
    steps: list[str] = []
    for root in results:
        for node in sympy.postorder_traversal(root):
            if node not in places:
                steps.append(_step(node, [places[operand] for operand in node.args]))
                places[node] = len(places)
    return Kernel(", ".join(steps), tuple(places[root] for root in results))


def _step(node: sympy.Basic, operands: Sequence[int]) -> str:
    if isinstance(node, sympy.Symbol):
        return node.name  # type: ignore[no-any-return]  # of SymPy
    if isinstance(node, sympy.Number | sympy.NumberSymbol):
        return str(float(node))
    name = _NAMES.get(type(node))
    if name is None:
        raise TypeError(f"a kernel cannot hold {type(node).__name__}")
    return " ".join([name, *map(str, operands)])


_HEAD = """# fmt: off
from __future__ import annotations

from collections.abc import Mapping

from eomgen.symbolic.kernel import Kernel
"""


def module_of(about: str, table: str, kernels: Mapping[str, Kernel]) -> str:
    """Return the text of a Python module that holds kernels by name.

    Parameters
    ----------
    about : docstring of the module
    table : name of the mapping
    kernels : by name, in the order of the text
    """
    indent = " " * 8
    text = f'"""{about}"""\n\n{_HEAD}\n{table}: Mapping[str, Kernel] = {{\n'
    for name, kernel in kernels.items():
        steps = textwrap.fill(kernel.steps, 116, initial_indent=f'{indent}"""', subsequent_indent=indent)
        text += f'    "{name}": Kernel(\n{steps}""",\n{indent}{kernel.results},\n    ),\n'
    return text + "}\n"
