"""Controllers in runs: against the same equations written by hand, with limits and tunable gains; the command line."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from tests.models.library import scene
from tests.simulation.rails import built, on_rail

CONTROLLERS: dict[str, Any] = {
    "motor": {"type": "low_pass", "signal": "servo", "gain": 0.9, "time_constant": 0.02, "initial": 0.4},
    "phase": {
        **{"type": "lead_lag", "signal": "v.hinge", "time_constant": 0.05, "lead": 0.1, "gain": 2},
        **{"initial_filtered": 0.1, "maximum": 1.5},
    },
    "slow": {"type": "pi", "signal": "phase", "proportional": 0.1, "integral": 0.3, "initial": -0.2},
    "servo": {
        **{"type": "pid", "signal": "1 - q.hinge", "proportional": "kp", "integral": 40, "derivative": 8},
        **{"time_constant": 0.01, "minimum": "-top", "maximum": "top", "tracking": 0.5, "initial_filtered": 0.7},
    },
}


SERVO: dict[str, Any] = {
    "gravity": [0, 0, 0],
    "terms": ["forward_dynamics", "internal_rate", "equations", "iteration", "outputs", "energy"],
    "parameters": {"kp": {"value": 40, "tunable": True}, "top": {"value": 12, "tunable": True}},
    "bodies__rod": {"mass": 1, "inertia": [1, 1, 1]},
    "joints__hinge__damping": 0.5,
    "joints__hinge__initial": {"position": 0.3},
    "controllers": CONTROLLERS,
    "efforts": {"motor": {"joint": "hinge", "effort": "motor - 0.2 * slow"}},
    "outputs": {"given": {"formula": ["servo", "motor", "phase", "slow"]}},
}


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(scene("pendulum", **SERVO))


def by_hand(kp: float, top: float) -> Callable[[float, np.ndarray], np.ndarray]:
    def outputs(y: np.ndarray) -> np.ndarray:
        q, v, integral, filtered, motor, lag, slow = y
        free = kp * (1 - q) + integral + 8 * (1 - q - filtered) / 0.01
        phase = min(1.5, 2 * (lag + 2 * (v - lag)))
        return np.array([max(-top, min(top, free)), motor, phase, 0.1 * phase + slow, free])

    def rates(_: float, y: np.ndarray) -> np.ndarray:
        q, v, _, filtered, motor, lag, _ = y
        servo, _, phase, slow, free = outputs(y)
        return np.array(
            [
                v,
                motor - 0.2 * slow - 0.5 * v,
                40 * (1 - q) + (servo - free) / 0.5,
                (1 - q - filtered) / 0.01,
                (0.9 * servo - motor) / 0.02,
                (v - lag) / 0.05,
                0.3 * phase,
            ]
        )

    rates.outputs = outputs  # type: ignore[attr-defined]  # what the test looks at besides
    return rates


@pytest.mark.slow
@pytest.mark.parametrize(("kp", "top"), [(40.0, 12.0), (90.0, 5.0)])
def test_controllers_are_their_equations(model: eomgen.Model, kp: float, top: float) -> None:
    rates = by_hand(kp, top)
    start = [0.3, 0.0, 0.0, 0.7, 0.4, 0.1, -0.2]
    exact = solve_ivp(rates, (0.0, 1.0), start, method="DOP853", rtol=1e-11, atol=1e-12, max_step=1e-3).y[:, -1]
    assert model.states == ("motor_filtered", "phase_filtered", "slow_integral", "servo_integral", "servo_filtered")
    for method, bound in (("rk4", 2e-5), ("generalized_alpha", 2e-3)):
        run = model.simulate(1.0, 5e-4, method=method, parameters={"kp": kp, "top": top})
        assert run.success, run.message
        assert np.allclose(
            np.concatenate([run.q[-1], run.v[-1], run.z[-1][[3, 4, 0, 1, 2]]]), exact, rtol=0, atol=bound
        )
        assert np.allclose(run.outputs["given"][-1], rates.outputs(exact)[:4], rtol=0, atol=20 * bound)  # type: ignore[attr-defined]
        servo = run.outputs["given"][:, 0]
        assert np.abs(servo).max() == top and np.abs(servo[-1]) < top


@pytest.mark.slow
def test_an_integral_that_winds_up_is_the_difference(model: eomgen.Model) -> None:
    """With tracking the overshoot of a saturated step is a fraction of that of a nearly free integral."""
    free = scene("pendulum", **SERVO, controllers__servo__tracking=1e6)
    wound = eomgen.build(free).simulate(4.0, 1e-3, parameters={"top": 2.0})
    held = model.simulate(4.0, 1e-3, parameters={"top": 2.0})
    assert wound.q.max() - 1.0 > 2.0 * (held.q.max() - 1.0) > 0.0


def pushed(kind: str, signal: str, **keys: Any) -> eomgen.SceneBuilder:
    """Return a cart on a rail that a controller pushes."""
    return on_rail("push", "rail").controller("push", kind, signal, **keys)


@pytest.mark.slow
def test_an_explicit_method_says_which_states_are_too_fast_for_it() -> None:
    builder = pushed("low_pass", "1 - q.rail", time_constant="T").parameter("T", 0.01, tunable=True)
    model = built(builder)
    assert "decay" not in model.simulate(0.1, 1e-3, method="rk4").message
    fast = model.simulate(0.1, 1e-3, method="rk4", parameters={"T": 2e-4})
    assert re.search(
        r"internal states decay at up to 5e\+03 1/s at t = \S+ s, too fast for an explicit method at this step; "
        r"try: generalized_alpha, or a step below 0\.00056 s$",
        fast.message,
    )
    assert "decay" not in model.simulate(0.1, 1e-3, parameters={"T": 2e-4}).message
