"""The compiled functions on NumPy arrays: leading axes of all inputs broadcast, and one C call evaluates the whole
batch, by the model's own library or by its companion with a sample in each lane of a vector.

A companion costs a compiler's time and gives the same bits two to four times as fast. So the companion is compiled in
the background once the batches of a function have taken as long as the compilation will, and a batch goes on with the
companion as soon as the compiler is done. It is used if it gives the same bits as the model's own library for some of
the batch's own samples, and is not slower.
"""

from __future__ import annotations

import contextlib
import functools
import math
import os
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from enum import Enum
from itertools import pairwise
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import DTypeLike

from eomgen.base.arrays import Array
from eomgen.base.messages import Log
from eomgen.base.threads import share, thread_count
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.system.terms import TERMS, nearest_term
from eomgen.toolchain.compiler import RunningCompilers, in_background
from eomgen.toolchain.library import Library
from eomgen.toolchain.profiles import PROFILES

_LOG = Log(__name__)
P = ParamSpec("P")
R = TypeVar("R")

#: The variable that says whether large batches have companions.
LANES_VARIABLE = "EOMGEN_LANES"
#: Samples of a batch at least: below, lanes stay empty, and the overhead of Python is larger.
LEAST = 16
#: Seconds of batches after which a companion is looked for in the cache.
_LOOK = 2e-3
#: Samples that are evaluated by both libraries before the companion is taken.
_COMPARED = 64


class Choice(Enum):
    """Whether companions are compiled: never, if the time saved exceeds the time of compilation, or at once for every
    batch."""

    OFF = "off"
    AUTO = "auto"
    NOW = "now"


def chosen() -> Choice:
    """Return the choice by ``EOMGEN_LANES``, ``auto`` by default. Raises UsageError for other words."""
    text = os.environ.get(LANES_VARIABLE) or Choice.AUTO.value
    try:
        return Choice(text)
    except ValueError:
        where, fault = f"environment variable {LANES_VARIABLE}", f"{text!r} is not a choice of lanes [E0259]"
        raise UsageError(Problem(where, fault, "auto, off or now")) from None


class Companion:
    """State of the companion library of one function, compiled for a sample in each lane of a vector. ``seconds`` that
    batches took or will take, estimates ``of_sample`` and for ``compiling``, the ``library`` if made, and whether this
    was looked for in the cache, is being compiled, was compared, or was refused."""

    def __init__(self, operations: int) -> None:
        self.seconds = 0.0  # that batches of this companion took or will take
        self.of_sample = 2e-10 * operations  # s, if no batch has been timed
        # s; gcc 12 on a core that others use as well: 0.64 s for the 608 operations of Panda's inverse dynamics, 5.9 s
        # for the 3664 of Talos', of which 0.32 and 2.4 s are the compiler's own
        self.compiling = 0.3 + 1e-3 * operations
        self.library: Library | None = None
        self.sought = self.begun = self.judged = self.refused = False


class LaneCompanions:
    """The companion libraries of a compiled library, one for each function, shared by all callers of the library.

    Parameters
    ----------
    library : Library
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        self._lock = threading.Lock()
        self._found: dict[str, Companion] = {}

    @classmethod
    def of(cls, library: Library) -> LaneCompanions:
        """Return the companions of a library, the same object for each call."""
        kept: LaneCompanions | None = library.kept.get("lanes")
        if kept is None:
            kept = library.kept.setdefault("lanes", cls(library))
        return kept

    def expect(self, name: str, operations: int, count: int, choice: Choice) -> Companion | None:
        """Announce a batch of ``count`` samples of function ``name``, and return the state of the companion library.

        The companion is looked for in the cache, and compiled in the background once batches have taken longer than the
        compilation, or now with ``Choice.NOW``. None for small batches, without companions, or after a refusal.
        ``operations`` are the operations of one sample.
        """
        make = self._library.companion
        if make is None or choice is Choice.OFF or count < LEAST:
            return None
        companion = self._found.get(name) or self._found.setdefault(name, Companion(operations))
        if companion.refused:
            return None
        if companion.judged:
            return companion
        companion.seconds += companion.of_sample * count
        if choice is Choice.NOW:
            with self._lock:
                if companion.library is None:
                    self._make(name, companion, RunningCompilers())
        elif companion.seconds > _LOOK and not companion.sought:
            companion.sought = True
            self._make(name, companion)
        compiled = PROFILES[self._library.profile].split
        if compiled and companion.seconds > companion.compiling and companion.library is None:
            self._begin(name, companion)
        return companion

    def judge(
        self, companion: Companion, name: str, inputs: Sequence[Array], sizes: Sequence[int], choice: Choice
    ) -> Library | None:
        """Return the companion library for use in a batch, or None if the companion is missing or was refused.

        A new companion evaluates some samples of the batch as the model's library does, and is refused for good if a
        bit differs or if the evaluation takes longer (not with ``Choice.NOW``).

        Parameters
        ----------
        inputs, sizes : of the batch, and numbers of each output
        """
        library = companion.library
        if library is None or companion.refused:
            return None
        if companion.judged:
            return library
        if not self._lock.acquire(blocking=False):  # another thread holds the lock
            return None
        try:
            why = self._reason_against(library, name, inputs, sizes, choice)
            if why:
                _LOG.info("lanes of %s are left out: their library %s", name, why)
            companion.refused = bool(why)
            companion.judged = True
        finally:
            self._lock.release()
        return None if companion.refused else library

    def _reason_against(
        self, library: Library, name: str, inputs: Sequence[Array], sizes: Sequence[int], choice: Choice
    ) -> str:
        rows = max(len(array) for array in inputs if array.ndim == 2)
        taken = np.linspace(0, rows - 1, _COMPARED).astype(np.intp)
        some = [array if array.ndim == 1 else array[taken] for array in inputs]
        seconds, results = [], []
        for candidate in (self._library, library):
            outputs = [np.empty((_COMPARED, size)) for size in sizes]
            call = candidate.bind(name, some, outputs)
            seconds.append(min(_measure_time(call) for _ in range(5)))
            results.append(outputs)
        if not all(_same_bits(first, second) for first, second in zip(*results, strict=True)):
            return "differs in bits"
        return "is slower" if choice is not Choice.NOW and seconds[1] > seconds[0] else ""

    def _begin(self, name: str, companion: Companion) -> None:
        with self._lock:
            if companion.begun:
                return
            companion.begun = True
        _LOG.info("compiles the lanes of %s in the background", name)
        in_background("eomgen-lanes", lambda running: self._make(name, companion, running))

    def _make(self, name: str, companion: Companion, running: RunningCompilers | None = None) -> None:
        """Compile the companion of a function, and keep it in ``companion``; a failure refuses the companion. Without
        ``running``, the companion is only looked for in the cache."""
        try:
            if self._library.companion is not None:
                companion.library = self._library.companion(name, running)
        except (EomgenError, OSError, ValueError) as error:
            if running is not None:
                _LOG.info("lanes of %s are left out: %s", name, error)
                companion.refused = True


def _measure_time(call: Callable[[], Any]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def _same_bits(first: Array, second: Array) -> bool:
    """Return whether two arrays of doubles have equal bits everywhere; any two NaN are equal."""
    return bool(np.all((first.view(np.int64) == second.view(np.int64)) | (np.isnan(first) & np.isnan(second))))


#: Functions that compute arguments of further functions: the functions of time alone, and the angles that the
#: configuration's references follow.
DRIVERS = ("base", "inputs", "base_rates", "input_rates", "joint_angles")


#: Operations of a piece at least: some milliseconds, of which the start of a thread takes a tenth; lanes take a quarter
#: of the time, and 30 us between two pieces are a tenth of a large batch.
_SHARE, _SHARE_OF_LANES = 10_000_000, 40_000_000


class Functions:
    """The functions of a compiled library, called by name on blocks of arrays; ``sizes`` are the sizes of the blocks.

    Parameters
    ----------
    library : Library
    """

    def __init__(self, library: Library) -> None:
        self.library = library
        self.sizes: dict[str, int] = dict(library.layout["sizes"])
        self._layouts = {function["name"]: function for function in library.layout["functions"]}
        self._output_names: dict[str, list[str]] = {}
        self._numbers = {name: number for number, name in enumerate(self._layouts)}
        self._shapes = {
            name: [tuple(output["shape"]) for output in function["outputs"]] for name, function in self._layouts.items()
        }
        self._complex = library.dtype.kind == "c"
        self._runs = 0
        self._lock = threading.Lock()
        ffi = library.ffi
        self._types = (ffi, *(ffi.typeof(text) for text in ("double[]", "double *[]", "long[]")))

    def __contains__(self, name: str) -> bool:
        return name in self._layouts

    def for_runs(self, name: str) -> bool:
        """Return whether the model has a function that runs may call, since it is not compiled later than others."""
        return name in self._layouts and name not in self.library.layout.get("later", ())

    @property
    def names(self) -> list[str]:
        return list(self._layouts)

    def inputs(self, name: str) -> list[str]:
        """Return the input blocks of a function. Raises UsageError when the model was built without the function."""
        if name not in self._layouts:
            raise self.missing(name)
        inputs: list[str] = self._layouts[name]["inputs"]
        return inputs

    def missing(self, name: str, other_scene: str = "") -> UsageError:
        """Return the error for a term that the model was built without, which only an ``other_scene`` has, if given."""
        there = ", ".join(name for name in self._layouts if name not in DRIVERS)
        fault = f"the term {name} is not in this model, which was built with {there} [E0260]"
        known = f'eomgen.build(scene, terms=[..., "{name}"])' if name in TERMS else nearest_term(str(name))
        return UsageError(Problem("", fault, other_scene or known))

    def output_names(self, name: str) -> list[str]:
        """Return the names of a function's outputs."""
        if name not in self._output_names:
            self._output_names[name] = [str(output["name"]) for output in self._layouts[name]["outputs"]]
        return self._output_names[name]

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
        if self.library.successor is not None:
            self.renew()
        names = self.inputs(name)
        arrays = [
            blocks[block].reshape((*blocks[block].shape, 1)) if block == "t" else blocks[block] for block in names
        ]
        if self._complex:
            arrays = [array.astype(self.library.dtype) for array in arrays]
        elif all(array.ndim < 3 and array.flags.c_contiguous for array in arrays):
            few = self._few(name, arrays)
            if few is not None:
                return self._at_once(name, arrays, few)
        leading = {array.shape[:-1] for array in arrays if array.ndim > 1}
        try:
            shape = leading.pop() if len(leading) == 1 else np.broadcast_shapes(*leading)
        except ValueError:
            shapes = ", ".join(f"{block} {blocks[block].shape}" for block in names)
            raise UsageError(
                Problem(name, f"the leading axes do not broadcast: {shapes} [E0261]", "batches of equal shape")
            ) from None
        count = math.prod(shape)
        flat = [_samples(array, shape, count) for array in arrays]
        results = [_empty((count, *output), self.library.dtype) for output in self._shapes[name]]
        if count:
            self._batch(name, flat, results, count)
        return tuple(result.reshape((*shape, *result.shape[1:])) for result in results)

    def renew(self) -> None:
        """Replace the library by the compiled successor, if the successor is made and no run is under way.

        Warns
        -----
        RuntimeWarning
            The compiler has failed, so the tape engine stays.
        """
        with self._lock:
            if not self._runs:
                self.library = compiled_or_same(self.library)

    @contextlib.contextmanager
    def one_library(self) -> Iterator[None]:
        """Keep the library, once renewed, for the time of a context: a run has the bits of one library from its first
        step on."""
        self.renew()
        with self._lock:
            self._runs += 1
        try:
            yield
        finally:
            with self._lock:
                self._runs -= 1

    def _batch(self, name: str, inputs: list[Array], results: list[Array], count: int) -> None:
        """Evaluate ``count`` samples and fill ``results`` in place; threads share a large batch, in lanes if a
        companion is there. ``inputs`` are (size,) or (count, size). C releases the interpreter, and each sample has the
        same bits in any batch, and in lanes."""
        operations = self._operations(name)
        work = count * operations
        choice = chosen()
        one_by_one = self._holding(name)
        lanes = LaneCompanions.of(one_by_one)
        companion = lanes.expect(name, operations, count, choice)
        sizes = [math.prod(shape) for shape in self._shapes[name]]

        def part(begin: int, end: int) -> None:
            whole = end - begin == count
            part_inputs = inputs if whole else [array if array.ndim == 1 else array[begin:end] for array in inputs]
            filled = results if whole else [result[begin:end] for result in results]
            library = None if companion is None else lanes.judge(companion, name, inputs, sizes, choice)
            (library or one_by_one).call(name, part_inputs, filled)

        began, threads = time.perf_counter(), 1
        if work < 2 * _SHARE:
            part(0, count)
        else:
            threads = min(count, work // _SHARE, thread_count())
            least = _SHARE_OF_LANES if companion is not None and companion.judged else _SHARE
            pieces = threads * max(1, min(count // threads, work // (threads * least)))  # as many for each thread
            share(part, pairwise(count * k // pieces for k in range(pieces + 1)), threads)
        if companion is not None and companion.library is None:
            companion.of_sample = max(1, threads) * (time.perf_counter() - began) / count

    def _few(self, name: str, arrays: list[Array]) -> int | None:
        """Return the number of samples on the first axes of a small batch, 0 for one sample without axes, else None."""
        rows = {len(array) for array in arrays if array.ndim > 1}
        if len(rows) != 1:
            return None if rows else 0
        count = rows.pop()
        return count if 1 < count < LEAST and count * self._operations(name) < 2 * _SHARE else None

    def _at_once(self, name: str, arrays: list[Array], count: int) -> tuple[Array, ...]:
        """Return the outputs of one sample (``count`` 0), or of few along the first axes."""
        ffi, doubles, pointers, longs = self._types
        leading = (count,) if count else ()
        results = tuple(np.empty((*leading, *shape)) for shape in self._shapes[name])
        inputs = ffi.new(pointers, [ffi.from_buffer(doubles, array) for array in arrays])
        outputs = ffi.new(pointers, [ffi.from_buffer(doubles, array) for array in results])
        strides = ffi.new(longs, [array.shape[1] if array.ndim > 1 else 0 for array in arrays])
        library = self._holding(name) if self.library.lacking else self.library
        library.lib.eomgen_call(self._numbers[name], count or 1, inputs, strides, outputs)
        return results

    def _operations(self, name: str) -> int:
        return max(1, int(self._layouts[name]["operations"]))

    def _holding(self, name: str) -> Library:
        """Return the library that has a function, which is made now if runs do not call the function."""
        return self.library.whole() if name in self.library.lacking else self.library


def by_one_library(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function, wrapped so that its first argument, a model, does not change its library during a call. So
    all results of a run have the bits of one library."""

    @functools.wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        model: Any = args[0] if args else None
        if model is None or model.functions.library.successor is None:
            return function(*args, **kwargs)
        with model.functions.one_library():
            return function(*args, **kwargs)

    return call


def compiled_or_same(library: Library) -> Library:
    """Return the compiled successor of a library on the tape engine once made, else the library itself.

    Warns
    -----
    RuntimeWarning
        The compiler has failed, so the tape engine stays; once.
    """
    successor = library.successor
    if successor is None:
        return library
    if successor.error is not None and not library.lacking:
        library.successor = None
        warnings.warn(f"the model stays on the tape engine: {successor.error} [W0026]", RuntimeWarning, stacklevel=4)
        return library
    if successor.library is None:
        return library
    successor.library.predecessor = library
    return successor.library


def _empty(shape: tuple[int, ...], dtype: DTypeLike) -> Array:
    if math.prod(shape) * np.dtype(dtype).itemsize < 2**16:  # bytes for which the heap has memory at hand
        return np.empty(shape, dtype)
    from eomgen.compiled.result_memory import RESULT_MEMORY  # noqa: PLC0415  # single states need no such memory

    return RESULT_MEMORY.empty(shape, dtype)


def _samples(array: Array, shape: tuple[int, ...], count: int) -> Array:
    """Return a contiguous array: (size,) if all samples have one value, else (count, size), from (..., size). ``shape``
    are the leading axes of the batch, ``count`` the product."""
    size = array.shape[-1]
    if array.ndim == 2 and len(array) == count != 1 and array.flags.c_contiguous:
        return array
    if array.size == size and count != 0:
        return np.ascontiguousarray(array.reshape(size))
    return np.ascontiguousarray(np.broadcast_to(array, (*shape, size)).reshape(count, size))
