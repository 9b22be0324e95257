"""Searches for rest by a damped motion and by decreasing energy: pendulums, whose rest hangs, and linear motions
against their exponentials."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import scipy.linalg

from eomgen.base.data import replace
from eomgen.lie.product import Factor
from eomgen.solvers.equilibrium_search import (
    _length_of_change,
    _linear,
    _shift,
    follow_damped_motion,
    follow_descent,
    nearest_rest,
)
from eomgen.solvers.statics import SearchTrail, Statics, examine, move
from tests.oracles.evaluation import Array

WEIGHTS = np.array([3.0, 2.0, 1.0])
COUPLING = np.array([[1.5, -0.5, 0.0], [-0.5, 1.0, -0.5], [0.0, -0.5, 0.5]])
INERTIA = np.diag([2.0, 1.0, 0.5])


def statics(force: Any, stiffness: Any, **others: Any) -> Statics:
    """Return three angles with inertias and ``force`` (q, z), which drives them towards less energy, without
    constraints."""
    none = np.zeros
    rates = others.get("rates", lambda q, z: none(0))
    couplings = others.get("couplings", lambda q, z: (none((3, 0)), *none((2, 0, 3)), none((0, 0))))
    return Statics(
        [Factor("R", "x", 0, 3, 0, 3)],
        np.ones(3, bool),
        0,
        mass=lambda q: INERTIA,
        jacobian=lambda q: none((0, 3)),
        constraint=lambda q: none(0),
        residual=lambda q, lam, z: -force(q, z),
        stiffness=lambda q, lam, z: stiffness(q),
        rates=rates,
        couplings=couplings,
        rates_in_motion=lambda q, z, v: rates(q, z) + couplings(q, z)[2] @ v,
        carried_in_motion=lambda q, z, v: couplings(q, z)[2],
        followed=lambda q: q,
        gravity=9.81,
        total=1.0,
    )


def pendulums() -> Statics:
    """Pendulums with torsion springs between each other: the energy is -w cos q + q C q / 2."""
    return statics(lambda q, z: -WEIGHTS * np.sin(q) - COUPLING @ q, lambda q: np.diag(WEIGHTS * np.cos(q)) + COUPLING)


def energy(q: Array) -> float:
    return float(-WEIGHTS @ np.cos(q) + 0.5 * q @ COUPLING @ q)


@pytest.mark.parametrize("start", [[2.5, 2.0, -1.0], [0.1, -0.2, 3.0], [3.1, 3.1, 3.1]])
def test_steps_of_decreasing_energy_end_where_pendulums_hang(start: list[float]) -> None:
    end = follow_descent(pendulums(), np.array(start), np.zeros(0))
    assert end.balanced
    np.testing.assert_allclose(end.point.q, 0.0, atol=1e-9)
    energies = [energy(q) for q in end.path]
    assert all(later <= earlier + 1e-12 for earlier, later in pairwise(energies))
    moves = np.abs(np.diff(end.path, axis=0)).max()
    assert 0.1 < moves <= 1.1  # rad, the width of the region
    damped = follow_damped_motion(pendulums(), np.array(start), np.zeros(0))
    assert damped.balanced
    np.testing.assert_allclose(damped.point.q, 0.0, atol=1e-9)


def test_an_unstable_rest_is_left() -> None:
    upright = statics(lambda q, z: WEIGHTS * np.sin(-q), lambda q: np.diag(WEIGHTS * np.cos(q)))
    for follow in (follow_descent, follow_damped_motion):
        end = follow(upright, np.array([np.pi, 0.0, np.pi]), np.zeros(0))
        assert end.balanced
        np.testing.assert_allclose(np.cos(end.point.q), 1.0, atol=1e-12)


def test_descent_ends_without_rest_where_the_energy_has_no_minimum(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("eomgen.solvers.equilibrium_search.SLOW_STEPS", 2)
    falling = statics(lambda q, z: np.ones(3), lambda q: np.zeros((3, 3)))
    end = follow_descent(falling, np.zeros(3), np.zeros(0))
    assert not end.balanced and end.steps == 20
    np.testing.assert_allclose(np.diff(end.path, axis=0).max(axis=1), 1.0, rtol=0.11)
    broken = statics(lambda q, z: np.where(q > 0.5, np.nan, 1.0), lambda q: np.zeros((3, 3)))
    assert not follow_descent(broken, np.zeros(3), np.zeros(0)).balanced


def test_a_motion_that_lags_is_left_to_decreasing_energy(monkeypatch: pytest.MonkeyPatch) -> None:
    start, z = np.array([2.5, 2.0, -1.0]), np.zeros(0)
    trail = SearchTrail(pendulums(), start, z)
    trail.has_arrived()
    assert trail.lags
    trail.move(examine(pendulums(), 1e-3 * start, z))
    assert not trail.lags
    monkeypatch.setattr("eomgen.solvers.equilibrium_search.SLOW_STEPS", 1)
    left = follow_damped_motion(pendulums(), start, z, patient=False)
    assert not left.balanced and left.steps < 10
    damped, rest = nearest_rest(pendulums(), start, z, any_kind=False)
    assert rest is not None and rest.balanced and rest.steps > damped.steps == left.steps
    np.testing.assert_allclose(rest.point.q, 0.0, atol=1e-9)
    np.testing.assert_array_equal(rest.path[0], start)
    np.testing.assert_array_equal(rest.path[len(damped.path)], damped.point.q)


def test_the_shift_of_stiffnesses_bounds_the_largest_displacement(rng: np.random.Generator) -> None:
    firm, moves, along = rng.uniform(0.1, 10.0, 5), rng.normal(size=(4, 5)), rng.normal(size=5)

    def largest(shift: float) -> float:
        return float(np.abs(moves @ (along / (firm + shift))).max())

    for widest in (1e-3, 0.1, 0.5):
        shift = _shift(firm, moves, along, widest * largest(0.0))
        assert 0.7 * widest * largest(0.0) < largest(shift) <= widest * largest(0.0)
    assert _shift(firm, moves, along, 1.001 * largest(0.0)) == 0.0


def test_a_linear_motion_is_an_exponential_and_its_error_the_bent_forces(rng: np.random.Generator) -> None:
    """x' = J x + f with internal states: against the exponential of the bordered matrix; a force that bends as time
    squared adds the third function of exponential integrators."""
    by_z, rate_q, rate_z = rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), -np.diag([1.0, 2.0])
    coupled = statics(
        lambda q, z: -COUPLING @ q - by_z @ z - WEIGHTS,
        lambda q: COUPLING,
        rates=lambda q, z: rate_q @ q + rate_z @ z + 1.0,
        couplings=lambda q, z: (by_z, rate_q, np.zeros((2, 3)), rate_z),
    )
    point, slower = examine(coupled, np.array([0.1, 0.2, -0.3]), np.array([0.5, -0.2])), 3.0
    motion = _linear(point, slower)
    root = np.linalg.inv(np.linalg.cholesky(INERTIA)).T
    K = root.T @ COUPLING @ root
    rate = 2.0 * np.sqrt(np.abs(K).max()) / slower
    assert motion.rate == pytest.approx(rate, rel=1e-12)
    J = np.block([[-K, -root.T @ by_z], [rate * rate_q @ root, rate * rate_z]])
    f = np.concatenate([-root.T @ point.residual, rate * point.rates])
    for time in (0.05, 1.0):
        bordered = np.zeros((6, 6))
        bordered[:5, :5], bordered[:5, 5] = J, f
        expected = scipy.linalg.expm(time * bordered)[:5, 5]
        change = motion.step(time)
        np.testing.assert_allclose(change, expected, rtol=1e-9, atol=1e-12)
        reached = examine(coupled, point.q + root @ change[:3], point.z + change[3:])
        error, there = motion.error(change, reached, time)
        np.testing.assert_allclose(error, 0.0, atol=1e-12)  # these forces are linear
        np.testing.assert_allclose(there, np.concatenate([-root.T @ reached.residual, rate * reached.rates]))
        bend = rng.normal(size=5)
        bent = SimpleNamespace(
            acceleration=reached.acceleration + root @ bend[:3] / motion.scale[:3],
            rates=reached.rates + bend[3:] / rate / motion.scale[3:],
        )
        chain = np.diag([1.0] * 7, 1)  # of time squared / 2, time and 1
        chain[:5, :5], chain[:5, 5], chain[:5, 6:] = J, 2.0 * bend / motion.scale / time**2, 0.0
        error, _ = motion.error(change, cast("Any", bent), time)
        np.testing.assert_allclose(error, scipy.linalg.expm(time * chain)[:5, 7], rtol=1e-9, atol=1e-12)
    newton = motion.step(np.inf)
    np.testing.assert_allclose(newton, -np.linalg.solve(J, f), rtol=1e-9)
    assert (
        _length_of_change(coupled, point, np.full(5, np.nan)) != _length_of_change(coupled, point, np.zeros(5)) == 0.0
    )


def test_lengths_count_no_turns() -> None:
    sliding = statics(lambda q, z: -q, lambda q: np.eye(3))
    object.__setattr__(sliding, "turning", np.array([True, False, False]))
    object.__setattr__(sliding, "length", 4.0)
    point = examine(sliding, np.zeros(3), np.zeros(0))
    change = np.linalg.solve(point.basis, [9.0, -2.0, 1.0])
    assert _length_of_change(sliding, point, change) == pytest.approx(0.5, rel=1e-12)


@pytest.mark.parametrize(("rate", "end"), [(lambda z: 1.0 - z, 1.0 - np.exp(-2.0)), (lambda z: 1.0 + z * z, None)])
def test_internal_states_follow_their_rates_along_a_motion_unless_they_explode(rate: Any, end: float | None) -> None:
    """Over 2 rad 1 - z leads to 1 - exp(-2), and 1 + z^2 to no end: tan(2) lies beyond a pole."""
    zero = np.zeros(3)
    made = replace(
        statics(lambda q, z: -WEIGHTS * q, lambda q: np.diag(WEIGHTS), rates=lambda q, z: np.zeros(1)),
        couplings=lambda q, z: (np.zeros((3, 1)), np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 1))),
        rates_in_motion=lambda q, z, v: rate(z) * v[0],
        carried_in_motion=lambda q, z, v: np.array([[1.0, 0.0, 0.0]]),
    )
    start = examine(made, zero, np.zeros(1))
    reached = move(made, start, np.append(start.dual @ np.array([2.0, 0.0, 0.0]), 0.0))
    assert (reached is None) == (end is None)
    if reached is not None:
        assert reached.z == pytest.approx([end], rel=1e-5)
