"""Progress bars, on a terminal by Rich, in a notebook by the browser's own; Ctrl-C between the chunks of long work."""

from __future__ import annotations

import contextlib
import importlib
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from types import FrameType
from typing import Any

from eomgen.base.html import escape_html
from eomgen.errors import Problem, UsageError

#: Called with (steps done, all steps).
Progress = Callable[[int, int], None]

#: Seconds before a bar, the display of compilers and the first line appear, and between texts to a notebook and lines.
_DELAYS = {"bar": 1.0, "compilers": 0.5, "first line": 10.0, "notebook": 0.2, "lines": 60.0}
#: Function that reports the progress of compilers in a display that is already there.
_TELLS: ContextVar[Callable[[str], None] | None] = ContextVar("told_by", default=None)


class Reporter:
    """Callback for progress, called with steps done, all steps and, if known, words on the present work.

    Attributes
    ----------
    report : called with progress
    announce : called with a sentence, as on the plan of the work
    stage : called with words on the present work, which the display shows
    """

    __slots__ = ("announce", "report", "stage")

    def __init__(
        self, report: Progress, announce: Callable[[str], None], stage: Callable[[str], None] = lambda _: None
    ) -> None:
        self.report, self.announce, self.stage = report, announce, stage

    def __call__(self, done: int, total: int, stage: str = "") -> None:
        self.report(done, total)
        if stage:
            self.stage(stage)


def duration(seconds: float) -> str:
    """Return a duration in words: ``40 s``, ``12 min``, ``3 h 20 min``."""
    if seconds < 99.5:
        return f"{seconds:.0f} s"
    hours, minutes = divmod(round(seconds / 60.0), 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min"


class Interrupts:
    """Context in which the first Ctrl-C sets ``heard`` and the second one raises KeyboardInterrupt.

    Work in chunks ends between two chunks. Only the main thread receives signals; in other threads, and if not
    ``heeded``, Ctrl-C has its usual effect.
    """

    __slots__ = ("_heeded", "_previous", "heard")

    def __init__(self, *, heeded: bool = True) -> None:
        self.heard, self._heeded = False, heeded and threading.current_thread() is threading.main_thread()
        self._previous: Any = signal.default_int_handler

    def __enter__(self) -> Interrupts:
        if self._heeded:  # None: a handler that was not set from Python
            self._previous = signal.signal(signal.SIGINT, self._hear) or signal.default_int_handler
        return self

    def __exit__(self, *_: object) -> None:
        if self._heeded:
            signal.signal(signal.SIGINT, self._previous)

    def _hear(self, number: int, frame: FrameType | None) -> None:
        self.heard = True
        signal.signal(signal.SIGINT, self._previous)


@contextlib.contextmanager
def show_progress(progress: Progress | bool | None, title: str) -> Iterator[Progress | None]:
    """Give the callback for progress: the caller's own function, a bar for ``True``, or None for None and ``False``.
    ``title`` stands before the bar, which is gone after the block.

    A bar is shown in a notebook, and on stderr if that is a terminal; otherwise a line a minute.

    Raises
    ------
    UsageError
        ``progress`` is neither a function nor a truth value.
    """
    if progress is None or progress is False:
        yield None
    elif callable(progress):
        yield progress
    elif progress is True:
        with notebook_bar(title) if _in_notebook() else terminal_bar(title) as bar:
            yield bar
    else:
        fault = f"{progress!r} is neither a function nor True [E0145]"
        raise UsageError(Problem("progress", fault, "True for a bar, or a function of (steps done, all steps)"))


@contextlib.contextmanager
def terminal_bar(title: str) -> Iterator[Reporter]:
    """Show a progress bar on stderr if the work takes more than a second, and give the Reporter. If stderr is not a
    terminal, lines: after ten seconds, then one a minute. Compilers report there, too."""
    if not sys.stderr.isatty():
        lines = _ProgressLines(title)
        with told_by(lines.stage):
            yield Reporter(lines.report, _write_line, lines.stage)
        return
    columns = ("BarColumn", "{task.percentage:>5.1f} %", "TimeRemainingColumn")
    with _rich_display(title, _DELAYS["bar"], "{task.description}", *columns) as (bar, task):

        def stage(text: str) -> None:
            bar.update(task, description=f"{title}: {text}")

        def report(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total, description=title)

        with told_by(stage):
            yield Reporter(report, bar.console.print, stage)


def _write_line(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


class _ProgressLines:
    """Lines on stderr: after ten seconds, then one a minute."""

    def __init__(self, title: str) -> None:
        self._title, self._begun = title, time.monotonic()
        self._due, self._before = self._begun + _DELAYS["first line"], -1

    def report(self, done: int, total: int) -> None:
        """Write progress with an estimate of the time left, if a line is due."""
        self._before = done if self._before < 0 else self._before
        if (spent := self._seconds_if_due()) is not None:
            rate = (done - self._before) / max(spent, 1e-9)
            rest = f", about {duration((total - done) / rate)} left" if rate > 0.0 else ""
            _write_line(f"{self._title}: {100.0 * done / max(total, 1):.3g} % after {duration(spent)}{rest}")

    def stage(self, text: str) -> None:
        """Write words on the present work, if a line is due."""
        if (spent := self._seconds_if_due()) is not None:
            _write_line(f"{self._title}: {text}, after {duration(spent)}")

    def _seconds_if_due(self) -> float | None:
        """Return the seconds so far if a line is due, else None."""
        now = time.monotonic()
        if now < self._due:
            return None
        self._due = now + _DELAYS["lines"]
        return now - self._begun


@contextlib.contextmanager
def waiting(title: str) -> Iterator[None]:
    """Show a title and the seconds so far, for work whose steps cannot be counted.

    On stderr, if that is a terminal and the work takes more than a second.
    """
    if not sys.stderr.isatty():
        yield
        return
    with _rich_display(title, _DELAYS["bar"], "SpinnerColumn", "{task.description}", "TimeElapsedColumn"):
        yield


@contextlib.contextmanager
def told_by(tell: Callable[[str], None]) -> Iterator[None]:
    """Let a display that is already there report the progress of compilers."""
    token = _TELLS.set(tell)
    try:
        yield
    finally:
        _TELLS.reset(token)


@contextlib.contextmanager
def counted_units(title: str) -> Iterator[Progress | None]:
    """Show finished and all units of work, with the seconds so far, if the work takes more than half a second: in a
    display that is there already, in a notebook, or on a terminal's stderr. Gives the callback for progress, None
    without these."""
    began = time.monotonic()
    if tell := _TELLS.get():
        yield lambda done, total: tell(_units(title, done, total, time.monotonic() - began))
    elif _in_notebook():
        with _notebook_display(_DELAYS["compilers"], 0.0) as show:
            yield lambda done, total: show(escape_html(_units(title, done, total, time.monotonic() - began)))
    elif sys.stderr.isatty():
        columns = ("SpinnerColumn", "{task.description}", "MofNCompleteColumn", "TimeElapsedColumn")
        with _rich_display(title, _DELAYS["compilers"], *columns) as (bar, task):
            yield lambda done, total: bar.update(task, completed=done, total=total)
    else:
        yield None


def _units(title: str, done: int, total: int, seconds: float) -> str:
    return f"{title}: {done} of {total} files, {seconds:.0f} s"


@contextlib.contextmanager
def _rich_display(title: str, patience: float, *columns: str) -> Iterator[tuple[Any, Any]]:
    """Start a display of Rich on stderr after some seconds, by a thread since the work may not report before, and stop
    it at the end. Columns are names of Rich's classes, or texts; gives the display and its task."""
    from rich import progress  # noqa: PLC0415  # only for a terminal
    from rich.console import Console  # noqa: PLC0415

    made = (progress.TextColumn(name) if "{" in name else getattr(progress, name)() for name in columns)
    bar = progress.Progress(*made, console=Console(stderr=True, highlight=False), transient=True)
    timer = threading.Timer(patience, bar.start)
    timer.start()
    try:
        yield bar, bar.add_task(title, total=None)
    finally:
        timer.cancel()
        timer.join()  # a display that is being started is stopped whole
        bar.stop()


@contextlib.contextmanager
def notebook_bar(title: str) -> Iterator[Progress]:
    """Show a progress bar below a notebook's cell, which is gone when the work is done, and give the callback for
    progress."""
    with _notebook_display(0.0, _DELAYS["notebook"]) as show:
        show(_html(title, 0, 1))
        yield lambda done, total: show(_html(title, done, total))


@contextlib.contextmanager
def _notebook_display(patience: float, pause: float) -> Iterator[Callable[[str], None]]:
    """Give a function that shows HTML below a notebook's cell, from some seconds on and with pauses, s, since the
    notebook sends each text to the browser; it is gone at the end."""
    shows: Any = importlib.import_module("IPython.display")  # which a notebook brings
    handle: Any = None
    due = time.monotonic() + patience

    def show(text: str) -> None:
        nonlocal handle, due
        if time.monotonic() < due:
            return
        due = time.monotonic() + pause
        if handle is None:
            handle = shows.display(shows.HTML(text), display_id=True)
        else:
            handle.update(shows.HTML(text))

    try:
        yield show
    finally:
        if handle is not None:
            handle.update(shows.HTML(""))


def _html(title: str, done: int, total: int) -> str:
    part = done / max(total, 1)
    return f'{escape_html(title)} <progress value="{part:.4f}" style="width:20em"></progress> {part:.1%}'


def _in_notebook() -> bool:
    """Return whether this process is the kernel of a notebook: a prompt of IPython has a terminal instead."""
    module: Any = sys.modules.get("IPython")
    shell = module.get_ipython() if module else None
    return shell is not None and getattr(shell, "kernel", None) is not None
