"""Partials with intermediates held as unknowns: eliminating them again gives the ordinary partials."""

from __future__ import annotations

import numpy as np
import pytest

from eomgen.symbolic.calculus.partials import cut_partials, forward_partials
from eomgen.symbolic.evaluate import evaluate
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


def whole(tape: Tape, tangents: list[dict[int, Ref]], columns: int, values: np.ndarray) -> np.ndarray:
    places = [(row, column, ref) for row, tangent in enumerate(tangents) for column, ref in tangent.items()]
    found = np.zeros((len(tangents), columns))
    for (row, column, _), value in zip(places, evaluate(tape, [ref for *_, ref in places], {"x": values}), strict=True):
        found[row, column] = value
    return found


@pytest.mark.parametrize("n", [1, 2, 7, 20])
def test_eliminating_the_cuts_gives_the_ordinary_partials(n: int, rng: np.random.Generator) -> None:
    tape = Tape()
    outputs, states = recursion(tape, n)
    seeds = {InputSymbol("x", k): {k: ONE} for k in range(n)}
    rows, definitions, nodes = cut_partials(tape, outputs, seeds, [*states, ONE, tape.input("x", 0)], n)
    used = len(definitions)
    assert nodes == sorted(abs(ref) for ref in states)[: len(nodes)]
    values = rng.normal(size=n)
    A = whole(tape, rows, n + used, values)
    G = whole(tape, definitions, n + used, values)
    found = A[:, :n] + A[:, n:] @ np.linalg.solve(np.eye(used) - G[:, n:], G[:, :n])
    expected = whole(tape, forward_partials(tape, outputs, seeds), n, values)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-13)


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
