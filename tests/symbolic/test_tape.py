from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies

from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map
from eomgen.symbolic.operations import Counts, InputSymbol, Op
from eomgen.symbolic.tape import ONE, ZERO, Tape, dot


@pytest.fixture
def tape():
    return Tape()


def test_zero_and_one_fold(tape):
    x = tape.input("x")
    assert tape.add(x, ZERO) == tape.add(ZERO, x) == tape.sub(x, ZERO) == tape.mul(x, ONE) == tape.div(x, ONE) == x
    assert tape.mul(x, ZERO) == tape.sub(x, x) == tape.add(x, -x) == tape.div(ZERO, x) == ZERO
    assert tape.div(x, x) == ONE
    assert len(tape.op) == 4


def test_a_negated_zero_folds_like_zero(tape):
    x = tape.input("x")
    assert tape.add(-ZERO, x) == tape.add(x, -ZERO) == tape.sub(x, -ZERO) == x
    assert tape.add(-ZERO, -ZERO) == tape.add(ZERO, -ZERO) == tape.mul(-ZERO, x) == ZERO


def test_commutative_operands_and_signs_share_a_node(tape):
    x, y = tape.input("x", 0), tape.input("x", 1)
    assert tape.add(x, y) == tape.add(y, x) == -tape.add(-x, -y)
    assert tape.sub(x, y) == -tape.sub(y, x)
    assert tape.mul(x, y) == tape.mul(y, x) == -tape.mul(-x, y) == tape.mul(-x, -y)
    assert tape.div(-x, y) == tape.div(x, -y) == -tape.div(x, y)
    assert tape.call(Op.MIN, x, y) == tape.call(Op.MIN, y, x)
    assert tape.call(Op.SIN, -x) == -tape.call(Op.SIN, x)
    assert tape.call(Op.COS, -x) == tape.call(Op.COS, x)


def test_constants_fold_to_the_numbers_of_the_c_library(tape):
    half, two = tape.constant(0.5), tape.constant(2.0)
    assert tape.value(tape.mul(half, -two)) == -1.0
    assert tape.value(tape.sub(half, two)) == -1.5
    assert tape.value(tape.call(Op.POW, two, tape.constant(0.3))) == math.pow(2.0, 0.3)
    assert tape.value(tape.call(Op.ATAN2, -half, -two)) == math.atan2(-0.5, -2.0)
    assert tape.value(tape.call(Op.SIN, half)) == math.sin(0.5)
    assert tape.select(tape.call(Op.LT, half, two), half, two) == half
    assert tape.value(tape.input("x")) is None


def test_powers_are_repeated_squares(tape):
    x = tape.input("x")
    cube = tape.power(x, 3)
    assert tape.counts([cube]) == Counts(multiplications=2, statements=2)
    assert tape.call(Op.POW, x, tape.constant(3.0)) == cube
    assert tape.call(Op.POW, x, tape.constant(-3.0)) == tape.div(ONE, cube)
    assert tape.call(Op.POW, x, tape.constant(0.5)) == tape.call(Op.SQRT, x)
    assert tape.power(x, 0) == ONE


def test_what_cannot_be_recorded_is_refused(tape):
    with pytest.raises(ValueError, match="a constant of a tape must be finite, not nan"):
        tape.constant(math.nan)
    for zero in (ZERO, -ZERO):
        with pytest.raises(ZeroDivisionError, match="division by a value that is zero by structure"):
            tape.div(ONE, zero)
    with pytest.raises(ValueError, match="math domain error"):
        tape.call(Op.LOG, tape.constant(-1.0))


def test_live_nodes_dependence_and_counts(tape):
    x, y, z = (tape.input("x", k) for k in range(3))
    first = tape.div(tape.call(Op.SIN, x), tape.add(x, y))
    second = tape.select(tape.call(Op.LT, x, y), tape.call(Op.MAX, x, y), tape.mul(y, y))
    tape.call(Op.EXP, z)
    assert tape.depends_on([first, -second]) == {InputSymbol("x", 0), InputSymbol("x", 1)}
    assert tape.counts([first, second]) == Counts(
        additions=1, multiplications=1, divisions=1, functions=1, selections=3, statements=7
    )
    live = tape.live([first, second])
    assert live == sorted(live)
    assert tape.counts([first]).flops == 1


def test_live_follows_what_a_map_gathers_once(tape):
    kernel = Tape()
    inputs = [tape.call(Op.SIN, tape.input("x", k)) for k in range(4)]
    loop = Map(
        kernel, 4, gather=(tuple(inputs),), stacked=(kernel.mul(kernel.input("gather"), kernel.input("gather")),)
    )
    rows = [row[0] for row in add_map(tape, loop).rows]
    assert tape.live([rows[2]]) == [*range(3, 3 + 2 * 4), rows[2]]
    assert tape.live([-rows[0], rows[3]]) == [*range(3, 3 + 2 * 4), rows[0], rows[3]]


def test_dot_product(tape):
    x, y = ([tape.input(name, k) for k in range(3)] for name in "xy")
    value = evaluate(tape, [dot(tape, x, y)], {"x": [1.0, 2.0, 3.0], "y": [4.0, -5.0, 6.0]})
    assert value[0] == 12.0
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        dot(tape, x, y[:2])


@pytest.mark.slow
@settings(max_examples=200, deadline=None)
@given(
    strategies.lists(
        strategies.tuples(strategies.sampled_from("+-*/"), *[strategies.integers(-30, 30)] * 2), max_size=25
    )
)
def test_local_rules_keep_the_value(program):
    """Integers and small fractions: what the rules reorder stays within rounding of plain Python arithmetic."""
    tape = Tape()
    values = [0.0, 1.0, 2.0, -3.0, 0.7, 1.3]
    refs = [tape.constant(v) for v in values[:4]] + [tape.input("x", 0), tape.input("x", 1)]
    for sign, i, j in program:
        a, b = i % len(refs), j % len(refs)
        sign_a, sign_b = (-1 if i < 0 else 1), (-1 if j < 0 else 1)
        x, y = sign_a * values[a], sign_b * values[b]
        p, q = sign_a * refs[a], sign_b * refs[b]
        if (sign == "/" and abs(y) < 0.1) or max(abs(x), abs(y)) > 100.0:
            continue
        values.append({"+": x + y, "-": x - y, "*": x * y, "/": x / y if y else 0.0}[sign])
        refs.append(
            {"+": tape.add, "-": tape.sub, "*": tape.mul}.get(sign, tape.div if abs(q) != ZERO else tape.mul)(p, q)
        )
    scale = max(map(abs, values))
    assert np.abs(evaluate(tape, refs, {"x": [0.7, 1.3]}) - values).max() <= 1e-8 * scale
