"""Calls of C on a stack that is large enough, on threads of their own, and the processor time of such calls.

Generated C allocates no memory: states and workspaces are its caller's, intermediate values on the stack. Models of
thousands of bodies need more than the 8 MB that systems give, so calls that need more stack than a thread has go on
threads of their own with enough of it.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

#: Bytes that any thread of Python has left.
ENOUGH = 4_000_000
#: Functions of a library that need no more than that.
_FLAT = ("eomgen_size", "eomgen_stepper_size", "eomgen_number_type", "eomgen_fingerprint", "eomgen_status_text")
_STARTING = threading.Lock()
#: Of each thread, the processor's time of the threads that it called functions on, ns.
_CALLED = threading.local()


def thread_time_ns() -> int:
    """Return the processor time of this thread, ns, with the time of functions that the thread called on stacks of
    their own."""
    return time.thread_time_ns() + int(getattr(_CALLED, "spent", 0))


def stack_size(needed: int) -> int:
    """Return the size of a thread's stack for functions that need a number of bytes; 0 if any thread has enough."""
    # untouched pages take no memory
    return 0 if needed <= ENOUGH else max(1 << 25, 4 * needed)


def with_stack(lib: Any, needed: int) -> Any:
    """Return the functions of a library, each called with as many bytes of stack as the function needs."""
    return LargeStackFunctions(lib, stack_size(needed)) if stack_size(needed) else lib


class LargeStackFunctions:
    """The functions of a library, called on stacks of a given number of bytes."""

    def __init__(self, lib: Any, size: int) -> None:
        self._lib, self._size = lib, size

    def __getattr__(self, name: str) -> Any:
        function = getattr(self._lib, name)
        return function if name in _FLAT else partial(self._call, function)

    def _call(self, function: Callable[..., Any], *arguments: Any) -> Any:
        """Call a function on a new thread with a large stack; return the result, or raise the error. The thread's
        processor time is added to the caller's for ``thread_time_ns``."""
        results: list[Any] = []
        failures: list[BaseException] = []
        spent: list[int] = []

        def work() -> None:
            began = time.thread_time_ns()
            try:
                results.append(function(*arguments))
            except BaseException as error:  # the error is raised again in the caller's thread
                failures.append(error)
            spent.append(time.thread_time_ns() - began)

        with _STARTING:  # the size is one of the process
            before = threading.stack_size(self._size)
            try:
                thread = threading.Thread(target=work)
                thread.start()
            finally:
                threading.stack_size(before)
        try:
            thread.join()
        finally:
            thread.join()  # Ctrl-C ends the wait, but the memory is in use until the function is done
        _CALLED.spent = getattr(_CALLED, "spent", 0) + sum(spent)
        if failures:
            raise failures[0]
        return results[0]
