"""Runs of operations that repeat, found in the order of the tape, so that a chain of identical bodies is written as loops.

Recursions over bodies record the same operations for each of them, one body after the other. Where a sequence of operation codes
repeats with some period, one period becomes the text of a loop; what its operands are in each turn is looked up, not assumed:
values of the same turn are locals, everything else has a place that may follow any rule. This is loop rerolling; repeats
are found by hashes of windows (Karp and Rabin 1987).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eomgen.symbolic.operations import UNARY, Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import INPUT_BLOCKS

_ARITY = [2] * (max(Op) + 1)
for _op in UNARY:
    _ARITY[_op] = 1
_ARITY[Op.SELECT] = 3
_ARITY[Op.CURVE] = 1

#: Operations that a loop must save in the text to be worth it.
SAVED = 150
#: Turns of a loop at least.
TURNS = 4
#: Operations in a row by which repeats are found, and distances between repeats that are tried.
_WINDOW = 24
_DISTANCES = 12

#: Inputs that are arrays; members of structs are no places that a loop could count through.
_ARRAYS = frozenset(INPUT_BLOCKS) - {"p", "t", "base"}


@dataclass(frozen=True)
class Roll:
    """A loop: the operations of every turn, in the same order; ``turns[k][j]`` is operation j of turn k."""

    turns: tuple[tuple[int, ...], ...]

    @property
    def period(self) -> int:
        return len(self.turns[0])


def operands(tape: Tape, node: int) -> tuple[int, ...]:
    """Return the operand references of an operation that is no result of a Map (faster than ``Tape.operands``)."""
    arity = _ARITY[tape.op[node]]
    if arity == 2:
        return (tape.a[node], tape.b[node])
    return (tape.a[node],) if arity == 1 else (tape.a[node], tape.b[node], tape.c[node])


def find_rolls(tape: Tape, live: Sequence[int]) -> list[Roll]:
    """Return the loops in a sequence of operations, in order and apart from each other."""
    fixed = [node for node in live if not is_circular(tape, node)]
    codes = _codes(tape, fixed)
    found: list[tuple[int, int, int]] = []
    _search(codes, 0, len(codes), found)
    rolls = []
    for start, period, turns in sorted(found):
        roll = _consistent(tape, [tuple(fixed[start + k * period : start + (k + 1) * period]) for k in range(turns)])
        if roll is not None:
            rolls.append(roll)
    return rolls


def is_circular(tape: Tape, node: int) -> bool:
    """Return whether a node is a sine or cosine of an input: those of a function are computed all at once."""
    return tape.op[node] in (Op.SIN, Op.COS) and tape.op[abs(tape.a[node])] is Op.INPUT


def _codes(tape: Tape, nodes: Sequence[int]) -> NDArray[np.uint64]:
    """Return a number for each operation that is the same where code, signs and kinds of operands are."""
    numbers: dict[tuple[object, ...], int] = {}

    def kind(ref: Ref) -> object:
        node = abs(ref)
        op = tape.op[node]
        if op is Op.CONST:
            return "number"
        if op is Op.INPUT:
            symbol = tape.inputs[tape.a[node]]
            return (symbol.block if symbol.block in _ARRAYS else symbol, ref < 0)
        return ref < 0

    def key(node: int) -> tuple[object, ...]:
        own = node if tape.op[node] is Op.CURVE else 0  # a curve is looked up by its number, which is no operand
        return (tape.op[node], own, *map(kind, operands(tape, node)))

    return np.array([numbers.setdefault(key(node), len(numbers)) for node in nodes], dtype=np.uint64)


def _search(codes: NDArray[np.uint64], low: int, high: int, found: list[tuple[int, int, int]]) -> None:
    """Add (start, period, turns) of the repeats between two positions, the longest first, then those on either side of it."""
    pending = [(low, high)]
    while pending:
        low, high = pending.pop()
        best = _longest(codes[low:high])
        if best is None:
            continue
        start, period, turns = best
        found.append((low + start, period, turns))
        pending += [(low, low + start), (low + start + period * turns, high)]


def _longest(codes: NDArray[np.uint64]) -> tuple[int, int, int] | None:
    size = len(codes) - _WINDOW + 1
    if size < 2:
        return None
    hashes = np.zeros(size, np.uint64)
    for k in range(_WINDOW):
        hashes = hashes * np.uint64(1000003) + codes[k : k + size] + np.uint64(7)
    order = np.argsort(hashes, kind="stable")
    equal = hashes[order][1:] == hashes[order][:-1]
    distances = Counter((order[1:] - order[:-1])[equal].tolist())
    best: tuple[int, int, int, int] | None = None
    for period, _ in distances.most_common(_DISTANCES):
        same = np.concatenate(([False], codes[:-period] == codes[period:], [False]))
        edges = np.flatnonzero(same[1:] != same[:-1])
        starts, lengths = edges[::2], edges[1::2] - edges[::2]
        longest = int(np.argmax(lengths))
        turns = int(lengths[longest]) // period + 1
        saved = (turns - 1) * period
        if turns >= TURNS and saved >= SAVED and (best is None or (saved, -period) > best[:2]):
            best = (saved, -period, int(starts[longest]), turns)
    return None if best is None else (best[2], -best[1], best[3])


def _consistent(tape: Tape, turns: Sequence[tuple[int, ...]]) -> Roll | None:
    """Return the loop over the longest run of turns, around the middle one, in which the same operands are locals."""
    place = {node: (k, j) for k, turn in enumerate(turns) for j, node in enumerate(turn)}

    def shape(k: int) -> list[int]:
        found = []
        for node in turns[k]:
            for ref in operands(tape, node):
                turn, position = place.get(abs(ref), (-1, -1))
                found.append(position if turn == k else -1)
        return found

    middle = len(turns) // 2
    wanted = shape(middle)
    first = last = middle
    while first > 0 and shape(first - 1) == wanted:
        first -= 1
    while last + 1 < len(turns) and shape(last + 1) == wanted:
        last += 1
    kept = turns[first : last + 1]
    return Roll(tuple(kept)) if len(kept) >= TURNS and (len(kept) - 1) * len(kept[0]) >= SAVED else None
