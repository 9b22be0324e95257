"""Onset of a contact force, derived with SymPy."""

from __future__ import annotations

import sympy

from eomgen.symbolic.kernel import Kernel
from eomgen.symbolic.symbolic_kernel import kernel_of


def onset() -> Kernel:
    """Derive the smooth onset s(u), u = d / w in [0, 1], and the potential of the spring k d s(d / w) over k w^2."""
    u, x = sympy.symbols("u x")
    a, b, c, d = sympy.symbols("a b c d")
    cubic = a + b * u + c * u**2 + d * u**3
    ends = [cubic.subs(u, 0), cubic.diff(u).subs(u, 0), cubic.subs(u, 1) - 1, cubic.diff(u).subs(u, 1)]
    rise = sympy.factor(cubic.subs(sympy.solve(ends, (a, b, c, d))))
    potential = sympy.factor(sympy.integrate(x * rise.subs(u, x), (x, 0, u)))
    return kernel_of([rise, potential])
