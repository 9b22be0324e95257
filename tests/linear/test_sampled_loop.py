"""Linear models of scenes with sampled states, against closed forms and against runs."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import eomgen
from tests.models.library import scene

HOLD = {"sample": "10 ms", "formula": "-300 * q.slide - 20 * v.slide", "unit": "N"}
#: Two clocks, a chain of values at the same time, delays of whole samples and of parts, an actuator that lags.
CLOCKS: dict[str, dict[str, Any]] = {
    "measured": {"sample": "10 ms", "formula": "q.slide"},
    "before": {"sample": "10 ms", "formula": "measured", "delay": "10 ms"},
    "integral": {"sample": "20 ms", "formula": "integral - 0.02 * measured"},
    "asked": {
        "sample": "10 ms",
        "formula": "-200 * measured - 15 * (measured - before) / 0.01 + 30 * integral",
        "delay": "3.2 ms",
    },
    "force": {"rate": "(asked - force) / 0.02"},
}


def cart(**states: dict[str, Any]) -> eomgen.Model:
    """Return a cart of 2 kg that the state ``force`` pushes."""
    free = {"bodies__cart__mass": 2.0, "joints__slide__stiffness": None, "joints__slide__initial": None}
    efforts = {"force": {"joint": "slide", "effort": "force"}}
    return eomgen.build(scene("oscillator", **free, states=states, efforts=efforts), profile="instant")


def test_held_outputs_are_inputs_of_the_continuous_part_and_the_loop_is_the_closed_form() -> None:
    linear = cart(force=HOLD).linearize()
    space, loop = linear.state_space(), linear.sampled_loop()
    assert (space.states, space.inputs, space.unit("inputs", "force")) == (("slide", "v.slide"), ("force",), "N")
    np.testing.assert_allclose(space.A, [[0, 1], [0, 0]], atol=1e-14)
    np.testing.assert_allclose(space.B, [[0], [0.5]], atol=1e-14)
    T, m, k, d = 0.01, 2.0, 300.0, 20.0
    expected = [[1 - k * T**2 / (2 * m), T - d * T**2 / (2 * m), 0], [-k * T / m, 1 - d * T / m, 0], [-k, -d, 0]]
    np.testing.assert_allclose(loop.A, expected, rtol=1e-9, atol=1e-10)
    assert (loop.states, loop.sample, loop.unit("states", "z.force")) == (("slide", "v.slide", "z.force"), T, "N")
    np.testing.assert_allclose(loop.C, [[1, 0, 0]], atol=1e-14)
    largest = np.max(np.abs(np.linalg.eigvals(np.array(expected)[:2, :2])))
    assert loop.decay == pytest.approx(-np.log(largest) / T, rel=1e-8)


@pytest.mark.slow
def test_several_clocks_and_delays_move_as_the_matrix_says() -> None:
    whole = cart(**CLOCKS)
    loop = whole.linearize().sampled_loop()
    assert loop.sample == pytest.approx(0.02) and loop.stability == "stable"
    run = whole.simulate(1.0, 1e-3, method="rk4", initial={"slide": 0.3}, error_estimate=False)
    z = [name for name in loop.states if name.startswith("z.")]
    assert sorted(z) == sorted(whole.z_names)
    found = np.column_stack([run.q, run.v, *(run.z[:, whole.z_names.index(name)] for name in z)])[::20]
    state = found[0]
    for row in found:
        np.testing.assert_allclose(row, state, atol=1e-6 * np.abs(found).max(axis=0).max())
        state = loop.A @ state


@pytest.mark.slow
def test_what_grows_does_so_at_the_rate_of_the_loop() -> None:
    torque = {"sample": "20 ms", "formula": "-3 * sin(q.hinge)", "unit": "N m"}
    pole = eomgen.build(
        scene(
            "pendulum",
            bodies__rod={"mass": 1, "center_of_mass": [0, 0, 0.5], "inertia": [0.02, 0.02, 0.001]},
            joints__hinge__initial={"position": 1e-7},
            states={"torque": torque},
            efforts={"torque": {"joint": "hinge", "effort": "torque"}},
            simulation={"method": "rk4"},
        ),
        profile="instant",
    )
    loop = pole.linearize(at="initial").sampled_loop()
    assert loop.stability == "unstable"
    run = pole.simulate(4.0, 1e-3, error_estimate=False)
    late = run.q[[2000, 3000, 4000], 0]
    assert np.log(late[1:] / late[:-1]) == pytest.approx(-loop.decay, rel=1e-3)


@pytest.mark.slow
def test_what_has_no_sampled_loop_is_told() -> None:
    with pytest.raises(eomgen.ModelError, match="no states are sampled; try: state_space"):
        cart(force={"rate": "-force"}).linearize(at="initial").sampled_loop()
    odd = {"sample": 0.01 * math.sqrt(2.0), "formula": "q.slide"}
    with pytest.raises(eomgen.ModelError, match=r"the periods 0\.01 s, 0\.0141421356 s have no common"):
        cart(force=HOLD, other=odd).linearize().sampled_loop()
    with pytest.raises(eomgen.ModelError, match=r"have no equilibrium; try: a run of simulate"):
        cart(force=HOLD).linearize(at="equilibrium")
