"""SampledRun: the rows at the ends of a run's steps, and interpolants through them, made once for all searches within
steps; and the limits of laws and events between the steps."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.simulation.accuracy.step_path import StepPath, StepRows, pieces, step_rows
from eomgen.simulation.judgement.finished_run import FinishedRun, laws_between_steps
from eomgen.simulation.stepping.states import states_of

DEFECT = Limit(
    0.05, "1", "sum of defects of steps in parts of a velocity or a range", "a choice: half of a large error"
)
DEFECT_WITHIN = Limit(
    0.25, "1", "largest defect within a step in such parts", "a fourth of a velocity is half of the energy"
)
ALIASED = Limit(
    0.8, "1", "deviation of a law from its chords in standard deviations", "a sine with 2.2 steps to a period"
)
ALIASED_PART = Limit(0.5, "1", "part of the steps with such deviations", "a choice")
UNDERSTATED = Limit(
    3.0, "1", "effect of such a law in parts of the stated error", "errors are up to 1.5 times an estimate"
)
MISSED = Limit(1.5, "1", "number of events that are missed in pairs", "a pair has two")
MISSED_PART = Limit(0.05, "1", "the same in parts of all events if some steps are examined", "a choice")
#: Maximum number of sampled steps.
MOST_SAMPLED = 4096


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
