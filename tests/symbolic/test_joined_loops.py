"""Loops over the same constants run together: what they share is computed once, what they give stays what it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from eomgen.symbolic.calculus.jets import jets
from eomgen.symbolic.evaluate import evaluate
from eomgen.symbolic.map import Map, add_map, unroll
from eomgen.symbolic.operations import Op
from eomgen.symbolic.tape import ONE, ZERO, Ref, Tape
from tests.symbolic.loops import harmonics


def waves(s: Ref, cosines: tuple[float, ...], frequencies: tuple[float, ...], op: Op = Op.COS) -> Map:
    kernel = Tape()
    size, frequency = kernel.input("element", 0), kernel.input("element", 1)
    value = kernel.mul(size, kernel.call(op, kernel.mul(frequency, kernel.input("shared", 0))))
    return Map(kernel, len(cosines), (cosines, frequencies), shared=(s,), sums=(value,), label=f"waves {cosines[0]}")


def test_loops_that_gather_the_same_are_joined() -> None:
    """Whatever the order of their slots; what is not gathered alike stays apart."""
    tape = Tape()
    x, y = ([tape.input(block, k) for k in range(3)] for block in "xy")

    def gathering(first: list[Ref], second: list[Ref], op: Op, one: int = 0) -> Map:
        kernel = Tape()
        size = kernel.call(op, kernel.mul(kernel.input("element", 0), kernel.input("gather", one)))
        value = kernel.mul(size, kernel.add(kernel.input("gather", 1 - one), kernel.constant(1.0)))
        gather = (tuple(first), tuple(second))
        return Map(kernel, 3, ((0.5, 1.5, 2.5),), gather=gather, sums=(value,), label=op.name.lower())

    loops = [gathering(x, y, Op.COS), gathering(x, y, Op.SIN), gathering(y, x, Op.TAN, one=1)]
    refs = [add_map(tape, loop).sums[0] for loop in loops]
    [(joined, starts)] = Map.together(dict(enumerate(loops)))
    assert starts == {0: 0, 1: 1, 2: 2}
    assert joined.gather == (tuple(x), tuple(y))
    assert tape.counts(refs).additions == 3 * (1 + 3), "y + 1 is that of all three"
    given = {block: np.random.default_rng(1).uniform(-1.0, 1.0, 3) for block in "xy"}
    alone = evaluate(tape, refs, given)
    together = [*add_map(tape, joined).sums, *unroll(tape, joined).sums]
    np.testing.assert_array_equal(evaluate(tape, together, given), [*alone, *alone])
    assert loops[0].join(gathering(x, x, Op.SIN)) is None


def test_derivatives_of_joined_loops_are_joined() -> None:
    tape = Tape()
    s = tape.input("s")
    values = [add_map(tape, waves(s, (1.0, 2.0), (0.5, 1.5))).sums[0]]
    values.append(add_map(tape, waves(s, (3.0, 4.0), (0.5, 1.5), Op.SIN)).sums[0])
    rows = jets(tape, values, {s: [s, ONE]}, 2)
    assert tape.counts([ref for row in rows for ref in row]).functions == 2 * 2


@pytest.mark.parametrize("what", ["frequencies", "argument", "count", "carry", "rows"])
def test_loops_that_share_nothing_stay_apart(what: str) -> None:
    tape = Tape()
    s = tape.input("s")
    first = waves(s, (1.0, 2.0), (0.5, 1.5))
    other = {
        "frequencies": waves(s, (1.0, 2.0), (0.6, 1.6)),
        "argument": waves(tape.input("x"), (1.0, 2.0), (0.5, 1.5)),
        "count": waves(s, (1.0, 2.0, 3.0), (0.5, 1.5, 2.5)),
        "carry": replace(first, initial=(ZERO,), last=(first.sums[0],)),
        "rows": replace(first, stacked=first.sums),
    }[what]
    assert first.join(other) is None
    assert [loop for loop, _ in Map.together({4: first, 2: other})] == [first, other]


def test_the_same_loop_twice_is_one() -> None:
    tape = Tape()
    loop = harmonics(tape, tape.input("s"))
    both = loop.join(replace(loop))
    assert both is not None
    assert len(both.elements) == 3
    assert both.counts().functions == loop.counts().functions
