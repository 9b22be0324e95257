"""The position servo of the examples: without limits against linear theory, with limits against its equations by
hand."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import eomgen

FOLDER = Path(__file__).parents[2] / "examples" / "pi_servo"
ROTOR, LOAD, STIFFNESS, SHAFT, LAG = 0.01, 0.05, 60.0, 0.02, 4e-3


def rates(y: np.ndarray, limit: float, tracking: float) -> np.ndarray:
    """Return the rates of (motor, load, their velocities, integral, torque)."""
    motor, load, w, u, integral, torque = y
    e = 1.0 - motor - 0.12 * w
    free = 6.0 * e + integral
    asked = max(-limit, min(limit, free))
    shaft = STIFFNESS * (motor - load) + SHAFT * (w - u)
    return np.array(
        [
            w,
            u,
            (torque - shaft - 0.01 * w) / ROTOR,
            (shaft - 0.02 * u) / LOAD,
            12.0 * e + (asked - free) / tracking,
            (asked - torque) / LAG,
        ]
    )


def linear(t: float) -> np.ndarray:
    """Return the state without limits: the exponential of the matrix of the rates, which are affine."""
    at_zero = rates(np.zeros(6), np.inf, 1.0)
    A = np.zeros((7, 7))
    A[:6, :6] = np.column_stack([rates(unit, np.inf, 1.0) - at_zero for unit in np.eye(6)])
    A[:6, 6] = at_zero
    return (expm(A * t) @ np.eye(7)[6])[:6]


@pytest.fixture(scope="module")
def model() -> eomgen.Model:
    return eomgen.build(FOLDER / "scene.toml")


def state(run: eomgen.Solution) -> np.ndarray:
    assert run.success, run.message
    return np.concatenate([run.q[-1], run.v[-1], run.z[-1]])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "steps", "order", "tolerance"),
    [("generalized_alpha", (600, 1200), 2.0, 0.1), ("rk4", (300, 600), 4.0, 0.2)],
)
def test_without_limits_it_is_linear(
    model: eomgen.Model, method: str, steps: tuple[int, int], order: float, tolerance: float
) -> None:
    exact = np.array([linear(0.05 * k) for k in range(7)])
    errors = []
    for count in steps:
        run = model.simulate(0.3, 0.3 / count, method=method, parameters={"limit": 1e6}, record_every=count // 6)
        errors.append(np.abs(np.hstack([run.q, run.v, run.z]) - exact).max(axis=0))
    slopes = np.log2(errors[0] / errors[1])
    assert np.all(np.abs(slopes - order) <= tolerance), slopes


@pytest.mark.long_cases("0.3")
@pytest.mark.slow
@pytest.mark.parametrize("tracking", [0.3, 1e6])
def test_with_limits_it_is_what_its_equations_say(model: eomgen.Model, tracking: float) -> None:
    exact = solve_ivp(
        lambda _, y: rates(y, 1.2, tracking),
        (0, 1.5),
        np.zeros(6),
        method="DOP853",
        rtol=1e-11,
        atol=1e-12,
        max_step=2e-4,
    ).y[:, -1]
    run = model.simulate(1.5, 2e-4, method="rk4", parameters={"tracking": tracking})
    assert np.max(np.abs(state(run) - exact) / (1.0 + np.abs(exact))) <= 2e-5
    assert np.abs(run.outputs["torques"][:, 0]).max() == 1.2


def test_figures_of_the_readme(model: eomgen.Model) -> None:
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    held, wound = (100.0 * (model.simulate(parameters={"tracking": x}).q[:, 1].max() - 1.0) for x in (0.3, 1e6))
    assert re.search(rf"overshoots by {held:.1f} %", readme) and re.search(rf"by {wound:.1f} %", readme)
