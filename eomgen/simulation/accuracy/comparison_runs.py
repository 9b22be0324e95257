"""Runs of the same motion at other steps or tolerances, on the rows common to all runs, and distances between these
motions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, field
from eomgen.base.progress import Progress
from eomgen.base.rounding import COMPUTED
from eomgen.errors import UsageError
from eomgen.integrators.events import STOPPED
from eomgen.results.events import Events
from eomgen.simulation.accuracy.motion_size import (
    Kinds,
    MotionSize,
    at_work,
    differences,
    motion_size,
    shares,
    whole_turns,
)
from eomgen.simulation.stepping.chunks import run_chunks
from eomgen.simulation.stepping.events import acting, parameters_over, table_of
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import states_of
from eomgen.simulation.stepping.stepper import Stepper
from eomgen.simulation.stepping.time_grid import step_parts, time_grid
from eomgen.toolchain.library import Library

#: Times of rows agree within this part of a step.
SAME_TIME = 1e-4


@dataclass(frozen=True)
class Span:
    """The compared part of a run: rows at multiples of an interval from a first row on, and the last row.

    Attributes
    ----------
    rows, parameters : (n, width), and the parameters there, (np,) or (n, np)
    stride : steps of the run between two rows
    steps : of the run over the span
    """

    rows: Array
    parameters: Array
    stride: int
    steps: int


@dataclass(frozen=True)
class ComparisonRun:
    """The result of a comparison run.

    Attributes
    ----------
    rows : (n, width), none if the run cannot start
    parameters : (np,), or (n, np), at the rows
    stopped : reason for an early end; empty at the end and at an event that stops the motion
    interrupted : whether Ctrl-C ended the run
    events : of the run; None without events
    statistics : counts of the stepper
    """

    rows: Array
    parameters: Array
    stopped: str = ""
    interrupted: bool = False
    events: Events | None = None
    statistics: Mapping[str, int | float] = field(default_factory=dict)


def span_of(run: Run, rows: Array, parameters: Array) -> Span:
    """Return the compared part of a run with given rows, (n, width), and parameters there, (np,) or (n, np).

    Rows lie at multiples of the interval of recording, except the first row of a resumed run and the last row.
    """
    step, every, times = run.settings["step"], min(run.every, run.grid.steps + 1), rows[:, 0]
    numbers = np.rint((times - run.grid.start) / step).astype(np.int64)
    first, last = 1 if numbers[0] % every and len(times) > 2 else 0, len(times) - 1
    steps = int(numbers[last] - numbers[first])
    stride = every * max(1, math.ceil(steps / every / 1000))  # a thousand rows suffice, the last one aside
    chosen = np.append(np.arange(first, last, stride // every), last)
    if len(chosen) == len(rows):  # all of them, and large scenes have large rows
        return Span(rows, parameters, stride, steps)
    return Span(rows[chosen], parameters if parameters.ndim == 1 else parameters[chosen], stride, steps)


def comparison_run(
    run: Run,
    library: Library,
    span: Span,
    *,
    multiple: float = 1.0,
    tolerance: float | None = None,
    largest: float = math.inf,
    every: int | None = None,
    progress: Progress | None = None,
) -> ComparisonRun:
    """Return the result of a run over a span with another step or tolerance, with rows at times common to run and span.

    Parameters
    ----------
    multiple : ratio of the steps, as 2, 4 or 1/2; relative to the span if the run's step is longer than the span
    tolerance : of the comparison run; None for the run's own
    largest : bound on the method's own steps, s, if it chooses them
    every : steps between the rows; by default the common rows
    progress : called with (steps done, all steps)
    """
    model = run.model
    changed = {} if tolerance is None else {"tolerance": tolerance}
    begin, start, end = span.rows[0], float(span.rows[0, 0]), float(span.rows[-1, 0])
    settings = {**run.settings, "step": min(run.settings["step"], end - start) * multiple, **changed}
    if "largest_step" in settings:
        # in shorter steps of the grid, an eighth of the bound at least; 0: none
        bound = settings["largest_step"] * min(max(multiple, 0.125), 1.0)
        settings["largest_step"] = min(bound or math.inf, largest) if math.isfinite(largest) else bound
    p = span.parameters if span.parameters.ndim == 1 else span.parameters[0]
    q, v, z = begin[1 : 1 + model.nq], begin[1 + model.nq : 1 + model.nq + model.nv], begin[len(begin) - model.nz :]
    try:
        grid = time_grid(start, end, settings["step"], library.real)
        stepper = Stepper(library, settings, p, run.controllers)
        status = stepper.initialize(start, q, v, stepper.first_inputs(run.driven, grid), z)
        if status:
            return ComparisonRun(span.rows[:0], p, stepper.status_text(status))
        whole = max(1, round(multiple))
        every = min(every or round(math.lcm(span.stride, whole) / multiple), grid.steps + 1)
        result = run_chunks(stepper, grid, every, run.driven, progress, windows=False)
    except UsageError as error:
        return ComparisonRun(span.rows[:0], p, str(error.problems[0]))
    reason = stepper.status_text(result.status) if result.status not in (0, STOPPED.number) else ""
    times = result.rows[:, 0]
    events = table_of(result, stepper, p)
    present = parameters_over(events, model, p, times)
    stopped = reason or str(result.failure or "")
    return ComparisonRun(result.rows, present, stopped, result.interrupted, events, stepper.statistics)


def progress_after(progress: Progress | None, before: int, total: int) -> Progress | None:
    """Return a callback of progress for a run after ``before`` steps of other runs, of ``total`` steps in all."""
    if progress is None:
        return None
    return lambda done, _: progress(before + done, max(total, before + done))


INTERRUPTED = "the runs that it is made from were interrupted"


#: From ``outputs`` or ``energy`` to their values at all rows of a run.
AtRows = Callable[[str], Mapping[str, Array]]


class NoEstimateError(Exception):
    """Reason for a missing error estimate; the run's message includes ``remedy``, unless it is empty."""

    def __init__(self, reason: str, remedy: str = "") -> None:
        super().__init__(reason)
        self.remedy = remedy


def planned_steps(run: Run, steps: int) -> int:
    """Return the expected number of steps of all comparison runs."""
    return steps if run.method.chooses_steps else math.ceil(steps / 2) + math.ceil(steps / 4)


class ComparedMotion(NamedTuple):
    """The motion of a run that is compared with another run.

    Attributes
    ----------
    rows : (n, width)
    outputs : values at the rows by name, (n, ...)
    stopped : reason if the run stopped early; else empty
    events : of the run; None without events
    changes : (m,) s, times of the events that change the motion
    statistics : counts of the stepper
    """

    rows: Array
    outputs: Mapping[str, Array]
    stopped: str = ""
    events: Events | None = None
    changes: Array = np.empty(0)
    statistics: Mapping[str, int | float] = MappingProxyType({})

    def at(self, places: NDArray[np.intp]) -> ComparedMotion:
        """Return the motion at some rows, without a copy if these are all rows, in order."""
        if np.array_equal(places, np.arange(len(self.rows))):
            return self
        return self._replace(rows=self.rows[places], outputs={key: rows[places] for key, rows in self.outputs.items()})


class MotionDifference(NamedTuple):
    """How two motions differ, by kind, at times (n,) that both have rows at."""

    t: Array
    kinds: Kinds


class RecordedRun(NamedTuple):
    """A run with its library, recorded rows (n, width), parameters there, (np,) or (n, np), events and counts."""

    run: Run
    library: Library
    rows: Array
    parameters: Array
    events: Events | None
    statistics: Mapping[str, int | float]


class ComparisonRuns:
    """A run, and comparison runs, which are made on demand.

    Attributes
    ----------
    taken, run : the run, with settings, inputs and grid
    span : the compared rows
    own : the run's own motion at these rows
    size : size of the motion, by which differences are divided
    parts : of steps, as the stepper ends steps at jumps and samples
    events : whether the library has events
    single : whether the run is in single precision
    last_place : the unit in the last place of 1
    rounding : the part of the motion that rounding may be
    """

    def __init__(self, taken: RecordedRun, progress: Progress | None, at_rows: AtRows | None = None) -> None:
        """Choose the compared rows of a run, and evaluate outputs, the size of the motion and the parts of steps there.
        `progress` is called with (steps done, all steps); `at_rows` returns outputs or energies at all rows if these
        are known, None: they are evaluated."""
        run, library, rows, parameters, events, statistics = taken
        self.run, self._library, self._progress, self.taken = run, library, progress, taken
        self.events = "events" in library.layout["method"]
        self.span = span_of(run, rows, parameters)
        self._at_rows = at_rows if len(self.span.rows) == len(rows) else None
        known = self._at_rows
        outputs = self._outputs(self.span.rows, self.span.parameters) if known is None else known("outputs")
        self.own = self._motion(self.span.rows, outputs, events)._replace(statistics=statistics)
        turns = whole_turns(run, self.span.rows, self.span.parameters)
        work = at_work(run, rows, parameters)
        self.size: MotionSize = motion_size(run.model, rows, self.own.outputs, turns, self._energies(), work)
        begin, end = (float(t) for t in self.span.rows[[0, -1], 0])
        self.parts = step_parts(library.layout["method"], begin, end, float(run.method.order), self.own.changes)
        self.single = run.model.library.real == "float"
        self.last_place = float(np.finfo(np.float32 if self.single else np.float64).eps)
        self.rounding = 1e3 * self.last_place  # smaller differences count as none
        self._steps = run.grid.steps
        self._all = self._steps + planned_steps(run, self.span.steps)

    @property
    def end(self) -> float:
        """The time of the last row minus the tolerance of equal times, s."""
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
        """Step of the run's time grid, or the compared span if that is shorter, s."""
        return min(self.run.settings["step"], float(self.span.rows[-1, 0] - self.span.rows[0, 0]))

    @property
    def _same(self) -> float:
        return SAME_TIME * self.step

    def beginning(self, count: int) -> ComparisonRuns:
        """Return the comparison runs of the first `count` steps between rows, with errors relative to the whole run's
        motion."""
        rows, p = self.taken.rows[: count + 1], self.taken.parameters
        parameters = p[: count + 1] if p.ndim > 1 else p
        first = ComparisonRuns(self.taken._replace(rows=rows, parameters=parameters, events=None), self._progress)
        first.size = self.size
        return first

    def at(self, *, multiple: float = 1.0, tolerance: float | None = None, largest: float = math.inf) -> ComparedMotion:
        """Return the motion of a run over the same span at a multiple of the step, another tolerance, or both.
        `largest` bounds the steps that the method chooses, s. Raises NoEstimateError if the user interrupts the run."""
        before = self._steps
        self._steps += math.ceil(self.span.steps / multiple)
        report = progress_after(self._progress, before, max(self._all, self._steps))
        settings: dict[str, Any] = {"multiple": multiple, "tolerance": tolerance, "largest": largest}
        result = comparison_run(self.run, self._library, self.span, progress=report, **settings)
        if result.interrupted:
            raise NoEstimateError(INTERRUPTED)
        motion = self._motion(result.rows, self._outputs(result.rows, result.parameters), result.events)
        return motion._replace(stopped=result.stopped, statistics=result.statistics)

    def same(self, apart: MotionDifference) -> bool:
        """Return whether all differences are below rounding although the run moves."""
        return not self.size.still and float(shares(apart.kinds, self.size).max(initial=0.0)) < self.rounding

    def same_count(self, motion: ComparedMotion) -> bool:
        """Return whether another run took as many steps of the method's own; False if the method counts none."""
        count = self.own.statistics.get("own_steps")
        return count is not None and count == motion.statistics.get("own_steps")

    def tell(self, multiple: float, larger_multiple: float) -> bool:
        """Return whether runs at two multiples of the step, the second one the larger, are different runs all over."""
        return self.parts.tell(multiple * self.step, larger_multiple * self.step)

    def ratio(self, multiple: float, times: Array) -> Array:
        """Return by how much the steps of a run at a multiple of the step are longer in effect, up to times (n,) s."""
        return self.parts.ratio(self.step, multiple * self.step, times)

    def apart(self, first: ComparedMotion, second: ComparedMotion) -> MotionDifference:
        """Return the absolute differences of two motions by kind at their common times. Rows at an event that changes
        the motion are left out, since rounding decides on which side of the event a row lies. Outputs without a finite
        value in both motions differ by 0."""
        times = first.rows[:, 0], second.rows[:, 0]
        after = np.searchsorted(times[1], times[0] - self._same)
        result = np.flatnonzero(after < len(times[1]))
        result = result[times[1][after[result]] <= times[0][result] + self._same]
        for changes in (first.changes, second.changes):
            result = result[~_near(times[0][result], changes, COMPUTED * self.step)]
        ours, theirs = first.at(result), second.at(after[result])
        with np.errstate(all="ignore"):
            kinds = differences(self.run.model, ours.rows, theirs.rows, (ours.outputs, theirs.outputs))
        for name, values in ours.outputs.items():  # if a formula has no value in both, the difference is 0
            undefined = ~(np.isfinite(values) | np.isfinite(theirs.outputs[name]))
            kinds[f"output.{name}"][undefined.reshape(kinds[f"output.{name}"].shape)] = 0.0
        return MotionDifference(times[0][result], kinds)

    def _energies(self) -> float:
        """Return the energies at work, J: the largest kinetic energy and the range of the potential energy; 0 if no
        output is an energy."""
        model, run = self.run.model, self.run
        if "energy" not in model.functions or all(item["unit"] != "J" for item in model.library.layout["outputs"]):
            return 0.0
        if self._at_rows is not None:
            energies = self._at_rows("energy")
        else:
            t, q, v, a, _, z = states_of(self.span.rows, model, views=True)
            u = run.signals.rows(t) if run.takes_rows else None
            with np.errstate(all="ignore"):
                energies = model.energy(q, v, a, t, u, z=z, parameters=self.span.parameters)
        at_work = float(np.max(energies["kinetic"]) + np.ptp(energies["potential"]))
        return at_work if math.isfinite(at_work) else 0.0

    def _motion(self, rows: Array, outputs: Mapping[str, Array], events: Events | None) -> ComparedMotion:
        return ComparedMotion(rows, outputs, "", events, acting(events, self._library.layout))

    def _outputs(self, rows: Array, parameters: Array) -> Mapping[str, Array]:
        model, run = self.run.model, self.run
        if "outputs" not in model.functions:
            return {}
        if not len(rows):  # a run that does not get through its first step
            return {name: values[:0] for name, values in self.own.outputs.items()}
        t, q, v, a, multipliers, z = states_of(rows, model, views=True)
        held = {"multipliers": multipliers} if model.multipliers else {}
        u = run.signals.rows(t) if run.takes_rows else None
        with np.errstate(all="ignore"):
            return model.outputs(q, v, a, t, u, z=z, parameters=parameters, **held)


def _near(times: Array, others: Array, slack: float) -> NDArray[np.bool_]:
    """Return a mask of the times (n,) within ``slack`` of an element of ``others`` (m,), sorted, all in s."""
    if not len(others):
        return np.zeros(len(times), dtype=bool)
    after = np.clip(np.searchsorted(others, times), 1, len(others)) - 1
    behind = np.minimum(after + 1, len(others) - 1)
    result: NDArray[np.bool_] = np.minimum(np.abs(times - others[after]), np.abs(times - others[behind])) <= slack
    return result
