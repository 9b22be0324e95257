"""Threads that share the work of a batch or an ensemble, and how many there are (``EOMGEN_THREADS``)."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable

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
        fault = f"{text!r} is not a number of threads"
        raise UsageError(
            Problem(f"environment variable {THREADS_VARIABLE}", fault, f"{THREADS_VARIABLE}=2, or unset it")
        )
    return int(text)


def share(call: Callable[[int, int], None], pieces: Iterable[tuple[int, int]], threads: int) -> None:
    """Call a function with each piece, in this thread and in ``threads - 1`` further threads; raise the first error of
    the calls.

    A batch is there in milliseconds, of which a pool of threads would take a third.
    """
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
    for other in others:
        other.start()
    work()
    for other in others:
        other.join()
    if failures:
        raise failures[0]
