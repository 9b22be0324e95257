"""Quadratic forms of normal variables: moments, and distributions against SciPy's chi-square and normal ones."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from eomgen.errors import ModelError
from eomgen.products.reliability.tails.distribution import lugannani_rice, steepest_descent
from eomgen.products.reliability.tails.quadratic_form import QuadraticForm
from tests.anchors import anchor
from tests.reliability.duffing import Duffing

INVERSIONS = {"steepest_descent": steepest_descent, "lugannani_rice": lugannani_rice}


def chi_square(n: int, offset: float = 0.0) -> QuadraticForm:
    """Return sum (z + offset)^2 of n variables."""
    return QuadraticForm(n * offset**2, np.full(n, 2.0 * offset), 2.0 * np.eye(n))


@pytest.mark.parametrize(("n", "offset"), [(1, 0.0), (2, 0.0), (7, 0.0), (1, 1.7), (5, 0.4)])
def test_both_tails_are_those_of_chi_square_to_twelve_digits(n: int, offset: float) -> None:
    y = np.array([1e-2, 0.3, n, n + 1.0, 5.0, 50.0, 500.0])
    tails = steepest_descent(chi_square(n, offset), y)
    oracle = stats.ncx2(n, n * offset**2) if offset else stats.chi2(n)
    np.testing.assert_allclose(tails.below, oracle.cdf(y), rtol=2e-13)
    np.testing.assert_allclose(tails.above, oracle.sf(y), rtol=2e-12)
    assert tails.above[-1] < 1e-80


@pytest.mark.parametrize("name", INVERSIONS)
def test_a_form_for_each_threshold_gives_what_each_gives_alone(name: str) -> None:
    """Forms with poles on both sides, on one, with none, and without spread."""
    square, none = np.diag([2.0, 0.0]), np.zeros((2, 2))
    forms = [QuadraticForm(0.2 * k, np.array([1.0, 0.3]), np.diag([0.4 * k, -0.1])) for k in range(3)]
    forms += [QuadraticForm(0.0, np.array([1.0, 2.0]), none), QuadraticForm(0.0, np.array([0.0, 3.0]), square)]
    forms += [QuadraticForm(1.0, np.zeros(2), none), QuadraticForm(1.0, np.zeros(2), square)]
    thresholds = [-0.4, 0.1, 3.0, 1.5, 0.7, 1.0, 0.5]
    together = INVERSIONS[name](forms, thresholds)
    for side in ("below", "above"):
        alone = [getattr(INVERSIONS[name](form, y), side) for form, y in zip(forms, thresholds, strict=True)]
        np.testing.assert_allclose(getattr(together, side), alone, rtol=1e-13)


def test_values_that_a_form_never_takes() -> None:
    tails = steepest_descent(chi_square(3), [-1.0, -1e-300])
    np.testing.assert_array_equal(tails.below, 0.0)
    np.testing.assert_array_equal(tails.above, 1.0)
    constant = steepest_descent(QuadraticForm(2.0, np.zeros(3), np.zeros((3, 3))), [1.0, 2.0, 3.0])
    np.testing.assert_array_equal(constant.below, [0.0, 1.0, 1.0])


def test_moments_and_distribution_of_the_linear_oscillator() -> None:
    """Reference digits of integrators_and_random_vibration.md 4.6, where the expansion is exact."""
    form = Duffing(cubic=0.0, depth=0.3).expansion(np.zeros(21)).form
    moments = form.moments
    anchor("quadratic_response").check(moments)
    reference = anchor("quadratic_distribution").reference
    for name, tolerance in (("steepest_descent", 1e-8), ("lugannani_rice", 6e-4)):
        tails = INVERSIONS[name](form, [0.0, 0.5, 1.0, 2.0])
        np.testing.assert_allclose(tails.below, reference, atol=tolerance)
        np.testing.assert_allclose(tails.below + tails.above, 1.0, atol=1e-14)
    anchor("quadratic_distribution").check(steepest_descent(form, [0.0, 0.5, 1.0, 2.0]).below)
    far = [6.0, 40.0]
    exact, near = (INVERSIONS[name](form, far).above for name in ("steepest_descent", "lugannani_rice"))
    np.testing.assert_allclose(near, exact, rtol=5e-3)
    assert 0.0 < exact[1] < 1e-100


def test_autocovariance_of_the_linear_oscillator() -> None:
    forms = [Duffing(0.0, 0.3, last).expansion(np.zeros(21)).form for last in (100, 150, 200, 250, 300)]
    found = [form.covariance(forms[-1]) for form in forms]
    np.testing.assert_allclose(found, [-0.08316337, 0.07729040, 0.00998309, -0.16942185, 0.35781765], atol=1e-8)


def test_refused_forms_say_why() -> None:
    with pytest.raises(ModelError, match=r"a quadratic form of 2 variables needs a Hessian \(2, 2\), found \(3, 3\)"):
        QuadraticForm(0.0, np.zeros(2), np.eye(3))
    with pytest.raises(ModelError, match="a quadratic form needs finite numbers"):
        QuadraticForm(np.nan, np.zeros(2), np.eye(2))


def test_the_saddle_point_formula_has_its_limit_at_the_mean() -> None:
    """Lugannani and Rice at the mean: 1/2 + K''' / (6 sqrt(2 pi) K''^1.5), K'' = 2 n and K''' = 8 n of chi-square."""
    n = 7
    limit = 0.5 + 8.0 * n / (6.0 * np.sqrt(2.0 * np.pi) * (2.0 * n) ** 1.5)
    away = np.sqrt(2.0 * n) * np.array([0.0, 1e-6, -1e-6])
    tails = lugannani_rice(chi_square(n), n + away)
    np.testing.assert_allclose(tails.below, limit, atol=1e-6)
    assert tails.below[0] == pytest.approx(limit, rel=1e-12)
