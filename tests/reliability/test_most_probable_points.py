"""Most probable points of the Duffing oscillator under a squared Gaussian process, and probabilities about them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pytest

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError
from eomgen.products.reliability.tails.distribution import importance_sampling, steepest_descent
from eomgen.products.reliability.tails.most_probable_point import (
    MostProbablePoint,
    breitung,
    first_order,
    further_design_points,
    hohenbichler_rackwitz,
    points_on_curve,
)
from eomgen.products.reliability.tails.quadratic_form import (
    ProjectedResponse,
    Response,
    ResponseExpansion,
    hermite_projection,
)
from tests.reliability.duffing import Duffing

#: Quantiles of a million samples, 1e-3 to 0.999 (integrators_and_random_vibration.md 4.6).
SHARES = np.array([1e-3, 0.01, 0.1, 0.9, 0.99, 0.999])


def most_probable_points(response: Response, thresholds: Sequence[float]) -> list[MostProbablePoint]:
    points, missed = points_on_curve(response, thresholds)
    if missed:
        raise missed[min(missed)]
    return [points[k] for k in range(len(thresholds))]


class CountedResponse:
    """A response that counts its evaluations: values alone, values with gradients, and with Hessians."""

    def __init__(self, response: Response) -> None:
        self.response, self.size = response, response.size
        self.solved = self.sloped = self.expanded = 0

    def values(self, points: Array) -> Array:
        self.solved += len(points)
        return self.response.values(points)

    def gradient(self, point: Array) -> tuple[float, Array]:
        self.sloped += 1
        return self.response.gradient(point)

    def expansion(self, point: Array) -> ResponseExpansion:
        self.expanded += 1
        return self.response.expansion(point)


class Formula:
    """A response of two variables by a formula: value, gradient and Hessian by hand."""

    size = 2

    def __init__(self, kind: str) -> None:
        self.kind = kind

    def expansion(self, point: Array) -> ResponseExpansion:
        x, y = point
        if self.kind == "two valleys":  # x^2 reaches 9 at x = 3 and x = -3; the slope makes one of them nearer
            return ResponseExpansion(x * x + 0.05 * x, np.array([2.0 * x + 0.05, 0.0]), np.diag([2.0, 0.0]))
        if self.kind == "bounded":
            bend = 1.0 / np.cosh(x) ** 2
            return ResponseExpansion(np.tanh(x), np.array([bend, 0.0]), np.diag([-2.0 * np.tanh(x) * bend, 0.0]))
        if self.kind == "flat":
            return ResponseExpansion(x * x + y * y, np.array([2.0 * x, 2.0 * y]), 2.0 * np.eye(2))
        raise ValueError(self.kind)

    def gradient(self, point: Array) -> tuple[float, Array]:
        found = self.expansion(point)
        return found.value, found.gradient

    def values(self, points: Array) -> Array:
        return np.array([self.expansion(point).value for point in points])


@pytest.mark.long
def test_the_distribution_between_the_quantiles_of_samples() -> None:
    """Quadratic forms at most probable points against 1e5 samples, known to 1.6e-3: check 18 of the dossier."""
    duffing = Duffing(0.5, 0.3)
    samples = np.concatenate([duffing.values(np.random.default_rng(k).standard_normal((50_000, 21))) for k in range(2)])
    thresholds = np.quantile(samples, SHARES)
    found = most_probable_points(duffing, list(thresholds))
    assert max(one.iterations for one in found) <= 6
    quadratic = np.array([float(steepest_descent(one.form, one.threshold).below) for one in found])
    off = np.abs(quadratic - SHARES).max()
    first = max(abs(1.0 - first_order(one) - share) for one, share in zip(found, SHARES, strict=True))
    assert off <= 8e-3
    assert first >= 5.0 * off


@pytest.mark.slow
@pytest.mark.parametrize(("side", "cubic", "reach"), [(-1.0, 0.1, -2.3), (1.0, 0.5, 2.35)])
def test_tails_five_standard_deviations_out_against_importance_sampling(
    side: float, cubic: float, reach: float
) -> None:
    duffing = Duffing(cubic, 0.3)
    mean = duffing.expansion(np.zeros(21))
    (found,) = most_probable_points(duffing, [reach])
    assert 4.0 < side * found.index < 6.0, (found.index, mean.value)
    estimate = importance_sampling(duffing, found.point, reach, above=side > 0, samples=20_000, seed=4)
    assert estimate.standard_error < 0.1 * estimate.probability
    tails = steepest_descent(found.form, reach)
    quadratic = float(tails.above if side > 0 else tails.below)
    assert quadratic == pytest.approx(estimate.probability, rel=0.25)
    plane = first_order(found)
    assert (plane if side > 0 else 1.0 - plane) > 1.7 * estimate.probability


def test_curvatures_of_a_circle_give_its_known_probability() -> None:
    """P(z1 + c z2^2 / 2 > b): curvature -c; Breitung's (1 + b c')^(-1/2), exact as b grows."""

    class Parabola(Formula):
        def expansion(self, point: Array) -> ResponseExpansion:
            x, y = point
            return ResponseExpansion(x - 0.2 * y * y, np.array([1.0, -0.4 * y]), np.diag([0.0, -0.4]))

    (found,) = most_probable_points(Parabola(""), [4.0])
    np.testing.assert_allclose(found.curvatures, [0.4], rtol=1e-12)
    exact = float(steepest_descent(found.form, 4.0).above)
    assert first_order(found) / exact > 1.5
    assert breitung(found) == pytest.approx(first_order(found) / np.sqrt(1.0 + 4.0 * 0.4), rel=1e-12)
    assert breitung(found) == pytest.approx(exact, rel=0.05)
    assert hohenbichler_rackwitz(found) == pytest.approx(exact, rel=0.02)

    class Mirrored(Parabola):
        def expansion(self, point: Array) -> ResponseExpansion:
            return ResponseExpansion(*(-part for part in Parabola("").expansion(point)))

    (other,) = most_probable_points(Mirrored(""), [-4.0])
    assert other.index == pytest.approx(-4.0)
    for tail in (first_order, breitung, hohenbichler_rackwitz):
        assert 1.0 - tail(other) == pytest.approx(tail(found), rel=1e-9)


def test_a_point_with_nearer_ones_beside_it_is_none() -> None:
    class Bowl(Formula):  # x + y^2 / 2 = 2 is nearer to the mean beside (2, 0), at (1, sqrt 2)
        def expansion(self, point: Array) -> ResponseExpansion:
            x, y = point
            return ResponseExpansion(x + 0.5 * y * y, np.array([1.0, y]), np.diag([0.0, 1.0]))

    (near, far) = most_probable_points(Bowl(""), [0.5, 2.0])
    assert near.nearest and not far.nearest
    assert np.isnan(breitung(far))


@pytest.mark.slow
def test_a_second_valley_is_found() -> None:
    (found,) = most_probable_points(Formula("two valleys"), [9.0])
    assert found.point[0] == pytest.approx(2.975, abs=1e-3)
    counted = CountedResponse(Formula("two valleys"))
    (other,) = further_design_points(counted, found, 0)
    assert other.point[0] == pytest.approx(-3.025, abs=1e-3)
    assert counted.expanded == 2  # where the search ends, and at the point: others came to known ones
    low, high = most_probable_points(Duffing(0.1, 0.3), [0.2, 0.8])
    assert further_design_points(Duffing(0.1, 0.3), high, 0) == []
    assert low.index < 0.0 < high.index


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("bounded", "the curve of most probable points from the mean does not come to 1.5: it ends at "),
        ("flat", "does not come to 1.5: it ends at 0, 0 standard deviations out, since the response has no slope"),
    ],
)
def test_what_has_no_most_probable_point_says_why(kind: str, text: str) -> None:
    with pytest.raises(NumericalError, match=re.escape(text)):
        most_probable_points(Formula(kind), [1.5])


def test_thresholds_beyond_the_end_of_the_curve_leave_the_others_theirs() -> None:
    found, missed = points_on_curve(Formula("bounded"), [1.5, 0.5, 2.0, -0.5])
    assert [found[k].point[0] for k in (1, 3)] == pytest.approx([np.arctanh(0.5), -np.arctanh(0.5)])
    assert sorted(missed) == [0, 2]
    assert missed[0].last is missed[2].last
    assert 0.99 < missed[0].last.threshold <= 1.0


def test_samples_without_a_value_make_no_probability() -> None:
    class Broken(Formula):
        def values(self, points: Array) -> Array:
            return np.where(points[:, 0] < 3.5, points[:, 0], np.nan)

    for above in (True, False):
        estimate = importance_sampling(Broken(""), np.array([2.0, 0.0]), 2.0, above=above, samples=500, seed=0)
        assert np.isnan(estimate.probability) and np.isnan(estimate.standard_error)
    fine = importance_sampling(Broken(""), np.array([-2.0, 0.0]), -2.0, above=False, samples=500, seed=0)
    assert fine.probability == pytest.approx(0.02275, rel=0.2)


@pytest.mark.slow
def test_projections_onto_hermite_polynomials_mend_the_variance_of_the_mean_expansion() -> None:
    duffing = Duffing(0.1, 0.3)
    samples = duffing.values(np.random.default_rng(8).standard_normal((20_000, 21)))
    about_mean, projected = duffing.expansion(np.zeros(21)).form, hermite_projection(duffing, 32, 0)
    spread = samples.std()
    assert abs(about_mean.standard_deviation / spread - 1.0) > 0.05
    assert abs(projected.standard_deviation / spread - 1.0) < 0.02
    assert abs(projected.mean - samples.mean()) < 0.03 * spread


class Turned:
    """A response of 30 variables that bends in three directions alone, none of them that of its slope."""

    size = 30

    def __init__(self) -> None:
        random = np.random.default_rng(3)
        self.bending = np.linalg.qr(random.standard_normal((30, 3)))[0]
        self.slope = random.standard_normal(30)
        self.multiplied = 0

    def expansion(self, point: Array) -> ResponseExpansion:
        along = self.bending.T @ point
        value = self.slope @ point + np.cos(along).sum()
        hessian = -(self.bending * np.cos(along)) @ self.bending.T
        return ResponseExpansion(float(value), self.slope - self.bending @ np.sin(along), hessian)

    def gradient(self, point: Array) -> tuple[float, Array]:
        found = self.expansion(point)
        return found.value, found.gradient

    def values(self, points: Array) -> Array:
        return np.array([self.expansion(point).value for point in points])

    def products(self, point: Array, directions: Array) -> Array:
        self.multiplied += directions.shape[1]
        return np.asarray(self.expansion(point).hessian @ directions)


def test_a_projected_response_has_its_whole_hessian_where_it_bends_in_these_directions_alone() -> None:
    turned = Turned()
    projected = ProjectedResponse(turned, turned.bending)
    point = np.random.default_rng(4).standard_normal(30)
    found, whole = projected.expansion(point), turned.expansion(point)
    np.testing.assert_allclose(found.hessian, whole.hessian, atol=1e-14)
    np.testing.assert_array_equal(found.gradient, whole.gradient)
    assert turned.multiplied == 4
    projected = ProjectedResponse(turned, np.zeros((30, 0)))
    slope = whole.gradient / np.linalg.norm(whole.gradient)
    np.testing.assert_allclose(projected.expansion(point).hessian @ slope, whole.hessian @ slope, atol=1e-14)
    turned.multiplied = 0
    ProjectedResponse(turned, slope[:, None]).expansion(point)
    assert turned.multiplied == 1


def test_most_probable_points_do_not_hang_on_the_directions_of_hessians() -> None:
    turned = Turned()
    (whole,) = most_probable_points(turned, [12.0])
    (projected,) = most_probable_points(ProjectedResponse(turned, turned.bending[:, :1]), [12.0])
    np.testing.assert_allclose(projected.point, whole.point, atol=1e-8)
    assert projected.index == pytest.approx(whole.index, rel=1e-10)
