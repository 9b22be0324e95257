"""Stationary motion on a random road: the published table, an integral over all frequencies, and an invariant."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from scipy.integrate import quad

from eomgen.errors import ModelError
from eomgen.products.linear.control.plant import Plant
from eomgen.products.linear.control.second_order import lqr
from eomgen.products.linear.control.stationary import stationary
from eomgen.products.linear.control.weights import Weights
from eomgen.spectra import Road
from tests.anchors import anchor
from tests.control.plants import ROAD, SPRUNG, TYRE, UNSPRUNG, quarter_car

TRAVEL, DYNAMIC_LOAD = [1.0, -1.0, 0.0, 0.0], [0.0, TYRE, 0.0, 0.0]
SKYHOOK = np.array([[0.0, 0.0, 2000.0, 0.0]])


def optimal(travel: float, tyre: float) -> np.ndarray:
    plant = quarter_car()
    A, B = plant.state_space()
    weights = Weights.of(plant).plus_output(A[2], B[2], 1.0)
    found = lqr(plant, weights.plus_output([TRAVEL, [0, 1, 0, 0]], np.zeros((2, 1)), [travel, tyre]))
    return np.hstack([found.G_p, found.G_v])


NONE = np.zeros((1, 4))
GAINS = {"passive": NONE, "skyhook": SKYHOOK, "soft": optimal(1e3, 1e4), "hard": optimal(1e2, 1e5)}


@pytest.mark.parametrize(
    ("road", "controller", "acceleration", "travel", "load"),
    [
        ("A", "passive", "0.35427", "2.9824", "180.08"),
        ("B", "passive", "0.70854", "5.9648", "360.17"),
        ("C", "passive", *anchor("quarter_car_passive").digits),
        ("D", "passive", "2.83416", "23.8592", "1440.67"),
        ("C", "skyhook", "1.22191", "9.9534", "730.56"),
        ("C", "soft", *anchor("quarter_car_regulator").digits),
        ("C", "hard", "1.21820", "11.8643", "714.83"),
    ],
)
def test_the_published_table(road: str, controller: str, acceleration: str, travel: str, load: str) -> None:
    """To the printed digits; the last of them may be cut instead of rounded."""
    G = GAINS[controller]
    found = stationary(quarter_car(), ROAD, Road(road).velocity_intensity(20.0), G[:, :2], G[:, 2:])
    values = found.rms(found.acceleration[0])[0], 1e3 * found.rms(TRAVEL)[0], found.rms(DYNAMIC_LOAD)[0]
    for value, digits in zip(values, (acceleration, travel, load), strict=True):
        assert abs(value - float(digits)) <= 1.0 * 10.0 ** -len(digits.partition(".")[2]), (value, digits)
    for case in (anchor("quarter_car_passive"), anchor("quarter_car_regulator")):
        if case.digits == (acceleration, travel, load):
            case.check(values)


@pytest.mark.parametrize("controller", GAINS)
def test_covariances_are_integrals_of_spectra(controller: str) -> None:
    """The one-sided density of the road's velocity through the frequency responses, added up over all frequencies."""
    plant, G = quarter_car(), GAINS[controller]
    density = 2.0 * Road("C").velocity_intensity(20.0)
    K, C = plant.K + plant.B @ G[:, :2], plant.C + plant.B @ G[:, 2:]
    r = np.ones((2, 1))  # a raised road raises all

    def responses(frequency: float) -> np.ndarray:
        """Return body acceleration, travel and tyre deflection per velocity of the road; gains work on what is above
        the road."""
        s = 2j * np.pi * frequency
        w = 1.0 / s
        z = np.linalg.solve(s**2 * plant.M + s * C + K, (ROAD + plant.B @ G[:, :2] @ r) * w)[:, 0]
        return np.array([s**2 * z[0], z[0] - z[1], TYRE * (z[1] - w)])

    found = stationary(plant, ROAD, Road("C").velocity_intensity(20.0), G[:, :2], G[:, 2:])
    values = found.rms(np.array([found.acceleration[0], TRAVEL, DYNAMIC_LOAD]))
    corners = np.array([1e-6, 0.3, 1.0, 1.5, 3.0, 9.0, 11.0, 14.0, 40.0, 200.0, 1e4, 1e6])
    for k, value in enumerate(values):
        parts = [
            quad(lambda f, k=k: abs(responses(f)[k]) ** 2, first, last, epsabs=0.0, epsrel=1e-10, limit=400)[0]
            for first, last in itertools.pairwise(corners)
        ]
        assert value == pytest.approx(np.sqrt(density * sum(parts)), rel=3e-6)


def test_the_invariant_of_every_suspension(rng: np.random.Generator) -> None:
    """At w^2 = k_t/m_u the body moves by -m_u/m_s of the road, whatever acts between body and wheel."""
    plant = quarter_car()
    s = 1j * np.sqrt(TYRE / UNSPRUNG)
    for G in [*GAINS.values(), *(1e3 * rng.normal(size=(10, 1, 4)))]:
        # (z_s, z_u) per z_r; gains on the tyre's deflection push on the road's own height too
        K, C = plant.K + plant.B @ G[:, :2], plant.C + plant.B @ G[:, 2:]
        z = np.linalg.solve(s**2 * plant.M + s * C + K, ROAD + plant.B @ G[:, :2] @ np.ones((2, 1)))
        assert abs(z[0, 0] + UNSPRUNG / SPRUNG) <= 1e-12


def test_two_roads_that_know_of_each_other() -> None:
    """Both wheels of a rigid axle on one track move as one wheel does: the covariance needs the roads' cross
    intensity."""
    single = quarter_car()
    zero = np.zeros((2, 2))
    both = Plant(*(np.block([[matrix, zero], [zero, matrix]]) for matrix in (single.M, single.C, single.K)), np.eye(4))
    roads = np.zeros((4, 2))
    roads[1, 0] = roads[3, 1] = TYRE
    one = stationary(single, ROAD, 1.0)
    together = stationary(both, roads, [[1.0, 1.0], [1.0, 1.0]])
    difference = [1, 0, -1, 0, 0, 0, 0, 0]
    assert together.rms(difference)[0] < 1e-6 * one.rms([1, 0, 0, 0])[0]
    apart = stationary(both, roads, 1.0)
    assert apart.rms(difference)[0] == pytest.approx(np.sqrt(2.0) * one.rms([1, 0, 0, 0])[0], rel=1e-9)


def test_what_has_no_stationary_motion() -> None:
    plant = quarter_car()
    with pytest.raises(ModelError, match="there is no stationary motion: a mode does not decay"):
        stationary(plant, ROAD, 1.0, G_v=[[-5000.0, 0.0]])
    loose = Plant(plant.M, plant.C + np.eye(2), plant.K - np.diag([0.0, TYRE]), plant.B)
    with pytest.raises(ModelError, match=r"there is no stationary motion: a mode does not decay \(-?[0-9.e-]+ 1/s\)"):
        stationary(loose, ROAD, 1.0)
    with pytest.raises(
        ModelError, match="a constant road does not hold the plant anywhere: its stiffness matrix is singular"
    ):
        stationary(Plant(loose.M, loose.C, loose.K, np.eye(2)), ROAD, 1.0, 1e3 * np.eye(2), np.zeros((2, 2)))
