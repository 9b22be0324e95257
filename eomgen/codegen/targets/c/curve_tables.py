"""Tables of curves in C: one for all curves of the same rows, and large ones as bytes, which compile ten times faster.

A compiler takes 4 us for a number in an initializer and 50 ns for a byte in a text. So tables of many numbers are texts
in a file of their own: doubles of IEEE 754, byte by byte, the least significant first, for any byte order of machines.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from eomgen.base.data import dataclass
from eomgen.codegen.program import ProgramCurve

#: Numbers from which on a table is bytes.
LARGE = 4096
#: Bytes in one text of a line.
_LINE = 28
#: C text of each byte: four characters, or one character and zeros; only zeros for the filler at a line's end.
_NOTHING = 256
_WRITTEN = np.zeros((257, 4), dtype=np.uint8)
for _code in range(256):
    _plain = 32 <= _code < 127 and chr(_code) not in '"\\?'
    _WRITTEN[_code] = [_code, 0, 0, 0] if _plain else list(f"\\{_code:03o}".encode())


#: Bytes of tables that are escaped at once.
_TOGETHER = 2**20


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
        """Whether the table is a file of bytes."""
        return len(self.rows) * len(self.rows[0]) >= LARGE

    @property
    def shared(self) -> bool:
        """Whether several curves have this table."""
        return len(self.curves) > 1

    @property
    def size(self) -> int:
        """Bytes of a row, including the zero at the end of a text."""
        return 8 * len(self.rows[0]) + 1

    @property
    def text(self) -> str:
        """Lines of the initializer, row by row."""
        data = np.array(self.rows, dtype="<f8").view(np.uint8)
        together = max(1, _TOGETHER // data.shape[1])
        parts = [_escaped(data[first : first + together]) for first in range(0, len(data), together)]
        return b"\n".join(parts).decode("ascii")


def _escaped(data: npt.NDArray[np.uint8]) -> bytes:
    """Return rows of bytes as texts of C, each in lines of at most ``_LINE`` bytes, and a comma after each row.

    All characters are laid out at places of equal width, and then zeros, which no text has, are deleted.
    """
    rows, size = data.shape
    lines, width = -(-size // _LINE), 4 * _LINE
    padded = np.full((rows, lines * _LINE), _NOTHING, dtype=np.int16)
    padded[:, :size] = data
    text = np.empty((rows, lines, 5 + width + 3), dtype=np.uint8)
    text[:, :, :5], text[:, :, 5 + width :] = list(b'    "'), list(b'"\0\n')
    text[:, :, 5 : 5 + width] = _WRITTEN.view(np.uint32)[:, 0].take(padded).view(np.uint8).reshape(rows, lines, width)
    text[:, -1, -2] = ord(",")
    return text.tobytes().translate(None, b"\0")[:-1]


def curve_tables(curves: Sequence[ProgramCurve]) -> tuple[CurveTable, ...]:
    """Return the tables of curves, equal tables once."""
    result: dict[tuple[tuple[float, ...], ...], list[int]] = {}
    for number, curve in enumerate(curves, 1):
        result.setdefault(curve.rows, []).append(number)
    return tuple(CurveTable(number, rows, tuple(of)) for number, (rows, of) in enumerate(result.items(), 1))
