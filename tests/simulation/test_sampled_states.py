"""Sampled states are the same controller stepped by hand: hold, delay, rounding, order, rates, with every method."""

from __future__ import annotations

import math
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.codegen.test_stand_alone import compiled, run


def part(name: str) -> str:
    """Return the text of a file of ``sampled``: parts of scenes with sampled states, which tests join."""
    return (Path(__file__).parent / "sampled" / name).read_text(encoding="utf-8")


CART = part("cart.toml")
HOLD = part("held.toml")
#: A measurement of 8 bits, now and at the sample before.
ENCODER = part("encoder.toml")
#: That, its difference as velocity, an integral, and a force that takes effect 3.2 ms later.
DIGITAL = ENCODER + part("digital.toml")
METHODS = ("rk4", "rk45", "taylor", "generalized_alpha", "generalized_alpha_f1", "rosenbrock", "tdg2", "rattlie")


@cache
def model(text: str) -> eomgen.Model:
    return eomgen.build(tomllib.loads(CART + text), profile="quick")


def held_by_hand(t_end: float) -> tuple[float, float, float]:
    q = v = force = 0.0
    for k in range(round(t_end / 0.01)):
        force = 40 * (1 + k * 0.01 - q) - 6 * v
        q, v = q + v * 0.01 + force * 0.5e-4, v + force * 0.01
    return q, v, force


def digital_by_hand(samples: int) -> tuple[float, float]:
    """Return q and v after samples of 10 ms of a unit mass under the digital controller, by exact parabolas."""
    q = v = integral = 0.0
    measured = [0.0]
    asked = [0.0, 0.0, 0.0]
    for k in range(samples):
        t = k * 0.01
        measured.append(math.floor(q * 256 + 0.5) / 256)
        if k % 2 == 0:
            integral += 0.02 * (1 + t - measured[-1])
        asked.append(40 * (1 + t - measured[-1]) - 6 * (measured[-1] - measured[-2]) / 0.01 + 3 * integral)
        for span, force in ((0.0032, asked[-3]), (0.0068, asked[-2])):
            q, v = q + v * span + 0.5 * force * span**2, v + force * span
    return q, v


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "step"), [*((name, 0.007) for name in METHODS), ("rk4", 0.01), ("hht", 0.0025), ("lsrt2", 0.05)]
)
def test_a_held_force_is_that_of_a_controller_by_hand(name: str, step: float) -> None:
    options = {"rho_inf": 0.8} if name.startswith("gen") else {}
    solution = model(HOLD).simulate(0.7, step, method=name, **options)
    q, v, force = held_by_hand(0.7)
    assert solution.success, solution.message
    assert solution.q[-1, 0] == pytest.approx(q, abs=1e-13) and solution.v[-1, 0] == pytest.approx(v, abs=1e-12)
    assert solution.z[0, 0] == 0.5 and solution.z[-1, 0] == pytest.approx(force, abs=1e-11)
    if step == 0.0025:
        assert np.array_equal(solution.z[1:5, 0], [40.0] * 4), "a row at a sample has what held until then"


@pytest.mark.slow
@pytest.mark.parametrize("name", [*METHODS, "corrected_predictor"])
def test_rounding_delays_rates_and_order_are_those_of_a_controller_by_hand(name: str) -> None:
    solution = model(DIGITAL).simulate(2.0, 0.004, method=name, error_estimate=False)
    q, v = digital_by_hand(200)
    assert solution.success, solution.message
    assert solution.q[-1, 0] == pytest.approx(q, abs=1e-11) and solution.v[-1, 0] == pytest.approx(v, abs=1e-10)
    measured = solution.z[:, model(DIGITAL).states.index("measured")]
    assert np.array_equal(measured * 256, np.round(measured * 256)) and len(np.unique(measured)) > 20


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rk4", "generalized_alpha"])
def test_a_simulator_a_checkpoint_and_parameters_go_with_samples(name: str, tmp_path: Any) -> None:
    whole = model(DIGITAL).simulate(1.0, 0.004, method=name, error_estimate=False)
    simulator = model(DIGITAL).start(method=name, step=0.004)
    simulator.step(n=100)
    state = simulator.state
    simulator.step(n=150)
    assert np.array_equal(simulator.q, whole.q[-1]) and np.array_equal(simulator.z, whole.z[-1])
    simulator.restore(state)
    simulator.set_parameter("stiffness", 20.0)
    simulator.advance(0.61)
    assert simulator.t == 0.61 and simulator.q[0] != pytest.approx(whole.at(0.61).q[0])
    path = tmp_path / "run.ckpt"
    model(DIGITAL).simulate(0.4, 0.004, method=name, error_estimate=False, checkpoint=path)
    rest = model(DIGITAL).resume(path, 1.0, error_estimate=False)
    assert np.array_equal(rest.q[-1], whole.q[-1])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "events"), [("rk4", False), ("rk45", True), ("taylor", False), ("generalized_alpha", True)]
)
def test_the_program_in_c_runs_as_simulate_does(name: str, events: bool, tmp_path: Any) -> None:
    text = DIGITAL + ('[events.low]\nwhen = "force - 20"\naction = "record"\n' if events else "")
    eomgen.generate(eomgen.load(tomllib.loads(CART + text)), tmp_path / "c", method=name)
    result = run(compiled(tmp_path / "c"), "1.0", "4e-3", "250")
    assert result.returncode == 0, result.stderr
    assert ("low at t = 0.0132" in result.stderr) == events
    last = [float(word) for word in result.stdout.splitlines()[-1].split(",")]
    q, v = digital_by_hand(100)
    assert last[1:3] == pytest.approx([q, v], abs=1e-11)


@pytest.mark.slow
def test_samples_count_from_the_origin_of_time() -> None:
    """A run that begins between two samples waits for the next one with what it starts from."""
    solution = model(HOLD).simulate(0.031, 0.001, method="rk4", t_start=0.015, error_estimate=False)
    assert np.array_equal(solution.z[:6, 0], [0.5] * 6)
    q = 0.5 * 0.5 * 0.005**2
    assert solution.z[6, 0] == pytest.approx(40 * (1.02 - q) - 6 * 0.5 * 0.005, abs=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "tolerance"), [("rk4", None), ("rk45", None), ("taylor", None), ("generalized_alpha", 1e-6)]
)
def test_events_and_samples_in_one_step(name: str, tolerance: float | None) -> None:
    text = HOLD + '[events.there]\nwhen = "q.x - 0.3"\naction = "stop"\n'
    solution = model(text).simulate(2.0, 0.01, method=name, tolerance=tolerance)
    assert solution.events is not None and solution.events.names == ("there",)
    q = v = 0.0
    for k in range(200):
        force = 40 * (1 + k * 0.01 - q) - 6 * v
        after = q + v * 0.01 + force * 0.5e-4
        if after >= 0.3:
            span = (-v + math.sqrt(v * v + 2 * force * (0.3 - q))) / force
            assert solution.events.t[0] == pytest.approx(k * 0.01 + span, abs=1e-10)
            return
        q, v = after, v + force * 0.01
    raise AssertionError("the cart never gets there")


WRONG: dict[str, dict[str, Any]] = {
    "a state needs its rate, or a sample and a formula, and has sample": {"sample": "1 ms"},
    "and has rate and sample and formula": {"rate": "1", "sample": "1 ms", "formula": "1"},
    "delay belongs to a sampled state, and this state has a rate": {"rate": "1", "delay": "1 ms"},
    "the time between two samples is 0 s": {"sample": 0, "formula": "1"},
    "the quantum -1 is not positive": {"sample": 1, "formula": "1", "quantum": -1},
    "the quantum is in rad, and the formula in m": {"sample": 1, "formula": "q.x", "quantum": "0.1 deg"},
    "the quantum 0 is not positive; try: a positive number, or": {"sample": 1, "formula": "1", "quantum": 0},
    "a delay of -1 s is not between 0 and 1000 samples": {"sample": 1, "formula": "1", "delay": -1},
    "the delay ends 1e-05 s after a sample": {"sample": 1, "formula": "1", "delay": 1.00001},
    "states.a.formula": {"sample": 1, "formula": "a.x"},
    "a mass, a time in s is expected": {"sample": "1 kg", "formula": "1"},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["rk4", "rk45", "taylor", "generalized_alpha"])
def test_a_sampled_quantity_that_passes_zero_does_so_at_a_sample(name: str) -> None:
    """The force falls below 20 N at t = 0.1 s: by hand 20.96 and 18.92 N before and behind it."""
    text = HOLD + '[events.low]\nwhen = "force - 20"\naction = "stop"\n'
    solution = model(text).simulate(0.5, 0.004, method=name, error_estimate=False)
    assert solution.events is not None and solution.events.names == ("low",)
    assert held_by_hand(0.1)[2] > 20.0 > held_by_hand(0.11)[2]
    assert solution.events.t[0] == pytest.approx(0.1, abs=1e-9)


@pytest.mark.slow_cases("rk45")
@pytest.mark.slow_cases("rk4")
@pytest.mark.parametrize("name", ["rk4", "rk45"])
def test_a_parameter_that_moves_an_event_over_zero_between_steps_is_an_event_there(name: str) -> None:
    simulator = model('[events.soft]\nwhen = "(stiffness - 30) * (2 + sin(q.x))"\naction = "record"\n').start(
        method=name, step=0.004
    )
    simulator.step(n=10)
    simulator.set_parameter("stiffness", 20.0)
    simulator.step()
    (event,) = simulator.events
    assert event.name == "soft" and event.t == pytest.approx(0.04, abs=1e-12)


@pytest.mark.parametrize("said", WRONG)
def test_mistakes_in_sampled_states_are_told(said: str) -> None:
    with pytest.raises(eomgen.DescriptionError, match=said):
        eomgen.load(tomllib.loads(CART) | {"states": {"a": WRONG[said]}})


def test_samples_begin_at_zero_and_their_effects_a_delay_later() -> None:
    late = CART + '[states.late]\nsample = "0.5 s"\ndelay = "0.2 s"\nformula = "q.x"\n'
    model = eomgen.build(tomllib.loads(late), profile="instant")
    np.testing.assert_allclose(model.discontinuity_times(-1.5, 1.0), [0.0, 0.2, 0.5, 0.7, 1.0])


@pytest.mark.slow
def test_what_moves_continuously_only_is_refused() -> None:
    for analysis in (model(HOLD).equilibrium, model(HOLD).steady_motion):
        with pytest.raises(eomgen.ModelError, match="the states force are sampled: between samples they stay"):
            analysis()
    with pytest.raises(eomgen.UsageError, match="forces jump 1e\\+06 times within a step of 1e\\+04 s"):
        model(HOLD).simulate(2e4, 1e4, method="rk4")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("formula", "quantum", "text"),
    [
        ("q.x", "12 m", "measured takes 1 value, rounded to multiples of 12 m: its formula goes from 0 to 1.18 m"),
        ("q.x - target", "0.5 m", "measured takes 3 values, rounded to multiples of 0.5 m: its formula goes from -1"),
        ("5.0 + 0 * q.x", "12 m", "measured is 0 all the time, rounded to multiples of 12 m: its formula is 5 m and"),
        ("q.x", "0.1 m", ""),
        ("1.0 if q.x > 0.5 else 0.0", "1 m", ""),
    ],
)
def test_a_quantum_that_leaves_few_values_is_noted(formula: str, quantum: str, text: str) -> None:
    """A number of bits given as the quantum rounds all to 0; a switch has few values by itself."""
    measured = f'[states.measured]\nsample = "10 ms"\nformula = "{formula}"\nquantum = "{quantum}"\nunit = "m"\n'
    model = eomgen.build(tomllib.loads(CART.replace("1 + t", "1.0") + HOLD + measured), profile="instant")
    solution = model.simulate(0.5, 1e-3, method="rk4", initial={"force": 0.0})
    found = [finding for finding in solution.findings if finding.name == "coarse_quantum"]
    assert [finding.text[: len(text)] for finding in found] == [text][: bool(text)]
    assert all("and not a number of bits" in finding.hint for finding in found)
    assert [finding.value for finding in found] == [float(quantum.partition(" ")[0])][: bool(text)]
