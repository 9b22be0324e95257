"""Inputs and forces that oscillate faster than the steps: every comparison run sees the same, and the run says so."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

import eomgen

UNSEEN = "varies faster than the steps resolve: between them it is up to"


def cart_with(effort: str = "push", **keys: Any) -> eomgen.Model:
    builder = eomgen.SceneBuilder("cart").body("cart", 2.0)
    builder.joint("rail", "prismatic", "base", "cart", axis=[1, 0, 0]).input("push", unit="N", **keys)
    return eomgen.build(builder.effort("push", "rail", effort).build(), profile="quick")


cart = functools.cache(cart_with)


def sine(frequency: float) -> Callable[[float], float]:
    return lambda t: 100.0 * math.sin(2.0 * math.pi * frequency * t)


def message(model: eomgen.Model, inputs: Mapping[str, Any] | None = None, **options: Any) -> str:
    return model.simulate(1.0, 1e-3, inputs={"push": 0.0} if inputs is None else inputs, **options).message


def exact(frequency: float) -> float:
    """Position after 1 s of 2 kg pushed by ``sine``: a t / W - a sin(W t) / W^2."""
    w = 2.0 * math.pi * frequency
    return 50.0 / w - 50.0 * math.sin(w) / w**2


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4", "rosenbrock"])
def test_an_input_faster_than_the_steps_is_told(method: str) -> None:
    solution = cart().simulate(1.0, 1e-3, inputs={"push": sine(1000.0)}, method=method)
    assert abs(solution.q[-1, 0]) < 1e-6 < abs(exact(1000.0))
    assert f"the input push {UNSEEN} " in solution.message
    assert "N off the line through them, and varies by 67.5 N in all; try: a step much smaller" in solution.message


@pytest.mark.slow
def test_a_force_that_depends_on_time_is_told_too() -> None:
    formula = cart("push + 100 * sin(2 * pi * 1000 * t)")
    told = f"the force along rail, which depends on t, {UNSEEN} 67.5 N off"
    assert told in message(formula) and told in message(formula, record_every=10)
    of_scene = cart(formula="100 * sin(2 * pi * 1000 * t)").simulate(1.0, 1e-3)
    assert f"the input push {UNSEEN} 67.5 N off" in of_scene.message


def noise_held_over_steps() -> Callable[[float], float]:
    values = np.random.default_rng(1).normal(size=1002)
    return lambda t: float(values[int(t * 1000.0 + 1e-6)])


@pytest.mark.slow_cases("generalized_alpha-<lambda>0")
@pytest.mark.parametrize(
    "push",
    [
        sine(20.0),
        lambda t: float(t > 0.5003),
        lambda t: float(t % 0.1 < 0.03),
        lambda t: 5.0,
        noise_held_over_steps(),
        np.random.default_rng(2).normal(size=1001),
    ],
)
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4"])
def test_what_the_steps_see_is_not_told(push: Any, method: str) -> None:
    assert UNSEEN not in message(cart(), {"push": push}, method=method)


@pytest.mark.slow
def test_steps_of_a_methods_own_and_smaller_steps_resolve_it() -> None:
    formula = cart("push + 100 * sin(2 * pi * 1000 * t)")
    for options in ({"method": "rk45", "tolerance": 1e-8}, {"method": "taylor", "tolerance": 1e-8}):
        solution = formula.simulate(1.0, 1e-3, inputs={"push": 0.0}, error_estimate=False, **options)
        assert UNSEEN not in solution.message
        assert solution.q[-1, 0] == pytest.approx(exact(1000.0), rel=1e-4)
    finer = cart().simulate(0.1, 2e-5, inputs={"push": sine(1000.0)}, error_estimate=False)
    assert UNSEEN not in finer.message


@pytest.mark.slow
def test_waves_of_the_scene_end_steps_where_they_jump() -> None:
    wave = cart_with(wave={"shape": "square", "period": 2e-4, "low": -50, "high": 100})
    assert UNSEEN not in wave.simulate(0.1, 1e-3, error_estimate=False).message


def test_a_function_without_a_value_between_the_steps_goes_on() -> None:
    known = {round(k * 1e-3, 9): float(k % 7) for k in range(1001)}
    assert message(cart(), {"push": lambda t: known[round(t, 9)]}) == "reached t = 1 s in 1000 steps"
