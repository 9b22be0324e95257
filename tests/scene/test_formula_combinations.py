"""Formulas as numbers times powers of formulas against their values at random numbers."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.formula.evaluate import evaluate
from eomgen.formula.nodes import Formula, Operation, Symbol, infix
from eomgen.formula.substitution import collect, mean, weighted_sum

A, B = Symbol("parameter", "a"), Symbol("parameter", "b")
FORMULAS: list[Formula] = [
    3.0 * A / (2.0 * B) - A / B,
    (A + 2.0 * B) * (A - B) / (A + B),
    -(A * B) * A / (B * B * 4.0),
    Operation("sqrt", (A,)) * (1.0 + B) * 2.0,
    1.0 / (1.0 / A),
    A - A,
]


@pytest.mark.parametrize("formula", FORMULAS, ids=infix)
def test_collected_formulas_keep_their_values(formula: Formula, rng: np.random.Generator) -> None:
    for a, b in rng.uniform(0.5, 2.0, (5, 2)):
        values = {"a": float(a), "b": float(b)}
        expected = evaluate(formula, lambda symbol, values=values: values[symbol.name])  # type: ignore[misc]
        found = evaluate(collect(formula), lambda symbol, values=values: values[symbol.name])  # type: ignore[misc]
        assert found == pytest.approx(expected, rel=1e-13, abs=1e-15)


def test_sums_of_one_formula_by_numbers_are_one_product() -> None:
    found = weighted_sum([0.25, 0.25, 0.5], [s * A / B for s in (1.0, 2.0, 4.0)])
    assert infix(found) == infix(2.75 * A / B)
    assert infix(collect(1.0 / weighted_sum([0.5, 0.5], [1.0 / (2.0 * A), 1.0 / (4.0 * A)]))) == infix(8 / 3 * A)


def test_the_mean_of_equal_formulas_is_the_formula() -> None:
    formula = Operation("sin", (A,)) + B
    assert mean([0.3, 0.7], [formula, formula]) is formula
