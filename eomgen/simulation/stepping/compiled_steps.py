"""Steps that compiled code takes for a simulator, with inputs that are held, that move, or that follow functions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from eomgen.base.arrays import Array
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.library import Library

#: Steps in one call of compiled code, which hears no Ctrl-C.
_MOST = 10_000

#: Number and time in s of each event that came, in order.
Events = list[tuple[int, float]]


class CompiledSteps:
    """Calls of a library's steps on the memory of a stepper.

    Attributes
    ----------
    u : (nu,) inputs of ``one``, and after ``move`` the inputs at the end of its steps
    one, free : one step with the inputs u, and one with the scene's formulas; give a status
    events : events of the last call of ``move`` or ``follow``
    """

    def __init__(self, library: Library, stepper: Stepper, nu: int) -> None:
        self._stepper = stepper
        self._time, self._last_step = stepper.state, stepper.state[stepper.places["step"]]
        self.u, self._end = np.zeros(nu), np.zeros(nu)
        pointer = partial(library.ffi.from_buffer, "double[]")
        memory = [pointer(part) for part in (stepper.parameters, stepper.settings, stepper.state, stepper.workspace)]
        self._call = partial(library.lib.eomgen_run_inputs, *memory)
        self._none = library.ffi.NULL
        self._first, self._last = (pointer(part) if nu else self._none for part in (self.u, self._end))
        self.events: Events = []
        self.one = partial(self._call, 1, self._first, self._none)
        self.free = partial(self._call, 1, self._none, self._none)

    def move(self, n: int, first: Array, last: Array | None) -> int:
        """Take steps with inputs from first to last, or held; return the status."""
        done, status = 0, 0
        self.events = []
        while done < n and not status:
            size = min(n - done, _MOST)
            self.u[:], self._end[:] = between(first, last, done / n), between(first, last, (done + size) / n)
            before = self._count
            status = int(self._call(size, self._first, self._none if last is None else self._last))
            done += self._count - before
            self.events += self._events
            self.u[:] = between(first, last, done / n)
        return status

    def follow(self, n: int, driven: Callable[[Array], Array] | None) -> int:
        """Take steps with the inputs (n, nu) that a function gives for times (n,), or formulas; return the status."""
        done, status = 0, 0
        self.events = []
        while done < n and not status:
            before = self._count
            status = self._some(min(n - done, _MOST), driven)
            done += self._count - before
            self.events += self._events
        return status

    def _some(self, n: int, driven: Callable[[Array], Array] | None) -> int:
        if driven is None:
            return int(self._call(n, self._none, self._none))
        stepper, count = self._stepper, self._count
        times = stepper.times_of(count, n, stepper.origin if count else float(self._time[0]))
        return stepper.run(n, 0, np.ascontiguousarray(driven(times)), None)[0]

    @property
    def _count(self) -> int:
        """Steps on the present grid; 0 if the next one begins another."""
        return self._stepper.count if abs(self._last_step[0]) == self._stepper.step_size else 0

    @property
    def _events(self) -> Events:
        """Events of the last call."""
        log = self._stepper.new_events
        return [(int(k), float(t)) for k, t in zip(log["event"], log["t"], strict=True)] if len(log) else []


def between(first: Array, last: Array | None, share: float) -> Array:
    """Return the inputs after a share of the way from first to last, or the held inputs if last is None."""
    return first if last is None else (1.0 - share) * first + share * last
