"""Recursions of leapfrogs up to order 12: made within a second, of their order, refused for what is wrong with them."""

from __future__ import annotations

import math

import numpy as np
import pytest

import eomgen
from eomgen.errors import UsageError
from eomgen.integrators.compositions import composition_named
from tests.oracles.orders import order_of

HIGHEST = ("yoshida12", "suzuki12", "creutz_gocksch12_1", "creutz_gocksch12_2")


@pytest.mark.parametrize("first", ["drift", "kick"])
@pytest.mark.parametrize("name", ["yoshida6", "yoshida12", "creutz_gocksch8_3", "suzuki10"])
def test_a_matrix_by_levels_is_the_product_of_all_drifts_and_kicks(name: str, first: str) -> None:
    by_levels = composition_named(name, "drift" if first == "drift" else "kick")
    assert len(by_levels.levels) == by_levels.order // 2 - 1
    steps = np.array([0.0, 0.1, 0.7, 1.2])
    state = np.broadcast_to(np.eye(2), (4, 2, 2)).copy()
    for part, fraction in by_levels.parts():
        to, by, sign = (0, 1, 1.0) if part == "drift" else (1, 0, -1.0)
        state[:, to] += sign * fraction * steps[:, None] * state[:, by]
    np.testing.assert_allclose(by_levels.oscillator(steps), state, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("name", HIGHEST)
def test_order_12_against_the_oscillator(name: str) -> None:
    """Errors after a time of 12: they fall by the 12th power, or are rounding already with steps of a radian."""
    composition = composition_named(name)
    assert composition.order == 12
    exact = np.array([[math.cos(12), math.sin(12)], [-math.sin(12), math.cos(12)]])

    def error(steps: int) -> float:
        matrix = np.linalg.matrix_power(composition.oscillator(np.array(12 / steps)), steps)
        return float(np.abs(matrix - exact).max())

    if composition.gradients > 1000:
        assert error(12) < 1e-11
    else:
        assert 11.0 < math.log(error(24) / error(36)) / math.log(1.5) < 13.0


@pytest.mark.parametrize("name", ["yoshida4", "suzuki6", "creutz_gocksch6_3", "yoshida8"])
def test_orders_by_levels_are_orders_of_words(name: str) -> None:
    made = composition_named(name)
    assert order_of(made.fractions, 9) == made.order


OSCILLATOR = {
    "format": 1,
    "kind": "hamiltonian",
    "name": "high_order_oscillator",
    "hamiltonian": "p_x**2/2 + x**2/2",
    "coordinates": {"x": {"initial": [1.0, 0.0]}},
    "simulation": {"duration": 10.0, "step": 0.25},
}


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "yoshida14",
            "method: there is no recursion of leapfrogs of order 14 with 1 on either side; try: an even order",
        ),
        ("suzuki5", "recursion of leapfrogs of order 5 with 2 on either side; try: an even order of 2 to 12"),
        (
            "creutz_gocksch12_9",
            "a step of order 12 with 9 leapfrogs on either side has 2476099 of them; try: at most 4 on either side at"
            " this order, or a lower order",
        ),
        ("creutz_gocksch12", "there is no method 'creutz_gocksch12' of Hamiltonian systems; try: creutz_gocksch4_"),
        ("yoshda8", "there is no method 'yoshda8' of Hamiltonian systems; try: yoshida8"),
    ],
)
def test_refusals_say_the_true_cause(name: str, text: str) -> None:
    with pytest.raises(UsageError) as caught:
        eomgen.build(OSCILLATOR).simulate(method=name)
    assert text in str(caught.value)
