"""Error estimate of a run from the same motion in steps twice and four times as long, or at another tolerance.

Richardson: where x_h - x = C h^p + higher powers, x_2h - x_h = (2^p - 1) (x_h - x), and the ratio of x_4h - x_2h to
x_2h - x_h tells whether p is the method's (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I
(1993), section II.4). Where it is not, where longer steps do not hold, or where the runs differ by a tenth of the
motion, powers of the step tell nothing of longer ones, and a run at half the step decides. Where steps end at samples
and jumps, runs at shorter steps are asked, the first that is another run all over.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.arrays import Array
from eomgen.calls import ByName
from eomgen.errors import UsageError
from eomgen.progress import Progress
from eomgen.results.error_estimate import NOTICED, OWN, ErrorEstimate, Largest
from eomgen.results.events import Events
from eomgen.simulation.comparison_runs import SAME_TIME, comparison_run, counted, span_of
from eomgen.simulation.events import acting
from eomgen.simulation.motion_size import Kinds, MotionSize, differences, motion_size, shares
from eomgen.simulation.run import Run
from eomgen.simulation.step_parts import step_parts
from eomgen.simulation.stepper import Trajectory
from eomgen.toolchain.library import Library

#: Differences above this part of the motion are too large to follow powers of the step.
_SATURATED = 0.1
#: Part of the motion by which runs at h and 2h may differ before a run at half the step is made as well.
_DOUBTFUL = 0.1
#: Steps of a run below which comparison runs in longer steps tell nothing.
_FEW_STEPS = 16
#: How far the observed order may be from the method's, unless the error is a negligible part of the motion.
_OTHER_ORDER, _NEGLIGIBLE = 0.75, 1e-10
#: Part of the motion that no error reaches but one of a run that explodes.
_EXPLODED = 10.0
#: What errors are a part of where a component hardly moves, and of outputs.
SMALL, RANGE = "{least}, the least that counts as its motion", "its range"
NONE = "its motion, which is none"
FASTEST = "the largest velocity in {unit}"
OWN_FASTEST, SMALL_RATE = "its largest", "{least}, the least that counts as its rate"
_INTERRUPTED = "the runs that it is made from were interrupted"
#: Part of a step within which a row is at an event.
_AT_EVENT = 1e-9
#: Differences that are rounding, in last places.
_ROUNDING = 1e3
#: How many times later or earlier an event near the end may come than others do in two runs.
_LATER = 2.0
#: How many times smaller the tolerance of a comparison run is; of methods of low order 2 to their order.
_TOLERANCES = 10.0
#: How many times as many parts of steps as the run itself a run at shorter steps may take.
_MOST_PARTS = 16.0
#: Powers of the smaller tolerance, asked in turn where jumps, samples and rows of inputs bound steps, and the least
#: tolerance: rounding.
_SMALLER, _LEAST_TOLERANCE = (1, 4, 8), 1e-14
#: Steps of the time grid that are shorter than half of any step of a method's own, and how many of them are taken.
_OWN_STEPS, _MOST_STEPS = 512.0, 1_000_000


class _NoEstimateError(Exception):
    """There is no estimate, and why."""


@dataclass(frozen=True)
class ErrorEstimation:
    """Estimation of the discretisation error of runs.

    Parameters
    ----------
    progress : called with (steps done, all steps), those of the comparison runs among them
    """

    progress: Progress | None = None

    def shown(self, run: Run, steps: int) -> Progress | None:
        """Return what reports the progress of the run itself, so many steps of which are left."""
        more = _planned(run, steps)
        return counted(self.progress, 0, run.grid.steps + more)

    def of(
        self,
        run: Run,
        library: Library,
        trajectory: Trajectory,
        parameters: Array,
        seconds: float,
        events: Events | None = None,
    ) -> ErrorEstimate:
        """Return the estimate for a run with parameters (np,), or (rows, np), and events, that took so many seconds."""
        began = time.perf_counter()
        try:
            if trajectory.interrupted:
                raise _NoEstimateError("the run was interrupted")
            if len(trajectory.rows) < 2:
                raise _NoEstimateError("the run made no step")
            if run.controllers is not None and (names := run.controllers.single):
                what = f"the function of {names} may keep something, so no second run calls it"
                raise _NoEstimateError(f"{what}; a class, or memory in the scene, can be had anew")
            runs = _Comparisons(run, library, trajectory.rows, parameters, self.progress, events)
            found = _by_tolerance(runs) if run.method.chooses_steps else _by_steps(runs)
        except _NoEstimateError as reason:
            return no_estimate(run, str(reason))
        except UsageError as error:  # a function of the caller that fails where it is asked again
            return no_estimate(run, str(error.problems[0]))
        except KeyboardInterrupt:  # what the run came to is kept
            return no_estimate(run, _INTERRUPTED)
        spent = time.perf_counter() - began
        return replace(found, seconds=spent, cost=spent / max(seconds, 1e-9))


def no_estimate(run: Run, reason: str = "it was switched off") -> ErrorEstimate:
    """Return what stands in the place of an estimate that there is none of."""
    model = run.model
    return ErrorEstimate.missing(reason, model.nq, model.nv, model.nz, len(model.multipliers))


def _planned(run: Run, steps: int) -> int:
    """Return how many steps comparison runs are expected to take."""
    return steps if run.method.chooses_steps else math.ceil(steps / 2) + math.ceil(steps / 4)


class _Motion(NamedTuple):
    """Rows (n, width) of a run, and the outputs there; why it came no further than its last row; its events, and the
    times of those that changed the motion, s."""

    rows: Array
    outputs: Mapping[str, Array]
    stopped: str = ""
    events: Events | None = None
    changes: Array = np.empty(0)

    def at(self, places: NDArray[np.intp]) -> _Motion:
        return self._replace(rows=self.rows[places], outputs={name: one[places] for name, one in self.outputs.items()})


class _Apart(NamedTuple):
    """How two motions differ, by kind, at times (n,) that both have rows at."""

    t: Array
    kinds: Kinds


class _Comparisons:
    """Comparison runs of one run, and how far motions are apart."""

    def __init__(
        self,
        run: Run,
        library: Library,
        rows: Array,
        parameters: Array,
        progress: Progress | None,
        events: Events | None,
    ) -> None:
        self.run, self._library, self._progress = run, library, progress
        self.events = "events" in library.layout["method"]
        self.span = span_of(run, rows, parameters)
        self.own = self._motion(self.span.rows, self.span.parameters, events)
        self.size: MotionSize = motion_size(run.model, rows, self.own.outputs)
        begin, end = (float(t) for t in self.span.rows[[0, -1], 0])
        self.parts = step_parts(library.layout["method"], begin, end, float(run.method.order), self.own.changes)
        self._steps = run.grid.steps
        self._all = self._steps + _planned(run, self.span.steps)

    @property
    def end(self) -> float:
        """The time of the last row, s, less what the times of rows may differ by."""
        return float(self.own.rows[-1, 0]) - self._same

    @property
    def turn(self) -> float:
        """The largest turn within a step of the run, rad."""
        model = self.run.model
        columns = [1 + model.nq + k for k, unit in enumerate(model.v_units) if unit == "rad/s"]
        with np.errstate(all="ignore"):
            fastest = float(np.max(np.abs(self.own.rows[:, columns]), initial=0.0))
        return fastest * self.step

    @property
    def step(self) -> float:
        """Of the run's time grid, s, or the span that is compared where that is shorter."""
        return min(self.run.settings["step"], float(self.span.rows[-1, 0] - self.span.rows[0, 0]))

    @property
    def _same(self) -> float:
        return SAME_TIME * self.step

    def at(self, *, multiple: float = 1.0, tolerance: float | None = None) -> _Motion:
        """Return the motion with another step or tolerance. Raises _NoEstimateError where the run was interrupted."""
        before = self._steps
        self._steps += math.ceil(self.span.steps / multiple)
        report = counted(self._progress, before, max(self._all, self._steps))
        found = comparison_run(
            self.run, self._library, self.span, multiple=multiple, tolerance=tolerance, progress=report
        )
        if found.interrupted:
            raise _NoEstimateError(_INTERRUPTED)
        return self._motion(found.rows, found.parameters, found.events)._replace(stopped=found.stopped)

    def tell(self, multiple: float, other: float) -> bool:
        """Return whether runs at two multiples of the step, the second one the larger, are different runs all over."""
        return self.parts.tell(multiple * self.step, other * self.step)

    def ratio(self, multiple: float, times: Array) -> Array:
        """Return by how much the steps of a run at a multiple of the step are longer in effect, up to times (n,) s."""
        return self.parts.ratio(self.step, multiple * self.step, times)

    def apart(self, first: _Motion, second: _Motion) -> _Apart:
        """Return how two motions differ where both have rows.

        Rows at an event that changes the motion are left out: rounding decides on which side of it they lie.
        """
        times = first.rows[:, 0], second.rows[:, 0]
        after = np.searchsorted(times[1], times[0] - self._same)
        found = np.flatnonzero(after < len(times[1]))
        found = found[times[1][after[found]] <= times[0][found] + self._same]
        for changes in (first.changes, second.changes):
            found = found[~_near(times[0][found], changes, _AT_EVENT * self.step)]
        one, other = first.at(found), second.at(after[found])
        with np.errstate(all="ignore"):
            kinds = differences(self.run.model, one.rows, other.rows, (one.outputs, other.outputs))
        for name, values in one.outputs.items():  # where a formula has no value in both, there is no difference
            undefined = ~(np.isfinite(values) | np.isfinite(other.outputs[name]))
            kinds[f"output.{name}"][undefined.reshape(kinds[f"output.{name}"].shape)] = 0.0
        return _Apart(times[0][found], kinds)

    def _motion(self, rows: Array, parameters: Array, events: Events | None) -> _Motion:
        return _Motion(rows, self._outputs(rows, parameters), "", events, acting(events, self._library.layout))

    def _outputs(self, rows: Array, parameters: Array) -> Mapping[str, Array]:
        model, run = self.run.model, self.run
        if "outputs" not in model.functions:
            return {}
        if not len(rows):  # a run that does not get through its first step
            return {name: values[:0] for name, values in self.own.outputs.items()}
        ends = np.cumsum([1, model.nq, model.nv, model.nv, len(model.multipliers)])
        t, q, v, a, multipliers, z = np.split(rows, ends, axis=1)
        held = {"multipliers": multipliers} if model.multipliers else {}
        u = run.signals.rows(t[:, 0]) if run.takes_rows else None
        with np.errstate(all="ignore"):
            return model.outputs(q, v, a, t[:, 0], u, z=z, parameters=parameters, **held)


class _Pair(NamedTuple):
    """Differences between neighbouring runs, and what they tell of the error of the run.

    Attributes
    ----------
    apart : of the run from another one
    gain : from the order to the error of the run as a part of that, (n, 1)
    words : which runs these were
    near, far : differences that tell the order, as |x_2h - x_h| and |x_4h - x_2h|; of tolerances there are none
    refinement : ratio of the steps of neighbouring ones of these runs
    """

    apart: _Apart
    gain: Callable[[float], Array]
    words: str
    near: _Apart | None = None
    far: _Apart | None = None
    refinement: float = 2.0


def _gain(ratio: Array) -> Callable[[float], Array]:
    """Return the gain where the steps of the other run are longer by a ratio, (n,), in effect; shorter below 1."""
    return lambda order: 1.0 / np.abs(np.power(ratio, order) - 1.0)[:, np.newaxis]


def _by_shorter(order: float) -> float:
    return 1.0 / (1.0 - math.pow(2.0, -order))


def _by_longer(order: float) -> float:
    return 1.0 / (math.pow(2.0, order) - 1.0)


def _by_tolerance(runs: _Comparisons) -> ErrorEstimate:
    """Return what a run at a smaller tolerance tells, at a larger one where no smaller one is taken.

    Errors follow tolerances only roughly: where a corner is met, or steps are few, a tenth of the tolerance makes from
    a hundredth of the error to twice as much. So the better run is asked, though it costs more. Events are looked for
    on the grid, which is refined for them as well: those that one step passes over are the error then. So are rows of
    inputs, between which these are curves of low order.
    """
    own = runs.run.settings["tolerance"]
    order = min(float(runs.run.method.order), math.log2(_TOLERANCES))
    bound = bool(len(runs.parts.ends)) or runs.run.driven is not None
    multiple = 0.5 if runs.events or runs.run.driven is not None else 1.0
    tries = [(-order * times, multiple) for times in _SMALLER[: None if bound else 1]]
    tries = [one for one in tries if one == tries[0] or own * math.pow(2.0, one[0]) >= _LEAST_TOLERANCE]
    if bound and (shortened := _that_bounds(runs)):
        tries.append((-order, shortened))
    tries.append((order, multiple))
    found = None
    for power, multiple in tries:
        tolerance = own * math.pow(2.0, power)
        found = runs.at(tolerance=tolerance, multiple=multiple)
        if len(found.rows) > 1 and not found.stopped:
            apart = runs.apart(runs.own, found)
            same = float(shares(apart.kinds, runs.size).max(initial=0.0)) < _floor(runs)
            if bound and same and multiple >= 0.5:
                continue
            shorter = f" and {_part(multiple)} the step" if multiple < 1.0 else ""
            gain = _by_shorter(-power) if power < 0.0 else _by_longer(power)
            pair = _Pair(apart, partial(_known, gain), f"a run at a tolerance of {tolerance:.2g}{shorter}")
            return replace(_estimate(runs, pair, math.nan), passed_over=_passed_over(runs, found))
    if found is not None and not found.stopped:
        where = "where forces jump, states are sampled or rows of inputs end"
        raise _NoEstimateError(f"its steps end {where}, and those of runs at other tolerances are the same ones")
    reason = f": {found.stopped}" if found is not None and found.stopped else ""
    raise _NoEstimateError(f"runs at other tolerances do not come to the end{reason}")


def _that_bounds(runs: _Comparisons) -> float:
    """Return a multiple of the step whose longest own step is shorter than the parts between jumps and samples, or the
    rows of inputs; 0 where that would be too many steps."""
    part = runs.step if runs.run.driven else (runs.parts.end - runs.parts.start) / (len(runs.parts.ends) + 1)
    multiple = min(0.25, part / (_OWN_STEPS * runs.step))
    return multiple if runs.span.steps / multiple <= _MOST_STEPS else 0.0


def _part(multiple: float) -> str:
    return "half" if multiple == 0.5 else f"1/{1.0 / multiple:.0f} of"


def _known(gain: float, order: float) -> Array:
    return np.full((1, 1), gain)


def _by_steps(runs: _Comparisons) -> ErrorEstimate:
    order = float(runs.run.method.order)
    if not (runs.tell(1.0, 2.0) and runs.tell(2.0, 4.0) and runs.tell(0.5, 1.0)):
        return _by_shorter_steps(runs, order)
    twice = runs.at(multiple=2.0)
    four = None if twice.stopped else runs.at(multiple=4.0)
    near = runs.apart(runs.own, twice)
    found = None
    if len(twice.rows) > 1:
        far = None if four is None else runs.apart(twice, four)
        words = "a run at twice the step" if four is None else "runs at 2 and 4 times the step"
        ratio = runs.ratio(2.0, near.t)
        found = _estimate(runs, _Pair(near, _gain(ratio), words, near, far, _refinement(runs, (1, 2, 4))), order)
        same = not _passed_over(runs, twice)
        if four is not None and not four.stopped and same and not _doubtful(runs, found, near):
            return found
    half = runs.at(multiple=0.5)
    if len(half.rows) > 1 and not half.stopped:
        words = "runs at half and 2 times the step"
        apart = runs.apart(runs.own, half)
        pair = _Pair(apart, _gain(runs.ratio(0.5, apart.t)), words, apart, near, _refinement(runs, (0.5, 1, 2)))
        return replace(_estimate(runs, pair, order), passed_over=_passed_over(runs, half))
    if found is None or not found.relative < _EXPLODED:
        raise _NoEstimateError(f"runs neither at twice nor at half the step hold: {twice.stopped or half.stopped}")
    return found


def _by_shorter_steps(runs: _Comparisons, order: float) -> ErrorEstimate:
    """Return what the first run tells that takes shorter parts of steps all over, and where the error matters the next
    one as well, which shows the order."""
    multiple = 0.5
    while not runs.tell(multiple, 1.0):
        multiple *= 0.5
        if runs.parts.count(multiple * runs.step) > _MOST_PARTS * runs.parts.count(runs.step):
            what = f"runs in shorter steps that differ from it all over take {_MOST_PARTS:.0f} times as many"
            raise _NoEstimateError(f"its steps end where forces jump or states are sampled; {what}")
    shorter = runs.at(multiple=multiple)
    if len(shorter.rows) < 2 or shorter.stopped:
        raise _NoEstimateError(f"a run at 1/{1.0 / multiple:.0f} of the step does not hold: {shorter.stopped}")
    apart = runs.apart(runs.own, shorter)
    words = f"a run at 1/{1.0 / multiple:.0f} of the step"
    passed_over = _passed_over(runs, shorter)
    found = _estimate(runs, _Pair(apart, _gain(runs.ratio(multiple, apart.t)), words), order)
    of_outputs = 0.0 if found.largest_output is None else found.largest_output.share
    if max(found.relative, of_outputs) > NOTICED and runs.tell(0.5 * multiple, multiple):
        finest = runs.at(multiple=0.5 * multiple)
        if len(finest.rows) > 1 and not finest.stopped:
            near, best = runs.apart(shorter, finest), runs.apart(runs.own, finest)
            words = f"runs at 1/{1.0 / multiple:.0f} and 1/{2.0 / multiple:.0f} of the step"
            refinement = _refinement(runs, (0.5 * multiple, multiple, 1.0))
            pair = _Pair(best, _gain(runs.ratio(0.5 * multiple, best.t)), words, near, apart, refinement)
            found = _estimate(runs, pair, order)
    return replace(found, passed_over=passed_over)


def _refinement(runs: _Comparisons, multiples: tuple[float, float, float]) -> float:
    """Return the ratio of steps by which differences between three runs tell an order: 2 where steps are doubled.

    Where parts of steps grow by other ratios r and s, the differences grow by r^p (s^p - 1) / (r^p - 1).
    """
    order = float(runs.run.method.order)
    end = np.array([runs.parts.end])
    first, second, third = (float(runs.ratio(multiple, end)[0]) ** order for multiple in multiples)
    return float(((third - second) / (second - first)) ** (1.0 / order))


def _passed_over(runs: _Comparisons, other: _Motion) -> str:
    """Return which event comes in another number in another run, in words; empty where all come equally often.

    Events near the end of the run may be in one of them by their errors, which show in what both runs have, and those
    that are only counted have no times: one more or less of these is none. A resumed run has events from before.
    """
    ours, theirs = runs.own.events, other.events
    if ours is None or theirs is None or runs.span.rows[0, 0] > runs.run.grid.start:
        return ""
    times = {name: (ours[name].t, theirs[name].t) for name in ours.counts}
    apart = [np.abs(one[: len(two)] - two[: len(one)]).max(initial=0.0) for one, two in times.values()]
    end = runs.end - max(runs.step, _LATER * max(apart, default=0.0))
    for name, count in ours.counts.items():
        one, two = times[name]
        listed = len(one) == count
        more = (one if len(one) > len(two) else two)[min(len(one), len(two)) :]
        if np.any(more < end) if listed else abs(count - theirs.counts[name]) > 1:
            pair = (len(one), len(two)) if listed else (count, theirs.counts[name])
            return f"the event {name} comes {pair[0]} times, and {pair[1]} times in shorter steps"
    return ""


def _doubtful(runs: _Comparisons, found: ErrorEstimate, near: _Apart) -> bool:
    """Return whether longer steps tell too little, so that a shorter one has to.

    What turns by more than half a turn within a step is met at angles that longer steps pass over in the same way.
    """
    if runs.span.steps < _FEW_STEPS or found.t[-1] < runs.end or runs.turn > math.pi:
        return True
    other_order = abs(found.order - found.declared_order) > _OTHER_ORDER and found.relative > _NEGLIGIBLE
    return other_order or float(shares(near.kinds, runs.size).max(initial=0.0)) > _DOUBTFUL


def _estimate(runs: _Comparisons, pair: _Pair, declared: float) -> ErrorEstimate:
    """Return the estimate from differences; ``declared`` is the order of the method, NaN where it chooses its steps."""
    size = runs.size
    errors, orders = {}, {}
    for kind, apart in pair.apart.kinds.items():
        orders[kind] = math.nan
        if pair.near is not None and pair.far is not None:
            with np.errstate(all="ignore"):
                far, near = ((differ.t, differ.kinds[kind] / size.sizes[kind]) for differ in (pair.far, pair.near))
            orders[kind] = observed_order(far, near, _floor(runs), pair.refinement)
        used = declared if math.isnan(orders[kind]) else min(max(orders[kind], 1.0), declared)
        errors[kind] = apart * pair.gain(used)
    share = shares(errors, size)
    row, component = np.unravel_index(int(np.argmax(share)), share.shape) if share.size else (0, 0)
    times = pair.apart.t
    largest = None
    if share.size:
        error = np.hstack([errors["increment"], errors["z"]])[row, component]
        found = (size.names[component], float(error), size.units[component], float(times[row]))
        least = np.concatenate([size.sizes["increment"], size.sizes["z"]])[component]
        unit = size.units[component] if size.units[component] != "1" else ""
        measure = OWN if size.own[component] else SMALL.format(least=f"{least:.2g} {unit}".strip())
        measure = measure if math.isfinite(least) else NONE
        largest = Largest(*found, float(share[row, component]), measure)
    outputs = {kind.partition(".")[2]: array for kind, array in errors.items() if kind.startswith("output.")}
    return ErrorEstimate(
        available=True,
        t=times,
        q_at=errors["q"],
        increment_at=errors["increment"],
        v_at=errors["v"],
        z_at=errors["z"],
        multipliers_at=errors["multipliers"],
        outputs_at=ByName(
            "output",
            {name: array[:, 0] if runs.own.outputs[name].ndim == 1 else array for name, array in outputs.items()},
        ),
        relative_at=share.max(axis=1, initial=0.0),
        order=orders["increment"],
        declared_order=declared,
        relative=largest.share if largest is not None else 0.0,
        largest=largest,
        largest_velocity=_largest_velocity(runs, errors["v"], times),
        largest_output=_largest_output(runs, errors, times),
        method=f"{pair.words}{_since(runs)}",
    )


def _since(runs: _Comparisons) -> str:
    """Return from where on a resumed run is compared, in words; empty for one that is compared from its start."""
    first, start = float(runs.span.rows[0, 0]), runs.run.grid.start
    return f" from t = {first:.6g} s on, where the state is taken for exact" if first > start + 0.5 * runs.step else ""


def _largest_velocity(runs: _Comparisons, errors: Array, times: Array) -> Largest | None:
    """Return the largest error of the velocities, (n, nv), as a part of the largest velocity of the same unit, of a
    beam's elastic coordinate of its own; None where nothing moves.

    A beam is no joint: of what turns and slides as fast as the machine does, its vibrations are a thousandth.
    """
    model = runs.run.model
    velocities = np.abs(runs.span.rows[:, 1 + model.nq : 1 + model.nq + model.nv]).max(axis=0)
    units = np.array(model.v_units)
    span = float(runs.span.rows[-1, 0] - runs.span.rows[0, 0])
    least = runs.size.sizes["increment"] / span  # what moves less rests but for rounding
    measures = np.maximum(velocities, np.where(np.isfinite(least), least, 0.0))
    fastest = np.array([measures[units == unit].max() for unit in units])
    elastic = np.zeros(model.nv, dtype=bool)
    for factor in model.factors:
        elastic[factor.v] = factor.name in model.beams
    fastest[elastic] = measures[elastic]
    moving = np.flatnonzero(fastest > 0.0)
    if not errors.size or not len(moving):
        return None
    share = np.nan_to_num(errors[:, moving] / fastest[moving], nan=np.inf)
    row, place = np.unravel_index(int(np.argmax(share)), share.shape)
    column = int(moving[place])
    unit, time, error = str(units[column]), float(times[row]), float(errors[row, column])
    measure = FASTEST.format(unit=unit or "its unit")
    if elastic[column]:
        own = velocities[column] >= fastest[column]
        measure = OWN_FASTEST if own else SMALL_RATE.format(least=f"{fastest[column]:.2g} {unit}")
    return Largest(model.v_names[column], error, unit, time, float(share[row, place]), measure)


def _largest_output(runs: _Comparisons, errors: Kinds, times: Array) -> Largest | None:
    """Return the largest error of the outputs as a part of their ranges; None without any."""
    units = {item["name"]: item["unit"] for item in runs.run.model.library.layout["outputs"]}
    found = []
    for kind, array in errors.items():
        name = kind.partition(".")[2]
        if not name or not array.size:
            continue
        share = shares(errors, runs.size, (kind,))
        row, place = np.unravel_index(int(np.argmax(share)), share.shape)
        label = f"output {name}{f'[{place}]' if array.shape[1] > 1 else ''}"
        found.append(
            Largest(label, float(array[row, place]), units[name], float(times[row]), float(share[row, place]), RANGE)
        )
    return max(found, key=lambda item: item.share, default=None)


def _floor(runs: _Comparisons) -> float:
    """Return the part of the motion that rounding may be."""
    single = runs.run.model.library.real == "float"
    return _ROUNDING * float(np.finfo(np.float32 if single else np.float64).eps)


def observed_order(far: tuple[Array, Array], near: tuple[Array, Array], floor: float, ratio: float = 2.0) -> float:
    """Return the order that differences tell; NaN where they are rounding.

    What is held against one another are the largest so far, up to the last row at which both follow powers of the step.

    Parameters
    ----------
    far, near : x_4h - x_2h and x_2h - x_h as parts of the motion, (n, size), at times (n,) each in s
    floor : differences that are rounding
    ratio : of the steps of neighbouring runs
    """
    if not len(far[0]) or not len(near[0]) or not far[1].shape[1]:
        return math.nan
    (t, largest), (near_t, near_largest) = ((times, _so_far(array)) for times, array in (far, near))
    places = np.searchsorted(near_t, t + SAME_TIME * (near_t[-1] - near_t[0]) / len(near_t), side="right") - 1
    seen = np.flatnonzero(places >= 0)
    ours, theirs = near_largest[places[seen]], largest[seen]
    known = np.flatnonzero((ours > floor) & (theirs > floor) & np.isfinite(theirs) & (t[seen] <= near_t[-1]))
    if not len(known):
        return math.nan
    calm = known[theirs[known] < _SATURATED]
    row = calm[-1] if len(calm) else known[0]
    return float(np.log2(theirs[row] / ours[row]) / math.log2(ratio))


def _near(times: Array, others: Array, slack: float) -> NDArray[np.bool_]:
    """Return which of times (n,) are within a slack of one of others (m,), in order, all in s."""
    if not len(others):
        return np.zeros(len(times), dtype=bool)
    after = np.clip(np.searchsorted(others, times), 1, len(others)) - 1
    behind = np.minimum(after + 1, len(others) - 1)
    found: NDArray[np.bool_] = np.minimum(np.abs(times - others[after]), np.abs(times - others[behind])) <= slack
    return found


def _so_far(array: Array) -> Array:
    """Return the largest number of each row and those before it, (n,)."""
    with np.errstate(all="ignore"):
        found: Array = np.maximum.accumulate(np.nan_to_num(array, nan=np.inf).max(axis=1))
    return found
