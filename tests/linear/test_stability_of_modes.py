"""The verdict on stability, and the other answers that modes draw from their eigenvalues, of oscillators by hand."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
import scipy.linalg
from scipy.optimize import linear_sum_assignment

from eomgen.base.arrays import Array
from eomgen.products.linear.eigenvalues import decomposition
from eomgen.products.linear.modes import Modes, modes
from eomgen.products.linear.state_space import StateSpace


def _oscillators(*pairs: tuple[float, float]) -> Modes:
    """Return the modes of x" + damping x' + stiffness x = 0, one mass for each pair (damping, stiffness)."""
    n = len(pairs)
    return modes(_matrix(pairs), np.eye(n, 2 * n), [f"x{k}" for k in range(n)], np.ones(n))


def _matrix(pairs: Sequence[tuple[float, float]]) -> Array:
    damping, stiffness = np.array(pairs).T
    n = len(pairs)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(stiffness), -np.diag(damping)]])


def _space(A: Array, sample: float | None = None) -> StateSpace:
    """Return the state space of A without inputs and outputs; of the sampled motion if a time between samples is
    given."""
    n = len(A)
    none, name = np.zeros((n, 0)), tuple(f"x{k}" for k in range(n))
    sampled = A if sample is None else scipy.linalg.expm(sample * A)
    return StateSpace(sampled, none, none, none.T, none[:0], none[:0], name, (), (), (), sample=sample)


@pytest.mark.parametrize(
    ("pairs", "verdict"),
    [
        ([(0.2, 4.0)], "stable"),
        ([(0.0, 4.0)], "marginal"),
        ([(-0.2, 4.0)], "unstable"),
        ([(0.0, -4.0)], "unstable"),
        ([(1.0, 0.0)], "marginal"),
        ([(0.0, 0.0)], "marginal"),
        ([(0.2, 4.0), (0.3, 9.0)], "stable"),
        ([(0.2, 4.0), (0.0, 9.0)], "marginal"),
        ([(0.2, 4.0), (-1e-6, 9.0)], "unstable"),
        ([(0.0, 4.0), (-0.2, 9.0)], "unstable"),
    ],
)
def test_the_verdict_follows_from_damping_and_stiffness(pairs: list[tuple[float, float]], verdict: str) -> None:
    found = _oscillators(*pairs)
    assert found.stability == verdict
    assert f", {verdict}" in repr(found)
    for sample in (None, 0.01):
        assert _space(_matrix(pairs), sample).stability == verdict


def test_oscillations_frequencies_and_the_band_are_of_the_modes_that_are_not_zero() -> None:
    found = _oscillators((0.0, 0.0), (0.4, 4.0), (0.0, 100.0))
    assert found.oscillating.tolist() == [False] * (len(found) - 2) + [True, True]
    assert found.frequency[-2:] == pytest.approx([2.0 / (2.0 * np.pi), 10.0 / (2.0 * np.pi)])
    assert found.damping_ratio[-2:] == pytest.approx([0.1, 0.0], abs=1e-12)
    assert found.band == pytest.approx((0.1 * 2.0 / (2.0 * np.pi), 10.0 * 10.0 / (2.0 * np.pi)))
    assert _oscillators((0.0, 0.0)).band == (0.01, 100.0)


def test_parts_that_are_not_coupled_have_the_modes_of_the_whole_matrix() -> None:
    random = np.random.default_rng(5)
    spun = np.array([[0.0, 1.0], [0.0, 0.0]])
    parts = [*[spun] * 4, random.normal(size=(21, 21)), random.normal(size=(14, 14))]
    order = random.permutation(sum(map(len, parts)))
    A = scipy.linalg.block_diag(*parts)[np.ix_(order, order)]
    values, vectors, errors = decomposition(A)
    assert np.linalg.norm(A @ vectors - vectors * values) < 1e-13 * np.linalg.norm(A)
    whole = scipy.linalg.eigvals(A)
    distances = np.abs(values[:, np.newaxis] - whole)
    assert np.max(distances[linear_sum_assignment(distances)]) < 1e-11
    of_bodies = np.abs(values) == 0.0  # bodies that turn freely
    assert np.sum(of_bodies) == 8 and np.all(errors[of_bodies] == 16.0 * np.finfo(float).eps ** 0.5)
    assert np.allclose(np.linalg.norm(vectors, axis=0), 1.0)


SLOW, FAST = _matrix([(1e-8, 1.0)]), _matrix([(1e5, 1e14)])
ONE_WAY = np.block([[SLOW, np.zeros((2, 2))], [np.full((2, 2), 1e9), FAST]])


@pytest.mark.parametrize(
    ("A", "sample", "verdict"),
    [
        ([[-1.0, 1e9], [0.0, -1.0]], None, "stable"),
        ([[-1.0, 0.0, 0.0], [1e9, -2.0, 0.0], [0.0, 1e9, -3.0]], None, "stable"),
        (scipy.linalg.block_diag(SLOW, FAST), None, "stable"),
        (ONE_WAY, None, "stable"),
        (ONE_WAY + 2e-8 * np.diag([0.0, 1.0, 0.0, 0.0]), None, "unstable"),
        ([[-1e150, 1e160], [-1e160, -1e150]], None, "stable"),
        ([[0.9, 1e9], [0.0, 0.9]], 0.01, "stable"),
        ([[1.0 - 1e-7, 1e3], [0.0, 1.0 - 1e-7 * (1.0 + 1e-7)]], 0.01, "stable"),
    ],
)
def test_gains_between_parts_make_no_rounding_errors(A: Array, sample: float | None, verdict: str) -> None:
    """A is triangular, or block triangular: its eigenvalues are its parts' own."""
    n = len(A)
    none, names = np.zeros((n, 0)), tuple("abcd"[:n])
    space = StateSpace(np.array(A), none, none, none.T, none[:0], none[:0], names, (), (), (), sample=sample)
    assert space.stability == verdict and (space.decay > 0.0) == (verdict == "stable")


@pytest.mark.parametrize("size", [3, 5, 20])
def test_a_multiple_zero_turned_is_marginal(size: int, rng: np.random.Generator) -> None:
    """Rounding parts m zeros with a single vector by the m-th root of the precision."""
    turn = np.linalg.qr(rng.normal(size=(size, size)))[0]
    shift = np.diag(np.ones(size - 1), 1)
    assert _space(turn @ shift @ turn.T).stability == "marginal"
    assert _space(turn @ (shift - np.eye(size)) @ turn.T).stability == ("stable" if size < 20 else "marginal")
