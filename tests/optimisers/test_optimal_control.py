"""Optimal control over eomgen's steps: the swing-up of an acrobot and the fastest motion of a Panda."""

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


@pytest.mark.slow
def test_the_acrobot_has_the_step_and_the_optimum_of_casadis_symbols(rng: np.random.Generator) -> None:
    own_demo = demo("acrobot_swing_up")
    step, native = eomgen.casadi(own_demo["SCENE"], profile="quick")["step"], own_demo["native_step"]()
    y, w, made = ca.MX.sym("y", 10), ca.MX.sym("w", 4), []
    for function in (step, native):
        end = function(y[:4], y[4], y[5:9], y[9])
        outputs = [end, ca.jacobian(end, y), ca.hessian(ca.dot(w, end), y)[0]]
        made.append(ca.Function("made", [y, w], outputs))
    for _ in range(20):
        point = np.concatenate([rng.normal(size=5), rng.uniform(0.5, 2.0, 4), [0.05]])
        weights = rng.normal(size=4)
        for found, expected in zip(made[0](point, weights), made[1](point, weights), strict=True):
            scale = np.max(np.abs(np.array(expected)))
            assert np.max(np.abs(np.array(found) - np.array(expected))) < 1e-11 * scale
    p = eomgen.build(own_demo["SCENE"], profile="quick").parameter_array()
    best, other = (own_demo["swing_up"](function, p) for function in (step, native))
    assert best.success and other.success
    assert best.iterations == other.iterations
    assert best.cost == pytest.approx(other.cost, rel=1e-9)
    assert best.x == pytest.approx(other.x, abs=1e-6)
    assert best.x[-1] == pytest.approx(own_demo["END"], abs=1e-8)
    assert np.max(np.abs(best.u)) <= own_demo["LARGEST_TORQUE"] * (1.0 + 1e-8)


@pytest.mark.slow
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
