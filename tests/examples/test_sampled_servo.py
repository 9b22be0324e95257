"""The digital servo against its own equations: the matrix exponential between samples, the controller by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import eomgen

SCENE = Path(__file__).parents[2] / "examples" / "pi_servo" / "sampled.toml"
PERIOD, QUANTUM = 2e-3, 2 * np.pi / 4096


def by_hand(samples: int) -> np.ndarray:
    """Return the state (angles and rates of motor and load) after each sample, (samples + 1, 4)."""
    J, k, d = np.array([0.01, 0.05]), 60.0, 0.02
    A = np.zeros((5, 5))  # with the torque, which is held
    A[:2, 2:4] = np.eye(2)
    A[2:4, :2] = np.array([[-k, k], [k, -k]]) / J[:, None]
    A[2:4, 2:4] = np.array([[-d - 0.01, d], [d, -d - 0.02]]) / J[:, None]
    A[2, 4] = 1.0 / J[0]
    half = expm(A * PERIOD / 2)
    x, rows = np.zeros(5), [np.zeros(4)]
    integral = before = limited = 0.0
    for _ in range(samples):
        measured = np.floor(x[0] / QUANTUM + 0.5) * QUANTUM
        asked = 6 * (1.0 - measured) - 0.72 * (measured - before) / PERIOD + integral
        x[4], x = limited, half @ np.array([*x[:4], limited])
        limited = min(max(asked, -1.2), 1.2)
        integral += PERIOD * (12 * (1.0 - measured) + (limited - asked) / 0.3)
        before = measured
        x = half @ np.array([*x[:4], limited])
        rows.append(x[:4].copy())
    return np.array(rows)


def error_of(method: str, step: float) -> float:
    every = round(PERIOD / step)
    solution = eomgen.build(SCENE).simulate(0.4, step, method=method, record_every=every, error_estimate=False)
    assert solution.success, solution.message
    return float(np.max(np.abs(np.hstack([solution.q, solution.v]) - by_hand(200))))


@pytest.mark.slow
def test_it_is_its_own_equations() -> None:
    assert error_of("taylor", 1e-3) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize(("method", "order", "step"), [("rk4", 4, 1e-3), ("generalized_alpha", 2, 5e-4)])
def test_orders_are_kept_between_samples(method: str, order: int, step: float) -> None:
    """At steps whose errors do not move the encoder onto another line."""
    coarse, fine = error_of(method, step), error_of(method, step / 2)
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.1), (coarse, fine)
