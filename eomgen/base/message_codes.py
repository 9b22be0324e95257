"""Codes of messages: rows of a catalogue of patterns, read when a message is printed or its code is asked for.

The row of the code ``E0312`` is line 312 of the files ``message_rows/errors_*.txt``, the row of ``W0012`` line 12 of
``message_rows/notes_*.txt``. A row has letters of the kinds, the room of the source, empty for the room of the row
above, the pattern, in which ``{}`` stands for a value, and a pattern of the remedy, separated by tabs. The line of a
message that is no longer made is empty. ``python -m tests.messages`` keeps the rows complete.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

#: Literal characters at least of a pattern that is compared with parts of a message.
_DISTINCT = 12
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
    pieces : tuple of str
        Literal parts of the pattern.
    letters : int
        Number of literal characters.
    """

    code: str
    kinds: str
    room: str
    pattern: str
    remedy: str
    pieces: tuple[str, ...]
    letters: int


def lines_of(letter: str) -> list[str]:
    """Return the lines of the codes with a letter, in order."""
    files = sorted(FOLDER.glob(f"{FILES[letter]}_*.txt"))
    return [line for file in files for line in file.read_text(encoding="utf-8").splitlines()]


def row_of(code: str, line: str) -> Row:
    """Return the row of a line of the catalogue."""
    kinds, room, pattern, remedy = f"{line}\t".replace("\\n", "\n").split("\t")[:4]
    pieces = tuple(pattern.split("{}"))
    return Row(code, kinds, room, pattern, remedy, pieces, sum(map(len, pieces)))


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


def general_code(exit_code: int) -> str:
    """Return the code of messages of a kind that have no row, such as messages of other distributions."""
    return f"E{exit_code:04d}"


def is_general(row: Row) -> bool:
    """Return whether a row stands for a kind of errors."""
    return "E0001" <= row.code <= general_code(7)


def code_of(text: str, *, notes: bool = False) -> str:
    """Return the code of the row that a message fits best; empty if no row fits.

    Parameters
    ----------
    text : str
        The fault of an error without place and remedy, or a note.
    notes : bool
        Whether the text is a note or a warning.

    Returns
    -------
    str
        Code of the pattern with the most literal characters among the patterns of the whole text, else among distinct
        patterns of a part of the text.
    """
    for letter in "WE" if notes else "EW":  # with --strict a note is an error, and a doubt may be noted
        possible = [row for row in rows() if row.code[0] == letter and row.kinds != "r" and not is_general(row)]
        whole = [row for row in possible if _fits(row.pieces, text)]
        parts = whole or [row for row in possible if row.letters >= _DISTINCT and _end(row.pieces, text) >= 0]
        if parts:
            return max(parts, key=lambda row: (row.letters, -int(row.code[1:]))).code
    return ""


def code_of_finding(name: str) -> str:
    """Return the code of a check of runs by name; empty for a check of another distribution."""
    return next((row.code for row in rows() if row.kinds == "r" and row.pattern == name), "")


def searched(words: Sequence[str]) -> Iterator[Row]:
    """Yield the rows that contain all words, in small or capital letters."""
    for row in rows():
        text = " ".join((row.code, row.room, row.pattern, row.remedy)).lower()
        if all(word.lower() in text for word in words):
            yield row


def _fits(pieces: Sequence[str], text: str) -> bool:
    """Return whether a text consists of literal pieces with anything between."""
    if len(pieces) == 1:
        return text == pieces[0]
    first, *middle, last = pieces
    if len(text) < len(first) + len(last) or not text.startswith(first) or not text.endswith(last):
        return False
    return _end(middle, text[len(first) : len(text) - len(last)]) >= 0


def _end(pieces: Sequence[str], text: str) -> int:
    """Return the end of pieces that follow one another in a text with anything between; -1 without such an order."""
    place = 0
    for piece in pieces:
        start = text.find(piece, place)
        if start < 0:
            return -1
        place = start + len(piece)
    return place
