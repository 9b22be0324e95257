"""Duffing's oscillator under white noise: moments of many runs in vector lanes against the Fokker-Planck equation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import eomgen
from eomgen.base.arrays import Array
from eomgen.integrators.stepper_layout import default_settings
from eomgen.products.ensembles.lane_code import stepper_in_lanes
from eomgen.simulation.stepping.stepper import LaneStepper
from eomgen.toolchain.library import LaneLibrary

RUNS, SETTLED, END, ROWS_PER_SECOND = 1024, 20.0, 220.0, 1


def stationary(bend: float) -> tuple[float, float]:
    """Return the variance and the kurtosis of q, whose density is exp(-(q^2/2 + bend q^4/4)) but for a factor."""
    mass, second, fourth = (
        quad(lambda q, power=power: q**power * np.exp(-0.5 * q**2 - 0.25 * bend * q**4), -12.0, 12.0, epsabs=1e-13)[0]
        for power in (0, 2, 4)
    )
    return second / mass, fourth * mass / second**2


def oscillator() -> eomgen.Model:
    """q'' + q' + q + bend q^3 = noise; of intensity E[w w] = 2 delta, so the density above is stationary."""
    builder = eomgen.SceneBuilder("oscillator", gravity=[0, 0, 0]).parameter("bend", 1.0, tunable=True)
    builder.input("noise", unit="N").body("mass", 1.0)
    builder.joint("slide", "prismatic", "base", "mass", axis=[1, 0, 0])
    builder.effort("all", "slide", "noise - v.slide - q.slide - bend * q.slide**3")
    return eomgen.build(builder.build(), method="trapezoidal", profile="fast")


def positions(model: eomgen.Model, bend: float, step: float) -> Array:
    """Return q (runs, rows) of settled runs; noise is independent from step to step, with variance 2 / step."""
    library = stepper_in_lanes(model, model.library)
    assert isinstance(library, LaneLibrary), library
    stepper = LaneStepper(library, default_settings(model.library.layout["method"]) | {"step": step})
    steps, each = round(END / step), round(1.0 / (step * ROWS_PER_SECOND))
    noise = np.random.default_rng(round(1.0 / step)).standard_normal((RUNS, steps + 1, 1)) * np.sqrt(2.0 / step)
    parameters = np.full((RUNS, 1), bend)
    rows, _, _, statuses = stepper.runs(np.zeros((RUNS, 3)), parameters, None, each, steps // each, 0, tables=noise)
    assert not statuses.any()
    found: Array = rows[:, round(SETTLED * ROWS_PER_SECOND) :, 1]
    return found


@pytest.mark.slow_cases("0.0")
@pytest.mark.parametrize("bend", [0.0, 1.0])
def test_variance_and_kurtosis_are_those_of_the_fokker_planck_equation(bend: float) -> None:
    """The variance misses a part of step^2, so two steps give it without; errors are those of independent runs."""
    model, expected = oscillator(), stationary(bend)
    if bend == 1.0:
        assert expected == pytest.approx((0.4679199170, 2.43015481), rel=1e-8)  # tabulated
    squares = [np.mean(positions(model, bend, step) ** 2, axis=1) for step in (0.2, 0.1)]
    coarse, fine = (one.mean() for one in squares)
    spread = [one.std() / np.sqrt(RUNS) for one in squares]
    error = np.hypot(4.0 * spread[1], spread[0]) / 3.0
    assert error < 0.006 * expected[0]
    assert abs((4.0 * fine - coarse) / 3.0 - expected[0]) < 3.0 * error
    q = positions(model, bend, 0.05)
    assert np.mean(q**4) / np.mean(q**2) ** 2 == pytest.approx(expected[1], rel=0.015)
