"""Series of the coefficient functions, against mpmath; the functions that make them, called once more."""

from __future__ import annotations

import math
from typing import Any

import mpmath
import numpy as np
import pytest

from eomgen.lie import coefficients as made

#: The functions of y = x^2 in closed form.
CLOSED: dict[str, Any] = {
    "SINC": lambda x: mpmath.sin(x) / x,
    "COS": mpmath.cos,
    "F3": lambda x: (x - mpmath.sin(x)) / x**3,
    "F4": lambda x: (2 - 2 * mpmath.cos(x) - x * mpmath.sin(x)) / x**4,
    "F5": lambda x: (3 * (x - mpmath.sin(x)) / x**3 - (1 - mpmath.cos(x)) / x**2) / x**2,
}


@pytest.mark.parametrize("name", CLOSED)
@pytest.mark.parametrize("x", [0.3, 1.0, 2.4])
def test_series_have_the_values_of_their_functions(name: str, x: float) -> None:
    if name in ("SINC", "COS"):
        x = 0.4 * x / 2.4
    with mpmath.workdps(40):
        expected = float(CLOSED[name](mpmath.mpf(x)))
    assert made.polynomial(getattr(made, name), x * x) == pytest.approx(expected, rel=3e-16)


@pytest.mark.parametrize("exponent", [2, 3, 4, 10, 36])
def test_tails_are_those_of_the_zeta_function(exponent: int) -> None:
    assert made._tail(exponent) == pytest.approx(float(mpmath.zeta(exponent, 3)), rel=2e-16)


def test_coefficients_are_made_of_factorials() -> None:
    assert made._alternating(3, 4) == [(1, 6), (-1, 120), (1, 5040), (-1, math.factorial(9))]
    assert made._derivative([(1, 2), (-3, 4), (5, 6)]) == [(-3, 4), (10, 6)]
    assert made._floats([(1, 3), (-2, 7)], -2) == (-2 / 3, 4 / 7)
    series = [2 * (-1) ** k / (2 * k + 1) for k in range(9)]
    np.testing.assert_allclose(made.ARCTANGENT, series, rtol=0)
    assert made.polynomial(made.ARCTANGENT, 0.01) == pytest.approx(2 * math.atan(0.1) / 0.1, rel=1e-15)
    assert made.polynomial([3.0, -1.0, 2.0], 0.5) == 3.0 - 0.5 + 0.5
