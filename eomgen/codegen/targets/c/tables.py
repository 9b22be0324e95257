"""Tables of curves in C: one for all curves of the same rows, and large ones as bytes, which compile ten times faster.

A compiler takes 4 us for a number in an initializer and 50 ns for a byte in a text. So tables of many numbers are texts
in a file of their own: doubles of IEEE 754, byte by byte, the least significant first, for any byte order of machines.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from eomgen.codegen.program import ProgramCurve

#: Numbers from which on a table is bytes.
LARGE = 4096
#: Bytes in one text of a line.
_LINE = 28
_ESCAPED = {code: f"\\{code:03o}" for code in range(256) if not 32 <= code < 127 or chr(code) in '"\\?'}


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
    def packed(self) -> bool:
        """Whether it is bytes in a file of its own."""
        return len(self.rows) * len(self.rows[0]) >= LARGE

    @property
    def shared(self) -> bool:
        """Whether several curves have it."""
        return len(self.curves) > 1

    @property
    def size(self) -> int:
        """Bytes of a row, and the zero that ends its text."""
        return 8 * len(self.rows[0]) + 1

    @property
    def lines(self) -> Iterator[str]:
        """Lines of the initializer, one row of bytes after the other."""
        data, size = np.array(self.rows, dtype="<f8").tobytes().decode("latin-1"), self.size - 1
        for start in range(0, len(data), size):
            row = data[start : start + size]
            texts = [row[k : k + _LINE].translate(_ESCAPED) for k in range(0, size, _LINE)]
            for text in texts[:-1]:
                yield f'    "{text}"'
            yield f'    "{texts[-1]}",'


def curve_tables(curves: Sequence[ProgramCurve]) -> tuple[CurveTable, ...]:
    """Return the tables of curves, equal ones once."""
    found: dict[tuple[tuple[float, ...], ...], list[int]] = {}
    for number, curve in enumerate(curves, 1):
        found.setdefault(curve.rows, []).append(number)
    return tuple(CurveTable(number, rows, tuple(of)) for number, (rows, of) in enumerate(found.items(), 1))
