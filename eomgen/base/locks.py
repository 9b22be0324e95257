"""Advisory file locks of processes: on cache entries under construction, and on folders to which one run writes.

The kernel releases a lock when its process ends. Windows locks files, not folders. Without locks (by the file system or
the operating system), processes build independently: slower, but correct.
"""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # pragma: no cover  # not on Windows
    fcntl = None  # type: ignore[assignment]  # its absence is asked for below

#: Locks of Windows.
_windows: Any = import_module("msvcrt") if os.name == "nt" else None


@contextlib.contextmanager
def claim(file: Path) -> Iterator[None]:
    """Hold the lock on a file, which is made if missing, within the block; wait while another process holds the lock.
    The file is removed afterwards. Without locks of the system the block runs at once."""
    descriptor = _take(file)
    try:
        yield
    finally:
        if descriptor is not None:
            with contextlib.suppress(OSError):
                # while the lock is still held: a waiting process sees that the file has gone, and makes another
                file.unlink()
            os.close(descriptor)


def hold(folder: Path) -> int | None:
    """Return a descriptor that marks a folder as in use until the descriptor is closed; None if another process does
    so, and if there are no locks."""
    with contextlib.suppress(BlockingIOError):
        return _lock(folder, os.O_RDONLY, wait=False)
    return None


@contextlib.contextmanager
def sole_use(folder: Path) -> Iterator[bool]:
    """Hold the lock on a folder within the block, and give whether this process holds the lock: False if another
    process holds the lock, True if there are no locks."""
    descriptor, alone = None, True
    try:
        descriptor = _lock(folder, os.O_RDONLY, wait=False)
    except BlockingIOError:
        alone = False
    try:
        yield alone
    finally:
        if descriptor is not None:
            os.close(descriptor)


def is_abandoned(folder: Path) -> bool:
    """Return whether no process holds the lock on a folder; False if there are no locks."""
    descriptor = hold(folder)
    if descriptor is not None:
        os.close(descriptor)
    return descriptor is not None


def _take(file: Path) -> int | None:
    """Return a descriptor of the file that this path names now, locked, waiting for other processes; None if there are
    no locks."""
    while True:
        descriptor = _lock(file, os.O_RDWR | os.O_CREAT, wait=True)
        if descriptor is None:
            return None
        try:
            if os.path.samestat(os.fstat(descriptor), file.stat()):
                return descriptor
        except OSError:
            pass  # the last holder has removed the file
        os.close(descriptor)


def _lock(path: Path, flags: int, *, wait: bool) -> int | None:
    """Open a file with the ``flags`` of ``os.open`` and lock the file; return the descriptor, None if locks are
    missing. Raises BlockingIOError if another process has the lock, without ``wait``."""
    if fcntl is None and _windows is None:
        return None
    descriptor = -1
    try:
        descriptor = os.open(path, flags, 0o666)
        if fcntl is not None:
            fcntl.flock(descriptor, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
        else:
            _lock_on_windows(descriptor, wait=wait)
    except BaseException as error:
        if descriptor >= 0:
            os.close(descriptor)
        if isinstance(error, BlockingIOError) or not isinstance(error, OSError):
            raise
        return None
    return descriptor


def _lock_on_windows(descriptor: int, *, wait: bool) -> None:
    """Lock the first byte of a file. Raises BlockingIOError if another process holds the lock and the caller does not
    wait."""
    while True:
        try:
            _windows.locking(descriptor, _windows.LK_NBLCK, 1)
            return
        except PermissionError:  # held by another process
            if not wait:
                raise BlockingIOError from None
            time.sleep(0.05)  # Windows gives up after ten tries
