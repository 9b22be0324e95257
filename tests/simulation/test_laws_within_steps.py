"""Errors of runs whose steps pass a law: the estimate holds, or a finding says that it does not."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.formula.motion_faults import steep, steepest
from tests.scene.test_motion_laws import driven, laws_of
from tests.simulation.rails import built, on_rail


def between_stops(stiffness: float, damping: float) -> eomgen.Model:
    """Return a mass that a periodic force drives from one damped stop to the other, each with an onset that is
    narrower than a step."""
    stops = {"lower": -0.2, "upper": 0.2224, "stiffness": stiffness, "damping": damping}
    return built(on_rail("19.57 * cos(5.225 * t)", velocity=2.175, limits=stops))


@pytest.mark.slow_except("rk4-1078.0-20.04")
@pytest.mark.parametrize(
    ("method", "stiffness", "damping"),
    [
        ("rosenbrock", 8385.0, 9.521),
        ("rosenbrock", 1078.0, 20.04),
        ("trapezoidal", 8385.0, 9.521),
        ("rk4", 1078.0, 20.04),
    ],
)
def test_the_onset_of_a_stop_is_a_jump_for_the_step(method: str, stiffness: float, damping: float) -> None:
    model = between_stops(stiffness, damping)
    true = model.simulate(2.0, 1e-3, method="rk45", tolerance=1e-12, error_estimate=False)
    for step, every in ((1e-3, 1), (2.5e-4, 4)):
        run = model.simulate(2.0, step, method=method, record_every=every)
        error = np.abs(run.q - true.q).max()
        assert run.error.available and "runs at 1/3 and 1/5 of the step" in run.error.method
        assert error < 3.0 * run.error.q_at.max() and np.isfinite(run.error.order)


@pytest.mark.slow
def test_a_smooth_stop_is_none() -> None:
    model = built(on_rail("-400 * q.x - 3 * q.x ** 3", position=0.1, velocity=2.0))
    assert "runs at 2 and 4 times the step" in model.simulate(2.0, 1e-3, method="trapezoidal").error.method


@pytest.mark.slow
def test_extrema_of_a_growing_vibration_are_no_jumps() -> None:
    """The largest bends of accelerations belong to the last rows, and there to extrema, whose net change is small."""
    run = built(on_rail(stiffness=100.0, damping=-5.0, position=0.1)).simulate(50.0, 5e-3)
    rate, frequency = 2.5, np.sqrt(100.0 - 2.5**2)
    angle = frequency * run.t
    exact = 0.1 * np.exp(rate * run.t) * (np.cos(angle) - rate / frequency * np.sin(angle))
    assert "1/3" not in run.error.method and not run.error.unordered
    assert 1.0 < run.error.q_at.max() / np.abs(run.q[:, 0] - exact).max() < 3.0


@pytest.mark.slow
@pytest.mark.parametrize("method", ["generalized_alpha", "trapezoidal"])
def test_decays_that_longer_steps_leave_out_are_compared_with_shorter_ones(method: str) -> None:
    """An internal state that falls by exp(-1.5) in a step: differences of longer steps begin after the decay."""
    run = built(on_rail("f").state("f", rate="-f / 1e-3", initial=1.0)).simulate(3.0, 1.5e-3, method=method)
    error = np.abs(run.z[:, 0] - np.exp(-run.t / 1e-3)).max()
    assert error > 0.01 and error < 3.0 * run.error.z_at.max()


def test_a_law_steeper_than_a_step_is_found_with_a_step_that_resolves_it() -> None:
    """What the trapezoidal rule for the rate misses of tanh in one step, against every place of the step."""
    [law] = laws_of(driven("tanh((t - 0.437) / 0.001)", duration=1.0))

    def largest(step: float) -> float:
        u = np.linspace(-2.0, 2.0, 4001) * max(step, 1e-3) / 1e-3
        low, high = u - 500.0 * step, u + 500.0 * step
        rates = np.cosh(low) ** -2.0 + np.cosh(high) ** -2.0
        return float(np.abs(np.tanh(high) - np.tanh(low) - 500.0 * step * rates).max())

    found = steepest(law.formula, (), 0.0, 1.0, 4e-3, False)
    assert found is not None and found.time == pytest.approx(0.437, abs=2e-3)
    assert found.missed == pytest.approx(largest(4e-3), rel=0.02)
    assert found.part == pytest.approx(found.missed / 2.0, rel=0.02)
    assert largest(found.enough) < 0.0031 * 2.0 < largest(2.0 * found.enough)
    turned = steepest(law.formula, (), 0.0, 1.0, 4e-3, True)
    assert turned is not None and turned.missed == pytest.approx(found.missed, rel=0.02)
    assert steepest(law.formula, (), 0.0, 1.0, 2e-4, False) is None
    refused, reported = steep([law], {}, 0.0, 1.0, 4e-3)
    assert not reported and f"over one step it changes by {found.missed:.3g} rad" in refused[0].what
    between = max(step for step in np.linspace(2e-4, 1e-3, 81) if largest(step) < 0.03 * 2.0)
    refused, [reported] = steep([law], {}, 0.0, 1.0, float(between))
    part = float(reported.partition("the integral of its rates, ")[2].partition(" %")[0])
    assert not refused and 1.0 < part <= 3.0  # places that are tried are a quarter of a step apart
