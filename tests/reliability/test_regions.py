"""Tails with several regions against probabilities in closed form: no model is compiled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy import integrate, special

from eomgen.base.arrays import Array
from eomgen.errors import NumericalError
from eomgen.products.reliability.tails import most_probable_point
from eomgen.products.reliability.tails.distribution import Draws
from eomgen.products.reliability.tails.most_probable_point import (
    all_centres,
    draws_about,
    points_on_curve,
    searched_points,
)
from eomgen.products.reliability.tails.quadratic_form import ResponseExpansion
from eomgen.products.reliability.vibration.distributions import at_points, correct_by_samples, further_points, spread
from eomgen.products.reliability.vibration.result import Distribution

SEEDS = 6


class Response:
    """A function of z (m, n), with derivatives by differences."""

    def __init__(self, size: int, function: Callable[[Array], Array]) -> None:
        self.size, self.values = size, function

    def gradient(self, point: Array) -> tuple[float, Array]:
        steps = 1e-6 * np.eye(self.size)
        ahead, behind = self.values(point + steps), self.values(point - steps)
        return float(self.values(point[None])[0]), (ahead - behind) / 2e-6

    def expansion(self, point: Array) -> ResponseExpansion:
        steps = 1e-4 * np.eye(self.size)
        rows = [(self.gradient(point + one)[1] - self.gradient(point - one)[1]) / 2e-4 for one in steps]
        return ResponseExpansion(*self.gradient(point), 0.5 * (np.array(rows) + np.array(rows).T))


def product_above(threshold: float) -> float:
    """Return P(x y > threshold) of two normal variables: K0 is the density of their product, times pi."""
    return float(integrate.quad(special.k0, threshold, 60.0, epsabs=0.0)[0]) / np.pi


PLANES = special.ndtr(-np.array([3.5, 3.6, 3.7]))
CASES = {
    "three planes of twenty variables": (
        Response(
            20, lambda z: np.max(np.array([z[:, 0] - 3.5, -z[:, 1] - 3.6, (z[:, 2] + z[:, 3]) / 2**0.5 - 3.7]), 0)
        ),
        1.0 - np.prod(1.0 - PLANES),
    ),
    "a product, without slope at the mean": (Response(2, lambda z: z[:, 0] * z[:, 1] - 6.0), product_above(6.0)),
    "the size of a product, four regions": (
        Response(2, lambda z: np.abs(z[:, 0] * z[:, 1]) - 9.0),
        2.0 * product_above(9.0),
    ),
    "a corner, where slopes jump": (
        Response(2, lambda z: np.minimum(z[:, 0] - 2.2, z[:, 1] - 2.6)),
        special.ndtr(-2.2) * special.ndtr(-2.6),
    ),
    "all directions": (Response(2, lambda z: np.sum(z**2, axis=1) - 16.0), np.exp(-8.0)),
    "a plane beside a half as likely one": (
        Response(3, lambda z: np.maximum(z[:, 0] - 4.0, -0.6 * z[:, 0] + 0.8 * z[:, 1] - 4.15)),
        special.ndtr(-4.0) + special.ndtr(-4.15),
    ),
}


def tail_of(response: Response, seed: int) -> tuple[Distribution, list[str]]:
    """Return the distribution at 0, with notes, as a study of random vibration finds it."""
    points, missed = points_on_curve(response, [0.0], lambda: True)
    if missed and (found := searched_points(response, 0.0, 2, seed)):
        points[0] = found[0]
    reached, none = list(points.values()), np.full(1, np.nan)
    others, _ = further_points(response, reached, seed) if reached else ({}, [])
    forms = spread(at_points(reached)["quadratic"], [0], 1) if reached else Distribution(none, none, none, none)
    about_mean = Draws(lambda z: (response.values(z),), np.zeros(response.size), seed + 1)
    return correct_by_samples(response, np.zeros(1), points, forms, about_mean, others, seed)


@pytest.mark.parametrize("name", CASES)
def test_intervals_hold_the_probability_of_all_regions(name: str) -> None:
    response, true = CASES[name]
    held = 0
    for seed in range(SEEDS):
        found, _ = tail_of(response, seed)
        assert found.above[0] == pytest.approx(true, rel=0.4)
        held += bool(1.0 - found.high[0] <= true <= 1.0 - found.low[0])
    assert held >= SEEDS - 1


def corner(z: Array) -> Array:
    """Positive for a first coordinate above 3, and for a second one below -3.2."""
    return np.asarray(np.maximum(z[:, 0] - 3.0, -z[:, 1] - 3.2))


@pytest.mark.parametrize(("sign", "above"), [(1.0, True), (-1.0, False)])
@pytest.mark.parametrize("known", [[], [[3.0, 0.0]]])
def test_samples_lead_to_centres_of_all_regions(sign: float, above: bool, known: list[list[float]]) -> None:
    response = Response(2, lambda z: 7.0 + sign * corner(z))
    found, draws = all_centres(response, [np.array(point) for point in known], 7.0, above=above, seed=3)
    expected = np.array([[3.0, 0.0], [0.0, -3.2]])
    np.testing.assert_allclose(sorted(found.tolist(), reverse=True), expected, atol=1e-6)
    assert draws is not None
    z, y = draws.first(1000)
    probability = float(np.mean(draws.weights(z) * ((y > 7.0) == above)))
    true = 1.0 - special.ndtr(3.0) * special.ndtr(3.2)
    assert probability == pytest.approx(true, rel=0.25)


def test_a_place_on_the_ray_stands_for_a_point_that_derivatives_do_not_find() -> None:
    """The first of 21 places to (3, 4) whose first coordinate is above 2."""
    response = Response(2, lambda z: z[:, 0])
    response.gradient = failing  # type: ignore[method-assign]
    found = most_probable_point._nearest(response, np.array([3.0, 4.0]), 2.0, above=True)
    np.testing.assert_allclose(found, np.array([3.0, 4.0]) * 15.0 / 21.0, rtol=1e-12)
    own = most_probable_point._nearest(Response(2, lambda z: z[:, 0]), np.array([3.0, 4.0]), 2.0, above=True)
    np.testing.assert_allclose(own, [2.0, 0.0], atol=1e-9)
    below = most_probable_point._nearest(Response(2, lambda z: z[:, 0]), np.array([-3.0, 4.0]), -2.5, above=False)
    np.testing.assert_allclose(below, [-2.5, 0.0], atol=1e-9)


def failing(point: Array) -> tuple[float, Array]:
    raise NumericalError("no derivatives")


@pytest.mark.slow
def test_a_probability_whose_samples_are_too_unequal_is_not_given() -> None:
    """The point at 3 has hardly a share in P(x_1 + 3 > 0.15 |x_2, ..|^2), which is all about other places."""
    response = Response(60, lambda z: z[:, 0] + 3.0 - 0.15 * np.sum(z[:, 1:] ** 2, axis=1))
    found, notes = tail_of(response, 0)
    draws = np.random.default_rng(0).standard_normal((200_000, 60))
    true = float(np.mean(response.values(draws) > 0.0))
    assert np.isnan(found.above[0]) or 1.0 - found.high[0] <= true <= 1.0 - found.low[0]
    assert np.isfinite(found.above[0]) or "no `corrected` probability of 0" in notes[-1]


def test_weights_of_samples_of_several_deviations_have_the_mean_one() -> None:
    draws = draws_about(lambda z: (z[:, 0],), np.array([[3.0, 1.0], [-2.0, 2.0]]), 4)
    z, _ = draws.first(20_000)
    weights = draws.weights(z)
    assert weights.mean() == pytest.approx(1.0, abs=0.03)
    assert (weights * z[:, 1] ** 2).mean() == pytest.approx(1.0, abs=0.06)
    np.testing.assert_allclose(draws.shares(z[:50]).sum(axis=1), 1.0, rtol=1e-12)
