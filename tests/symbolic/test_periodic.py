"""Inputs that whole turns can be taken off: what the structure says, against values."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.periodic import periodic_inputs
from eomgen.symbolic.tape import Tape


def sine(tape, x):
    return tape.call(Op.SIN, x)


def product(tape, a, b, c):
    return [tape.mul(sine(tape, a), tape.call(Op.COS, b))]


def sums_and_multiples(tape, a, b, c):
    twice = tape.mul(tape.constant(-2.0), tape.sub(a, b))
    return [sine(tape, tape.add(twice, c)), tape.call(Op.COS, tape.sub(b, tape.constant(0.3)))]


def half_of_one(tape, a, b, c):
    return [sine(tape, tape.mul(tape.constant(0.5), a)), sine(tape, tape.add(b, c))]


def spring(tape, a, b, c):
    return [tape.add(sine(tape, tape.add(a, b)), tape.mul(tape.constant(3.0), b))]


def itself(tape, a, b, c):
    return [a, sine(tape, b), tape.call(Op.TAN, c)]


def sum_as_output(tape, a, b, c):
    angle = tape.add(a, b)
    return [sine(tape, angle), angle, sine(tape, c)]


CASES = {product: "ab", sums_and_multiples: "abc", half_of_one: "bc", spring: "a", itself: "b", sum_as_output: "c"}


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
def test_turns_change_nothing_just_where_the_structure_says_so(case):
    tape = Tape()
    outputs = case(tape, *(tape.input("q", k) for k in range(3)))
    found = {"abc"[symbol.index] for symbol in periodic_inputs(tape, outputs)}
    assert found == set(CASES[case])
    q = np.array([0.3, -0.7, 1.1])
    before = np.array(evaluate(tape, outputs, {"q": q}))
    for name in found:
        turned = q + 2 * np.pi * 7 * (np.arange(3) == "abc".index(name))
        assert evaluate(tape, outputs, {"q": turned}) == pytest.approx(before, abs=1e-13)


def test_what_a_loop_reads_stays_as_it_is():
    kernel = Tape()
    row = kernel.call(Op.SIN, kernel.add(kernel.input("shared", 0), kernel.input("element", 0)))
    tape = Tape()
    angle, other = tape.input("q", 0), tape.input("q", 1)
    loop = Map(kernel, 2, elements=((0.1, 0.2),), shared=(angle,), sums=(row,))
    total = add_map(tape, loop).sums[0]
    assert periodic_inputs(tape, [total, tape.call(Op.SIN, other)]) == {InputSymbol("q", 1)}
