from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings

from eomgen.symbolic.calculus.jets import jets
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.tape import ONE, ZERO, Tape
from tests.oracles.fifty_digits import evaluate_mpmath
from tests.symbolic.random_tapes import EVERY, build, programs, record

ORDER = 6
X = ((0.37, 0.5, -0.4, 0.9, 0.3, -0.7, 1.1), (0.81, -0.6, 0.2, 0.1, -1.3, 0.8, 0.4))


def moving_inputs(tape, count):
    """Return the jets of inputs x whose coefficients of order 1.. are inputs c."""
    return {
        InputSymbol("x", k): [tape.input("x", k), *(tape.input("c", k * ORDER + i) for i in range(ORDER))]
        for k in range(count)
    }


def at(paths):
    return {"x": [path[0] for path in paths], "c": [entry for path in paths for entry in path[1:]]}


def taylor(tape, output, paths):
    """Return the Taylor coefficients of an output by numerical differentiation at sixty digits."""
    with mpmath.workdps(60):

        def along(t):
            return evaluate_mpmath(tape, [output], {"x": [mpmath.polyval(list(reversed(path)), t) for path in paths]})[
                0
            ]

        return [float(value) for value in mpmath.taylor(along, 0, ORDER)]


@pytest.mark.parametrize("op", EVERY)
def test_every_operation_against_numerical_taylor_coefficients(op):
    for paths in (X, X[::-1]):
        tape = Tape()
        output = record(tape, op, tape.input("x", 0), tape.input("x", 1))
        [jet] = jets(tape, [output], moving_inputs(tape, 2), ORDER)
        assert jet[0] == output
        assert evaluate(tape, jet, at(paths)) == pytest.approx(taylor(tape, output, paths), rel=1e-12, abs=1e-14)


@settings(max_examples=25, deadline=None)
@given(programs)
def test_random_tapes_against_numerical_taylor_coefficients(program):
    tape, symbols, outputs = build(program)
    [jet] = jets(tape, outputs[-1:], moving_inputs(tape, len(symbols)), ORDER)
    paths = (*X, (-1.2, 0.3, 0.5, -0.2, 0.1, 0.4, -0.6))
    expected = np.array(taylor(tape, outputs[-1], paths))
    assert np.abs(evaluate(tape, jet, at(paths)) - expected).max() <= 1e-10 * (1.0 + np.abs(expected).max())


def test_a_varying_base_with_a_constant_exponent_may_be_negative():
    tape = Tape()
    t, n = tape.input("t"), tape.input("p")
    [jet] = jets(tape, [tape.call(Op.POW, t, n)], {t: [t, ONE]}, 4)
    assert evaluate(tape, jet, {"t": -2.0, "p": 3.0}).tolist() == pytest.approx([-8, 12, -6, 1, 0])


def test_the_branch_of_a_select_is_followed():
    tape = Tape()
    t = tape.input("t")
    output = tape.select(tape.call(Op.LT, t, ONE), tape.mul(t, t), tape.call(Op.EXP, t))
    [jet] = jets(tape, [output], {t: [t, ONE]}, 3)
    assert evaluate(tape, jet, {"t": 0.5}).tolist() == [0.25, 1.0, 1.0, 0.0]
    assert evaluate(tape, jet, {"t": 2.0}) == pytest.approx(
        [math.exp(2) / math.factorial(k) for k in range(4)], rel=1e-15
    )


def test_inputs_without_a_jet_are_constant_and_order_zero_is_the_value():
    tape = Tape()
    x, p = tape.input("x"), tape.input("p")
    output = tape.call(Op.LOG, tape.mul(x, p))
    assert jets(tape, [output], {}, 3) == [[output, ZERO, ZERO, ZERO]]
    assert jets(tape, [-output], {x: [x, ONE]}, 0) == [[-output]]


def test_a_first_coefficient_may_substitute_the_input():
    tape = Tape()
    x, y = tape.input("x"), tape.input("y")
    [jet] = jets(tape, [tape.mul(x, tape.call(Op.SIN, x))], {x: [y, ONE]}, 1)
    assert jet == [tape.mul(y, tape.call(Op.SIN, y)), tape.add(tape.mul(y, tape.call(Op.COS, y)), tape.call(Op.SIN, y))]
