"""Distributions of outputs under random processes: the Duffing oscillator against NumPy's, costs, files, mistakes."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy import integrate, special
from scipy.stats import norm

import eomgen
from eomgen import RandomVibration, random_vibration
from eomgen.errors import UsageError
from eomgen.products.reliability.tails.most_probable_point import JUMPING, MostProbablePoint, UnreachedThreshold
from eomgen.products.reliability.vibration.distributions import notes_on_unreached
from eomgen.products.reliability.vibration.inputs import processes_of, truncated_processes
from eomgen.products.reliability.vibration.result import Process, _title_of_modes
from eomgen.products.reliability.vibration.run_response import first_passage, judged_passage, not_normal
from eomgen.scene.load import from_data
from tests.models import library
from tests.reliability.duffing import Duffing

START = 0.48835331272856514
FORCE = {"type": "squared_exponential", "correlation_time": "1 s", "seed": 1, "unit": "N"}
FORCE |= {"translation": "0.5 * (1 + 0.3 * g)**2"}
LAW = "force - q.slide - cubic * q.slide**3 - 0.2 * v.slide"


def scene(
    cubic: float = 0.1,
    share: float = 0.9999,
    start: float = START,
    law: str = LAW,
    duration: float = 15.0,
    **process: Any,
) -> dict[str, Any]:
    """Return the Duffing oscillator under a process, which is another one if its keys are given."""
    return library.scene(
        "oscillator",
        name="duffing",
        simulation={"method": "trapezoidal", "step": 0.05, "duration": duration},
        parameters={"cubic": {"value": cubic, "tunable": True}},
        random={"force": (process or FORCE) | {"share": share}},
        joints__slide__stiffness=None,
        joints__slide__initial={"position": start},
        efforts={"all": {"joint": "slide", "effort": law}},
        outputs={"x": {"formula": "q.slide", "unit": "m"}, "pair": {"formula": ["q.slide", "v.slide"]}},
    )


def block(random: dict[str, Any], outputs: dict[str, Any]) -> dict[str, Any]:
    """Return a mass at rest beside random constants."""
    simulation = {"duration": 0.1, "step": 0.05, "method": "rk4"}
    rest = {"joints__slide__stiffness": None, "joints__slide__initial": None, "name": "block"}
    return library.scene("oscillator", random=random, outputs=outputs, simulation=simulation, **rest)


@pytest.fixture(scope="module")
def duffing() -> eomgen.Model:
    return built(scene())


def built(data: dict[str, Any]) -> eomgen.Model:
    return eomgen.build(from_data(data), method="trapezoidal")


def study(model: eomgen.Model, output: str = "x", **options: Any) -> RandomVibration:
    return random_vibration(model, output, 15.0, 0.05, method="trapezoidal", **options)


@pytest.mark.slow
def test_moments_and_tails_at_the_mean_are_those_of_the_oracle(duffing: eomgen.Model) -> None:
    found = study(duffing, thresholds=[-0.7159, 1.1862], points=False)
    assert "left out, with" not in found.message
    oracle = Duffing(0.1, 0.3).expansion(np.zeros(21)).form
    expected = oracle.moments
    np.testing.assert_allclose(found.moments["second_order"], expected, rtol=2e-4)
    assert found.moments["first_order"][2:] == (0.0, 0.0)
    assert [(one.name, one.variables) for one in found.processes] == [("force", 21)]
    assert found.processes[0].captured >= 0.9999
    assert vars(found.costs["second_order"]) == {"runs": 0, "adjoints": 1, "tangents": 0}


@pytest.mark.long
def test_the_distribution_at_most_probable_points_is_that_of_the_oracle(duffing: eomgen.Model) -> None:
    """FORM 0.00163, quadratic 0.00106 where a million samples have 0.00100 (dossier, 4.6)."""
    found = study(duffing, thresholds=[-1.0978, 1.1862], samples=1000, tail_samples=1000, levels=[1.5])
    assert found.distributions["form"].below[0] == pytest.approx(0.00163, rel=5e-3)
    assert found.distributions["quadratic"].below[0] == pytest.approx(0.00106, rel=5e-3)
    sampled = found.distributions["importance_sampling"]
    assert sampled.low[0] < found.distributions["quadratic"].below[0] < sampled.high[0]
    counted = found.distributions["monte_carlo"]
    assert counted.low[1] < found.distributions["quadratic"].below[1] < counted.high[1]
    assert found.moments["monte_carlo"][1] == pytest.approx(0.5333, rel=0.05)
    passage = found.first_passage[1.5]
    assert passage["crossing_rate"] == pytest.approx(passage["monte_carlo"], abs=0.08)
    assert [note[:36] for note in found.notes] == ["the quadratic form about the mean mi"]
    assert found.moments["corrected"][1] == pytest.approx(0.5333, rel=0.03)
    true = found.distributions["corrected"]
    assert true.low[0] < 0.00100 < true.high[0] and 0.00085 < true.below[0] < 0.00115
    assert np.all(np.abs(found.errors["quadratic"]) < 0.15) and abs(found.errors["form"][0] - 0.6) < 0.15
    assert found.indices[0] < 0.0 < found.indices[1]


@pytest.mark.slow
def test_covariance_with_earlier_times_of_the_linear_oscillator() -> None:
    """Reference digits of integrators_and_random_vibration.md 4.6; modes of another quadrature move the fifth."""
    found = study(built(scene(0.0, start=0.5)), thresholds=[0.5], points=False, times=[10.0, 15.0])
    np.testing.assert_allclose(found.autocovariance["second_order"], [0.00998309, 0.35781765], atol=2e-4)
    assert abs(found.autocovariance["first_order"][1] - 0.35781765) > 1e-3


@pytest.mark.long
def test_a_method_without_derivatives_in_rows_of_inputs_finds_the_distribution_about_rest() -> None:
    """All of the motion about rest is rounding, in which no step misses a singular position."""
    linear = scene(0.0, 0.9, start=0.0, **FORCE | {"translation": "0.5 * g"})
    deviations = []
    for method in ("rk4", "trapezoidal"):
        model = eomgen.build(from_data(linear), method=method)
        found = random_vibration(model, "x", 2.0, 0.02, method=method, points=False)
        deviations.append(found.moments["second_order"][1])
    assert deviations[0] == pytest.approx(deviations[1], rel=1e-3)


def test_a_gradient_that_changes_fast_is_said_to_jump_only_with_a_kink() -> None:
    last = SimpleNamespace(threshold=0.5, point=np.array([3.0, 4.0]))
    missed = {0: UnreachedThreshold(cast("MostProbablePoint", last), 1.5, JUMPING)}
    (note,) = notes_on_unreached(missed, np.array([1.5]), list)
    assert (
        "5 standard deviations out, where the gradient of the response changes more than its Hessian predicts" in note
    )
    assert "near a saddle from which motions part (no jump of slopes was found in formulas): 1.5 have none" in note
    (note,) = notes_on_unreached(missed, np.array([1.5]), lambda: ["max(q.slide, 0)"])
    assert "where the gradient of the response jumps" in note and ": by max(q.slide, 0): 1.5 have none" in note


def test_rates_of_crossings_are_the_closed_forms() -> None:
    """cos(w t) z1 + sin(w t) z2: w exp(-b^2 / 2) / 2 pi (Rice); c t + z and (1 + t) z pass b once: by distributions."""
    t, b = np.linspace(0.0, 2.0, 4001), 1.3
    up = norm.sf(b)

    def of(integral: float) -> float:
        return float(up + (1.0 - up) * -np.expm1(-integral))

    w, none = 5.0, np.zeros_like(t)
    turning = np.stack([np.cos(w * t), np.sin(w * t)], axis=1)
    rate = w / (2.0 * np.pi) * np.exp(-0.5 * b**2)
    assert first_passage(t, none, turning, b) == pytest.approx(of(2.0 * rate), rel=1e-5)
    drift = first_passage(t, 0.4 * t, np.ones((len(t), 1)), b)
    assert drift == pytest.approx(of(norm.cdf(b) - norm.cdf(b - 0.8)), rel=1e-5)
    growing = first_passage(t, none, (1.0 + t)[:, None], b)
    assert growing == pytest.approx(of(norm.cdf(b) - norm.cdf(b / 3.0)), rel=1e-5)


@pytest.mark.long
def test_forces_that_jump_leave_samples_alone() -> None:
    """The mean run passes the jump; where it does not, one on the way to a most probable point does."""
    jumping = built(scene(0.1, 0.9, start=0.1, law=f"{LAW} - (0.1 if q.slide > 0.3 else 0)"))
    told = r"random_vibration: forces jump near t = [\d.]+ s by a comparison in effort all, at a moment that force_z\d"
    with pytest.raises(UsageError, match=told + r" moves, .*; try: samples=4000 \(--monte-carlo 4000\), which take no"):
        random_vibration(jumping, "x", 3.0, 0.05, method="trapezoidal")
    found = random_vibration(jumping, "x", 3.0, 0.05, method="trapezoidal", samples=40, times=[1.0], levels=[0.7])
    assert list(found.distributions) == list(found.moments) == ["monte_carlo"]
    assert "samples alone are left: forces jump near t = " in found.message
    assert (
        not found.autocovariance
        and not len(found.times)
        and list(found.first_passage[0.7]) == ["monte_carlo", "preferred"]
    )
    assert np.isnan(found.indices).all() and np.all(np.diff(found.thresholds) > 0.0)
    far = built(scene(0.1, 0.9, law=f"{LAW} - (0.1 if q.slide > 0.6 else 0)"))
    with pytest.raises(UsageError, match="random_vibration: forces jump near t = "):
        random_vibration(far, "x", 3.0, 0.05, thresholds=[0.9], method="trapezoidal")
    found = random_vibration(far, "x", 3.0, 0.05, thresholds=[0.9], method="trapezoidal", samples=40)
    assert "form" not in found.distributions and {"second_order", "monte_carlo"} <= set(found.distributions)
    assert "most probable points are left out: forces jump near t = " in found.message


def test_samples_contradict_rates_of_crossings_of_responses_that_are_not_normal() -> None:
    assert judged_passage(1.0, 0.1, 100, 1000, normal=True) == (0.1, "")
    assert judged_passage(1.0, 0.1, 110, 1000, normal=True) == (0.1, "")
    value, note = judged_passage(5.0, 2.4e-9, 10, 1000, normal=False)
    assert value == 0.01 and "has probability 2.4e-09 by the rate of crossings of a normal process and 0.01 by" in note
    value, note = judged_passage(5.0, 0.1, 0, 1000, normal=True)
    assert value == 0.0 and note.endswith(
        "crossings come in clumps, and the rate takes each as independent of the others [W0069]"
    )
    _, note = judged_passage(5.0, 0.1, 0, 1000, normal=False)
    assert note.endswith("which is preferred: the response is not normal [W0069]")
    _, note = judged_passage(5.0, 0.1, 300, 1000, normal=True)
    assert note.endswith("which is preferred [W0069]")
    value, note = judged_passage(
        1.8, 0.3954, 2231, 6400, normal=True
    )  # eight standard errors, and a difference of 12 %
    assert value == pytest.approx(0.3486, abs=1e-4) and "which is preferred" in note
    assert judged_passage(1.8, 0.3954, 349, 1000, normal=True) == (0.3954, "")  # three standard errors
    normal = np.random.default_rng(1).standard_normal(1000)
    assert not not_normal(3.0 + 2.0 * normal, 3.0, 2.0)
    assert "samples lie more than two standard deviations out, not 4.6 %" in not_normal(normal**3, 0.0, 1.0)


def test_last_modes_that_matter_to_the_output_are_noted() -> None:
    duffing: Any = SimpleNamespace(description=from_data(scene()))
    variables = processes_of(duffing)[1]
    slopes = np.array([1.0] * 19 + [0.02, 0.02])
    assert truncated_processes(duffing, variables, slopes) == []
    (note,) = truncated_processes(duffing, variables, np.where(slopes < 1.0, 1.0, slopes))
    assert note.startswith("the last 2 of 21 modes of force have 9.5 % of the output's variance, to first order: the")


@pytest.mark.parametrize(
    ("kinds", "title"),
    [
        (["exponential"], "Karhunen-Loève modes of the random processes"),
        (["waves"], "Energies of the waves, of two variables each"),
        (["exponential", "waves"], "Karhunen-Loève modes of the random processes, energies of the waves"),
    ],
)
def test_the_title_of_modes_tells_waves_from_processes(kinds: list[str], title: str) -> None:
    assert _title_of_modes([Process("sea", kind, 2, 1.0, (1.0, 0.5)) for kind in kinds]) == title


@pytest.mark.long
def test_a_largest_value_in_the_output_is_the_reason_for_a_jump_of_its_gradient() -> None:
    """Of y = max(x1 - 2.2, x2 - 2.6) alone, and of no other output."""
    constant = {"type": "constant", "distribution": "normal(0, 1)"}
    outputs = {"y": {"formula": "max(2.6 - x2, 2.2 - x1)"}, "z": {"formula": "x1 * x2"}}
    model = eomgen.build(block({"x1": constant, "x2": constant}, outputs))
    found = eomgen.random_vibration(model, "y", thresholds=[0.0])
    true = special.ndtr(-2.2) * special.ndtr(-2.6)
    assert found.distributions["corrected"].low[0] < true < found.distributions["corrected"].high[0]
    assert "by a largest value in output y" in found.message
    product = eomgen.random_vibration(model, "z", thresholds=[5.0])
    assert abs(product.indices[0]) == pytest.approx(np.sqrt(10.0), rel=1e-6)
    true = integrate.quad(special.k0, 5.0, 60.0)[0] / np.pi
    assert 1.0 - product.distributions["corrected"].high[0] < true < 1.0 - product.distributions["corrected"].low[0]
    assert "largest value" not in product.message and "of the variance of the process" not in product.message
