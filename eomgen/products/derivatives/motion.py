"""Trajectory storage for adjoint runs: full history for short runs, else checkpoints with recomputation.

Checkpoints are as many as each part has steps, so memory grows with the square root of the number of steps. Steps
taken again have the same bits, since a checkpoint is the stepper's whole memory.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.compiled.initial_state import InitialState
from eomgen.errors import NumericalError, Problem
from eomgen.simulation.stepping.chunks import rows_from
from eomgen.simulation.stepping.inputs import HeldRows
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.stepper import Stepper

#: Bytes of rows that are kept, and largest number of steps of a part.
KEPT_BYTES, LONGEST = 2**25, 2048


@dataclass(frozen=True)
class RunSegment:
    """Rows (steps + 1, width) of a part of a run, with the row before the first step.

    Attributes
    ----------
    first : number of the first row of the part in the run
    memory : data of the stepper that rows do not hold: the algorithmic acceleration at the first row, (nv,), or the
        dependent components at the start of each step
    """

    first: int
    rows: Array
    memory: Array


class ReplayedRun:
    """A run stepped once forwards, and then again in parts from the end.

    Parameters
    ----------
    of_step : bytes of the matrices of a step
    kept : bytes of rows that are kept

    Attributes
    ----------
    first_row : the row at the start, (width,)
    kept : whether rows are kept, and not stepped again
    """

    def __init__(self, run: Run, stepper: Stepper, state: InitialState, of_step: int, kept: int = KEPT_BYTES) -> None:
        """Initialize the stepper and keep the memory of the start. Raises NumericalError for a damped first step."""
        self.run, self.stepper = run, stepper
        self.steps = run.grid.whole
        self.length = max(min(2**26 // of_step, LONGEST), 32, math.isqrt(self.steps))  # 64 MB of matrices
        self.kept = kept >= 8 * (self.steps + 1) * stepper.sizes["row"]
        self.done = 0
        self._parts: list[RunSegment] = []
        self._checkpoints: list[tuple[int, Any]] = []
        driven, table = run.driven, None
        if isinstance(driven, HeldRows):
            table = driven.over(len(stepper.input_times))
        elif driven is not None:
            table = driven(run.grid.start + run.grid.step * stepper.input_times)
        self.check(stepper.initialize(run.grid.start, state.q, state.v, table, state.z))
        self.start = {name: stepper.state[part].copy() for name, part in stepper.places.items()}
        if "history" in self.start and self.start["history"][0] < 0:
            fault = "the start excites motions too fast for the step: the damped first step has no derivatives [E0621]"
            hint = f"a step of {0.1 * run.grid.step:.3g} s, or an initial state nearer to balance"
            raise NumericalError(Problem("sensitivities", fault, hint))
        self._first = stepper.memory
        self.first_row = stepper.row if table is None else stepper.row_with(np.ascontiguousarray(table))

    @property
    def parts(self) -> int:
        """Number of parts."""
        return -(-self.steps // self.length)

    def forwards(self) -> Iterator[RunSegment]:
        """Step through the run again, and yield its parts in order; parts or checkpoints are kept for going
        backwards."""
        self.stepper.restore(*self._first)
        self._parts, self._checkpoints, self.done = [], [], 0
        row = self.first_row
        while self.done < self.steps:
            if not self.kept:
                self._checkpoints.append((self.done, (row, *self.stepper.memory)))
            part = self._step(row)
            if self.kept:
                self._parts.append(part)
            row = part.rows[-1]
            yield part

    def backwards(self) -> Iterator[RunSegment]:
        """Yield the parts from the last to the first: kept ones, or stepped again from checkpoints."""
        if not self._parts and not self._checkpoints:
            for _ in self.forwards():
                pass
        if self.kept:
            yield from reversed(self._parts)
            return
        for done, (row, *memory) in reversed(self._checkpoints):
            self.done = done
            self.stepper.restore(*memory)
            yield self._step(row)

    def _step(self, row: Array) -> RunSegment:
        stepper, run, done = self.stepper, self.run, self.done
        size = min(self.length, self.steps - done)
        table = None if run.driven is None else rows_from(stepper, run.driven, done, size, run.grid.start)
        record = np.empty((size, stepper.sizes["row"]))
        memory = self._take_steps(size, table, record)
        self.check_whole_steps()
        self.done = done + size
        return RunSegment(done, np.concatenate([row[np.newaxis], record]), memory)

    def check_whole_steps(self) -> None:
        """Raise NumericalError if the stepper has halved a step, which then has no derivatives."""
        if self.stepper.statistics.get("halvings"):
            fault = f"a step near t = {self.stepper.t:.6g} s converged in halves only, without derivatives [E0622]"
            raise NumericalError(Problem("sensitivities", fault, f"a step of {0.5 * self.run.grid.step:.3g} s"))

    def _take_steps(self, size: int, table: Array | None, record: Array) -> Array:
        """Take steps, fill the rows, and return data of the stepper that rows do not hold."""
        places = self.stepper.places  # methods without algorithmic accelerations have all of a step in rows
        a = self.stepper.state[places["a"]].copy() if "a" in places else np.zeros(0)
        done, of_step = 0, len(self.stepper.input_times) - 1
        while done < size:  # a call ends before the log of events is full
            inputs = None if table is None else table[done * of_step :]
            status, taken = self.stepper.run(size - done, 1, inputs, record[done:])
            self.check(status)
            done += taken
        return a

    def check(self, status: int) -> None:
        """Raise NumericalError if a call of the stepper failed."""
        if status:
            fault = f"the run fails at t = {self.stepper.t:.9g} s: {self.stepper.status_text(status)} [E0623]"
            raise NumericalError(Problem("sensitivities", fault, "a smaller step; simulate says more of it"))
