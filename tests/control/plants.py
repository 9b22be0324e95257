"""Plants that the tests of control share: the quarter car of the literature, and random ones."""

from __future__ import annotations

import numpy as np

from eomgen.base.arrays import Array
from eomgen.products.linear.control.second_order import Plant
from eomgen.products.linear.state_space import StateSpace

SPRUNG, UNSPRUNG, SPRING, DAMPER, TYRE = 240.0, 36.0, 16000.0, 980.0, 160000.0
#: Force on body and wheel per displacement of the road.
ROAD = np.array([[0.0], [TYRE]])
#: From (z_s, z_u, z_s', z_u') to the state (z_s - z_u, z_s', z_u - z_r, z_u') of the literature, and back.
RELATIVE = np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def quarter_car() -> Plant:
    """Return body and wheel with an actuator that pushes the body up and the wheel down."""
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    K = SPRING * pair + np.diag([0.0, TYRE])
    return Plant(np.diag([SPRUNG, UNSPRUNG]), DAMPER * pair, K, np.array([[1.0], [-1.0]]), ["body", "wheel"])


def first_order(plant: Plant, disturbances: Array | None = None) -> StateSpace:
    """Return the state space of a plant, with inputs u1, u2, ... and disturbances w1, ... by columns (2n, nw)."""
    n, m = plant.B.shape
    E = np.zeros((2 * n, 0)) if disturbances is None else disturbances
    B = np.vstack([np.zeros((n, m)), np.linalg.solve(plant.M, plant.B)])
    states = (*plant.names, *(f"v.{name}" for name in plant.names))
    inputs, given = (tuple(f"{letter}{k + 1}" for k in range(size)) for letter, size in (("u", m), ("w", E.shape[1])))
    nothing = (np.zeros((0, 2 * n)), np.zeros((0, m)), np.zeros((0, E.shape[1])))
    return StateSpace(plant.state_matrix(), B, E, *nothing, states, inputs, given, ())


def random_plant(rng: np.random.Generator, n: int, m: int, *, symmetric: bool = True) -> Plant:
    """Return a plant with masses and stiffnesses over some orders of magnitude; circulatory and gyroscopic unless
    symmetric."""

    def definite(sizes: Array) -> Array:
        turned, _ = np.linalg.qr(rng.normal(size=(n, n)))
        return turned @ np.diag(sizes) @ turned.T

    M, K = definite(10.0 ** rng.uniform(-1, 2, n)), definite(10.0 ** rng.uniform(1, 5, n))
    C = 0.002 * K + 0.1 * M
    if not symmetric:
        C = C + 10.0 * rng.normal(size=(n, n))
        K = K + 100.0 * rng.normal(size=(n, n))
    return Plant(M, C, K, rng.normal(size=(n, m)), [f"q{k + 1}" for k in range(n)])
