"""The swing-up of a cart-pole over eomgen's step and over the same step in CasADi's own symbols."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.optimisers.test_optimal_control import demo, hold

EXAMPLE = "cart_pole_swing_up"


@cache
def step() -> Any:
    return eomgen.casadi(demo(EXAMPLE)["SCENE"], profile="quick")["step"]


@pytest.mark.slow
def test_values_jacobian_and_hessian_are_those_of_casadis_symbols(rng: np.random.Generator) -> None:
    hold(step(), demo(EXAMPLE)["native_step"](), (4, 1, 3), rng)


def test_the_optimum_is_that_of_casadis_symbols_in_as_many_iterations() -> None:
    p = eomgen.build(demo(EXAMPLE)["SCENE"], profile="quick").parameter_array()
    own, native = (demo(EXAMPLE)["swing_up"](function, p) for function in (step(), demo(EXAMPLE)["native_step"]()))
    assert own.success and native.success
    assert own.iterations == native.iterations <= 20
    assert own.cost == pytest.approx(native.cost, rel=1e-9)
    assert own.x == pytest.approx(native.x, abs=1e-6)
    assert own.x[-1] == pytest.approx(demo(EXAMPLE)["END"], abs=1e-8)
    approximated = demo(EXAMPLE)["swing_up"](step(), p, exact=False)
    assert approximated.cost == pytest.approx(own.cost, rel=1e-7)
    assert approximated.iterations > own.iterations
