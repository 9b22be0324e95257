"""Distributions by each method, against SciPy's normal, binomial and beta distributions: no model is compiled."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy import stats

from eomgen.products.reliability.tails.distribution import Draws
from eomgen.products.reliability.tails.most_probable_point import (
    JUMPING,
    MostProbablePoint,
    UnreachedThreshold,
)
from eomgen.products.reliability.tails.quadratic_form import ResponseExpansion
from eomgen.products.reliability.vibration import distributions as under_test
from eomgen.products.reliability.vibration.result import Distribution

NONE = np.zeros(0)
GRADIENT = np.array([2.0, 0.0])


def plane_point(threshold: float) -> MostProbablePoint:
    """Return the most probable point of y = 1 + 2 z_0 in the plane: P(y > threshold) is that of a normal variable."""
    point = np.array([0.5 * (threshold - 1.0), 0.0])
    multiplier = -1.0 if threshold > 1.0 else 1.0
    return MostProbablePoint(threshold, point, multiplier, ResponseExpansion(threshold, GRADIENT, np.zeros((2, 2))), 1)


THRESHOLDS = np.array([-5.0, 0.0, 1.5, 4.0, 8.0])
EXACT = stats.norm(1.0, 2.0)


def exact(**changes: Any) -> Distribution:
    below, above = EXACT.cdf(THRESHOLDS), EXACT.sf(THRESHOLDS)
    return Distribution(**({"below": below, "above": above, "low": NONE, "high": NONE} | changes))


def test_tails_by_importance_sampling_have_their_standard_errors() -> None:
    points = [plane_point(threshold) for threshold in THRESHOLDS]

    def y(z: np.ndarray) -> np.ndarray:
        return 1.0 + np.asarray(z) @ GRADIENT

    response: Any = SimpleNamespace(values=y, value=y, count=2)
    result = under_test.tails_of(response, points, 4000, 3)
    np.testing.assert_allclose(result.below + result.above, 1.0, rtol=1e-14)
    half = 0.5 * (result.high - result.low)
    np.testing.assert_allclose(result.high - result.below, half, rtol=1e-9)
    assert np.all(np.abs(result.below - EXACT.cdf(THRESHOLDS)) < 1.6 * half)
    assert np.all(half < 0.1 * np.minimum(result.below, result.above) + 1e-12)


def test_counts_replace_probabilities_that_they_contradict() -> None:
    about_mean = Draws(lambda z: (1.0 + z @ GRADIENT,), np.zeros(2), 11)
    y = about_mean.first(200)[1]
    true = exact(low=EXACT.cdf(THRESHOLDS) * 0.9, high=np.minimum(EXACT.cdf(THRESHOLDS) * 1.1, 1.0))
    same, notes = under_test.counted_instead(THRESHOLDS, true, about_mean)
    assert notes == []
    for name in ("below", "above", "low", "high"):
        assert getattr(same, name).tolist() == getattr(true, name).tolist()
    below = np.array([np.nan, 0.01, 0.02, 0.999, 1.0 - 1e-6])
    given = exact(below=below, above=1.0 - below, low=below * 0.9, high=np.minimum(below * 1.1, 1.0))
    given.low[3:] = [0.9985, 1.0 - 2e-6]
    result, notes = under_test.counted_instead(THRESHOLDS, given, about_mean)
    for k, threshold in ((1, 0.0), (2, 1.5), (3, 4.0)):
        under = int(np.count_nonzero(y <= threshold))
        assert result.below[k] == pytest.approx(under / 200) and result.above[k] == pytest.approx(1.0 - under / 200)
        interval = stats.binomtest(under, 200).proportion_ci(0.95, "exact")
        assert (result.low[k], result.high[k]) == pytest.approx((interval.low, interval.high), rel=1e-9)
        upper = k == 3
        share, told = (1.0 - under / 200, 1e-3) if upper else (under / 200, below[k])
        sign = ">" if upper else "<="
        assert notes[k - 1] == (
            f"P(y {sign} {threshold:g}) is {told:.3g} by samples about its most probable point, but {share:.3g} by 200"
            " samples about the mean: other regions contribute, and the latter is taken [W0061]"
        )
    assert len(notes) == 3 and np.isnan(result.below[0]) and result.below[4] == below[4]


@pytest.mark.parametrize("above", [True, False])
def test_tails_are_counted_about_the_mean(above: bool) -> None:
    about_mean = Draws(lambda z: (1.0 + z @ GRADIENT,), np.zeros(2), 5)
    y = about_mean.first(8000)[1]
    threshold = 4.0 if above else -3.0
    seen = int(np.count_nonzero((y > threshold) == above))
    interval = stats.binomtest(seen, len(y)).proportion_ci(0.95, "exact")
    found = under_test._count_tail(about_mean, threshold, above=above)
    assert found == pytest.approx((seen / len(y), interval.low, interval.high), rel=1e-9)
    assert under_test._is_upper(about_mean, threshold) == above
    tenth = float(np.sort(y)[-11 if above else 10])  # ten samples are beyond
    assert under_test._count_tail(about_mean, tenth, above=above)[0] == pytest.approx(10 / 8000, rel=0.11)
    assert np.isnan(under_test._count_tail(about_mean, 9.5 if above else -7.5, above=above)).all()
    failed = Draws(lambda z: (np.where(z[:, 0] > 3.5, np.nan, z[:, 0]),), np.zeros(2), 5)
    assert np.isnan(under_test._count_tail(failed, 0.0, above=above)).all()


def test_a_point_with_nearer_ones_beside_it_is_noted_unless_it_is_next_to_a_jump(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(under_test, "further_design_points", lambda *given: [])
    bent = ResponseExpansion(8.0, GRADIENT, np.diag([0.0, 2.0]))
    points = [MostProbablePoint(8.0, np.array([3.5, 0.0]), -1.0, bent, 1, aside) for aside in (0.0, 0.01)]
    points.append(plane_point(9.0))
    note = "the most probable point of 8 is not the nearest one: trust samples there [W0058]"
    assert under_test.further_points(cast(Any, None), points, 0)[1] == [note]


@pytest.mark.parametrize("count", [1, 40])
def test_samples_have_bounds_of_clopper_and_pearson_and_moments(count: int) -> None:
    y = np.random.default_rng(count).gamma(2.0, 1.0, count)
    thresholds = np.array([-1.0, *np.quantile(y, [0.1, 0.5]), y[0], 100.0])
    result, moments = under_test.empirical_distribution(y, thresholds)
    for k, threshold in enumerate(thresholds):
        under = int(np.sum(y <= threshold))
        interval = stats.binomtest(under, count).proportion_ci(0.95, "exact")
        assert (result.low[k], result.high[k]) == pytest.approx((interval.low, interval.high), rel=1e-9)
        assert result.below[k] == under / count and result.above[k] == 1.0 - under / count
    expected = (y.mean(), y.std(), *((stats.skew(y), stats.kurtosis(y)) if count > 1 else (np.nan, np.nan)))
    assert moments == pytest.approx(expected, rel=1e-9, nan_ok=True)


def test_errors_are_relative_to_the_less_probable_side() -> None:
    true = exact()
    part = np.array([0.1, -0.2, 0.3, -0.05, 0.5])
    wrong = exact(below=true.below * (1.0 + part), above=true.above * (1.0 + part))
    np.testing.assert_allclose(under_test.relative_errors(wrong, true), part, rtol=1e-9)
    one_sided = exact(
        below=np.where(THRESHOLDS < 1.0, true.below, 7.0), above=np.where(THRESHOLDS < 1.0, 7.0, true.above)
    )
    assert under_test.relative_errors(one_sided, true).tolist() == [0.0] * 5


def test_forms_far_from_samples_are_named_with_both_values() -> None:
    below = np.array([0.001, 0.1, 0.5, 0.9, 0.999])
    counted = Distribution(below, 1.0 - below, below - 1.96e-4, below + 1.96e-4)
    form = Distribution(below.copy(), (1.0 - below), NONE, NONE)
    thresholds = np.arange(1.0, 6.0)
    assert under_test.disagreements(thresholds, form, counted, "samples") == {}
    form.below[0], form.above[4], form.above[3] = 0.0017, 0.0017, 0.124
    assert under_test.disagreements(thresholds, form, counted, "samples") == {
        0: "P(y <= 1) is 0.0017 by the quadratic form and 0.001 +- 0.0001 by samples",
        4: "P(y > 5) is 0.0017 by the quadratic form and 0.001 +- 0.0001 by samples",
    }
    form.above[3] = form.below[1] = 0.126
    assert list(under_test.disagreements(thresholds, form, counted, "samples")) == [0, 1, 3, 4]


def test_notes_name_the_worst_form_and_all_vague_corrections() -> None:
    below = np.array([0.01, 0.5, 0.99])
    true = Distribution(below, 1.0 - below, below * 0.9, below * 1.1)
    true.low[2], true.high[2] = 0.989, 0.991
    errors = {"quadratic": np.array([0.02, np.nan, -0.35]), "form": np.array([0.1, 0.2, 0.25])}
    thresholds = np.array([1.0, 2.0, 3.0])
    assert under_test.doubts_of_forms(thresholds, errors, true) == [
        "probabilities of `quadratic` are off by up to 35 %, at 3 (-35 %; `form` +25 %): take `corrected` [W0062]"
    ]
    errors["quadratic"][2] = 0.1
    true.low[0], true.high[0] = 0.008, 0.012
    true.low[1], true.high[1] = 0.425, 0.575
    assert under_test.doubts_of_forms(thresholds, errors, true) == [
        "`corrected` probabilities are known less well at 1 (+- 20 %); try: samples=... or tail_samples=..."
        " (--monte-carlo, --tail-samples) [W0063]"
    ]
    errors["quadratic"][0] = -0.19
    assert len(under_test.doubts_of_forms(thresholds, errors, true)) == 1  # within the spread of samples


def test_places_of_distributions() -> None:
    one = exact(low=THRESHOLDS * 0.0, high=THRESHOLDS * 0.0 + 1.0)
    less = under_test.without(one, {1, 3})
    for name in ("below", "above"):
        ours, theirs = getattr(less, name), getattr(one, name)
        assert np.isnan(ours).tolist() == [False, True, False, True, False] and not np.isnan(theirs).any()
        assert ours[[0, 2, 4]].tolist() == theirs[[0, 2, 4]].tolist()
    assert (less.low is one.low, less.high is one.high) == (True, True)
    wide = under_test.spread(exact(), [5, 0, 1, 2, 6], 8)
    assert wide.below[[5, 0, 1, 2, 6]].tolist() == exact().below.tolist() and np.isnan(wide.below[[3, 4, 7]]).all()
    assert wide.above[[5, 0, 1, 2, 6]].tolist() == exact().above.tolist() and wide.low.size == wide.high.size == 0


def test_ends_of_curves_are_noted_once_with_all_thresholds_beyond() -> None:
    low, high = plane_point(-5.0), plane_point(8.0)
    missed = {
        3: UnreachedThreshold(high, 12.0, JUMPING), 0: UnreachedThreshold(low, -6.0, "the limit of runs"),
        4: UnreachedThreshold(high, 10.0, JUMPING), 1: UnreachedThreshold(low, -9.0, "the limit of runs"),
    }  # fmt: skip
    thresholds = np.array([-6.0, -9.0, 0.0, 12.0, 10.0])
    notes = under_test.notes_on_unreached(missed, thresholds, lambda: ["abs", "min"])
    begin = "the curve of most probable points ends at"
    assert notes == [
        f"{begin} -5, 3 standard deviations out, the limit of runs: -9, -6 have none, trust samples there [W0060]",
        f"{begin} 8, 3.5 standard deviations out, {JUMPING}: by abs, min: 10, 12 have none, trust samples"
        f" there [W0060]",
    ]
    assert under_test.why_gradient_changes([]).startswith("where the gradient of the response changes more than its")
