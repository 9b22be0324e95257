"""Demands on a run and their judge: motions that runs are held against, also under conditions near the scene's own
and of runs that no configuration was chosen on.

The judge: motions that runs are held against, each known to a part of the demand and no better.

Two runs of one method are compared, the second at a hundredth of the first one's tolerance or at half its step, from a
tolerance on that is a part of the demand; both are refined until they differ by no more than the judge may be wrong.
Candidates that served under the scene's own conditions are tried first under others.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.errors import EomgenError, ModelError, NumericalError, Problem
from eomgen.formula.prescribed_motion import constant
from eomgen.lie.product import difference, update
from eomgen.pipeline.model import Model
from eomgen.products.studies.work_precision.axes import TOLERANCE, Candidate, possible
from eomgen.products.studies.work_precision.observation import ErrorSize, Observation, error_in
from eomgen.products.studies.work_precision.reference import (
    LARGEST_UNCERTAINTY,
    TIGHT,
    RefinedRun,
    RunReference,
    check_moves,
    hold,
    no_reference,
    rank,
    refine,
    took_longer,
)
from eomgen.products.studies.work_precision.running import REACHED, ComparedRun, Runner


@dataclass(frozen=True)
class Demand:
    """A demand on the error of a run: a relative ``error`` of a ``quantity`` in a ``measure`` over time (``largest``,
    ...)."""

    error: float
    quantity: str
    measure: str

    def of(self, sizes: Mapping[str, ErrorSize]) -> float:
        """Return the error that counts; infinite if unknown or not finite."""
        return error_in(sizes, self.quantity, self.measure)


#: Relative changes of conditions: initial positions by this part of each coordinate's motion in the run, velocities by
#: this part of the largest velocity; parameters and inputs by this part of the value, and prescribed laws of time begin
#: later by this part of the run.
MOVED, CHANGED = 0.05, 0.03


@dataclass(frozen=True)
class Condition:
    """Under which a run is made.

    Attributes
    ----------
    label : in words, empty for the scene's own
    arguments : of ``Runner.run``
    """

    label: str = ""
    arguments: Mapping[str, Any] = field(default_factory=dict)


#: Unchanged arguments of the scene.
OWN = Condition()


def conditions(runner: Runner, motion: Observation) -> Iterator[Condition]:
    """Yield conditions near the scene's own, without end and the same at every call.

    Every second condition also has other parameters, and each has other inputs if the scene or the caller gives inputs:
    numbers and functions are multiplied, and prescribed laws of time begin at a later moment. A parameter whose change
    the scene refuses is not changed.

    Parameters
    ----------
    motion : of the scene's formulation under unchanged conditions
    """
    rng = np.random.default_rng(20240607)
    model = runner.model(runner.formulations.own)
    first = np.broadcast_to(motion.q[0], motion.q.shape)
    moves = np.abs(difference(model.factors, first, motion.q)).max(axis=0)
    speeds = np.abs(motion.v).max(axis=0)
    moving = _over_time(model, runner)
    number = 0
    while True:
        number += 1
        q = update(model.factors, motion.q[0], MOVED * moves * rng.choice([-1.0, 1.0], model.nv))
        v = motion.v[0] + MOVED * speeds * rng.choice([-1.0, 1.0], model.nv)
        arguments: dict[str, Any] = {"initial": {"q": q, "v": v}}
        words = [f"positions by {100 * MOVED:g} % of their motion, velocities by {100 * MOVED:g} %"]
        if number % 2 == 0 and (others := _parameters(model, runner.parameters or {}, rng)):
            arguments["parameters"] = others
            words.append(f"parameters by {100 * CHANGED:g} %")
        if changed := _inputs(model, runner, rng):
            arguments["inputs"] = {**(runner.inputs or {}), **changed}
            words.append(f"inputs by {100 * CHANGED:g} %")
        if moving:
            arguments["later"] = max(1, round(CHANGED * rng.uniform(0.5, 1.0) * runner.grid.rows))
            seconds = arguments["later"] * runner.grid.row
            words.append(f"prescribed functions of time from {seconds:.3g} s on")
        yield Condition(f"{number}: {', '.join(words)}", arguments)


def _parameters(model: Model, parameters: Mapping[str, float], rng: np.random.Generator) -> dict[str, float]:
    values = {**dict(model.parameters), **parameters}
    for name, value in list(values.items()):
        changed = {**values, name: value * (1.0 + CHANGED * float(rng.choice([-1.0, 1.0])))}
        try:
            model.parameter_array(changed)
        except EomgenError:
            continue
        values = changed
    return values


def _inputs(model: Model, runner: Runner, rng: np.random.Generator) -> dict[str, Any]:
    """Return the caller's inputs and the scene's constant inputs by name, each multiplied by a random factor 1 +-
    0.03."""
    inputs = runner.inputs or {}
    result: dict[str, Any] = {}
    sampled = _sample_inputs(model, runner)
    for column, name in enumerate(model.inputs):
        factor = 1.0 + CHANGED * float(rng.choice([-1.0, 1.0]))
        if name in inputs:
            result[name] = _multiply(inputs[name], factor)
        elif sampled is not None and np.ptp(sampled[:, column]) == 0.0 and sampled[0, column]:
            result[name] = factor * float(sampled[0, column])
    return result


def _multiply(signal: Any, factor: float) -> Any:
    if not callable(signal):
        return factor * np.asarray(signal, dtype=float)
    original: Callable[[float], float] = signal
    return lambda t: factor * original(t)


def _sample_inputs(model: Model, runner: Runner) -> Array | None:
    """Return the scene's inputs at some times of the run, (n, nu); None for a scene without inputs."""
    if not model.inputs or "inputs" not in model.functions:
        return None
    grid = runner.grid
    times = np.linspace(grid.start, grid.end, 257)
    p = model.parameter_array(runner.parameters)
    values: Array = np.asarray(model.input_values(times, parameters=p), dtype=float)
    return values


def _over_time(model: Model, runner: Runner) -> bool:
    """Return whether the scene has a prescribed law of time: an input, a drive, the motion of its base, a force."""
    sampled = _sample_inputs(model, runner)
    moves = sampled is not None and bool(np.any(np.ptp(sampled, axis=0) > 0.0))
    prescribed = (*(law.formula for law in model.description.laws), *model.description.formulas)
    return moves or any(not constant(formula) for formula in prescribed)


#: Wanted uncertainty of the reference, relative to the demand.
KNOWN = 0.05


@dataclass
class Judge:
    """Reference motions under the scene's conditions and under changed conditions, for the errors of runs.

    Attributes
    ----------
    runner : runs configurations
    candidates : candidates of the scene's own formulation
    demand : error to be met
    seconds : of the processor, that a motion may take
    say : called with a word on the present work
    tried : reasons for which other methods failed
    """

    runner: Runner
    candidates: Sequence[Candidate]
    demand: Demand
    seconds: float
    say: Callable[[str], None]
    tried: dict[str, str] = field(default_factory=dict)
    _held: dict[str, RunReference] = field(default_factory=dict)
    _served: RefinedRun | None = None

    def reference(self, condition: Condition = OWN) -> RunReference:
        """Return the motion under a condition.

        Raises
        ------
        NumericalError
            No motion is accurate enough for the demand, or the system does not move.
        """
        if condition.label not in self._held:
            self._held[condition.label] = self._reference(condition)
        return self._held[condition.label]

    def error(self, observation: Observation, condition: Condition = OWN) -> float:
        """Return the error of a run under a condition, as far as known."""
        return self.demand.of(self.reference(condition).errors_of(observation))

    def _reference(self, condition: Condition) -> RunReference:
        """Return the most certain motion under a condition as the reference, tried by one method after another. Raises
        NumericalError if no method runs, the system does not move, or the motion is known to less than half of the
        demand."""
        best: RefinedRun | None = None
        apart = 0
        for candidate in self._order():
            self.say(f"reference: {candidate.row.name}{', ' * bool(condition.label)}{condition.label}")
            known = self._refine(candidate, condition)
            if known is not None and (best is None or known.error < best.error):
                best = known
            if best is not None and best.error <= KNOWN * self.demand.error:
                break
            apart += known is not None and known.error > LARGEST_UNCERTAINTY
            if apart == 2:  # such a motion is unstable
                break
        if best is None:
            slow = dict.fromkeys((candidate.row.name for candidate in self.candidates), took_longer(self.seconds))
            raise no_reference([f"{name}: {why}" for name, why in (slow | self.tried).items()])
        check_moves(self.runner, best.observation)
        if best.error > LARGEST_UNCERTAINTY:
            hold(f"{best.described} and the same at half its accuracy", best.error)
        if best.error > 0.5 * self.demand.error:
            fault = (
                f"the best reference, {best.described}, is known to {best.error:.2g} only, too little for the"
                f" demand {self.demand.error:g} [E1112]"
            )
            hint = "a larger demand, a shorter run, or a larger budget"
            raise NumericalError(Problem("error", fault, hint))
        if not condition.label:
            self._served = best
        return RunReference(best.observation, best.described, "itself at half its accuracy", best.apart)

    def _order(self) -> list[Candidate]:
        """Return the candidates that have not failed, the last successful one first, then by rank. Raises ModelError
        without candidates."""
        if not self.candidates:
            raise ModelError(Problem("methods", "no method runs on this scene [E1115]", "other methods"))
        served = None if self._served is None else self._served.candidate
        able = (c for c in self.candidates if c.row.name not in self.tried)
        return sorted(able, key=lambda c: (c is not served, rank(self.runner, c)))

    def _refine(self, candidate: Candidate, condition: Condition) -> RefinedRun | None:
        """Return the motion by one method under a condition, refined until two levels agree to 5 % of the demand. The
        best so far if accuracy ends or time runs out; None, with the reason in ``tried``, if the method fails."""
        levels, enough = self._levels(candidate), KNOWN * self.demand.error
        if self._served is not None and self._served.candidate is candidate:
            levels = levels[levels.index(self._served.level) - 1 :]
        known, why = refine(self.runner, candidate, levels, self.seconds, enough, self.demand.of, **condition.arguments)
        if known is None and not condition.label:
            self.tried[candidate.row.name] = why
        return known

    def _levels(self, candidate: Candidate) -> list[Mapping[str, Any]]:
        """Return successively finer resolutions of a method as arguments of ``Runner.run``."""
        if not candidate.method.chooses_steps:
            return [{"per_row": 2**k} for k in range(17)]
        least = min(x for x in (*TIGHT, *candidate.tolerances) if possible(candidate.row.name, {TOLERANCE: x}))
        tolerance, levels = min(1e-2 * self.demand.error, max(candidate.tolerances, default=1.0)), []
        while tolerance > 5.0 * least:  # the least tolerances are not refined by less
            levels.append(tolerance)
            tolerance *= 1e-2
        return [{TOLERANCE: x} for x in (*levels, 5.0 * least, least)]


@dataclass(frozen=True)
class VerificationRun:
    """One verification run.

    Attributes
    ----------
    what : condition, in words
    error : of the tuned quantity, infinite if the run did not reach the end
    uncertainty : of the reference
    by : description of the reference
    said : by the run
    """

    what: str
    error: float
    uncertainty: float
    by: str
    said: str = ""


def verify(judge: Judge, run: Mapping[str, Any], condition: Condition) -> VerificationRun | None:
    """Run a configuration under a condition and return its error against the reference there; None without a reference.

    The error is infinite if the run does not reach the end.

    Parameters
    ----------
    judge : has the references
    run : arguments of ``Runner.run``: ``configuration``, ``per_row`` or ``tolerance``
    condition : initial state, parameters, inputs
    """
    try:
        held = judge.reference(condition)
    except EomgenError:
        return None
    outcome = under(judge, run, condition)
    if outcome.ended != REACHED or outcome.observation is None:
        return VerificationRun(condition.label, np.inf, 0.0, "", outcome.said)
    error, bar = judge.error(outcome.observation, condition), held.bar(judge.demand.quantity, judge.demand.measure)
    return VerificationRun(condition.label, error, bar, held.described, outcome.said)


def under(judge: Judge, run: Mapping[str, Any], condition: Condition = OWN) -> ComparedRun:
    """Return the run of a configuration under a condition, from the start of the reference."""
    arguments = dict(condition.arguments)
    if "initial" in arguments:
        motion = judge.reference(condition).observation
        arguments["initial"] = {"q": motion.q[0], "v": motion.v[0]}  # consistent
    return judge.runner.run(**run, **arguments, timed=False, estimated=False)
