"""Stability of the methods of one factorization for every step size, by exact polynomials.

A linear step maps its state by a rational matrix in w = (h omega)^2 > 0 and kappa, the stiffness that the matrix of the
step has, over the true one. With lambda = (1 + x)/(1 - x) its eigenvalues are within the unit circle where the
polynomial in x has no root to the right (Routh and Hurwitz). `tests/integrators/test_rosenbrock.py` and
`test_corrected_predictor.py` hold the generated steps to these maps.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest
import sympy as sp

w, kappa, above, g = sp.symbols("w kappa above g", positive=True)
half, GAMMA = sp.Rational(1, 2), 1 - sp.sqrt(2) / 2
Step = Callable[..., tuple[sp.Expr, ...]]


def one_stage(q: sp.Expr, v: sp.Expr) -> tuple[sp.Expr, ...]:
    k = (-w * q - half * kappa * w * v) / (1 + kappa * w / 4)
    return q + v + half * k, v + k


def two_stages(q: sp.Expr, v: sp.Expr) -> tuple[sp.Expr, ...]:
    matrix = 1 + g**2 * kappa * w
    first_v = (-w * q - g * kappa * w * v) / matrix
    first_q = v + g * first_v
    right_q = v + half * first_v - g * first_v
    right_v = -w * (q + half * first_q) + g * kappa * w * first_q
    second_v = (right_v - g * kappa * w * right_q) / matrix
    return q + right_q + g * second_v, v + second_v


def corrected_predictor(q: sp.Expr, v: sp.Expr, phi: sp.Expr, *, linear_update: bool = True) -> tuple[sp.Expr, ...]:
    matrix = 1 + kappa * w / 4
    k = (phi - half * kappa * w * v) / matrix
    force = -w * (q + v + half * k)
    b = half * (phi + force) - k
    d = b / matrix
    return q + v + half * k + half * d, v + k + d, force + (2 * (d - b) if linear_update else 0)


def hurwitz(step: Step, unknowns: int) -> list[sp.Expr]:
    """Return the coefficients of the polynomial in x, the highest power first."""
    state, x, eigenvalue = sp.symbols(f"s:{unknowns}"), sp.Symbol("x"), sp.Symbol("lambda")
    matrix = sp.Matrix([[sp.diff(row, one) for one in state] for row in step(*state)]).applyfunc(sp.together)
    whole = sp.numer(sp.cancel(matrix.charpoly(eigenvalue).as_expr()))
    numerator = sp.Poly(sp.expand(whole.subs(g, GAMMA)), eigenvalue)
    turned = sum(c * (1 + x) ** m * (1 - x) ** (unknowns - m) for (m,), c in numerator.terms())
    coefficients = [sp.expand(c) for c in sp.Poly(sp.expand(turned), x).all_coeffs()]
    assert len(coefficients) == unknowns + 1
    sign = -1 if coefficients[-1].subs({w: 1, kappa: 1}).evalf() < 0 else 1
    return [sign * c for c in coefficients]


def never_negative(polynomial: sp.Expr, least: sp.Expr) -> bool:
    """Return whether all coefficients in w and kappa - least are at least zero."""
    shifted = sp.Poly(sp.expand(polynomial.subs(kappa, least + above)), w, above)
    return all(sp.nsimplify(sp.radsimp(c)).is_nonnegative for c in shifted.coeffs())


def grows(step: Step, unknowns: int, stiffness: sp.Rational) -> bool:
    """Return whether some step size has an eigenvalue outside of the unit circle."""
    conditions = hurwitz(step, unknowns)
    if unknowns == 3:
        b3, b2, b1, b0 = conditions
        conditions.append(b2 * b1 - b3 * b0)
    sizes = (sp.Rational(1, 100), 1, 100, 10_000, 10**6)
    return any(bool(c.subs({w: size, kappa: stiffness}) < 0) for c in conditions for size in sizes)


def test_one_stage_neither_damps_nor_grows_with_the_true_stiffness_or_more() -> None:
    coefficients = hurwitz(one_stage, 2)
    assert [sp.expand(c) for c in coefficients] == [16, sp.expand(4 * w * (kappa - 1)), 4 * w]
    assert all(never_negative(c, sp.Integer(1)) for c in coefficients)
    assert not grows(one_stage, 2, sp.Rational("1.0")) and grows(one_stage, 2, sp.Rational("0.99"))
    z = sp.Symbol("z")
    function = (1 + z / 2) / (1 - z / 2)
    assert sp.series(function - sp.exp(z), z, 0, 4).removeO() == z**3 / 12


@pytest.mark.slow
def test_two_stages_are_stable_from_085_of_the_stiffness_on_and_damp_all_of_an_infinite_one() -> None:
    least = half + sp.sqrt(2) / 4
    coefficients = hurwitz(two_stages, 2)
    # The first, a w^2 + b w + c, has no real root w where its discriminant is negative: from `least` to `upper`, its
    # other zero, and no positive one where b > 0, which is so before `upper`.
    a, b, c = sp.Poly(coefficients[0], w).all_coeffs()
    discriminant = sp.Poly(sp.expand(b**2 - 4 * a * c), kappa)
    leading, middle, _ = discriminant.all_coeffs()
    upper = sp.radsimp(-middle / leading) - least
    assert leading.evalf() > 0 and sp.simplify(discriminant.eval(least)) == 0
    assert float(sp.solve(b, kappa)[0].evalf()) < float(upper.evalf()) and sp.diff(b, kappa).evalf() > 0
    assert sp.simplify(sp.discriminant(a, kappa)) == 0 and sp.Poly(a, kappa).LC().evalf() > 0 and c > 0
    assert all(never_negative(c, least) for c in coefficients[1:])
    assert not grows(two_stages, 2, sp.Rational("0.854")) and grows(two_stages, 2, sp.Rational("0.853"))
    y, z = sp.Symbol("y", real=True), sp.Symbol("z")
    # L-stable: |denominator|^2 - |numerator|^2 on the imaginary axis, and nothing left at infinity.
    margin = sp.expand((1 + GAMMA**2 * y**2) ** 2 - (1 + (1 - 2 * GAMMA) ** 2 * y**2))
    assert sp.simplify(margin - GAMMA**4 * y**4) == 0
    function = (1 + (1 - 2 * GAMMA) * z) / (1 - GAMMA * z) ** 2
    assert sp.limit(function, z, -sp.oo) == 0
    assert sp.simplify(sp.series(function - sp.exp(z), z, 0, 3).removeO()) == 0


@pytest.mark.slow
def test_a_corrected_prediction_is_stable_from_two_thirds_of_the_stiffness_on() -> None:
    b3, b2, b1, b0 = hurwitz(corrected_predictor, 3)
    least = sp.Rational(2, 3)
    assert all(never_negative(c, least) for c in (b3, b2, b1, b0))
    assert sp.expand(b2 * b1 - b3 * b0 - 128 * w**2 * (kappa - 1) ** 2 * (kappa * w + 4)) == 0
    assert not grows(corrected_predictor, 3, sp.Rational("0.667")) and grows(
        corrected_predictor, 3, sp.Rational("0.66")
    )


def test_without_the_linear_update_of_its_force_it_is_not() -> None:
    def without(*state: sp.Expr) -> tuple[sp.Expr, ...]:
        return corrected_predictor(*state, linear_update=False)

    assert not grows(without, 3, sp.Rational("1.0"))
    assert grows(without, 3, sp.Rational("0.9")) and grows(without, 3, sp.Rational("1.1"))
