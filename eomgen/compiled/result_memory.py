"""Memory of results of batches, used again when no array refers to it any more."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Sequence

import numpy as np
from numpy.typing import DTypeLike, NDArray

from eomgen.base.arrays import Array

#: Bytes of results that are kept for: below, the heap has them at hand; above, NumPy asks for pages of 2 MB, which cost
#: less to fetch than to fill.
_LEAST, _LARGEST = 2**16, 2**23
#: Bytes that are kept at most.
_KEPT = 2**26
#: References to memory that only this module holds: of its list, of a loop and of the call that counts them.
_UNUSED = 3


class ResultMemory:
    """Uninitialised arrays, in the memory of dropped arrays of the same size if there is any.

    The system takes pages of freed memory back, and fetching one costs as much as some ten samples of a batch; loops
    over batches drop one result for the next. Whoever holds an array, or any view of it, keeps its memory.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: list[NDArray[np.uint8]] = []
        self._reused = getattr(sys, "_is_gil_enabled", lambda: True)()  # elsewhere references are not counted exactly

    def empty(self, shape: Sequence[int], dtype: DTypeLike) -> Array:
        """Return an uninitialised array."""
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if not (self._reused and _LEAST <= size <= _LARGEST):
            return np.empty(shape, dtype)
        with self._lock:
            return self._memory(size).view(dtype).reshape(shape)

    def _memory(self, size: int) -> NDArray[np.uint8]:
        for memory in self._kept:
            if memory.size == size and sys.getrefcount(memory) == _UNUSED:
                return memory
        new = np.empty(size, np.uint8)
        room = _KEPT - sum(memory.size for memory in self._kept) - size
        while room < 0 and self._kept:
            room += self._kept.pop(0).size
        self._kept.append(new)
        return new
