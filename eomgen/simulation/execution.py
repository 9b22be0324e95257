"""Execution of runs from one start: stepper, checkpoints and progress of each run, up to its outcome."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Mapping

import numpy as np

from eomgen.base.data import dataclass
from eomgen.base.progress import Progress
from eomgen.compiled.initial_state import InitialState
from eomgen.simulation.checkpoint import CheckpointWriter, checkpoint_writer
from eomgen.simulation.judgement.finished_run import RunStart
from eomgen.simulation.outcome import JudgedRun
from eomgen.simulation.stepping.chunks import Trajectory, run_chunks
from eomgen.simulation.stepping.events import table_of
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.settings import check_memory
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.toolchain.library import Library


class CostlyRunError(Exception):
    """A run takes more steps than its execution allows."""


def own_steps(counts: Mapping[str, int | float]) -> float:
    """Return the number of steps chosen by a method, from the counts of its stepper; 1 before the first step."""
    return float(counts.get("own_steps") or counts.get("expansions") or 1)


@dataclass
class Execution:
    """Execution of runs with one library.

    Attributes
    ----------
    library : with the stepper
    checkpoint, checkpoint_every : as of ``simulate``
    progress : called with (steps done, all steps); the steps of the error estimate are counted too
    estimated : whether the discretisation error is estimated
    """

    library: Library
    checkpoint: str | os.PathLike[str] | None
    checkpoint_every: int | None
    progress: Progress | None
    estimated: bool

    def outcome(
        self, run: Run, beginning: RunStart | None, most_steps: float = math.inf, resumed: Stepper | None = None
    ) -> JudgedRun:
        """Return the outcome of a run from its start, or from the present state of the stepper of an earlier run.

        Parameters
        ----------
        beginning : start of the run; None for a resumed run
        most_steps : steps of the method's own after which the run is given up
        resumed : stepper of the earlier run

        Raises
        ------
        UsageError
            The rows take more memory than this machine has; the stepper refuses its settings; a checkpoint cannot be
            written at the start.
        CostlyRunError
            The run takes more steps than ``most_steps``.
        """
        stepper = resumed or Stepper(self.library, run.settings, run.parameters, run.controllers)
        steps = run.grid.steps if resumed is None else run.grid.steps - resumed.count
        check_memory(steps // run.every + 2, stepper.sizes["row"])
        writer = checkpoint_writer(run, self.library, self.checkpoint, self.checkpoint_every)
        report = self.progress
        if self.estimated and report is not None:
            from eomgen.simulation.accuracy.comparison_runs import planned_steps, progress_after  # noqa: PLC0415  # on request

            report = progress_after(report, 0, run.grid.steps + planned_steps(run, steps))

        def watch(done: int, total: int) -> None:
            if own_steps(stepper.statistics) > most_steps:
                raise CostlyRunError
            if report is not None:
                report(done, total)

        began = time.perf_counter()
        state = None if beginning is None else beginning.state
        trajectory = _trajectory(run, stepper, state, report if most_steps == math.inf else watch, writer)
        stepper.close()
        wall, events = time.perf_counter() - began, table_of(trajectory, stepper, run.parameters)
        return JudgedRun(run, stepper, trajectory, events, wall, writer, beginning, self.estimated, self.progress)


def _trajectory(
    run: Run, stepper: Stepper, state: InitialState | None, progress: Progress | None, writer: CheckpointWriter | None
) -> Trajectory:
    """Return the recorded trajectory of a run from a state; None: from the present state of the stepper. A start that
    fails gives one row with NaN accelerations, and its status. `progress` is called with (steps done, all steps);
    `writer` writes a first checkpoint before the steps. Raises UsageError if the stepper refuses its settings."""
    grid, model, inputs = run.grid, run.model, run.driven
    if state is not None:
        status = stepper.initialize(grid.start, state.q, state.v, stepper.first_inputs(inputs, grid), state.z)
        if status:
            run.check_settings(status, stepper.status_text(status))
            unknown = np.full(model.nv + len(model.multipliers), np.nan)
            rows = np.concatenate([[grid.start], state.q, state.v, unknown, state.z])[np.newaxis]
            return Trajectory(rows, status, False, 0)
        if writer is not None:
            writer.write(stepper, 0)  # a path without write access is reported before the run
    return run_chunks(stepper, grid, min(run.every, grid.steps + 1), inputs, progress, writer)
