"""Which library evaluates the samples of a batch: the model's own, or its companion with a sample in each lane of a
vector.

A companion costs a compiler's time and gives the same bits two to four times as fast. So it is compiled in the
background once the batches of a function have taken as long as that will, and a batch goes over to it in the middle
when it is there. It is used if it gives the same bits as the model's own library for some of the batch's own
samples, and is not slower.
"""

from __future__ import annotations

import atexit
import contextlib
import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from enum import Enum
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.errors import EomgenError, Problem, UsageError
from eomgen.toolchain.compiler import Running
from eomgen.toolchain.library import Library

_LOG = logging.getLogger(__name__)

#: The variable that says whether large batches have companions.
LANES_VARIABLE = "EOMGEN_LANES"
#: Samples of a batch at least: below, lanes stay empty, and the overhead of Python is larger.
LEAST = 16
#: Seconds of an operation if no batch has been timed; seconds for compiling a companion: a start, and seconds per
#: operation (gcc 12 on a core that others use as well: 0.64 s for the 608 of Panda's inverse dynamics, 5.9 s for the
#: 3664 of Talos', of which 0.32 and 2.4 s are its own).
_OPERATION, _START, _COMPILED = 2e-10, 0.3, 1e-3
#: Seconds of a function's batches from which on a look into the cache pays.
_LOOK = 2e-3
#: Samples that are evaluated by both libraries before the companion is taken.
_COMPARED = 64
#: Priority of the compiler in the background, as of ``nice``.
_NICE = 5


class Choice(Enum):
    """Whether there are companions: never, when they pay, or at once for every batch."""

    OFF = "off"
    AUTO = "auto"
    NOW = "now"


def chosen() -> Choice:
    """Return the choice by ``EOMGEN_LANES``, ``auto`` by default. Raises UsageError for other words."""
    text = os.environ.get(LANES_VARIABLE) or Choice.AUTO.value
    try:
        return Choice(text)
    except ValueError:
        where, fault = f"environment variable {LANES_VARIABLE}", f"{text!r} is no choice of lanes"
        raise UsageError(Problem(where, fault, "auto, off or now")) from None


class Companion:
    """State of one function's companion library: its costs, and whether it is compiled, checked or refused."""

    def __init__(self, operations: int) -> None:
        self.seconds = 0.0  # that its batches took or will take
        self.of_sample = _OPERATION * operations
        self.compiling = _START + _COMPILED * operations
        self.library: Library | None = None
        self.sought = self.begun = self.judged = self.refused = False


class Lanes:
    """The companions of a library, shared by all who use it.

    Parameters
    ----------
    library : Library
    """

    def __init__(self, library: Library) -> None:
        self._library = library
        self._lock = threading.Lock()
        self._found: dict[str, Companion] = {}

    @classmethod
    def of(cls, library: Library) -> Lanes:
        """Return the companions of a library, the same ones each time."""
        kept: Lanes | None = library.kept.get("lanes")
        if kept is None:
            kept = library.kept.setdefault("lanes", cls(library))
        return kept

    def expect(self, name: str, operations: int, count: int, choice: Choice) -> Companion | None:
        """Announce a batch, so that its companion is looked for or compiled if it pays; return the state of the
        companion, or None if there will be none."""
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
                    self._make(name, companion, Running())
        elif companion.seconds > _LOOK and not companion.sought:
            companion.sought = True
            self._look(name, companion)
        if companion.seconds > companion.compiling and companion.library is None:
            self._begin(name, companion)
        return companion

    def judged(
        self, companion: Companion, name: str, inputs: Sequence[Array], sizes: Sequence[int], choice: Choice
    ) -> Library | None:
        """Return the companion, or None if it is not there or was refused; if it is new, evaluate some samples of
        the batch by both libraries, and refuse it if a bit differs, or if it takes longer.

        Parameters
        ----------
        inputs, sizes : of the batch, and numbers of each output
        """
        library = companion.library
        if library is None or companion.refused:
            return None
        if companion.judged:
            return library
        if not self._lock.acquire(blocking=False):  # another thread is at it
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
        for own in (self._library, library):
            outputs = [np.empty((_COMPARED, size)) for size in sizes]
            call = own.bind(name, some, outputs)
            seconds.append(min(_timed(call) for _ in range(5)))
            results.append(outputs)
        if not all(_same_bits(one, other) for one, other in zip(*results, strict=True)):
            return "differs in bits"
        return "is slower" if choice is not Choice.NOW and seconds[1] > seconds[0] else ""

    def _look(self, name: str, companion: Companion) -> None:
        with contextlib.suppress(EomgenError, OSError, ValueError):
            if self._library.companion is not None:
                companion.library = self._library.companion(name)

    def _begin(self, name: str, companion: Companion) -> None:
        with self._lock:
            if companion.begun:
                return
            companion.begun = True
        _LOG.info("compiles the lanes of %s in the background", name)
        running = Running()
        atexit.register(running.stop)

        def work() -> None:
            _yield_to_others()
            self._make(name, companion, running)
            atexit.unregister(running.stop)

        threading.Thread(target=work, name="eomgen-lanes", daemon=True).start()

    def _make(self, name: str, companion: Companion, running: Running) -> None:
        """Compile a companion; without one, batches go on as they are."""
        try:
            if self._library.companion is not None:
                companion.library = self._library.companion(name, running)
        except (EomgenError, OSError, ValueError) as error:
            _LOG.info("lanes of %s are left out: %s", name, error)
            companion.refused = True


def _yield_to_others() -> None:
    """Let all else go before this thread and the compilers that it starts."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _NICE)


def _timed(call: Callable[[], Any]) -> float:
    began = time.perf_counter()
    call()
    return time.perf_counter() - began


def _same_bits(one: Array, other: Array) -> bool:
    """Return whether two arrays of numbers are the same, NaN being one number."""
    return bool(np.all((one.view(np.int64) == other.view(np.int64)) | (np.isnan(one) & np.isnan(other))))
