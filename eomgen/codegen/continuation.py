"""Programs of scenes with many equal parts (elements of a beam), continued from Programs of scenes with few: integers
and lists that grow evenly.

Equal parts of a scene are numbered alike, and loops run over them in the C, so a Program of n parts differs from one of
n + d in integers that grow evenly and in lists that have some items more. Three samples, of n, n + d and n + 2 d parts,
determine such data and leave one number to check for each that they determine: data that are not as regular are
refused, never guessed.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from eomgen.base.data import fields, is_dataclass, replace
from eomgen.base.rounding import SUMMED
from eomgen.codegen.program import Program
from eomgen.codegen.scheduling.matrix_loops import with_assembly
from eomgen.system.sparsity import packed_places, unpacked_places

#: Three samples, of n, n + d and n + 2 d equal parts.
Samples = tuple[Any, Any, Any]
#: Returns the continuation of numbers that follow another rule than ``extrapolate``, or None if there is none.
Known = Callable[[Samples], Any]
#: Numbers in texts: a number with decimals is not a count, but ``beam.7`` ends in one.
_NUMBER = re.compile(r"((?<![A-Za-z_\d])\d+\.\d+(?:e[-+]?\d+)?|\d+)")
_SEPARATOR = ", "


class IrregularSamples(Exception):  # no error: the caller derives all parts then
    """The samples differ by more than evenly growing integers and lists."""


def extrapolate(samples: Samples, number: int, known: Known = lambda _: None) -> Any:
    """Return data of n + ``number`` d equal parts, of the same types as the samples.

    Integers, also within texts, are continued linearly; lists that grow get repeated items inserted.

    Parameters
    ----------
    samples : plain data (dataclasses, mappings, sequences, texts, numbers) of n, n + d and n + 2 d parts
    number : 3 or more
    known : continues growing lists of numbers that are not constant, as places along a beam are: takes three lists and
        returns the continued list, or None to decline

    Raises
    ------
    IrregularSamples
        An integer that does not grow evenly, a list without a repeated part, or another difference.
    """
    first, second, third = samples
    kind = type(first)
    if not (kind is type(second) is type(third)):
        raise IrregularSamples(f"{kind.__name__} and {type(third).__name__}")
    if kind is int:
        return first + _even(first, second, third) * number
    if kind is str:
        return _text(samples, number)
    if isinstance(first, list | tuple):
        if len(first) == len(second) == len(third):
            items = [extrapolate(items, number, known) for items in zip(first, second, third, strict=True)]
        else:
            items = _longer(samples, number, known)
        return kind(items)
    if isinstance(first, dict):
        if not first.keys() == second.keys() == third.keys():
            raise IrregularSamples("other keys")
        return {key: extrapolate((first[key], second[key], third[key]), number, known) for key in first}
    if is_dataclass(first):
        values = {
            item.name: extrapolate(
                cast("Samples", tuple(getattr(sample, item.name) for sample in samples)), number, known
            )
            for item in fields(first)
        }
        return kind(**values)
    if repr(first) == repr(second) == repr(third):
        return first
    if kind is float and (made := known(((first,), (second,), (third,)))) is not None:
        return made[0]
    raise IrregularSamples(f"{first!r}, {second!r}, {third!r}")


def continued_sums(samples: tuple[Sequence[float], ...], number: int) -> list[float]:
    """Return the list of numbers for n + ``number`` d parts, from the lists for n, n + d and n + 2 d parts. Numbers are
    equal in all samples, or grow evenly up to rounding, as sums along a chain do; the list may grow.
    Raises IrregularSamples."""
    rows = [np.array([[0.0, value] for value in sample]).reshape(-1, 2) for sample in samples]
    made: list[float] = _extrapolate_rows(rows, number)[:, 1].tolist()
    return made


def continued_integers(samples: tuple[NDArray[np.int64], ...], number: int) -> NDArray[np.int64]:
    """Return the table of integers for n + ``number`` d parts, (items, columns), one row for each item of a list.

    ``samples`` are the tables for n, n + d and n + 2 d parts with equal columns. If the number of rows does not grow,
    all entries are continued linearly from the first two samples. Raises IrregularSamples.
    """
    growth = _even(*map(len, samples))
    if not growth:
        return samples[0] + (samples[1] - samples[0]) * number
    one_kind = [np.insert(sample, 0, 0, axis=1) for sample in samples]
    return _extrapolate_rows(one_kind, number)[:, 1:]


def _even(first: int, second: int, third: int) -> int:
    if second - first != third - second:
        raise IrregularSamples(f"{first}, {second}, {third}")
    return second - first


def _text(samples: Samples, number: int) -> str:
    parts = [_NUMBER.split(sample) for sample in samples]
    if len({len(part) for part in parts}) > 1:
        lists = [sample.split(_SEPARATOR) for sample in samples]
        return _SEPARATOR.join(_longer(cast("Samples", tuple(lists)), number, lambda _: None))
    made = []
    for items in zip(*parts, strict=True):
        if len(set(items)) == 1:
            made.append(items[0])
        elif all(map(_is_count, items)):
            first, second, third = map(int, items)
            made.append(str(first + _even(first, second, third) * number))
        else:
            raise IrregularSamples(items[0])
    return "".join(made)


def _is_count(text: str) -> bool:
    return text.isdecimal() and str(int(text)) == text


def _longer(samples: Samples, number: int, known: Known) -> list[Any]:
    """Return a list that grows with the number of parts, continued to n + ``number`` d parts. The list has a beginning,
    a block of items for each further d parts, and an end. Lists of integers are continued as numbers; lists that
    ``known`` continues are taken from there; other items are split into shape and integers. Raises IrregularSamples for
    a list that becomes shorter or does not repeat."""
    growth = _even(*map(len, samples))
    if growth < 0:
        raise IrregularSamples("a list that becomes shorter")
    if all(type(item) is int for sample in samples for item in sample):
        rows = cast("Any", tuple(np.array(sample, dtype=np.int64).reshape(-1, 1) for sample in samples))
        return list(map(int, continued_integers(rows, number)[:, 0].tolist()))
    made = known(samples)
    if made is not None:
        return list(made)
    shapes: dict[Any, int] = {}
    flat = [[_flat(item) for item in sample] for sample in samples]
    width = max((len(values) for items in flat for _, values in items), default=0)
    rows = [
        np.array(
            [[shapes.setdefault(shape, len(shapes)), *values, *[0] * (width - len(values))] for shape, values in items],
            dtype=np.int64,
        ).reshape(len(items), width + 1)
        for items in flat
    ]
    made = _extrapolate_rows(rows, number)
    if (
        len(shapes) == 1
        and isinstance(only := next(iter(shapes)), tuple)
        and only[0] in (list, tuple)
        and set(only[1:]) == {int}
    ):
        rows_of_integers = made[:, 1 : len(only)].tolist()
        return rows_of_integers if only[0] is list else list(map(tuple, rows_of_integers))
    by_number = list(shapes)
    return [_build(by_number[kind], iter(values)) for kind, *values in made.tolist()]


#: Rows of integers, or of numbers that grow evenly but for rounding.
_Table = NDArray[Any]
#: Of three samples the rows of a list: the kind of an item, which items of other samples share, and the item's numbers.
_Rows = Sequence[_Table]


def _same(first: _Table, second: _Table) -> NDArray[np.bool_]:
    """Return whether integers are equal, or numbers but for rounding."""
    slack = 0 if first.dtype == np.int64 else SUMMED * np.maximum(np.abs(first), np.abs(second))
    return np.asarray(np.abs(first - second) <= slack)


def _extrapolate_rows(rows: _Rows, number: int) -> _Table:
    """Return the rows for n + ``number`` d parts from the rows of three samples, (items, 1 + columns) with the kind
    first. A list may grow in several places, and is continued section by section: one over the accelerations and the
    constraints of a chain grows in both. Raises IrregularSamples."""
    made = []
    while (growth := _even(*map(len, rows))) or len(rows[0]):
        try:
            part, grown = rows, _extrapolate_block(rows, growth, number)
        except IrregularSamples:
            part, grown = _first_section(rows, growth, number)
        made.append(grown)
        rows = [row[len(taken) :] for row, taken in zip(rows, part, strict=True)]
    return np.concatenate(made)


def _first_section(rows: _Rows, growth: int, number: int) -> tuple[_Rows, _Table]:
    """Return the first section of the rows of three samples that grows in one place, and this section for n +
    ``number`` d parts. ``growth`` is the number of rows by which the whole list grows from sample to sample. Of all
    smaller growths, the one after which the most rows continue unchanged or evenly is chosen. Raises
    IrregularSamples."""
    end = _prefix(rows)
    best = 0
    made: tuple[_Rows, _Table] | None = None
    for size in range(1, growth):
        alike = _prefix([row[end + size * k :] for k, row in enumerate(rows)])
        if alike > best:
            part = [row[: end + size * k] for k, row in enumerate(rows)]
            with contextlib.suppress(IrregularSamples):
                made, best = (part, _extrapolate_block(part, size, number)), alike
    if made is None:
        raise IrregularSamples("a list without a repeated part")
    return made


def _extrapolate_block(rows: _Rows, growth: int, number: int) -> _Table:
    """Return the rows for n + ``number`` d parts if ``growth`` rows are inserted at one place with each further d
    parts. With ``growth`` 0 all rows must continue evenly one by one. Raises IrregularSamples otherwise."""
    if not growth:
        if _prefix(rows) < len(rows[0]):
            raise IrregularSamples("a list of other items")
        even: _Table = rows[0] + (rows[1] - rows[0]) * number
        return even
    start, size = _split(rows, growth), len(rows[0])
    head = rows[0][:start] + (rows[1][:start] - rows[0][:start]) * number
    end, moved = rows[0][start:], rows[1][len(rows[1]) - (size - start) :]
    base, step, rate = _rule(rows, start, growth)
    blocks = (base + rate * number) + np.arange(number)[:, np.newaxis, np.newaxis] * step
    grown: _Table = np.concatenate([head, blocks.reshape(number * growth, -1), end + (moved - end) * number])
    return grown


def _split(rows: _Rows, growth: int) -> int:
    """Return the index of the row at which blocks of ``growth`` rows are inserted from sample to sample. One more
    block, before or after the inserted blocks, must follow the same rule, as a check. Indices near the middle of the
    possible range are tried first, 400 at most. Raises IrregularSamples if none fits."""
    shortest = len(rows[0])
    before = _prefix(rows)
    behind = _prefix([row[::-1] for row in rows])
    least, most = max(shortest - behind, 0), min(before, shortest)
    middle = (least + most) // 2
    # a period of a list has fewer items than 400
    for start in sorted(range(least, most + 1), key=lambda start: abs(start - middle))[:400]:
        if _repeats(rows, start, growth):
            return start
    raise IrregularSamples("a list without a repeated part")


def _prefix(rows: _Rows) -> int:
    """Return the number of leading rows that grow evenly over the three samples, with the kind (column 0) unchanged."""
    size = len(rows[0])
    first, second, third = (row[:size] for row in rows)
    good = np.all(_same(2 * second - first, third), axis=1) & (first[:, 0] == second[:, 0])
    return size if good.all() else int(np.argmin(good))


def _repeats(rows: _Rows, start: int, growth: int) -> bool:
    """Return whether the blocks of ``growth`` rows around row ``start`` grow evenly from block to block and sample to
    sample. At least one block besides the inserted blocks must exist before or after, and the kind (column 0) must not
    change."""
    before, behind = int(start >= growth), int(len(rows[0]) - start >= growth)
    if not before + behind:
        return False
    base, step, rate = _rule(rows, start, growth)
    if step[:, 0].any() or rate[:, 0].any():
        return False
    return all(
        np.all(
            _same(
                rows[sample][start + block * growth : start + (block + 1) * growth], base + step * block + rate * sample
            )
        )
        for sample in range(3)
        for block in range(-before, sample + behind)
    )


def _rule(rows: _Rows, start: int, growth: int) -> tuple[_Table, _Table, _Table]:
    """Return the arrays base, step and rate, (growth, columns): block b of sample k is base + step b + rate k. Block 0
    begins at row ``start``, and a block has ``growth`` rows."""
    base, left, right = (
        sample[start + block * growth : start + (block + 1) * growth]
        for sample, block in ((rows[1], 0), (rows[2], 0), (rows[2], 1))
    )
    return 2 * base - left, right - left, left - base


def _flat(value: Any) -> tuple[Hashable, list[int]]:
    """Return the shape of nested data with all counts removed, hashable, and the list of the counts in order."""
    numbers: list[int] = []
    return _shape(value, numbers), numbers


def _shape(value: Any, numbers: list[int]) -> Hashable:
    """Return nested data with all counts removed, hashable, and append the counts to ``numbers`` in order of
    occurrence. Counts are integers, also within texts if without decimals and leading zeros, but not keys of dicts.
    Other constants, such as floats, are kept with their text, so that shapes are equal only if the constants are."""
    kind = type(value)
    if kind is int:
        numbers.append(value)
        return int
    if kind is str:
        parts = _NUMBER.split(value)
        for index in range(1, len(parts), 2):
            if _is_count(parts[index]):
                numbers.append(int(parts[index]))
                parts[index] = ""
        return (str, *parts)
    if isinstance(value, list | tuple):
        return (kind, *[_shape(item, numbers) for item in value])
    if isinstance(value, dict):
        return (kind, *[(key, _shape(item, numbers)) for key, item in value.items()])
    if is_dataclass(value):
        return (kind, *[_shape(getattr(value, item.name), numbers) for item in fields(value)])
    return (None, kind, repr(value), _Constant(value))


class _Constant:
    """A value in a shape, with a text for comparisons of shapes."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Constant)

    def __hash__(self) -> int:
        return 0


def _build(shape: Any, numbers: Iterator[int]) -> Any:
    if shape is int:
        return next(numbers)
    kind, *parts = shape
    if kind is None:
        return parts[2].value
    if kind is str:
        parts[1::2] = [part or str(next(numbers)) for part in parts[1::2]]
        return "".join(parts)
    if kind is dict:
        return {key: _build(part, numbers) for key, part in parts}
    built = [_build(part, numbers) for part in parts]
    return kind(built) if kind in (list, tuple) else kind(*built)


def continued_program(programs: Sequence[Program], number: int, known: Known) -> Program:
    """Return the Program of n + ``number`` d equal parts, without an initial state.

    Parameters
    ----------
    programs : Programs of n, n + d and n + 2 d parts
    number : 3 or more
    known : continues lists of numbers that are not constant, as in ``extrapolate``

    Raises
    ------
    IrregularSamples
        The Programs differ by more than evenly growing integers and lists.
    """
    no_start: dict[str, Any] = dict.fromkeys(("initial_q", "initial_v", "asked_q", "asked_v"), ())
    plain = [replace(program, patterns={}, method=_assemble(program), **no_start) for program in programs]
    made = cast("Program", extrapolate(cast("Samples", tuple(plain)), number, known))
    patterns = {}
    for name in programs[0].patterns:
        places = cast("Any", tuple(unpacked_places(program.patterns[name]).T for program in programs))
        patterns[name] = packed_places(cast("Any", continued_integers(places, number)))
    return replace(made, patterns=patterns)


def _assemble(program: Program) -> Mapping[str, Any]:
    """Return the method data of a Program with the matrix assembly as loops, unchanged without a solver."""
    method = program.method
    return {**method, "solver": with_assembly(method["solver"])} if "solver" in method else method
