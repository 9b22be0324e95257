"""Sums in the order in which their terms are ready: equal to exact sums, with shorter critical paths."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from eomgen.symbolic.evaluate import Arithmetic, Evaluation
from eomgen.symbolic.latency import critical_path
from eomgen.symbolic.map import add_map
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.summation import sums_by_readiness
from eomgen.symbolic.tape import Ref, Tape
from tests.symbolic.loops import harmonics

_RULES: dict[Op, Callable[..., Fraction]] = {
    Op.ADD: lambda x, y: x + y,
    Op.SUB: lambda x, y: x - y,
    Op.MUL: lambda x, y: x * y,
    Op.DIV: lambda x, y: x / y,
}
_EXACT = Arithmetic(_RULES, Fraction)


def _recorded(seed: int) -> tuple[Tape, list[Ref]]:
    """Return random sums, products and quotients of six inputs, and some of the last as outputs."""
    source, tape = random.Random(seed), Tape()
    refs = [tape.input("q", k) for k in range(6)] + [tape.constant(0.5), tape.constant(3.0)]
    for _ in range(60):
        x, y = (source.choice([1, -1]) * source.choice(refs[-14:]) for _ in range(2))
        kind = source.choice("++++--**/")
        if kind == "/":
            refs.append(tape.div(x, tape.add(tape.mul(y, y), tape.constant(1.0))))
        else:
            refs.append({"+": tape.add, "-": tape.sub, "*": tape.mul}[kind](x, y))
    return tape, refs[-5:]


def _exact(tape: Tape, refs: list[Ref], values: list[Fraction]) -> list[Any]:
    def leaf(symbol: InputSymbol) -> Fraction:
        return values[symbol.index]

    return Evaluation(tape, refs).run(leaf, _EXACT)


def test_reordered_sums_are_the_same_numbers_with_fewer_cycles_and_no_more_operations() -> None:
    shorter = 0
    for seed in range(40):
        tape, outputs = _recorded(seed)
        ordered = sums_by_readiness(tape, outputs)
        values = [Fraction(random.Random(seed + k).randint(-50, 50), 8) for k in range(6)]
        assert _exact(tape, ordered, values) == _exact(tape, outputs, values)
        before, after = critical_path(tape, outputs), critical_path(tape, ordered)
        assert tape.counts(ordered).weight <= tape.counts(outputs).weight
        shorter += after < before
    assert shorter > 20


def test_sums_that_others_need_names_and_labels_stay() -> None:
    tape = Tape()
    a, b, c, d = (tape.input("q", k) for k in range(4))
    with tape.block("shared part"):
        shared = tape.add(tape.div(a, b), c)
        tape.name(shared, "part")
    with tape.block("whole"):
        whole = tape.add(tape.add(shared, d), tape.mul(a, c))
        tape.name(-whole, "minus_whole")
    ordered = sums_by_readiness(tape, [whole, tape.mul(shared, d)])
    assert tape.counts(ordered).flops == tape.counts([whole, tape.mul(shared, d)]).flops
    assert tape.names[abs(ordered[0])] == "whole"
    assert tape.label(abs(ordered[0])) == "whole"
    assert shared in tape.live(ordered)  # one term of the whole, by its name
    assert tape.names[shared] == "part"


def test_loops_stay_as_they_are() -> None:
    tape = Tape()
    sums = add_map(tape, harmonics(tape, tape.input("q"))).sums
    assert sums_by_readiness(tape, sums) == list(sums)
