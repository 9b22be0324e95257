"""Computation time of a run's steps alone: one call of compiled code for all of them, or one from event to event if
the library gives events to its caller, and otherwise no Python between."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.files import write_text
from eomgen.compiled.model import CompiledModel
from eomgen.errors import NumericalError, Problem
from eomgen.integrators.families.register import Method, method_named
from eomgen.results.solution import Solution
from eomgen.simulation.stepping.inputs import Signal
from eomgen.simulation.stepping.run import stored_run
from eomgen.simulation.stepping.settings import stepper_library
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.large_stack import thread_time_ns

#: Part of the steps that are faster than a late step, and number of steps required to measure this part.
PART, COUNT = 0.9999, 20_000


@dataclass(frozen=True)
class StepTimes:
    """Processor's times of steps, s, each step by one call from Python.

    Attributes
    ----------
    seconds : (steps,) of the steps, their calls included
    calls : (steps,), of calls that take no step: the overhead of the call, the clock and the machine
    """

    seconds: Array
    calls: Array

    @property
    def median(self) -> float:
        return float(np.median(self.seconds))

    @property
    def late(self) -> float:
        """Quantile ``PART`` of the times of steps, s."""
        return _late(self.seconds)

    @property
    def longest(self) -> float:
        return float(self.seconds.max())

    def summary(self) -> dict[str, float]:
        times = {"steps": len(self.seconds), "median": self.median, "late": self.late, "longest": self.longest}
        return times | {"call_median": float(np.median(self.calls)), "call_late": _late(self.calls)}

    def __str__(self) -> str:
        times = f"{_quantiles(self.seconds)}, longest {1e6 * self.longest:.3g} us, of {len(self.seconds)} steps"
        return f"{times}; in it the call itself: {_quantiles(self.calls)}"

    def write(self, path: Path) -> Path:
        """Write all times in order as CSV, in s, and return the path."""
        write_text(path, "\n".join(["seconds", *(f"{x:.9g}" for x in self.seconds)]) + "\n")
        return path


def _late(seconds: Array) -> float:
    return float(np.quantile(seconds, PART, method="higher"))


def _quantiles(seconds: Array) -> str:
    return f"median {1e6 * float(np.median(seconds)):.3g} us, {100 * PART:g} % below {1e6 * _late(seconds):.3g} us"


def step_times(
    model: CompiledModel, solution: Solution, inputs: Mapping[str, Signal] | None = None, count: int = COUNT
) -> StepTimes:
    """Repeat a run, step by step on one core, until ``count`` steps have been timed, and return the times.

    Parameters
    ----------
    model : CompiledModel
        Model of the solution.
    solution : Solution
        Of a run of whole steps with this model that reached the end.
    inputs : mapping
        As of the run.

    Raises
    ------
    NumericalError
        The run did not reach its end, or its repetition does not.
    """
    described = solution.metadata
    if not solution.success:
        fault = "a run that stops early has no times of all its steps [E2080]"
        raise NumericalError(Problem("timing", fault, "a run that reaches its end"))
    method = method_named(described["method"], **described["method_parameters"])
    repeated = RepeatedRun(model, solution, method, inputs)
    runs: list[Array] = []
    calls: list[Array] = []
    with one_core():
        while sum(len(times) for times in runs) < count:
            runs.append(repeated.seconds_of_steps()[0])
            calls.append(repeated.seconds_of_calls())
    return StepTimes(np.concatenate(runs), np.concatenate(calls))


class RepeatedRun:
    """The run of a solution, for repeated stepping from its initial state.

    Times are the processor time of this thread, so that other processes which share the processor do not count.

    Parameters
    ----------
    model : CompiledModel
    solution : Solution
        Of a run of whole steps with this model.
    method : Method
        Of that run.
    inputs : mapping
        As of the run.
    """

    def __init__(
        self,
        model: CompiledModel,
        solution: Solution,
        method: Method,
        inputs: Mapping[str, Signal] | None = None,
    ) -> None:
        """Rebuild the run from the solution's metadata, with stepper, table of inputs and record for repeated
        stepping."""
        described = solution.metadata
        library = stepper_library(model, str(described["method"]), method)
        run = stored_run(model, described, method, library, float(described["t_end"]), inputs or {})
        start, self.every, self.steps = run.grid.start, run.every, run.grid.whole
        self._stepper = Stepper(library, run.settings, run.parameters)
        self._state = (start, solution.q[0], solution.v[0], solution.z[0])
        #: Arithmetic of the compiled code.
        self.real = library.real
        self._first = self._stepper.first_inputs(run.driven, run.grid)
        self._table = run.driven(self._stepper.times_of(0, self.steps, start)) if run.driven else None
        self._record = np.empty((self.steps // self.every + 1, self._stepper.sizes["row"]))

    @property
    def state(self) -> Array:
        """State at the end of the last repetition: t, q, v, (1 + nq + nv,)."""
        return np.concatenate([self._stepper.state[self._stepper.places[name]] for name in ("t", "q", "v")])

    def seconds(self) -> float:
        """Return the processor's time for all steps, s; the start of the stepper does not count. Raises
        NumericalError if the run stops."""
        self._begin()
        done, status, table, per_step = 0, 0, self._table, self._stepper.sizes["rows_per_step"]
        began = thread_time_ns()
        while done < self.steps and not status:
            status, _ = self._stepper.run(self.steps - done, self.every, table, self._record)
            done = self._stepper.count
            table = None if self._table is None else self._table[done * per_step :]
        took = 1e-9 * (thread_time_ns() - began)
        self._check(status)
        return took

    def seconds_of_steps(self) -> tuple[Array, int]:
        """Return the processor's time of each step with its call, s, (steps,), and the largest number of Newton
        iterations. The run is repeated from its start, one call from Python for each step. The number of iterations is
        0 if the method counts none. Raises NumericalError if the run stops."""
        self._begin()
        taken, per_step = np.empty(self.steps), self._stepper.sizes["rows_per_step"]
        counts = self._stepper.places.get("newton_iterations")
        most = before = 0
        for number in range(self.steps):
            first = number * per_step
            table = None if self._table is None else np.ascontiguousarray(self._table[first : first + per_step + 1])
            began = thread_time_ns()
            status, _ = self._stepper.run(1, 0, table, None)
            taken[number] = 1e-9 * (thread_time_ns() - began)
            self._check(status)
            if counts is not None:
                now = int(self._stepper.state[counts][0])
                most, before = max(most, now - before), now
        return taken, most

    def seconds_of_calls(self) -> Array:
        """Return the processor's time of calls that take no step, s, (steps,): as many calls as the run has steps."""
        taken = np.empty(self.steps)
        for number in range(self.steps):
            began = thread_time_ns()
            self._stepper.run(0, 0, None, None)
            taken[number] = 1e-9 * (thread_time_ns() - began)
        return taken

    def _begin(self) -> None:
        t, q, v, z = self._state
        self._check(self._stepper.initialize(t, q, v, self._first, z))

    def _check(self, status: int) -> None:
        if status:
            fault = f"the run cannot be repeated: {self._stepper.status_text(status)} [E2081]"
            raise NumericalError(Problem("timing", fault, "a run that reaches its end"))


@contextmanager
def one_core() -> Iterator[None]:
    """Keep this thread on the first core that it may use, for the body of the context; without effect if the operating
    system cannot restrict threads to cores."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
