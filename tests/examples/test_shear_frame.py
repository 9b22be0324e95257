"""The shear frame with a pendulum: digits by DOP853 on equations written by hand, and what its demo writes."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import eomgen
from tests.anchors import anchor

FOLDER = Path(__file__).parents[2] / "examples" / "shear_frame_with_pendulum"
#: q and v: DOP853 at a relative tolerance of 3e-14.
AT_20 = np.array([
    0.0115755347101, 0.0315633856084, 0.0450184105330, -0.2423276703138,
    0.0161887930740, 0.0036895900312, -0.0223027992375, -0.9221490296953,
])  # fmt: skip  # a table
STRONG_AT_5 = np.array([
    -0.113674059921, -0.221442317649, -0.286602688579, -5.676005793853,
    -1.999861579187, -3.452440944801, -4.327406737068, -7.956607172029,
])  # fmt: skip  # a table
#: 4e5 steps of a method of order 7; the stiff storey's velocity is known to 1e-9.
STIFF_AT_10 = np.array([
    1.22867e-7, 0.1373634437235, 0.2291467307201, -2.157586602157,
    7.7e-8, 0.1963752037393, 0.6783053245553, -4.443661436670,
])  # fmt: skip  # a table
STRONG, STIFF = {"frequency": 4.0}, {"first_storey": 2e11}
#: What 1 is small for at 10 s in the stiff case, without the stiff storey.
STIFF_SCALE = np.array([0.12, 0.15, 1.1, 0.7, 0.9, 5.0])


@cache
def frame() -> eomgen.Model:
    return eomgen.build(FOLDER / "scene.toml")


def ends(run: eomgen.Solution, row: int = -1) -> np.ndarray:
    assert run.success, run.message
    return np.concatenate([run.q[row], run.v[row]])


@pytest.mark.slow
def test_weak_and_strong_shaking_have_the_digits_of_another_solver() -> None:
    run = frame().simulate(20.0, 0.05, method="taylor", tolerance=1e-14)
    anchor("shear_frame").check(ends(run, 200))
    np.testing.assert_allclose(ends(run), AT_20, rtol=0, atol=5e-12)
    run = frame().simulate(5.0, 0.05, method="taylor", tolerance=1e-14, parameters=STRONG)
    np.testing.assert_allclose(ends(run), STRONG_AT_5, rtol=0, atol=2e-11)


@pytest.mark.slow
def test_the_stiff_storey_follows_its_load_and_the_others_keep_the_order() -> None:
    stiff = [
        ends(frame().simulate(10.0, step, method="rosenbrock", parameters=STIFF, error_estimate=False)) - STIFF_AT_10
        for step in (5e-3, 2.5e-3, 1.25e-3, 6.25e-4)
    ]
    slow = [float(np.abs(np.delete(error, [0, 4]) / STIFF_SCALE).max()) for error in stiff]
    assert slow[1] < 1e-2
    assert np.log2(slow[2] / slow[3]) == pytest.approx(2.0, abs=0.1)
    assert abs(stiff[1][0]) < 1e-9


def slow_error(method: str, step: float) -> float:
    """Return the error of all but the stiff storey in the stiff case."""
    end = ends(frame().simulate(10.0, step, method=method, parameters=STIFF, error_estimate=False))
    return float(np.abs(np.delete(end - STIFF_AT_10, [0, 4]) / STIFF_SCALE).max())


@pytest.mark.slow
def test_passes_step_over_what_is_stiff_at_high_order() -> None:
    """h omega = 400 and 320. A prototype had 1.4e-5 and 1.9e-8 at 400: it corrected accelerations in every pass, which
    takes three times as long a step."""
    assert slow_error("tdg2", 0.04) == pytest.approx(4.7e-5, rel=0.1)
    assert slow_error("tdg3", 0.04) == pytest.approx(1.9e-7, rel=0.1)
    assert slow_error("tdg3", 0.032) < 5e-8


@pytest.mark.slow
def test_small_explicit_steps_have_the_digits_of_the_stiff_frame() -> None:
    run = frame().simulate(10.0, 2e-5, method="rk4", parameters=STIFF, record_every=500_000, error_estimate=False)
    np.testing.assert_allclose(np.delete(ends(run), [0, 4]), np.delete(STIFF_AT_10, [0, 4]), rtol=0, atol=2e-9)
    stopped = frame().simulate(10.0, 1e-3, method="rk4", parameters=STIFF, error_estimate=False)
    assert not stopped.success and "rk4" not in stopped.message and "unstable at this step" in stopped.message
