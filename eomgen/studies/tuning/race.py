"""A race: the contender that promises to meet the demand at the least cost runs next, until none promises more than
what has been reached."""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from eomgen.errors import EomgenError, NumericalError
from eomgen.studies.tuning.contender import Contender, Tried
from eomgen.studies.work_precision.axes import TOLERANCE, reason
from eomgen.studies.work_precision.reference import Reference
from eomgen.studies.work_precision.running import REACHED, REFUSED, Runner, timed
from eomgen.studies.work_precision.times import fraction_of

#: Times that one run's time is the median of; runs shorter than the second are repeated more often.
REPEATS, SHORT, MORE_REPEATS = 3, 2e-3, 9
#: A contender may promise this part of the best so far and still run.
PROMISE = 0.97


@dataclass
class Race:
    """Runs contenders against a judge.

    Attributes
    ----------
    judge : the motion that errors are told from
    quantity, measure : whose error
    demand : what is to be met
    seconds : spent so far, builds not counted
    """

    runner: Runner
    judge: Reference
    quantity: str
    measure: str
    demand: float
    say: Callable[[str], None]
    seconds: float = 0.0
    runs: int = 0
    left_out: dict[str, str] = field(default_factory=dict)

    def run(self, contenders: Sequence[Contender], best: float = math.inf) -> Contender | None:
        """Return the contender that meets the demand at the least cost; None where none does.

        Parameters
        ----------
        best : seconds in which the demand is met already
        """
        for contender in contenders:
            self._prepare(contender)
        while True:
            best = min([best, *(run.seconds for c in contenders if (run := c.best(self.demand)))])
            opened = [c for c in contenders if not c.closed and c.expected(self.demand) < PROMISE * best]
            if not opened:
                break
            self._advance(min(opened, key=lambda c: c.expected(self.demand)))
        able = [c for c in contenders if c.best(self.demand)]
        return min(able, key=lambda c: c.best(self.demand).seconds, default=None)  # type: ignore[union-attr]

    def _prepare(self, contender: Contender) -> None:
        self.say(f"building: {contender.configuration.label}")
        try:
            self.runner.prepare(contender.configuration)
        except EomgenError as error:
            contender.closed, contender.why = True, reason(error)
            self.left_out[contender.configuration.label] = contender.why

    def _advance(self, contender: Contender) -> None:
        resolution = contender.wanted(self.demand)
        self.say(f"{contender.configuration.label}")
        began = time.perf_counter()
        contender.add(self.tried(contender, resolution), self.demand)
        self.seconds += time.perf_counter() - began
        self.runs += 1

    def tried(self, contender: Contender, resolution: float) -> Tried:
        """Return a run of a contender; of infinite error where it does not reach its end."""
        if contender.kind == TOLERANCE:
            outcome = self.runner.run(contender.configuration, tolerance=1.0 / resolution, estimated=False)
        else:
            outcome = self.runner.run(contender.configuration, fraction_of(resolution), estimated=False)
        if outcome.ended == REFUSED:
            contender.closed, contender.why = True, outcome.said
            self.left_out[contender.configuration.label] = outcome.said
        if outcome.ended != REACHED or outcome.observation is None or outcome.repeated is None:
            return Tried(resolution, math.inf, outcome.seconds or 1e-3)
        size = self.judge.errors_of(outcome.observation).get(self.quantity)
        error = math.inf if size is None else float(getattr(size, self.measure))
        try:
            taken = timed(outcome.repeated, 1)
            taken += timed(outcome.repeated, (MORE_REPEATS if taken[0] < SHORT else REPEATS) - 1)
        except NumericalError:
            return Tried(resolution, math.inf, outcome.seconds)
        return Tried(resolution, error if math.isfinite(error) else math.inf, statistics.median(taken))
