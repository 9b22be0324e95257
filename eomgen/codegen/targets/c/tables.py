"""Tables of integers in C: long regular tables, as equal parts of a scene give, become counted expressions; texts for
places in arrays, loops over nonzeros, and tables of fronts. Tables of curves: one for all curves of the same rows, and
large ones as bytes, which compile ten times faster.

A compiler takes 4 us for a number in an initializer and 50 ns for a byte in a text. So tables of many numbers are texts
in a file of their own: doubles of IEEE 754, byte by byte, the least significant first, for any byte order of machines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from eomgen.base.data import dataclass
from eomgen.codegen.program import ProgramCurve
from eomgen.codegen.scheduling.stretches import RowStretch, ranges, stretches


def place(start: int, step: int, counter: str = "i") -> str:
    """Return the text of start + step i."""
    if step == 0:
        return str(start)
    term = counter if abs(step) == 1 else f"{abs(step)} * {counter}"
    if step < 0:
        return f"{start} - {term}"
    return f"{start} + {term}" if start else term


def offset(distance: int | str) -> str:
    """Return the text that offsets a pointer by a distance, empty for a distance of 0."""
    return "" if distance in (0, "0") else f" + {distance}"


def shift(first: str, step: int, counter: str = "k") -> str:
    """Return the text of a place that moves by a step with each count."""
    if step == 0:
        return first
    return f"{first} {'+' if step > 0 else '-'} {f'{abs(step)} * ' if abs(step) > 1 else ''}{counter}"


def chosen(ranges: Sequence[tuple[int, str]], counter: str = "k") -> str:
    """Return a choice between texts by ranges of a counter, each with an end."""
    text = ranges[-1][1]
    for end, choice in reversed(ranges[:-1]):
        text = f"{counter} < {end} ? {choice} : {text}"
    return text


#: Characters in a line.
WIDTH = 120
#: Tables of fewer entries stay tables.
_LONG = 72
#: Ranges of one table at most.
_RANGES = 6


class Lookup:
    """A table of integers as C text: an array, or if long and regular, expressions of the index.

    Parameters
    ----------
    name : of the table in C
    values : entries of the table
    apart : whether the entries of a table stand in lines of their own

    Attributes
    ----------
    tables : name and values of each array that must be declared
    ranges : (end, text), the expressions of the index ``@`` up to each end; empty if the table is one array
    """

    def __init__(self, name: str, values: Sequence[int], apart: bool = False) -> None:
        self.name, self.values, self.apart = name, tuple(values), apart
        self.tables: list[tuple[str, tuple[int, ...]]] = []
        self.ranges: list[tuple[int, str]] = []
        if len(self.values) >= _LONG:
            self._count()
        if not self.ranges:
            self.tables = [(name, self.values)]

    def _count(self) -> None:
        """Set ``ranges`` and ``tables`` for regular values: few ranges of counted expressions, or periods."""
        even = ranges(self.values)
        if len(even) <= _RANGES:
            self.ranges = [(end, place(start, step, "@")) for end, start, step in even]
            return
        repeated = stretches([self.values], [True])
        if len(repeated) <= _RANGES and 4 * sum(stretch.period for stretch in repeated) <= len(self.values):
            self.ranges = [(stretch.stop, self._periodic(stretch)) for stretch in repeated]
            return
        size = len(self.values)
        for period in range(2, 17):
            steps = [after - before for before, after in zip(self.values, self.values[period:], strict=False)]
            if steps == (steps[:period] * (size // period + 1))[: len(steps)]:
                first, by = f"{self.name}_first", f"{self.name}_step"
                self.tables = [(first, self.values[:period]), (by, tuple(steps[:period]))]
                self.ranges = [(size, f"{first}[@ % {period}] + {by}[@ % {period}] * (@ / {period})")]
                return

    def _periodic(self, stretch: RowStretch) -> str:
        """Return the C text of the entries in a stretch as an expression of ``@``; the first period may become a
        table."""
        at = f"(@ - {stretch.start})" if stretch.start else "@"
        first = self.values[stretch.start : stretch.start + stretch.period]
        inner = f"{at} % {stretch.period}" if stretch.count > 1 else at
        is_even = len(first) > 2 and len({after - before for before, after in pairwise(first)}) == 1
        if is_even:
            text = place(first[0], first[1] - first[0], inner)
        else:
            name = f"{self.name}_{len(self.tables)}" if self.tables else self.name
            self.tables.append((name, first))
            text = f"{name}[{inner}]"
        if stretch.count == 1:
            return text
        step = self.values[stretch.start + stretch.period] - first[0]
        return shift(text, step, f"({at} / {stretch.period})")

    def declaration(self, depth: int = 1, note: str = "") -> str:
        """Return C lines, indented by ``depth`` levels, that declare the arrays read by ``at``, with the comment
        ``note``."""
        indent, result = "    " * depth, ""
        behind = f" /* {note} */" if note else ""
        for name, values in self.tables:
            if self.apart:
                result += integers(name, values, depth)
            else:
                texts = ", ".join(map(str, values))
                result += f"{indent}static const int {name}[{len(values)}] = {{ {texts} }};{behind}\n"
        return result

    def at(self, index: str = "i") -> str:
        """Return the C text of the entry at an index, which is C text, too; for a number a counted entry itself."""
        if not self.ranges:
            return f"{self.name}[{index}]"
        if index.isdigit():
            return str(self.values[int(index)])
        text = chosen(self.ranges, "@").replace("@", index)
        return text if text.isdigit() else f"({text})"


class RowLookup:
    """Rows of places in an array, one for each element; rows that repeat, moved by a step each period, are stored once.

    Parameters
    ----------
    rows : places of each element

    Attributes
    ----------
    rows : the stored rows
    row, moved : as texts of ``element``, the stored row of an element and the distance by which its places are moved;
        empty if each element has a row of its own
    """

    def __init__(self, rows: Sequence[Sequence[int]]) -> None:
        """Find repeated rows, of which one period is stored with a step."""
        self.rows, self.row, self.moved = rows, "", ""
        if len(rows) < _LONG:
            return
        repeats = stretches([*zip(*rows, strict=True)], [True] * len(rows[0]))
        if len(repeats) > _RANGES or 4 * sum(stretch.period for stretch in repeats) > len(rows):
            return
        kept: list[Sequence[int]] = []
        at: list[tuple[int, str]] = []
        by: list[tuple[int, str]] = []
        for stretch in repeats:
            start, period, before = stretch.start, stretch.period, len(kept)
            kept += rows[start : start + period]
            counter = f"(element - {start})" if start else "element"
            after = rows[start + period] if stretch.count > 1 else rows[start]
            step = after[0] - rows[start][0]
            if any(there - here != step for there, here in zip(after, rows[start], strict=True)):
                return
            at.append((stretch.stop, place(before, 1, f"{counter} % {period}" if stretch.count > 1 else counter)))
            by.append((stretch.stop, place(0, step, f"({counter} / {period})")))
        self.rows, self.row, self.moved = kept, chosen(at, "element"), chosen(by, "element")


def integers(name: str, values: Sequence[int], depth: int = 0) -> str:
    """Return the lines that declare a table of integers, each ended."""
    indent, texts = "    " * depth, [*map(str, values)]
    batch = max(1, (WIDTH - len(indent) - 4) // (2 + max(map(len, texts), default=1)))
    rows = [f"{indent}    {', '.join(texts[k : k + batch])},\n" for k in range(0, len(texts), batch)]
    return "".join([f"{indent}static const int {name}[{len(texts)}] = {{\n", *rows, f"{indent}}};\n"])


def nonzeros(places: Sequence[Sequence[int]]) -> list[dict[str, Any]]:
    """Return loops over the nonzeros of a matrix, one for each stretch of a long table of places.

    Each has ``count`` periods k of ``period`` nonzeros j, ``tables`` (the rows and columns of the first period, by the
    names ``row`` and ``column``), and as C texts ``number``, ``row`` and ``column`` of a nonzero.

    Parameters
    ----------
    places : row and column of each nonzero
    """
    whole = RowStretch(0, len(places), 1)
    parts = stretches([range(len(places)), *zip(*places, strict=True)], [True] * 3) if len(places) >= _LONG else [whole]
    if 2 * sum(stretch.period for stretch in parts) > len(places):
        parts = [whole]
    result = []
    for stretch in parts:
        first, last = places[stretch.start], places[stretch.start + (stretch.count > 1) * stretch.period]
        tables = {
            name: [index[k] for index in places[stretch.start : stretch.start + stretch.period]]
            for k, name in enumerate(("row", "column"))
        }
        texts = {
            name: shift(f"{name}[j]", after - before) for name, before, after in zip(tables, first, last, strict=True)
        }
        number = shift(place(stretch.start, 1, "j"), stretch.period if stretch.count > 1 else 0)
        result.append({"count": stretch.count, "period": stretch.period, "tables": tables, "number": number, **texts})
    return result


def places_of_fronts(fronts: Sequence[Sequence[int]]) -> list[str]:
    """Return the columns of the table of fronts as texts of i; empty for few or irregular fronts."""
    columns = [ranges(column) for column in zip(*fronts, strict=True)]
    if len(fronts) < _LONG // 2 or max(map(len, columns)) > _RANGES:
        return []
    return [chosen([(end, place(start, step)) for end, start, step in column], "i") for column in columns]


def collapse(items: Sequence[Mapping[str, Any]], kinds: Sequence[str], places: Sequence[str]) -> list[dict[str, Any]]:
    """Return items with ``count``; many items of one kind at equally spaced places become one with places as C texts of
    k.

    If kinds alternate, as positions and rotations of free bodies do, and fewer items result, items are sorted by kind.

    Parameters
    ----------
    items : mappings, in any order
    kinds, places : keys whose values must be equal, and keys of integers
    """
    by_kind: dict[tuple[Any, ...], list[Mapping[str, Any]]] = {}
    for item in items:
        by_kind.setdefault(tuple(item[key] for key in kinds), []).append(item)
    as_given = _collapse(items, kinds, places)
    sorted_items = _collapse([item for alike in by_kind.values() for item in alike], kinds, places)
    return sorted_items if len(sorted_items) < len(as_given) else as_given


def _collapse(items: Sequence[Mapping[str, Any]], kinds: Sequence[str], places: Sequence[str]) -> list[dict[str, Any]]:
    """Return items, in order, with runs of eight or more of equal kinds and evenly spaced places as one."""
    result: list[dict[str, Any]] = []
    start = 0
    while start < len(items):
        first, end = items[start], start + 1
        steps = {key: items[end][key] - first[key] for key in places} if end < len(items) else {}
        while (
            end < len(items)
            and all(items[end][key] == first[key] for key in kinds)
            and all(items[end][key] - items[end - 1][key] == steps[key] for key in places)
        ):
            end += 1
        if end - start >= 8:
            result.append({**first, "count": end - start, **{k: place(first[k], steps[k], "k") for k in places}})
        else:
            end = start + 1
            result.append({**first, "count": 1})
        start = end
    return result


#: Numbers from which on a table is bytes.
LARGE = 4096
#: Bytes in one text of a line.
_LINE = 28
#: C text of each byte: four characters, or one character and zeros; only zeros for the filler at a line's end, 256.
_WRITTEN = np.zeros((257, 4), dtype=np.uint8)
for _code in range(256):
    _plain = 32 <= _code < 127 and chr(_code) not in '"\\?'
    _WRITTEN[_code] = [_code, 0, 0, 0] if _plain else list(f"\\{_code:03o}".encode())


@dataclass(frozen=True)
class CurveTable:
    """The rows of one curve or of several.

    Attributes
    ----------
    number : from 1 on
    rows : as of ``ProgramCurve``
    curves : numbers of the curves, from 1 on
    """

    number: int
    rows: tuple[tuple[float, ...], ...]
    curves: tuple[int, ...]

    @property
    def is_packed(self) -> bool:
        """Whether the table is a file of bytes."""
        return len(self.rows) * len(self.rows[0]) >= LARGE

    @property
    def is_shared(self) -> bool:
        """Whether several curves have this table."""
        return len(self.curves) > 1

    @property
    def size(self) -> int:
        """Bytes of a row, including the zero at the end of a text."""
        return 8 * len(self.rows[0]) + 1

    @property
    def text(self) -> str:
        """Lines of the initializer, row by row."""
        data = np.array(self.rows, dtype="<f8").view(np.uint8)
        together = max(1, 2**20 // data.shape[1])  # rows of a megabyte are escaped at once
        parts = [_escape(data[first : first + together]) for first in range(0, len(data), together)]
        return b"\n".join(parts).decode("ascii")


def _escape(data: npt.NDArray[np.uint8]) -> bytes:
    """Return rows of bytes, shape (rows, size), as string literals of C, at most ``_LINE`` bytes each, a comma after
    each row. All characters are laid out at places of equal width, and then zeros, which no text has, are deleted."""
    rows, size = data.shape
    lines, width = -(-size // _LINE), 4 * _LINE
    padded = np.full((rows, lines * _LINE), 256, dtype=np.int16)
    padded[:, :size] = data
    text = np.empty((rows, lines, 5 + width + 3), dtype=np.uint8)
    text[:, :, :5], text[:, :, 5 + width :] = list(b'    "'), list(b'"\0\n')
    text[:, :, 5 : 5 + width] = _WRITTEN.view(np.uint32)[:, 0].take(padded).view(np.uint8).reshape(rows, lines, width)
    text[:, -1, -2] = ord(",")
    return text.tobytes().translate(None, b"\0")[:-1]


def curve_tables(curves: Sequence[ProgramCurve]) -> tuple[CurveTable, ...]:
    """Return the tables of curves, equal tables once."""
    result: dict[tuple[tuple[float, ...], ...], list[int]] = {}
    for number, curve in enumerate(curves, 1):
        result.setdefault(curve.rows, []).append(number)
    return tuple(CurveTable(number, rows, tuple(of)) for number, (rows, of) in enumerate(result.items(), 1))
