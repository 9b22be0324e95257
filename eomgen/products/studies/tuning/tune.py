"""tune: the cheapest configuration of a scene that meets a demand on its error, found by racing and verified."""

from __future__ import annotations

import itertools
import math
import os
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from eomgen.base.calls import checked_call, names_of
from eomgen.base.data import dataclass, field
from eomgen.compiled.arguments import number_of
from eomgen.errors import ModelError, NumericalError, Problem, UsageError
from eomgen.products.studies.defaults import MEASURE, OUTPUT, TUNE_BUDGET
from eomgen.products.studies.seconds import study_seconds
from eomgen.products.studies.tuning.judge import Condition, Demand, Judge, VerificationRun, conditions, verify
from eomgen.products.studies.tuning.race import COARSE, Contender, Race, RaceEntries, RaceRun
from eomgen.products.studies.tuning.result import RacedMethod, Tuned
from eomgen.products.studies.work_precision.axes import TOLERANCE, candidates, checked_axes
from eomgen.products.studies.work_precision.formulations import JOINT, formulations
from eomgen.products.studies.work_precision.observation import check_measure, check_output
from eomgen.products.studies.work_precision.running import (
    MOST_TIMES,
    REACHED,
    Runner,
    machine,
    measure_seconds,
    tuning_grid,
)
from eomgen.system.description import Simulation

#: The part of the budget that the motion under a condition, and that a run, may take.
JUDGE_SHARE = 0.15


@checked_call('eomgen.tune("scene.toml", 1e-4)')
def tune(
    scene: Any,
    error: float | None = None,
    *,
    output: str = OUTPUT,
    measure: str = MEASURE,
    axes: Sequence[str] = (),
    methods: Sequence[str] = (),
    t_end: float | None = None,
    parameters: Mapping[str, float] | None = None,
    inputs: Mapping[str, Any] | None = None,
    budget: float = TUNE_BUDGET,
    formulated: bool = True,
    progress: Callable[[str], None] | None = None,
    **reading: Any,
) -> Tuned:
    """Find the cheapest configuration of a scene that meets a demand on its error.

    Errors include all rows that the scene records with the tuned settings, up to 20 000; times are of stepping with
    these rows, without outputs, energies and the error estimate. No file of a scene is written: ``Tuned.save`` does.

    Methods race: the first method of each family is run coarsely; cost and order of these runs decide on further runs.
    Relatives of the winner race only with the axis ``parameters``. The winner is verified on runs with other initial
    states, parameters and inputs, against separate references, and refined if it misses the demand. After four rounds
    the winner is returned even if runs of verification still miss the demand: ``Tuned.met`` is False then. The scene's
    own run meets the demand in any case.

    Parameters
    ----------
    scene : str, Path, mapping, Scene or document
        Scene, or the document of another front end.
    error : float
        Demanded relative error, as 1e-4; required. Errors are relative to the size of the quantity in a reference run.
    output : str
        Quantity of the error: an output of the scene, ``q``, ``v``, ``state`` (the largest error of q, v and z), or, if
        the scene has any, ``z`` or ``multipliers``.
    measure : str
        Of the error over time: ``largest``, ``rms`` or ``final``.
    axes : sequence of str
        Varied axes: ``formulation``, ``parameters``, ``policy``, ``arithmetic`` (for demands of 1e-5 and more),
        ``fidelity``; all but ``fidelity`` by default. The ``method`` and the ``resolution`` always vary, and may be
        named for no further axis; the compiler's profile does not.
    methods : sequence of str
        Methods to try; by default all that make a difference to the scene.
    t_end : float
        S, at least a step of the scene; the scene's duration by default. Runs begin at 0.
    parameters, inputs : mapping
        Tunable parameters and inputs by name, as of ``simulate``; the scene's by default.
    budget : float
        Seconds, builds not counted, for single limits: a run is stopped after 0.15 of these (1 s at least), and a
        reference by one method is not refined for longer than 0.15 of these. The whole computation has no limit.
    formulated : bool
        Whether other formulations than the scene's own may win, with the axis ``formulation``.
    progress : callable
        Called with a word on the present work.
    **reading
        As of ``eomgen.load``.

    Returns
    -------
    Tuned
        The cheapest settings that meet the demand on the scene's own run, with measured error, rivals and runs of
        verification, ``verified``; conditions without a reference have none.

    Raises
    ------
    UsageError
        No demand, or a demand out of 1e-13..0.5; an unknown output, method, axis or measure; ``t_end`` too small.
    ModelError
        No method runs on the scene.
    NumericalError
        There is no sufficiently accurate reference, all bodies rest, or no configuration meets the demand within the
        budget.
    """
    if error is None:
        raise UsageError(Problem("tune", "a demand on the error is needed [E1123]", "error=1e-4"))
    if not (isinstance(error, int | float) and 1e-13 <= error <= 0.5):
        raise UsageError(Problem("error", f"a demand lies in 1e-13..0.5, not {error!r} [E1125]", "1e-4"))
    check_measure(measure)
    chosen, named = checked_axes(axes, ("profile",)), names_of("methods", "methods", methods, "rk4")
    others = formulated and "formulation" in chosen
    variants = formulations(scene, reading, others=others, fidelity="fidelity" in chosen)
    defaults = variants.description.simulation
    end, budget = defaults.duration if t_end is None else number_of("t_end", t_end), study_seconds("budget", budget)
    grid = tuning_grid(end, defaults.step, defaults.step * defaults.record_every)
    runner = Runner(variants, grid, parameters, inputs, limit=max(1.0, JUDGE_SHARE * budget))
    source = Path(scene) if isinstance(scene, str | os.PathLike) else None
    demand, say = Demand(float(error), output, measure), progress or (lambda _: None)
    return _Tuning(runner, demand, defaults, named, chosen, budget, say).result(source)


@dataclass
class _Tuning:
    """The state of one call of ``tune``: runner, demand and options, and the reasons for omitted configurations."""

    runner: Runner
    demand: Demand
    defaults: Simulation
    methods: tuple[str, ...]
    axes: tuple[str, ...]
    budget: float
    say: Callable[[str], None]
    left_out: dict[str, str] = field(default_factory=dict)

    @property
    def own(self) -> str:
        """The name of the scene's own formulation."""
        return self.runner.formulations.own

    def result(self, source: Path | None) -> Tuned:
        """Race and verify the configurations, and return the cheapest that meets the demand, with rivals, checks and
        costs. `source` is the scene's file, if any. Raises ModelError if no method runs, NumericalError if none meets
        the demand."""
        demand = self.demand
        began = time.process_time()
        self.left_out |= self.runner.formulations.refused
        model = self.runner.model(self.own)
        check_output("output", demand.quantity, model)
        scene_candidates = candidates(self.own, model, self.methods, self.left_out)
        if not scene_candidates:
            why = "; ".join(self.left_out.values())
            raise ModelError(Problem("methods", f"no method runs on this scene: {why} [E1128]", "other methods"))
        # a demand is judged by the best, also from methods that do not race
        every = candidates(self.own, model, (), {}) if self.methods else ()
        judges = {candidate.row.name: candidate for candidate in (*every, *scene_candidates)}
        judge = Judge(self.runner, list(judges.values()), demand, JUDGE_SHARE * self.budget, self.say)
        near = conditions(self.runner, judge.reference().observation)
        race = Race(judge, demand.error, self.say, [next(near)], left_out=self.left_out)
        entries = RaceEntries(race, scene_candidates, self._others(), self.axes, self.methods, self.defaults)
        try:
            contenders = entries.run_race()
            self._enough(contenders)
            winner, checks = self._verify_winner(entries, contenders, near)
        except KeyboardInterrupt as stop:
            best = min(race.entered, key=lambda c: c.seconds(demand.error), default=None)
            if best is not None and (met := best.best(demand.error)) is not None:
                settings = self._simulation(best, self._value(best, met)).items()
                told = ", ".join(f"{key} = {value!r}" for key, value in settings)
                stop.add_note(f"the cheapest so far, which is not verified, has {told}")
            raise
        self._enough(contenders)
        own_settings = self._own_settings(judge)
        spent = time.process_time() - began - self.runner.building, race.runs
        return self._result(contenders, winner, checks, own_settings, spent, source)

    def _others(self) -> list[str]:
        """Return the names of other formulations that may win: simplified ones first, then other coordinates. Other
        coordinates are left out, with a reason, if joint coordinates have no constraints."""
        less = self.runner.formulations.simplified
        others = [name for name in self.runner.formulations.scenes if name != self.own and name not in less]
        if self.own == JOINT and not self.runner.model(JOINT).multipliers and others:
            self.left_out |= dict.fromkeys(others, "joint coordinates have no constraints")
            return list(less)
        return [*less, *others]

    def _enough(self, contenders: Sequence[Contender]) -> None:
        demand = self.demand
        if not any(c.best(demand.error) for c in contenders):
            closest = min((run.error for c in contenders for run in c.runs), default=math.inf)
            fault = f"no configuration meets {demand.error:g} in the budget: the least error is {closest:.2g} [E1129]"
            raise NumericalError(Problem("error", fault, "a larger demand, a larger budget, or other methods"))

    def _verify_winner(
        self, entries: RaceEntries, contenders: list[Contender], near: Iterator[Condition]
    ) -> tuple[Contender, tuple[VerificationRun, ...]]:
        """Return the winner and the runs of its verification.

        Conditions under which the winner misses the demand become conditions of tuning, all contenders race again, and
        other conditions verify. Another winner brings its neighbours into the race.
        """
        race = entries.race
        for left in reversed(range(4)):  # conditions missed in one round are tuned on in the next
            winner = min(contenders, key=lambda c: c.seconds(race.demand))
            run = winner.best(race.demand)
            if run is None:
                break
            tried = list(itertools.islice(near, 3))
            checks: list[VerificationRun] = []
            for condition in tried:
                self.say(f"verifying: {condition.label}")
                if (check := verify(race.judge, winner.how(run), condition)) is not None:
                    checks.append(check)
            missed = {check.what for check in checks if not check.error <= race.demand}
            if not missed or not left:
                break
            race.training += [condition for condition in tried if condition.label in missed]
            for contender in contenders:
                contender.reopen(race.demand)
            best = race.run(contenders)
            if best is not winner:
                entries.race_with_neighbours(contenders, best)
        return winner, tuple(checks)

    def _result(
        self,
        contenders: Sequence[Contender],
        winner: Contender,
        checks: tuple[VerificationRun, ...],
        own_settings: tuple[str, float, float],
        spent: tuple[float, int],
        source: Path | None,
    ) -> Tuned:
        """Return the result for the winner's run, with rivals, verification runs, the scene's own settings and costs.
        `spent` are seconds of computation and the number of runs."""
        demand, run = self.demand, winner.best(self.demand.error)
        assert run is not None  # checked by ``_enough``
        grid, value = self.runner.grid, self._value(winner, run)
        name = winner.configuration.formulation
        told = (c for c in contenders if any(each.error < COARSE for each in c.runs))
        finer = [contender.predict_seconds(0.1 * demand.error) for contender in told]
        elsewhere = name != self.own and name not in self.runner.formulations.simplified
        return Tuned(
            scene=self.runner.model(self.own).name,
            quantity=demand.quantity,
            measure=demand.measure,
            demand=demand.error,
            configuration=winner.configuration,
            kind=winner.kind,
            value=value,
            error=run.own,
            seconds=run.seconds,
            span=grid.end - grid.start,
            steps=run.steps,
            rivals=_rivals(contenders, winner, demand.error),
            next_digit=max(min(finer) / run.seconds, 1.0) if finer else 0.0,
            own=own_settings,
            said=self.runner.run(**winner.how(run), timed=False).said,
            verified=checks,
            simulation=self._simulation(winner, value),
            written=(run.own, run.seconds),
            coordinates=("joint" if name == JOINT else "absolute") if elsewhere else "",
            group=name if elsewhere and name != JOINT else "",
            machine=machine(),
            spent=spent,
            built=sum(self.runner.compiled.values()),
            left_out=dict(self.left_out),
            source=source,
            simplified=name if name in self.runner.formulations.simplified else "",
        )

    def _value(self, winner: Contender, run: RaceRun) -> float:
        """Return the step, s, or the tolerance of a run."""
        return 1.0 / run.resolution if winner.kind == TOLERANCE else self.runner.grid.row / run.resolution

    def _own_settings(self, judge: Judge) -> tuple[str, float, float]:
        """Run the scene with its own method and step; return both in words, the error and the seconds of stepping.
        Error and seconds are infinite if the run does not reach the end."""
        simulation = self.defaults
        configuration = self.runner.own_configuration()
        words = f"{configuration.method}, step {simulation.step:g} s"
        per_row = Fraction(self.runner.grid.row / simulation.step).limit_denominator(MOST_TIMES)
        outcome = self.runner.run(configuration, per_row, estimated=False)
        if outcome.ended != REACHED or outcome.observation is None or outcome.repeated is None:
            return words, math.inf, math.inf
        return words, judge.error(outcome.observation), measure_seconds(outcome.repeated, 1)[0]

    def _simulation(self, winner: Contender, value: float) -> dict[str, Any]:
        """Return the winner's method, step or tolerance (`value`), recording and settings as keys of a scene's
        ``simulation``."""
        interval = self.defaults.step * self.defaults.record_every
        settings: dict[str, Any] = {"method": winner.configuration.method}
        if winner.kind == TOLERANCE:
            grid = self.runner.grid
            settings |= {"tolerance": value, "step": grid.row * grid.recorded, "record_every": 1}
        else:
            settings |= {"step": _shortest(value), "record_every": max(1, round(interval / value))}
        return settings | winner.configuration.simulation_keys()


def _rivals(contenders: Sequence[Contender], winner: Contender, demand: float) -> tuple[RacedMethod, ...]:
    """Return the best run of each other method and formulation, cheapest first; expected seconds if none meets the
    demand."""
    best: dict[tuple[str, str], RacedMethod] = {}
    for contender in contenders:
        key = (contender.configuration.method, contender.configuration.formulation)
        told = any(math.isfinite(run.error) for run in contender.runs)
        if key == (winner.configuration.method, winner.configuration.formulation) or not told:
            continue
        measured = contender.best(demand) is not None
        seconds = contender.seconds(demand) if measured else contender.predict_seconds(demand)
        rival = RacedMethod(contender.configuration.label, seconds, measured)
        if key not in best or rival.seconds < best[key].seconds:
            best[key] = rival
    return tuple(sorted(best.values(), key=lambda rival: rival.seconds))


def _shortest(value: float) -> float:
    """Return the number of the fewest digits within rounding of a few products of a value: 0.015, not
    0.015000000000000001."""
    near = (float(f"{value:.{digits}g}") for digits in range(1, 17))
    return next((number for number in near if abs(number - value) <= 4.0 * math.ulp(value)), value)
