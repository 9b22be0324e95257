"""Places in flat arrays: nonzeros of sparse matrices as one short text, and blocks of ``second_partials``.

Places of the nonzeros of sparse matrices as one short text: differences of flat numbers, compressed.

Beams and chains repeat their blocks, so a hundred thousand places become a few hundred letters.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Places = NDArray[np.int64]


def packed_places(pairs: Sequence[tuple[int, int]]) -> str:
    """Return (row, column) pairs, in order, as text."""
    places = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    changes = np.diff(places, axis=0, prepend=np.zeros((1, 2), np.int64))
    return base64.b64encode(zlib.compress(changes.astype("<i4").tobytes(), 9)).decode("ascii")


def unpacked_places(text: str) -> Places:
    """Return the (2, count) rows and columns of a text that ``packed_places`` made."""
    changes = np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i4").reshape(-1, 2)
    places: Places = np.cumsum(changes, axis=0, dtype=np.int64).T
    return places


class SecondBlocks(NamedTuple):
    """Numbers of components by name, in order.

    Attributes
    ----------
    weights : of the residual ``r``, ``zdot``, holonomic constraints ``Phi``, rates ``w`` and accelerations ``wdot`` of
        all constraints, outputs ``y``
    direction : of ``q`` (left-trivialised), ``v``, ``a``, ``z``, ``lam``, ``p``, ``u``
    """

    weights: Mapping[str, int]
    direction: Mapping[str, int]

    def places(self, block: str) -> dict[str, slice]:
        """Return the slices of the parts of ``weights`` or ``direction``."""
        result, first = {}, 0
        for name, size in getattr(self, block).items():
            result[name], first = slice(first, first + size), first + size
        return result


def second_blocks(
    *, nv: int, nz: int, nu: int, holonomic: int, rows: int, outputs: int, parameters: int
) -> SecondBlocks:
    """Return the blocks of a system with so many of each; ``rows``: of all constraints."""
    weights = {"r": nv, "zdot": nz, "Phi": holonomic, "w": rows, "wdot": rows, "y": outputs}
    return SecondBlocks(weights, {"q": nv, "v": nv, "a": nv, "z": nz, "lam": rows, "p": parameters, "u": nu})
