"""Runs with jumps of the state, stepped again in parts: samples of sampled states, and events with their actions.

A step of the grid is cut at samples within it and at events that change the motion; each stretch of a cut step starts
anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.rounding import WRITTEN
from eomgen.errors import NumericalError, Problem
from eomgen.integrators.events import SHORTEST, STOPPED
from eomgen.products.derivatives.motion import ReplayedRun, RunSegment
from eomgen.simulation.stepping.chunks import rows_from


@dataclass(frozen=True)
class StepPart:
    """A part of a cut step, without a jump inside.

    Attributes
    ----------
    first, last : rows (t, q, v, vdot, multipliers, z) at both ends; vdot and multipliers may be unknown
    samples : (sampled states,) of bool, states that take new values at the start
    event : number of the event at the end; -1: none
    short : whether the stretch is two terms of a Taylor series
    renews : whether accelerations at the end are evaluated anew, at a point of the grid after an event
    p : (np,) parameters, with the present modes
    """

    first: Array
    last: Array
    samples: NDArray[np.bool_]
    event: int
    short: bool
    renews: bool
    p: Array


@dataclass(frozen=True)
class JumpSegment(RunSegment):
    """A part of a run with jumps.

    Attributes
    ----------
    p : (rows, np) parameters at the rows, with the present modes
    samples : (steps, sampled states) of bool, states that take new values at the start of each step
    anew, begun : (steps,) of bool, steps that start from newly evaluated accelerations; and with new units
    inertia : (nv,) W = 1/M_ii at the start, by which multipliers move positions; empty if there is none
    cut : stretches of the steps with samples or events inside, by number of the step
    """

    p: Array
    samples: NDArray[np.bool_]
    anew: NDArray[np.bool_]
    begun: NDArray[np.bool_]
    inertia: Array
    cut: Mapping[int, Sequence[StepPart]]


def acting_events(layout: Mapping[str, Any]) -> Sequence[int]:
    """Return for each event of a stepper's layout whether the event changes the motion; others are recorded alone."""
    acts: Sequence[int] = layout["method"].get("events", {}).get("flags", {}).get("acts", ())
    return acts


class JumpMotion(ReplayedRun):
    """A run whose state jumps at samples or events, stepped again in parts with the jumps recorded."""

    @cached_property
    def _cut_before(self) -> dict[int, tuple[bool, bool]]:
        """Whether the step before a part is cut, and ends with new accelerations, by the first step of the part."""
        return {}

    def _step(self, row: Array) -> RunSegment:
        """Step through the next part of the run from ``row``, cut at events and samples, and return the segment."""
        run, done = self.run, self.done
        size = min(self.length, self.steps - done)
        times: Array = run.grid.start + run.grid.step * np.arange(done, done + size + 1, dtype=float)
        table = None if run.driven is None else rows_from(self.stepper, run.driven, done, size, run.grid.start)
        modes, inside, record = self.stepper.modes, self._inside(times), np.empty((size, len(row)))
        p = [run.parameters if modes is None else self._with_modes(run.parameters, modes)]
        samples, begins = self._due(times[:-1]), np.zeros(size, dtype=bool)
        anew = np.array(samples.any(axis=1))
        state, places = self.stepper.state, self.stepper.places
        a, none = state[places["a"]].copy(), np.zeros(0)
        inertia = state[places["inverse_inertia"]].copy() if "inverse_inertia" in places else none
        cut: dict[int, Sequence[StepPart]] = {}
        begun, before, (after_cut, renewed) = 0, row, self._cut_before.get(done, (False, False))
        while begun < size:
            count = 1
            while begun not in inside and begun + count < size and begun + count not in inside:
                count += 1
            if after_cut and not renewed:  # the step starts anew with the same units
                state[places["step"]] = -run.grid.step
                state[places["origin"]], state[places["count"]] = run.grid.start, done + begun
            ends = [times[begun], *inside.get(begun, ()), times[begun + count]]
            events, points = self._legs(ends, count, begun, table)
            record[begun : begun + count] = points[-count:]
            for number in range(begun, begun + count):
                begins[number] = after_cut and renewed
                anew[number] |= after_cut
                after_cut = number in inside or self._comes(events, record[number])
                if after_cut:
                    cut[number] = self._stretches(
                        [before, *points] if number in inside else [before, record[number]], events, p[-1]
                    )
                    renewed = cut[number][-1].renews
                p.append(cut[number][-1].p if after_cut else p[-1])
                before = record[number]
            begun += count
        self.check_whole_steps()
        self.done = done + size
        self._cut_before[self.done] = after_cut, renewed
        rows = np.concatenate([row[np.newaxis], record])
        return JumpSegment(done, rows, a, np.array(p), samples, anew, begins, inertia, cut)

    def _legs(
        self, times: Sequence[float], count: int, step: int, table: Array | None
    ) -> tuple[list[Any], list[Array]]:
        """Take ``count`` steps of the grid, or one step in parts that end at ``times`` (s). Returns the events that
        change the motion, in order, and the rows at all ends. `step` is the number of the first step in `table`, the
        inputs at the rows."""
        if len(times) == 2:
            inputs = None if table is None else table[step : step + count + 1]
            return self._taken_steps(count, self.run.grid.step, inputs)
        events: list[Any] = []
        rows: list[Array] = []
        for begin, end in pairwise(times):
            inputs = None
            if table is not None:
                shares = (np.array([begin, end]) - times[0])[:, np.newaxis] / self.run.grid.step
                inputs = np.ascontiguousarray((1.0 - shares) * table[step] + shares * table[step + 1])
            acting, reached = self._taken_steps(1, end - begin, inputs)
            events, rows = [*events, *acting], [*rows, *reached]
        return events, rows

    def _taken_steps(self, count: int, size: float, table: Array | None) -> tuple[list[Any], list[Array]]:
        """Take ``count`` steps of a size (s); return the events that change the motion, and the rows at the ends.
        Raises NumericalError if an event ends the run, or the stepper fails."""
        stepper, run, done = self.stepper, self.run, 0
        stepper.settings[list(run.settings).index("step")] = size
        record = np.empty((count, stepper.sizes["row"]))
        acts = acting_events(stepper.layout)
        events: list[Any] = []
        while done < count:
            inputs = None if table is None else np.ascontiguousarray(table[done:])
            status, taken = stepper.run(count - done, 1, inputs, record[done:])
            acting = [entry for entry in stepper.new_events if acts[int(entry["event"])]]
            events += acting
            if status == STOPPED.number:
                name = stepper.layout["method"]["events"]["rows"][int(acting[-1]["event"])]["name"]
                fault = f"the event {name} ends the run at t = {stepper.t:.9g} s, before the last row [E0579]"
                last = run.grid.start + run.grid.step * np.floor((stepper.t - run.grid.start) / run.grid.step)
                hint = f"t_end = {last:.9g}, or an event with action record"
                raise NumericalError(Problem("sensitivities", fault, hint))
            self.check(status)
            done += taken
        return events, list(record)

    def _stretches(self, ends: Sequence[Array], events: list[Any], p: Array) -> list[StepPart]:
        """Return the parts of a cut step between its rows `ends` and at events, with parameters `p` and modes after
        each event. Events within the step are taken from the list. Raises NumericalError for two events at the same
        time."""
        result: list[StepPart] = []
        for start, end in pairwise(ends):
            first, samples, acted = start, self._due(start[:1])[0], False
            while self._comes(events, end):
                entry = events.pop(0)
                if result and result[-1].event >= 0 and result[-1].last[0] == entry["t"]:
                    fault = f"two events change the motion at t = {entry['t']:.9g} s, in either order [E0580]"
                    raise NumericalError(Problem("sensitivities", fault, "one event, or other parameters"))
                last = self._row_of(entry, "_before", end)
                result.append(self._stretch(first, last, samples, int(entry["event"]), p))
                acted = True
                first, samples = self._row_of(entry, "", end), np.zeros_like(samples)
                if "modes" in (entry.dtype.names or ()):
                    p = self._with_modes(p, entry["modes"])
            result.append(self._stretch(first, end, samples, -1, p, renews=acted and end is ends[-1]))
        return result

    @staticmethod
    def _comes(events: Sequence[Any], end: Array) -> bool:
        """Return whether the next event comes until a row."""
        return bool(len(events)) and bool(events[0]["t"] <= end[0] + 4.0 * np.finfo(float).eps * abs(end[0]))

    def _stretch(
        self, first: Array, last: Array, samples: NDArray[np.bool_], event: int, p: Array, *, renews: bool = False
    ) -> StepPart:
        if len(self.sampled_places):  # values that are held over the stretch
            first = first.copy()
            first[self.sampled_places] = last[self.sampled_places]
        short = last[0] - first[0] <= SHORTEST * self.run.grid.step
        return StepPart(first, last, samples, event, bool(short), renews, p)

    def _row_of(self, entry: Any, suffix: str, like: Array) -> Array:
        """Return a row with the state of an entry of the log; accelerations are of the row ``like``."""
        row, (nq, nv) = like.copy(), (self.run.model.nq, self.run.model.nv)
        row[0], row[1 : 1 + nq], row[1 + nq : 1 + nq + nv] = entry["t"], entry[f"q{suffix}"], entry[f"v{suffix}"]
        if self.run.model.nz:
            row[len(row) - self.run.model.nz :] = entry[f"z{suffix}"]
        return row

    @property
    def _clocks(self) -> Mapping[str, Any]:
        """Data of the sampled states; none without them."""
        none = {"clocks": [], "rows": [], "closest": 0.0}
        clocks: Mapping[str, Any] = self.stepper.layout["method"].get("samples", none)
        return clocks

    @property
    def sampled_places(self) -> NDArray[np.intp]:
        """Places of the sampled states in a row."""
        first = self.stepper.sizes["row"] - self.run.model.nz
        return first + np.array([int(row["state"]) for row in self._clocks["rows"]], dtype=np.intp)

    def _tolerance(self, times: Array) -> Array:
        at_point = min(WRITTEN * self.run.grid.step, self._clocks["closest"])  # as in the steppers
        tolerance: Array = at_point + 64.0 * float(np.finfo(float).eps) * np.abs(times)
        return tolerance

    def _due(self, times: Array) -> NDArray[np.bool_]:
        """Return whether each sampled state is sampled at each time (n,), (n, sampled states)."""
        result = np.zeros((len(times), len(self._clocks["rows"])), dtype=bool)
        for number, row in enumerate(self._clocks["rows"]):
            period, offset = self._clocks["clocks"][row["clock"]]
            count = np.floor((times - offset) / period + 0.5)
            result[:, number] = (count >= 0.0) & (np.abs(times - offset - count * period) <= self._tolerance(times))
        return result

    def _inside(self, times: Array) -> dict[int, list[float]]:
        """Return the times of samples strictly inside of the steps between `times` (s), by number of the step."""
        result: dict[int, list[float]] = {}
        for period, offset in self._clocks["clocks"]:
            counts = np.arange(max(0.0, np.floor((times[0] - offset) / period)), (times[-1] - offset) / period + 1.0)
            samples = offset + counts * period
            places = np.searchsorted(times, samples) - 1
            for sample, row in zip(samples.tolist(), places.tolist(), strict=True):
                if not 0 <= row < len(times) - 1:
                    continue
                near = np.min(np.abs(times[row : row + 2] - sample))
                if near > self._tolerance(np.array([sample]))[0]:
                    result.setdefault(row, []).append(sample)
        return {row: sorted(set(samples)) for row, samples in result.items()}

    def _with_modes(self, p: Array, modes: Array) -> Array:
        result = p.copy()
        result[[mode["parameter"] for mode in self.stepper.layout["method"]["events"]["modes"]]] = modes
        return result
