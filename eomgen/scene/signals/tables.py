"""Points from two columns of a CSV file, chosen by title or number; units in titles; errors name file and line."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.files import read_bytes
from eomgen.base.messages import is_number, listed, nearest, shown
from eomgen.errors import FileError, Problem
from eomgen.formula.units.parser import factors_of, read_unit
from eomgen.formula.units.table import names

MOST_ROWS = 100_000
_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
#: Numbers with separators of thousands; of one comma the number may also be decimal.
_THOUSANDS = re.compile(r"[+-]?\d{1,3}(?:(?:,\d{3})+(?:\.\d+)?|(?:\.\d{3})+(?:,\d+)?|(?:[ '\u00a0]\d{3})+(?:[.,]\d+)?)")
#: Titles of columns of times, with or without a unit after the word, and of columns that count rows.
_TIME = re.compile(r"(?:t|time|zeit|timestamp)(?:[ _]*[\[(/].*|_(?:s|ms|us|min|h))?", re.IGNORECASE)
_COUNTING = frozenset({"", "index", "idx", "n", "no", "no.", "nr", "row", "sample", "#", "unnamed: 0"})
_BYTE_ORDERS = (b"\xff\xfe", b"\xfe\xff")
#: First bytes of spreadsheets: of xlsx and ods, which are ZIP archives, and of xls.
_SPREADSHEETS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")


class TableError(FileError):
    """A table that cannot be read."""

    def __init__(self, where: str, fault: str, hint: str = "") -> None:
        super().__init__(Problem(where, fault, hint))


class Columns(NamedTuple):
    """Two columns of a table.

    Attributes
    ----------
    argument, value : (n,) arrays
    lines : (n,) array
        The line of each row.
    titles : tuple of str
        Of both columns, empty without any; of files whose text must not be quoted the unit in brackets alone.
    width : int
        Number of columns in the first row.
    """

    argument: Array
    value: Array
    lines: Array
    titles: tuple[str, str]
    width: int


def read_columns(
    path: Path,
    first: str | int,
    second: str | int,
    *,
    delimiter: str | None = None,
    decimal: str = ".",
    quotes: bool = True,
    chosen: bool = True,
) -> Columns:
    """Return two columns of a CSV file, with their titles and the lines of all rows. Raises FileError for the first
    fault.

    Parameters
    ----------
    path : UTF-8, with or without a byte order mark; lines that are empty or begin with ``#`` do not count
    first, second : titles in the first row, or numbers of columns from 0
    delimiter : ``comma``, ``semicolon``, ``tab`` or ``space``; by default the delimiter in the first row
    decimal : ``.`` or ``,``
    quotes : whether messages may quote titles and cells
    chosen : whether a user chose one of the columns; an index that pandas wrote is refused otherwise
    """
    name = path.name if path.name.isascii() and path.name.isprintable() else ascii(path.name)
    text = _text(path, name)
    rows = list(_rows(text, name, delimiter))
    if not rows:
        raise TableError(name, "the table is empty [E1884]", "a row of titles, and rows of numbers")
    head, count = rows[0], len(rows[0][1])
    count -= all(len(cells) == count and not cells[-1].strip() for _, cells in rows)  # a delimiter ends each row
    head = (head[0], head[1][:count])
    titles = [] if _is_number(head[1][0], decimal) else [title.strip() for title in head[1]]
    words = _Words(titles, quotes=quotes)
    places = [_place(column, titles, head, name, words) for column in (first, second)]
    body = rows[1:] if titles else rows
    if not body:
        raise TableError(name, "there are titles and no rows of numbers [E1885]", "two rows or more")
    if len(body) > MOST_ROWS:
        fault = f"the table has {len(body)} rows, more than {MOST_ROWS} [E1886]"
        raise TableError(f"{name}:{body[MOST_ROWS][0]}", fault, "every tenth row, or the part that is needed")
    _check_lengths(body, count, name)
    x, y = (np.array([_number(row, index, words, name, decimal) for row in body]) for index in places)
    _check_index(chosen, titles, x, f"{name}:{head[0]}", quotes=quotes)
    of_both = [titles[index] if titles else "" for index in places]
    if not quotes:
        of_both = [f"[{unit}]" if (unit := unit_of_title(title)) else "" for title in of_both]
    return Columns(x, y, np.array([line for line, _ in body]), (of_both[0], of_both[1]), count)


def _check_index(chosen: bool, titles: Sequence[str], x: Array, where: str, *, quotes: bool) -> None:
    """Raise TableError for a first column ``x`` that counts the rows, was not ``chosen`` by the user, and is an index
    by the first title or another column's. ``quotes``: whether the message may quote titles."""
    if chosen or len(titles) < 2 or not np.array_equal(x, np.arange(len(x)) + x[0]):
        return
    times = [index for index, title in enumerate(titles[1:], 1) if _TIME.fullmatch(title)]
    first = titles[0].lower()
    if not (len(titles) > 2 and first in _COUNTING) and (not times or _TIME.fullmatch(titles[0])):
        return
    fault = "the first column counts the rows, as an index that pandas writes [E1887]"
    time = times[0] if times else 1
    value = next((index for index in range(1, len(titles)) if index != time), None)
    if value is None:
        raise TableError(where, fault, "a column of times and one of values, or argument = 0 to take the count")
    columns = (f'"{titles[time]}"', f'"{titles[value]}"') if quotes else (str(time), str(value))
    hint = f"argument = {columns[0]}, value = {columns[1]}"
    raise TableError(where, fault, f"{hint}; or the file written with index=False" if not first else hint)


def _check_lengths(body: Sequence[tuple[int, list[str]]], count: int, name: str) -> None:
    """Raise TableError for the first row, pair of line and cells, with more than ``count`` cells; empty cells and
    comments at the end do not count. ``name`` is the file's name."""
    for line, cells in body:
        surplus = cells[count:]
        if surplus and surplus[0].strip() and not surplus[0].lstrip().startswith("#"):
            fault = f"the row has {len(cells)} cells, and the first row of the file has {count} [E1890]"
            hint = 'one cell for each column; a file with decimal commas needs ; between columns and decimal = ","'
            raise TableError(f"{name}:{line}", fault, hint)


class _Words:
    """Titles and cells for messages, which quote no text of a file outside the scene's folder."""

    def __init__(self, titles: Sequence[str], *, quotes: bool) -> None:
        self.titles = titles
        self.quotes = quotes

    def column(self, index: int) -> str:
        """Return the title of a column, or its number."""
        return f"column {shown(self.titles[index])}" if self.titles and self.quotes else f"column {index}"

    def cell(self, cell: str) -> str:
        """Return a cell unchanged."""
        return shown(cell) if self.quotes else "the cell"


def _text(path: Path, name: str) -> str:
    """Return the text of a table's file. Raises FileError for a file that cannot be read, is too large, is a
    spreadsheet, or is not UTF-8; ``name`` is the file's name for messages."""
    data = read_bytes(path, 20_000_000)
    if data.startswith(_SPREADSHEETS):
        fault = "the file is a spreadsheet (xlsx, ods or xls), and tables are read from CSV [E1892]"
        raise TableError(name, fault, "the sheet saved as CSV in UTF-8, under another name")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        utf_16 = data.startswith(_BYTE_ORDERS)
        fault = "the file is UTF-16 [E1893]" if utf_16 else f"byte {error.start} is not UTF-8 [E1894]"
        raise TableError(f"{name}:{line}", fault, "the file saved as CSV in UTF-8") from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        fault = "there is a zero byte: this is not a text [E1895]"
        raise TableError(f"{name}:{line}", fault, "the file saved as CSV in UTF-8")
    return text


def _rows(text: str, name: str, delimiter: str | None) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of each row that is not empty or a comment. Raises TableError for a row that is not
    CSV; the delimiter None stands for the first row's."""
    lines = [
        (number, line)
        for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        return
    import csv  # noqa: PLC0415  # few scenes have tables

    bare = re.sub(r'"[^"]*"', "", lines[0][1].strip())
    mark = _DELIMITERS[delimiter] if delimiter is not None else next((mark for mark in "\t;, " if mark in bare), ",")
    for number, line in lines:
        if mark == " ":
            yield number, line.split()
            continue
        try:
            (cells,) = csv.reader(io.StringIO(line), delimiter=mark, strict=True)
        except (csv.Error, ValueError) as error:
            fault = f"this is not CSV: {error} [E1896]"
            raise TableError(f"{name}:{number}", fault, "plain numbers between delimiters") from None
        yield number, cells


def _is_number(text: str, decimal: str) -> bool:
    cell = text.strip()
    return is_number(cell.replace(decimal, ".")) or _DECIMAL_COMMA.fullmatch(cell) is not None


def _place(column: str | int, titles: Sequence[str], head: tuple[int, list[str]], name: str, words: _Words) -> int:
    """Return the index of a column given by index or title. Raises TableError for an unknown or repeated title.
    ``head`` has line and cells of the first row, ``titles`` is empty without titles, ``name`` is the file's name."""
    line, cells = head
    if isinstance(column, int):
        if column >= len(cells):
            hint = f"a number from 0 to {len(cells) - 1}, or another delimiter"
            if len(cells) == 1:
                hint = "a table of two columns, or another delimiter"
            raise TableError(f"{name}:{line}", f"there is no column {column}: the row has {len(cells)} [E1897]", hint)
        return column
    if not titles:
        fault = f"there is no column {shown(column)}: the first row holds numbers, not titles [E1899]"
        raise TableError(f"{name}:{line}", fault, f"the number of the column, 0 to {len(cells) - 1}")
    result = [index for index, title in enumerate(titles) if title == column]
    if len(result) == 1:
        return result[0]
    if result:
        hint = f"the number of the column, {' or '.join(map(str, result))}"
        raise TableError(f"{name}:{line}", f"{len(result)} columns are called {shown(column)} [E1901]", hint)
    if not words.quotes:
        fault = f"no column has the title {shown(column)} [E1900]"
        raise TableError(f"{name}:{line}", fault, "a title in the first row of the file, or the number of the column")
    fault = f"there is no column {shown(column)}; there are {listed(titles)} [E1898]"
    hint = nearest(column, titles)
    raise TableError(
        f"{name}:{line}", fault, f"the delimiter that separates {shown(titles[0])}" if len(titles) == 1 else hint
    )


def _number(row: tuple[int, list[str]], index: int, words: _Words, name: str, decimal: str) -> float:
    """Return the number in cell ``index`` of a row, pair of line and cells. Raises TableError for an empty cell or
    one that is not a finite number; ``name`` is the file's name, ``decimal`` the decimal mark."""
    line, cells = row
    column = words.column(index)
    if index >= len(cells) or not cells[index].strip():
        got = "is empty" if index < len(cells) else f"is missing: the row has {len(cells)}"
        raise TableError(f"{name}:{line}", f"{column} {got} [E1902]", "a number, or the row left out")
    cell = cells[index].strip()
    if decimal == "," and "." in cell:
        fault = f"{column}: {words.cell(cell)} has a point, and the decimal mark is a comma [E1904]"
        raise TableError(f"{name}:{line}", fault, "numbers without separators of thousands")
    text = cell.replace(decimal, ".") if decimal != "." else cell
    try:
        number = float(text) if "_" not in text else math.nan
    except ValueError:
        fault = f"{column}: {words.cell(cell)} is not a number [E1905]"
        raise TableError(f"{name}:{line}", fault, _in_place(cell)) from None
    if not math.isfinite(number):
        fault = f"{column}: {words.cell(cell)} is not a finite number [E1906]"
        raise TableError(f"{name}:{line}", fault, "the row left out")
    return number


def _in_place(cell: str) -> str:
    """Return a remedy for a cell that is not a number."""
    if _THOUSANDS.fullmatch(cell):
        hint = "numbers without separators of thousands"
        return f'{hint}; decimal = "," if the comma is a decimal mark' if _DECIMAL_COMMA.fullmatch(cell) else hint
    if _DECIMAL_COMMA.fullmatch(cell):
        return 'decimal = ","'
    return "a number such as 0.25"


_IN_BRACKETS = re.compile(r".*[\[(]([^\[\]()]+)[\])]\s*")
_OVER = re.compile(r"[^/]*\S\s*/\s*([^/\s]+)\s*")
_LAST_WORD = re.compile(r"\s*(\w*?)[_\s]([A-Za-z]+)\s*")
#: Last words that are units after any name, and last words that are units after a name of time; other words may be
#: names.
_UNITS = frozenset({"ms", "us", "mm", "cm", "km", "deg", "rpm", "kN", "kPa", "MPa"})
_OF_TIMES = frozenset({"ms", "us", "ns", "min", "h", "hours", "minutes", "milliseconds"})
_TIMES = frozenset({"t", "time", "zeit", "temps", "tiempo"})


def unit_of_title(title: str) -> str:
    """Return the unit named in a column's title, ``mm`` of ``height [mm]``; empty if the title names no known unit.
    Accelerations in g are in g0."""
    if marked := _IN_BRACKETS.fullmatch(title) or _OVER.fullmatch(title):
        unit = marked[1].strip()
    elif last := _LAST_WORD.fullmatch(title):
        unit = last[2] if last[2] in (_OF_TIMES if last[1].lower() in _TIMES else _UNITS) else ""
    else:
        return ""
    if unit == "g" and "acc" in title.lower():
        return "g0"
    return unit if factors_of(unit) else ""


def is_time(title: str) -> bool:
    """Return whether a title names a time."""
    return _TIME.fullmatch(title) is not None


def without_unit(column: str, others: Sequence[str]) -> str:
    """Return the fault of the column ``column``, which has no unit while the columns ``others`` have units, with a
    remedy, as a clause for notes."""
    hint = f'{column}_unit = "1" for plain numbers, or the unit of its column'
    return f"its numbers are taken as they are, without a unit, unlike the numbers of {listed(others)}; try: {hint}"


def is_in_si(unit: str) -> bool:
    """Return whether numbers of a scene are in a unit."""
    return all(names()[name].is_coherent for name, _ in read_unit(unit))


def note_of_label(key: str, label: str, remedy: str) -> list[str]:
    """Return a note on the label of numbers if the label is a unit beyond SI; none for other labels."""
    if all(names()[name].is_coherent for name, _ in factors_of(label) or ()):
        return []
    return [f"{key}.unit: its unit {label} is a label, so formulas take its numbers as they are; try: {remedy} [W0142]"]
