"""What rates are for: a series elastic arm that follows a motion without feedback, and a motion that respects rates of
torque."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import eomgen
from tests.examples.demos import EXAMPLES, demo_module
from tests.oracles.pinocchio_oracle import oracle_of_tree

ARM_RATE = np.array([150.0] * 4 + [30.0] * 3)


@pytest.fixture(scope="module")
def links() -> eomgen.Model:
    return eomgen.build(EXAMPLES / "sea_arm" / "links.toml", terms=["inverse_dynamics", "rates", "rates_1"])


@pytest.fixture(scope="module")
def elastic_arm() -> eomgen.Model:
    return eomgen.build(EXAMPLES / "sea_arm" / "scene.toml", method="rk4")


@pytest.mark.long
def test_feedforward_alone_tracks(links: eomgen.Model, elastic_arm: eomgen.Model) -> None:
    demo = demo_module("sea_arm")
    _, deviation = demo.tracked(elastic_arm, demo.Feedforward(links), 2e-4)
    assert deviation.max() < 1e-10


@pytest.mark.slow
def test_feedforward_without_the_second_derivative_fails(links: eomgen.Model, elastic_arm: eomgen.Model) -> None:
    demo = demo_module("sea_arm")
    run, deviation = demo.tracked(elastic_arm, demo.Feedforward(links, complete=False), 2e-4)
    at = [float(np.interp(t, run.t, deviation)) for t in (0.1, 0.5, 1.0)]
    np.testing.assert_allclose(at, [3.7e-5, 8.6e-4, 5.8e-3], rtol=0.02)  # the dossier's own simulation
    assert deviation.max() > 1e-3


@pytest.mark.slow
def test_feedforward_tracks_under_another_solver(links: eomgen.Model, elastic_arm: eomgen.Model) -> None:
    demo = demo_module("sea_arm")
    feedforward = demo.Feedforward(links)
    start = feedforward.start()

    def rhs(t: float, y: np.ndarray) -> np.ndarray:
        return np.concatenate([y[14:], elastic_arm.forward_dynamics(y[:14], y[14:], t, feedforward.torques(t))])

    found = solve_ivp(
        rhs, (0.0, 0.3), np.concatenate([start["q"], start["v"]]), method="DOP853", rtol=1e-12, atol=1e-13
    )
    assert np.abs(found.y[7:14, -1] - demo.motion(0.3)[0]).max() < 1e-12


@pytest.mark.slow
def test_rates_of_torque_are_those_of_pinocchio(links: eomgen.Model) -> None:
    demo = demo_module("jerk_limited_arm")
    move = demo.Move(links, 0.9)
    oracle = oracle_of_tree(eomgen.load(EXAMPLES / "sea_arm" / "links.toml"))
    h = 1e-3
    for t in (0.2, 0.45, 0.7):
        q, v, a, _ = move.at(t + h * np.array([-2.0, -1.0, 1.0, 2.0]))
        near = oracle.inverse_dynamics({"q": q, "v": v, "a": a})
        slope = (near[0] - 8.0 * near[1] + 8.0 * near[2] - near[3]) / (12.0 * h)
        np.testing.assert_allclose(move.torques(np.array(t))[1], slope, rtol=1e-7, atol=1e-7)


@pytest.mark.long
def test_fastest_move_keeps_to_its_limits_and_is_tracked(links: eomgen.Model) -> None:
    demo = demo_module("jerk_limited_arm")
    move, hasty = demo.fastest(links, ARM_RATE), demo.fastest(links, ARM_RATE, ("rate of torque",))
    assert 0.999 < max(move.load(ARM_RATE).values()) <= 1.0
    assert max(demo.Move(links, move.duration - 1e-3).load(ARM_RATE).values()) > 1.0
    arm = eomgen.build(EXAMPLES / "jerk_limited_arm" / "scene.toml", method="rk4")
    assert demo.driven(arm, move, 0.02, move.duration)[1].max() < 1e-9
    assert demo.driven(arm, hasty, 0.02, hasty.duration)[1].max() > 0.1
