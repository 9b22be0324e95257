"""Copies of this process: one imports matplotlib while a model runs, and draws the figures of the stored solution,
others do work while this process goes on, such as a long table, or compute a value.

Import and drawing of matplotlib take most of a short ``eomgen simulate``, on one core. The copy is made by fork before
the run and waits for an order; then a second copy is made, and both take figures in turn.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import sys
import threading
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from eomgen.base.figures import new_figure

#: Draws files and returns their paths.
Drawing = Callable[[], Sequence[Path]]
#: Returns the drawings of an order.
Drawings = Callable[[Mapping[str, Any]], Sequence[Drawing]]

_DONE = b"done\n"
#: Whether the process is eomgen's own: the process of a caller of Python is not copied for a value.
_OWN: ContextVar[bool] = ContextVar("own process", default=False)
_T = TypeVar("_T")


class DrawingProcess:
    """A copy of this process, for the parent.

    Parameters
    ----------
    number : int
        Of the process.
    orders, answers : int
        Descriptors of pipes: to the copy, from the copy.
    """

    def __init__(self, number: int, orders: int, answers: int) -> None:
        self._number, self._orders, self._answers = number, orders, answers

    def order(self, content: Mapping[str, Any]) -> None:
        """Begin to draw.

        Parameters
        ----------
        content : mapping
            Of numbers, texts and lists; the drawings of the copy depend on the order.
        """
        with contextlib.suppress(BrokenPipeError):
            os.write(self._orders, json.dumps(content).encode())
        os.close(self._orders)
        self._orders = -1

    def files(self) -> list[str] | None:
        """Wait for the copy, and return the names of the drawn files, in the order of the drawings; None if a figure
        has failed."""
        answers = _whole(self._answers)
        if answers.count(_DONE) != 2:
            return None
        lines = [line.split("\t") for line in answers.replace(_DONE, b"").decode().splitlines()]
        return [name for line in sorted(lines, key=lambda line: int(line[0])) for name in line[1:]]

    def end(self) -> None:
        """End the copy, with or without drawn figures."""
        if self._orders >= 0:
            os.close(self._orders)
        os.close(self._answers)
        os.kill(self._number, signal.SIGKILL)
        os.waitpid(self._number, 0)


@contextlib.contextmanager
def drawing_process(prepared: Callable[[], Drawings]) -> Iterator[DrawingProcess | None]:
    """Give a copy of this process that draws; None on one core, besides other threads, and on other systems than Linux.

    Parameters
    ----------
    prepared : callable
        Imports modules and returns the drawings of an order, the longest last; called in the copy.
    """
    if not _can_copy():
        yield None
        return
    order_reader, orders = os.pipe()
    answers, answer_writer = os.pipe()
    number = fork()
    if not number:
        os.close(orders)
        os.close(answers)
        _serve(prepared, order_reader, answer_writer)
    os.close(order_reader)
    os.close(answer_writer)
    process = DrawingProcess(number, orders, answers)
    try:
        yield process
    finally:
        process.end()


@contextlib.contextmanager
def in_copy(work: Callable[[], object]) -> Iterator[Callable[[], bool]]:
    """Do work, such as the writing of a file, in a copy of this process meanwhile.

    Gives a function that waits, and returns whether the work is done: False if the work has failed, and on one core,
    besides other threads, and on other systems than Linux. The caller does the work then, and reports faults.
    """
    if not _can_copy():
        yield lambda: False
        return
    number = fork()
    if not number:
        status = 1
        try:
            work()
            status = 0
        finally:
            os._exit(status)
    ended: list[int] = []

    def done() -> bool:
        if not ended:
            ended.append(os.waitpid(number, 0)[1])
        return ended[0] == 0

    try:
        yield done
    finally:
        if not ended:
            os.kill(number, signal.SIGINT)  # the copy removes the file that it has begun
            done()


@contextlib.contextmanager
def own_process() -> Iterator[None]:
    """Let ``compute_in_copy`` copy this process, which is one of the command line."""
    before = _OWN.set(True)
    try:
        yield
    finally:
        _OWN.reset(before)


@contextlib.contextmanager
def compute_in_copy(compute: Callable[[], _T]) -> Iterator[Callable[[], _T | None]]:
    """Compute a value, which a pipe can take, in a copy of this process meanwhile.

    Gives a function that waits and returns the value, for one call: None under the conditions of ``in_copy``, and
    outside of ``own_process``. The caller computes the value then, and reports faults.
    """
    if not _OWN.get():
        yield lambda: None
        return
    from multiprocessing import Pipe  # noqa: PLC0415  # for long derivations only

    answer, sender = Pipe(duplex=False)
    with answer, in_copy(lambda: sender.send(compute())) as done:
        sender.close()

        def value() -> _T | None:
            with contextlib.suppress(EOFError):  # without a copy, or of one that has failed
                computed: _T = answer.recv()
                return computed if done() else None
            return None

        yield value


def _can_copy() -> bool:
    """Return whether this process can be copied, and would go on at the same time."""
    if sys.platform != "linux" or len(os.sched_getaffinity(0)) < 2:
        return False
    # a spinner of rich writes to the terminal alone, and no copy does
    spinners = sum(type(thread).__module__ == "rich.live" for thread in threading.enumerate())
    return threading.active_count() - spinners == 1


def _serve(prepared: Callable[[], Drawings], order_reader: int, answer_writer: int) -> NoReturn:
    """Draw in the copy of the process, which ends here, without flushing or closing the parent's files. ``prepared`` as
    of ``drawing_process``; the order is read from the descriptor ``order_reader``, and names of drawn files are written
    to ``answer_writer``."""
    status = 1
    try:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # the parent draws if the copy is interrupted
        drawings = prepared()
        _leave_out_documentation()
        new_figure((1.0, 1.0))
        order = _whole(order_reader)
        tasks = drawings(json.loads(order)) if order else ()
        turns, numbers = os.pipe()
        os.write(numbers, bytes(reversed(range(len(tasks)))))
        os.close(numbers)
        child = fork() if tasks else 0
        while turn := os.read(turns, 1):
            names = [path.name for path in tasks[turn[0]]()]
            os.write(answer_writer, ("\t".join([f"{turn[0]}", *names]) + "\n").encode())
        os.write(answer_writer, _DONE)
        if child:
            os.waitpid(child, 0)
        status = 0
    finally:
        os._exit(status)


def _leave_out_documentation() -> None:
    """Have matplotlib imported without the lists of properties in docstrings: a fifth of the time, and the copy shows
    none."""
    from matplotlib import artist  # noqa: PLC0415  # in the copy alone

    artist.kwdoc = lambda *_: ""


def fork() -> int:
    """Copy this process; return the number of the copy, 0 in the copy."""
    with warnings.catch_warnings():
        # Python 3.12 warns of threads: OpenBLAS has threads, and starts new ones in a copy.
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def _whole(descriptor: int) -> bytes:
    """Return all bytes until the other side of a pipe is closed."""
    parts = []
    while part := os.read(descriptor, 65536):
        parts.append(part)
    return b"".join(parts)
