"""Memory of the results of batches, which is used again when no array refers to the memory any more."""

from __future__ import annotations

import contextlib
import math
import mmap
import weakref
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import DTypeLike

from eomgen.base.arrays import Array

#: Bytes of an array from which on pages of 2 MB are asked for, and the system may take unused memory back.
_LARGE = 2**22
#: Bytes of unused memory that are kept at most.
_KEPT = 2**28
#: Whether the system can take back pages of memory that stays mapped (not on Windows).
_RECLAIMED = hasattr(mmap, "MADV_FREE")


class ResultMemory:
    """Uninitialised arrays, in the memory of dropped arrays of the same size if there is any.

    The system clears each page of new memory, which takes as long as the lanes need to compute its numbers. Loops over
    batches drop one result for the next. An array, or any view of the array, keeps its memory.
    """

    def __init__(self) -> None:
        self._unused: deque[mmap.mmap] = deque()

    def empty(self, shape: Sequence[int], dtype: DTypeLike) -> Array:
        """Return an uninitialised array."""
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if size >= _LARGE and not _RECLAIMED:
            return np.empty(shape, dtype)
        memory = self._take(size) or _map_memory(size)
        whole = np.frombuffer(memory, np.uint8)  # the base of all its views
        weakref.finalize(whole, self._give_back, memory).atexit = False
        return whole.view(dtype).reshape(shape)

    def _take(self, size: int) -> mmap.mmap | None:
        for memory in reversed(self._unused.copy()):
            if len(memory) == size:
                with contextlib.suppress(ValueError):  # another thread has taken it
                    self._unused.remove(memory)
                    return memory
        return None

    def _give_back(self, memory: mmap.mmap) -> None:
        """Keep the memory of a dropped array for later arrays, and free the oldest beyond ``_KEPT`` bytes. There is no
        lock: collections drop arrays in the middle of other calls."""
        try:
            if len(memory) >= _LARGE:
                memory.madvise(mmap.MADV_FREE)
        except OSError:  # this kernel lacks it
            return
        self._unused.append(memory)
        while sum(map(len, self._unused.copy())) > _KEPT:
            with contextlib.suppress(IndexError):
                self._unused.popleft()


def _map_memory(size: int) -> mmap.mmap:
    if not _RECLAIMED:
        return mmap.mmap(-1, size)
    memory = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    if size >= _LARGE and hasattr(mmap, "MADV_HUGEPAGE"):
        with contextlib.suppress(OSError):  # kernels without them
            memory.madvise(mmap.MADV_HUGEPAGE)
    return memory


#: The memory of all models.
RESULT_MEMORY = ResultMemory()
