"""The swing-up of a cart-pole over eomgen's step and over the same step in CasADi's own symbols."""

from __future__ import annotations

import runpy
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import eomgen

DEMO = Path(__file__).parents[2] / "examples" / "cart_pole_swing_up" / "demo.py"


@cache
def demo() -> dict[str, Any]:
    return runpy.run_path(str(DEMO))


@cache
def step() -> Any:
    return eomgen.casadi(demo()["SCENE"], profile="quick")["step"]


@pytest.mark.slow
def test_values_jacobian_and_hessian_are_those_of_casadis_symbols(rng: np.random.Generator) -> None:
    y, w = ca.MX.sym("y", 9), ca.MX.sym("w", 4)
    made = []
    for function in (step(), demo()["native_step"]()):
        end = function(y[:4], y[4], y[5:8], y[8])
        outputs = [end, ca.jacobian(end, y), ca.hessian(ca.dot(w, end), y)[0]]
        made.append(ca.Function("made", [y, w], outputs))
    for _ in range(20):
        point = np.concatenate([rng.normal(size=5), rng.uniform(0.5, 2.0, 3), [0.05]])
        weights = rng.normal(size=4)
        for found, expected in zip(made[0](point, weights), made[1](point, weights), strict=True):
            scale = np.max(np.abs(np.array(expected)))
            assert np.max(np.abs(np.array(found) - np.array(expected))) < 1e-12 * scale


def test_the_optimum_is_that_of_casadis_symbols_in_as_many_iterations() -> None:
    p = eomgen.build(demo()["SCENE"], profile="quick").parameter_array()
    own, native = (demo()["swing_up"](function, p) for function in (step(), demo()["native_step"]()))
    assert own.success and native.success
    assert own.iterations == native.iterations <= 20
    assert own.cost == pytest.approx(native.cost, rel=1e-9)
    assert own.x == pytest.approx(native.x, abs=1e-6)
    assert own.x[-1] == pytest.approx(demo()["END"], abs=1e-8)
    approximated = demo()["swing_up"](step(), p, exact=False)
    assert approximated.cost == pytest.approx(own.cost, rel=1e-7)
    assert approximated.iterations > own.iterations
