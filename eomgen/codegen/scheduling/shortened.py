"""Loops with tables of indices that grow with their length -> loops that count instead, cut at changes of the rule.

A loop of a few statements becomes one for each stretch of its tables. A loop of many statements stays one, and its
tables become choices between a few ranges of its counter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any, cast

from eomgen.codegen.program import Expression, Statement
from eomgen.codegen.scheduling.stretches import Stretch, ranges, stretches

#: Loops of fewer iterations keep their tables.
_LONG = 12
#: A loop of no more statements is cut.
_FEW = 8
#: A table of more ranges is no choice.
MOST_RANGES = 4


def counted(
    count: int, statements: Sequence[Statement], read: Sequence[Expression], given: Sequence[Expression]
) -> list[tuple[Any, ...]]:
    """Return the data of statements of kind ``repeat`` with the same effects in the same order as one with tables."""
    whole = (count, tuple(statements), tuple(read), tuple(given))
    if count < _LONG or not any(_is_table(expression) for expression in (*read, *given)):
        return [whole]
    if len(statements) > _FEW:
        return [(count, tuple(statements), tuple(map(_choice, read)), tuple(map(_choice, given)))]
    for order in _orders(count, read, given):
        taken, stored = ([_ordered(expression, order) for expression in side] for side in (read, given))
        varying = [expression for expression in (*taken, *stored) if _varies(expression)]
        moving = [_plain(expression)[0] == "row" for expression in varying]
        result = stretches([_column(expression, count) for expression in varying], moving)
        if 2 * sum(stretch.period for stretch in result) <= count:
            return _cut(result, statements, taken, stored)
    return [whole]


def _cut(
    stretches: Sequence[Stretch],
    statements: Sequence[Statement],
    read: Sequence[Expression],
    given: Sequence[Expression],
) -> list[tuple[Any, ...]]:
    """Return a loop for each stretch."""
    return [
        (
            stretch.count if stretch.count > 1 else stretch.period,
            tuple(statements),
            tuple(_within(expression, stretch) for expression in read),
            tuple(_within(expression, stretch) for expression in given),
            *([stretch.period] if min(stretch.period, stretch.count) > 1 else []),
        )
        for stretch in stretches
    ]


def _orders(count: int, read: Sequence[Expression], given: Sequence[Expression]) -> Iterator[Sequence[int]]:
    """Yield orders of the iterations: the given one, and if none waits for another, orders by operands,
    which keep the results of one loop together."""
    yield range(count)
    rows = [[expression for expression in side if _plain(expression)[0] == "row"] for side in (read, given)]
    taken, stored = ({place for row in side if _plain(row)[1] == "w" for place in _column(row, count)} for side in rows)
    if not taken & stored:
        for row in filter(_is_table, rows[0]):
            places = _column(row, count)
            yield sorted(range(count), key=places.__getitem__)


def _ordered(expression: Expression, order: Sequence[int]) -> Expression:
    """Return an expression of iterations in another order."""
    if order == range(len(order)) or not _varies(expression):
        return expression
    plain = _plain(expression)
    if plain[0] == "numbers":
        return _signed(expression, ("numbers", tuple(plain[1][k] for k in order)))
    places = _column(expression, len(order))
    return _signed(expression, ("row", plain[1], tuple(places[k] for k in order)))


def _plain(expression: Expression) -> tuple[Any, ...]:
    """Return an expression without its minus; of a local value, an empty table."""
    if not isinstance(expression, tuple):
        return ("local",)
    return cast("tuple[Any, ...]", expression[1]) if expression[0] == "neg" and _is_tuple(expression[1]) else expression


def _is_tuple(expression: object) -> bool:
    return isinstance(expression, tuple)


def _varies(expression: Expression) -> bool:
    return _plain(expression)[0] in ("row", "numbers")


def _is_table(expression: Expression) -> bool:
    plain = _plain(expression)
    return plain[0] == "numbers" or (plain[0] == "row" and len(plain) == 3)


def _column(expression: Expression, count: int) -> list[int]:
    """Return the places that an expression reads; for a column of constants distinct squares, equal for equal
    constants, so that no stretch is found in it."""
    plain = _plain(expression)
    if plain[0] == "numbers":
        known: dict[str, int] = {}
        return [known.setdefault(repr(value), len(known)) ** 2 for value in plain[1]]
    return list(plain[2]) if len(plain) == 3 else [plain[2] + plain[3] * k for k in range(count)]


def _signed(like: Expression, plain: Expression) -> Expression:
    """Return an expression with the minus that another has."""
    return ("neg", plain) if isinstance(like, tuple) and like[0] == "neg" else plain


def _within(expression: Expression, stretch: Stretch) -> Expression:
    """Return an expression of the counters of a stretch: k over its periods, j within one."""
    if not _varies(expression):
        return expression
    plain = _plain(expression)
    if plain[0] == "numbers":
        values = plain[1][stretch.start : stretch.start + stretch.period]
        if len({repr(value) for value in values}) == 1:
            return _signed(expression, ("K", values[0]))
        return _signed(expression, ("numbers" if stretch.count == 1 else "cells", values))
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
    return _signed(expression, rule)


def _choice(expression: Expression) -> Expression:
    """Return a table as a choice between ranges of the counter, or as it is if they are many."""
    if not _is_table(expression):
        return expression
    plain = _plain(expression)
    result: list[tuple[Any, ...]] = []
    if plain[0] == "numbers":
        for end, value in enumerate(plain[1], 1):
            if result and repr(result[-1][1]) == repr(value):
                result.pop()
            result.append((end, value))
        return _signed(expression, ("choice", "numbers", *result)) if len(result) <= MOST_RANGES else expression
    result += ranges(plain[2])
    return _signed(expression, ("choice", plain[1], *result)) if len(result) <= MOST_RANGES else expression
