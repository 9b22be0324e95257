from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.operations import UNARY, Op
from eomgen.symbolic.tape import Tape
from tests.oracles.fifty_digits import evaluate_mpmath
from tests.symbolic.random_tapes import BINARY, record

LIBRARY = {
    Op.SQRT: math.sqrt,
    Op.SIN: math.sin,
    Op.COS: math.cos,
    Op.TAN: math.tan,
    Op.ASIN: math.asin,
    Op.ACOS: math.acos,
    Op.ATAN: math.atan,
    Op.SINH: math.sinh,
    Op.COSH: math.cosh,
    Op.TANH: math.tanh,
    Op.EXP: math.exp,
    Op.LOG: math.log,
    Op.ABS: abs,
    Op.SIGN: lambda x: math.copysign(1.0, x),
}


def test_the_library_covers_every_function_of_one_argument():
    assert set(LIBRARY) == UNARY


@pytest.mark.parametrize("op", sorted(UNARY))
def test_functions_agree_with_the_c_library_and_with_mpmath(op):
    tape = Tape()
    ref = tape.call(op, tape.input("x"))
    for x in (0.3, 0.9):
        assert evaluate(tape, [ref], {"x": x})[0] == pytest.approx(LIBRARY[op](x), rel=4e-16)
        assert float(evaluate_mpmath(tape, [ref], {"x": x})[0]) == pytest.approx(LIBRARY[op](x), rel=4e-16)


#: Of 1 and 2.
OF_TWO = (3.0, -1.0, 2.0, 0.5, 1.0, math.atan(0.5), 1.0, 2.0, 1.0, 1.0)


@pytest.mark.parametrize(("op", "expected"), zip(BINARY, OF_TWO, strict=True))
def test_operations_of_two_arguments(op, expected):
    tape = Tape()
    ref = record(tape, op, tape.input("x", 0), tape.input("x", 1))
    for values in (evaluate(tape, [ref, -ref], {"x": [1.0, 2.0]}), evaluate_mpmath(tape, [ref, -ref], {"x": [1, 2]})):
        assert [float(value) for value in values] == pytest.approx([expected, -expected])


def test_comparisons_at_equality():
    tape = Tape()
    x, y = tape.input("x", 0), tape.input("x", 1)
    refs = [tape.call(Op.LT, x, y), tape.call(Op.LE, x, y), tape.select(tape.call(Op.LE, x, y), x, -y)]
    assert evaluate(tape, refs, {"x": [2.0, 2.0]}).tolist() == [0.0, 1.0, 2.0]
    assert [float(value) for value in evaluate_mpmath(tape, refs, {"x": [3.0, 2.0]})] == [0.0, 0.0, -2.0]


def test_complex_numbers_decide_on_their_real_part():
    tape = Tape()
    x, y = tape.input("x", 0), tape.input("x", 1)
    refs = [
        tape.call(Op.ABS, x),
        tape.call(Op.SIGN, x),
        tape.call(Op.MIN, x, y),
        tape.call(Op.MAX, x, y),
        tape.select(tape.call(Op.LT, x, y), x, y),
    ]
    z, w = -2.0 + 3.0j, 1.0 - 50.0j
    expected = [2.0 - 3.0j, -1.0, z, w, z]
    assert evaluate(tape, refs, {"x": [z, w]}).tolist() == expected
    assert [complex(value) for value in evaluate_mpmath(tape, refs, {"x": [z, w]})] == expected


@pytest.mark.parametrize("angle", np.linspace(-3.1, 3.1, 13))
def test_complex_atan2_keeps_tiny_imaginary_parts_in_every_quadrant(angle):
    tape = Tape()
    ref = tape.call(Op.ATAN2, tape.input("x", 0), tape.input("x", 1))
    y, x = 2.0 * math.sin(angle), 2.0 * math.cos(angle)
    for dy, dx in ((1.0, 0.0), (0.0, 1.0)):
        expected = (x * dy - y * dx) / 4.0
        value = evaluate(tape, [ref], {"x": [y + 1e-40j * dy, x + 1e-40j * dx]})[0]
        assert value.real == pytest.approx(angle, rel=1e-15)
        assert value.imag / 1e-40 == pytest.approx(expected, rel=1e-14, abs=1e-16)
        exact = evaluate_mpmath(tape, [ref], {"x": [mpmath.mpc(y, 1e-40 * dy), mpmath.mpc(x, 1e-40 * dx)]}, digits=90)[
            0
        ]
        assert float(exact.real) == pytest.approx(angle, rel=1e-15)
        assert float(exact.imag / mpmath.mpf(1e-40)) == pytest.approx(expected, rel=1e-14, abs=1e-16)


def test_atan2_of_real_arrays_with_a_zero_denominator():
    tape = Tape()
    ref = tape.call(Op.ATAN2, tape.input("x", 0), tape.input("x", 1))
    for y, x in ((1.0, 0.0), (-1.0, 0.0), (0.0, -1.0)):
        assert evaluate(tape, [ref], {"x": [y, x]})[0] == math.atan2(y, x)
        assert evaluate(tape, [ref], {"x": [y + 0j, x + 0j]})[0] == pytest.approx(math.atan2(y, x), rel=1e-15)


def test_mpmath_carries_fifty_digits_and_exact_doubles():
    tape = Tape()
    ref = tape.call(Op.EXP, tape.mul(tape.constant(0.1), tape.input("x")))
    with mpmath.workdps(60):
        reference = mpmath.exp(mpmath.mpf(3602879701896397) / 2**55 * 3)  # the double next to 0.1, times 3
        assert abs(evaluate_mpmath(tape, [ref], {"x": 3})[0] - reference) < mpmath.mpf(10) ** -48


def test_a_missing_component_is_named():
    tape = Tape()
    ref = tape.input("q", 2)
    expected = (
        r"^the tape needs component 2 of input block 'q', which has 1; "
        r"try: pass inputs\['q'\] with at least 3 numbers$"
    )
    with pytest.raises(ValueError, match=expected):
        evaluate(tape, [ref], {"q": 1.0})
    with pytest.raises(ValueError, match=expected):
        evaluate_mpmath(tape, [ref], {"q": [1.0]})


def test_a_deep_tape_needs_no_recursion():
    tape = Tape()
    ref = x = tape.input("x")
    for _ in range(20000):
        ref = tape.add(tape.mul(tape.constant(0.5), ref), x)
    assert evaluate(tape, [ref], {"x": 1.0})[0] == 2.0
