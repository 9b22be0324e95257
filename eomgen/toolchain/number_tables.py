"""Other numbers in the tables of a compiled library, without a compiler: a constant array stands in the file of a
library as the bytes of its numbers."""

from __future__ import annotations

import re
import sys
from array import array
from collections.abc import Sequence

from eomgen.toolchain.compiler import Compiler

Numbers = Sequence[float]
#: Tables begin at multiples of the size of a number.
_ALIGNED = 8


def keeps_tables(compiler: Compiler) -> bool:
    """Return whether libraries of a compiler read all numbers from the tables: without optimisation at the link, which
    may copy a number into a function. On macOS the system refuses changed libraries, since they are signed."""
    linked_whole = compiler.is_zig or any(word.startswith("-flto") for word in compiler.command)
    return sys.platform == "linux" and not linked_whole


def with_tables(library: bytes, tables: Sequence[tuple[Numbers, Numbers]]) -> bytes | None:
    """Return the bytes of a library with other numbers in its tables, None if the numbers of a table are not there once
    for each table with these.

    Parameters
    ----------
    tables : numbers and as many new numbers of every table; a short table may have the end of a longer one
    """
    result, rest = bytearray(library), bytearray(library)
    packed = [(array("d", old).tobytes(), array("d", new).tobytes()) for old, new in tables]
    for old, new in sorted({*packed}, key=lambda table: -len(table[0])):
        places = [match.start() for match in re.finditer(re.escape(old), rest) if match.start() % _ALIGNED == 0]
        if len(places) != packed.count((old, new)):
            return None
        for place in places:
            result[place : place + len(new)] = new
            rest[place : place + len(old)] = b"\xff" * len(old)  # no number
    return bytes(result)
