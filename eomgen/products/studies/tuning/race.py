"""The race of configurations: the configuration that promises to meet the demand at the least cost runs next, until
none promises more than the best; models of cost and error at other steps or tolerances.

The models are error = C h^p, with the declared order p until runs show another, and time = c0 + c1 steps.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from typing import Any

from eomgen.base.data import dataclass, field, replace
from eomgen.errors import EomgenError, NumericalError
from eomgen.products.studies.tuning.judge import Condition, Judge, under
from eomgen.products.studies.work_precision.axes import (
    TOLERANCE,
    Candidate,
    Configuration,
    candidates,
    one_of_each,
    reason,
    refinements,
)
from eomgen.products.studies.work_precision.running import (
    REACHED,
    REFUSED,
    fraction_of,
    measure_seconds,
    whole_steps,
)
from eomgen.system.description import Simulation

#: Part of the demanded error that a run is expected to stay below, since the errors of verification runs may be larger.
MARGIN = 0.75
#: Errors above this give no order.
COARSE = 0.2
#: Orders that runs show are believed down to this part of the declared one.
LEAST_ORDER = 0.5


@dataclass(frozen=True)
class RaceRun:
    """One run.

    Attributes
    ----------
    resolution : steps in a row of the grid, or 1/tolerance
    error : the largest error under the conditions of the run
    seconds : processor's time of the steps
    own : error under the scene's unchanged conditions
    steps : of the method
    conditions : number of conditions of the training in this run, besides the scene's conditions
    """

    resolution: float
    error: float
    seconds: float
    own: float = math.inf
    steps: float = 0.0
    conditions: int = 0


@dataclass
class Contender:
    """A configuration in a race, with its runs at different resolutions and the models of error and time.

    Attributes
    ----------
    candidate : origin of the configuration
    kind : ``step`` or ``tolerance``
    start : resolution of the first run
    coarsest : rows of the grid that a step may take at most
    runs : in order
    closed, why : whether the contender is out of the race, and the reason
    taken : runs since the contender entered or re-entered the race
    """

    candidate: Candidate
    configuration: Configuration
    kind: str
    start: float
    coarsest: int = 1
    runs: list[RaceRun] = field(default_factory=list)
    closed: bool = False
    why: str = ""
    taken: int = 0

    def best(self, demand: float) -> RaceRun | None:
        """Return the cheapest run of this configuration with an error of at most ``demand``; None if there is none."""
        able = [run for run in self.runs if run.error <= demand]
        return min(able, key=lambda run: run.seconds, default=None)

    def seconds(self, demand: float) -> float:
        """Return the seconds of the cheapest run that meets a demand; infinite if no run does."""
        best = self.best(demand)
        return math.inf if best is None else best.seconds

    def how(self, run: RaceRun) -> dict[str, Any]:
        """Return a run as arguments of ``Runner.run``."""
        if self.kind == TOLERANCE:
            return {"configuration": self.configuration, "tolerance": 1.0 / run.resolution}
        return {"configuration": self.configuration, "per_row": fraction_of(run.resolution)}

    @property
    def order(self) -> float:
        """Decades of error per decade of resolution, by the last two meaningful runs, within bounds; else the declared
        order."""
        declared = self._declared_order
        told = self._meaningful_pair
        if len(told) < 2 or told[1].resolution < 1.3 * told[0].resolution:
            return declared
        seen = math.log(told[0].error / told[1].error) / math.log(told[1].resolution / told[0].resolution)
        return min(max(seen, LEAST_ORDER * declared), 1.6 * declared)

    @property
    def _declared_order(self) -> float:
        return 1.0 if self.kind == TOLERANCE else float(self.candidate.method.order)

    @property
    def _meaningful_pair(self) -> list[RaceRun]:
        """The last two meaningful runs, the coarser first."""
        told = (run for run in self.runs if 1e-14 < run.error < COARSE)
        return sorted(told, key=lambda run: run.resolution)[-2:]

    def predict_resolution(self, demand: float) -> float:
        """Return the resolution (steps in a row of the grid, or 1/tolerance) at which an error `demand` should be met.
        From the run nearest to the demand and the order; ``start`` without runs, several times the finest resolution
        after runs with large errors. Steps end on rows of the grid."""
        if not self.runs:
            return self.start
        last = min(self.runs, key=lambda run: abs(math.log(max(run.error, 1e-300) / demand)))
        finest = max(run.resolution for run in self.runs)
        if not last.error < COARSE:
            return self._steps(4.0 * finest) if self.kind != TOLERANCE else 100.0 * finest
        factor = float((max(last.error, 1e-300) / (MARGIN * demand)) ** (1.0 / self.order))
        jump = 16.0 if self.kind != TOLERANCE else 1e6
        result = self._between(min(last.resolution * factor, jump * finest), demand)
        if self.kind == TOLERANCE:
            return min(max(result, 10.0), 1e15)
        return self._whole(result, result * MARGIN ** (1.0 / self.order), demand)

    def _whole(self, resolution: float, least: float, demand: float) -> float:
        """Return whole steps for a resolution: the next larger number, or, if this number costs much more, the smallest
        number that may satisfy the demand, unless this number has missed the demand."""
        finer, coarser = self._steps(resolution), self._steps(least)
        missed = max((run.resolution for run in self.runs if run.error > demand), default=0.0)
        return coarser if finer > 1.2 * resolution and missed < coarser < finer else finer

    def _between(self, resolution: float, demand: float) -> float:
        """Return a resolution that lies between a run that misses the demand and the next run that meets the demand;
        else the middle of both runs."""
        met = min((run.resolution for run in self.runs if run.error <= demand), default=math.inf)
        missed = max((run.resolution for run in self.runs if run.error > demand and run.resolution < met), default=0.0)
        if not missed or resolution > missed:
            return resolution
        return math.sqrt(missed * met) if met < math.inf else 1.3 * missed

    def _steps(self, resolution: float) -> float:
        return whole_steps(resolution, self.coarsest)

    def least_seconds(self, demand: float) -> float:
        """Return the least seconds in which the contender may meet a demand.

        Errors follow tolerances only roughly. An adaptive method that has not met the demand yet promises the measured
        seconds of the finest run, so that extrapolated times drop no such method.
        """
        if self.kind == TOLERANCE and self.runs and self.best(demand) is None:
            return max(self.runs, key=lambda run: run.resolution).seconds
        return self.predict_seconds(demand)

    def predict_seconds(self, demand: float) -> float:
        """Return the seconds of a run that should meet an error `demand`, by the model of time; 0 without runs."""
        if not self.runs:
            return 0.0
        wanted = self.predict_resolution(demand)
        if len(self._meaningful_pair) == len(self.runs) == 1 and (error := self.runs[0].error) < MARGIN * demand:
            # corners may lower the order, and then still coarser runs do
            coarser = (max(error, 1e-14) / (MARGIN * demand)) ** (1.0 / (LEAST_ORDER * self._declared_order))
            wanted = min(wanted, coarser * self.runs[0].resolution)
        runs = sorted(self.runs, key=lambda run: run.resolution)
        last = min(runs, key=lambda run: abs(math.log(run.resolution / wanted)))
        if self.kind == TOLERANCE:
            power = 1.0 / max(4.0, float(self.candidate.method.order))
            return float(last.seconds * (wanted / last.resolution) ** power)
        per_step = last.seconds / last.resolution
        if len(runs) > 1 and runs[-1].resolution > 1.3 * runs[0].resolution:
            slope = (runs[-1].seconds - runs[0].seconds) / (runs[-1].resolution - runs[0].resolution)
            per_step = min(max(slope, 0.3 * per_step), 1.2 * per_step)
        return max(last.seconds + per_step * (wanted - last.resolution), 0.1 * last.seconds)

    def add(self, run: RaceRun, demand: float) -> None:
        """Take a run, and close if another would gain little."""
        self.runs.append(run)
        self.taken += 1
        self._judge(demand)

    def reopen(self, demand: float) -> None:
        """Race again, for another demand; refused resolutions stay refused."""
        if self.runs and self.closed and any(math.isfinite(run.error) for run in self.runs):
            self.taken, self.closed = 0, False
            self._judge(demand)

    def _judge(self, demand: float) -> None:
        best = self.best(demand)
        if self.taken >= 7:
            self.closed, self.why = True, "enough runs"
        elif best is not None:
            wanted = self.predict_resolution(demand)
            tried = any(abs(math.log(wanted / run.resolution)) < 0.05 for run in self.runs)
            if tried or self.predict_seconds(demand) > 0.9 * best.seconds:  # another would gain little
                self.closed, self.why = True, "met"


def _repeats(seconds: float) -> int:
    """Return the number of runs for the median of a time."""
    return 9 if seconds < 2e-3 else 3


@dataclass
class Race:
    """A race of configurations to a demanded error, run against the references of a judge.

    Attributes
    ----------
    judge : runs configurations and compares them with references
    demand : error to be met
    say : called with a word on the present work
    training : further conditions under which the demand is to be met
    runs : number of runs so far
    left_out : reasons by label of configurations that do not run
    entered : contenders that race or have raced
    """

    judge: Judge
    demand: float
    say: Callable[[str], None]
    training: list[Condition] = field(default_factory=list)
    runs: int = 0
    left_out: dict[str, str] = field(default_factory=dict)
    entered: list[Contender] = field(default_factory=list)

    def run(self, contenders: Sequence[Contender], best: float = math.inf) -> Contender | None:
        """Return the contender that meets the demand at the least cost; None if none does.

        The contender that promises the least time runs next, until none promises less than the best.

        Parameters
        ----------
        contenders : built and run here; their runs are added to them
        best : seconds in which the demand is met already
        """
        for contender in contenders:
            self.prepare(contender)
        while True:
            best = min(best, self._least(contenders))
            opened = [c for c in contenders if not c.closed and c.least_seconds(self.demand) < 0.97 * best]
            if not opened:
                break
            first = min(opened, key=lambda c: c.least_seconds(self.demand))
            self.say(first.configuration.label)
            first.add(self._try_resolution(first, first.predict_resolution(self.demand), best), self.demand)
        able = [c for c in contenders if c.best(self.demand)]
        return min(able, key=lambda c: c.seconds(self.demand), default=None)

    def prepare(self, contender: Contender) -> None:
        """Build the model of a contender; if the build fails, close the contender and keep the reason in
        ``left_out``."""
        self.say(f"building: {contender.configuration.label}")
        self.entered.append(contender)
        try:
            self.judge.runner.prepare(contender.configuration)
        except EomgenError as error:
            self._leave_out(contender, reason(error))

    def _least(self, contenders: Sequence[Contender]) -> float:
        """Return the least seconds of a run that meets the demand under all conditions of the training; infinite if
        none does. The cheapest run is tried under missing conditions first, and its error in the contender is
        replaced."""
        while True:
            able = [(run.seconds, n) for n, c in enumerate(contenders) if (run := c.best(self.demand)) is not None]
            if not able:
                return math.inf
            first = contenders[min(able)[1]]
            run = first.best(self.demand)
            if run is None or run.conditions == len(self.training):
                return min(able)[0]
            first.runs[first.runs.index(run)] = self._train(first, run)
            first.reopen(self.demand)

    def _train(self, contender: Contender, run: RaceRun) -> RaceRun:
        """Return a run with the largest error, after runs under the remaining conditions of the training. Ends at the
        first condition that misses the demand; a failed run counts as an infinite error."""
        error, done = run.error, run.conditions
        for condition in self.training[done:]:
            outcome = under(self.judge, contender.how(run), condition)
            done += 1
            there = outcome.observation
            error = max(error, math.inf if there is None else self.judge.error(there, condition))
            if error > self.demand:
                break
        return replace(run, error=error, conditions=done)

    def _try_resolution(self, contender: Contender, resolution: float, best: float) -> RaceRun:
        """Run a contender at a resolution and return the run with error and median time. The error is infinite if the
        run does not reach the end; a refused run closes the contender. Only runs that meet the demand in less than 1.5
        times the seconds `best` are tried under the training and timed repeatedly."""
        self.runs += 1
        tried = RaceRun(resolution, math.inf, 1e-3)
        outcome = self.judge.runner.run(**contender.how(tried), estimated=False)
        if outcome.ended == REFUSED:
            self._leave_out(contender, outcome.said)
        if outcome.ended != REACHED or outcome.observation is None or outcome.repeated is None:
            return replace(tried, seconds=outcome.seconds or 1e-3)
        steps = outcome.stats.get("own_steps", outcome.stats.get("steps", 0.0))
        error = self.judge.error(outcome.observation)
        try:
            taken = measure_seconds(outcome.repeated, 1)
            if _repeats(taken[0]) > 3:  # the first of these was with cold caches
                taken = measure_seconds(outcome.repeated, 3)
            run = RaceRun(resolution, error, statistics.median(taken), error, steps)
            if error <= self.demand and run.seconds < 1.5 * best:
                run = self._train(contender, run)
                if run.error <= self.demand:
                    taken += measure_seconds(outcome.repeated, _repeats(run.seconds) - len(taken))
        except NumericalError:
            return replace(tried, seconds=outcome.seconds)
        return replace(run, seconds=statistics.median(taken))

    def _leave_out(self, contender: Contender, why: str) -> None:
        contender.closed, contender.why = True, why
        self.left_out[contender.configuration.label] = why


#: Ratio of the times of a step above which another formulation leaves the race, with all formulations of its kind.
DEARER = 3.0


@dataclass
class RaceEntries:
    """Choice of the contenders that enter a race: methods of the scene, relatives of the best, other formulations.

    Attributes
    ----------
    own : candidates of the scene's own formulation
    others : names of other formulations, formulations of less fidelity first
    axes : along which configurations may vary
    defaults : of the scene
    """

    race: Race
    own: Sequence[Candidate]
    others: Sequence[str]
    axes: Sequence[str]
    methods: tuple[str, ...]
    defaults: Simulation

    def run_race(self) -> list[Contender]:
        """Run the whole race, one candidate of each family first, and return all contenders. Afterwards relatives and
        settings of the best race, then other formulations, until steps on one of them take more than three times as
        long."""
        contenders = [self._contender(candidate) for candidate in one_of_each(self.own)]
        best = self.race_with_neighbours(contenders, self.race.run(contenders))
        for name in self.others:
            best = self._also(contenders, best, self._contenders_on(name, best))
            if name in self.race.judge.runner.formulations.simplified:
                continue
            if best is not None and any(self._dearer(c, best) for c in contenders if c.candidate.formulation == name):
                rest = self.others[self.others.index(name) + 1 :]
                why = f"a step on {name} takes more than {DEARER:g} times as long as the best one's"
                self.race.left_out.update(dict.fromkeys(rest, why))
                break
        return contenders

    def race_with_neighbours(self, contenders: list[Contender], best: Contender | None) -> Contender | None:
        """Return the best contender after a race with its neighbours: first relatives, then settings; entries that have
        raced are left out."""
        for near in (self._relatives, self._settings):
            entered = {contender.configuration.key for contender in contenders}
            best = self._also(contenders, best, [c for c in near(best) if c.configuration.key not in entered])
        return best

    def _also(self, contenders: list[Contender], best: Contender | None, added: list[Contender]) -> Contender | None:
        """Return the best contender after a race with further contenders."""
        reached = math.inf if best is None else best.seconds(self.race.demand)
        better = self.race.run(added, reached) if added else None
        contenders += added
        return better if better is not None and better.seconds(self.race.demand) < reached else best

    def _contender(self, candidate: Candidate, configuration: Configuration | None = None) -> Contender:
        configuration = configuration or candidate.configuration({"rho_inf": self.defaults.rho_inf})
        if candidate.method.chooses_steps:
            return Contender(
                candidate, configuration, TOLERANCE, 1.0 / first_tolerance(candidate.method.order, self.race.demand)
            )
        grid = self.race.judge.runner.grid
        first = whole_steps(grid.row / (8.0 * self.defaults.step), grid.coarsest)
        return Contender(candidate, configuration, "step", first, grid.coarsest)

    def _near(self, best: Contender, candidate: Candidate, configuration: Configuration | None = None) -> Contender:
        """Return a contender that begins with the winner's resolution."""
        contender = self._contender(candidate, configuration)
        reached = best.best(self.race.demand)
        if reached is not None and contender.kind == best.kind:
            contender.start = reached.resolution
        return contender

    def _relatives(self, best: Contender | None) -> list[Contender]:
        """Return contenders with other methods of the winner's family, and with other values of the winner's
        parameters. A method that equals another method of the family with a parameter's value is left out. Empty
        without a winner, or if ``parameters`` are not varied."""
        if best is None or "parameters" not in self.axes:
            return []
        result = []
        for candidate in self.own:
            row = candidate.row
            if candidate.family is not best.candidate.family or not (candidate.facts.compared or row.differs):
                continue
            for configuration in candidate.configurations():
                if configuration.key != best.configuration.key:
                    result.append(self._near(best, candidate, configuration))
        return result

    def _settings(self, best: Contender | None) -> list[Contender]:
        """Return contenders with the winner's method with other settings of the iteration, and in single precision.
        Single precision for demands of 1e-5 and more only. Empty without a winner."""
        if best is None:
            return []
        axes = [axis for axis in self.axes if axis != "arithmetic" or self.race.demand >= 1e-5]
        varied = refinements(best.configuration, axes)
        return [self._near(best, best.candidate, configuration) for configuration in varied]

    def _contenders_on(self, name: str, best: Contender | None) -> list[Contender]:
        """Return contenders on another formulation: the winner's family if possible there, else one contender of each
        family. Empty, with the reason in ``left_out``, if the formulation cannot be built."""
        self.race.say(f"building: {name}")
        try:
            there = candidates(name, self.race.judge.runner.model(name), self.methods, self.race.left_out)
        except EomgenError as error:
            self.race.left_out[name] = reason(error)
            return []
        first = one_of_each(there)
        same = [c for c in first if best is not None and c.family is best.candidate.family]
        if best is not None and same:
            return [self._near(best, candidate) for candidate in same]
        return [self._contender(candidate) for candidate in first]

    def _dearer(self, there: Contender, best: Contender) -> bool:
        """Return whether a step on another formulation takes so much longer than a step of the best contender that
        formulations of this kind need not run."""
        reached = best.best(self.race.demand)
        if reached is None or not reached.steps:
            return False
        per_step = [run.seconds / run.steps for run in there.runs if run.steps]
        return bool(per_step) and min(per_step) > DEARER * reached.seconds / reached.steps


def first_tolerance(order: int, demand: float) -> float:
    """Return the tolerance at which a method takes as many steps as a method of order 5 at the demand, at most 0.1.

    Steps are as many as tolerance^(-1/(order + 1)): of order 2, a demand of 1e-8 would take hundreds of thousands.
    """
    return float(min(0.1, demand ** min(1.0, (order + 1) / 6.0)))
