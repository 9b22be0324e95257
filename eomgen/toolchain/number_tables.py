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
    """Return the bytes of a library with other numbers in its tables, None if the tables are not found just once, or if
    a table of zeros alone looks like the room between tables.

    Compilers write the tables of a source one after another, in the order of the source or in reverse, with zeros
    between them up to the next multiple of the alignment.

    Parameters
    ----------
    tables : numbers and as many new numbers of every table, in the order of the source
    """
    if not all(any(old) for old, _ in tables):
        return None
    packed = [(array("d", old).tobytes(), array("d", new).tobytes()) for old, new in tables]
    for ordered in (packed, packed[::-1]):
        block = rb"\0*?".join(b"(%b)" % re.escape(old) for old, _ in ordered)
        places = [match for match in re.finditer(block, library) if match.start() % _ALIGNED == 0]
        if len(places) == 1:
            result = bytearray(library)
            for number, (_, new) in enumerate(ordered, 1):
                result[slice(*places[0].span(number))] = new
            return bytes(result)
    return None
