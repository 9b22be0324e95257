from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings

from eomgen.symbolic.calculus.partials import forward_partials, gradient, jacobian_vector
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.tape import ONE, ZERO, Tape
from tests.oracles.fifty_digits import evaluate_mpmath
from tests.symbolic.random_tapes import EVERY, build, complex_step, points, programs, record


def jacobian(tape, outputs, symbols):
    seeds = {ref: {k: ONE} for k, ref in enumerate(symbols)}
    return [[partial.get(k, ZERO) for k in range(len(symbols))] for partial in forward_partials(tape, outputs, seeds)]


@pytest.mark.parametrize("op", EVERY)
@pytest.mark.parametrize("point", [(0.37, 0.81), (0.91, 0.22)])
def test_every_operation_against_complex_step_and_mpmath(op, point):
    tape = Tape()
    symbols = [tape.input("x", 0), tape.input("x", 1)]
    output = record(tape, op, *symbols)
    partials = jacobian(tape, [output], symbols)[0]
    value = evaluate(tape, partials, {"x": point})
    assert value == pytest.approx(complex_step(tape, [output], {"x": point}, "x")[0], rel=1e-14, abs=1e-300)
    with mpmath.workdps(50):
        for k, derivative in enumerate(evaluate_mpmath(tape, partials, {"x": point})):
            order = (1, 0) if k == 0 else (0, 1)
            reference = mpmath.diff(lambda x, y: evaluate_mpmath(tape, [output], {"x": [x, y]})[0], point, order)
            assert abs(derivative - reference) < mpmath.mpf(10) ** -30
    assert gradient(tape, output, symbols) == partials or evaluate(
        tape, gradient(tape, output, symbols), {"x": point}
    ) == pytest.approx(value, rel=1e-14)


@settings(max_examples=120, deadline=None)
@given(programs, points)
def test_forward_reverse_and_complex_step_agree_on_random_tapes(program, point):
    tape, symbols, outputs = build(program)
    forward = jacobian(tape, outputs, symbols)
    reverse = [gradient(tape, output, symbols) for output in outputs]
    expected = complex_step(tape, outputs, {"x": point}, "x")
    scale = 1e-11 * (1.0 + np.abs(expected).max())
    for rows in (forward, reverse):
        assert np.abs([evaluate(tape, row, {"x": point}) for row in rows] - expected).max() <= scale


@settings(max_examples=60, deadline=None)
@given(programs, points)
@example(program=[(Op.POW, 0, 1, False)], point=[0.0, 1.0, 0.0])  # an exponent that is 0 at this point alone
def test_forward_over_forward_is_the_complex_step_of_the_first_derivative_and_symmetric(program, point):
    tape, symbols, outputs = build(program)
    gradients = gradient(tape, outputs[-1], symbols)
    expected = complex_step(tape, gradients, {"x": point}, "x")
    hessian = [
        [jacobian_vector(tape, jacobian_vector(tape, outputs[-1:], {x: ONE}), {y: ONE})[0] for y in symbols]
        for x in symbols
    ]
    value = np.array([evaluate(tape, row, {"x": point}) for row in hessian])
    tolerance = 1e-9 * (1.0 + np.abs(expected).max())
    assert np.abs(value - expected).max() <= tolerance
    assert np.abs(value - value.T).max() <= tolerance


def test_partials_are_sparse():
    tape = Tape()
    x = [tape.input("x", k) for k in range(4)]
    outputs = [tape.mul(x[0], x[1]), tape.call(Op.SIN, x[3]), x[2], tape.constant(3.0)]
    partials = forward_partials(tape, outputs, {InputSymbol("x", k): {10 + k: ONE} for k in range(3)})
    assert partials == [{10: x[1], 11: x[0]}, {}, {12: ONE}, {}]


def test_a_seeded_node_inside_is_independent_and_its_sign_counts():
    tape = Tape()
    x = tape.input("x")
    inner = tape.call(Op.SIN, x)
    output = tape.mul(inner, x)
    assert jacobian_vector(tape, [output], {inner: ONE}) == [x]
    assert jacobian_vector(tape, [output], {-inner: ONE}) == [-x]
    assert gradient(tape, -output, [inner, -inner]) == [-x, x]


def test_choices_where_functions_are_not_smooth():
    tape = Tape()
    x, y = tape.input("x", 0), tape.input("x", 1)
    symbols = [x, y]
    outputs = [
        tape.call(Op.ABS, x),
        tape.call(Op.SIGN, x),
        tape.call(Op.MIN, x, y),
        tape.call(Op.MAX, x, y),
        tape.select(tape.call(Op.LT, x, y), tape.mul(x, x), y),
    ]
    rows = jacobian(tape, outputs, symbols)

    def at(*point):
        return [evaluate(tape, row, {"x": point}).tolist() for row in rows]

    assert at(0.0, 0.0) == [[0, 0], [0, 0], [1, 0], [1, 0], [0, 1]]
    assert at(-3.0, 2.0) == [[-1, 0], [0, 0], [1, 0], [0, 1], [-6, 0]]
    assert at(3.0, 2.0) == [[1, 0], [0, 0], [0, 1], [1, 0], [0, 1]]


def test_a_constant_exponent_asks_for_no_logarithm_so_negative_bases_stay_legal():
    tape = Tape()
    x, n = tape.input("x"), tape.input("p")
    output = tape.call(Op.POW, x, n)
    [derivative] = jacobian_vector(tape, [output], {x: ONE})
    assert evaluate(tape, [derivative], {"x": -2.0, "p": 3.0})[0] == 12.0
    assert evaluate(tape, [derivative], {"x": 0.0, "p": 2.0})[0] == 0.0


def test_the_work_is_linear_in_nodes_times_directions():
    tape = Tape()
    directions = 14
    x = [tape.input("x", k) for k in range(directions)]
    refs = list(x)
    rng = np.random.default_rng(1)
    while len(tape.live(refs)) < 800:
        i, j = rng.integers(max(0, len(refs) - 40), len(refs), 2)
        refs.append(tape.mul(refs[i], refs[j]) if rng.random() < 0.5 else tape.add(refs[i], tape.call(Op.SIN, refs[j])))
    before = len(tape.op)
    forward_partials(tape, refs[-30:], {ref: {k: ONE} for k, ref in enumerate(x)})
    assert len(tape.op) - before <= 3 * directions * 800
    before = len(tape.op)
    gradient(tape, refs[-1], x)
    assert len(tape.op) - before <= 3 * 800
