"""Loop rerolling: repeated sequences of operations on the tape, as in chains of identical bodies, become loops.

Recursions over bodies record the same operations for each body in turn. If a sequence of operation codes repeats
with some period, one period becomes the body of a loop. Operands within the same iteration are locals, all others are
workspace or array entries at looked-up indices. Repeats are found by hashes of windows (Karp and Rabin 1987).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass
from eomgen.symbolic.operations import UNARY, Op
from eomgen.symbolic.tape import Ref, Tape
from eomgen.system.system import INPUT_BLOCKS

_ARITY = [2] * (max(Op) + 1)
for _op in UNARY:
    _ARITY[_op] = 1
_ARITY[Op.SELECT] = 3
_ARITY[Op.CURVE] = 1

#: Least number of operations that a loop removes from the text.
MINIMUM_SAVED = 150
#: Least number of iterations of a loop.
MINIMUM_ITERATIONS = 4
#: Length of the hashed windows, in operations, and number of candidate periods.
_WINDOW = 24
_DISTANCES = 12

#: Input blocks that are no arrays: structs and a number, with components that a loop cannot index.
UNINDEXED = frozenset({"p", "t", "base"})
#: Input blocks of a model's functions that a loop can index.
_ARRAYS = frozenset(INPUT_BLOCKS) - UNINDEXED
#: Operations as globals: looking a member up in an enumeration takes five times as long.
_CONST, _INPUT, _MAP, _CURVE, _SIN, _COS = Op.CONST, Op.INPUT, Op.MAP, Op.CURVE, Op.SIN, Op.COS


@dataclass(frozen=True)
class RerolledLoop:
    """A loop; ``iterations[k][j]`` is the tape node of operation j in iteration k."""

    iterations: tuple[tuple[int, ...], ...]

    @property
    def period(self) -> int:
        return len(self.iterations[0])


def operands(tape: Tape, node: int) -> tuple[int, ...]:
    """Return the operand references of an operation that is no result of a Map (faster than ``Tape.operands``)."""
    arity = _ARITY[tape.op[node]]
    if arity == 2:
        return (tape.a[node], tape.b[node])
    return (tape.a[node],) if arity == 1 else (tape.a[node], tape.b[node], tape.c[node])


def find_loops(tape: Tape, live: Sequence[int]) -> list[RerolledLoop]:
    """Return the loops in a sequence of live tape nodes, in order and disjoint; none spans the call of a Map."""
    loops = []
    for is_map, nodes in groupby(live, lambda node: tape.op[node] is _MAP):
        if is_map:
            continue
        fixed = [node for node in nodes if not is_circular(tape, node)]
        repeats: list[tuple[int, int, int]] = []
        _search(_codes(tape, fixed), 0, len(fixed), repeats)
        for start, period, iterations in sorted(repeats):
            loop = _consistent(
                tape, [tuple(fixed[start + k * period : start + (k + 1) * period]) for k in range(iterations)]
            )
            if loop is not None:
                loops.append(loop)
    return loops


def is_circular(tape: Tape, node: int) -> bool:
    """Return whether a node is a sine or cosine of an input: all of a function are computed at once."""
    return tape.op[node] in (_SIN, _COS) and tape.op[abs(tape.a[node])] is _INPUT


def _codes(tape: Tape, nodes: Sequence[int]) -> NDArray[np.uint64]:
    """Return an integer per operation, equal for operations with equal code, signs and kinds of operands."""
    numbers: dict[tuple[object, ...], int] = {}

    def kind(ref: Ref) -> object:
        node = abs(ref)
        op = tape.op[node]
        if op is _CONST:
            return "number"
        if op is _INPUT:
            symbol = tape.inputs[tape.a[node]]
            return (symbol.block if symbol.block in _ARRAYS else symbol, ref < 0)
        return ref < 0

    def key(node: int) -> tuple[object, ...]:
        own = node if tape.op[node] is _CURVE else 0  # a curve is looked up by its number, which is no operand
        return (tape.op[node], own, *map(kind, operands(tape, node)))

    return np.array([numbers.setdefault(key(node), len(numbers)) for node in nodes], dtype=np.uint64)


def _search(codes: NDArray[np.uint64], low: int, high: int, repeats: list[tuple[int, int, int]]) -> None:
    """Append (start, period, iterations) of the repeats in [low, high): the longest, then repeats on both sides."""
    pending = [(low, high)]
    while pending:
        low, high = pending.pop()
        best = _longest(codes[low:high])
        if best is None:
            continue
        start, period, iterations = best
        repeats.append((low + start, period, iterations))
        pending += [(low, low + start), (low + start + period * iterations, high)]


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
        iterations = int(lengths[longest]) // period + 1
        saved = (iterations - 1) * period
        if (
            iterations >= MINIMUM_ITERATIONS
            and saved >= MINIMUM_SAVED
            and (best is None or (saved, -period) > best[:2])
        ):
            best = (saved, -period, int(starts[longest]), iterations)
    return None if best is None else (best[2], -best[1], best[3])


def _consistent(tape: Tape, iterations: Sequence[tuple[int, ...]]) -> RerolledLoop | None:
    """Return the loop over the longest run of iterations around the middle one that have the same local operands."""
    alike = _alike(tape, np.array(iterations, dtype=np.int64))
    first = last = len(iterations) // 2
    while first > 0 and alike[first - 1]:
        first -= 1
    while last + 1 < len(iterations) and alike[last + 1]:
        last += 1
    kept = iterations[first : last + 1]
    return (
        RerolledLoop(tuple(kept))
        if len(kept) >= MINIMUM_ITERATIONS and (len(kept) - 1) * len(kept[0]) >= MINIMUM_SAVED
        else None
    )


def _alike(tape: Tape, nodes: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return the mask of iterations, (count, period), with the same local operands as the middle one."""
    count, period = nodes.shape
    low = int(nodes.min())
    position = np.full(int(nodes.max()) - low + 1, -1, dtype=np.int64)
    position[nodes - low] = np.arange(count * period).reshape(count, period)
    arity = np.array([_ARITY[tape.op[node]] for node in nodes[0]])
    result = np.ones(count, dtype=bool)
    flat = nodes.ravel().tolist()
    for number, given in enumerate((tape.a, tape.b, tape.c)):
        taken = arity > number
        if not np.any(taken):
            break
        refs = np.abs(np.array([given[node] for node in flat], dtype=np.int64).reshape(count, period)[:, taken])
        inside = (refs >= low) & (refs < low + len(position))
        at = np.where(inside, position[np.where(inside, refs - low, 0)], -1)
        local = np.where(at // period == np.arange(count)[:, np.newaxis], at % period, -1)
        result &= np.all(local == local[count // 2], axis=1)
    return result
