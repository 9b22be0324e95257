"""SampledRun: the rows at the ends of a run's steps, and interpolants through them, made once for all searches within
steps."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from eomgen.base.arrays import Array
from eomgen.simulation.accuracy.step_path import StepPath, StepRows, pieces, step_rows
from eomgen.simulation.judgement.finished_run import FinishedRun, laws_between_steps
from eomgen.simulation.stepping.states import states_of


class SampledRun:
    """Motion within the steps of a finished run, with rows at the ends of steps and interpolants through them. Searches
    share it as ``finished.once(SampledRun)``, made once. In its methods ``finer`` divides the average step of methods
    with adaptive steps."""

    def __init__(self, finished: FinishedRun) -> None:
        self.finished, self.run, self.rows = finished, finished.run, finished.trajectory.rows
        self._steps: dict[float, StepRows | None] = {}
        self._paths: dict[int, StepPath] = {}

    @cached_property
    def recorded_path(self) -> StepPath:
        """Interpolant of the recorded rows."""
        return StepPath(self.run, self.rows, self.finished.present, self.finished.prescribed.u)

    def steps(self, finer: float = 1.0) -> StepRows | None:
        """Return rows at the ends of steps, of adaptive methods ``finer`` times as close as the average step; None if
        the run cannot be repeated."""
        if finer not in self._steps:
            run, library = self.finished, self.finished.stepper.library
            self._steps[finer] = step_rows(self.run, library, self.rows, run.present, run.statistics, finer=finer)
        return self._steps[finer]

    def path(self, taken: StepRows) -> StepPath:
        """Return the interpolant of rows of ``steps``."""
        if taken.rows is self.rows:
            return self.recorded_path
        if id(taken) not in self._paths:
            self._paths[id(taken)] = StepPath(self.run, taken.rows, taken.parameters)
        return self._paths[id(taken)]

    @cached_property
    def between_rows(self) -> tuple[Array, Array]:
        """q and z at the rows and, if known, at the ends of the steps between rows."""
        states, taken = self.finished.states, self.steps()
        if taken is not None:
            states = states_of(np.concatenate([self.rows, taken.rows]), self.run.model)
        return states.q, states.z

    @property
    def examined_share(self) -> float:
        """Share of the run in which laws between the steps are looked for."""
        if not self.run.method.chooses_steps or not laws_between_steps(self.run):
            return 1.0
        repeated = pieces(self.run, self.rows, self.finished.statistics)
        return min(1.0, repeated.number * repeated.duration / float(self.rows[-1, 0] - self.rows[0, 0]))
