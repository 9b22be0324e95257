"""The share of an output's variance that is lost with the modes left out, against spectra and expansions with more."""

from __future__ import annotations

import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid

import eomgen
from eomgen import RandomVibration, random_vibration
from eomgen.products.reliability.random_processes.covariance import (
    Covariance,
    SquaredExponential,
    band,
    exponential,
    kanai_tajimi,
)
from eomgen.products.reliability.vibration.inputs import lost_variance
from eomgen.scene.load import from_data
from tests.models.library import scene

OSCILLATOR = "force - q.slide - 0.2 * v.slide"


def data_of(process: dict[str, Any], effort: str = OSCILLATOR, **others: dict[str, Any]) -> dict[str, Any]:
    """Return a mass of 1 kg that processes push, by a formula of the first one, ``force``."""
    return scene(
        "oscillator",
        joints__slide={"type": "prismatic", "parent": "base", "child": "cart", "axis": [1, 0, 0]},
        random={"force": process, **others},
        efforts={"all": {"joint": "slide", "effort": effort}},
        outputs={"x": {"formula": "q.slide"}},
        simulation={"method": "trapezoidal", "step": 0.005, "duration": 6},
    )


def model_of(process: dict[str, Any], effort: str = OSCILLATOR) -> eomgen.Model:
    return eomgen.build(from_data(data_of(process, effort)), method="trapezoidal")


def found_of(model: eomgen.Model, end: float, step: float, **options: Any) -> RandomVibration:
    return random_vibration(model, "x", end, step, points=False, thresholds=[0.01], method="trapezoidal", **options)


def variance_by_spectrum(process: Covariance, highest: float, end: float, stiffness: float, damping: float) -> float:
    """Return the variance at the end of a run of the oscillator from rest: int G abs(int h exp(-i w s) ds)^2 df."""
    poles = np.roots([1.0, damping, stiffness])
    f = np.linspace(0.0, highest, 400_001)
    w = 2j * math.pi * f
    one, other = (np.expm1((pole - w) * end) / (pole - w) for pole in poles)
    transfer = (one - other) / (poles[0] - poles[1])
    return float(trapezoid(process.density(f) * np.abs(transfer) ** 2, f))


GROUND = {"type": "kanai_tajimi", "frequency": "15 rad/s", "damping": 0.6}
GUSTS = {"type": "exponential", "correlation_time": "2 s"}
ROAD = {"type": "squared_exponential", "correlation_length": "3 m", "speed": "4 m/s", "standard_deviation": 3}
BAND = {"type": "band", "band": [9, 11], "share": 0.99}
LATER, OTHER = {"follows": "force", "delay": 0.4}, {"correlation": {"force": 0.6}, "standard_deviation": 2}
SOIL, WIND = kanai_tajimi(1.0, 15.0, 0.6), exponential(1.0, 2.0)


@pytest.mark.parametrize(
    ("process", "others", "covariance", "between", "delays"),
    [
        ({"type": "band", "band": [3, 5]}, {}, band(1.0, 3.0, 5.0), [[1.0]], [0.0]),
        (GROUND, {}, SOIL, [[1.0]], [0.0]),
        (GUSTS, {}, WIND, [[1.0]], [0.0]),
        ({**GUSTS, "translation": "exp(0.7 * g)"}, {}, WIND, [[0.49]], [0.0]),
        (ROAD, {}, SquaredExponential(3.0, 0.75), [[1.0]], [0.0]),
        (GROUND, {"later": LATER}, SOIL, [[1.0, 1.0], [1.0, 1.0]], [0.0, 0.4]),
        (GUSTS, {"other": OTHER}, WIND, [[1.0, 1.2], [1.2, 4.0]], [0.0, 0.0]),
    ],
)
def test_the_variance_lost_and_kept_is_the_double_sum_over_the_covariance(
    process: dict[str, Any],
    others: dict[str, Any],
    covariance: Covariance,
    between: list[list[float]],
    delays: list[float],
) -> None:
    inputs = from_data(data_of({"modes": 7, **process}, **others)).inputs
    processes = [item.series for item in inputs if item.series is not None]
    times = np.linspace(0.0, 6.0, 241)
    for seed in range(3):
        random = np.random.default_rng(seed)
        weights = [np.cos(random.uniform(0.5, 3.0) * times + random.uniform(0.0, 6.0)) for _ in processes]
        slopes: dict[str, float] = {}
        for one, of_rows in zip(processes, weights, strict=True):
            for name, weight, mode in zip(one.variables, one.weights, one.modes, strict=True):
                value = weight * float(of_rows @ mode((one.speed or 1.0) * times - one.lag))
                slopes[name] = slopes.get(name, 0.0) + value
        slope = 0.7 if processes[0].translation is not None else 1.0
        gradient = slope * np.array([*slopes.values(), 0.5])  # the last one is of something else, such as waves
        by_name = {one.name: of_rows for one, of_rows in zip(processes, weights, strict=True)}
        lost = lost_variance(processes, times, by_name, [*slopes, "else"], gradient)
        variance = gradient[-1] ** 2
        for i, j in product(range(len(processes)), repeat=2):
            lags = np.subtract.outer(times - delays[i], times - delays[j])
            variance += between[i][j] * float(weights[i] @ covariance.at(lags) @ weights[j])
        assert lost == pytest.approx(1.0 - float(gradient @ gradient) / variance, abs=1e-5)
        assert 0.0 < lost < 1.0
    unexplained = lost_variance(processes, times, by_name, [*slopes, "else"], gradient[::-1])
    assert math.isnan(unexplained)


@pytest.mark.long
def test_a_band_far_above_the_resonance_loses_more_of_the_output_than_of_itself() -> None:
    found = found_of(model_of(BAND), 6.0, 0.002)
    expected = variance_by_spectrum(band(1.0, 9.0, 11.0), 12.0, 6.0, 1.0, 0.2)
    kept = found.moments["second_order"][1] ** 2
    assert kept / (1.0 - found.lost_variance) == pytest.approx(expected, rel=0.01)
    assert found.lost_variance == pytest.approx(0.16, abs=0.01)
    told = (
        "the modes left out, with 0.76 % of a process's variance, have 16 % of the output's: its standard deviation is"
        " 8.3 % low; try: share = 0.999245 or more"
    )
    assert "to second order; 16 % of its variance is lost with the modes left out; " in found.message
    assert list(found.notes) == [told] and told in found.message
    assert found.to_dict()["lost_variance"] == found.lost_variance
    assert vars(found.costs["truncation"]) == {"runs": 1, "adjoints": 1, "tangents": 0}
