"""Work side by side: threads that share a batch or an ensemble, and advisory locks of files that one process writes.

Advisory file locks: on cache entries under construction, on folders that one run writes to.

The kernel releases them when their process ends. Without file locks (by the file system or the operating system),
processes build independently: slower, but correct.
"""

from __future__ import annotations

import contextlib
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from eomgen.errors import Problem, UsageError

#: The variable that says how many, in place of one for each processor.
THREADS_VARIABLE = "EOMGEN_THREADS"


def thread_count() -> int:
    """Return the largest number of threads side by side: ``EOMGEN_THREADS``, or one for each processor of this
    process.

    Raises
    ------
    UsageError
        The variable is no whole number from 1 on.
    """
    if not (text := os.environ.get(THREADS_VARIABLE, "")):
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not text.isascii() or not text.isdigit() or int(text) < 1:
        fault = f"{text!r} is no number of threads"
        raise UsageError(
            Problem(f"environment variable {THREADS_VARIABLE}", fault, f"{THREADS_VARIABLE}=2, or unset it")
        )
    return int(text)


def share(call: Callable[[int, int], None], pieces: Iterable[tuple[int, int]], threads: int) -> None:
    """Call a function with each piece, in this thread and in ``threads - 1`` others; raise its first error.

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
            except BaseException as error:  # it is raised in the thread of the caller
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


try:
    import fcntl
except ImportError:  # pragma: no cover  # not on Windows
    fcntl = None  # type: ignore[assignment]  # its absence is asked for below


@contextlib.contextmanager
def claimed(file: Path) -> Iterator[None]:
    """Hold the lock on this file, waiting while another process holds it. The file is removed afterwards."""
    descriptor = _taken(file)
    try:
        yield
    finally:
        if descriptor is not None:
            with contextlib.suppress(OSError):
                file.unlink()  # while it is still held: who waits for it sees that it has gone, and makes another
            os.close(descriptor)


def hold(folder: Path) -> int | None:
    """Return a descriptor that marks a folder as in use until it is closed; None if there are no locks."""
    return _locked(folder, os.O_RDONLY, wait=False)


@contextlib.contextmanager
def sole_use(folder: Path) -> Iterator[bool]:
    """Hold the lock on a folder, and give whether no other process does; always true if there are no locks."""
    descriptor, alone = -1, True
    try:
        if fcntl is not None:
            try:
                descriptor = os.open(folder, os.O_RDONLY)
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                alone = False
            except OSError:
                pass  # no locks here
        yield alone
    finally:
        if descriptor >= 0:
            os.close(descriptor)


def abandoned(folder: Path) -> bool:
    """Return whether no process holds the lock on a folder."""
    descriptor = _locked(folder, os.O_RDONLY, wait=False)
    if descriptor is None:
        return False
    os.close(descriptor)
    return True


def _taken(file: Path) -> int | None:
    """Return a descriptor of the file that this path names now, locked."""
    while True:
        descriptor = _locked(file, os.O_RDWR | os.O_CREAT, wait=True)
        if descriptor is None:
            return None
        try:
            if os.path.samestat(os.fstat(descriptor), file.stat()):
                return descriptor
        except OSError:
            pass  # its last holder has removed it
        os.close(descriptor)


def _locked(path: Path, flags: int, *, wait: bool) -> int | None:
    if fcntl is None:
        return None
    descriptor = -1
    try:
        descriptor = os.open(path, flags, 0o666)
        fcntl.flock(descriptor, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        if descriptor >= 0:
            os.close(descriptor)
        return None
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor
