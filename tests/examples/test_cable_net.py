"""Cables and nets of equal knots: their rest is a polygon of forces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import root

import eomgen
from eomgen.scene.load import load_toml
from tests.oracles.evaluation import Array

EXAMPLE = Path(__file__).parents[2] / "examples" / "cable_net" / "scene.toml"
G = 9.81
#: A cable of so many KNOTS between points DROP apart in height.
CABLE = """
format = 1
name = "cable"
coordinates = "absolute"

[repeat.knots]
indices = { i = [1, KNOTS] }
bodies."knot_{i}" = { mass = 0.02, inertia = [1e-6, 1e-6, 1e-6], group = "R3xSO3" }
points."eye_{i}" = { body = "knot_{i}" }
joints."free_{i}" = { type = "free", parent = "base", child = "knot_{i}", initial = { position = ["0.1 * {i}", 0, 0] } }

[repeat.pieces]
indices = { i = [2, KNOTS] }
springs."piece_{i}" = { first = "eye_{i - 1}", second = "eye_{i}", stiffness = 200, damping = 0.05, length = 0.095 }

[points]
left = { body = "base" }
right = { body = "base", position = ["0.1 * (KNOTS + 1)", 0, "-DROP"] }

[springs]
first = { first = "left", second = "eye_1", stiffness = 200, damping = 0.05, length = 0.095 }
last = { first = "eye_KNOTS", second = "right", stiffness = 200, damping = 0.05, length = 0.095 }
"""


def cable(knots: int, drop: float = 0.0) -> eomgen.Scene:
    return load_toml(CABLE.replace("KNOTS", f"{knots}").replace("DROP", f"{drop}"))


def polygon(knots: int, drop: float, mass: float, stiffness: float, length: float) -> Array:
    """Return x and z, (knots, 2), of the knots of a cable at rest, of which no piece is slack.

    Along the cable the horizontal force H is the same, and the vertical one falls by the weight of each knot; a piece
    lies along its force T and is T over its stiffness longer than without it. H and the vertical force of the first
    piece are those with which the last piece ends at the other point.
    """

    def corners(H: float, V: float) -> Array:
        vertical = V - mass * G * np.arange(knots + 1)
        T = np.hypot(H, vertical)
        pieces = ((length + T / stiffness) / T)[:, np.newaxis] * np.stack([np.full(knots + 1, H), -vertical], axis=1)
        return np.asarray(np.cumsum(pieces, axis=0))

    end = np.array([0.1 * (knots + 1), -drop])
    weight = knots * mass * G
    found = root(lambda force: corners(*force)[-1] - end, [weight, weight / 2], tol=1e-14)
    assert np.abs(corners(*found.x)[-1] - end).max() < 1e-12
    return corners(*found.x)[:-1]


def knots_of(q: Array) -> Array:
    """Return the places, (knots, 3), in a configuration of rotations with positions behind them."""
    return q.reshape(-1, 7)[:, 4:]


@pytest.mark.long_except_every(2)
@pytest.mark.slow
@pytest.mark.parametrize("drop", [0.0, 0.3])
def test_a_cable_rests_on_its_polygon_of_forces(drop: float) -> None:
    rest = eomgen.build(cable(6, drop), profile="quick").equilibrium()
    np.testing.assert_allclose(knots_of(rest.q)[:, ::2], polygon(6, drop, 0.02, 200.0, 0.095), rtol=0.0, atol=1e-10)
    assert len(rest.undetermined) == 18  # nothing turns the knots


@pytest.mark.long
def test_every_cable_of_the_net_rests_as_one_alone() -> None:
    """Ties between cables at rest are as long as they are without force; what moves the net is the blow alone."""
    model = eomgen.build(EXAMPLE)
    places = knots_of(model.equilibrium().q).reshape(10, 10, 3)
    np.testing.assert_allclose(places[..., 1], np.repeat(0.1 * np.arange(10.0)[:, np.newaxis], 10, axis=1), atol=1e-10)
    np.testing.assert_allclose(places[..., ::2], [polygon(10, 0.0, 0.02, 200.0, 0.095)] * 10, rtol=0.0, atol=1e-10)
