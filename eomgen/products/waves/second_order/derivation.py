"""Second-order Lagrangian waves by SymPy, from the Lagrangian equations of motion:
``python -m eomgen.products.waves.second_order.derivation eomgen/products/waves/second_order/derived.py`` writes the
kernels of a pair of components.

Labels are (a, b, c) with c = 0 at the free surface; positions are labels + e xi + e^2 eta, pressure over density is
-g c + e p1 + e^2 p2. Irrotational flow: eta_t = (xi . grad) u + grad Phi, u = xi_t, with Phi harmonic, which
tests/waves/residuals.py holds to the hierarchy of equations. The dynamic condition at c = 0,

    Phi_tt + g Phi_c = -d/dt (|u|^2 / 2 + xi . u_t) - g (xi . grad) w,

is projected on the sines of sum and difference of two phases. The result is then written without differences of
nearly equal numbers (``kernels``), and the rewriting is an identity that is checked before anything is written.
Sources: Fouques, Krogstad and Myrhaug, JOMAE 128 (2006) 177; Nouguier, Chapron and Guerin, JFM 772 (2015) 165.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path

import sympy
from sympy import Expr, Rational, diff

from eomgen.symbolic.kernel import Kernel
from eomgen.symbolic.symbolic_kernel import kernel_of, module_of

COMMAND = "python -m eomgen.products.waves.second_order.derivation eomgen/products/waves/second_order/derived.py"
#: Wave numbers, frequencies and profiles of the components i and j, and the cosine and sine of the angle between them.
K_I, K_J, W_I, W_J, G_EFF = sympy.symbols("k_i k_j w_i w_j g", positive=True)
CH_I, CH_J, SH_I, SH_J, C_I, C_J = sympy.symbols("Ch_i Ch_j Sh_i Sh_j C_i C_j", positive=True)
COS, SIN = sympy.symbols("cos_ij sin_ij", real=True)
_CI, _CJ, _SI, _SJ = sympy.symbols("cos_i cos_j sin_i sin_j", real=True)  # of the phases


def _derivative(expression: Expr, by: str) -> Expr:
    """Return the derivative of an expression of the symbols above by a, b, c or t: Ch' = k Sh, Sh' = k Ch, and phases
    kx a + ky b - w t."""
    if by == "c":
        chain = ((CH_I, K_I * SH_I), (SH_I, K_I * CH_I), (CH_J, K_J * SH_J), (SH_J, K_J * CH_J))
        return sum((diff(expression, x) * rate for x, rate in chain), sympy.Integer(0))
    rate_i, rate_j = {"a": (K_I, K_J * COS), "b": (0, K_J * SIN), "t": (-W_I, -W_J)}[by]
    of_i = diff(expression, _SI) * _CI - diff(expression, _CI) * _SI
    of_j = diff(expression, _SJ) * _CJ - diff(expression, _CJ) * _SJ
    return rate_i * of_i + rate_j * of_j


def _first_order() -> list[Expr]:
    """Return xi of two components of amplitude 1, the first along a."""
    return [-CH_I * _SI - COS * CH_J * _SJ, -SIN * CH_J * _SJ, SH_I * _CI + SH_J * _CJ]


def _at_sum_and_difference(expression: Expr, *, odd: bool) -> tuple[Expr, Expr]:
    """Return coefficients at the sum and at the difference of both phases, from the products of both components in an
    expression. They belong to sines if the expression is ``odd`` in the phases, else to cosines."""
    first_pair, second_pair = ((_SI, _CJ), (_CI, _SJ)) if odd else ((_CI, _CJ), (_SI, _SJ))
    expression = sympy.expand(expression)
    x, y = (expression.coeff(u, 1).coeff(v, 1) for u, v in (first_pair, second_pair))
    plus, minus = ((x + y) / 2, (x - y) / 2) if odd else ((x - y) / 2, (x + y) / 2)
    plus, minus = (sympy.expand(value).subs(SIN**2, 1 - COS**2) for value in (plus, minus))
    return plus, minus


def second_order() -> Mapping[str, tuple[Expr, Expr]]:
    """Return, by name, the forcing by the product of two components, at the sum and at the difference of their phases.

    ``forcing`` is the right-hand side of the dynamic condition, of sines; ``along``, ``across`` (horizontal, along the
    first component and orthogonal to it, of cosines) and ``vertical`` (of sines) are (xi . grad) u, the velocity of a
    label besides grad Phi.
    """
    xi = _first_order()
    u = [_derivative(x, "t") for x in xi]
    carried = [sum(x * _derivative(velocity, by) for x, by in zip(xi, "abc", strict=True)) for velocity in u]
    energy = sum(v * v for v in u) / 2 + sum(x * _derivative(v, "t") for x, v in zip(xi, u, strict=True))
    forcing = sympy.expand(-_derivative(energy, "t") - G_EFF * carried[2])
    forcing = forcing.subs({CH_I: C_I, CH_J: C_J, SH_I: 1, SH_J: 1})
    # the dispersion relation g k = w^2 coth k h
    by_frequencies = {K_I: W_I**2 * C_I / G_EFF, K_J: W_J**2 * C_J / G_EFF}
    return {
        "forcing": tuple(x.subs(by_frequencies) for x in _at_sum_and_difference(forcing, odd=True)),
        "along": _at_sum_and_difference(carried[0], odd=False),
        "across": _at_sum_and_difference(carried[1], odd=False),
        "vertical": _at_sum_and_difference(carried[2], odd=True),
    }


# Symbols of the kernels besides the symbols above, because differences of nearly equal numbers lose all digits:
# w = w_i - w_j, delta = k_i - k_j, lean = 1 - cos_ij, dt = tanh k_i h - tanh k_j h, s = 1 / sinh^2 k h,
# q = C_i C_j - 1, E = Ch_i Ch_j - Sh_i Sh_j, lag = Sh_i Ch_j - Ch_i Sh_j; of the wave number of the sum or difference
# kT = k tanh k h, P = cosh k (c + h) / cosh k h and its derivative Pc by c, px and py.
_W, _DELTA, _LEAN, _DT, _S_I, _S_J, _Q, _E, _LAG = sympy.symbols("w delta lean dt s_i s_j q E lag")
_KT, _P, _PC, _PX, _PY, _KX_I, _KX_J, _KY_I, _KY_J = sympy.symbols("kT P Pc px py kx_i kx_j ky_i ky_j")
_MEANING = {
    _W: W_I - W_J,
    _DELTA: K_I - K_J,
    _LEAN: 1 - COS,
    _DT: 1 / C_I - 1 / C_J,
    _S_I: C_I**2 - 1,
    _S_J: C_J**2 - 1,
    _Q: C_I * C_J - 1,
    _E: CH_I * CH_J - SH_I * SH_J,
    _LAG: SH_I * CH_J - CH_I * SH_J,
    _KX_I: K_I,
    _KX_J: K_J * COS,
    _KY_I: 0,
    _KY_J: K_J * SIN,
}


def kernels() -> Mapping[str, Kernel]:
    """Return the kernels for a pair with amplitudes 1 at one depth: coefficients of Phi (sine), x and y (sine), z
    (cosine).

    ``sum`` and ``difference``: both phases added, subtracted. ``degenerate``: the difference of phases that do not move
    against one another, with the drift velocity (cosine) in place of the potential.

    Raises
    ------
    ArithmeticError
        A kernel that contradicts the equations.
    """
    terms = second_order()
    sums, half = W_I + W_J, Rational(1, 2)
    forced_plus = -(W_I * W_J * sums * (_Q - _LEAN * C_I * C_J) + half * (W_I**3 * _S_I + W_J**3 * _S_J))
    cubes = _S_J * _W * (W_I**2 + W_I * W_J + W_J**2) - W_I**3 * _DT * (C_I + C_J) * C_I * C_J
    forced_minus = -(W_I * W_J * _W * ((1 - _LEAN) * C_I * C_J + 1) + half * cubes)
    plus, minus = _LEAN * CH_I * CH_J - _E, (1 - _LEAN) * CH_I * CH_J + SH_I * SH_J
    east, north = (half * (W_I * i + W_J * j) for i, j in ((_KX_I, _KX_J), (_KY_I, _KY_J)))
    mixed = W_J * K_J * CH_I * SH_J + W_I * K_I * CH_J * SH_I
    change = _W * K_I + W_J * _DELTA  # w_i k_i - w_j k_j
    up_plus = half * (_LEAN * mixed - change * _LAG)
    both = CH_J * SH_I + SH_J * CH_I
    up_minus = half * (change * (1 - half * _LEAN) * both - half * (W_I * K_I + W_J * K_J) * _LEAN * _LAG)
    _hold("forcing", (forced_plus, forced_minus), terms["forcing"])
    _hold("along", (east * plus, east * minus), terms["along"])
    _hold("across", (north * plus, north * minus), terms["across"])
    _hold("vertical", (up_plus, up_minus), terms["vertical"])

    potential = sympy.symbols("potential")
    # integrals of the velocities cos and sin (k a - w t): -sin / w and cos / w
    moved = {"sum": (forced_plus, plus, up_plus, sums), "difference": (forced_minus, minus, up_minus, _W)}
    made = {}
    for name, (forced, factor, up, rate) in moved.items():
        of = forced / (G_EFF * _KT - rate**2)
        horizontal = [-(v * factor + potential * _P * p) / rate for v, p in ((east, _PX), (north, _PY))]
        results = [of * _P, *horizontal, (up + potential * _PC) / rate]
        made[name] = kernel_of([x.subs(potential, of) for x in results])
    # grad |xi|^2 / 4 of the pair and grad Q, which takes the pressure of both from the surface
    lifted = half * half * minus
    still = -W_I * W_J * _S_I / (2 * G_EFF * _KT)
    slope = (
        half * half * ((1 - _LEAN) * (K_I * SH_I * CH_J + K_J * CH_I * SH_J) + K_I * CH_I * SH_J + K_J * SH_I * CH_J)
    )
    static = [-(lifted + still * _P) * p for p in (_PX, _PY)]
    made["degenerate"] = kernel_of([east * minus, north * minus, *static, slope + still * _PC])
    return made


def _hold(name: str, written: tuple[Expr, Expr], derived: tuple[Expr, Expr]) -> None:
    """Raise ArithmeticError if a rewritten kernel is not the derived one."""
    for where, new, old in zip(("sum", "difference"), written, derived, strict=True):
        if sympy.cancel(sympy.expand(new.subs(_MEANING) - old)) != 0:
            raise ArithmeticError(f"{name} at the {where} of phases is not what the equations say")


_ABOUT = f"""Kernels of a pair of waves by SymPy, so that no run imports it: written by
``{COMMAND}``."""


def module() -> str:
    """Return the text of the module of all kernels."""
    return module_of(_ABOUT, "KERNELS", kernels())


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(module(), encoding="utf-8")
