"""The compiled functions on NumPy arrays: leading axes of all inputs broadcast, and one C call evaluates the whole
batch.

Memory of results of batches, used again when no array refers to it any more.
"""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import DTypeLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.threads import share, thread_count
from eomgen.compiled.lanes import Lanes, chosen
from eomgen.errors import Problem, UsageError
from eomgen.system.terms import TERMS, nearest_term
from eomgen.toolchain.library import Library

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


#: Functions that compute arguments of the others: the functions of time alone, and the angles that the configuration's
#: references follow.
DRIVERS = ("base", "inputs", "base_rates", "input_rates", "joint_angles")


#: Operations of a piece at least: some milliseconds, of which the start of a thread takes a tenth.
_SHARE = 10_000_000


class Functions:
    """The functions of a library by name.

    Parameters
    ----------
    library : Library
    """

    def __init__(self, library: Library) -> None:
        self.library = library
        self.sizes: dict[str, int] = dict(library.layout["sizes"])
        self._layouts = {function["name"]: function for function in library.layout["functions"]}
        self._numbers = {name: number for number, name in enumerate(self._layouts)}
        self._shapes = {
            name: [tuple(output["shape"]) for output in function["outputs"]] for name, function in self._layouts.items()
        }
        self._complex = library.dtype.kind == "c"
        self._memory = ResultMemory()
        ffi = library.ffi
        self._types = (ffi, *(ffi.typeof(text) for text in ("double[]", "double *[]", "long[]")))

    def __contains__(self, name: str) -> bool:
        return name in self._layouts

    @property
    def names(self) -> list[str]:
        return list(self._layouts)

    def inputs(self, name: str) -> list[str]:
        """Return the input blocks of a function. Raises UsageError when the model was built without it."""
        if name not in self._layouts:
            there = ", ".join(name for name in self._layouts if name not in DRIVERS)
            fault = f"the term {name} is not in this model, which was built with {there}"
            known = f'eomgen.build(scene, terms=[..., "{name}"])' if name in TERMS else nearest_term(str(name))
            raise UsageError(Problem("", fault, known))
        inputs: list[str] = self._layouts[name]["inputs"]
        return inputs

    def output_names(self, name: str) -> list[str]:
        """Return the names of a function's outputs."""
        return [str(output["name"]) for output in self._layouts[name]["outputs"]]

    def __call__(self, name: str, blocks: Mapping[str, Array]) -> tuple[Array, ...]:
        """Evaluate a function.

        Parameters
        ----------
        blocks : mapping
            At least the function's inputs; each (..., size), and t (...).

        Returns
        -------
        tuple of arrays
            Leading axes are the broadcast leading axes of the inputs; the rest is each output's shape.

        Raises
        ------
        UsageError
            Leading axes that do not broadcast.
        """
        names = self.inputs(name)
        arrays = [
            blocks[block].reshape((*blocks[block].shape, 1)) if block == "t" else blocks[block] for block in names
        ]
        if self._complex:
            arrays = [array.astype(self.library.dtype) for array in arrays]
        elif all(array.ndim == 1 and array.flags.c_contiguous for array in arrays):
            return self._single(name, arrays)
        leading = {array.shape[:-1] for array in arrays if array.ndim > 1}
        try:
            shape = leading.pop() if len(leading) == 1 else np.broadcast_shapes(*leading)
        except ValueError:
            shapes = ", ".join(f"{block} {blocks[block].shape}" for block in names)
            raise UsageError(
                Problem(name, f"the leading axes do not broadcast: {shapes}", "batches of equal shape")
            ) from None
        count = math.prod(shape)
        flat = [_samples(array, shape, count) for array in arrays]
        results = [self._memory.empty((count, *output), self.library.dtype) for output in self._shapes[name]]
        if count:
            self._batch(name, flat, results, count)
        return tuple(result.reshape((*shape, *result.shape[1:])) for result in results)

    def _batch(self, name: str, inputs: list[Array], results: list[Array], count: int) -> None:
        """Evaluate a batch in pieces; threads share a large one. C releases the interpreter, and each sample has the
        same bits in any batch, and in lanes."""
        operations = max(1, int(self._layouts[name]["operations"]))
        work = count * operations
        choice = chosen()
        lanes = Lanes.of(self.library)
        companion = lanes.expect(name, operations, count, choice)
        sizes = [math.prod(shape) for shape in self._shapes[name]]

        def part(begin: int, end: int) -> None:
            whole = end - begin == count
            own = inputs if whole else [array if array.ndim == 1 else array[begin:end] for array in inputs]
            filled = results if whole else [result[begin:end] for result in results]
            library = None if companion is None else lanes.judged(companion, name, inputs, sizes, choice)
            (library or self.library).call(name, own, filled)

        began, threads = time.perf_counter(), 1
        if work < 2 * _SHARE:
            part(0, count)
        else:
            threads = min(count, work // _SHARE, thread_count())
            pieces = threads * max(1, min(count // threads, work // (threads * _SHARE)))  # as many for each thread
            share(part, pairwise(count * k // pieces for k in range(pieces + 1)), threads)
        if companion is not None and companion.library is None:
            companion.of_sample = max(1, threads) * (time.perf_counter() - began) / count

    def fastest(self, name: str, blocks: Mapping[str, Array], count: int) -> Library:
        """Return the library by which samples of a function take least, for C that calls it: the model's own, or
        its companion in lanes.

        Parameters
        ----------
        blocks : as of a call, of some of the samples
        count : of all of them
        """
        companion = Lanes.of(self.library).expect(name, max(1, int(self._layouts[name]["operations"])), count, chosen())
        if companion is None:
            return self.library
        sizes = [math.prod(shape) for shape in self._shapes[name]]
        inputs = [
            np.ascontiguousarray(blocks[block][:, np.newaxis] if block == "t" else blocks[block], float)
            for block in self.inputs(name)
        ]
        return Lanes.of(self.library).judged(companion, name, inputs, sizes, chosen()) or self.library

    def _single(self, name: str, arrays: list[Array]) -> tuple[Array, ...]:
        """Evaluate one sample, as in a caller's inner loop, so without the bookkeeping of batches."""
        ffi, doubles, pointers, longs = self._types
        results = tuple(np.empty(shape) for shape in self._shapes[name])
        inputs = ffi.new(pointers, [ffi.from_buffer(doubles, array) for array in arrays])
        outputs = ffi.new(pointers, [ffi.from_buffer(doubles, array) for array in results])
        self.library.lib.eomgen_call(self._numbers[name], 1, inputs, ffi.new(longs, len(arrays)), outputs)
        return results


def _samples(array: Array, shape: tuple[int, ...], count: int) -> Array:
    """Return (size,) for one value in all samples, else (count, size)."""
    size = array.shape[-1]
    if array.ndim == 2 and len(array) == count != 1 and array.flags.c_contiguous:
        return array
    if array.size == size and count != 0:
        return np.ascontiguousarray(array.reshape(size))
    return np.ascontiguousarray(np.broadcast_to(array, (*shape, size)).reshape(count, size))
