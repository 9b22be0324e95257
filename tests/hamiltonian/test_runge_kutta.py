"""Runge-Kutta methods of the integrator room on Hamiltonian systems, which need not be separable."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from eomgen.integrators.families.adaptive import LARGEST_TOLERANCE, SMALLEST_TOLERANCE
from eomgen.products.fields.documents.tables import TOLERANCES
from tests.hamiltonian.systems import rows_of_program, system
from tests.hamiltonian.test_hamiltonian import reference
from tests.hamiltonian.test_implicit_steps import PENDULUM, model

FALLING = system(
    "falling",
    "p_x**2/2 - 1/x",
    coordinates={"x": {"initial": [1.0, 0.0]}},
)


def test_the_fourth_order() -> None:
    exact, errors = reference(model("pendulum"), 1.0), []
    for step in (0.004, 0.002):
        run = model("pendulum").simulate(1.0, step, method="rk4", error_estimate=False)
        errors.append(np.abs(np.concatenate([run.q[-1], run.p[-1]]) - exact).max())
        assert run.stats["gradients"] == 4 * run.stats["steps"]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.3)


@pytest.mark.parametrize("tolerance", [1e-5, 1e-8, 1e-11])
def test_errors_follow_the_tolerance_in_any_grid(tolerance: float) -> None:
    exact = reference(model("pendulum"), 2.0)
    for step in (2.0, 0.1, -0.1):
        initial = {} if step > 0 else {"q": exact[:2], "p": exact[2:]}
        run = model("pendulum").simulate(
            math.copysign(2.0, step), step, method="rk45", tolerance=tolerance, initial=initial
        )
        error = np.abs(run.q[-1] - (exact[:2] if step > 0 else [1.2, 0.4])).max()
        assert error < 30 * tolerance
        if step > 0:
            assert run.error_estimate.relative * np.ptp(run.q) > error / 5
            assert run.error_estimate.method == f"a run at tolerance {tolerance / 10:.3g}"
            assert math.isnan(run.error_estimate.order)


def test_files_and_runs_have_the_same_bounds_of_tolerances() -> None:
    assert (SMALLEST_TOLERANCE, LARGEST_TOLERANCE) == TOLERANCES


def test_own_steps_are_few_and_go_on_over_rows() -> None:
    many = model("pendulum").simulate(2.0, 0.001, method="rk45", tolerance=1e-4, error_estimate=False)
    assert many.stats["iterations"] == 2000  # the grid is finer than steps need to be
    one = model("pendulum").simulate(2.0, 2.0, method="rk45", tolerance=1e-4, error_estimate=False)
    assert one.stats["iterations"] < 60
    rows = model("pendulum").simulate(2.0, 0.05, method="rk45", tolerance=1e-10, error_estimate=False)
    assert rows.stats["iterations"] < 320  # 277 in one step of the grid, 345 if none told the next one how long it is


def test_a_singularity_stops_steps() -> None:
    made: Any = eomgen.build(FALLING, profile="quick")  # type: ignore[call-overload]
    t_fall = math.pi / (2 * math.sqrt(2))
    run = made.simulate(1.2, 0.1, method="rk45")
    assert not run.success and run.t[-1] == pytest.approx(1.1)
    assert "the motion has a singularity near; try: a larger tolerance, or another end" in run.message
    assert run.t[-1] < t_fall < run.t[-1] + 0.1
    before = made.simulate(1.1, 0.1, method="rk45", tolerance=1e-10)
    x = before.q[-1, 0]
    assert math.sqrt(x * (1 - x) / 2) + math.acos(math.sqrt(x)) / math.sqrt(2) == pytest.approx(1.1, abs=1e-8)


@pytest.mark.parametrize("method", ["rk45", "rk4", "gauss6"])
def test_the_folder_of_c_has_them(method: str, tmp_path: Path) -> None:
    data: Any = {**PENDULUM, "simulation": {"duration": 1.0, "step": 0.1, "tolerance": 1e-9, "method": "rk45"}}
    folder = tmp_path / method
    eomgen.generate(data, folder, method=method)
    rows = rows_of_program(folder)
    options: Any = {"tolerance": 1e-9} if method == "rk45" else {}
    run = model("pendulum").simulate(1.0, 0.1, method=method, **options)
    np.testing.assert_allclose(rows[:, 1:5], np.hstack([run.q, run.p]), atol=1e-11)
