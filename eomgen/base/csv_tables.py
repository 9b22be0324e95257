"""Tables as CSV: written with numbers that read back to the same bits, and read with names of columns, separators,
decimal commas and missing values; errors name file and line."""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import IO

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.files import FEWER_ROWS, nearby, read_file, write_file, write_text
from eomgen.base.messages import counted, is_number, shown
from eomgen.errors import FileError, Problem


def write_table(path: Path, names: Sequence[str], columns: Array, *, numbered: str = "") -> None:
    """Write a table as ``.csv``: one row of names, numbers that read back to the same bits.

    Parameters
    ----------
    path : of the file; an existing file is replaced
    names : of the columns
    columns : (rows, columns)
    numbered : name of a first column with the number of each row, from 0 on; none if empty

    Raises
    ------
    FileError
        The file cannot be written.
    """

    def fill(stream: IO[bytes]) -> None:
        text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
        import csv  # noqa: PLC0415  # a run reads and writes no table

        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([numbered, *names] if numbered else names)
        # numbers of Python take four times the memory of the array's, hence made in parts
        rows = max(1, 2**18 // max(1, columns.shape[1]))
        for start in range(0, len(columns), rows):
            for number, row in enumerate(columns[start : start + rows].tolist(), start):
                cells = ",".join(map(repr, row))  # a writer looks for characters to quote, which takes as long again
                text.write(f"{number},{cells}\n" if numbered else f"{cells}\n")
        text.flush()
        text.detach()

    write_file(path, 24 * columns.size, fill, FEWER_ROWS)


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Return texts and numbers as CSV, the names of columns first."""
    text = io.StringIO()
    import csv  # noqa: PLC0415  # a run reads and writes no table

    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def write_rows(path: Path, rows: Iterable[Sequence[object]]) -> None:
    """Write texts and numbers as ``.csv``, the names of columns first. Raises FileError."""
    write_text(path, csv_text(rows))


_DELIMITERS = (",", ";", "\t")
_MISSING = ("", "nan", "na", "null", "none")
_HINT = "a first line of names, t,angle, and below it rows of numbers, 0.01,0.2"


def read_cells(path: Path) -> tuple[list[str], list[tuple[str, list[str]]]]:
    """Return the names of the columns, and for each row place (file and line) and cells without blanks around.

    Columns are separated by commas, semicolons or tabs; lines that are empty or begin with # do not count.

    Raises
    ------
    FileError
        No such file, no text, no names, a name twice, no rows, rows of another length, a quotation mark that is open.
    """
    try:
        lines = read_file(path).decode("utf-8-sig").splitlines()
    except OSError as error:
        raise FileError(
            Problem(str(path), f"cannot be read: {error.strerror or error} [E0115]", nearby(path))
        ) from None
    except UnicodeDecodeError:
        raise FileError(
            Problem(str(path), "this is not a text in UTF-8, and a CSV file is needed [E0116]", _HINT)
        ) from None
    numbered = [(f"{path}, line {k}", line) for k, line in enumerate(lines, 1) if line.strip() and line[0] != "#"]
    if not numbered:
        raise FileError(Problem(str(path), "the file is empty [E0117]", _HINT))
    delimiter = max(_DELIMITERS, key=numbered[0][1].count)
    (_, names), *rows = [(where, _cells(where, line, delimiter)) for where, line in numbered]
    _check_names(path, names)
    if not rows:
        raise FileError(Problem(str(path), "the table has no rows below its names [E0118]", _HINT))
    for where, cells in rows:
        if len(cells) != len(names):
            fault = f"the row has {counted(len(cells), 'cell')}, and there are {counted(len(names), 'name')} [E0119]"
            raise FileError(Problem(where, fault, "a cell for each name"))
    return names, rows


def read_table(path: Path) -> tuple[list[str], Array]:
    """Return the names of the columns and the numbers (rows, columns); missing numbers are nan.

    Raises
    ------
    FileError
        The file cannot be read, has no cells, or has cells that are not numbers.
    """
    names, rows = read_cells(path)
    result = [[_number(where, name, cell) for name, cell in zip(names, cells, strict=True)] for where, cells in rows]
    return names, np.array(result)


def _cells(where: str, line: str, delimiter: str) -> list[str]:
    import csv  # noqa: PLC0415  # a run reads and writes no table

    try:  # line by line, so that an open quotation mark cannot swallow the lines below it
        (row,) = csv.reader([line], delimiter=delimiter, strict=True)
    except csv.Error as error:
        raise FileError(
            Problem(where, f"this is not a CSV file: {error} [E0120]", "plain cells between delimiters")
        ) from None
    return [cell.strip() for cell in row]


def _check_names(path: Path, names: Sequence[str]) -> None:
    if all(is_number(name) for name in names):
        raise FileError(Problem(str(path), "the first line has numbers in place of names [E0121]", _HINT))
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise FileError(
            Problem(str(path), f"the column {shown(twice)} is there twice [E0122]", "one column for each name")
        )


def _number(where: str, name: str, cell: str) -> float:
    if cell.lower() in _MISSING:
        return math.nan
    try:
        return float(cell)
    except ValueError:
        hint = "a decimal point in place of the comma" if "," in cell else "numbers alone, without units"
        raise FileError(Problem(f"{where}, column {name}", f"{shown(cell)} is not a number [E0123]", hint)) from None
