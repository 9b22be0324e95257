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
from eomgen.codegen.scheduling.stretches import FEWEST
from eomgen.symbolic.map import Map
from eomgen.symbolic.operations import LEAVES, Op
from eomgen.symbolic.tape import ZERO, Ref, Tape

#: Runs of equally spaced places that get code of their own, at most.
FEW_RUNS = 12
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
    """Outputs without the summands that loops of Maps add, and the additions of these loops. ``outputs`` are the
    remaining references of each output; ``additions`` and ``nodes`` map the number of a Map on the tape to the Map's
    additions, and to the nodes of the results that are added."""

    outputs: list[list[Ref]]
    additions: dict[int, tuple[Addition, ...]]
    nodes: dict[int, list[int]]


def accumulate_maps(tape: Tape, outputs: Sequence[Sequence[Ref]]) -> AccumulatedOutputs:
    """Return the outputs without results of Maps that loops can add themselves, and the additions of these loops. A Map
    qualifies with ``FEWEST`` elements or more and only rows as results, if all used results are summands of outputs;
    with fewer elements the rows stay in the workspace. The remaining sums are recorded on the tape; ``outputs`` itself
    stays unchanged."""
    numbers = {
        number
        for number, loop in enumerate(tape.maps)
        if isinstance(loop, Map) and loop.count >= FEWEST and loop.stacked and not (loop.sums or loop.last)
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
    """Return the results of Maps that are summands of outputs, and the other summands of the same components. The first
    mapping has the number of the Map as key; the second has (output number, component)."""
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
    """Drop Maps from ``additions`` (in place) whose components need a summand of a Map that does not add by itself.
    Returns the (output number, component) that therefore stay ordinary sums: a sum over Maps needs them all."""
    places = {number: {(item.output, item.component) for item in items} for number, items in sums.items()}
    ordinary_sums = {entry for number, some in places.items() if number not in additions for entry in some}
    while dropped := [number for number in additions if not ordinary_sums.isdisjoint(places[number])]:
        for number in dropped:
            del additions[number]
            ordinary_sums |= places[number]
    return ordinary_sums


def _uses(tape: Tape, live: Sequence[int], outputs: Sequence[Sequence[Ref]]) -> dict[int, int]:
    """Return the number of reads and stores of each live operation; operands of a Map count once."""
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
    """Return the results of Maps in the sum that a reference stands for, and the remaining summands, with signs. Only
    sums, differences and results of Maps with one use (``uses``) are split."""
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
    """Return the additions of the rows of Map ``number`` to outputs: by equally spaced stretches of elements, or by
    tables. None if a column of the rows belongs to different outputs or signs and stretches are many."""
    loop = cast("Map", tape.maps[number])
    width = len(loop.stacked)
    places = [[-1] * loop.count for _ in range(width)]
    kinds = [[-1] * loop.count for _ in range(width)]
    for item in summands:
        element, column = divmod(tape.b[item.node], width)
        places[column][element] = item.component
        kinds[column][element] = 2 * item.output + (item.sign < 0)
    pieces = _pieces(np.array([*places, *kinds], dtype=np.int64).T, width)
    if len(pieces) > FEW_RUNS:
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
    """Return additions with tables of the components to which each element adds; None if a column has different kinds.
    ``places`` and ``kinds`` have the shape (width, count): component of the output, and 2 output + (1 for a negative),
    both -1 for a column that is not added. Columns whose places differ by a constant share a table."""
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
    """Return the stretches (first, end) of rows of a table that change by equal steps from row to row, and single rows.
    Together the stretches cover all rows in order. Columns from ``fixed_from`` on must be constant within a stretch."""
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
