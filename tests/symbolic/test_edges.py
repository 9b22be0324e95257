"""Derivatives of formulas at points where an operation is singular, on the tape: against one-sided differences."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from eomgen.formula.recording import record
from eomgen.scene.formula.parser import read_formula
from eomgen.scene.formula.scope import EVERYTHING, SceneNames
from eomgen.symbolic.calculus.jets import jets
from eomgen.symbolic.calculus.partials import forward_partials, gradient, jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.scalar import Algebra, Scalar
from eomgen.symbolic.series import Series, SeriesTerm, record_series
from eomgen.symbolic.tape import ONE, ZERO, Tape
from tests.oracles.edge_formulas import EDGES, EdgeFormula

NAMES = SceneNames(inputs=("x", "y"))
EXACT = 1e-9  # of differences at 60 digits, a thousand times


def recorded(text: str):
    """Return the tape of a formula, x and y, and the value."""
    tape = Tape()
    x, y = (tape.input(name) for name in "xy")
    value = record(
        Algebra(tape), read_formula(text, NAMES, EVERYTHING), lambda symbol: Scalar(tape, {"x": x, "y": y}[symbol.name])
    )
    return tape, x, y, value.ref


def at(tape: Tape, refs, edge: EdgeFormula):
    with np.errstate(all="ignore"):
        return evaluate(tape, refs, {"x": edge.x, "y": edge.y})


@pytest.mark.parametrize("edge", EDGES, ids=lambda edge: f"{edge.text} at {edge.x}")
def test_derivatives_forward_reverse_and_mixed(edge):
    tape, x, y, value = recorded(edge.text)
    first_x, first_y, second = edge.derivatives()
    forward = forward_partials(tape, [value], {x: {0: ONE}, y: {1: ONE}})[0]
    reverse = gradient(tape, value, [x, y])
    weighted = gradient(tape, tape.mul(tape.input("w"), value), [x, y])  # as Hessians take it
    assert at(tape, [forward.get(0, ZERO), forward.get(1, ZERO)], edge) == pytest.approx(
        [first_x, first_y], abs=EXACT, rel=EXACT
    )
    assert at(tape, reverse, edge) == pytest.approx([first_x, first_y], abs=EXACT, rel=EXACT)
    seconds = [
        *jacobian_vector(tape, [forward.get(0, ZERO)], {x: ONE}),
        *jacobian_vector(tape, [reverse[0]], {x: ONE}),
        gradient(tape, forward.get(0, ZERO), [x])[0],
        gradient(tape, reverse[0], [x])[0],
        *jacobian_vector(tape, [weighted[0]], {x: ONE}),
    ]
    with np.errstate(all="ignore"):
        values = evaluate(tape, seconds, {"x": edge.x, "y": edge.y, "w": 1.0})
    assert values == pytest.approx([second] * len(seconds), abs=EXACT, rel=EXACT)


@pytest.mark.parametrize("edge", EDGES, ids=lambda edge: f"{edge.text} at {edge.x}")
def test_derivatives_in_time(edge):
    """Along x + a t, y + b t: the rate is the gradient times the rates, and the second rate has no NaN."""
    tape, x, y, value = recorded(edge.text)
    first_x, first_y, second = edge.derivatives()
    a, b = tape.input("a"), tape.input("b")
    coefficients = jets(tape, [value], {x: [x, a], y: [y, b]}, 2)[0]
    with np.errstate(all="ignore"):
        along = evaluate(tape, coefficients, {"x": edge.x, "y": edge.y, "a": -0.7, "b": 0.3})
        alone = evaluate(tape, coefficients, {"x": edge.x, "y": edge.y, "a": -0.7, "b": 0.0})
    assert along[1] == pytest.approx(-0.7 * first_x + 0.3 * first_y, abs=EXACT, rel=EXACT)
    assert np.isfinite(along).all()
    assert alone[2] == pytest.approx(0.5 * 0.49 * second, abs=EXACT, rel=EXACT)


#: Powers are exponentials of logarithms in these recurrences, which start at no base of 0.
SERIES = [edge for edge in EDGES if "**y" not in edge.text and edge.text != "x**2.5"]


@pytest.mark.parametrize("edge", SERIES, ids=lambda edge: f"{edge.text} at {edge.x}")
def test_recurrence_of_taylor_coefficients(edge):
    source, x, y, value = recorded(edge.text)
    first_x, first_y, _ = edge.derivatives()
    tape = Tape()
    series = Series(tape)
    rates = {"x": tape.input("a"), "y": tape.input("b")}
    given = {source.symbol(ref): SeriesTerm(tape.input(name), rates[name]) for ref, name in ((x, "x"), (y, "y"))}
    term = record_series(series, source, [value], given, {})[0]
    state = {"x": edge.x, "y": edge.y, "a": -0.7, "b": 0.3, "sums": np.zeros(40), "order": [1.0, 1.0, 0.0, 1.0]}
    with np.errstate(all="ignore"):
        kept = evaluate(tape, series.kept, state) if series.kept else np.zeros(0)
        sides = {"left": series.left, "right": series.right}
        rows = {name: evaluate(tape, [part.value for part in parts], state) for name, parts in sides.items() if parts}
        first = evaluate(tape, [term.next], {**state, **rows, "kept": kept})[0]
    assert first == pytest.approx(-0.7 * first_x + 0.3 * first_y, abs=EXACT, rel=EXACT)


def test_slopes_that_are_infinite_stay_infinite():
    for text, order in (("sqrt(x)", 1), ("x**1.5", 2), ("asin(1 - x)", 1), ("sqrt(x*y)", 1)):
        tape, x, _, value = recorded(text)
        slope = value
        for _ in range(order):
            slope = jacobian_vector(tape, [slope], {x: ONE})[0]
        assert not np.isfinite(at(tape, [slope], EdgeFormula(text, 0.0))[0]), text


def test_derivatives_through_a_loop_in_a_branch_that_is_not_taken():
    tape, kernel = Tape(), Tape()
    x = tape.input("x")
    root = kernel.call(Op.SQRT, kernel.input("gather"))
    loop = Map(kernel, 3, gather=((x, tape.mul(x, x), tape.sub(x, ONE)),), sums=(root,))
    value = tape.select(tape.call(Op.LT, ONE, x), add_map(tape, loop).sums[0], ZERO)
    for slope in (gradient(tape, value, [x])[0], jacobian_vector(tape, [value], {x: ONE})[0]):
        curvature = [jacobian_vector(tape, [slope], {x: ONE})[0], gradient(tape, slope, [x])[0]]
        with np.errstate(all="ignore"):
            assert evaluate(tape, [slope, *curvature], {"x": 0.0}).tolist() == [0.0, 0.0, 0.0]
        at_two = [mpmath.diff(lambda x: mpmath.sqrt(x) + x + mpmath.sqrt(x - 1), 2, k) for k in (1, 2)]
        assert evaluate(tape, [slope, *curvature], {"x": 2.0}) == pytest.approx(
            [float(at_two[0]), float(at_two[1]), float(at_two[1])], rel=1e-12
        )


def test_norms_cost_two_selections_and_positive_roots_none():
    for text, selections in (("sqrt(x**2 + y**2)", 3), ("sqrt(x**2 + y**2 + 1e-6)", 0), ("sqrt(x + y)", 0)):
        tape, x, y, value = recorded(text)
        assert tape.counts(gradient(tape, value, [x, y])).selections == selections, text
