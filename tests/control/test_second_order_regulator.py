"""Regulators of plants of second order: 40-digit arithmetic, and published gains."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from eomgen.control import lqr
from tests.control.plants import RELATIVE, first_order, quarter_car, random_plant


@pytest.mark.slow_cases("3-2")
@pytest.mark.parametrize(("n", "m"), [(1, 1), (3, 2)])
def test_gains_are_those_of_40_digit_arithmetic(n: int, m: int, rng: np.random.Generator) -> None:
    """The stable subspace of the Hamiltonian matrix, by mpmath: nothing of SciPy, nothing of blocks."""
    plant = random_plant(rng, n, m, symmetric=False)
    F, D, W = rng.normal(size=(2, 2 * n)), 0.1 * rng.normal(size=(2, m)), np.diag([5.0, 7.0])
    Q = np.diag([*10.0 ** rng.uniform(0, 3, n), *[3.0] * n]) + F.T @ W @ F
    R = np.diag(10.0 ** rng.uniform(-3, -2, m)) + D.T @ W @ D
    weights = Q, R, F.T @ W @ D
    with mpmath.workdps(40):
        M = mpmath.matrix(plant.M.tolist())
        A, B = mpmath.zeros(2 * n), mpmath.zeros(2 * n, m)
        for k in range(n):
            A[k, n + k] = mpmath.mpf(1)
        A[n:, :n] = -mpmath.inverse(M) * mpmath.matrix(plant.K.tolist())
        A[n:, n:] = -mpmath.inverse(M) * mpmath.matrix(plant.C.tolist())
        B[n:, :] = mpmath.inverse(M) * mpmath.matrix(plant.B.tolist())
        Q, R, S = (mpmath.matrix(w.tolist()) for w in weights)
        R_inverse = mpmath.inverse(R)
        free, cost = A - B * R_inverse * S.T, Q - S * R_inverse * S.T
        H = mpmath.zeros(4 * n)
        H[: 2 * n, : 2 * n], H[: 2 * n, 2 * n :] = free, -B * R_inverse * B.T
        H[2 * n :, : 2 * n], H[2 * n :, 2 * n :] = -cost, -free.T
        values, vectors = mpmath.eig(H)
        stable = [k for k in range(4 * n) if mpmath.re(values[k]) < 0]
        assert len(stable) == 2 * n
        X = mpmath.matrix(4 * n, 2 * n)
        for column, k in enumerate(stable):
            X[:, column] = vectors[:, k]
        P = X[2 * n :, :] * mpmath.inverse(X[: 2 * n, :])
        G = R_inverse * (B.T * P + S.T)
        expected = np.array([[float(mpmath.re(G[i, j])) for j in range(2 * n)] for i in range(m)])
    found = lqr(first_order(plant), *weights)
    np.testing.assert_allclose(found.gains, expected, rtol=1e-10, atol=1e-10 * np.abs(expected).max())
    assert found.eigenvalues.real.max() < 0.0


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
    space, two = first_order(quarter_car()), np.array([[1.0, -1.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0]])
    a, b = space.A[2:3], space.B[2:3]
    found = lqr(space, a.T @ a + two.T @ np.diag([travel, tyre]) @ two, b.T @ b, a.T @ b)
    printed = found.gains[0] @ np.linalg.inv(RELATIVE)
    for value, digits in zip(printed, gains, strict=True):
        assert abs(value - float(digits)) <= 0.5 * 10.0 ** -len(digits.partition(".")[2]), (value, digits)
