"""Points from two columns of a CSV file, chosen by title or number; errors name file and line."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import Problem
from eomgen.text import listed, nearest, shown

LARGEST_TABLE = 20_000_000
MOST_ROWS = 100_000
_DELIMITERS = {"comma": ",", "semicolon": ";", "tab": "\t", "space": " "}
_DECIMAL_COMMA = re.compile(r"[+-]?\d+,\d+([eE][+-]?\d+)?")
_BYTE_ORDERS = (b"\xff\xfe", b"\xfe\xff")


class TableError(Exception):
    """A table that cannot be taken; ``problem`` says where, what, and what to try."""

    def __init__(self, where: str, what: str, hint: str = "") -> None:
        self.problem = Problem(where, what, hint)
        super().__init__(str(self.problem))


def read_columns(
    path: Path, first: str | int, second: str | int, *, delimiter: str | None = None, decimal: str = "."
) -> tuple[Array, Array, Array, tuple[str, str]]:
    """Return two columns of a CSV file, the line of each row, (n,) each, and the titles of both, empty without any.

    Parameters
    ----------
    path : Path
        UTF-8, with or without a byte order mark; lines that are empty or begin with ``#`` do not count.
    first, second : str or int
        Titles in the first row, or numbers of columns from 0.
    delimiter : str, optional
        ``comma``, ``semicolon``, ``tab`` or ``space``; by default what the first row shows.
    decimal : str
        ``.`` or ``,``.

    Raises
    ------
    TableError
        For the first thing that is wrong, with file and line.
    """
    name = path.name if path.name.isascii() and path.name.isprintable() else ascii(path.name)
    text = _text(path, name)
    rows = list(_rows(text, name, delimiter))
    if not rows:
        raise TableError(name, "the table is empty", "a row of titles, and rows of numbers")
    titles = [] if _is_number(rows[0][1][0], decimal) else [title.strip() for title in rows[0][1]]
    places = [_place(column, titles, rows[0], name) for column in (first, second)]
    body = rows[1:] if titles else rows
    if not body:
        raise TableError(name, "there are titles and no rows of numbers", "two rows or more")
    if len(body) > MOST_ROWS:
        what = f"the table has {len(body)} rows, more than {MOST_ROWS}"
        raise TableError(f"{name}:{body[MOST_ROWS][0]}", what, "every tenth row, or the part that is needed")
    x, y = (np.array([_number(row, place, titles, name, decimal) for row in body]) for place in places)
    of_first, of_second = (titles[place] if titles else "" for place in places)
    return x, y, np.array([line for line, _ in body]), (of_first, of_second)


def _text(path: Path, name: str) -> str:
    try:
        if path.exists() and not path.is_file():
            raise TableError(
                name, f"{str(path)!a} is not a file", "the path of a CSV file, from the scene file's folder"
            )
        with path.open("rb") as stream:
            data = stream.read(LARGEST_TABLE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        hint = "a path from the scene file's folder"
        raise TableError(name, f"{str(path)!a} cannot be read: {reason}", hint) from None
    if len(data) > LARGEST_TABLE:
        raise TableError(name, f"the file is larger than {LARGEST_TABLE // 1_000_000} MB", "fewer rows or columns")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        what = "the file is UTF-16" if data.startswith(_BYTE_ORDERS) else f"byte {error.start} is not UTF-8"
        raise TableError(f"{name}:{line}", what, "the file saved as CSV in UTF-8") from None
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise TableError(f"{name}:{line}", "there is a zero byte: this is no text", "the file saved as CSV in UTF-8")
    return text


def _rows(text: str, name: str, delimiter: str | None) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of each row that counts."""
    lines = [
        (number, line)
        for number, line in enumerate(text.replace("\r\n", "\n").replace("\r", "\n").split("\n"), 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not lines:
        return
    mark = _DELIMITERS[delimiter] if delimiter is not None else _delimiter_of(lines[0][1])
    for number, line in lines:
        if mark == " ":
            yield number, line.split()
            continue
        try:
            (cells,) = csv.reader(io.StringIO(line), delimiter=mark, strict=True)
        except (csv.Error, ValueError) as error:
            raise TableError(
                f"{name}:{number}", f"this is not CSV: {error}", "plain numbers between delimiters"
            ) from None
        yield number, cells


def _delimiter_of(line: str) -> str:
    """Return the first of tab, semicolon, comma and space that is in a line outside quotes."""
    bare = re.sub(r'"[^"]*"', "", line.strip())
    return next((mark for mark in "\t;, " if mark in bare), ",")


def _is_number(text: str, decimal: str) -> bool:
    try:
        float(text.strip().replace(decimal, "."))
    except ValueError:
        return bool(_DECIMAL_COMMA.fullmatch(text.strip()))
    return True


def _place(column: str | int, titles: Sequence[str], head: tuple[int, list[str]], name: str) -> int:
    line, cells = head
    if isinstance(column, int):
        if column >= len(cells):
            hint = f"a number from 0 to {len(cells) - 1}, or another delimiter"
            raise TableError(f"{name}:{line}", f"there is no column {column}: the row has {len(cells)}", hint)
        return column
    if not titles:
        what = f"there is no column {shown(column)}: the first row holds numbers, not titles"
        raise TableError(f"{name}:{line}", what, f"the number of the column, 0 to {len(cells) - 1}")
    found = [place for place, title in enumerate(titles) if title == column]
    if len(found) == 1:
        return found[0]
    if found:
        hint = f"the number of the column, {' or '.join(map(str, found))}"
        raise TableError(f"{name}:{line}", f"{len(found)} columns are called {shown(column)}", hint)
    what = f"there is no column {shown(column)}; there are {listed(titles)}"
    hint = nearest(column, titles)
    raise TableError(
        f"{name}:{line}", what, f"the delimiter that separates {shown(titles[0])}" if len(titles) == 1 else hint
    )


def _number(row: tuple[int, list[str]], place: int, titles: Sequence[str], name: str, decimal: str) -> float:
    line, cells = row
    column = f"column {shown(titles[place])}" if titles else f"column {place}"
    if place >= len(cells) or not cells[place].strip():
        got = "is empty" if place < len(cells) else f"is missing: the row has {len(cells)}"
        raise TableError(f"{name}:{line}", f"{column} {got}", "a number, or the row left out")
    cell = cells[place].strip()
    text = cell.replace(decimal, ".") if decimal != "." else cell
    try:
        number = float(text) if "_" not in text else math.nan
    except ValueError:
        hint = 'decimal = ","' if _DECIMAL_COMMA.fullmatch(cell) else "a number such as 0.25"
        raise TableError(f"{name}:{line}", f"{column}: {shown(cell)} is not a number", hint) from None
    if not math.isfinite(number):
        raise TableError(f"{name}:{line}", f"{column}: {shown(cell)} is not a finite number", "the row left out")
    return number
