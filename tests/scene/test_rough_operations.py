"""Operations that may have no derivative are named by text: two of them, and the number of the others."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.formula.features import Feature, rough_operations
from eomgen.formula.nodes import Number, Operation, Symbol
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import EVERYTHING, SceneNames

NAMES = SceneNames(parameters={"k": True}, inputs=("torque",), joints={"hinge": "revolute"})


def _named(*texts: str) -> str:
    return rough_operations(read_formula(text, NAMES, EVERYTHING) for text in texts)


@pytest.mark.parametrize("count", range(6))
def test_two_are_named_and_the_others_counted(count: int) -> None:
    found = _named(*(f"sqrt(q.hinge + {number})" for number in range(3, 3 + count)))
    named = [f"sqrt(q.hinge + {number})" for number in range(3, 3 + min(count, 2))]
    assert found == ", ".join(named) + (f" and {count - 2} more" if count > 2 else "")


def test_the_same_operation_is_named_once() -> None:
    assert _named("sqrt(t)", "2*sqrt(t)", "1 + sqrt(t)") == "sqrt(t)"


@pytest.mark.parametrize(
    "text", ["sqrt(k)", "q.hinge**2", "q.hinge**1", "sin(q.hinge)", "k**0.5", "exp(q.hinge)", "sqrt(2)*t"]
)
def test_operations_with_a_derivative_or_of_parameters_alone_are_not_named(text: str) -> None:
    assert _named(text) == ""


@pytest.mark.parametrize(
    "text", ["q.hinge**0.5", "q.hinge**k", "log(v.hinge)", "asin(t)", "acos(torque)", "atan2(q.hinge, v.hinge)"]
)
def test_roots_logarithms_powers_and_angles_of_moving_quantities_are_named(text: str) -> None:
    assert _named(f"sin(1 + {text})") != ""


def test_quantities_at_the_place_of_a_load_are_named_as_they_are_written() -> None:
    arguments = (Symbol("local", "velocity", 1), Symbol("local", "velocity", 0))
    assert rough_operations([Operation("atan2", arguments)]) == "atan2(velocity.here[1], velocity.here[0])"


@pytest.mark.parametrize(("low", "high"), [(-10.6, 10.4), (-30.0, -9.0), (2.3, 2.4), (5.25, 5.25)])
def test_places_of_a_period_are_found_on_both_sides_of_zero(low: float, high: float) -> None:
    feature = Feature(Number(0.0), np.array([0.25, 0.5]), period=1.0)
    every = np.sort(np.add.outer(np.arange(-40, 40), [0.25, 0.5]), axis=None)
    inside = every[(every >= low) & (every <= high)]
    np.testing.assert_array_equal(feature.between(low, high, 1000), inside)
    np.testing.assert_array_equal(feature.between(low, high, 3), inside[:3])
