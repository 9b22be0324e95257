"""Formulas of time: bumps on the tape, times from which a formula has no value, breakpoints within a run."""

from __future__ import annotations

import math

import numpy as np
import pytest

from eomgen.formula.curves import Bump
from eomgen.formula.discontinuities import Breakpoint
from eomgen.formula.integration import Integration
from eomgen.formula.motion_faults import undefined_from
from eomgen.formula.nodes import ZERO, Application, Symbol
from eomgen.formula.recording import law_and_rate
from eomgen.scene.formula.namespaces import SceneNames
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import MOTION

NAMES = SceneNames(parameters={"a": True})
BUMP = Bump("b", 0.5, 1.7, 0.3)
TIMES = np.linspace(-0.2, 3.0, 65)


@pytest.mark.parametrize("derivative", [0, 1, 2, 3])
def test_bumps_on_the_tape_are_the_bumps_and_their_slopes_the_next_ones(derivative: int) -> None:
    value, rate = law_and_rate(Application(BUMP, Symbol("time"), derivative), {})(TIMES)
    np.testing.assert_allclose(value, BUMP(TIMES, derivative), rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(rate, BUMP(TIMES, derivative + 1), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "first"),
    [
        ("sqrt(2 - t)", 2.0),
        ("log(a - t)", 3.0),
        ("t + sqrt(sin(t))", math.pi),
        ("(1.25 - t)**0.5", 1.25),
        ("asin(t / 4)", 4.0),
        ("1 / (t - 1)", None),
        ("sqrt(t)", None),
        ("log(1 + t)", None),
        ("sqrt(-1 - t)", 0.0),
    ],
)
def test_times_from_which_a_formula_has_no_value(text: str, first: float | None) -> None:
    found = undefined_from(read_formula(text, NAMES, MOTION), (("a", 3.0),), 0.0, 5.0)
    assert found == (None if first is None else pytest.approx(first, abs=1e-12))


@pytest.mark.parametrize(
    ("time", "period", "within"),
    [
        (0.7, 0.0, [0.7]),
        (2.0, 0.0, []),
        (0.0, 0.0, []),
        (0.25, 0.5, [0.25, 0.75, 1.25, 1.75]),
        (-3.9, 1.0, [0.1, 1.1]),
        (5.3, 1.0, [0.3, 1.3]),
        (4.0, 2.0, []),
    ],
)
def test_breakpoints_within_a_run(time: float, period: float, within: list[float]) -> None:
    integration = Integration("base.acceleration[0]", {}, frozenset(), 2.0, False)
    found = [*integration._within(Breakpoint(time, period, 0, 0.0))]
    np.testing.assert_allclose(found, within, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "displacement"),
    [
        ("3", lambda t: 1.5 * t**2),
        ("a * t", lambda t: 0.5 * t**3),
        ("2 * sin(3 * t)", lambda t: 2 / 3 * t - 2 / 9 * np.sin(3 * t)),
        ("exp(-t) + t**2", lambda t: np.exp(-t) + t - 1 + t**4 / 12),
        ("sign(sin(4 * t))", None),
        ("1 if t < 0.5 else -1", lambda t: np.where(t < 0.5, t**2 / 2, -(t**2) / 2 + t - 0.25)),
    ],
)
def test_second_integrals_of_accelerations(text: str, displacement: object) -> None:
    integration = Integration("base.acceleration[0]", {"a": 3.0}, frozenset({"a"}), 2.0, False)
    made = integration.integral(read_formula(text, NAMES, MOTION))
    times = np.linspace(0.0, 2.0, 41)
    value, rate = law_and_rate(made.formula, {"a": 3.0})(times)
    assert made.formula != ZERO and abs(value[0]) < 1e-50 and abs(rate[0]) < 1e-25
    if displacement is not None:
        np.testing.assert_allclose(value, displacement(times), rtol=1e-9, atol=1e-10)  # type: ignore[operator]
