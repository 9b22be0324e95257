"""Skyhook and clipped damping: the law of the literature, what a damper can do, and round corners."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.errors import UsageError
from tests.oracles.semi_active import clipped, skyhook

BODY, WHEEL = (grid.ravel() for grid in np.meshgrid(np.linspace(-1, 1, 41), np.linspace(-1, 1, 39)))


def test_the_law_of_the_literature() -> None:
    """F = c z_s' if z_s' (z_s' - z_u') > 0 else 0."""
    F = clipped(skyhook(BODY, WHEEL, 2000.0), BODY - WHEEL)
    for force, body, wheel in zip(F, BODY, WHEEL, strict=True):
        assert force == (2000.0 * body if body * (body - wheel) > 0.0 else 0.0)


def test_groundhook_holds_the_wheel() -> None:
    assert skyhook(0.3, 0.5, 2000.0, 400.0) == pytest.approx(600.0 - 200.0)


@pytest.mark.parametrize("width", [0.0, 1e-3, 0.1])
def test_the_damper_stays_a_damper(width: float) -> None:
    rate = BODY - WHEEL
    F = clipped(skyhook(BODY, WHEEL, 2000.0, 500.0), rate, 300.0, 3000.0, width)
    moving = np.abs(rate) > 1e-9
    coefficient = F[moving] / rate[moving]
    assert coefficient.min() >= 300.0 * (1 - 1e-12) and coefficient.max() <= 3000.0 * (1 + 1e-12)
    assert np.all(F[~moving] == 0.0) or np.abs(F[~moving]).max() < 1e-9 * 3000.0


def test_it_is_the_nearest_that_a_damper_can_do() -> None:
    """Every other coefficient within the limits is farther from what is wanted."""
    wanted, rate = skyhook(BODY, WHEEL, 2000.0), BODY - WHEEL
    best = np.abs(clipped(wanted, rate, 300.0, 3000.0) - wanted)
    others = [np.abs(c * rate - wanted) for c in np.linspace(300.0, 3000.0, 200)]
    assert np.all(best <= np.min(others, axis=0) + 1e-9)
    assert np.all(best >= np.min(others, axis=0) - 14.0 * np.abs(rate))  # a grid of 13.6 N s/m


def test_round_corners_become_sharp() -> None:
    wanted, rate = skyhook(BODY, WHEEL, 2000.0), BODY - WHEEL
    sharp = clipped(wanted, rate, 300.0, 3000.0)
    errors = [np.abs(clipped(wanted, rate, 300.0, 3000.0, width) - sharp).max() for width in (1e-2, 1e-3, 1e-4)]
    assert errors[0] > errors[1] > errors[2] and errors[2] < 1.0


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        ((300.0, 200.0, 0.0), "the damping cannot lie between 300 and 200"),
        ((-1.0, 200.0, 0.0), "the damping cannot lie between -1 and 200"),
        ((0.0, np.inf, 0.1), "a width of 0.1 m/s needs a finite maximum and must not be negative"),
        ((0.0, 100.0, -0.1), "a width of -0.1 m/s needs a finite maximum and must not be negative"),
    ],
)
def test_limits_that_cannot_be(limits: tuple[float, float, float], message: str) -> None:
    with pytest.raises(UsageError) as caught:
        clipped(1.0, 1.0, *limits)
    assert caught.value.problems[0].what == message
