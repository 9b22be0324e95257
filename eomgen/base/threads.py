"""Threads that share the work of a batch or an ensemble, and how many there are (``EOMGEN_THREADS``); one thread for
small matrices.

OpenBLAS, which NumPy and SciPy bring along, wakes a thread for each processor for matrices from some tens of rows on,
and threads that wait for the next matrix stay busy. So analyses of models with some hundred velocities take several
times as long on a machine with other work, and no less on an idle one. The import of NumPy takes twice as long: its
threads wait for a first matrix meanwhile.
"""

from __future__ import annotations

import contextlib
import functools
import os
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any, ClassVar

from eomgen.errors import Problem, UsageError

#: The variable that says how many, in place of one for each processor.
THREADS_VARIABLE = "EOMGEN_THREADS"


def thread_count() -> int:
    """Return the largest number of threads side by side: ``EOMGEN_THREADS``, or one for each processor of this
    process.

    Raises
    ------
    UsageError
        The variable is not a whole number from 1 on.
    """
    if not (text := os.environ.get(THREADS_VARIABLE, "")):
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        fault = f"{text!r} is not a number of threads [E0146]"
        raise UsageError(
            Problem(f"environment variable {THREADS_VARIABLE}", fault, f"{THREADS_VARIABLE}=2, or unset it")
        )
    return int(text)


def share(call: Callable[[int, int], None], pieces: Iterable[tuple[int, int]], threads: int) -> None:
    """Call ``call`` with both numbers of each piece, in this thread and in ``threads - 1`` further threads; wait for
    all, and raise the first error of the calls. After an error no further piece is begun. A batch is there in
    milliseconds, of which a pool of threads would take a third."""
    waiting = deque(pieces)
    failures: list[BaseException] = []

    def work() -> None:
        while True:
            try:
                piece = waiting.popleft()
            except IndexError:
                return
            try:
                call(*piece)
            except BaseException as error:  # the error is raised in the thread of the caller
                failures.append(error)
                waiting.clear()

    others = [threading.Thread(target=work, name=f"eomgen-batch_{number}") for number in range(1, threads)]
    for thread in others:
        thread.start()
    work()
    for thread in others:
        thread.join()
    if failures:
        raise failures[0]


@contextlib.contextmanager
def variables(**values: str) -> Iterator[None]:
    """Set variables of the environment within the block: for libraries that read them when loaded. Variables
    of the user stay as they are, and no variable is set while other threads run, which might start processes or read
    the environment."""
    alone = threading.active_count() == 1
    added = {name: value for name, value in values.items() if alone and name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)


def calm_imports() -> contextlib.AbstractContextManager[None]:
    """Return a context in which an OpenBLAS that is loaded has threads that wait busily for 2^20 cycles, 0.4 ms, and
    not for 2^26, 27 ms, before they sleep."""
    return contextlib.nullcontext() if "numpy" in sys.modules else variables(OPENBLAS_THREAD_TIMEOUT="20")


#: Prefixes and suffixes of the names of functions of OpenBLAS, in the libraries of NumPy and SciPy and in a system's.
_PREFIXES, _SUFFIXES = ("scipy_openblas", "openblas"), ("64_", "")


@contextlib.contextmanager
def one_thread_of_algebra(velocities: int) -> Iterator[None]:
    """Limit OpenBLAS to one thread within the block for a model with up to 1000 ``velocities``; the number before is
    set again when all threads of Python have left such blocks."""
    if velocities > 1000:
        yield
        return
    with _Algebra.lock:
        _Algebra.inside += 1
        for read, write in _openblas("scipy.linalg" in sys.modules):
            if (threads := read()) > 1:  # libraries that were loaded since are found, too
                _Algebra.before.append((write, threads))
                write(1)
    try:
        yield
    finally:
        with _Algebra.lock:
            _Algebra.inside -= 1
            while _Algebra.before and not _Algebra.inside:
                write, threads = _Algebra.before.pop()
                write(threads)


class _Algebra:
    """Count of threads of Python within ``one_thread_of_algebra``, and the numbers of OpenBLAS threads before, with the
    functions that set them again."""

    lock = threading.Lock()
    inside = 0
    before: ClassVar[list[tuple[Callable[[int], None], int]]] = []


@functools.cache
def _openblas(of_scipy: bool) -> list[tuple[Callable[[], int], Callable[[int], None]]]:
    """Return the functions that read and write the number of threads of each loaded OpenBLAS; none on systems that do
    not list loaded libraries as Linux does.

    Parameters
    ----------
    of_scipy : whether SciPy has loaded a library of its own
    """
    try:
        lines = Path("/proc/self/maps").read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return []
    import ctypes  # noqa: PLC0415  # few commands work with matrices

    files = dict.fromkeys(line[line.index("/") :] for line in lines if "openblas" in line and "/" in line)
    functions = []
    for file in files:
        try:
            library: Any = ctypes.CDLL(file)
        except OSError:
            continue
        for prefix in _PREFIXES:
            for suffix in _SUFFIXES:
                read = getattr(library, f"{prefix}_get_num_threads{suffix}", None)
                write = getattr(library, f"{prefix}_set_num_threads{suffix}", None)
                if read is not None and write is not None:
                    functions.append((read, write))
    return functions
