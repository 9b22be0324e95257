"""Measured tables from CSV files: a row of names, then rows of numbers; an empty cell is not a number."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from eomgen.arrays import Array
from eomgen.errors import FileError, Problem
from eomgen.files.nearby import nearby

_DELIMITERS = (",", ";", "\t")
_MISSING = ("", "nan", "na", "null", "none")


def read_table(path: Path) -> tuple[list[str], Array]:
    """Return the names of the columns and the numbers (rows, columns); missing ones are nan.

    Columns are separated by commas, semicolons or tabs; lines that begin with # are comments.

    Raises
    ------
    FileError
        No such file, no text, no names, a name twice, rows of another length, cells that are no numbers.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise FileError(Problem(str(path), f"cannot be read: {error.strerror or error}", nearby(path))) from None
    except UnicodeDecodeError:
        raise FileError(Problem(str(path), "this is no text, and a CSV file is needed", _HINT)) from None
    numbered = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if not numbered:
        raise FileError(Problem(str(path), "the file is empty", _HINT))
    delimiter = max(_DELIMITERS, key=numbered[0][1].count)
    names, *rows = [
        [cell.strip() for cell in row] for row in csv.reader((line for _, line in numbered), delimiter=delimiter)
    ]
    _check_names(path, names)
    table = np.empty((len(rows), len(names)))
    for k, ((number, _), row) in enumerate(zip(numbered[1:], rows, strict=False)):
        if len(row) != len(names):
            what = f"line {number} has {len(row)} cells, and there are {len(names)} names"
            raise FileError(Problem(str(path), what, "one number for each name, an empty cell where one is missing"))
        for column, cell in enumerate(row):
            table[k, column] = _number(path, number, names[column], cell)
    return names, table


_HINT = "a first line of names, t,angle, and below it rows of numbers, 0.01,0.2"


def _check_names(path: Path, names: Sequence[str]) -> None:
    if all(_is_number(name) for name in names):
        raise FileError(Problem(str(path), "the first line has numbers in place of names", _HINT))
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise FileError(Problem(str(path), f"the column {twice!r} is there twice", "one column for each name"))


def _number(path: Path, line: int, name: str, cell: str) -> float:
    if cell.lower() in _MISSING:
        return math.nan
    try:
        return float(cell)
    except ValueError:
        what = f"line {line}, column {name}: {cell[:40]!r} is no number"
        hint = "a decimal point in place of the comma" if "," in cell else "numbers alone, without units"
        raise FileError(Problem(str(path), what, hint)) from None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True
