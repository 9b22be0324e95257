"""The corrected predictor: its formula in dense NumPy, order 2 with any matrix, forces that a rig answers with."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.integrators.stepper_models import PROGRAMS
from tests.integrators.test_rosenbrock import error_of_strong, slopes
from tests.integrators.test_rosenbrock import frame as frame_by_parameters
from tests.models.c_programs import printed, program
from tests.models.shear_frame import shear_frame

METHOD = "corrected_predictor"


@cache
def frame() -> eomgen.Model:
    return eomgen.build(shear_frame())


@pytest.mark.slow
def test_order_with_a_kept_matrix_where_the_pendulum_tumbles() -> None:
    runs = [
        frame_by_parameters(frequency=4.0).simulate(
            5.0, 5.0 / count, method=METHOD, settings={"matrix_every": 0}, error_estimate=False
        )
        for count in (1000, 2000, 4000)
    ]
    errors = [error_of_strong(np.concatenate([run.q[-1], run.v[-1]])) for run in runs]
    assert slopes(errors).min() >= 1.95


@pytest.mark.slow_cases("0")
@pytest.mark.parametrize("every", [0, 1])
def test_a_step_is_that_of_the_formula(every: int) -> None:
    made, h = frame(), 0.02
    q, v = made.initial_q.copy(), made.initial_v.copy()
    phi = made.forward_dynamics(q, v, t=0.0)
    K, C, M = made.partials(q, v, phi, t=0.0)
    for number in range(50):
        if every:
            K, C, M = made.partials(q, v, phi, t=number * h)
        matrix = M + h / 2 * C + h * h / 4 * K
        k = np.linalg.solve(matrix, M @ phi - h / 2 * K @ v)
        forces = made.forward_dynamics(q + h * v + h * h / 2 * k, v + h * k, t=(number + 1) * h)
        b = h / 2 * (phi + forces) - h * k
        d = np.linalg.solve(matrix, M @ b)
        q, v, phi = q + h * v + h * h / 2 * k + h / 2 * d, v + h * k + d, forces + (d - b) * 2 / h
    end = made.simulate(50 * h, h, method=METHOD, settings={"matrix_every": every}, error_estimate=False)
    np.testing.assert_allclose(end.q[-1], q, rtol=0, atol=1e-12)
    np.testing.assert_allclose(end.v[-1], v, rtol=0, atol=1e-11)


@pytest.mark.slow
def test_steps_cost_one_evaluation_and_matrices_as_asked_for() -> None:
    for every, factorizations in ((0, 1), (1, 200), (10, 20)):
        stats = frame().simulate(2.0, 0.01, method=METHOD, settings={"matrix_every": every}, error_estimate=False).stats
        assert (stats["factorizations"], stats["evaluations"], stats["exchanges"]) == (factorizations, 201, 0)


RIG = (PROGRAMS / "rig.c").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a program: an oscillator of which a share of the stiffness is in the equations, the rest is measured."""
    folder = tmp_path_factory.mktemp("rig")
    builder = eomgen.SceneBuilder("rig", gravity=[0, 0, 0]).parameter("share", 1.0, tunable=True).input("answer")
    builder.body("mass", 1.0)
    builder.joint("rail", "prismatic", "base", "mass", axis=[1, 0, 0], stiffness="share", initial={"position": 1.0})
    return program(folder, builder.effort("measured", "rail", "answer").build(), METHOD, RIG)


@pytest.mark.slow_cases("1.0")
@pytest.mark.parametrize("share", [1.0, 0.75, 0.0])
def test_forces_measured_at_the_prediction_keep_the_order(rig: Path, share: float) -> None:
    errors = []
    for count in (100, 200, 400):
        t, q, v = printed(rig, 5.0 / count, count, share)[-1]
        errors.append(float(np.hypot(q - np.cos(t), v + np.sin(t))))
    assert slopes(errors) == pytest.approx(2.0, abs=0.1)


def test_a_rig_stays_calm_at_every_step_with_two_thirds_of_its_stiffness_in_the_matrix(rig: Path) -> None:
    """h omega = 100."""
    assert np.abs(printed(rig, 100.0, 2000, 0.69)[:, 1]).max() < 20.0
    assert np.abs(printed(rig, 100.0, 2000, 0.64)[:, 1]).max() > 1e6
