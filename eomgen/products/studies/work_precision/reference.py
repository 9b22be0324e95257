"""The reference of a study: two runs by different methods at tight tolerances; their difference is its uncertainty."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
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
    with_arrays,
)
from eomgen.products.studies.work_precision.running import Runner

#: Tolerances of methods with adaptive steps, as references.
TIGHT = (1e-15, 1e-13)
#: Methods of a lower order come last; with fixed steps, their results are extrapolated.
LOW_ORDER = 4
#: Two references that differ by more than this are none.
LARGEST_UNCERTAINTY = 0.01


@dataclass(frozen=True)
class RefinedRun:
    """The most accurate run of a method that can be afforded.

    Attributes
    ----------
    described : method, formulation and step or tolerance, in words
    apart : difference from the run at half the step, or at another tolerance, by quantity
    error : of these the one that counts
    level : step or tolerance, as an argument of ``Runner.run``
    """

    candidate: Candidate
    observation: Observation
    described: str
    apart: Mapping[str, ErrorSize]
    error: float
    level: Mapping[str, Any]


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
        result = errors(observation, self.observation)
        for name in result.keys() & self.uncertainty.keys():
            result[name] = ErrorSize(*map(max, vars(result[name]).values(), vars(self.uncertainty[name]).values()))
        return result

    def to_dict(self) -> dict[str, Any]:
        return {
            "by": self.described,
            "held against": self.second,
            "uncertainty": {name: dict(vars(size)) for name, size in self.uncertainty.items()},
        }


def reference(
    runner: Runner, candidates: Sequence[Candidate], seconds: float, say: Callable[[str], None]
) -> RunReference:
    """Return the reference of a study.

    Of the methods from order 4 on, methods with adaptive steps come first, then the highest orders; of formulations,
    those without constraints. The second run is by a method of another family.

    Parameters
    ----------
    runner, candidates : runs configurations; methods on formulations that may serve
    seconds : that both may take
    say : called with a word on the present work

    Raises
    ------
    NumericalError
        There are no two that agree to a hundredth.
    """
    solved, tried = list[RefinedRun](), list[str]()
    for candidate in sorted(candidates, key=lambda c: rank(runner, c)):
        if any(candidate.family is known.candidate.family for known in solved):
            continue
        say(f"reference: {candidate.row.name}, {candidate.formulation}")
        levels, limit = [{"per_row": 2.0**k} for k in range(3, 17)], 0.5 * seconds
        if candidate.method.chooses_steps:
            known = {x for x in (*TIGHT, *candidate.tolerances) if possible(candidate.row.name, {TOLERANCE: x})}
            levels, limit = [{TOLERANCE: x} for x in sorted(known)[1::-1]], math.inf
        solution, why = refine(runner, candidate, levels, limit, 1e-13, _largest_error, rounding=1e-6)
        if solution is None:
            tried.append(f"{candidate.row.name} on {candidate.formulation}: {why}")
            continue
        solved.append(solution)
        if len(solved) == 2:
            break
    if not solved:
        raise no_reference(tried)
    first = solved[0]
    check_moves(runner, first.observation)
    if len(solved) == 1:
        hold(f"{first.described} and the same at half its accuracy", first.error)
        return RunReference(first.observation, first.described, "itself at half its accuracy", first.apart)
    apart = errors(solved[1].observation, first.observation)
    hold(f"{first.described} and {solved[1].described}", _largest_error(apart))
    return RunReference(first.observation, first.described, solved[1].described, apart)


def refine(
    runner: Runner,
    candidate: Candidate,
    levels: Sequence[Mapping[str, Any]],
    seconds: float,
    enough: float,
    measure: Callable[[Mapping[str, ErrorSize]], float],
    *,
    rounding: float = math.inf,
    **conditions: Any,
) -> tuple[RefinedRun | None, str]:
    """Return the motion by one method, refined until two levels agree, and an empty text; the best so far if accuracy
    ends or time runs out; None, with the reason, if the method fails.

    Parameters
    ----------
    levels : steps in a row of the grid, or tolerances, from coarse to fine, as arguments of ``Runner.run``
    seconds : of the processor, that the method may take
    enough : difference of two levels at which the refinement ends
    measure : returns the difference that counts
    rounding : below this a difference that hardly falls ends the refinement; results of methods of low order are
        extrapolated to step zero if it is given
    conditions : other arguments of ``Runner.run``
    """
    configuration, method = candidate.configuration({}), candidate.method
    try:
        runner.prepare(configuration)  # building takes none of the effort
    except EomgenError as error:
        return None, reason(error)
    began, why, before, best = time.process_time(), took_longer(seconds), None, None
    for level in levels:
        outcome = runner.run(configuration, **level, dense=True, timed=False, estimated=False, **conditions)
        here = outcome.reference
        if here is None:
            why = outcome.unresolved or outcome.said
            if method.chooses_steps or best is not None:
                break
        elif before is not None:
            apart = errors(before, here)
            size = measure(apart)
            if best is not None and 0.7 * best.error < size < rounding:  # rounding, or corners, have the word
                break
            words = f"{candidate.row.name}, {candidate.formulation}, {_words(level, runner.grid.row)}"
            result = here
            if rounding < math.inf and not method.chooses_steps and method.order < LOW_ORDER:
                result, words = _extrapolate(here, before, method.order), f"{words}, extrapolated"
            best = RefinedRun(candidate, result, words, apart, size, level)
            if size <= enough:
                break
        before = here
        if time.process_time() - began + (3.0 if method.chooses_steps else 2.0) * outcome.seconds > seconds:
            break
    return best, why


def _words(level: Mapping[str, Any], row: float) -> str:
    return f"tolerance {level[TOLERANCE]:.3g}" if TOLERANCE in level else f"step {row / level['per_row']:.3g} s"


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
