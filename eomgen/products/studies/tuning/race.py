"""A race: the contender that promises to meet the demand at the least cost runs next, until none promises more than
the best so far."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from eomgen.errors import EomgenError, NumericalError
from eomgen.products.studies.tuning.contender import Contender, Tried
from eomgen.products.studies.tuning.judge import Judge
from eomgen.products.studies.tuning.nearby_conditions import Condition
from eomgen.products.studies.tuning.verification_runs import under
from eomgen.products.studies.work_precision.axes import reason
from eomgen.products.studies.work_precision.running import REACHED, REFUSED, Runner, timed
from eomgen.simulation.timing import Repeated

#: Times that one run's time is the median of; runs shorter than the second are repeated more often.
REPEATS, SHORT, MORE_REPEATS = 3, 2e-3, 9
#: Runs that take so many times as long as the best so far are timed once.
FAR = 1.5
#: A contender may promise this part of the best so far and still run.
PROMISE = 0.97
#: Runs within this factor of the time of the first are timed again side by side; and the largest number of these.
CLOSE, FINALISTS = 1.25, 3


@dataclass
class Race:
    """Runs contenders against a judge.

    Attributes
    ----------
    demand : to be met
    training : conditions besides the scene's own under which it is to be met
    """

    judge: Judge
    demand: float
    say: Callable[[str], None]
    training: list[Condition] = field(default_factory=list)
    runs: int = 0
    left_out: dict[str, str] = field(default_factory=dict)

    @property
    def runner(self) -> Runner:
        return self.judge.runner

    def run(self, contenders: Sequence[Contender], best: float = math.inf) -> Contender | None:
        """Return the contender that meets the demand at the least cost; None if none does.

        Parameters
        ----------
        best : seconds in which the demand is met already
        """
        for contender in contenders:
            self.prepare(contender)
        while True:
            best = min(best, self._least(contenders))
            opened = [c for c in contenders if not c.closed and c.promised(self.demand) < PROMISE * best]
            if not opened:
                break
            first = min(opened, key=lambda c: c.promised(self.demand))
            self.say(first.configuration.label)
            first.add(self._tried(first, first.wanted(self.demand), best), self.demand)
        able = [c for c in contenders if c.best(self.demand)]
        return min(able, key=lambda c: c.seconds(self.demand), default=None)

    def prepare(self, contender: Contender) -> None:
        """Build the model of a contender; one that cannot be built runs no more."""
        self.say(f"building: {contender.configuration.label}")
        try:
            self.runner.prepare(contender.configuration)
        except EomgenError as error:
            self._leave_out(contender, reason(error))

    def finish(self, contenders: Sequence[Contender]) -> None:
        """Take the times of the cheapest runs that meet the demand again, in turns."""
        able = sorted((c for c in contenders if c.best(self.demand)), key=lambda c: c.seconds(self.demand))
        close = [c for c in able if c.seconds(self.demand) <= CLOSE * able[0].seconds(self.demand)][:FINALISTS]
        if len(close) < 2:
            return
        entered: list[tuple[Contender, Tried, Repeated, list[float]]] = []
        for contender in close:
            run = contender.best(self.demand)
            if run is not None:
                outcome = self.runner.run(**contender.how(run), estimated=False)
                entered += [(contender, run, outcome.repeated, [])] if outcome.repeated is not None else []
        for _ in range(MORE_REPEATS if able[0].seconds(self.demand) < SHORT else REPEATS):
            for *_, repeated, taken in entered:
                taken.extend(timed(repeated, 1))
        for contender, run, _, taken in entered:
            contender.runs[contender.runs.index(run)] = replace(run, seconds=statistics.median(taken))

    def _least(self, contenders: Sequence[Contender]) -> float:
        """Return the least seconds of a run that meets the demand under all conditions of the training."""
        while True:
            able = [(run.seconds, n) for n, c in enumerate(contenders) if (run := c.best(self.demand)) is not None]
            if not able:
                return math.inf
            first = contenders[min(able)[1]]
            run = first.best(self.demand)
            if run is None or run.conditions == len(self.training):
                return min(able)[0]
            first.runs[first.runs.index(run)] = self._trained(first, run)
            first.reopen(self.demand)

    def _trained(self, contender: Contender, run: Tried) -> Tried:
        """Return a run with its largest error under the conditions of the training that it has not had."""
        error, done = run.error, run.conditions
        for condition in self.training[done:]:
            outcome = under(self.judge, contender.how(run), condition)
            done += 1
            there = outcome.observation
            error = max(error, math.inf if there is None else self.judge.error(there, condition))
            if error > self.demand:
                break
        return replace(run, error=error, conditions=done)

    def _tried(self, contender: Contender, resolution: float, best: float) -> Tried:
        """Return a run of a contender; of infinite error if it does not reach its end."""
        self.runs += 1
        tried = Tried(resolution, math.inf, 1e-3)
        outcome = self.runner.run(**contender.how(tried), estimated=False)
        if outcome.ended == REFUSED:
            self._leave_out(contender, outcome.said)
        if outcome.ended != REACHED or outcome.observation is None or outcome.repeated is None:
            return replace(tried, seconds=outcome.seconds or 1e-3)
        steps = outcome.stats.get("own_steps", outcome.stats.get("steps", 0.0))
        error = self.judge.error(outcome.observation)
        try:
            taken = timed(outcome.repeated, 1)
            if taken[0] < SHORT:  # the first of these was with cold caches
                taken = timed(outcome.repeated, REPEATS)
            run = Tried(resolution, error, statistics.median(taken), error, steps)
            if error <= self.demand and run.seconds < FAR * best:
                run = self._trained(contender, run)
                if run.error <= self.demand:
                    taken += timed(outcome.repeated, (MORE_REPEATS if run.seconds < SHORT else REPEATS) - len(taken))
        except NumericalError:
            return replace(tried, seconds=outcome.seconds)
        return replace(run, seconds=statistics.median(taken))

    def _leave_out(self, contender: Contender, why: str) -> None:
        contender.closed, contender.why = True, why
        self.left_out[contender.configuration.label] = why
