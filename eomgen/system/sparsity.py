"""Sparsity patterns as short texts: places of the nonzeros of sparse matrices, as compressed differences of flat
numbers.

Beams and chains repeat their blocks, so a hundred thousand places become a few hundred letters.
"""

from __future__ import annotations

import base64
import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Places = NDArray[np.int64]


def packed_places(pairs: Sequence[tuple[int, int]]) -> str:
    """Return (row, column) pairs, in order, as a text: compressed differences of successive pairs in base 64."""
    places = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    changes = np.diff(places, axis=0, prepend=np.zeros((1, 2), np.int64))
    return base64.b64encode(zlib.compress(changes.astype("<i4").tobytes(), 9)).decode("ascii")


def unpacked_places(text: str) -> Places:
    """Return the (2, count) rows and columns of a text that ``packed_places`` made."""
    changes = np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype="<i4").reshape(-1, 2)
    places: Places = np.cumsum(changes, axis=0, dtype=np.int64).T
    return places
