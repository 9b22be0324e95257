"""Pairs of roots of an event within one step, which the signs at its ends do not show: counted on the interpolant."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.rounding import WRITTEN
from eomgen.errors import EomgenError
from eomgen.products.doubts.places import NONE, evenly, grid_of_step, sample, whole_steps
from eomgen.products.doubts.sampled_run import MISSED, MISSED_PART, MOST_SAMPLED, SampledRun
from eomgen.results.finding import Finding
from eomgen.simulation.accuracy.step_path import StepPath, StepStates
from eomgen.simulation.judgement.finished_run import FinishedRun


def unseen_events(finished: FinishedRun) -> Finding | None:
    """Return a finding on the event with the most roots that are missed within steps, with their number; None if none
    is. Steps in which an event changes the motion are left out, and formulas of accelerations, multipliers or inputs:
    these are not known between the ends of steps."""
    if finished.events is None:
        return None
    sampled, changes, counts = finished.once(SampledRun), finished.changes, finished.events.counts
    rows, events = sampled.rows, finished.stepper.layout["method"]["events"]["rows"]
    event_indices = [index for index, row in enumerate(events) if row["has_rate"]]
    if not event_indices or len(rows) < 2 or rows[0, 0] > finished.run.grid.start:
        return None
    signs = np.array([events[index]["sign"] for index in event_indices])
    seen = np.array([counts[events[index]["name"]] for index in event_indices], dtype=float)
    try:
        recorded = _Roots(sampled.recorded_path, event_indices, signs, changes)
        if not np.any(recorded.count_missed(seen) > 0.0):
            return None
        taken = sampled.steps()
        if taken is None:
            return None
        whole = taken.rows is rows
        roots = recorded if whole else _Roots(sampled.path(taken), event_indices, signs, changes, taken.breaks)
        missed = roots.count_missed(seen)
    except (EomgenError, np.linalg.LinAlgError):  # states at which the equations give no numbers
        return None
    worst = int(np.argmax(missed))
    if not missed[worst] > 0.0:
        return None
    name, number = events[event_indices[worst]]["name"], round(float(missed[worst]))
    text = f"the event {name} comes {seen[worst]:.0f} times, and about {number} more lie in pairs within single steps"
    return Finding(text=f"{text}, which signs at their ends do not show", value=float(number))


class _Roots:
    """Numbers of roots of event functions along the interpolant of a run.

    Parameters
    ----------
    path : interpolant of the steps
    known : indices of the events
    signs : of the rates at roots that count, (events,); 0 for both
    changes : (n,) s, at which the motion is changed
    breaks : indices of rows after which there is no step
    """

    def __init__(
        self,
        path: StepPath,
        known: Sequence[int],
        signs: NDArray[np.intp],
        changes: Array,
        breaks: NDArray[np.intp] = NONE,
    ) -> None:
        """Choose the steps in which roots of events are searched for, and the share of the run that these steps stand
        for."""
        self._path, self._known, self._signs = path, list(known), signs
        t = path.states.t
        covered, whole = whole_steps(t, changes, breaks)
        self._steps = whole[evenly(len(whole), MOST_SAMPLED)]
        self._sampled = len(self._steps) < len(whole_steps(t, changes[:0], NONE)[0])
        span = float(np.diff(t)[covered].sum())
        self._share = len(whole) / max(len(self._steps), 1) * (float(t[-1] - t[0]) / span if span else 1.0)
        if len(whole) < len(covered):  # the events in these steps are counted, the steps are not
            self._share = min(self._share, len(whole) / max(len(self._steps), 1))

    def count_missed(self, seen: Array) -> Array:
        """Return the number of missed events, (events,), given the numbers ``seen`` of detected ones, (events,)."""
        if not len(self._steps):
            return np.zeros(len(seen))
        steps, share = self._steps, self._share
        count = min(64, 8 * MOST_SAMPLED // len(steps))
        result = share * self._roots(steps, count)
        while np.any(self._beyond(result, seen) > 0.0) and count < 1024:
            count *= 4
            part = steps[evenly(len(steps), 65_536 // count)]
            share *= len(steps) / len(part)
            steps, before = part, result
            result = share * self._roots(steps, count)
            if np.all(result <= before * (1.0 + MISSED_PART) + 1.0):
                break
        return self._beyond(result, seen)

    def _beyond(self, counts: Array, seen: Array) -> Array:
        least = MISSED + (MISSED_PART * seen if self._sampled else 0.0)
        missed: Array = np.where(counts - seen > least, counts - seen, 0.0)
        return missed

    def _roots(self, steps: NDArray[np.intp], count: int) -> Array:
        """Return the number of roots of each event within steps (m,), (events,), by signs at ``count`` places in each
        step, which are not evenly spread, and at both ends."""
        grid = grid_of_step(count)
        values = self._values(sample(self._path, steps, grid)).reshape(len(steps), len(grid), len(self._known))
        touched = WRITTEN * np.abs(np.nan_to_num(values)).max(axis=1, keepdims=True)
        result = np.zeros(len(self._known))
        for event in range(len(self._known)):
            event_values = values[:, :, event]
            signs = np.where(np.abs(event_values) > touched[:, :, event], np.sign(np.nan_to_num(event_values)), 0.0)
            # a zero value takes the sign before it
            last = np.maximum.accumulate(np.where(signs != 0.0, np.arange(len(grid)), 0), axis=1)
            signs = np.take_along_axis(signs, last, axis=1)
            rises = np.diff(signs, axis=1)
            passed = np.abs(rises) > 1.0
            if self._signs[event]:
                passed &= np.sign(rises) == self._signs[event]
            result[event] = np.count_nonzero(passed)
        return result

    def _values(self, there: StepStates) -> Array:
        """Return the functions of the known events at states within steps, (m, events)."""
        path, model = self._path, self._path.run.model
        q, v, z = there.states
        held = {"multipliers": np.zeros((len(q), len(model.multipliers)))} if model.multipliers else {}
        with np.errstate(all="ignore"):
            u = there.u if model.nu else None
            a = path.states.a[there.steps]
            functions = model.evaluate("events", q, v, a, there.t, u, z=z, parameters=there.p, **held)
        return np.asarray(functions["event"])[:, self._known]
