"""The estimated error where steps end at samples and at points of curves, by closed forms of the motion in between."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from eomgen.base.arrays import Array
from eomgen.simulation.stepping.time_grid import StepParts, step_parts
from tests.simulation.rails import built, on_rail
from tests.simulation.test_error_estimate import good

pytestmark = pytest.mark.slow

STIFFNESS = 400.0
FREQUENCY = np.sqrt(STIFFNESS)
SAMPLE = 0.01


def _sled() -> eomgen.SceneBuilder:
    """Return a mass of 1 kg on a spring, 0.1 m from rest, that a force u moves."""
    return on_rail("u", stiffness=STIFFNESS, position=0.1)


LAW = {"sample": "10 ms", "formula": "-20 * q.x - 0.5 * v.x"}


@cache
def sampled() -> eomgen.Model:
    return built(_sled().state("u", **LAW))


@cache
def polygon(last: float) -> eomgen.Model:
    """Return the sled with a force that is linear between points 10 ms apart, up to a time in s, and stays there."""
    curve = {"points": points(last).tolist(), "interpolation": "linear", "outside": "hold", "unit": "N"}
    return built(_sled().input("u", **curve))


def points(last: float) -> Array:
    t = SAMPLE * np.arange(round(last / SAMPLE) + 1)
    return np.stack([t, 8.0 * np.sin(11.0 * t)], axis=1)


def _moved(q: float, v: float, force: float, rate: float, time: float) -> tuple[float, float]:
    """Return q and v after a time, s, in which the force has a constant rate."""
    place, speed = q - force / STIFFNESS, v - rate / STIFFNESS
    angle = FREQUENCY * time
    q = (force + rate * time) / STIFFNESS + place * np.cos(angle) + speed / FREQUENCY * np.sin(angle)
    return q, rate / STIFFNESS - FREQUENCY * place * np.sin(angle) + speed * np.cos(angle)


def known(name: str, t: Array, last: float = 0.0) -> Array:
    """Return the positions at times (n,) s, those of samples or points among them or in between, in closed form."""
    found, state = [], (0.1, 0.0)
    curve = points(last)
    for k in range(round(t[-1] / SAMPLE) + 1):
        if name == "sampled":
            force, rate = -20.0 * state[0] - 0.5 * state[1], 0.0
        else:
            here, there = np.interp([k * SAMPLE, (k + 1) * SAMPLE], curve[:, 0], curve[:, 1])
            force, rate = here, (there - here) / SAMPLE
        inside = t[(t > (k - 1e-6) * SAMPLE) & (t < (k + 1 - 1e-6) * SAMPLE)]
        found += [_moved(*state, force, rate, time - k * SAMPLE)[0] for time in inside]
        state = _moved(*state, force, rate, SAMPLE)
    return np.array(found)


@pytest.mark.parametrize("step", [0.02, 0.01, 0.004, 0.001])
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4"])
def test_steps_that_end_at_samples_state_their_error(method: str, step: float) -> None:
    run = sampled().simulate(1.0, step, method=method)
    true = np.abs(run.q[:, 0] - known("sampled", run.t)).max()
    assert true > 1e-12 and good(run.error.q, true)


@pytest.mark.parametrize("last", [1.0, 0.5])
@pytest.mark.parametrize("step", [0.02, 0.01, 0.002])
def test_steps_that_end_at_points_of_a_curve_state_their_error(step: float, last: float) -> None:
    """Points over half of the run alone: runs at twice the step differ in the other half only."""
    run = polygon(last).simulate(1.0, step, method="rk4")
    true = np.abs(run.q[:, 0] - known("polygon", run.t, last))
    assert good(run.error.q, true.max())
    first = run.error.t <= 0.5
    assert good(run.error.q_at[first].max(), true[run.t <= 0.5].max())


@pytest.mark.parametrize(
    ("name", "method", "tolerance"),
    [
        ("sampled", "rk45", 1e-5),
        ("sampled", "generalized_alpha", 1e-7),
        ("polygon", "taylor", 1e-2),
        ("polygon", "rk45", 1e-7),
        ("polygon", "generalized_alpha", 1e-5),
    ],
)
def test_chosen_steps_that_jumps_bound_state_their_error(name: str, method: str, tolerance: float) -> None:
    run = (sampled() if name == "sampled" else polygon(1.0)).simulate(1.0, 0.01, method=method, tolerance=tolerance)
    true = np.abs(run.q[:, 0] - known(name, run.t, 1.0)).max()
    assert good(run.error.q, true) if true > 1e-13 else run.error.q < 1e-10


def test_parts_of_steps_are_those_between_points_of_the_grid_and_samples() -> None:
    """Sums by hand: steps of 2 s with samples each 3 s are parts of 2, 1, 1, 2 s; of 4 s: 3, 1, 2, 2, 1, 3 s."""
    parts = step_parts({"samples": {"clocks": [[3.0, 0.0]]}}, 0.0, 12.0, 2.0, np.empty(0))
    assert parts.ends.tolist() == [3.0, 6.0, 9.0]
    expected = np.sqrt((27 + 1 + 8 + 8 + 1 + 27) / (2 * (8 + 1 + 1 + 8)))
    assert parts.ratio(2.0, 4.0, np.array([12.0])) == pytest.approx([expected])
    assert parts.tell(2.0, 4.0) and not parts.tell(3.0, 6.0) and parts.tell(1.5, 3.0)
    free = StepParts(np.empty(0), 0.0, 12.0, 2.0)
    assert free.ratio(0.5, 1.0, np.arange(3.0)).tolist() == [2.0, 2.0, 2.0] and free.tell(1.0, 2.0)


@pytest.mark.parametrize(("period", "known_rows"), [("20 ms", False), ("250 ms", True)])
def test_an_energy_that_vanishes_between_samples_is_no_balance(period: str, known_rows: bool) -> None:
    """A stiff spring that numerical damping stops, beside a force of next to no power."""
    swinging = on_rail("u", stiffness=1e4, position=0.1).state("u", sample=period, formula="-0.01 * v.x")
    run = built(swinging).simulate(1.0, 0.01, rho_inf=0.2)
    initial, final = 0.5 * 1e4 * 0.1**2, 0.5 * run.v[-1, 0] ** 2 + 0.5e4 * run.q[-1, 0] ** 2
    assert final < 0.6 * initial  # the held force has the power of 0.1 W at most: of 20 J its work is hardly 0.1 J
    if known_rows:
        assert run.stats["energy_error"] > 0.3 and "the energy is out of balance by" in run.message
    else:
        assert run.metadata["energy_balance"] == "not known: forces jump, or states are sampled, next to most rows"
        assert "energy_error" not in run.stats


@pytest.mark.parametrize("step", [0.01, 0.02])
def test_advice_on_the_step_is_that_of_the_parts_that_were_taken(step: float) -> None:
    """Steps of 20 ms are parts of 10 ms: advice by the step would be twice as long, the error four times."""
    coarse = sampled().simulate(6.0, step)
    assert coarse.message.startswith("reached t = 6 s in ") and "the estimated error is" in coarse.message
    advised = float(coarse.message.split("try: a step smaller than ")[1].split()[0])
    run = sampled().simulate(6.0, advised)
    true = np.abs(run.q[:, 0] - known("sampled", run.t)).max() / np.ptp(run.q)
    assert 0.005 < true < 0.015


@pytest.mark.parametrize(("method", "tolerance"), [("rk45", 1e-2), ("rk45", 1e-9), ("generalized_alpha", 1e-4)])
def test_chosen_steps_between_rows_of_inputs_state_the_error_of_these_as_well(method: str, tolerance: float) -> None:
    """A force of the caller, which steps know at a few times only: DOP853 asks for it at all."""

    def force(t: float) -> float:
        return float(8.0 * np.sin(11.0 * t))

    model = built(_sled().input("u", unit="N"))
    run = model.simulate(1.0, 0.01, method=method, tolerance=tolerance, inputs={"u": force})
    precision = {"rtol": 1e-12, "atol": 1e-13}
    solved = solve_ivp(
        lambda t, x: [x[1], force(t) - STIFFNESS * x[0]], (0.0, 1.0), [0.1, 0.0], "DOP853", run.t, **precision
    )
    assert good(run.error.q, np.abs(run.q[:, 0] - solved.y[0]).max())
