"""Catalogue of messages by code: texts, kinds, rooms and remedies, for explanations and searches.

The source gives the code of each message, at the end of its literal. The row of the code ``E0312`` is line 312 of the
files ``message_rows/errors_*.txt``, the row of ``W0012`` line 12 of ``message_rows/notes_*.txt``. A row has letters of
the kinds, the room of the source, empty for the room of the row above, the pattern, in which ``{}`` stands for a value,
and a pattern of the remedy, separated by tabs. The line of a message that is no longer made is empty.
``python -m tests.messages`` writes the rows.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

FOLDER = Path(__file__).with_name("message_rows")
#: Files of the codes by first letter.
FILES = {"E": "errors", "W": "notes"}
#: Kinds of messages by letter; the first seven are errors in the order of exit codes.
KINDS = {
    "i": "internal error",
    "u": "usage error",
    "d": "description error",
    "m": "model error",
    "t": "toolchain error",
    "n": "numerical error",
    "f": "input/output error",
    "w": "note or warning",
    "r": "finding of a run",
}


class Row(NamedTuple):
    """A message of the catalogue.

    Attributes
    ----------
    code : str
        Such as ``E0312``.
    kinds : str
        Keys of ``KINDS``.
    room : str
        Module of the source without ``eomgen``; modules of one file are one room.
    pattern : str
        Text with ``{}`` for values; the name of a finding.
    remedy : str
        Pattern of the remedy; empty if it depends on the case.
    """

    code: str
    kinds: str
    room: str
    pattern: str
    remedy: str


def lines_of(letter: str) -> list[str]:
    """Return the lines of the codes with a letter, in order."""
    files = sorted(FOLDER.glob(f"{FILES[letter]}_*.txt"))
    return [line for file in files for line in file.read_text(encoding="utf-8").splitlines()]


def row_of(code: str, line: str) -> Row:
    """Return the row of a line of the catalogue."""
    kinds, room, pattern, remedy = f"{line}\t".replace("\\n", "\n").split("\t")[:4]
    return Row(code, kinds, room, pattern, remedy)


@cache
def rows() -> tuple[Row, ...]:
    """Return all rows of the catalogue, errors first, in the order of codes."""
    made: list[Row] = []
    for letter in FILES:
        for place, line in enumerate(lines_of(letter), 1):
            if line:
                row = row_of(f"{letter}{place:04d}", line)
                made.append(row if row.room else row._replace(room=made[-1].room))
    return tuple(made)


def code_of_finding(name: str) -> str:
    """Return the code of a check of runs by name; empty for a check of another distribution."""
    return next((row.code for row in rows() if row.kinds == "r" and row.pattern == name), "")


def searched(words: Sequence[str]) -> Iterator[Row]:
    """Yield the rows that contain all words, in small or capital letters."""
    for row in rows():
        text = " ".join((row.code, row.room, row.pattern, row.remedy)).lower()
        if all(word.lower() in text for word in words):
            yield row
