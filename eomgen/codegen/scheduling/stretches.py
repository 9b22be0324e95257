"""Tables of indices as rules: rows that repeat one period, each time moved by the same step; loops with tables that
grow with their length become loops that count.

Equal parts of a scene are numbered alike, so tables of the places read and stored by a loop repeat but at the ends.
Differences of neighbouring rows then repeat exactly, and repeats are found by hashes of windows (Karp and Rabin 1987).

A loop of a few statements becomes one for each stretch of its tables. A loop of many statements stays one, and its
tables become choices between a few ranges of its counter.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import dataclass
from eomgen.codegen.program import Expression, Statement

#: Least number of repetitions that become a loop, and of rows that a loop saves.
FEWEST, _SAVED = 4, 12
#: Lengths of the hashed windows.
_WINDOWS = (1, 5, 24)


@dataclass(frozen=True)
class RowStretch:
    """Rows ``start .. stop - 1``: row ``start + period k + j`` is row ``start + j`` plus k times the step of each
    column."""

    start: int
    period: int
    count: int

    @property
    def stop(self) -> int:
        return self.start + self.period * self.count


def stretches(columns: Sequence[Sequence[int]], moving: Sequence[bool]) -> list[RowStretch]:
    """Cut the rows of a table into stretches that together cover all rows in order; a stretch with count 1 does not
    repeat.

    Parameters
    ----------
    columns : columns of the table, of equal length
    moving : which columns may have a step other than 0
    """
    table = np.array(columns, dtype=np.int64).T
    fixed = [column for column, moves in enumerate(moving) if not moves]
    in_order = sorted(_search(table, fixed), key=lambda stretch: stretch.start)
    result: list[RowStretch] = []
    end = 0
    for stretch in [*in_order, RowStretch(len(table), 1, 0)]:
        if stretch.start > end:
            result.append(RowStretch(end, stretch.start - end, 1))
        if stretch.count:
            result.append(stretch)
        end = stretch.stop
    return result


#: Largest integer of C.
_LARGEST = int(np.iinfo(np.int32).max)


def ranges(indices: Sequence[int]) -> list[tuple[int, int, int]]:
    """Return ranges (end, start, step) of equally spaced indices: number k is start + step k for k below the end.
    Ranges follow one another; starts and products step k fit into an int of C."""
    result: list[tuple[int, int, int]] = []
    for k, index in enumerate(indices):
        if result and result[-1][1] + result[-1][2] * k == index and abs(result[-1][2] * k) <= _LARGEST:
            result[-1] = (k + 1, *result[-1][1:])
        else:
            step = indices[k + 1] - index if k + 1 < len(indices) else 0
            if max(abs(step) * (k + 1), abs(index - step * k)) > _LARGEST:
                step = 0
            result.append((k + 1, index - step * k, step))
    return result


def _search(table: NDArray[np.int64], fixed: Sequence[int]) -> list[RowStretch]:
    """Return stretches of a table, disjoint, in no order. Columns ``fixed`` must not move from period to period."""
    if len(table) < 2:
        return []
    codes = np.unique(np.diff(table, axis=0), axis=0, return_inverse=True)[1].reshape(-1)

    def judge(start: int, period: int, length: int) -> tuple[int, int]:
        count = (length + period + 1) // period
        saved = (count - 1) * period
        equal = saved >= _SAVED and np.array_equal(table[start + period, fixed], table[start, fixed])
        return count, saved if equal else 0

    return [RowStretch(*stretch) for stretch in repetitions(codes.astype(np.uint64), _WINDOWS, judge, between=1)]


#: From start, period and number of equal pairs of a repetition with ``FEWEST`` or more to its count, and the
#: items saved; 0 for too few.
Judge = Callable[[int, int, int], tuple[int, int]]


def repetitions(
    codes: NDArray[np.uint64], windows: Sequence[int], judge: Judge, between: int = 0
) -> Iterator[tuple[int, int, int]]:
    """Yield start, period and count of repetitions in a sequence of codes, disjoint, in no order: the repetition that
    saves most, then repetitions before and after it.

    Parameters
    ----------
    windows : lengths of the windows whose distances are candidates of periods
    between : 1 for codes of differences of neighbours, 0 for codes of the items themselves
    """
    pending = [(0, len(codes) + between)]
    while pending:
        low, high = pending.pop()
        inside = codes[low : max(low, high - between)]
        best: tuple[int, int, int, int] | None = None
        for period in _periods(inside, windows):
            same = np.concatenate(([False], inside[:-period] == inside[period:], [False]))
            edges = np.flatnonzero(same[1:] != same[:-1]).reshape(-1, 2)
            for start, end in edges[edges[:, 1] - edges[:, 0] + between >= (FEWEST - 1) * period].tolist():
                count, saved = judge(low + start, period, end - start)
                if saved and (best is None or (saved, -period) > best[:2]):
                    best = (saved, -period, low + start, count)
        if best is not None:
            _, negative, start, count = best
            yield start, -negative, count
            pending += [(low, start), (start - negative * count, high)]


def _periods(codes: NDArray[np.uint64], windows: Sequence[int]) -> list[int]:
    """Return candidate periods of the codes, sorted: the twelve most frequent distances of equal windows by length."""
    distances = [_equal_windows(codes, window).most_common(12) for window in windows]
    return sorted({distance for common in distances for distance, _ in common})


def _equal_windows(codes: NDArray[np.uint64], window: int) -> Counter[int]:
    """Return the frequencies of the distances between a window of codes and the next window of equal codes. Windows are
    compared by hashes of ``window`` codes."""
    size = max(0, len(codes) - window + 1)
    hashes = np.zeros(size, np.uint64)
    for k in range(window):
        hashes = hashes * np.uint64(1000003) + codes[k : k + size] + np.uint64(7)
    order = np.argsort(hashes, kind="stable")
    equal = hashes[order][1:] == hashes[order][:-1]
    return Counter((order[1:] - order[:-1])[equal].tolist())


#: A table of more ranges is not printed as a choice.
MOST_RANGES = 4


def repeat_statements(
    count: int, statements: Sequence[Statement], read: Sequence[Expression], targets: Sequence[Expression]
) -> list[tuple[Any, ...]]:
    """Return the data of one or several ``repeat`` statements that have the effect of one loop over ``count``
    iterations. ``statements`` is the body, ``read`` and ``targets`` the expressions of inputs and outputs. Long loops
    of few statements with tables are cut into counting loops; tables of longer bodies become choices between ranges."""
    whole = (count, tuple(statements), tuple(read), tuple(targets))
    if count < _SAVED or not any(_is_table(expression) for expression in (*read, *targets)):
        return [whole]
    if len(statements) > 8:  # each part would repeat the text
        return [(count, tuple(statements), tuple(map(_choice, read)), tuple(map(_choice, targets)))]
    for order in _orders(count, read, targets):
        taken, stored = ([_reorder(expression, order) for expression in side] for side in (read, targets))
        varying = [expression for expression in (*taken, *stored) if _varies(expression)]
        moving = [_plain(expression)[0] == "row" for expression in varying]
        result = stretches([_column(expression, count) for expression in varying], moving)
        if 2 * sum(stretch.period for stretch in result) <= count:
            return _cut(result, statements, taken, stored)
    return [whole]


def _cut(
    stretches: Sequence[RowStretch],
    statements: Sequence[Statement],
    read: Sequence[Expression],
    targets: Sequence[Expression],
) -> list[tuple[Any, ...]]:
    """Return the data of a ``repeat`` statement for each stretch of iterations, with a fifth number for nested
    loops."""
    return [
        (
            stretch.count if stretch.count > 1 else stretch.period,
            tuple(statements),
            tuple(_within(expression, stretch) for expression in read),
            tuple(_within(expression, stretch) for expression in targets),
            *([stretch.period] if min(stretch.period, stretch.count) > 1 else []),
        )
        for stretch in stretches
    ]


def _orders(count: int, read: Sequence[Expression], targets: Sequence[Expression]) -> Iterator[Sequence[int]]:
    """Yield orders of the iterations that give equal results: the original one first. If no iteration reads a workspace
    slot that another one stores, also the orders sorted by each table of places that is read; these keep the results of
    one loop together."""
    yield range(count)
    rows = [[expression for expression in side if _plain(expression)[0] == "row"] for side in (read, targets)]
    taken, stored = ({slot for row in side if _plain(row)[1] == "w" for slot in _column(row, count)} for side in rows)
    if not taken & stored:
        for row in filter(_is_table, rows[0]):
            places = _column(row, count)
            yield sorted(range(count), key=places.__getitem__)


def _reorder(expression: Expression, order: Sequence[int]) -> Expression:
    """Return an expression of the iteration number with iterations reordered: ``order[k]`` becomes iteration k."""
    if order == range(len(order)) or not _varies(expression):
        return expression
    plain = _plain(expression)
    if plain[0] == "numbers":
        return _with_sign(expression, ("numbers", tuple(plain[1][k] for k in order)))
    places = _column(expression, len(order))
    return _with_sign(expression, ("row", plain[1], tuple(places[k] for k in order)))


def _plain(expression: Expression) -> tuple[Any, ...]:
    """Return an expression without a minus; for a local value, an empty table."""
    if not isinstance(expression, tuple):
        return ("local",)
    inner: Any = expression[1]
    return inner if expression[0] == "neg" and isinstance(inner, tuple) else expression


def _varies(expression: Expression) -> bool:
    return _plain(expression)[0] in ("row", "numbers")


def _is_table(expression: Expression) -> bool:
    plain = _plain(expression)
    return plain[0] == "numbers" or (plain[0] == "row" and len(plain) == 3)


def _column(expression: Expression, count: int) -> list[int]:
    """Return the integer places of an expression in iterations 0 to count - 1. For a table of constants, squares of
    integers, equal for equal constants and irregularly spaced, so that no stretch is found in different constants."""
    plain = _plain(expression)
    if plain[0] == "numbers":
        known: dict[str, int] = {}
        return [known.setdefault(repr(value), len(known)) ** 2 for value in plain[1]]
    return list(plain[2]) if len(plain) == 3 else [plain[2] + plain[3] * k for k in range(count)]


def _with_sign(like: Expression, plain: Expression) -> Expression:
    """Return an expression with the minus that another has."""
    return ("neg", plain) if isinstance(like, tuple) and like[0] == "neg" else plain


def _within(expression: Expression, stretch: RowStretch) -> Expression:
    """Return an expression for the iterations of one stretch, by the counters k over periods and j within a period. For
    a stretch with count 1, k counts the rows."""
    if not _varies(expression):
        return expression
    plain = _plain(expression)
    if plain[0] == "numbers":
        values = plain[1][stretch.start : stretch.start + stretch.period]
        if len({repr(value) for value in values}) == 1:
            return _with_sign(expression, ("K", values[0]))
        return _with_sign(expression, ("numbers" if stretch.count == 1 else "cells", values))
    places = _column(expression, stretch.stop)[stretch.start :]
    first = places[: stretch.period]
    inner = first[1] - first[0] if len(first) > 1 else 0
    is_even = all(after - before == inner for before, after in pairwise(first))
    if stretch.count == 1:
        rule: tuple[Any, ...] = ("row", plain[1], first[0], inner) if is_even else ("row", plain[1], tuple(first))
    else:
        step = places[stretch.period] - first[0]
        rule = ("row", plain[1], first[0], step) if stretch.period == 1 else ("cell", plain[1], first[0], inner, step)
        if not is_even:
            rule = ("cell", plain[1], tuple(first), step)
    return _with_sign(expression, rule)


def _choice(expression: Expression) -> Expression:
    """Return a table as a choice between at most ``MOST_RANGES`` ranges of the counter; other expressions unchanged."""
    if not _is_table(expression):
        return expression
    plain = _plain(expression)
    result: list[tuple[Any, ...]] = []
    if plain[0] == "numbers":
        for end, value in enumerate(plain[1], 1):
            if result and repr(result[-1][1]) == repr(value):
                result.pop()
            result.append((end, value))
        return _with_sign(expression, ("choice", "numbers", *result)) if len(result) <= MOST_RANGES else expression
    result += ranges(plain[2])
    return _with_sign(expression, ("choice", plain[1], *result)) if len(result) <= MOST_RANGES else expression
