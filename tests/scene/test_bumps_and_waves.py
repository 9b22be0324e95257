"""Bumps and waves as functions: values and derivatives of SymPy's expressions, ends and kinks."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from eomgen.formula.curves import Bump, Waves

PLACES = np.linspace(-1.0, 4.0, 41)


@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
def test_bumps_and_waves_are_their_expressions(derivative: int) -> None:
    x = sympy.Symbol("x")
    bump, inside = Bump("b", 0.5, 1.7, 0.3), (PLACES >= 0.5) & (PLACES < 2.2)
    expression = sympy.Float(0.15) * (1 - sympy.cos(2 * sympy.pi * (x - sympy.Float(0.5)) / sympy.Float(1.7)))
    expected = [float(expression.diff(x, derivative).subs(x, place)) for place in PLACES[inside]]
    np.testing.assert_allclose(bump(PLACES, derivative)[inside], expected, atol=1e-11)
    assert not bump(PLACES, derivative)[~inside].any()
    harmonics = ((0.3, 2.0, 0.1), (0.2, 5.0, -1.0))
    total = sum(a * sympy.cos(w * x + phase) for a, w, phase in harmonics)
    expected = [float(total.diff(x, derivative).subs(x, place)) for place in PLACES]
    np.testing.assert_allclose(Waves("w", harmonics)(PLACES, derivative), expected, atol=1e-11)


def test_bumps_end_where_their_second_derivative_jumps() -> None:
    bump = Bump("b", 0.5, 2.0, 0.25)
    assert bump.kinks() == [(0.5, 2), (2.5, 2)] and Waves("w", ()).kinks() == []
    assert (str(bump), str(Waves("w", ((1.0, 2.0, 3.0),)))) == ("a bump 0.25 high over 2 from 0.5", "1 harmonics")
    assert (bump(1.5), bump([0.5, 2.5]).tolist()) == (0.25, [0.0, 0.0])
    second = 0.125 * np.pi**2
    np.testing.assert_allclose(bump([0.5 - 1e-12, 0.5, 2.5 - 1e-12, 2.5], 2), [0.0, second, second, 0.0], rtol=1e-9)
    assert Waves("w", ())([[1.0, 2.0]]).tolist() == [[0.0, 0.0]]
