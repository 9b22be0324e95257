"""An implicit family from another distribution: what implicit families share serves it as it serves eomgen's own.

A module and its templates (``midpoint``), through an entry point; matrix, pivots, factors, substitution and inputs are
eomgen's.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root

import eomgen
from tests.integrators.test_taylor import SCENES, error, model, reference
from tests.models.distributions import distribution, register
from tests.models.shear_frame import shear_frame

pytestmark = pytest.mark.slow

__all__ = ["register"]

METHOD = "implicit_midpoint"


@pytest.fixture(autouse=True)
def installed(register: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    entry = "midpoint = tests.integrators.midpoint.family:Midpoint"
    monkeypatch.syspath_prepend(distribution(tmp_path / "site", "eomgen-midpoint", entry))


def slopes(errors: list[float]) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / errors[1:])


@pytest.mark.parametrize("name", SCENES)
def test_order_on_rotations_poses_and_internal_states(name: str) -> None:
    """A driven pendulum; SE(3), SO(3) and R in flight; a cart with internal states. References by DOP853."""
    made, exact = model(name), reference(name, 0.8)
    errors = [error(made, made.simulate(0.8, 0.8 / count, method=METHOD), exact) for count in (40, 80, 160)]
    assert slopes(errors) == pytest.approx(2.0, abs=0.05)


@cache
def frame() -> eomgen.Model:
    return eomgen.build(shear_frame(), profile="quick")


def test_steps_solve_the_midpoint_equations() -> None:
    """Against a general root finder on the model's functions."""
    made, h = frame(), 0.02
    q, v = made.initial_q.copy(), made.initial_v.copy()
    for k in range(20):

        def missing(a: np.ndarray, k: int = k, q: np.ndarray = q, v: np.ndarray = v) -> np.ndarray:
            middle = v + h / 2 * a
            return made.inverse_dynamics(q + h / 2 * middle, middle, a, t=(k + 0.5) * h)

        a = root(missing, np.zeros(made.nv), tol=1e-13).x
        q, v = q + h * (v + h / 2 * a), v + h * a
    end = made.simulate(20 * h, h, method=METHOD)
    np.testing.assert_allclose(end.q[-1], q, rtol=0, atol=1e-11)
    np.testing.assert_allclose(end.v[-1], v, rtol=0, atol=1e-10)
