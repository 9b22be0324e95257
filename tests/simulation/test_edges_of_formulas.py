"""Runs that start where a slope of a formula is zero times infinity, and names of formulas without a slope."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import eomgen

DRAG, GRAVITY, END = 0.3, 9.81, 2.0


def falling(size: str) -> dict[str, Any]:
    """Return a body that is let go from rest; ``size`` is the norm of its velocity."""
    return {
        "format": 1,
        "name": "drop",
        "gravity": [0, 0, -GRAVITY],
        "bodies": {"b": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}},
        "joints": {"f": {"type": "free", "parent": "base", "child": "b"}},
        "points": {"o": {"body": "b", "position": [0, 0, 0]}},
        "outputs": {"speed": {"formula": "velocity.o[2]"}},
        "forces": {"drag": {"body": "b", "force": [f"-{DRAG}*velocity.here[{k}]*{size}" for k in range(3)]}},
    }


NORM = "sqrt(velocity.here[0]**2 + velocity.here[1]**2 + velocity.here[2]**2)"


@pytest.mark.slow_cases("generalized_alpha", "rattlie", "taylor", "tdg1", "corrected_predictor", "rk4")
@pytest.mark.parametrize(
    "method", ["generalized_alpha", "rk4", "rosenbrock", "tdg1", "rattlie", "corrected_predictor", "taylor"]
)
def test_quadratic_drag_from_rest(method: str) -> None:
    """v = -sqrt(g/c) tanh(sqrt(g c) t)."""
    run = eomgen.build(falling(NORM), method=method, profile="quick").simulate(END, 0.01)
    exact = -np.sqrt(GRAVITY / DRAG) * np.tanh(np.sqrt(GRAVITY * DRAG) * END)
    assert run.success, run.message
    assert run.outputs["speed"][-1] == pytest.approx(exact, abs=1e-4)


def test_quotient_without_a_value_is_named() -> None:
    run = eomgen.build(falling(f"1/{NORM}"), method="rk4", profile="quick").simulate(0.1, 0.01)
    assert not run.success
    assert "1 / sqrt(velocity.here[0]" in run.message
    assert "may have no value there" in run.message


@pytest.mark.slow
def test_root_without_a_slope_is_named() -> None:
    """From q = 0 the tangent of sqrt(q) is vertical."""
    scene = {
        "format": 1,
        "name": "rise",
        "gravity": [0, 0, 0],
        "bodies": {"b": {"mass": 1.0, "inertia": [0.1, 0.1, 0.1]}},
        "joints": {"x": {"type": "prismatic", "parent": "base", "child": "b", "axis": [1, 0, 0]}},
        "efforts": {"e": {"joint": "x", "effort": "1 + sqrt(q.x)"}},
    }
    run = eomgen.build(scene, method="rosenbrock", profile="quick").simulate(0.1, 0.01)
    assert "; sqrt(q.x) may have no slope there" in run.message
