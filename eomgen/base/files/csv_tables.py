"""Tables as CSV: one row of names, then numbers with as many digits as they need to be read back to the same bits."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import IO

from eomgen.base.arrays import Array
from eomgen.base.files.writing import write_file, write_text

#: Rows that are written at once.
_ROWS = 4096


def write_table(path: Path, names: Sequence[str], columns: Array, *, numbered: str = "") -> None:
    """Write a table as ``.csv``: one row of names, numbers that read back to the same bits. Raises FileError.

    ``numbered``: name of a first column with the number of each row, from 0 on; none if it is empty.
    """

    def fill(stream: IO[bytes]) -> None:
        text = io.TextIOWrapper(stream, encoding="utf-8", newline="")
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow([numbered, *names] if numbered else names)
        for start in range(0, len(columns), _ROWS):
            rows = columns[start : start + _ROWS].tolist()
            if numbered:
                rows = [[number, *row] for number, row in enumerate(rows, start)]
            writer.writerows([map(repr, row) for row in rows])
        text.flush()
        text.detach()

    write_file(path, 24 * columns.size, fill)


def write_rows(path: Path, rows: Iterable[Sequence[object]]) -> None:
    """Write texts and numbers as ``.csv``, the names of columns first. Raises FileError."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    write_text(path, text.getvalue())
