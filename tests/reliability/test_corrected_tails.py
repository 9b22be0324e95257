"""Quadratic forms corrected by samples, against responses whose distribution is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import special

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError
from eomgen.products.reliability.tails.distribution import Draws, corrected_tail, far_branches, steepest_descent
from eomgen.products.reliability.tails.most_probable_point import JUMPING, points_on_curve
from eomgen.products.reliability.tails.quadratic_form import QuadraticForm, ResponseExpansion


def monotonic(points: Array) -> tuple[Array]:
    """y = sinh(z1) is above sinh(b) with probability P(z1 > b)."""
    return (np.sinh(points[:, 0]),)


@pytest.mark.parametrize("index", [0.3, 1.0, 2.5, -1.5, 4.0])
@pytest.mark.parametrize("wrong", [1.0, 1.3, 0.5])
def test_a_form_that_is_wrong_is_corrected_within_its_bounds(index: float, wrong: float) -> None:
    """A plane at ``wrong`` times the distance; most errors lie within the bounds, all within twice these."""
    slope, above = 1.0 / wrong, index > 0.0
    form = QuadraticForm(0.0, np.array([slope * np.sinh(index) / index, 0.0, 0.0]), np.zeros((3, 3)))
    true, of_form = special.ndtr(-abs(index)), special.ndtr(-abs(index) * wrong)
    centre = np.array([index if abs(index) > 1.0 else 0.0, 0.0, 0.0])
    within = []
    for seed in range(8):
        found = corrected_tail(
            Draws(monotonic, centre, seed), form, of_form, np.sinh(index), above=above, accuracy=0.1, most=10_000
        )
        assert found.standard_error < 0.05 * max(found.probability, 0.1 * of_form)
        assert abs(found.probability - true) < 4.0 * found.standard_error
        within.append(abs(found.probability - true) < 1.96 * found.standard_error)
    assert np.mean(within) >= 0.7
    if wrong == 1.0:
        assert found.samples <= 3200 and found.probability == pytest.approx(true, rel=1e-9)


def test_samples_are_as_many_as_the_accuracy_asks_for_and_begin_with_the_same() -> None:
    draws = Draws(monotonic, np.zeros(2), 3)
    first, y = draws.first(200)
    more, values = draws.first(400)
    assert len(more) == len(values) == 400
    np.testing.assert_array_equal(more[:200], first)
    np.testing.assert_array_equal(values[:200], y)
    plane = QuadraticForm(0.0, np.ones(2), np.zeros((2, 2)))
    counts = [
        corrected_tail(Draws(monotonic, np.zeros(2), 3), plane, 0.24, 1.0, above=True, accuracy=accuracy, most=10**5)
        for accuracy in (0.3, 0.1, 0.03)
    ]
    assert counts[0].samples <= counts[1].samples < counts[2].samples

    def broken(points: Array) -> tuple[Array]:
        return (np.where(points[:, 0] > 2.0, np.nan, points[:, 0]),)

    assert np.isnan(
        corrected_tail(Draws(broken, np.zeros(2), 0), plane, 0.1, 1.0, above=True, accuracy=0.1, most=400).probability
    )


class Kinked:
    """y = z1 + a |z2 - b| whose gradient jumps at z2 = b; ``rough`` adds jumps all along the way."""

    size = 2

    def __init__(self, jumps: float) -> None:
        self.jumps = jumps

    def values(self, points: Array) -> Array:
        return np.asarray(points[:, 0] + self.jumps * np.abs(points[:, 1] - 0.05))

    def gradient(self, point: Array) -> tuple[float, Array]:
        slope = self.jumps * np.sign(point[1] - 0.05)
        return float(self.values(point[None])[0]), np.array([1.0, slope])

    def expansion(self, point: Array) -> ResponseExpansion:
        value, gradient = self.gradient(point)
        return ResponseExpansion(value, gradient, np.zeros((2, 2)))


def test_a_curve_that_ends_at_a_kink_says_that_the_gradient_jumps() -> None:
    """With a valley along z2 = b the direction of the gradient never meets the point."""
    _, missed = points_on_curve(Kinked(0.5), [-3.0])
    assert missed[0].why == JUMPING
    assert isinstance(missed[0], NumericalError) and "where the gradient of the response jumps" in str(missed[0])
    found, missed = points_on_curve(Kinked(0.01), [3.0, -3.0])
    assert not missed and all(abs(found[k].index) == pytest.approx(3.0, rel=2e-3) for k in found)


def _cubic(points: Array) -> tuple[Array]:
    z = points[:, 0]
    return (1.0 + 2.0 * z + 0.1 * z**3,)


@pytest.mark.parametrize("index", [-2.6, -2.35, 2.0, 2.6])
@pytest.mark.parametrize("size", [1, 6])
def test_a_form_that_bends_back_is_corrected_at_both_ends(index: float, size: int) -> None:
    """The form of a cubic about a point reaches the threshold behind the mean, too, and the cubic does not."""
    true, point = special.ndtr(-abs(index)), np.zeros(size)
    point[0] = index
    value, slope, bend = 1.0 + 2.0 * index + 0.1 * index**3, 2.0 + 0.3 * index**2, 0.6 * index
    gradient, hessian = np.zeros(size), np.zeros((size, size))
    gradient[0], hessian[0, 0] = slope, bend
    form, above = QuadraticForm(0.0, gradient, hessian).about(point, value), index > 0.0
    tails = steepest_descent(form, [value])
    of_form = float((tails.above if above else tails.below)[0])
    assert of_form > 1.01 * true
    branches = far_branches(form, value, point, of_form, above=above)
    assert branches.shape == (1, size) and form.values(branches) == pytest.approx([value], abs=1e-12)
    centres = np.vstack([point, branches])
    found = [
        corrected_tail(Draws(_cubic, centres, seed), form, of_form, value, above=above, accuracy=0.1, most=4000)
        for seed in range(6)
    ]
    for each in found:
        assert abs(each.probability - true) < 4.0 * each.standard_error < 0.25 * true
    assert np.mean([each.probability for each in found]) == pytest.approx(true, rel=0.05)


def test_both_sides_of_a_response_that_bends_back_count() -> None:
    """P(z^2 > 9) has two regions; the form is the response, and keeps the probability of both."""
    form = QuadraticForm(0.0, np.zeros(1), np.array([[2.0]]))
    true = 2.0 * special.ndtr(-3.0)
    branches = far_branches(form, 9.0, np.array([3.0]), true, above=True)
    draws = Draws(lambda z: (z[:, 0] ** 2,), np.vstack([[3.0], branches]), 1)
    found = corrected_tail(draws, form, true, 9.0, above=True, accuracy=0.1, most=4000)
    assert abs(branches[0, 0]) == pytest.approx(3.0) and found.probability == pytest.approx(true, rel=1e-12)


def test_unlikely_branches_have_no_samples() -> None:
    form = QuadraticForm(0.0, np.array([1.0, 0.0]), np.array([[0.02, 0.0], [0.0, -0.5]]))
    plane = QuadraticForm(0.0, np.ones(2), np.zeros((2, 2)))
    assert far_branches(form, 3.0, np.array([2.9, 0.0]), 1e-3, above=True).shape == (
        0,
        2,
    )  # 103 standard deviations out
    assert len(far_branches(form, -3.0, np.array([0.0, 3.5]), 1e-3, above=False)) == 1
    assert far_branches(form, -1.0, np.array([-1.0, 0.0]), 0.8, above=True).shape == (0, 2)  # the mean is within
    assert far_branches(plane, 3.0, np.full(2, 1.5), 0.01, above=True).shape == (0, 2)
