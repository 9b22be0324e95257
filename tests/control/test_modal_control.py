"""Modal control in closed form against the Riccati equation, and its spillover."""

from __future__ import annotations

import re
from collections.abc import Callable

import mpmath
import numpy as np
import pytest

from eomgen.control import lqr
from eomgen.errors import ModelError, UsageError
from eomgen.products.linear.control.second_order import (
    Plant,
    modal_feedback,
    modes_of,
    optimal_modal_gains,
    placed_modal_gains,
)
from tests.control.plants import first_order, quarter_car, random_plant


def test_published_modal_gains() -> None:
    g, h = optimal_modal_gains(3.7, 0.0, 0.02)
    assert f"{g:.9f} {h:.9f}" == "15.838225480 9.037502474"


@pytest.mark.parametrize("damping", [0.0, 0.3, 40.0])
@pytest.mark.parametrize("effort", [1e-8, 0.02, 1e3])
@pytest.mark.parametrize("frequency", [0.0, 3.7, 1e3])
def test_modal_gains_satisfy_their_riccati_equation(frequency: float, damping: float, effort: float) -> None:
    """The Riccati equation of one mode in 50 digits: g^2 + 2 w^2 g = w^2/R and h^2 + 2 c h = 2 g + 1/R."""
    with mpmath.workdps(50):
        w, c, R = map(mpmath.mpf, (frequency, damping, effort))
        g = -(w**2) + w * mpmath.sqrt(w**2 + 1 / R)
        h = -c + mpmath.sqrt(c**2 + 2 * g + 1 / R)
        assert abs(g**2 + 2 * w**2 * g - w**2 / R) < mpmath.mpf(10) ** -25 * (1 + w**2 / R)
        expected = float(g), float(h)
    np.testing.assert_allclose(optimal_modal_gains(frequency, damping, effort), expected, rtol=1e-13)


@pytest.mark.parametrize("n", [1, 3, 6])
def test_full_modal_control_is_the_optimal_one(n: int, rng: np.random.Generator) -> None:
    """The sum of the modes' costs, written in coordinates: the regulator of the whole plant has the same gains."""
    plant = random_plant(rng, n, n)
    modes = modes_of(plant)
    R = 10.0 ** rng.uniform(-4, 0, n)
    g, h = optimal_modal_gains(modes.frequencies, modes.damping, R)
    found = modal_feedback(plant, modes, range(n), g, h)
    of_coordinates = modes.shapes.T @ plant.M
    reach = modes.shapes.T @ plant.B
    nothing = np.zeros((n, n))
    position = of_coordinates.T @ np.diag(modes.frequencies**2) @ of_coordinates
    weight = np.block([[position, nothing], [nothing, of_coordinates.T @ of_coordinates]])
    gains = lqr(first_order(plant), weight, reach.T @ np.diag(R) @ reach).gains
    for modal, optimal in zip((found.G_p, found.G_v), np.split(gains, 2, axis=1), strict=True):
        np.testing.assert_allclose(modal, optimal, rtol=0.0, atol=1e-9 * np.abs(optimal).max())
    assert found.crosstalk == 0.0 and found.spillover == 0.0


def test_modes_get_the_frequencies_and_damping_asked_for(rng: np.random.Generator) -> None:
    plant = random_plant(rng, 4, 4)
    modes = modes_of(plant)
    wanted, ratio = modes.frequencies * [1.5, 1.0, 0.8, 1.2], np.array([0.7, 0.05, 0.3, 0.2])
    found = modal_feedback(plant, modes, range(4), *placed_modal_gains(modes.frequencies, modes.damping, wanted, ratio))
    poles = wanted * (-ratio + 1j * np.sqrt(1.0 - ratio**2))
    for pole in poles:
        assert np.abs(found.eigenvalues - pole).min() < 1e-9 * abs(pole)


def test_spillover_is_told(rng: np.random.Generator) -> None:
    """Two actuators on a chain of four masses: two modes get their forces, the other two get what is said."""
    K = 1e3 * (2.0 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    plant = Plant(np.eye(4), 0.01 * K, K, np.eye(4)[:, [0, 3]], "abcd")
    modes = modes_of(plant)
    g, h = optimal_modal_gains(modes.frequencies[:2], modes.damping[:2], 1e-3)
    found = modal_feedback(plant, modes, [0, 1], g, h)
    xi, speed = rng.normal(size=4), rng.normal(size=4)
    u = -found.G_p @ modes.shapes @ xi - found.G_v @ modes.shapes @ speed
    forces = modes.shapes.T @ plant.B @ u
    np.testing.assert_allclose(forces[:2], -g * xi[:2] - h * speed[:2], rtol=1e-9)
    assert found.crosstalk == 0.0
    unit = np.linalg.solve((modes.shapes.T @ plant.B)[:2], np.eye(2))
    assert found.spillover == pytest.approx(np.abs((modes.shapes.T @ plant.B)[2:] @ unit).max())
    assert found.spillover > 0.1


def test_too_few_actuators_make_modes_talk_to_each_other() -> None:
    plant = quarter_car()
    modes = modes_of(plant)
    found = modal_feedback(plant, modes, [0, 1], *optimal_modal_gains(modes.frequencies, modes.damping, 0.1))
    reach = modes.shapes.T @ plant.B
    share = reach @ reach.T / float((reach.T @ reach)[0, 0])  # the projection on what one actuator can do
    assert found.crosstalk == pytest.approx(np.abs(share - np.eye(2)).max())
    assert found.crosstalk > 0.1


def test_spillover_that_destabilises_is_refused() -> None:
    """Sensor and actuator apart: a feedback that damps the first mode of a chain drives the second one."""
    K = np.array([[2.0, -1.0], [-1.0, 2.0]])
    plant = Plant(np.eye(2), np.zeros((2, 2)), K, np.array([[1.0], [-0.9]]), "ab")
    modes = modes_of(plant)
    with pytest.raises(ModelError) as caught:
        modal_feedback(plant, modes, [0, 1], [0.0, 0.0], [2.0, -0.5])
    assert caught.value.problems[0].what.startswith("modal control with 1 actuators makes a mode at ")


PAIR = Plant(np.eye(2), np.zeros((2, 2)), np.diag([4.0, 9.0]), np.array([[1.0], [0.0]]), "ab")


NO_MODES = {
    "the equilibrium is unstable: the mode of pole grows at 3 1/s": Plant(
        np.eye(2), np.zeros((2, 2)), np.diag([4.0, -9.0]), np.eye(2), ["cart", "pole"]
    ),
    "the stiffness matrix is not symmetric, so there are no modes that keep their shape": Plant(
        np.eye(2), np.zeros((2, 2)), np.array([[4.0, 1.0], [-1.0, 9.0]]), np.eye(2), "ab"
    ),
}


REFUSED: dict[str, Callable[[], object]] = {
    "no actuator reaches mode 2 at 0.4775 Hz": lambda: modal_feedback(PAIR, modes_of(PAIR), [1], 1.0, 1.0),
    "there is no mode 3: the model has 2": lambda: modal_feedback(PAIR, modes_of(PAIR), [2], 1.0, 1.0),
    "one of them is named twice": lambda: modal_feedback(PAIR, modes_of(PAIR), [0, 0], 1.0, 1.0),
    **{message: lambda plant=plant: modes_of(plant) for message, plant in NO_MODES.items()},
}


@pytest.mark.parametrize("message", REFUSED)
def test_modes_out_of_reach_are_named(message: str) -> None:
    with pytest.raises((ModelError, UsageError), match=re.escape(message)):
        REFUSED[message]()
