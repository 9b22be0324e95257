"""The reference of a study: two runs by different methods at tight tolerances; their difference is its uncertainty."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from eomgen.base.data import dataclass
from eomgen.errors import EomgenError, NumericalError, Problem
from eomgen.products.studies.work_precision.axes import TOLERANCE, Candidate, possible, reason
from eomgen.products.studies.work_precision.observation import (
    STATE,
    ErrorSize,
    Observation,
    errors,
    known_errors,
    with_arrays,
)
from eomgen.products.studies.work_precision.running import ComparedRun, Runner

#: Tolerances of methods with adaptive steps, as references.
TIGHT = (1e-15, 1e-13)
#: Steps are halved until two runs differ by no more than this, or by no less than before.
SETTLED = 1e-13
#: Steps between two times of the grid, at most.
MOST_STEPS = 2**16
#: Methods of a lower order come last; with fixed steps, their results are extrapolated.
LOW_ORDER = 4
#: Two references that differ by more than this are none.
LARGEST_UNCERTAINTY = 0.01


@dataclass(frozen=True)
class ReferenceSolution:
    """A run that serves as a reference.

    Attributes
    ----------
    described : method, formulation and step or tolerance, in words
    settled : change by the last halving of the step, or by another tolerance
    """

    observation: Observation
    described: str
    family: type
    settled: float


@dataclass(frozen=True)
class RunReference:
    """The reference that runs are compared with.

    Attributes
    ----------
    observation : of the first run
    described, second : both runs, in words
    uncertainty : the difference of the two by quantity
    """

    observation: Observation
    described: str
    second: str
    uncertainty: Mapping[str, ErrorSize]

    def bar(self, quantity: str, measure: str = "largest") -> float:
        """Return by how much a quantity of the reference may be wrong."""
        size = self.uncertainty.get(quantity)
        return 0.0 if size is None else float(getattr(size, measure))

    def errors_of(self, observation: Observation) -> dict[str, ErrorSize]:
        """Return the errors of a run by quantity, none below the uncertainty of this reference."""
        return known_errors(observation, self.observation, self.uncertainty)

    def to_dict(self) -> dict[str, Any]:
        return {
            "by": self.described,
            "held against": self.second,
            "uncertainty": {name: size.to_dict() for name, size in self.uncertainty.items()},
        }


def reference(
    runner: Runner,
    candidates: Sequence[Candidate],
    seconds: float,
    say: Callable[[str], None],
    *,
    settled: float = SETTLED,
    count: int = 2,
    first_steps: int = 8,
    **run: Any,
) -> RunReference:
    """Return the reference of a study, or of a single run of a study.

    Of the methods from order 4 on, methods with adaptive steps come first, then the highest orders; of formulations,
    those without constraints. The second run is by a method of another family.

    Parameters
    ----------
    runner, candidates : runs configurations; methods on formulations that may serve
    seconds : that both may take
    say : called with a word on the present work
    settled : steps are halved until two runs differ by no more than this
    count : 1: a second run only if the method chooses its steps or its step has been halved, by the same method
    first_steps : between two times of the grid, of the coarsest run
    run : other conditions, as of ``Runner.run``

    Raises
    ------
    NumericalError
        There are no two that agree to a hundredth.
    """
    order = sorted(candidates, key=lambda c: rank(runner, c))
    search = _ReferenceSearch(runner, seconds / count, settled, first_steps, run)
    solved: list[ReferenceSolution] = []
    tried: list[str] = []
    for candidate in order:
        if any(candidate.family is reference.family for reference in solved):
            continue
        say(f"reference: {candidate.row.name}, {candidate.formulation}")
        solution, why = search.best(candidate)
        if solution is None:
            tried.append(f"{candidate.row.name} on {candidate.formulation}: {why}")
            continue
        solved.append(solution)
        if len(solved) == count:
            break
    if not solved:
        raise no_reference(tried)
    first = solved[0]
    check_moves(runner, first.observation)
    if len(solved) == 1:
        hold(f"{first.described} and the same at half its accuracy", first.settled)
        known = {name: ErrorSize(*(first.settled,) * 3) for name in errors(first.observation, first.observation)}
        return RunReference(first.observation, first.described, "itself at half its accuracy", known)
    apart = errors(solved[1].observation, first.observation)
    hold(f"{first.described} and {solved[1].described}", _largest_error(apart))
    return RunReference(first.observation, first.described, solved[1].described, apart)


def no_reference(tried: Sequence[str]) -> NumericalError:
    """Return the error of a scene for which no method gives a reference, with the reasons of the first methods."""
    reasons = "; ".join(tried[:3]) or "there is none that runs on it"
    fault = f"no method gives a reference for this scene: {reasons} [E1111]"
    return NumericalError(Problem("reference", fault, "a shorter run, or a scene whose motion is smooth"))


def hold(both: str, part: float) -> None:
    """Raise NumericalError if two references, in words, differ by too large a part of the motion."""
    if not part <= LARGEST_UNCERTAINTY:
        fault = f"{both} differ by {100.0 * part:.3g} % of the motion: no error can be computed from them [E1136]"
        hint = "a shorter run, before motions that start side by side part, or a larger budget for the references"
        raise NumericalError(Problem("reference", fault, hint))


def check_moves(runner: Runner, observation: Observation) -> None:
    """Raise NumericalError if no coordinate and velocity changes in a run, because methods cannot be compared then. A
    model with internal states passes."""
    moves = any(np.any(np.ptp(values, axis=0)) for values in (observation.q, observation.v))
    if moves or runner.model(runner.formulations.own).nz:
        return
    fault = "nothing moves in this run, so that all methods give the same at any step [E1137]"
    raise NumericalError(Problem("reference", fault, "an initial state off balance, an input, or a later end"))


def rank(runner: Runner, candidate: Candidate) -> tuple[bool, bool, int, bool, int]:
    """Return the sort key of a candidate for a reference, smaller for better ones. Better are orders from 4 on, chosen
    steps, higher orders, no constraints, earlier formulations."""
    constrained = bool(runner.model(candidate.formulation).multipliers)
    names = list(runner.formulations.scenes)
    return (
        candidate.method.order < LOW_ORDER,
        not candidate.method.chooses_steps,
        -candidate.method.order,
        constrained,
        names.index(candidate.formulation),
    )


@dataclass(frozen=True)
class _ReferenceSearch:
    """Search for the most accurate run of a method.

    Attributes
    ----------
    seconds : limit for one method
    settled : difference of two runs at which the refinement ends
    first_steps : between two times of the grid, of the coarsest run
    conditions : other conditions of the runs
    """

    runner: Runner
    seconds: float
    settled: float
    first_steps: int
    conditions: Mapping[str, Any]

    def best(self, candidate: Candidate) -> tuple[ReferenceSolution | None, str]:
        """Return a candidate's most accurate run and an empty text; None and the reason if there is none. Of a method
        that chooses its steps the run at the least tolerance."""
        if not candidate.method.chooses_steps:
            return self._halve_steps(candidate)
        known = {x for x in (*TIGHT, *candidate.tolerances) if possible(candidate.row.name, {TOLERANCE: x})}
        tolerances = sorted(known)[:2]
        runs = [self._run(candidate, tolerance=tolerance) for tolerance in tolerances]
        tight, looser = runs[0].reference, runs[-1].reference
        if tight is None:
            return None, runs[0].said
        settled = _largest_error(errors(looser, tight)) if looser is not None else 0.0
        words = f"{candidate.row.name}, {candidate.formulation}, tolerance {tolerances[0]:g}"
        return ReferenceSolution(tight, words, candidate.family, settled), ""

    def _run(self, candidate: Candidate, **resolution: Any) -> ComparedRun:
        configuration, more = candidate.configuration({}), self.conditions
        return self.runner.run(configuration, **resolution, dense=True, timed=False, estimated=False, **more)

    def _halve_steps(self, candidate: Candidate) -> tuple[ReferenceSolution | None, str]:
        """Return the run at which halving the step has ended, and the message of the last run; None and a reason
        without one. Results of methods of low order are extrapolated to step zero."""
        try:
            self.runner.prepare(candidate.configuration({}))  # building takes none of the effort
        except EomgenError as error:
            return None, reason(error)
        best: ReferenceSolution | None = None
        said, change, order = "", np.inf, candidate.method.order
        levels = [{"per_row": self.first_steps * 2**k} for k in range(17) if self.first_steps * 2**k <= MOST_STEPS]
        for level, outcome, before in refine(lambda level: self._run(candidate, **level), levels, self.seconds, 2.2):
            said, here = outcome.said, outcome.reference
            if here is None and best is not None:
                break
            if here is None or before is None:
                continue
            apart = _largest_error(errors(before, here))
            if apart > 0.7 * change and apart < 1e-6:  # rounding has the word from here on
                break
            change = apart
            words = (
                f"{candidate.row.name}, {candidate.formulation}, step {self.runner.grid.row / level['per_row']:.3g} s"
            )
            if order < LOW_ORDER:
                here, words = _extrapolate(here, before, order), f"{words}, extrapolated"
            best = ReferenceSolution(here, words, candidate.family, apart)
            if apart < self.settled:
                break
        return best, said or took_longer(self.seconds)


def refine(
    run: Callable[[dict[str, Any]], ComparedRun], levels: Sequence[dict[str, Any]], seconds: float, growth: float
) -> Iterator[tuple[dict[str, Any], ComparedRun, Observation | None]]:
    """Yield the levels of refinement of one method, each with its run and the observation of the run before, which is
    None behind a run that is no reference. Ends before a run that would exceed the seconds, if each takes ``growth``
    times as long as the one before."""
    began, before = time.process_time(), None
    for level in levels:
        outcome = run(level)
        yield level, outcome, before
        before = outcome.reference
        if time.process_time() - began + growth * outcome.seconds > seconds:
            break


def took_longer(seconds: float) -> str:
    """Return the reason for a method without a reference, all runs of which reached the end."""
    return f"two runs, one at half the step or a smaller tolerance, take longer than {seconds:.2g} s"


def _largest_error(apart: Mapping[str, ErrorSize]) -> float:
    """Return the largest error of the state, or of the outputs if runs have no coordinates in common."""
    return apart[STATE].largest if STATE in apart else max((size.largest for size in apart.values()), default=0.0)


def _extrapolate(fine: Observation, coarse: Observation, order: int) -> Observation:
    """Return the extrapolation to step zero of runs with half the step and with the step, for a method of an order.
    Quaternions are brought to unit length."""
    weight = 1.0 / (2.0**order - 1.0)
    arrays = {name: fine.arrays[name] + weight * (fine.arrays[name] - coarse.arrays[name]) for name in fine.arrays}
    for factor in fine.factors:
        if factor.group != "R":
            part = slice(factor.q_start, factor.q_start + 4)
            arrays["q"][:, part] /= np.linalg.norm(arrays["q"][:, part], axis=1, keepdims=True)
    for name in [key for key in arrays if key.startswith("poses.")]:
        arrays[name][:, :4] /= np.linalg.norm(arrays[name][:, :4], axis=1, keepdims=True)
    return with_arrays(arrays, fine.components, fine.rows)
