"""Values that vanish for all inputs: by cancellation, in all cases and in loops; others that only seem to vanish."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.symbolic.zeros import vanishing


def binomial(tape: Tape, x: Ref, y: Ref) -> Ref:
    """(x + y)^2 - x^2 - 2 x y - y^2, some of which rounding leaves."""
    whole, square = tape.mul(tape.add(x, y), tape.add(x, y)), tape.mul(x, x)
    mixed = tape.mul(tape.constant(2.0), tape.mul(x, y))
    return tape.sub(tape.sub(tape.sub(whole, square), mixed), tape.mul(y, y))


def on_the_circle(tape: Tape, x: Ref, y: Ref) -> Ref:
    """sin^2 + cos^2 - 1 of x/y."""
    sine, cosine = (tape.call(op, tape.div(x, y)) for op in (Op.SIN, Op.COS))
    return tape.sub(tape.add(tape.mul(sine, sine), tape.mul(cosine, cosine)), tape.constant(1.0))


def in_both_cases(tape: Tape, x: Ref, y: Ref) -> Ref:
    """(x + y if x < y else 2 x) - x, less y or x in the same cases."""
    condition = tape.call(Op.LT, x, y)
    whole = tape.select(condition, tape.add(x, y), tape.mul(tape.constant(2.0), x))
    return tape.sub(tape.sub(whole, x), tape.select(condition, y, x))


def in_one_case(tape: Tape, x: Ref, y: Ref) -> Ref:
    """x - y below 1e-9, else 0: zero at most inputs."""
    close = tape.call(Op.LT, tape.mul(x, x), tape.constant(1e-18))
    return tape.select(close, tape.sub(x, y), tape.constant(0.0))


def absorbed(tape: Tape, x: Ref, y: Ref) -> Ref:
    """(1e20 + x) - 1e20: zero in double precision."""
    large = tape.constant(1e20)
    return tape.sub(tape.add(tape.mul(large, tape.div(y, y)), x), large)


def in_a_loop(tape: Tape, x: Ref, y: Ref) -> Ref:
    """The second element of x e - y with e = (1, 0), plus y."""
    kernel = Tape()
    e, s, g = kernel.input("element", 0), kernel.input("shared", 0), kernel.input("gather", 0)
    row = kernel.sub(kernel.mul(e, s), g)
    loop = Map(kernel, 2, elements=((1.0, 0.0),), shared=(x,), gather=((x, y),), stacked=(row,))
    return tape.add(add_map(tape, loop).rows[1][0], y)


@pytest.mark.parametrize("made", [binomial, on_the_circle, in_both_cases, in_a_loop])
def test_values_that_cancel_vanish(made: Callable[[Tape, Ref, Ref], Ref]) -> None:
    tape = Tape()
    x, y = tape.input("q", 0), tape.input("q", 1)
    ref = made(tape, x, y)
    assert vanishing(tape, [ref, x, -ref, tape.mul(x, y)]) == {ref, -ref}


@pytest.mark.parametrize("made", [in_one_case, absorbed])
def test_values_that_are_zero_at_most_inputs_do_not_vanish(made: Callable[[Tape, Ref, Ref], Ref]) -> None:
    tape = Tape()
    ref = made(tape, tape.input("q", 0), tape.input("q", 1))
    assert not evaluate(tape, [ref], {"q": np.random.default_rng(1).uniform(0.5, 2.0, (9, 2))}).any()
    assert vanishing(tape, [ref]) == set()
