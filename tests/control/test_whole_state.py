"""Regulators, observers and output feedback of models of first order: closed forms, Hamiltonian matrices, duality,
separation, sampling against exponentials of matrices and against integrals."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any, cast

import mpmath
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad_vec
from scipy.linalg import expm, solve_discrete_lyapunov

from eomgen.control import OutputFeedback, kalman, lqr, place, place_observer
from eomgen.errors import EomgenError, ModelError, NumericalError, UsageError
from eomgen.products.linear.augmentation import delay, delay_line, driven_by, shaping_filter
from eomgen.products.linear.control.margins import _roots
from eomgen.products.linear.control.second_order import Plant
from eomgen.products.linear.control.stationary import root_mean_squares, stationary_covariance
from eomgen.products.linear.sampling import discretized
from eomgen.products.linear.state_space import StateSpace
from tests.control.plants import first_order

Array = NDArray[np.float64]


def model(
    A: object, B: object, C: object | None = None, E: object | None = None, D: object | None = None, **names: object
) -> StateSpace:
    """Return a model with states x1, x2, ..., inputs u1, ..., disturbances w1, ... and outputs y1, ..."""
    A, B = np.array(A, float), np.array(B, float)
    n, m = B.shape
    C = np.eye(n) if C is None else np.array(C, float)
    E = np.zeros((n, 0)) if E is None else np.array(E, float)
    D = np.zeros((len(C), m)) if D is None else np.array(D, float)
    states, inputs, disturbances, outputs = (
        tuple(f"{letter}{k + 1}" for k in range(size))
        for letter, size in (("x", n), ("u", m), ("w", E.shape[1]), ("y", len(C)))
    )
    given = {"states": states, "inputs": inputs, "disturbances": disturbances, "outputs": outputs} | names
    return StateSpace(A, B, E, C, D, np.zeros((len(C), E.shape[1])), **given)  # type: ignore[arg-type]


def random_model(n: int, m: int, ny: int, nw: int, seed: int = 3) -> StateSpace:
    rng = np.random.default_rng(seed)
    return model(rng.normal(size=(n, n)), rng.normal(size=(n, m)), rng.normal(size=(ny, n)), rng.normal(size=(n, nw)))


def upper(values: Array) -> Array:
    return np.array(sorted(values, key=lambda value: (round(value.real, 6), round(value.imag, 6))))


def test_a_scalar_regulator_and_a_scalar_observer_in_closed_form() -> None:
    a, b, q, r = 0.7, 2.0, 3.0, 0.5
    root = math.sqrt(a**2 + b**2 * q / r)
    law = lqr(model([[a]], [[b]]), {"x1": q}, {"u1": r})
    np.testing.assert_allclose(law.gain("u1", "x1"), (a + root) / b, rtol=1e-13)
    np.testing.assert_allclose(law.eigenvalues, [-root], rtol=1e-13)
    assert law.cost_left is not None
    np.testing.assert_allclose(law.cost_left, [[r * (a + root) / b**2]], rtol=1e-13)
    seen = kalman(model([[a]], [[b]], [[1.5]], [[1.0]]), {"w1": q}, {"y1": r})
    variance = (a + math.sqrt(a**2 + 1.5**2 * q / r)) * r / 1.5**2
    np.testing.assert_allclose(seen.deviations["x1"], math.sqrt(variance), rtol=1e-13)
    np.testing.assert_allclose(seen.gains, [[variance * 1.5 / r]], rtol=1e-13)


def test_what_has_a_state_space_stands_for_it() -> None:
    class Linear:
        def state_space(self) -> StateSpace:
            return plain

    plain = random_model(3, 2, 2, 1)
    weights = {"x1": 2.0, "x3": 0.5}, {"u1": 1.0, "u2": 3.0}
    np.testing.assert_array_equal(lqr(Linear(), *weights).gains, lqr(plain, *weights).gains)
    seen = {"w1": 2.0}, {"y1": 0.1, "y2": 0.3}
    np.testing.assert_array_equal(kalman(Linear(), *seen).gains, kalman(plain, *seen).gains)
    late = delay("w1", "u1", 0.1)
    np.testing.assert_array_equal(driven_by(Linear(), late).A, driven_by(plain, late).A)
    np.testing.assert_array_equal(discretized(Linear(), 0.1).A, discretized(plain, 0.1).A)
    with pytest.raises(UsageError) as caught:
        lqr(np.eye(2), *weights)  # type: ignore[arg-type]
    assert str(caught.value) == (
        "usage error: space: a linear model is needed, not ndarray; try: model.linearize(), or its state_space()"
    )


def test_a_scalar_regulator_from_sample_to_sample_in_closed_form() -> None:
    a, b, q, r = 1.1, 0.4, 2.0, 0.3
    space = discretized(model([[math.log(a) / 0.1]], [[1.0]]), 0.1)
    space = model([[a]], [[b]], sample=0.1)
    # P = q + a^2 P - a^2 b^2 P^2 / (r + b^2 P)
    P = max(np.roots([b**2, r - q * b**2 - a**2 * r, -q * r]))
    law = lqr(space, [[q]], [[r]])
    np.testing.assert_allclose(law.gains, [[a * b * P / (r + b**2 * P)]], rtol=1e-12)


def test_eigenvalues_are_the_stable_ones_of_the_hamiltonian_matrix() -> None:
    space = random_model(6, 2, 3, 2)
    rng = np.random.default_rng(5)
    root = rng.normal(size=(8, 8))
    joined = root.T @ root
    Q, N, R = joined[:6, :6], joined[:6, 6:], joined[6:, 6:]
    law = lqr(space, Q, R, N)
    A = space.A - space.B @ np.linalg.solve(R, N.T)
    S = space.B @ np.linalg.solve(R, space.B.T)
    hamiltonian = np.block([[A, -S], [-(Q - N @ np.linalg.solve(R, N.T)), -A.T]])
    values = np.linalg.eigvals(hamiltonian)
    np.testing.assert_allclose(upper(law.eigenvalues), upper(values[values.real < 0.0]), rtol=1e-9)
    # what a motion costs is what is left of the cost at its start: its integral mode by mode
    start, closed = rng.normal(size=6), space.A - space.B @ law.gains
    whole = Q - N @ law.gains - law.gains.T @ N.T + law.gains.T @ R @ law.gains
    rates, shapes = np.linalg.eig(closed)
    amounts = np.linalg.solve(shapes, start)
    total = np.sum(
        np.outer(amounts.conj(), amounts) * (shapes.conj().T @ whole @ shapes) / -(rates.conj()[:, np.newaxis] + rates)
    )
    assert law.cost_left is not None
    np.testing.assert_allclose(total, start @ law.cost_left @ start, rtol=1e-9)


def test_regulators_of_stiff_chains_are_refined_by_newtons_iteration() -> None:
    """SciPy's solutions alone have relative residuals of 5.6e-8, and sampled of 4.4e-9, and are refused."""
    chain = np.tril(np.ones((3, 3)))

    def plant(masses: list[float], stiffnesses: list[float]) -> StateSpace:
        M, K = chain.T @ np.diag(masses) @ chain, np.diag(stiffnesses)
        return first_order(Plant(M, 1e-4 * np.sqrt(K), K, np.eye(3)[:, :1], ["one", "two", "three"]))

    space, weights = plant([1.0, 0.1, 0.1], [1e7, 1.0, 1e6]), [1e6, 1e3, 1e4, 1e2, 1e1, 1e4]
    law = lqr(space, weights, [1e-4])
    with mpmath.workdps(40):
        matrix = np.block([[space.A, -space.B @ space.B.T / 1e-4], [-np.diag(weights), -space.A.T]])
        values = np.array([complex(value) for value in mpmath.eig(mpmath.matrix(matrix), left=False, right=False)])
    np.testing.assert_allclose(upper(law.eigenvalues), upper(values[values.real < 0.0]), rtol=2e-9)
    sampled = lqr(plant([100.0] * 3, [1e8, 1e8, 10.0]), [100.0, 1.0, 1e5, 1e5, 1e3, 1.0], [1e-4], sample=0.01)
    assert sampled.closed_loop.stability == "stable"


def test_weights_of_outputs_are_weights_of_what_they_are_made_of() -> None:
    space = random_model(4, 2, 2, 0)
    D = np.array([[0.0, 0.3], [1.2, 0.0]])
    space = model(space.A, space.B, space.C, D=D)
    law = lqr(space, {"y1": 2.0, "y2": 5.0, "x3": 0.7}, {"u1": 0.4, "u2": 0.1})
    W, unit = np.diag([2.0, 5.0]), np.zeros((4, 4))
    unit[2, 2] = 0.7
    other = lqr(space, space.C.T @ W @ space.C + unit, np.diag([0.4, 0.1]) + D.T @ W @ D, space.C.T @ W @ D)
    np.testing.assert_allclose(law.gains, other.gains, rtol=1e-10)
    # one input alone: the other is a disturbance
    one = lqr(space, {"y1": 2.0}, {"u2": 0.1})
    assert (one.space.inputs, one.space.disturbances) == (("u2",), ("u1",))
    np.testing.assert_array_equal(one.space.E[:, 0], space.B[:, 0])


def test_observers_are_regulators_of_the_dual_model() -> None:
    space = random_model(5, 1, 2, 2)
    seen = kalman(space, {"w1": 0.3, "w2": 2.0}, {"y1": 0.1, "y2": 0.4})
    dual = lqr(model(space.A.T, space.C.T), space.E @ np.diag([0.3, 2.0]) @ space.E.T, np.diag([0.1, 0.4]))
    np.testing.assert_allclose(seen.gains, dual.gains.T, rtol=1e-9)


def test_noise_that_reaches_states_and_measurements_alike() -> None:
    """An accelerometer's noise is the force's: from the Riccati equation with its cross term, term by term."""
    space = random_model(3, 1, 1, 1)
    F = np.array([[0.8]])
    space = StateSpace(
        space.A, space.B, space.E, space.C, space.D, F, space.states, space.inputs, space.disturbances, space.outputs
    )
    W, V = 0.6, 0.2
    seen = kalman(space, {"w1": W}, {"y1": V})
    P, L = seen.covariance, seen.gains
    assert P is not None
    R = V + F @ F.T * W
    np.testing.assert_allclose(L, (P @ space.C.T + space.E * W @ F.T) @ np.linalg.inv(R), rtol=1e-9)
    left = space.A @ P + P @ space.A.T + space.E @ space.E.T * W - L @ R @ L.T
    np.testing.assert_allclose(left, 0.0, atol=1e-10 * np.abs(P).max())


@pytest.mark.parametrize("sample", [None, 0.05])
def test_regulator_and_observer_keep_their_eigenvalues(sample: float | None) -> None:
    space = random_model(4, 2, 2, 2)
    law = lqr(space, np.eye(4), 0.3 * np.eye(2), sample=sample, delay=0.0 if sample is None else 0.08)
    seen = kalman(
        space, {"w1": 1.0, "w2": 0.5}, {"y1": 0.1, "y2": 0.2}, sample=sample, delay=0.0 if sample is None else 0.08
    )
    whole = OutputFeedback(law, seen)
    n = len(law.space.states)
    assert n == (4 if sample is None else 8)
    expected = np.concatenate([law.eigenvalues, seen.eigenvalues])
    np.testing.assert_allclose(np.sort(np.abs(whole.eigenvalues)), np.sort(np.abs(expected)), rtol=1e-5, atol=1e-5)
    assert whole.closed_loop.stability == "stable"
    assert whole.closed_loop.states[n] == "estimate.x1"
    assert whole.closed_loop.disturbances == ("w1", "w2", "noise.y1", "noise.y2")
    # the loop by hand, from the equations of plant and controller
    c = whole.controller
    joined = np.block(
        [
            [law.space.A + law.space.B @ c.D @ seen.C, law.space.B @ c.C],
            [c.B @ seen.C, c.A],
        ]
    )
    np.testing.assert_allclose(whole.closed_loop.A, joined, atol=1e-12)


@pytest.mark.slow
def test_the_covariance_of_an_estimate_is_that_of_its_error() -> None:
    space = random_model(3, 1, 2, 1)
    noise, measured = {"w1": 0.7}, {"y1": 0.05, "y2": 0.3}
    stable = model(space.A - 4.0 * np.eye(3), space.B, space.C, space.E)
    seen = kalman(stable, noise, measured)
    G = np.hstack([stable.E, seen.gains])
    error = model(stable.A - seen.gains @ seen.C, stable.B, E=G)
    found = stationary_covariance(error, {"w1": 0.7, "w2": 0.05, "w3": 0.3})
    np.testing.assert_allclose(found, seen.covariance, rtol=1e-9, atol=1e-12)
    sampled = kalman(stable, noise, measured, sample="20 ms")
    # by running the recursion of covariances until it stands still
    A, C, V = sampled.space.A, sampled.C, np.diag([0.05, 0.3])
    added = quad_vec(lambda t: 0.7 * np.outer(*[expm(stable.A * t) @ stable.E[:, 0]] * 2), 0.0, 0.02)[0]
    P = np.zeros((3, 3))
    for _ in range(2000):
        P = A @ P @ A.T + added
        M = P @ C.T @ np.linalg.inv(C @ P @ C.T + V)
        P = P - M @ C @ P
    np.testing.assert_allclose(sampled.gains, M, rtol=1e-8)
    np.testing.assert_allclose(sampled.covariance, P, rtol=1e-8)


@pytest.mark.slow_except("1.0")
@pytest.mark.parametrize("delay_in_samples", [0.0, 0.3, 1.0, 2.4])
def test_held_inputs_exactly(delay_in_samples: float) -> None:
    """States at samples against the exponential of the matrix, piece by piece."""
    space, T = random_model(3, 2, 2, 1, seed=8), 0.07
    sampled = discretized(space, T, delay_in_samples * T)
    rng = np.random.default_rng(1)
    asked, held = rng.normal(size=(12, 2)), rng.normal(size=(12, 1))
    s, state = np.zeros(3), np.zeros(len(sampled.states))
    late = delay_in_samples * T

    def at_work(t: float) -> Array:
        k = math.floor((t - late) / T + 1e-9)
        return asked[k] if k >= 0 else np.zeros(2)

    for k in range(12):
        edges = sorted(
            {k * T, (k + 1) * T, *(j * T + late for j in range(k + 1) if k * T < j * T + late < (k + 1) * T)}
        )
        for start, end in pairwise(edges):
            force = np.concatenate([at_work(start + 1e-12), held[k]])
            whole = np.zeros((6, 6))
            whole[:3, :3], whole[:3, 3:] = space.A, np.hstack([space.B, space.E])
            step = expm(whole * (end - start))
            s = step[:3, :3] @ s + step[:3, 3:] @ force
        state = sampled.A @ state + sampled.B @ asked[k] + sampled.E @ held[k]
        np.testing.assert_allclose(state[:3], s, rtol=1e-11, atol=1e-13)


@pytest.mark.slow_except("1.0")
@pytest.mark.parametrize("delay_in_samples", [0.0, 0.4, 1.0, 1.6])
def test_a_sampled_regulator_minimises_the_integral(delay_in_samples: float) -> None:
    """What is left of the cost is the integral along the motion; other gains cost more."""
    space, T = random_model(3, 1, 1, 0, seed=2), 0.1
    D = np.array([[0.5]])
    space = model(space.A, space.B, space.C, D=D)
    law = lqr(space, {"y1": 1.0, "x2": 0.3}, {"u1": 0.2}, sample=T, delay=delay_in_samples * T)
    n = len(law.space.states)
    start = np.zeros(n)
    start[:3] = [1.0, -0.5, 0.3]

    nodes, weights = np.polynomial.legendre.leggauss(8)
    whole = np.zeros((4, 4))
    whole[:3, :3], whole[:3, 3] = space.A, space.B[:, 0]
    durations = (delay_in_samples % 1.0 * T, (1.0 - delay_in_samples % 1.0) * T)
    steps = {d: expm(whole * d) for d in durations}
    within = {d: [expm(whole * d * (node + 1.0) / 2.0) for node in nodes] for d in durations}

    def cost(gains: Array) -> float:
        state, total = start, 0.0
        first, last = durations
        waiting = n - 3
        for _ in range(600):
            u = -gains @ state
            inputs = [u[0], *state[3:]]
            newer = inputs[waiting - 1 if first else waiting]
            pieces = [(inputs[waiting], first), (newer, last)] if first else [(newer, last)]
            s = state[:3]
            for force, duration in pieces:
                for there, weight in zip(within[duration], weights, strict=True):
                    x = (there @ [*s, force])[:3]
                    y = float(space.C[0] @ x + D[0, 0] * force)
                    total += duration / 2.0 * weight * (y**2 + 0.3 * x[1] ** 2 + 0.2 * force**2)
                s = (steps[duration] @ [*s, force])[:3]
            state = np.concatenate([s, u, state[3:-1]]) if waiting else s
            if np.abs(state).max() < 1e-7:
                break
        return total

    best = cost(law.gains)
    assert law.cost_left is not None
    np.testing.assert_allclose(best, start @ law.cost_left @ start, rtol=1e-9)
    assert all(cost(law.gains + change) > best for change in 0.05 * np.vstack([np.eye(n), -np.eye(n)])[:, np.newaxis])


def test_placed_eigenvalues() -> None:
    space = random_model(4, 1, 1, 0)
    poles = [-1.0 + 2.0j, -1.0 - 2.0j, -3.0, -4.5]
    np.testing.assert_allclose(upper(place(space, poles).eigenvalues), upper(np.array(poles)), rtol=1e-8)
    seen = place_observer(space, poles, ["y1"])
    np.testing.assert_allclose(upper(seen.eigenvalues), upper(np.array(poles)), rtol=1e-8)
    sampled = place(space, poles, sample="10 ms")
    np.testing.assert_allclose(upper(sampled.eigenvalues), upper(np.exp(0.01 * np.array(poles))), rtol=1e-7)
    observed = place_observer(space, poles, ["y1"], sample="10 ms")
    np.testing.assert_allclose(upper(observed.eigenvalues), upper(np.exp(0.01 * np.array(poles))), rtol=1e-7)


def test_margins_of_a_loop_with_known_ones() -> None:
    """L = 2 / (s (s + 1) (s + 2)): gain margin 3 at sqrt 2 rad/s."""
    A, B = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -2.0, -3.0]], [[0.0], [0.0], [1.0]]
    law = place(model(A, B), np.roots([1.0, 3.0, 2.0, 2.0]))
    np.testing.assert_allclose(law.gains, [[2.0, 0.0, 0.0]], atol=1e-9)
    margins = law.margins["u1"]
    np.testing.assert_allclose(margins.gain_margin, 3.0, rtol=1e-9)
    assert margins.gain_reduction == 0.0
    w = math.sqrt(max(np.roots([1.0, 5.0, 4.0, -4.0]).real))  # w^2 of w^2 (1 + w^2)(4 + w^2) = 4
    lag = math.pi / 2.0 + math.atan(w) + math.atan(w / 2.0)
    np.testing.assert_allclose(margins.crossover, [w], rtol=1e-10)
    np.testing.assert_allclose(margins.phase_margin, math.degrees(math.pi - lag), rtol=1e-9)
    np.testing.assert_allclose(margins.delay_margin, (math.pi - lag) / w, rtol=1e-9)
    frequencies = np.linspace(0.2, 3.0, 200_001)
    s = 1j * frequencies
    np.testing.assert_allclose(margins.modulus_margin, np.abs(1 + 2 / (s * (s + 1) * (s + 2))).min(), rtol=1e-8)


@pytest.mark.slow
def test_margins_that_optimal_feedback_always_has() -> None:
    for seed in range(4):
        law = lqr(random_model(5, 2, 2, 0, seed), np.eye(5), np.diag([0.2, 1.0]))
        for margins in law.margins.values():
            assert margins.modulus_margin >= 1.0 - 1e-9
            assert margins.phase_margin >= 60.0 - 1e-6
            assert margins.gain_margin == np.inf
            assert margins.gain_reduction <= 0.5 + 1e-9


@pytest.mark.parametrize("sample", [None, 0.1])
@pytest.mark.parametrize("seed", [0, 6])
def test_margins_are_those_of_a_dense_curve(seed: int, sample: float | None) -> None:
    """Crossovers, lags and the distance from -1 of the loop at frequencies without end; growth at both limits."""
    space = random_model(4, 2, 1, 0, seed)
    law = lqr(space, np.eye(4), np.diag([0.1, 2.0]), sample=sample)
    A, B, G = law.space.A, law.space.B, law.gains
    for k, (name, margins) in enumerate(law.margins.items()):
        other = 1 - k
        opened = A - B[:, [other]] @ G[[other]]

        def loop(w: Array, k: int = k, opened: Array = opened) -> NDArray[np.complex128]:
            points = 1j * w if sample is None else np.exp(1j * w * sample)
            pencils = points[:, np.newaxis, np.newaxis] * np.eye(4) - opened
            return np.linalg.solve(pencils, np.broadcast_to(B[:, [k]], (len(w), 4, 1)))[..., 0] @ G[k]

        w = np.geomspace(1e-3, 300.0 if sample is None else math.pi / sample, 40_001)
        values = loop(w)
        np.testing.assert_allclose(margins.loop, loop(margins.frequencies), rtol=1e-9)
        assert margins.modulus_margin == pytest.approx(np.abs(1.0 + values).min(), rel=3e-4)
        crossed = np.flatnonzero(np.diff(np.sign(np.abs(values) - 1.0)))
        np.testing.assert_allclose(margins.crossover, 0.5 * (w[crossed] + w[crossed + 1]), rtol=3e-4)
        lags = np.degrees(np.angle(-values[crossed])) % 360.0
        expected = min([min(lag, 360.0 - lag) for lag in lags], default=np.inf)
        assert margins.phase_margin == pytest.approx(expected, abs=0.1)
        late = min([math.radians(lag) / at for lag, at in zip(lags, w[crossed], strict=True)], default=np.inf)
        assert margins.delay_margin == pytest.approx(late, rel=3e-3)
        assert margins.gain_reduction < 1.0 < margins.gain_margin, name
        for factor in (margins.gain_reduction, margins.gain_margin):
            if 0.0 < factor < np.inf:
                moved = np.linalg.eigvals(opened - factor * B[:, [k]] @ G[[k]])
                growth = moved.real.max() if sample is None else np.abs(moved).max() - 1.0
                assert growth == pytest.approx(0.0, abs=1e-7)


def test_a_gain_margin_may_be_at_standstill() -> None:
    """1 / (s - 1) with u = -2 s: the loop is -2 at standstill, and half of the gain is the least that holds it."""
    law = place(model([[1.0]], [[1.0]]), [-1.0])
    margins = law.margins["u1"]
    np.testing.assert_allclose([margins.gain_reduction, margins.modulus_margin], [0.5, 1.0], rtol=1e-6)
    assert margins.gain_margin == np.inf


def test_the_margins_of_output_feedback_are_those_of_its_loop() -> None:
    space = random_model(3, 1, 1, 1, 4)
    whole = OutputFeedback(lqr(space, np.eye(3), [[0.1]]), kalman(space, {"w1": 1.0}, {"y1": 0.1}))
    c, margins = whole.controller, whole.margins["u1"]
    for place_of_point in (0, 900, 1500):
        w, unit = margins.frequencies[place_of_point], np.eye(3)
        plant = space.C @ np.linalg.solve(1j * w * unit - space.A, space.B)
        controller = c.C @ np.linalg.solve(1j * w * unit - c.A, c.B)
        np.testing.assert_allclose(margins.loop[place_of_point], -(controller @ plant)[0, 0], rtol=1e-9)


def test_a_filter_before_a_model_multiplies_responses() -> None:
    space = random_model(3, 1, 2, 2)
    shaped = driven_by(space, shaping_filter([2.0, 3.0], [1.0, 0.4, 5.0], "white", "w2", "m"))
    assert (shaped.disturbances, shaped.outputs) == (("w1", "white"), ("y1", "y2", "w2"))
    assert shaped.states == ("x1", "x2", "x3", "filter.w2[0]", "filter.w2[1]")
    w = np.array([0.4, 2.2, 9.0])
    response = (2.0j * w + 3.0) / (-(w**2) + 0.4j * w + 5.0)
    np.testing.assert_allclose(shaped.frequency_response(w, "white", "w2"), response, rtol=1e-12)
    np.testing.assert_allclose(
        shaped.frequency_response(w, "white", "y1"), response * space.frequency_response(w, "w2", "y1"), rtol=1e-12
    )
    np.testing.assert_allclose(
        shaped.frequency_response(w, "u1", "y2"), space.frequency_response(w, "u1", "y2"), rtol=1e-12
    )


def test_a_filter_without_states_is_a_gain() -> None:
    gain = shaping_filter([3.0], [2.0], "white", "u1")
    assert (gain.B.shape, gain.C.shape, gain.E.shape) == ((0, 0), (1, 0), (0, 1))
    assert driven_by(model([[-1.0]], [[2.0]]), gain).E.tolist() == [[3.0]]


def test_delays_before_a_model() -> None:
    space = random_model(2, 1, 1, 2)
    late = driven_by(space, delay("w1", "w2", "50 ms", order=6))
    assert late.disturbances == ("w1",)
    w = np.array([1.0, 30.0, 80.0])
    expected = space.frequency_response(w, "w1", "y1") + np.exp(-0.05j * w) * space.frequency_response(w, "w2", "y1")
    np.testing.assert_allclose(late.frequency_response(w, "w1", "y1"), expected, rtol=1e-5)
    source = delay("w2", "w2", "50 ms", order=6)
    same = driven_by(space, dataclasses.replace(source, units={**source.units, "disturbances": ("V",)}))
    assert same.disturbances == ("w1", "w2")
    assert same.unit("disturbances", "w2") == "V"
    expected = np.exp(-0.05j * w) * space.frequency_response(w, "w2", "y1")
    np.testing.assert_allclose(same.frequency_response(w, "w2", "y1"), expected, rtol=1e-5)
    sampled = discretized(space, 0.01)
    line = driven_by(sampled, delay_line("w1", "w2", 5, 0.01))
    expected = sampled.frequency_response(w, "w1", "y1")
    expected = expected + np.exp(-0.05j * w) * sampled.frequency_response(w, "w2", "y1")
    np.testing.assert_allclose(line.frequency_response(w, "w1", "y1"), expected, rtol=1e-11)


def test_root_mean_squares_of_filtered_noise() -> None:
    """x' = -a x + w has the variance W/(2 a); held noise that of its recursion. White noise itself has no bound."""
    space = model([[-3.0]], [[0.0]], [[2.0]], [[1.0]])
    np.testing.assert_allclose(root_mean_squares(space, {"w1": 0.6})["y1"], 2.0 * math.sqrt(0.6 / 6.0), rtol=1e-12)
    sampled = discretized(space, 0.1)
    variance = solve_discrete_lyapunov(sampled.A, sampled.E @ sampled.E.T * 0.6)[0, 0]
    np.testing.assert_allclose(root_mean_squares(sampled, {"w1": 0.6})["y1"], 2.0 * math.sqrt(variance), rtol=1e-12)
    direct = [dataclasses.replace(of, F=np.array([[3.0]])) for of in (space, sampled)]
    values = [root_mean_squares(of, {"w1": 0.6})["y1"] for of in direct]
    np.testing.assert_allclose(values, [np.inf, math.sqrt(4.0 * variance + 9.0 * 0.6)], rtol=1e-12)
    with pytest.raises(ModelError, match="there is no stationary motion: the slowest motion does not decay"):
        root_mean_squares(model([[0.5]], [[1.0]], E=[[1.0]]), {"w1": 1.0})


UNMOVED = model([[0.4, 0.0], [0.0, -1.0]], [[0.0], [1.0]], E=[[1.0], [1.0]])
HELD = model([[0.0, 0.0], [0.0, -1.0]], [[1.0], [1.0]], [[0.0, 1.0]], [[0.0], [1.0]])
FINE = random_model(3, 1, 2, 1)


def undriven() -> StateSpace:
    return shaping_filter([1.0], [1.0, 1.0], "white", "road")


def oscillator(growth: float) -> StateSpace:
    """Return an oscillator of 2 Hz that no input moves."""
    turn = 4.0 * np.pi
    return model([[growth, turn], [-turn, growth]], [[0.0], [0.0]])


#: Calls that fail, by a part of what they say.
NOT_DESIGNED: dict[str, Callable[[], object]] = {
    "the mode of x1 that grows at 0.4 1/s without oscillating cannot be stabilised: no actuator moves it": (
        lambda: lqr(UNMOVED, {"x1": 1.0}, {"u1": 1.0}, sample=0.1)
    ),
    "the mode of x1 and x2 at 2 Hz, which is not damped, cannot be stabilised: no actuator moves it": (
        lambda: lqr(oscillator(0.0), np.eye(2), {"u1": 1.0})
    ),
    "the mode of x1 and x2 at 2 Hz, which grows at 0.25 1/s, cannot be stabilised: no actuator moves it": (
        lambda: lqr(oscillator(0.25), np.eye(2), {"u1": 1.0})
    ),
    # of several motions at 0, side, yaw, yaw rate and travel of a car with a steering wheel, the one without actuator
    "the mode of x4 at 0 Hz, which nothing holds, cannot be stabilised": (
        lambda: lqr(model([[0, 20, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0], [0, 0, 0, 0]], [[0], [0], [1], [0]]), 1.0, 1.0)
    ),
    "the mode of x1 and x2 at 2 Hz, which decays at 0.25 1/s, cannot be placed: no actuator moves it": (
        lambda: place(oscillator(-0.25), [-1.0, -2.0])
    ),
    "the mode of x1 at 0 Hz, which nothing holds, has zero weight": lambda: lqr(HELD, {"x2": 1.0}, {"u1": 1.0}),
    "the mode of x1 at 0 Hz, which nothing holds, is not seen in y1": lambda: kalman(HELD, {"w1": 1.0}, {"y1": 1.0}),
    "no noise moves the mode of x1 at 0 Hz, which nothing holds": lambda: kalman(HELD, {"w1": 1.0}, {"x1": 1.0}),
    "cannot be placed: nothing measured shows it": lambda: place_observer(HELD, [-1.0, -2.0], ["y1"]),
    "u1_before are inputs of samples before, and errors of these cannot be placed": (
        lambda: place_observer(FINE, [-1.0, -2.0, -3.0], ["y1"], sample=0.1, delay=0.1)
    ),
}


REFUSED: dict[str, Callable[[], object]] = {
    "Q: the weight of x1 is -1": lambda: lqr(FINE, {"x1": -1.0}, {"u1": 1.0}),
    "there is no input 'force'; try: one of u1": lambda: lqr(FINE, {"y1": 1.0}, {"force": 1.0}),
    "some effort has zero weight": lambda: lqr(FINE, {"y1": 1.0}, {"u1": 0.0}),
    "R: a weight of u1 is needed, not NoneType": lambda: lqr(FINE, {"y1": 1.0}, {}),
    "Q: an array of real numbers is needed, not str": lambda: lqr(FINE, "y1", [[1.0]]),
    "inputs are a list of names, not the text 'u1'": lambda: lqr(FINE, 1.0, 1.0, inputs="u1"),
    "sample: motions over 1e+300 s are beyond all numbers": lambda: lqr(HELD, {"y1": 1.0}, {"u1": 1.0}, sample=1e300),
    "poles: a list of numbers is needed, not 'fast'": lambda: place(FINE, cast(Any, "fast")),
    "poles: the pole -3+0i is there 2 times, and 1 of them": lambda: place(FINE, [-3.0, -3.0, -1.0]),
    "Q is negative in some direction (eigenvalue -2)": lambda: lqr(FINE, [1.0, -2.0, 0.0], [1.0]),
    "Q is not symmetric; try: W and its transpose, halved": lambda: lqr(FINE, np.eye(3, k=1), [1.0]),
    "Q: Q[1, 1] is nan, not a finite number": lambda: lqr(FINE, [1.0, np.nan, 1.0], [1.0]),
    "poles: a pole is not finite": lambda: place(FINE, [1e9, 2e9, 3e9], sample=1.0),
    "N has the shape (2, 1); try: (3, 1)": lambda: lqr(FINE, np.eye(3), [[1.0]], np.ones((2, 1))),
    "delay: a delay is given, and no time between two samples": lambda: lqr(FINE, {"y1": 1.0}, {"u1": 1.0}, delay=0.1),
    "sample: ": lambda: lqr(FINE, {"y1": 1.0}, {"u1": 1.0}, sample="5 mm"),
    "sample: the model is sampled already, every 0.1 s": lambda: discretized(discretized(FINE, 0.1), 0.1),
    "sample: the time between two samples is -0.1 s": lambda: discretized(FINE, -0.1),
    "delay: the delay is -0.1 s, and a sample lasts 0.1 s": lambda: discretized(FINE, 0.1, -0.1),
    "measurement_noise: the noise of y1 is 0.0": lambda: kalman(FINE, {"w1": 1.0}, {"y1": 0.0}),
    "inputs: the model has no input": lambda: place_observer(undriven(), [-2.0], ["road"], inputs=["u1"]),
    "measurement_noise: no measured signal is named": lambda: kalman(FINE, {"w1": 1.0}, {}),
    "no disturbance, input or state 'w9'": lambda: kalman(FINE, {"w9": 1.0}, {"y1": 1.0}),
    "try: the same model, inputs, sample and delay for both": lambda: OutputFeedback(
        lqr(FINE, {"y1": 1.0}, {"u1": 1.0}), kalman(FINE, {"w1": 1.0}, {"y1": 1.0}, sample=0.1)
    ),
    "poles: 2 poles are given, and the model has 3 eigenvalues": lambda: place(FINE, [-1.0, -2.0]),
    "without its conjugate; try: -2-1i too": lambda: place(FINE, [-1.0, -2.0 + 1j, -3.0]),
    "and the other is sampled every 0.1 s": lambda: driven_by(FINE, delay_line("w0", "w1", 2, 0.1)),
}


BEYOND_NUMBERS: dict[str, Callable[[], object]] = {
    "could not be solved: overflow encountered in ": lambda: lqr(FINE, {"y1": 1e308}, {"u1": 1e-300}),
    "the Riccati equation could not be solved: ": lambda: kalman(FINE, {"w1": 1e300}, {"y1": 1e-320}),
}


WRONG = {ModelError: NOT_DESIGNED, UsageError: REFUSED, NumericalError: BEYOND_NUMBERS}


@pytest.mark.parametrize(("error", "message"), [(kind, message) for kind, calls in WRONG.items() for message in calls])
def test_what_cannot_be_designed(error: type[EomgenError], message: str) -> None:
    with pytest.raises(error) as caught:
        WRONG[error][message]()
    assert message in str(caught.value)


@pytest.mark.parametrize("sample", [None, 0.01])
def test_poles_and_costs_do_not_depend_on_the_units_of_states(sample: float | None) -> None:
    """One input, so that gains are unique; states in units of 1e-6, 1 and 1e4."""
    units = np.array([1e6, 1.0, 1e-4])
    A, B = np.array([[0.0, 1.0, 0.0], [-3.0, -0.2, 1.0], [0.5, 0.0, -2.0]]), np.array([[0.0], [1.0], [3.0]])
    poles = [-1.0, -2.0 + 1.0j, -2.0 - 1.0j]
    plain = place(model(A, B), poles, sample=sample)
    other = place(model(units[:, np.newaxis] * A / units, units[:, np.newaxis] * B), poles, sample=sample)
    np.testing.assert_allclose(other.gains * units, plain.gains, rtol=1e-7)
    weights = {f"x{k + 1}": weight for k, weight in enumerate([2.0, 1.0, 0.5])}
    scaled = {name: weight / unit**2 for (name, weight), unit in zip(weights.items(), units, strict=True)}
    plain = lqr(model(A, B), weights, {"u1": 0.3}, sample=sample)
    other = lqr(model(units[:, np.newaxis] * A / units, units[:, np.newaxis] * B), scaled, {"u1": 0.3}, sample=sample)
    np.testing.assert_allclose(other.gains * units, plain.gains, rtol=1e-8)


def test_roots_lie_between_points_and_on_them() -> None:
    """(x - 1) (x - 2.5) (x - 4) over whole numbers, with a root that is touched at 7."""
    points = np.arange(1.0, 9.0)
    function = lambda x: (x - 1.0) * (x - 2.5) * (x - 4.0) * (x - 7.0) ** 2  # noqa: E731
    assert sorted(_roots(function, points, function(points))) == pytest.approx([1.0, 2.5, 4.0, 7.0], rel=1e-12)
