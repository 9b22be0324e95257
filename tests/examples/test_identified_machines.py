"""The identified machines: true values are within intervals of 95 % in most draws of the noise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import stats

import eomgen
from eomgen.base.arrays import Array
from eomgen.pipeline.pipeline import build_for_run
from tests.examples.demos import demo_module


@pytest.fixture(scope="module")
def quarter_car() -> Callable[[int], eomgen.Identification]:
    code = demo_module("identified_quarter_car")
    model = build_for_run(code.scene())
    return lambda seed: eomgen.identify(
        model, code.measured(model, seed), list(code.UNKNOWN), values=code.UNKNOWN, step=code.STEP
    )


@pytest.fixture(scope="module")
def arm() -> Callable[[int], eomgen.Identification]:
    code = demo_module("identified_arm")
    measurement = code.Measurement(build_for_run(code.scene()))
    found: Callable[[int], eomgen.Identification] = measurement.identified
    return found


def distances(found: eomgen.Identification, true: dict[str, float]) -> Array:
    """Return errors of the estimates by their deviations."""
    return np.array([(one.value - true[one.name]) / one.deviation for one in found.estimates])


QUARTER_CAR = {"sprung_mass": 240.0, "unsprung_mass": 36.0, "spring": 16000.0, "damper": 980.0, "tyre": 160000.0}


def arm_parameters() -> dict[str, float]:
    code = demo_module("identified_arm")
    true = {f"viscous{k}": value for k, value in enumerate(code.VISCOUS, 1)}
    true |= {f"dry{k}": value for k, value in enumerate(code.DRY, 1)}
    return true | {"payload_mass": 3.0} | {f"payload_{k}": value for k, value in (code.CENTRE | code.INERTIA).items()}


@pytest.mark.slow
def test_the_quarter_car_is_known_from_one_run(quarter_car: Callable[[int], eomgen.Identification]) -> None:
    found = quarter_car(0)
    assert np.abs(distances(found, QUARTER_CAR)).max() < 3.5
    assert found.notes == () and {one.state for one in found.estimates} == {"determined"}


@pytest.mark.long
def test_intervals_of_the_quarter_car_hold_the_truth(quarter_car: Callable[[int], eomgen.Identification]) -> None:
    check_coverage(quarter_car, QUARTER_CAR)


@pytest.mark.long
def test_the_arm_is_known_from_one_run_by_six_runs_with_derivatives(
    arm: Callable[[int], eomgen.Identification],
) -> None:
    true = arm_parameters()
    assert len(true) == 24
    for seed in range(3):
        found = arm(seed)
        assert np.abs(distances(found, true)).max() < 4.5
        assert found.runs <= 6 and not found.failed


@pytest.mark.long
def test_intervals_of_the_arm_hold_the_truth(arm: Callable[[int], eomgen.Identification]) -> None:
    check_coverage(arm, arm_parameters())


def check_coverage(identified: Callable[[int], eomgen.Identification], true: dict[str, float]) -> None:
    """Assert that each interval, and the ellipsoid of all, hold the truth in 25 of 30 draws; fewer have a chance of
    0.3 %."""
    held, whole, level = np.zeros(len(true)), 0, stats.chi2.ppf(0.95, len(true))
    for seed in range(30):
        found = identified(seed)
        assert found.notes == ()
        off = distances(found, true)
        held += [one.low < true[one.name] < one.high for one in found.estimates]
        whole += off @ np.linalg.solve(found.correlation, off) < level
    assert held.min() >= 25 and whole >= 25, f"{held}, {whole}"
