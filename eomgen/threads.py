"""How many threads share the work of a batch or an ensemble."""

from __future__ import annotations

import os

from eomgen.errors import Problem, UsageError

#: The variable that says how many, in place of one for each processor.
THREADS_VARIABLE = "EOMGEN_THREADS"


def thread_count() -> int:
    """Return how many threads may run side by side: what ``EOMGEN_THREADS`` says, or one for each processor of this
    process.

    Raises
    ------
    UsageError
        The variable is no whole number from 1 on.
    """
    if not (text := os.environ.get(THREADS_VARIABLE, "")):
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        what = f"{text!r} is no number of threads"
        raise UsageError(
            Problem(f"environment variable {THREADS_VARIABLE}", what, f"{THREADS_VARIABLE}=2, or unset it")
        )
    return int(text)
