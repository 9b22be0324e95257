"""Runs that start where a slope of a formula is zero times infinity, and names of formulas without a slope."""

from __future__ import annotations

import numpy as np
import pytest

import eomgen
from eomgen.symbolic.evaluate import evaluate
from tests.simulation.rails import built, on_rail

DRAG, GRAVITY, END = 0.3, 9.81, 2.0


def falling(size: str, method: str) -> eomgen.Model:
    """Return a body that is let go from rest; ``size`` is the norm of its velocity."""
    builder = eomgen.SceneBuilder("drop", gravity=[0, 0, -GRAVITY]).body("b", 1.0, inertia=[0.1, 0.1, 0.1])
    builder.joint("f", "free", "base", "b").point("o", "b", [0, 0, 0]).output("speed", formula="velocity.o[2]")
    return built(
        builder.force("drag", "b", force=[f"-{DRAG}*velocity.here[{k}]*{size}" for k in range(3)]), method=method
    )


NORM = "sqrt(velocity.here[0]**2 + velocity.here[1]**2 + velocity.here[2]**2)"


@pytest.mark.slow_except("rosenbrock")
@pytest.mark.parametrize("method", ["generalized_alpha", "rk4", "rosenbrock", "tdg1", "corrected_predictor", "taylor"])
def test_quadratic_drag_from_rest(method: str) -> None:
    """v = -sqrt(g/c) tanh(sqrt(g c) t)."""
    run = falling(NORM, method).simulate(END, 0.01)
    exact = -np.sqrt(GRAVITY / DRAG) * np.tanh(np.sqrt(GRAVITY * DRAG) * END)
    assert run.success, run.message
    assert run.outputs["speed"][-1] == pytest.approx(exact, abs=1e-4)


def test_quotient_without_a_value_is_named() -> None:
    run = falling(f"1/{NORM}", "rk4").simulate(0.1, 0.01)
    assert not run.success
    assert "1 / sqrt(velocity.here[0]" in run.message
    assert "may have no value there" in run.message


@pytest.mark.slow
def test_root_without_a_slope_is_named() -> None:
    """From q = 0 the tangent of sqrt(q) is vertical."""
    run = built(on_rail("1 + sqrt(q.x)"), method="rosenbrock").simulate(0.1, 0.01)
    assert "; sqrt(q.x) may have no slope there" in run.message


def test_formulas_of_fixed_numbers_are_decided_or_refused_as_they_are_derived() -> None:
    def derived(law: str) -> eomgen.System:
        builder = on_rail(law).parameter("a", 1.0).curve("c", points=[[0, 0], [1, 1]])
        return eomgen.derive(builder.definition("twice", "2 * t").build(), ["force"])

    system = derived("1 / (1 - a) if a > 1 else 3 * twice")
    assert evaluate(system.tape, system.functions["force"].refs, {"t": [0.7]}) == pytest.approx([4.2])
    for law, text in (
        ("sqrt(a - 3)", r"sqrt\(-2\) in a formula has no finite value for any state"),
        ("q.x / (a - 1)", r"div\(\.\.\., 0\) in a formula has no finite value for any state"),
        ("c(a + 1)", "the curve c has no value at 2"),
    ):
        with pytest.raises(eomgen.EomgenError, match=text):
            derived(law)
