"""Formulas of time with transitions in place of jumps and kinks, and formulas with numbers in place of symbols."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from eomgen.errors import EomgenError
from eomgen.formula.curves import Curve
from eomgen.formula.discontinuities import smooth_law
from eomgen.formula.nodes import Application, Formula, Number, Symbol
from eomgen.formula.recording import law_and_rate
from eomgen.formula.substitution import substitute
from eomgen.scene.formula.namespaces import SceneNames
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import MOTION, PARAMETERS

NAMES = SceneNames(parameters={"a": False, "b": True})
DURATION = 0.1


def law(text: str) -> Formula:
    return read_formula(text, NAMES, MOTION)


def over(formula: Formula, times: Any) -> Any:
    return law_and_rate(formula, {"a": 0.5, "b": 2.0})(np.asarray(times, dtype=float))[0]


def at(formula: Formula, time: float) -> float:
    return float(over(formula, [time])[0])


def fixed(symbol: Symbol) -> float | None:
    return 0.5 if symbol.name == "a" else None


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("sign(t - 1)", [1.0]),
        ("sign(a - t) * t", [0.5]),
        ("abs(2 * t - 3)", [1.5]),
        ("abs(3 - 2 * t) + t**2", [1.5]),
        ("min(t, 5 - 3 * t)", [1.25]),
        ("max(t, 5 - 3 * t)", [1.25]),
        ("max(5 - 3 * t, t)", [1.25]),
        ("3 if t < 1 else 5", [1.0]),
        ("t if 2 * t <= 3 else 5 - t", [1.5]),
        ("2 if t > 1 and t < 2 else 0", [1.0, 2.0]),
        ("sin(t) if t < 1 or t > 2 else 4", [1.0, 2.0]),
        ("1 if not t < 1 else 0", [1.0]),
    ],
)
def test_laws_are_the_same_outside_of_transitions_and_smooth_within(text: str, times: list[float]) -> None:
    rough = law(text)
    smooth = smooth_law(rough, DURATION, fixed)
    every = np.linspace(0.0, 3.0, 3001)
    within = np.zeros(len(every), dtype=bool)
    for time in times:
        within |= (every > time - 1e-12) & (every < time + DURATION)
    old, new = over(rough, every), over(smooth, every)
    np.testing.assert_allclose(new[~within], old[~within], rtol=1e-14, atol=1e-14)
    for order, largest in ((1, 60.0), (2, 6e3)):  # a jump of values would be a slope of 1000 times the jump, and so on
        assert np.max(np.abs(np.diff(new, order))) * 1000**order < largest * np.max(np.abs(old))
    third = np.diff(new, 3) * 1000.0**3
    assert np.max(np.abs(third)) < 1e6 * np.max(np.abs(old))


def test_transitions_pass_the_middle_in_their_middle() -> None:
    for text, time in (("sign(t - 1)", 1.0), ("sign(1 - t)", 1.0), ("1 if t < 1 else -1", 1.0)):
        smooth = smooth_law(law(text), DURATION, fixed)
        assert at(smooth, time + 0.5 * DURATION) == pytest.approx(0.0, abs=1e-13)
        assert abs(at(smooth, time + 0.25 * DURATION)) > 0.7


def test_laws_without_jumps_are_kept() -> None:
    for text in ("sin(t)", "abs(a) * t", "sign(b)", "max(a, b) + t", "t if a < b else 2 * t"):
        formula = law(text)
        assert smooth_law(formula, DURATION, fixed) == formula or "if" in text
    curve = Curve("c", np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0]), "quintic", "hold")
    used = Application(curve, law("t + abs(t - 1)"))
    smooth = smooth_law(used, DURATION, fixed)
    assert smooth != used and at(smooth, 0.5) == at(used, 0.5) and at(smooth, 1.7) == at(used, 1.7)


@pytest.mark.parametrize(
    "text", ["sign(sin(t))", "abs(t**2 - 1)", "sign(t - b)", "max(t, exp(t))", "1 if t * t < 2 else 0"]
)
def test_times_that_are_not_known_are_refused(text: str) -> None:
    with pytest.raises(EomgenError, match="the times are not known beforehand at which"):
        smooth_law(law(text), DURATION, fixed)


def known(symbol: Symbol) -> float | None:
    return {"a": 2.0}.get(symbol.name)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a**2 + 1", 5.0),
        ("1 / (a - 2) if a < 1 else 7", 7.0),  # the branch that is not taken has no value
        ("7 if a < 3 else 1 / (a - 2)", 7.0),
        ("b + a", None),
        ("b if a < 1 else a", 2.0),
    ],
)
def test_numbers_take_the_place_of_symbols(text: str, expected: float | None) -> None:
    formula = read_formula(text, NAMES, PARAMETERS)
    made = substitute(formula, known)
    if expected is None:
        assert made == read_formula("b + 2", NAMES, PARAMETERS)
    else:
        assert made == Number(expected)


def test_branches_stay_if_their_condition_does() -> None:
    made = substitute(read_formula("a if b < 1 else a + 1", NAMES, PARAMETERS), known)
    assert made == read_formula("2 if b < 1 else 3", NAMES, PARAMETERS)


def test_curves_of_numbers_are_numbers() -> None:
    curve = Curve("c", np.array([0.0, 1.0, 2.0]), np.array([0.0, 3.0, -1.0]), "linear", "hold")
    for derivative, expected in ((0, 1.0), (1, -4.0)):
        used = Application(curve, read_formula("a - 0.5", NAMES, PARAMETERS), derivative)
        assert substitute(used, known) == Number(expected)
        assert substitute(used, lambda symbol: None) == used
    other: Any = Application(curve, read_formula("a + b", NAMES, PARAMETERS))
    assert substitute(other, known).argument == read_formula("2 + b", NAMES, PARAMETERS)  # type: ignore[union-attr]
