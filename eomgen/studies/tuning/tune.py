"""tune: the cheapest configuration of a scene that meets a demand on its error, found by racing and verified."""

from __future__ import annotations

import math
import os
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

from eomgen.errors import EomgenError, ModelError, NumericalError, Problem, UsageError
from eomgen.pipeline import pipeline
from eomgen.studies.tuning.contender import MARGIN, Contender, Tried
from eomgen.studies.tuning.race import REPEATS, Race
from eomgen.studies.tuning.real_time import RealTime
from eomgen.studies.tuning.real_time import real_time as in_real_time
from eomgen.studies.tuning.result import Rival, Tuned
from eomgen.studies.tuning.verification import Verified, conditions, verified
from eomgen.studies.work_precision.axes import TOLERANCE, Candidate, candidates, one_of_each, reason
from eomgen.studies.work_precision.configuration import Configuration
from eomgen.studies.work_precision.formulations import JOINT, formulations
from eomgen.studies.work_precision.machine import machine
from eomgen.studies.work_precision.observation import MEASURES, STATE, quantities
from eomgen.studies.work_precision.reference import Reference, reference
from eomgen.studies.work_precision.running import REACHED, Runner, timed
from eomgen.studies.work_precision.times import MOST_TIMES, fraction_of, tuning_grid, whole_steps
from eomgen.text import nearest, shown

#: The first run of a contender has steps this many times the scene's, or a tolerance of this many demands.
FIRST_STEP, FIRST_TOLERANCE = 8.0, 1.0
#: What a motion is held against while it races is known to this part of the demand.
JUDGE = 0.05
#: Single precision is tried for demands from this on.
SINGLE = 1e-4
#: Rounds in which a configuration that failed its verification is made finer.
ROUNDS = 3
#: The part of the budget that the judge, and that each verification's reference, may take.
JUDGE_SHARE, VERIFICATION_SHARE = 0.3, 0.02


@dataclass(frozen=True)
class Demand:
    """An error that is to be met: relative, of a quantity, in a measure over time."""

    error: float
    quantity: str
    measure: str


def tune(
    scene: Any,
    error: float | None = None,
    *,
    real_time: float | None = None,
    iterations: int | None = None,
    output: str = STATE,
    measure: str = "largest",
    methods: Sequence[str] = (),
    t_end: float | None = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    budget: float = 60.0,
    formulated: bool = True,
    progress: Callable[[str], None] | None = None,
    **reading: Any,
) -> Tuned | RealTime:
    """Find the cheapest configuration of a scene that meets a demand on its error, or what a cycle of real time buys.

    Errors are those of all rows that the written file will record, up to 20 000; times are of stepping with these rows,
    without outputs, energies and the error estimate.

    Methods race: each is run coarsely once, and what its cost and order promise decides which of them runs again. The
    winner is verified on runs with other initial states and parameters, against references of their own, and made finer
    where it misses the demand there.

    Parameters
    ----------
    scene : path, mapping, Scene, or another front end's document
    error : float
        The demand, relative as the errors of ``eomgen.tradeoff``.
    real_time : float
        s of motion that are to be computed within as many seconds: the most accurate fixed step is found whose work in
        such a cycle ends in time in 99.99 % of the cycles. No demand is taken with it.
    iterations : int
        With ``real_time``: bound on Newton's iterations of a step; what the run needs by default.
    output : str
        Whose error: an output of the scene, ``q``, ``v`` or ``state`` (both).
    measure : str
        ``largest``, ``rms`` or ``final``.
    methods : sequence of str
        All that make a difference to the scene by default.
    t_end : float
        s; the scene's duration by default.
    parameters, inputs : mapping
        As of ``simulate``.
    budget : float
        Seconds of computation, builds not counted.
    formulated : bool
        Whether other formulations than the scene's own may win.
    progress : callable
        Called with a word on what is done.
    reading
        As of ``eomgen.load``.

    Returns
    -------
    Tuned, or RealTime where ``real_time`` is given

    Raises
    ------
    UsageError
        A demand out of 1e-13..0.5; an unknown output, method or measure.
    NumericalError
        There is no reference that is known well enough, or nothing meets the demand within the budget; nothing ends in
        time, or nothing converges within the bound.
    """
    if (error is None) is (real_time is None):
        raise UsageError(Problem("tune", "either an error is demanded or a cycle of real time", "error=1e-4"))
    if iterations is not None and (real_time is None or iterations < 1):
        raise UsageError(Problem("iterations", "a bound of 1 or more goes with a cycle of real time", "real_time=1e-3"))
    if error is not None and not (isinstance(error, int | float) and 1e-13 <= error <= 0.5):
        raise UsageError(Problem("error", f"a demand lies in 1e-13..0.5, not {error!r}", "1e-4"))
    if measure not in MEASURES:
        raise UsageError(Problem("measure", f"there is no measure {shown(measure)}", f"one of {', '.join(MEASURES)}"))
    found = formulations(scene, reading, others=formulated and real_time is None)
    source = Path(scene) if isinstance(scene, str | os.PathLike) else None
    say = progress or (lambda _: None)
    if error is None:
        return in_real_time(
            found,
            float(real_time or 0.0),
            output=output,
            measure=measure,
            methods=methods,
            t_end=t_end,
            parameters=parameters,
            inputs=inputs,
            iterations=iterations,
            budget=budget,
            say=say,
            source=source,
        )
    tuning = _Tuning(found, tuple(methods), t_end, parameters, inputs, budget, say)
    return tuning.result(Demand(float(error), output, measure), source)


class _Tuning:
    """The work of one call of ``tune``."""

    def __init__(
        self,
        found: Any,
        methods: tuple[str, ...],
        t_end: float | None,
        parameters: Mapping[str, float] | None,
        inputs: Mapping[str, Any] | None,
        budget: float,
        say: Callable[[str], None],
    ) -> None:
        document, front_end = pipeline.as_document(found.scenes[found.own])
        self.defaults = front_end.describe(document).simulation
        end = self.defaults.duration if t_end is None else t_end
        if not (math.isfinite(end) and end > 0.0):
            raise UsageError(Problem("t_end", f"a run needs a later end than {end:g} s", "10"))
        self.found, self.methods, self.budget, self.say = found, methods, budget, say
        self.parameters = dict(parameters or {})
        grid = tuning_grid(end, self.defaults.step, self.defaults.step * self.defaults.record_every)
        self.runner = Runner(found, grid, parameters, inputs, limit=max(1.0, 0.3 * budget))
        self.left_out: dict[str, str] = dict(found.refused)
        self.own = found.own

    def result(self, demand: Demand, source: Path | None) -> Tuned:
        """Return what meets a demand at the least cost."""
        began = time.perf_counter()
        known = quantities(self.runner.model(self.own))
        if demand.quantity not in known:
            what = f"the scene has no output {shown(demand.quantity)}"
            raise UsageError(Problem("output", what, nearest(demand.quantity, known)))
        own = self._candidates(self.own)
        judges = self._judges(own)
        judge = self._judge(judges, demand)
        race = Race(self.runner, judge, demand.quantity, demand.measure, demand.error, self.say)
        race.left_out = self.left_out
        contenders = self._raced(race, own)
        able = [c for c in contenders if c.best(demand.error) is not None]
        if not able:
            closest = min((run.error for c in contenders for run in c.runs), default=math.inf)
            what = f"nothing meets {demand.error:g} within the budget: the least error is {closest:.2g}"
            raise NumericalError(Problem("error", what, "a larger demand, a larger budget, or other methods"))
        winner, run, checks = self._verified(race, contenders, demand, judges, judge)
        built = sum(self.runner.compiled.values())
        spent = time.perf_counter() - began - built
        return self._described(demand, contenders, (winner, run), checks, judge, race, (spent, built), source)

    def _candidates(self, formulation: str) -> tuple[Candidate, ...]:
        return candidates(formulation, self.runner.model(formulation), self.methods, self.left_out)

    def _judges(self, own: Sequence[Candidate]) -> tuple[Candidate, ...]:
        """Return what may be a reference: also methods that do not race, since a demand is told from the best."""
        every = candidates(self.own, self.runner.model(self.own), (), {})
        return (*own, *(c for c in every if c.row.name not in {one.row.name for one in own})) if own else ()

    def _judge(self, own: Sequence[Candidate], demand: Demand) -> Reference:
        if not own:
            why = "; ".join(self.left_out.values())
            raise ModelError(Problem("methods", f"no method runs on this scene: {why}", "other methods"))
        held = reference(
            self.runner, own, JUDGE_SHARE * self.budget, self.say, settled=JUDGE * demand.error, count=1, first_steps=1
        )
        bar = held.bar(demand.quantity, demand.measure)
        if bar > 0.5 * demand.error:
            what = f"the best reference, {held.described}, is known to {bar:.2g} only: {demand.error:g} cannot be told"
            raise NumericalError(Problem("error", what, "a larger demand, a shorter run, or a larger budget"))
        return held

    def _raced(self, race: Race, own: Sequence[Candidate]) -> list[Contender]:
        """Return all contenders: one method of each family, then the winner's relatives, then other formulations."""
        demand = race.demand
        first = [self._contender(c, c.configuration(self._usual), race) for c in one_of_each(own)]
        contenders = list(first)
        best = race.run(first)
        for relatives in (self._relatives, self._other_formulations, self._other_settings):
            added = relatives(best, own, race)
            contenders += added
            reached = math.inf if best is None else _seconds(best, demand)
            better = race.run(added, reached) if added else None
            if better is not None and _seconds(better, demand) < reached:
                best = better
        return contenders

    @property
    def _usual(self) -> dict[str, float]:
        return {"rho_inf": self.defaults.rho_inf}

    def _contender(self, candidate: Candidate, configuration: Configuration, race: Race) -> Contender:
        if candidate.method.chooses_steps:
            return Contender(candidate, configuration, TOLERANCE, 1.0 / (FIRST_TOLERANCE * race.demand))
        return Contender(candidate, configuration, "step", self._first_steps(), self.runner.grid.coarsest)

    def _first_steps(self) -> float:
        grid = self.runner.grid
        return whole_steps(grid.row / (FIRST_STEP * self.defaults.step), grid.coarsest)

    def _relatives(self, best: Contender | None, own: Sequence[Candidate], race: Race) -> list[Contender]:
        """Return other methods of the winner's family, and other values of its parameters."""
        if best is None:
            return []
        found = []
        for candidate in own:
            if candidate.family is not best.candidate.family:
                continue
            for configuration in candidate.configurations(parameters=True, own={}):
                if configuration.key != best.configuration.key:
                    found.append(self._near(best, candidate, configuration, race))
        return found

    def _near(self, best: Contender, candidate: Candidate, configuration: Configuration, race: Race) -> Contender:
        """Return a contender that begins where the winner has got to."""
        contender = self._contender(candidate, configuration, race)
        reached = best.best(race.demand)
        if reached is not None and contender.kind == best.kind:
            contender.start = reached.resolution
        return contender

    def _other_formulations(self, best: Contender | None, own: Sequence[Candidate], race: Race) -> list[Contender]:
        found: list[Contender] = []
        for name in list(self.found.scenes)[1:]:
            self.say(f"building: {name}")
            try:
                there = self._candidates(name)
            except EomgenError as error:
                self.left_out[name] = reason(error)
                continue
            found += [self._contender(c, c.configuration(self._usual), race) for c in one_of_each(there)]
        return found

    def _other_settings(self, best: Contender | None, own: Sequence[Candidate], race: Race) -> list[Contender]:
        """Return the winner with other settings of its iteration, and in single precision."""
        if best is None:
            return []
        method = self.runner.method(best.configuration)
        varied = [best.configuration.varied(policy=name, settings=s) for name, s in method.policies.items()]
        if race.demand >= SINGLE:
            varied.append(best.configuration.varied(real="float"))
        return [self._near(best, best.candidate, configuration, race) for configuration in varied]

    def _verified(
        self, race: Race, contenders: Sequence[Contender], demand: Demand, own: Sequence[Candidate], judge: Reference
    ) -> tuple[Contender, Tried, tuple[Verified, ...]]:
        """Return the winner, its run and those that it is verified on.

        Where one of these misses the demand all race again, for a demand that is smaller by as much.
        """
        checks: tuple[Verified, ...] = ()
        for _ in range(ROUNDS):
            winner = min(contenders, key=lambda c: _seconds(c, race.demand))
            run = winner.best(race.demand)
            if run is None:
                break
            last = winner, run
            checks = self._checks(winner, run, demand, own, judge)
            worst = max((check.error for check in checks), default=0.0)
            if worst <= demand.error:
                break
            room = 0.0 if not math.isfinite(worst) else demand.error * max(run.error, 1e-15) / worst
            race.demand = max(min(0.9 * race.demand, room), 0.05 * race.demand) if room else MARGIN * race.demand
            for contender in contenders:
                contender.reopen(race.demand)
            race.run(contenders)
        return (*last, checks)

    def _checks(
        self, winner: Contender, run: Tried, demand: Demand, own: Sequence[Candidate], judge: Reference
    ) -> tuple[Verified, ...]:
        """Return what a run gives under other conditions."""
        name = winner.candidate.formulation
        model = self.runner.model(name, winner.configuration.real, winner.configuration.profile)
        there = own if name == self.own else self._candidates(name)
        motion = judge.observation if name == self.own else self._motion(winner, run)
        target = (demand.quantity, demand.measure, demand.error)
        effort = VERIFICATION_SHARE * self.budget
        checks = []
        for changed in conditions(model, motion, self.parameters):
            self.say(f"verifying: {changed[0]}")
            check = verified(self.runner, winner.candidate, there, _how(winner, run), target, effort, changed)
            checks += [] if check is None else [check]
        return tuple(checks)

    def _motion(self, winner: Contender, run: Tried) -> Any:
        outcome = self.runner.run(**_how(winner, run), timed=False, estimated=False)
        if outcome.observation is None:
            raise NumericalError(Problem("tune", f"a run cannot be repeated: {outcome.said}", "the same again"))
        return outcome.observation

    def _described(
        self,
        demand: Demand,
        contenders: Sequence[Contender],
        won: tuple[Contender, Tried],
        checks: tuple[Verified, ...],
        judge: Reference,
        race: Race,
        spent: tuple[float, float],
        source: Path | None,
    ) -> Tuned:
        winner, run = won
        grid = self.runner.grid
        value = 1.0 / run.resolution if winner.kind == TOLERANCE else grid.row / run.resolution
        name = winner.configuration.formulation
        elsewhere = name != self.own
        outcome = self.runner.run(**_how(winner, run), timed=False, estimated=False)
        return Tuned(
            scene=self.runner.model(self.own).name,
            quantity=demand.quantity,
            measure=demand.measure,
            demand=demand.error,
            configuration=winner.configuration,
            kind=winner.kind,
            value=value,
            error=run.error,
            seconds=run.seconds,
            span=grid.end - grid.start,
            steps=outcome.stats.get("own_steps", outcome.stats.get("steps", 0.0)),
            rivals=_rivals(contenders, winner, race.demand),
            next_digit=_next_digit(contenders, run, race.demand),
            own=self._own_settings(judge, demand),
            verified=checks,
            simulation=self._simulation(winner, value),
            written=self._as_written(winner, run, judge, demand),
            coordinates=("joint" if name == JOINT else "absolute") if elsewhere else "",
            group=name if elsewhere and name != JOINT else "",
            machine=machine(),
            spent=(spent[0], race.runs),
            built=spent[1],
            left_out=dict(self.left_out),
            source=source,
        )

    def _own_settings(self, judge: Reference, demand: Demand) -> tuple[str, float, float]:
        """Return the scene's own settings in words, their error and seconds."""
        simulation = self.defaults
        given = {name: getattr(simulation, name) for name in ("alpha", "beta", "gamma") if getattr(simulation, name)}
        method = str(self.runner.model(self.own).library.layout["built_method"])
        configuration = Configuration(self.own, method, given)
        words = f"{method}, step {simulation.step:g} s"
        per_row = Fraction(self.runner.grid.row / simulation.step).limit_denominator(MOST_TIMES)
        outcome = self.runner.run(configuration, per_row, estimated=False)
        if outcome.ended != REACHED or outcome.observation is None or outcome.repeated is None:
            return words, math.inf, math.inf
        size = judge.errors_of(outcome.observation)[demand.quantity]
        return words, float(getattr(size, demand.measure)), outcome.repeated.seconds()

    def _as_written(self, winner: Contender, run: Tried, judge: Reference, demand: Demand) -> tuple[float, float]:
        """Return error and seconds with what a scene's file can hold of a configuration."""
        plain = winner.configuration.varied(policy="", settings={}, real="double", profile="fast")
        if plain.key == winner.configuration.key:
            return run.error, run.seconds
        outcome = self.runner.run(**{**_how(winner, run), "configuration": plain}, estimated=False)
        if outcome.observation is None or outcome.repeated is None:
            return math.inf, math.inf
        size = judge.errors_of(outcome.observation)[demand.quantity]
        return float(getattr(size, demand.measure)), statistics.median(timed(outcome.repeated, REPEATS))

    def _simulation(self, winner: Contender, value: float) -> dict[str, Any]:
        """Return the keys of a scene's section ``simulation``."""
        interval = self.defaults.step * self.defaults.record_every
        found: dict[str, Any] = {"method": winner.configuration.method}
        if winner.kind == TOLERANCE:
            grid = self.runner.grid
            found |= {"tolerance": value, "step": grid.row * grid.recorded, "record_every": 1}
        else:
            found |= {"step": value, "record_every": max(1, round(interval / value))}
        return found | dict(winner.configuration.parameters)


def _how(contender: Contender, run: Tried) -> dict[str, Any]:
    """Return the arguments of ``Runner.run`` for a run of a contender."""
    if contender.kind == TOLERANCE:
        return {"configuration": contender.configuration, "tolerance": 1.0 / run.resolution}
    return {"configuration": contender.configuration, "per_row": fraction_of(run.resolution)}


def _seconds(contender: Contender, demand: float) -> float:
    best = contender.best(demand)
    return math.inf if best is None else best.seconds


def _rivals(contenders: Sequence[Contender], winner: Contender, demand: float) -> tuple[Rival, ...]:
    """Return the best of each other method and formulation."""
    found: dict[tuple[str, str], Rival] = {}
    for contender in contenders:
        key = (contender.configuration.method, contender.configuration.formulation)
        if key == (winner.configuration.method, winner.configuration.formulation) or not contender.runs:
            continue
        measured = contender.best(demand) is not None
        seconds = _seconds(contender, demand) if measured else contender.expected(demand)
        rival = Rival(contender.configuration.label, seconds, measured)
        if key not in found or rival.seconds < found[key].seconds:
            found[key] = rival
    return tuple(sorted(found.values(), key=lambda rival: rival.seconds))


def _next_digit(contenders: Sequence[Contender], run: Tried, demand: float) -> float:
    expected = [c.expected(0.1 * demand) for c in contenders if c.runs and any(r.error < 0.2 for r in c.runs)]
    return max(min(expected, default=0.0) / run.seconds, 1.0) if expected else 0.0
