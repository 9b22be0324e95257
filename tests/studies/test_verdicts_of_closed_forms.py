"""The verdict on one closed form: the worst entry by its tolerance, its name, and errors over a ladder of steps."""

from __future__ import annotations

import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from eomgen.products.studies.verification import check
from eomgen.products.studies.verification.differences import LADDER

CLAIM = cast(Any, SimpleNamespace(rows=("force", "lift"), columns=("q.a", "q.b", "q.c")))
AT = cast(Any, SimpleNamespace(claim=CLAIM, names=("start", "later")))
MISALIGNED = Path(__file__).parents[2] / "examples" / "misaligned_four_bar" / "scene.toml"


def test_the_worst_entry_is_the_one_farthest_beyond_its_tolerance() -> None:
    value, expected, allowed = np.zeros((2, 2, 3)), np.zeros((2, 2, 3)), np.ones((2, 2, 3))
    every = np.ones((2, 2, 3), dtype=bool)

    def worst(**more: Any) -> list[Any]:
        given = {"counted": every, "value": value, "expected": expected, "allowed": allowed} | more
        return check._worst(AT, *given.values(), "complex step")

    expected[0, 1, 1] = 1.0
    assert worst() == []  # as large as the tolerance
    expected[0, 1, 1], expected[1, 0, 2], allowed[1, 0, 2] = 5.0, 3.0, 0.5
    (found,) = worst()
    assert (found.state, found.entry, found.value, found.expected) == ("later", "force along q.c", 0.0, 3.0)
    assert (found.by, found.bar) == ("complex step", 0.5)
    counted = every.copy()
    counted[1, 0, 2] = False
    (found,) = worst(counted=counted)
    assert (found.state, found.entry, found.expected) == ("start", "lift along q.b", 5.0)
    expected[:] = math.nan
    assert worst() == []
    assert check._worst(AT, every[:0], *[np.zeros((0, 2, 3))] * 3, "") == []


def test_largest_differences_are_parts_of_the_sizes_of_their_states() -> None:
    difference = np.array([[[1.0, -4.0]], [[30.0, 2.0]], [[math.nan, math.inf]]])
    sizes = cast(Any, SimpleNamespace(state=np.array([[[2.0]], [[10.0]], [[1.0]]])))
    assert check._largest(difference, sizes, np.array([True, True, True])) == 3.0
    assert check._largest(difference, sizes, np.array([True, False, True])) == 2.0
    assert check._largest(difference, sizes, np.array([False, False, True])) is None


def test_errors_over_steps_fall_with_their_order_down_to_rounding() -> None:
    """Of errors that fall by the square of the step to 1e-10, and rise by rounding from there on."""
    size = len(LADDER)
    steps = np.asarray(LADDER, float)
    errors = 1e-2 * (steps / steps[0]) ** 2 + 1e-14 / steps
    best, step, slope = check._best(errors)
    least = int(np.argmin(errors))
    assert (best, step) == (errors[least], steps[least]) and slope == pytest.approx(2.0, abs=0.02)
    nothing = np.full(size, math.nan)
    assert check._best(nothing) == (None, None, None)
    rounding = np.full(size, 1e-12)
    assert check._best(rounding)[2] is None
    with_gap = errors.copy()
    with_gap[0] = math.nan
    assert check._best(with_gap)[2] == pytest.approx(2.0, abs=0.02)
    bent = errors.copy()
    bent[1] = bent[0]  # a bend that the largest steps go over
    assert check._best(bent)[2] == pytest.approx(2.0, abs=0.02)


@pytest.mark.long
def test_sums_of_large_accelerations_are_known_to_the_rounding_of_their_summands() -> None:
    """Near a singular position accelerations are 1e13 times the sum B a + g of them."""
    assert check.check(MISALIGNED, only=["constraint_acceleration"], seed=3, profile="quick").passed
