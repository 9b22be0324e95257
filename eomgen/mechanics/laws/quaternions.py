"""Rotation by a unit quaternion, derived with SymPy."""

from __future__ import annotations

import sympy

from eomgen.symbolic.kernel import Kernel
from eomgen.symbolic.symbolic_kernel import kernel_of


def rotation() -> Kernel:
    """Derive the rotation matrix of a unit quaternion (w, x, y, z), from x' = p x p*.

    The diagonal is written 1 - 2(..), which is orthogonal to first order in the quaternion's length error.
    """
    w, x, y, z = sympy.symbols("w x y z", real=True)
    p = sympy.Quaternion(w, x, y, z)
    columns = []
    for unit in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        turned = p * sympy.Quaternion(0, *unit) * p.conjugate()
        columns.append([sympy.expand(part) for part in (turned.b, turned.c, turned.d)])  # nine products of two symbols
    results = []
    for row in range(3):
        for column in range(3):
            entry = columns[column][row]
            if row == column:
                entry = sympy.expand(entry - (w**2 + x**2 + y**2 + z**2)) + 1  # |p| = 1; a sum of four squares
            results.append(_halved(entry))
    return kernel_of(results)


def _halved(entry: sympy.Expr) -> sympy.Expr:
    """Write a quadratic entry as [1 +] 2 (..), one multiplication by two instead of one per term."""
    constant = entry.subs(dict.fromkeys(entry.free_symbols, 0))
    half = sympy.Add(*((term / 2) for term in sympy.Add.make_args(entry - constant)))
    return constant + sympy.Mul(2, half, evaluate=False)
