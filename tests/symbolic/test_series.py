"""The recurrence of coefficients, order by order, against jets on the tape and against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings

from eomgen.formula.curves import Curve
from eomgen.symbolic.calculus.jets import jets
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.series import KEPT, LEFT, ORDER, PREVIOUS, RIGHT, SUMS, Series, SeriesTerm, record_series
from eomgen.symbolic.tape import ONE, Tape
from tests.symbolic.random_tapes import EVERY, build, programs, record
from tests.symbolic.test_jets import ORDER as JET_ORDER
from tests.symbolic.test_jets import X, at, moving_inputs


def coefficients(source, outputs, paths, order, *, time=False):
    """Return the Taylor coefficients (order + 1, outputs) that the recurrence gives along paths of the inputs x, and
    how many products they need; ``time``: the first input is known to be linear."""
    tape = Tape()
    series = Series(tape, time=tape.input("x_k", 0) if time else None)
    inputs = {InputSymbol("x", k): SeriesTerm(tape.input("x", k), tape.input("x_k", k)) for k in range(len(paths))}
    terms = record_series(series, source, outputs, inputs, {})
    size = len(series.left)
    values = {"x": [path[0] for path in paths], "p": [1.3]}
    left, right = (np.zeros((order + 1, size)) for _ in range(2))
    left[0] = evaluate(tape, [term.value for term in series.left], values)
    right[0] = evaluate(tape, [term.value for term in series.right], values)
    kept = evaluate(tape, series.kept, values)
    previous = evaluate(tape, [term.value for term in series.previous], values)
    found = [evaluate(tape, [term.value for term in terms], values)]
    for k in range(1, order + 1):
        sums = sum((left[i] * right[k - i] for i in range(1, k)), np.zeros(size))
        blocks = {
            "x_k": [path[k] for path in paths], SUMS: sums, LEFT: left[0], RIGHT: right[0], KEPT: kept,
            PREVIOUS: previous, ORDER: [k, 1 / k, 1 / (k + 1), paths[0][1]],
        }  # fmt: skip  # blocks
        left[k] = evaluate(tape, [term.next for term in series.left], blocks)
        right[k] = evaluate(tape, [term.next for term in series.right], blocks)
        previous = evaluate(tape, [term.next for term in series.previous], blocks)
        found.append(evaluate(tape, [term.next for term in terms], blocks))
    return np.array(found), size


def by_jets(source, outputs, paths):
    found = jets(source, outputs, moving_inputs(source, len(paths)), JET_ORDER)
    return np.array([evaluate(source, jet, at(paths) | {"p": [1.3]}) for jet in found]).T


@pytest.mark.parametrize("op", EVERY)
def test_every_operation_is_that_of_jets(op):
    for paths in (X, X[::-1]):
        tape = Tape()
        x, y = tape.input("x", 0), tape.input("x", 1)
        output = record(tape, op, x, y)
        outputs = [output, tape.mul(output, x), tape.select(tape.call(Op.LT, x, y), output, y)]
        expected = by_jets(tape, outputs, paths)
        assert coefficients(tape, outputs, paths, JET_ORDER)[0] == pytest.approx(expected, rel=1e-12, abs=1e-14)


@settings(max_examples=50, deadline=None)
@given(programs)
def test_random_tapes_are_those_of_jets(program):
    paths = [
        [0.4, 0.3, -0.2, 0.1, 0.2, -0.1, 0.05],
        [-0.7, 0.2, 0.1, -0.3, 0.1, 0.0, 0.1],
        [1.1, -0.4, 0.2, 0.2, 0.0, 0.1, -0.1],
    ]
    tape, _, outputs = build(program)
    expected = by_jets(tape, outputs, paths)
    found, _ = coefficients(tape, outputs, paths, JET_ORDER)
    assert np.allclose(found, expected, rtol=1e-9, atol=1e-10 * (1 + np.abs(expected).max()))


def of_time():
    """Return a tape with functions of what is linear in the input 0, and of what is not."""
    tape = Tape()
    t, y, p = (tape.input("x", 0), tape.input("x", 1), tape.input("p", 0))
    phase = tape.sub(tape.mul(tape.mul(p, tape.constant(1.7)), t), tape.sub(p, tape.mul(t, tape.constant(0.3))))
    linear = [tape.call(op, phase) for op in (Op.SIN, Op.COS, Op.SINH, Op.COSH, Op.EXP)]
    x = np.linspace(-9.0, 9.0, 7)
    curve = Curve("hill", x, 3.0 / (1.0 + x**2))
    linear.append(tape.curve(curve, 0, tape.sub(tape.constant(0.1), phase)))
    return (
        tape,
        linear,
        [tape.call(Op.SIN, tape.mul(t, phase)), tape.mul(linear[0], y), tape.call(Op.EXP, tape.mul(t, y))],
    )


def test_functions_of_what_is_linear_in_time_need_no_product():
    tape, linear, others = of_time()
    paths = [[0.37, 0.5, *[0.0] * 5], X[1]]
    expected = by_jets(tape, [*linear, *others], paths)
    for outputs, columns, most in ((linear, slice(6), 0), ([*linear, *others], slice(None), 7)):
        found, products = coefficients(tape, outputs, paths, JET_ORDER, time=True)
        assert found == pytest.approx(expected[:, columns], rel=1e-12, abs=1e-14)
        assert products <= most < coefficients(tape, outputs, paths, JET_ORDER)[1]


@pytest.mark.parametrize("time", [False, True])
def test_closed_forms_of_high_order(time):
    order = 24
    tape = Tape()
    t = tape.input("x", 0)
    outputs = [
        tape.call(Op.EXP, t),
        tape.call(Op.SIN, t),
        tape.div(ONE, tape.sub(tape.constant(2.0), t)),
        tape.call(Op.LOG, t),
    ]
    start = 0.5
    found, _ = coefficients(tape, outputs, [[start, 1.0, *[0.0] * order]], order, time=time)
    k = np.arange(order + 1)
    factorial = np.array([math.factorial(n) for n in k], float)
    assert found[:, 0] == pytest.approx(np.exp(start) / factorial, rel=1e-14)
    assert found[:, 1] == pytest.approx(np.sin(start + k * np.pi / 2) / factorial, rel=1e-13, abs=1e-40)
    assert found[:, 2] == pytest.approx((2 - start) ** -(k + 1.0), rel=1e-13)
    assert found[1:, 3] == pytest.approx((-1.0) ** (k[1:] + 1) / (k[1:] * start ** k[1:]), rel=1e-12)


def test_what_does_not_vary_in_time_costs_no_product():
    series = Series(Tape())
    source = Tape()
    p, x = source.input("p", 0), source.input("x", 0)
    outputs = [source.mul(source.call(Op.COS, p), x), source.div(x, p), source.mul(p, p)]
    moving = {InputSymbol("x", 0): SeriesTerm(series.tape.input("x", 0), series.tape.input("x_k", 0))}
    terms = record_series(series, source, outputs, moving, {})
    assert series.left == []
    assert len(series.kept) == 2
    assert series.tape.depends_on([terms[0].next]) == {InputSymbol(KEPT, 0), InputSymbol("x_k", 0)}
