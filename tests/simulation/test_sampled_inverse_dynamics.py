"""Computed torque as a digital controller: inverse dynamics in the formula of a sampled state."""

import numpy as np
import pytest

import eomgen
from tests.simulation.rails import built

INERTIA, LEVER, MASS, GRAVITY, SAMPLE = 0.35, 0.5, 1.0, 9.81, 1e-3


def _by_hand(samples: int) -> tuple[float, float]:
    """Return the angle and its rate after so many samples, each a step of the classical Runge-Kutta method."""

    def rates(x: np.ndarray) -> np.ndarray:
        return np.array([x[1], (torque + GRAVITY * MASS * LEVER * np.cos(x[0])) / INERTIA])

    x, h = np.zeros(2), SAMPLE
    for k in range(samples):
        position, velocity = 0.3 * np.sin(k * h), 0.3 * np.cos(k * h)
        wanted = -position + 100.0 * (position - x[0]) + 20.0 * (velocity - x[1])
        torque = INERTIA * wanted - GRAVITY * MASS * LEVER * np.cos(position)
        k1 = rates(x)
        k2 = rates(x + h / 2 * k1)
        k3 = rates(x + h / 2 * k2)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + rates(x + h * k3))
    return float(x[0]), float(x[1])


def arm(effort: str) -> eomgen.SceneBuilder:
    """Return a rod on a hinge with what it is to follow."""
    builder = eomgen.SceneBuilder("arm").body("rod", MASS, center_of_mass=[LEVER, 0, 0], inertia=[0.01, 0.1, 0.1])
    builder.joint("elbow", "revolute", "base", "rod", axis=[0, 1, 0]).effort("motor", "elbow", effort)
    wanted = "-0.3*sin(t) + 100*(0.3*sin(t) - q.elbow) + 20*(0.3*cos(t) - v.elbow)"
    position, velocity = {"elbow": "0.3 * sin(t)"}, {"elbow": "0.3 * cos(t)"}
    return builder.reference("servo", position=position, velocity=velocity, acceleration={"elbow": wanted})


def test_a_sampled_state_holds_computed_torque() -> None:
    builder = arm("torque").state("torque", sample="1 ms", formula="tau.elbow(servo)")
    solution = built(builder, method="rk4").simulate(0.5, SAMPLE)
    assert (solution.q[-1, 0], solution.v[-1, 0]) == pytest.approx(_by_hand(500), abs=1e-13)


@pytest.mark.slow
def test_a_sampled_controller_is_given_it() -> None:
    given = {"sample": "1 ms", "signals": {"tau": "tau.elbow(servo)"}, "outputs": ["torque"]}
    model = built(arm("law_torque").controller("law", "sampled", **given), method="rk4")
    solution = model.simulate(0.5, SAMPLE, controllers={"law": lambda t, signals: signals})
    assert (solution.q[-1, 0], solution.v[-1, 0]) == pytest.approx(_by_hand(500), abs=1e-13)
