"""Error estimate of a run from the same motion in steps twice and four times as long, or at another tolerance.

If longer steps do not show the method's order, if they fail, or if the runs differ by a tenth of the motion,
extrapolation from longer steps is not valid, and a run at half the step decides. If steps end at samples and jumps,
runs at shorter steps are compared: the first one whose steps all differ from the run's. If the motion crosses jumps of
the forces, errors depend on the place of each jump in its step: two runs whose steps have no common multiple decide.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults
from eomgen.base.data import replace
from eomgen.base.progress import Progress
from eomgen.base.rounding import COMPUTED
from eomgen.errors import UsageError
from eomgen.integrators.families.adaptive import SMALLEST_TOLERANCE
from eomgen.results.error_estimate import NO_ORDER, NOTICED, OTHER_ORDER, ErrorEstimate
from eomgen.simulation.accuracy.comparison_runs import (
    INTERRUPTED,
    AtRows,
    ComparedMotion,
    ComparisonRuns,
    MotionDifference,
    NoEstimateError,
    RecordedRun,
)
from eomgen.simulation.accuracy.fastest_rates import FastestRates
from eomgen.simulation.accuracy.motion_size import motion_size, shares
from eomgen.simulation.accuracy.richardson import (
    Pair,
    estimate,
    gain_by,
    gain_of,
    keep_order,
)
from eomgen.simulation.accuracy.step_path import crosses_jumps, step_rows
from eomgen.simulation.stepping.run import Run

#: Steps of a run below which comparison runs in longer steps give no estimate.
_FEW_STEPS = 16
#: Fractions of the step for runs that cross jumps of forces, with errors of order 1: a run at half the step meets every
#: second jump at the same place in a step.
_PRIME_PARTS = (3, 5)
#: Powers of 1/2 of the step that are tried for runs of one step, or of steps that were halved.
_QUARTERS = (2, 4)
#: Ratio of the parts of steps that a run at shorter steps may take to the parts of the run itself.
_MOST_PARTS = 16.0
_HALF = "runs at half and 2 times the step"
#: Powers of the smaller tolerance, tried in turn if jumps, samples and rows of inputs bound steps.
_SMALLER = (1, 4, 8)


def estimate_errors(
    taken: RecordedRun,
    seconds: float,
    at_rows: AtRows,
    rates: Callable[[], FastestRates],
    progress: Progress | None = None,
    *,
    interrupted: bool,
) -> ErrorEstimate:
    """Return the estimated discretisation error of a finished run, by runs of the same motion at other steps or
    tolerances.

    No error is raised: an estimate that cannot be made has ``available`` False and the reason.

    Parameters
    ----------
    taken : the run
    seconds : s, duration of the run
    at_rows : outputs and energy of the run at all rows
    rates : returns the fastest rates along the run
    progress : called with (steps done, all steps), the steps of the comparison runs included
    interrupted : whether the run was
    """
    began, run = time.perf_counter(), taken.run
    try:
        if interrupted:
            raise NoEstimateError("the run was interrupted")
        if len(taken.rows) < 2:
            raise NoEstimateError("the run made no step")
        if run.controllers is not None and (names := run.controllers.single):
            refused = f"the function of {names} may keep something, so no second run calls it"
            raise NoEstimateError(f"{refused}; a class, or memory in the scene, can be had anew")
        runs = ComparisonRuns(taken, progress, at_rows)
        estimated = _by_tolerance if run.method.chooses_steps else partial(_by_steps, rates=rates)
        result = estimated(runs)
        if result.relative > NOTICED and _moves_between_rows(runs):
            result = estimated(runs)
    except NoEstimateError as reason:
        return replace(no_estimate(run, str(reason)), remedy=reason.remedy)
    except UsageError as error:  # a function of the caller that fails in a comparison run
        return no_estimate(run, str(error.problems[0]))
    except KeyboardInterrupt:  # the rows of the run itself are kept
        return no_estimate(run, INTERRUPTED)
    spent = time.perf_counter() - began
    return replace(result, seconds=spent, cost=spent / max(seconds, 1e-9))


def _moves_between_rows(runs: ComparisonRuns) -> bool:
    """Return whether the motion is much larger than sparse rows show; then replace ``runs.size`` by the size from the
    rows of all steps. A state that oscillates at a multiple of the rows' frequency seems to be at rest there."""
    run, library, rows, parameters, _, statistics = runs.taken
    taken = step_rows(run, library, rows, parameters, statistics)
    if taken is None or taken.rows is rows:
        return False
    finer = motion_size(run.model, np.concatenate([rows, taken.rows]), {})
    known = runs.size.sizes
    larger = {kind: np.fmax(known[kind], size) for kind, size in finer.sizes.items() if np.all(np.isfinite(size))}
    if not any(np.any(size > 2.0 * known[kind]) for kind, size in larger.items()):
        return False
    runs.size = replace(finer, sizes=known | larger)
    return True


def no_estimate(run: Run, reason: str = "it was switched off") -> ErrorEstimate:
    """Return the placeholder of an error estimate that was not made, with the reason."""
    model = run.model
    return ErrorEstimate.missing(reason, model.nq, model.nv, model.nz, len(model.multipliers))


def _by_tolerance(runs: ComparisonRuns) -> ErrorEstimate:
    """Estimate errors by a run at a smaller tolerance, or at a larger one if no smaller tolerance can be taken.

    Errors follow tolerances only roughly: at a corner, or with few steps, a tenth of the tolerance makes from a
    hundredth of the error to twice as much. So the run at the smaller tolerance is taken, though its cost is higher.
    The time grid is refined as well: the first steps follow from the grid. With the same grid, both tolerances would
    have the same first steps if no force acts yet, and both runs would meet a narrow barrier at the same place. If
    steps are as long as rounding allows, they do not follow the tolerance, but their errors grow with the motion: so
    the longest steps are bounded as the tolerances would have them. Events
    are looked for on the grid, and rows of inputs, between which inputs are curves of low order, lie on the grid.
    Without events and such rows the grid stays if steps end at jumps or samples: a halved grid could halve these steps,
    and both runs would differ by more than the tolerances explain.
    """
    bound = bool(len(runs.parts.ends)) or runs.run.driven is not None
    for power, multiple in _tolerance_tries(runs, bound=bound):
        tolerance = runs.run.settings["tolerance"] * math.pow(2.0, power)
        longest = runs.own.statistics.get("largest_step", math.inf) if power < 0.0 else math.inf
        largest = math.pow(2.0, power / float(runs.run.method.order)) * longest
        result = runs.at(tolerance=tolerance, multiple=multiple, largest=largest)
        if not _is_complete(result):
            continue
        apart = runs.apart(runs.own, result)
        if multiple >= 0.5 and runs.same(apart) and (bound or runs.same_count(result)):
            continue
        part = "half" if multiple == 0.5 else f"1/{1.0 / multiple:.0f} of"
        shorter = f" and {part} the step" if multiple < 1.0 else ""
        pair = Pair(apart, partial(_fixed_gain, gain_of(power)), f"a run at a tolerance of {tolerance:.2g}{shorter}")
        return replace(estimate(runs, pair, math.nan), passed_over=_passed_over(runs, result))
    if result.stopped:
        raise NoEstimateError(f"runs at other tolerances do not come to the end: {result.stopped}")
    same = "of runs at other tolerances are the same ones"
    if bound:
        ends = "its steps end where forces jump, states are sampled or rows of inputs end"
        raise NoEstimateError(f"{ends}, and those {same}")
    remedy = f"largest_step = {0.25 * _largest_step(runs):.2g} in the settings"
    raise NoEstimateError(f"the steps {same}", remedy)


def _tolerance_tries(runs: ComparisonRuns, *, bound: bool) -> list[tuple[float, float]]:
    """Return the comparison runs to try in turn: power of 2 of the tolerance, and multiple of the step."""
    # a tenth of the tolerance; for methods of low order, 2 to the power of the order
    order = min(float(runs.run.method.order), math.log2(10.0))
    multiple = 1.0 if len(runs.parts.ends) and not runs.events and runs.run.driven is None else 0.5
    first, *smaller = (-order * times for times in _SMALLER[: None if bound else 1])
    tolerance = runs.run.settings["tolerance"]
    smaller = [power for power in smaller if tolerance * math.pow(2.0, power) >= SMALLEST_TOLERANCE]
    tries = [(power, multiple) for power in (first, *smaller)]
    if shortened := _that_bounds(runs, bound=bound):
        tries.append((-order, shortened))
    return [*tries, (order, multiple)]


def _that_bounds(runs: ComparisonRuns, *, bound: bool) -> float:
    """Return the multiple of the step for a comparison run whose longest adaptive step is shorter than the intervals
    between jumps, samples or input rows, or without such bounds shorter than the run's own steps; 0 if the run would
    need too many steps. `bound` says whether there are jumps, samples or input rows."""
    part = runs.step if runs.run.driven else (runs.parts.end - runs.parts.start) / (len(runs.parts.ends) + 1)
    if not bound:
        part = _largest_step(runs)
        if part > 0.5 * runs.run.settings.get("largest_step", math.inf) > 0.0:
            return 0.25
    multiple = min(0.25, part / (512.0 * runs.step))  # shorter than half of any step of a method's own
    return multiple if runs.span.steps / multiple <= 1e6 else 0.0


def _largest_step(runs: ComparisonRuns) -> float:
    """Return the largest step of the method, s; if steps are not counted, the step of the grid."""
    return float(runs.own.statistics.get("largest_step", runs.step))


def _fixed_gain(gain: float, order: float) -> Array:
    return np.full((1, 1), gain)


def _by_steps(runs: ComparisonRuns, rates: Callable[[], FastestRates]) -> ErrorEstimate:
    """Return the estimate from runs at 2 and 4 times the step, and from shorter steps if these do not suffice. `rates`
    returns the fastest rates along the run. Raises NoEstimateError if the runs give no
    estimate."""
    order = float(runs.run.method.order)
    if runs.span.steps == 1 or (runs.own.statistics.get("halvings", 0) and runs.span.steps < _FEW_STEPS):
        return _by_much_shorter_steps(runs, order)
    if not (runs.tell(1.0, 2.0) and runs.tell(2.0, 4.0) and runs.tell(0.5, 1.0)):
        return _by_shorter_steps(runs, order)
    twice = runs.at(multiple=2.0)
    jumps, resolved = _laws_within_steps(runs, rates)
    if jumps and (result := _by_prime_parts(runs)):
        return result
    result, near, far, suffices = _by_longer_steps(runs, twice, order, resolved=resolved)
    if result is not None and suffices:
        return result
    stopped = twice.stopped
    del twice  # large scenes have large motions
    half = _comparison(runs, 0.5)
    if not half.complete:
        # only a run that explodes has such an error
        if result is None or not result.relative < 10.0:
            reason = f"runs neither at twice nor at half the step hold: {stopped or half.stopped}"
            raise NoEstimateError(reason, _smaller(runs))
        return result
    rounding = runs.single and result is not None and result.order < NO_ORDER
    del result  # large scenes have large motions
    if half.equal:
        return _by_much_shorter_steps(runs, order)
    if rounding:  # which grows towards shorter steps, and of which two runs may have as much
        both = _largest_of([(near, 1.0), (half.apart, 1.0)])
        pair = Pair(both, partial(_fixed_gain, 1.0), _HALF, near, far, _refinement(runs, (1, 2, 4)))
    else:
        pair = _shorter_pair(runs, half.apart, near, order)
    result = replace(estimate(runs, pair, order), passed_over=half.passed_over)
    return result if resolved else _with_first_rows(runs, result, order)


def _shorter_pair(runs: ComparisonRuns, apart: MotionDifference, near: MotionDifference, order: float) -> Pair:
    """Return the pair of the run and a run at half the step; if that one may be as far off as the run, since it does
    not show the method's order either, the pair of the run and a run at a quarter."""
    pair = Pair(apart, gain_by(runs.ratio(0.5, apart.t)), _HALF, apart, near, _refinement(runs, (0.5, 1, 2)))
    if keep_order(runs, apart, near, order, pair.refinement) or not (quarter := _comparison(runs, 0.25)).complete:
        return pair
    gain = gain_by(runs.ratio(0.25, quarter.apart.t))
    return pair._replace(apart=quarter.apart, gain=gain, words="runs at a quarter, half and 2 times the step")


def _by_longer_steps(
    runs: ComparisonRuns, twice: ComparedMotion, order: float, *, resolved: bool
) -> tuple[ErrorEstimate | None, MotionDifference, MotionDifference | None, bool]:
    """Return the estimate by runs at 2 and 4 times the step, differences between h and 2h and between 2h and 4h, and
    whether the estimate suffices.

    Parameters
    ----------
    resolved : whether steps four times as long resolve decays; otherwise no run takes these
    """
    four = runs.at(multiple=4.0) if resolved and not twice.stopped else None
    near = runs.apart(runs.own, twice)
    if len(twice.rows) < 2:
        return None, near, None, False
    far = None if four is None else runs.apart(twice, four)
    words = "a run at twice the step" if four is None else "runs at 2 and 4 times the step"
    pair = Pair(near, gain_by(runs.ratio(2.0, near.t)), words, near, far, _refinement(runs, (1, 2, 4)))
    result = estimate(runs, pair, order)
    agree = four is not None and not four.stopped and not _passed_over(runs, twice)
    return result, near, far, agree and far is not None and not _doubtful(runs, result, near, far)


def _is_complete(motion: ComparedMotion) -> bool:
    """Return whether a run came to the end."""
    return len(motion.rows) > 1 and not motion.stopped


class _Comparison(NamedTuple):
    """Comparison with a run at another step, without its motion: large scenes have large motions.

    Attributes
    ----------
    apart : how the motions differ
    complete : whether that run came to the end
    stopped : reason for an early end
    equal : whether steps were halved, and both runs are the same one
    passed_over : as of ``ErrorEstimate``
    """

    apart: MotionDifference
    complete: bool
    stopped: str
    equal: bool
    passed_over: str


def _comparison(runs: ComparisonRuns, multiple: float) -> _Comparison:
    """Return the comparison with a run at a multiple of the step."""
    motion = runs.at(multiple=multiple)
    apart = runs.apart(runs.own, motion)
    halved = runs.own.statistics.get("halvings", 0) or motion.statistics.get("halvings", 0)
    equal = bool(halved) and runs.same(apart)
    return _Comparison(apart, _is_complete(motion), motion.stopped, equal, _passed_over(runs, motion))


def _laws_within_steps(runs: ComparisonRuns, rates: Callable[[], FastestRates]) -> tuple[bool, bool]:
    """Return whether the motion crosses jumps of forces, and whether steps four times as long resolve the fastest
    decay."""
    sizes = np.concatenate([runs.size.sizes["increment"], runs.size.sizes["z"]])
    jumps = not runs.size.still and crosses_jumps(runs.run, runs.span.rows, runs.span.parameters, sizes)
    decay, _, passed, states = rates()
    # above, steps four times as long leave out the decay: explicit methods of order 2 are stable up to 2
    return jumps or passed.rate * runs.step > 1.0, max(decay.rate, states.rate) * runs.step < 0.5


def _with_first_rows(runs: ComparisonRuns, result: ErrorEstimate, order: float) -> ErrorEstimate:
    """Return an estimate of all rows with errors of the run's first rows put in front, from a run at half the step.
    Errors that decay soon after the start are missing in `result`, whose compared rows are sparse. The largest
    errors are taken over both. `order` is the method's order. `result` is returned if the run at half the step
    stops."""
    first = runs.beginning(8)
    shorter = first.at(multiple=0.5)
    difference = first.apart(first.own, shorter)
    if shorter.stopped or not len(difference.t):
        return result
    start = estimate(first, Pair(difference, gain_by(first.ratio(0.5, difference.t)), result.method), order)
    later = result.t > start.t[-1]
    rows = ("t", "q_at", "increment_at", "v_at", "z_at", "multipliers_at", "relative_at")
    joined: dict[str, Any] = {
        name: np.concatenate([getattr(start, name), getattr(result, name)[later]]) for name in rows
    }
    outputs = {name: np.concatenate([start.outputs_at[name], item[later]]) for name, item in result.outputs_at.items()}
    largest: dict[str, Any] = {}
    for name in ("largest", "largest_velocity", "largest_output"):
        errors = [item for item in (getattr(start, name), getattr(result, name)) if item is not None]
        largest[name] = max(errors, key=lambda item: item.share, default=None)
    relative = max(start.relative, result.relative)
    return replace(result, **joined, **largest, relative=relative, outputs_at=NamedResults("output", outputs))


def _by_prime_parts(runs: ComparisonRuns) -> ErrorEstimate | None:
    """Estimate errors as the larger of the estimates by runs at a third and a fifth of the step; None if one of these
    does not hold.

    The error of a step that crosses a jump of a force is of first order, with a factor that depends on the place of the
    jump in the step. Two runs may agree by chance, most often if the steps of one run are multiples of the steps of the
    other run.
    """
    order = float(runs.run.method.order)
    shorter = [runs.at(multiple=1.0 / parts) for parts in _PRIME_PARTS]
    if not all(map(_is_complete, shorter)):
        return None
    gains = [gain_of(-math.log2(parts)) for parts in _PRIME_PARTS]
    differing = [(runs.apart(runs.own, motion), gain) for motion, gain in zip(shorter, gains, strict=True)]
    words = f"runs at {' and '.join(f'1/{parts}' for parts in _PRIME_PARTS)} of the step"
    far, near = differing[-2][0], runs.apart(*shorter)
    refinement = _refinement(runs, (1.0 / _PRIME_PARTS[1], 1.0 / _PRIME_PARTS[0], 1.0))
    pair = Pair(_largest_of(differing), partial(_fixed_gain, 1.0), words, near, far, refinement)
    return replace(estimate(runs, pair, order), passed_over=_passed_over(runs, shorter[-1]))


def _largest_of(differing: Sequence[tuple[MotionDifference, float]]) -> MotionDifference:
    """Return the largest, entry by entry, of differences times their factors. The last pair must cover all rows: its
    times are the times of the result."""
    last, gain = differing[-1]
    kinds = {kind: gain * values for kind, values in last.kinds.items()}
    for difference, factor in differing[:-1]:
        places = np.searchsorted(last.t, difference.t)
        common = (places < len(last.t)) & np.isin(difference.t, last.t)
        for kind, values in difference.kinds.items():
            kinds[kind][places[common]] = np.maximum(kinds[kind][places[common]], factor * values[common])
    return MotionDifference(last.t, kinds)


def _smaller(runs: ComparisonRuns) -> str:
    return f"a step smaller than {0.25 * runs.step:.2g} s"


def _by_much_shorter_steps(runs: ComparisonRuns, order: float) -> ErrorEstimate:
    """Estimate errors by a run at a quarter of the step, or at the largest smaller fraction that takes different steps.

    For a run of a single step, which has no longer steps, and for a run whose steps were all halved, which equals the
    run at half the step.
    """
    for power in _QUARTERS:
        multiple = math.pow(0.5, power)
        shorter = _comparison(runs, multiple)
        words = f"a run at 1/{1.0 / multiple:.0f} of the step"
        if not shorter.complete:
            raise NoEstimateError(f"{words} does not hold: {shorter.stopped}", _smaller(runs))
        if not shorter.equal:
            gain = gain_by(np.full(len(shorter.apart.t), 2.0 * multiple))
            return replace(estimate(runs, Pair(shorter.apart, gain, words), order), passed_over=shorter.passed_over)
    least = f"1/{math.pow(2.0, _QUARTERS[-1]):.0f} of the step"
    raise NoEstimateError(f"its steps were halved, and runs at up to {least} are the same run", _smaller(runs))


def _by_shorter_steps(runs: ComparisonRuns, order: float) -> ErrorEstimate:
    """Estimate errors by the first run whose parts of steps are all shorter, if steps end at events or samples.

    If the error matters, the next shorter run shows the order.
    """
    multiple = 0.5
    while not runs.tell(multiple, 1.0):
        multiple *= 0.5
        if runs.parts.count(multiple * runs.step) > _MOST_PARTS * runs.parts.count(runs.step):
            refused = f"runs in shorter steps that differ from it all over take {_MOST_PARTS:.0f} times as many"
            raise NoEstimateError(f"its steps end where forces jump or states are sampled; {refused}")
    shorter = runs.at(multiple=multiple)
    if not _is_complete(shorter):
        raise NoEstimateError(f"a run at 1/{1.0 / multiple:.0f} of the step does not hold: {shorter.stopped}")
    apart = runs.apart(runs.own, shorter)
    words = f"a run at 1/{1.0 / multiple:.0f} of the step"
    passed_over = _passed_over(runs, shorter)
    result = estimate(runs, Pair(apart, gain_by(runs.ratio(multiple, apart.t)), words), order)
    of_outputs = 0.0 if result.largest_output is None else result.largest_output.share
    if max(result.relative, of_outputs) > NOTICED and runs.tell(0.5 * multiple, multiple):
        finest = runs.at(multiple=0.5 * multiple)
        if _is_complete(finest):
            near, best = runs.apart(shorter, finest), runs.apart(runs.own, finest)
            words = f"runs at 1/{1.0 / multiple:.0f} and 1/{2.0 / multiple:.0f} of the step"
            refinement = _refinement(runs, (0.5 * multiple, multiple, 1.0))
            pair = Pair(best, gain_by(runs.ratio(0.5 * multiple, best.t)), words, near, apart, refinement)
            result = estimate(runs, pair, order)
    return replace(result, passed_over=passed_over)


def _refinement(runs: ComparisonRuns, multiples: tuple[float, float, float]) -> float:
    """Return the ratio of steps by which the differences between three runs show an order: 2 if steps are doubled.
    `multiples` are the steps of the three runs as multiples of the run's step, increasing. If parts of steps grow by
    other ratios r and s, the differences grow by r^p (s^p - 1) / (r^p - 1)."""
    order = float(runs.run.method.order)
    end = np.array([runs.parts.end])
    first, second, third = (float(runs.ratio(multiple, end)[0]) ** order for multiple in multiples)
    return float(((third - second) / (second - first)) ** (1.0 / order))


def _passed_over(runs: ComparisonRuns, motion: ComparedMotion) -> str:
    """Return a sentence on the first event that another run counts differently; empty if all counts agree, and for
    resumed runs, whose counts include earlier events. An event near the end of the run may be in only one of the two
    runs, because of errors as large as the differences of the times of common events. Events that are only counted have
    no times: a difference of one does not matter."""
    ours, theirs = runs.own.events, motion.events
    if ours is None or theirs is None or runs.span.rows[0, 0] > runs.run.grid.start:
        return ""
    times = {name: (ours[name].t, theirs[name].t) for name in ours.counts}
    shifts = [np.abs(a[: len(b)] - b[: len(a)]).max(initial=0.0) for a, b in times.values()]
    # an event near the end may differ by more than others
    end = runs.end - max(runs.step, 2.0 * max(shifts, default=0.0))
    for name, count in ours.counts.items():
        a, b = times[name]
        listed = len(a) == count
        more = (a if len(a) > len(b) else b)[min(len(a), len(b)) :]
        if np.any(more < end) if listed else abs(count - theirs.counts[name]) > 1:
            pair = (len(a), len(b)) if listed else (count, theirs.counts[name])
            return f"the event {name} comes {pair[0]} times, and {pair[1]} times in shorter steps"
    return ""


def _doubtful(runs: ComparisonRuns, result: ErrorEstimate, near: MotionDifference, far: MotionDifference) -> bool:
    """Return whether runs with longer steps do not suffice for an estimate, because there are few steps, fast turns,
    another order, or large differences `near`. An angle that turns by more than half a turn within a
    step is sampled in the same way by longer steps."""
    if runs.span.steps < _FEW_STEPS or result.t[-1] < runs.end or runs.turn > math.pi:
        return True
    if result.relative > COMPUTED:
        other_order = abs(result.order - result.declared_order) > OTHER_ORDER
        if other_order or not keep_order(runs, near, far, result.declared_order, _refinement(runs, (1, 2, 4))):
            return True
    return float(shares(near.kinds, runs.size).max(initial=0.0)) > 0.1
