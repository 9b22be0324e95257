"""Optimal control over eomgen's steps: swing-ups of a cart-pole and an acrobot, a fast Panda, a car with preview."""

from __future__ import annotations

import runpy
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest

import eomgen

EXAMPLES = Path(__file__).parents[2] / "examples"


@cache
def demo(example: str) -> dict[str, Any]:
    return runpy.run_path(str(EXAMPLES / example / "demo.py"))


def hold(function: Any, native: Any, sizes: tuple[int, int, int], rng: np.random.Generator) -> None:
    """Hold ends, Jacobians and Hessians of two steps together at random states; sizes of x, u and p."""
    x, u, p = sizes
    y, w, made = ca.MX.sym("y", sum(sizes) + 1), ca.MX.sym("w", x), []
    for step in (function, native):
        end = step(y[:x], y[x : x + u], y[x + u : x + u + p], y[-1])
        outputs = [end, ca.jacobian(end, y), ca.hessian(ca.dot(w, end), y)[0]]
        made.append(ca.Function("made", [y, w], outputs))
    for _ in range(20):
        point = np.concatenate([rng.normal(size=x + u), rng.uniform(0.5, 2.0, p), [0.03]])
        weights = rng.normal(size=x)
        for found, expected in zip(made[0](point, weights), made[1](point, weights), strict=True):
            scale = np.max(np.abs(np.array(expected)))
            assert np.max(np.abs(np.array(found) - np.array(expected))) < 1e-11 * scale


@cache
def step_of(example: str) -> Any:
    return eomgen.casadi(demo(example)["SCENE"], profile="quick")["step"]


@pytest.mark.slow
@pytest.mark.parametrize(("example", "parameters"), [("cart_pole_swing_up", 3), ("acrobot_swing_up", 4)])
def test_swings_up_have_the_step_and_the_optimum_of_casadis_symbols(
    example: str, parameters: int, rng: np.random.Generator
) -> None:
    own_demo, step = demo(example), step_of(example)
    native = own_demo["native_step"]()
    hold(step, native, (4, 1, parameters), rng)
    p = eomgen.build(own_demo["SCENE"], profile="quick").parameter_array()
    best, other = (own_demo["swing_up"](function, p) for function in (step, native))
    assert best.success and other.success
    assert best.iterations == other.iterations
    assert best.cost == pytest.approx(other.cost, rel=1e-9)
    assert best.x == pytest.approx(other.x, abs=1e-6)
    assert best.x[-1] == pytest.approx(own_demo["END"], abs=1e-8)
    assert np.max(np.abs(best.u)) <= own_demo.get("LARGEST_TORQUE", np.inf) * (1.0 + 1e-8)
    if example == "cart_pole_swing_up":
        approximated = own_demo["swing_up"](step, p, exact=False)
        assert approximated.cost == pytest.approx(best.cost, rel=1e-7)
        assert approximated.iterations > best.iterations


@pytest.mark.long
def test_the_fastest_motion_of_panda_is_within_its_limits_and_is_that_of_the_stepper() -> None:
    pytest.importorskip("pinocchio")  # which brings the robots' files
    own_demo = demo("fastest_panda")
    scene, limits = own_demo["arm"](), own_demo["limits"]()
    step = eomgen.casadi(scene, ["forward_dynamics"], profile="quick")["step"]
    best = own_demo["fastest"](step, limits)
    assert best.success
    for low, values, high in (
        (limits.low, best.x[:, :7], limits.high),
        (-limits.speed, best.x[:, 7:], limits.speed),
        (-limits.torque, best.u, limits.torque),
    ):
        assert np.all(low - 1e-6 <= values) and np.all(values <= high + 1e-6)
    by_speed = np.max(np.abs(own_demo["END"] - own_demo["START"]) / limits.speed)
    assert by_speed < best.t[-1] < 1.01 * by_speed
    model, state, h = eomgen.build(scene, profile="quick", method="rk4"), best.x[0], best.t[1]
    names = [item.name for item in model.description.inputs]
    for k, torques in enumerate(best.u):
        run = model.simulate(
            h,
            h,
            method="rk4",
            initial={"q": state[:7], "v": state[7:]},
            inputs=dict(zip(names, torques.tolist(), strict=True)),
        )
        state = np.concatenate([run.q[-1], run.v[-1]])
        assert state == pytest.approx(best.x[k + 1], abs=1e-6)
    assert state[:7] == pytest.approx(own_demo["END"], abs=1e-6)
