"""Stationary motion on a random road: the published table, and an integral over all frequencies."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from scipy.integrate import quad

from eomgen.base.arrays import Array
from eomgen.control import lqr, stationary_covariance
from eomgen.spectra import Road
from tests.anchors import anchor
from tests.control.plants import ROAD, TYRE, first_order, quarter_car

#: Rows of the state: travel, and the change of the tyre's force.
TRAVEL, DYNAMIC_LOAD = [1.0, -1.0, 0.0, 0.0], [0.0, TYRE, 0.0, 0.0]


def optimal(travel: float, tyre: float) -> Array:
    space, two = first_order(quarter_car()), np.array([TRAVEL, [0.0, 1.0, 0.0, 0.0]])
    a, b = space.A[2:3], space.B[2:3]
    return lqr(space, a.T @ a + two.T @ np.diag([travel, tyre]) @ two, b.T @ b, a.T @ b).gains


GAINS = {
    "passive": np.zeros((1, 4)), "skyhook": np.array([[0.0, 0.0, 2000.0, 0.0]]), "soft": optimal(1e3, 1e4),
    "hard": optimal(1e2, 1e5),
}  # fmt: skip  # two lines


def root_mean_squares(gains: Array, intensity: float) -> Array:
    """Return body acceleration, travel and dynamic load; the state is relative to the road, whose velocity is noise."""
    lifted = np.array([[-1.0], [-1.0], [0.0], [0.0]])
    space = first_order(quarter_car(), lifted)
    closed = dataclasses.replace(space, A=space.A - space.B @ gains)
    rows = np.array([closed.A[2], TRAVEL, DYNAMIC_LOAD])
    return np.sqrt(np.einsum("ij,jk,ik->i", rows, stationary_covariance(closed, {"w1": intensity}), rows))


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
    values = root_mean_squares(GAINS[controller], Road(road).velocity_intensity(20.0)) * [1.0, 1e3, 1.0]
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

    def responses(frequency: float) -> Array:
        """Return body acceleration, travel and tyre deflection per velocity of the road; gains work on what is above
        the road."""
        s = 2j * np.pi * frequency
        w = 1.0 / s
        z = np.linalg.solve(s**2 * plant.M + s * C + K, (ROAD + plant.B @ G[:, :2] @ r) * w)[:, 0]
        return np.array([s**2 * z[0], z[0] - z[1], TYRE * (z[1] - w)])

    values = root_mean_squares(G, Road("C").velocity_intensity(20.0))
    corners = np.array([1e-6, 0.3, 1.0, 1.5, 3.0, 9.0, 11.0, 14.0, 40.0, 200.0, 1e4, 1e6])
    for k, value in enumerate(values):
        parts = [
            quad(lambda f, k=k: abs(responses(f)[k]) ** 2, first, last, epsabs=0.0, epsrel=1e-10, limit=400)[0]
            for first, last in itertools.pairwise(corners)
        ]
        assert value == pytest.approx(np.sqrt(density * sum(parts)), rel=3e-6)
