"""Outputs that are sums over elements: the loop of a Map adds each row to the outputs at once, and no row is stored.

Forces and tangents of elements only add up in the rows of their nodes. An output that is a sum of results of Maps and
of other values is set to the sum of these; then each element adds its terms, in the order of the elements. The rows
of 4096 elements of a beam take 4.7 MB if they wait for additions, and 1 kB if each is added at once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from functools import reduce
from itertools import chain
from typing import cast

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass
from eomgen.codegen.program import Addition
from eomgen.symbolic.map import Map
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import ZERO, Ref, Tape

#: Loops of fewer elements keep the rows in the workspace.
_FEW = 4
#: Stretches of elements that add to equally spaced places, at most.
_STRETCHES = 12
#: Operations as globals: looking a member up in an enumeration takes five times as long.
_ADD, _SUB, _MAP = Op.ADD, Op.SUB, Op.MAP


@dataclass(frozen=True)
class Summand:
    """A result of a Map in a component of an output, with a sign."""

    node: int
    output: int
    component: int
    sign: int


@dataclass(frozen=True)
class AccumulatedOutputs:
    """Outputs without the additions of Maps, and the additions of each Map, by the number of the Map."""

    outputs: list[list[Ref]]
    additions: dict[int, tuple[Addition, ...]]
    nodes: dict[int, list[int]]


def accumulate_maps(tape: Tape, outputs: Sequence[Sequence[Ref]]) -> AccumulatedOutputs:
    """Take a Map's results out of the outputs if all its used results are summands of outputs."""
    numbers = {
        number
        for number, loop in enumerate(tape.maps)
        if isinstance(loop, Map) and loop.count >= _FEW and loop.stacked and not (loop.sums or loop.last)
    }
    rest = [list(refs) for refs in outputs]
    if not numbers:
        return AccumulatedOutputs(rest, {}, {})
    live = tape.live(chain.from_iterable(outputs))
    uses = _uses(tape, live, outputs)
    sums, others = _sums(tape, outputs, uses)
    read = Counter(tape.a[node] for node in live if tape.op[node] is _MAP)
    additions: dict[int, tuple[Addition, ...]] = {}
    for number, items in sums.items():
        if number in numbers and len(items) == read[number]:
            made = _additions(tape, number, items)
            if made is not None:
                additions[number] = made
    kept = _without_incomplete(additions, sums)
    for (output, component), refs in others.items():
        if (output, component) not in kept:
            rest[output][component] = reduce(tape.add, refs, ZERO)
    nodes = {number: sorted(item.node for item in sums[number]) for number in additions}
    return AccumulatedOutputs(rest, additions, nodes)


def _sums(
    tape: Tape, outputs: Sequence[Sequence[Ref]], uses: Mapping[int, int]
) -> tuple[dict[int, list[Summand]], dict[tuple[int, int], list[Ref]]]:
    """Return the summands of outputs by the number of their Map, and the other summands of such outputs by place."""
    sums: dict[int, list[Summand]] = {}
    others: dict[tuple[int, int], list[Ref]] = {}
    for output, refs in enumerate(outputs):
        for component, ref in enumerate(refs):
            if ref == ZERO:  # most entries of a whole matrix
                continue
            of_maps, of_others = _summands(tape, ref, uses)
            if of_maps:
                others[output, component] = of_others
            for item in of_maps:
                summand = Summand(abs(item), output, component, 1 if item > 0 else -1)
                sums.setdefault(tape.a[abs(item)], []).append(summand)
    return sums, others


def _without_incomplete(
    additions: dict[int, tuple[Addition, ...]], sums: Mapping[int, Sequence[Summand]]
) -> set[tuple[int, int]]:
    """Drop additions to outputs that keep a summand, and return the outputs that stay as they are.

    A sum of results of several Maps needs all these Maps.
    """
    places = {number: {(item.output, item.component) for item in items} for number, items in sums.items()}
    kept = {place for number, some in places.items() if number not in additions for place in some}
    while dropped := [number for number in additions if not kept.isdisjoint(places[number])]:
        for number in dropped:
            del additions[number]
            kept |= places[number]
    return kept


def _uses(tape: Tape, live: Sequence[int], outputs: Sequence[Sequence[Ref]]) -> dict[int, int]:
    """Return the number of reads and stores of each operation."""
    uses = dict.fromkeys(live, 0)
    gathered: set[int] = set()
    for node in live:
        op = tape.op[node]
        if op in LEAVES or (op is _MAP and tape.a[node] in gathered):
            continue
        if op is _MAP:
            gathered.add(tape.a[node])
        for ref in tape.operands(node):
            uses[abs(ref)] += 1
    for refs in outputs:
        for ref in refs:
            if ref != ZERO:
                uses[abs(ref)] += 1
    return uses


def _summands(tape: Tape, ref: Ref, uses: Mapping[int, int]) -> tuple[list[Ref], list[Ref]]:
    """Return the results of Maps in a sum, and the remaining summands."""
    pending, of_maps, others = [ref], list[Ref](), list[Ref]()
    while pending:
        item = pending.pop()
        node, sign = abs(item), 1 if item > 0 else -1
        op = tape.op[node]
        if op is _MAP and uses[node] == 1:
            of_maps.append(item)
        elif op in (_ADD, _SUB) and uses[node] == 1:
            pending += [(sign if op is _ADD else -sign) * tape.b[node], sign * tape.a[node]]
        elif node != ZERO:
            others.append(item)
    return of_maps, others


def _additions(tape: Tape, number: int, summands: Sequence[Summand]) -> tuple[Addition, ...] | None:
    """Return the places to which elements add rows; None if elements of many kinds add to different outputs."""
    loop = cast("Map", tape.maps[number])
    width = len(loop.stacked)
    places = [[-1] * loop.count for _ in range(width)]
    kinds = [[-1] * loop.count for _ in range(width)]
    for item in summands:
        element, column = divmod(tape.b[item.node], width)
        places[column][element] = item.component
        kinds[column][element] = 2 * item.output + (item.sign < 0)
    pieces = _pieces(np.array([*places, *kinds], dtype=np.int64).T, width)
    if len(pieces) > _STRETCHES:
        return _tabulate(np.array(places, dtype=np.int64), np.array(kinds, dtype=np.int64))
    result: list[Addition] = []
    for first, end in pieces:
        groups: dict[tuple[int, int], list[tuple[int, int]]] = {}
        for column in range(width):
            if (kind := kinds[column][first]) >= 0:
                step = places[column][first + 1] - places[column][first] if end - first > 1 else 0
                groups.setdefault((kind, step), []).append((column, places[column][first]))
        for (kind, step), items in groups.items():
            columns, starts = zip(*items, strict=True)
            result.append(Addition(first, end, kind // 2, -1 if kind % 2 else 1, step, columns, starts))
    return tuple(result)


def _tabulate(places: NDArray[np.int64], kinds: NDArray[np.int64]) -> tuple[Addition, ...] | None:
    """Return additions with tables of places (width, count); columns at a constant distance share a table."""
    if np.any(kinds != kinds[:, :1]):
        return None
    groups: dict[tuple[int, bytes], tuple[list[int], list[int], tuple[int, ...]]] = {}
    for column, (kind, along) in enumerate(zip(kinds[:, 0].tolist(), places, strict=True)):
        if kind < 0:
            continue
        moved = along - along[0]
        columns, offsets, _ = groups.setdefault((kind, moved.tobytes()), ([], [], tuple(moved.tolist())))
        columns.append(column)
        offsets.append(int(along[0]))
    made: list[Addition] = []
    for (kind, _), (columns, offsets, moves) in groups.items():
        least = min(offsets)
        starts = tuple(least + move for move in moves)
        apart = tuple(offset - least for offset in offsets)
        sign = -1 if kind % 2 else 1
        made.append(Addition(0, places.shape[1], kind // 2, sign, 0, tuple(columns), apart, starts))
    return tuple(made)


def _pieces(table: NDArray[np.int64], fixed_from: int) -> list[tuple[int, int]]:
    """Cut rows into stretches (first, end) that move by the same steps, and rows alone; later columns do not move."""
    steps = np.diff(table, axis=0)
    moves = ~np.any(steps[:, fixed_from:], axis=1)
    alike = np.zeros(len(table), dtype=bool)  # whether a row and the following two rows are equally spaced
    alike[:-2] = moves[1:] & moves[:-1] & np.all(steps[1:] == steps[:-1], axis=1)
    result: list[tuple[int, int]] = []
    first = 0
    while first < len(table):
        end = first + 1
        if alike[first]:
            while alike[end - 1]:
                end += 1
            end += 1
        result.append((first, end))
        first = end
    return result
