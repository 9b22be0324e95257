"""Corrections of a path against roots of polynomials; the last one takes known factors if that is exact enough."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.sparse import csc_array

from eomgen.lie.product import Factor
from eomgen.solvers.bordered_newton import (
    Balance,
    Direction,
    LoadedState,
    LoadedStatics,
    Matrix,
    Tangents,
    correct,
    held_factor,
)
from eomgen.solvers.load_steps import stable_branch
from tests.oracles.evaluation import Array


def springs(n: int, power: int, tangents: list[Array], *, whole: bool) -> LoadedStatics:
    """Return n springs with forces x + x^power that a load s stretches each by another part; tangents are listed."""
    shares, nothing = np.linspace(0.5, 1.0, n), np.zeros(0)

    def matrix(entries: Array) -> Matrix:
        return entries if whole else csc_array(entries)

    def tangents_at(rest: LoadedState) -> Tangents:
        tangents.append(rest.q)
        empty = (matrix(np.zeros(shape)) for shape in ((0, n), (n, 0), (0, n), (0, 0)))
        return Tangents(matrix(np.diag(1.0 + power * rest.q ** (power - 1))), *empty)

    return LoadedStatics(
        factors=[Factor("R", "x", 0, n, 0, n)],
        sizes=np.ones(n),
        reach=1.0,
        balance=lambda rest: Balance(rest.q + rest.q**power - rest.s * shares, nothing, nothing),
        tangents=tangents_at,
        by_factor=lambda _: Balance(-shares, nothing, nothing),
        followed=lambda q, _: q,
        strains=lambda _: None,
        mass=lambda _: matrix(np.eye(n)),
    )


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize(("start", "fewer"), [(0.3, 1), (1e-2, 0)])
def test_the_last_correction_takes_known_factors_if_corrections_shrink_fast(
    start: float, fewer: int, whole: bool
) -> None:
    """Twelve digits either way; corrections of 1e-4 are followed by another tangent, and of 1e-5 by none."""
    n, tangents = 4, list[Array]()
    statics = springs(n, 3, tangents, whole=whole)
    exact = np.array([brentq(lambda x, f=f: x + x**3 - f, 0.0, 1.0, xtol=1e-15) for f in np.linspace(0.5, 1.0, n)])
    guess = LoadedState(exact + start, np.zeros(0), np.zeros(0), 1.0)
    result = correct(statics, guess, held_factor(statics, guess), 0.0)
    assert not result.trouble
    np.testing.assert_allclose(result.rest.q, exact, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(result.displacement, exact - guess.q, rtol=0.0, atol=1e-12)
    assert result.corrections == len(tangents) + fewer


def test_a_correction_by_the_stiffness_of_another_side_is_not_taken() -> None:
    """A spring a thousand times as stiff from just below rest on, with a start on the soft side."""
    tangents: list[Array] = []
    statics = springs(1, 3, tangents, whole=True)
    nothing, kink = np.zeros(0), 0.4999

    def balance(rest: LoadedState) -> Balance:
        return Balance(rest.q - rest.s * 0.5 + 1e3 * np.maximum(rest.q - kink, 0.0), nothing, nothing)

    def tangents_at(rest: LoadedState) -> Tangents:
        tangents.append(rest.q)
        empty = (np.zeros(shape) for shape in ((0, 1), (1, 0), (0, 1), (0, 0)))
        return Tangents(np.array([[1001.0 if rest.q[0] > kink else 1.0]]), *empty)

    stiff = LoadedStatics(**{**vars(statics), "balance": balance, "tangents": tangents_at})
    guess = LoadedState(np.array([kink - 1e-4]), nothing, nothing, 1.0)
    result = correct(stiff, guess, held_factor(stiff, guess), 0.0)
    assert not result.trouble
    assert result.rest.q[0] == pytest.approx((0.5 + 1e3 * kink) / 1001.0, rel=1e-13)
    assert len(tangents) == 2


def test_lengths_of_tiny_changes_do_not_underflow() -> None:
    statics = replace(springs(2, 2, [], whole=True), reach=1e200)
    assert statics.length(np.array([3e-200, 0.0]) * np.sqrt(2.0), 4.0) == pytest.approx(5e-200, rel=1e-12, abs=0.0)


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_unstable_rest_leads_to_the_stable_one_on_the_side_of_the_path(side: float, whole: bool) -> None:
    """A double well (x^2 - 1)^2 / 4 beside a spring y^2 / 2, at the same load throughout: rest at x = 1 or -1."""
    form = np.asarray if whole else csc_array

    def statics(slope: float) -> LoadedStatics:
        nothing = np.zeros(0)
        return LoadedStatics(
            factors=[Factor("R", "x", 0, 2, 0, 2)],
            sizes=np.ones(2),
            reach=1.0,
            balance=lambda rest: Balance(np.array([rest.q[0] ** 3 - slope * rest.q[0], rest.q[1]]), nothing, nothing),
            tangents=lambda rest: Tangents(
                form(np.diag([3.0 * rest.q[0] ** 2 - slope, 1.0])),
                *(form(np.zeros(shape)) for shape in ((0, 2), (2, 0), (0, 2), (0, 0))),
            ),
            by_factor=lambda _: Balance(np.zeros(2), nothing, nothing),
            followed=lambda q, _: q,
            strains=lambda _: None,
            mass=lambda _: form(np.eye(2)),
        )

    rest, onwards = LoadedState(np.zeros(2), np.zeros(0), np.zeros(0), 0.7), Direction(np.array([side, 0.1]), 0.3)
    found = stable_branch(statics(1.0), rest, onwards)
    assert found is not None and found.rest.s == 0.7
    np.testing.assert_allclose(found.rest.q, [side, 0.0], atol=1e-8)
    np.testing.assert_allclose(found.left_along, [side, 0.0], atol=1e-9)
    places = np.array(found.path)
    np.testing.assert_array_equal(places[[0, -1]], [rest.q, found.rest.q])
    assert len(places) > 4 and np.all(np.diff(side * places[:, 0]) > 0.0) and np.abs(np.diff(places[:, 0])).max() < 0.5
    assert stable_branch(statics(-1.0), rest, onwards) is None  # stable itself
    assert stable_branch(statics(1.0), replace(rest, z=np.zeros(1)), onwards) is None
