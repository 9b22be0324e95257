"""The regulator in second-order form: its block equations, 40-digit arithmetic, published gains, and plants it
refuses."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from eomgen.errors import ModelError, UsageError
from eomgen.products.linear.control.plant import Plant
from eomgen.products.linear.control.second_order import lqr
from eomgen.products.linear.control.weights import Weights
from tests.control.plants import RELATIVE, quarter_car, random_plant


@pytest.mark.slow_cases("3-2")
@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 2)])
def test_gains_are_those_of_40_digit_arithmetic(n: int, m: int, rng: np.random.Generator) -> None:
    """The stable subspace of the Hamiltonian matrix, by mpmath: nothing of SciPy, nothing of blocks."""
    plant = random_plant(rng, n, m, symmetric=False)
    weights = Weights.of(plant, 10.0 ** rng.uniform(0, 3, n), 3.0, 10.0 ** rng.uniform(-3, -2, m)).plus_output(
        rng.normal(size=(2, 2 * n)), 0.1 * rng.normal(size=(2, m)), [5.0, 7.0]
    )
    with mpmath.workdps(40):
        M = mpmath.matrix(plant.M.tolist())
        A, B = mpmath.zeros(2 * n), mpmath.zeros(2 * n, m)
        for k in range(n):
            A[k, n + k] = mpmath.mpf(1)
        A[n:, :n] = -mpmath.inverse(M) * mpmath.matrix(plant.K.tolist())
        A[n:, n:] = -mpmath.inverse(M) * mpmath.matrix(plant.C.tolist())
        B[n:, :] = mpmath.inverse(M) * mpmath.matrix(plant.B.tolist())
        Q, R, S = (mpmath.matrix(w.tolist()) for w in (weights.state, weights.effort, weights.cross))
        R_inverse = mpmath.inverse(R)
        F, W = A - B * R_inverse * S.T, Q - S * R_inverse * S.T
        H = mpmath.zeros(4 * n)
        H[: 2 * n, : 2 * n], H[: 2 * n, 2 * n :] = F, -B * R_inverse * B.T
        H[2 * n :, : 2 * n], H[2 * n :, 2 * n :] = -W, -F.T
        values, vectors = mpmath.eig(H)
        stable = [k for k in range(4 * n) if mpmath.re(values[k]) < 0]
        assert len(stable) == 2 * n
        X = mpmath.matrix(4 * n, 2 * n)
        for column, k in enumerate(stable):
            X[:, column] = vectors[:, k]
        P = X[2 * n :, :] * mpmath.inverse(X[: 2 * n, :])
        G = R_inverse * (B.T * P + S.T)
        expected = np.array([[float(mpmath.re(G[i, j])) for j in range(2 * n)] for i in range(m)])
    found = lqr(plant, weights)
    np.testing.assert_allclose(
        np.hstack([found.G_p, found.G_v]), expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max()
    )
    assert found.residual <= 1e-10 and found.eigenvalues.real.max() < 0.0


@pytest.mark.parametrize(
    ("travel", "tyre", "gains"),
    [
        (1e3, 1e4, ("-8410.5336", "911.99654", "2779.8603", "609.38533")),
        (1e2, 1e5, ("-13600", "156.36312", "-19350.159", "-111.26320")),
    ],
)
def test_published_gains_of_the_quarter_car(travel: float, tyre: float, gains: tuple[str, ...]) -> None:
    """J = int z_s''^2 + r1 (z_s - z_u)^2 + r2 (z_u - z_r)^2: the body's acceleration makes cross terms and weighs
    efforts."""
    plant = quarter_car()
    A, B = plant.state_space()
    weights = Weights.of(plant).plus_output(A[2], B[2], 1.0)
    weights = weights.plus_output([[1, -1, 0, 0], [0, 1, 0, 0]], np.zeros((2, 1)), [travel, tyre])
    found = lqr(plant, weights)
    printed = np.hstack([found.G_p, found.G_v])[0] @ np.linalg.inv(RELATIVE)
    for value, digits in zip(printed, gains, strict=True):
        assert abs(value - float(digits)) <= 0.5 * 10.0 ** -len(digits.partition(".")[2]), (value, digits)


@pytest.mark.slow
def test_the_cost_is_what_a_motion_costs(rng: np.random.Generator) -> None:
    """x^T P x against the cost of the closed loop added up along its exact motion."""
    plant = random_plant(rng, 2, 1)
    weights = Weights.of(plant, 10.0, 1.0, 0.01)
    found = lqr(plant, weights)
    A, _ = plant.state_space(found.G_p, found.G_v)
    G = np.hstack([found.G_p, found.G_v])
    rate = weights.state + G.T @ weights.effort @ G
    x0 = rng.normal(size=4)
    values, vectors = np.linalg.eig(A)
    start = np.linalg.solve(vectors, x0)
    pairs = -1.0 / np.add.outer(values, values)  # int exp((a + b) t) dt
    cost = np.real(start @ ((vectors.T @ rate @ vectors) * pairs) @ start)
    P = np.block([[found.P11, found.P12], [found.P12.T, found.P22]])
    assert cost == pytest.approx(x0 @ P @ x0, rel=1e-9)


def test_units_do_not_matter(rng: np.random.Generator) -> None:
    """The same plant in millimetres and milliseconds has the same gains in its units."""
    plant = random_plant(rng, 3, 2)
    weights = Weights.of(plant, 100.0, 1.0, 1e-3)
    length, time = 1e3, 1e3
    other = Plant(plant.M * time**2 / length, plant.C * time / length, plant.K / length, plant.B)
    scaled = Weights.of(other, 100.0 / length**2, (time / length) ** 2, 1e-3)
    found, same = lqr(plant, weights), lqr(other, scaled)
    np.testing.assert_allclose(same.G_p * length, found.G_p, rtol=1e-9, atol=1e-9 * np.abs(found.G_p).max())
    np.testing.assert_allclose(same.G_v * length / time, found.G_v, rtol=1e-9, atol=1e-9 * np.abs(found.G_v).max())


def test_an_unstable_equilibrium_is_held() -> None:
    """An upright pendulum without weights: the cheapest gains mirror its poles in the imaginary axis."""
    plant = Plant([[2.0]], [[0.0]], [[-18.0]], [[1.0]])
    found = lqr(plant, Weights.of(plant, effort=1.0))
    np.testing.assert_allclose(sorted(found.eigenvalues.real), [-3.0, -3.0], rtol=1e-6)
    assert found.G_p == pytest.approx(36.0) and found.G_v == pytest.approx(12.0)


def test_a_plant_at_rest_without_weights_is_left_alone() -> None:
    plant = quarter_car()
    found = lqr(plant, Weights.of(plant, effort=1.0))
    assert np.abs(found.G_p).max() == pytest.approx(0.0, abs=1e-9) and np.abs(found.G_v).max() == pytest.approx(
        0.0, abs=1e-9
    )


def pendulums(reach: float, stiffness: float) -> Plant:
    return Plant(np.eye(2), np.zeros((2, 2)), np.diag([40.0, stiffness]), [[1.0], [reach]], ["lower", "upper"])


NO_ACTUATOR = "cannot be stabilised: no actuator moves it"


FOUR_PI = (4 * np.pi) ** 2


UNSTABLE = {
    f"the mode of upper that grows at 3 1/s without oscillating {NO_ACTUATOR}": pendulums(0.0, -9.0),
    f"the mode of upper at 0 Hz, which nothing holds, {NO_ACTUATOR}": pendulums(0.0, 0.0),
    f"the mode of upper at 2 Hz, which is not damped, {NO_ACTUATOR}": pendulums(0.0, FOUR_PI),
    f"the mode of coordinate 2 at 2 Hz, which grows at 0.25 1/s, {NO_ACTUATOR}": Plant(
        np.eye(2), np.diag([1.0, -0.5]), np.diag([40.0, FOUR_PI + 0.0625]), [[1.0], [0.0]]
    ),
}


@pytest.mark.parametrize("message", UNSTABLE)
def test_what_cannot_be_stabilised_is_named(message: str) -> None:
    plant = UNSTABLE[message]
    with pytest.raises(ModelError) as caught:
        lqr(plant, Weights.of(plant, 1.0, 1.0, 1.0))
    assert caught.value.problems[0].what == message
    assert caught.value.problems[0].hint == "an actuator that works on it, or a spring and a damper that hold it"


def test_a_decaying_mode_out_of_reach_is_left_as_it_is() -> None:
    plant = Plant(np.eye(2), np.diag([0.0, 0.2]), np.diag([40.0, 90.0]), [[1.0], [0.0]])
    found = lqr(plant, Weights.of(plant, 1.0, 1.0, 1.0))
    assert np.abs(found.G_p[:, 1]).max() < 1e-12
    assert np.min(np.abs(found.eigenvalues - (-0.1 + 1j * np.sqrt(90.0 - 0.01)))) < 1e-9


def test_a_mode_that_costs_nothing_is_named() -> None:
    plant = Plant(np.eye(2), np.diag([1.0, 0.0]), np.diag([40.0, 0.0]), np.eye(2), ["held", "free"])
    with pytest.raises(ModelError, match="the mode of free at 0 Hz, which nothing holds, has zero weight") as caught:
        lqr(plant, Weights.of(plant, [1.0, 0.0], [1.0, 0.0], 1.0))
    assert caught.value.problems[0].hint == "a weight on a coordinate or a velocity that it moves"
    assert lqr(plant, Weights.of(plant, [0.0, 1.0], 0.0, 1.0)).eigenvalues.real.max() < 0.0


NO_WEIGHTS: dict[str, dict[str, Any]] = {
    "the weight of the coordinates is negative in some direction (eigenvalue -2)": {"position": [1.0, -2.0]},
    "the weight of the velocities is not symmetric": {"velocity": [[1.0, 2.0], [0.0, 1.0]]},
    "the weight of the efforts has the shape (2,)": {"effort": [1.0, 2.0]},
    "the weight of the coordinates has an entry [1, 1] that is not finite": {"position": [1.0, np.nan]},
}


NO_MASSES = {
    "the mass matrix M is not symmetric": [[1.0, 0.5], [0.0, 1.0]],
    "the mass matrix M is not positive definite": [[1.0, 0.0], [0.0, -1.0]],
    "M has an entry [0, 1] that is not finite": [[1.0, np.inf], [np.inf, 1.0]],
}


@pytest.mark.parametrize("message", [*NO_WEIGHTS, *NO_MASSES])
def test_weights_and_masses_that_are_none_are_refused(message: str) -> None:
    with pytest.raises(UsageError) as caught:
        if message in NO_WEIGHTS:
            Weights.of(quarter_car(), **NO_WEIGHTS[message])
        else:
            Plant(NO_MASSES[message], np.zeros((2, 2)), np.eye(2), [[1.0], [0.0]])
    assert caught.value.problems[0].what == message


def test_an_effort_has_to_cost_something() -> None:
    plant = quarter_car()
    with pytest.raises(UsageError, match="some effort has zero weight, so the optimal gain is unbounded"):
        lqr(plant, Weights.of(plant, 1.0, 1.0))
