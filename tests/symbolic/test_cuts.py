"""Partials with intermediates held as unknowns: eliminating them again gives the ordinary partials."""

from __future__ import annotations

from eomgen.symbolic.calculus.partials import cut_partials, forward_partials
from eomgen.symbolic.operations import InputSymbol, Op
from eomgen.symbolic.tape import ONE, Ref, Tape


def recursion(tape: Tape, n: int) -> tuple[list[Ref], list[Ref]]:
    """Return sums s_i = sin(s_(i-1) + x_i) x_i, in which every one depends on all inputs before it, and outputs of
    them."""
    x = [tape.input("x", k) for k in range(n)]
    state, states = x[0], []
    for entry in x:
        state = tape.mul(tape.call(Op.SIN, tape.add(state, entry)), entry)
        states.append(-state if len(states) % 2 else state)
    return [tape.add(tape.mul(state, state), entry) for state, entry in zip(states, x, strict=True)], states


def test_the_extended_system_grows_linearly_where_the_partials_grow_quadratically() -> None:
    def nonzeros(n: int) -> tuple[int, int]:
        tape = Tape()
        outputs, states = recursion(tape, n)
        seeds = {InputSymbol("x", k): {k: ONE} for k in range(n)}
        rows, definitions, _ = cut_partials(tape, outputs, seeds, states, n)
        return sum(map(len, [*rows, *definitions])), sum(map(len, forward_partials(tape, outputs, seeds)))

    extended, ordinary = zip(*(nonzeros(n) for n in (10, 20, 40)), strict=True)
    assert extended[2] - extended[1] == 2 * (extended[1] - extended[0])
    assert ordinary[2] > 3.5 * ordinary[1]
