"""Detection and findings of laws that act between the steps of a run: narrow forces and rates, forces aliased by the
steps, chatter about a level.

A run evaluates forces at its steps alone. Comparison runs may miss the same barrier, or sample a periodic force in the
same phase. The equations are therefore integrated along the interpolant of the steps: the defect of a step is the
impulse along the interpolant minus the change of velocity by the step. A step is examined if a formula deviates from
its chord over the step, or if an argument crosses a comparison, a point of a table or a centre within the step.
Deuflhard and Bornemann, Scientific Computing with ODEs (2002), 3.2, on defects.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.rounding import WRITTEN
from eomgen.errors import EomgenError
from eomgen.formula.discontinuities import breakpoints
from eomgen.formula.evaluate import symbols
from eomgen.formula.features import Feature, features
from eomgen.formula.nodes import Formula, Symbol, infix
from eomgen.lie import product
from eomgen.products.doubts.places import NONE, evenly, grid_of_step, sample, whole_steps
from eomgen.products.doubts.sampled_run import (
    ALIASED,
    ALIASED_PART,
    DEFECT,
    DEFECT_WITHIN,
    MOST_SAMPLED,
    UNDERSTATED,
    SampledRun,
)
from eomgen.results.finding import Finding
from eomgen.simulation.accuracy.comparison_runs import SAME_TIME, Span, comparison_run
from eomgen.simulation.accuracy.motion_size import at_work, differences, motion_size, reach_of, shares
from eomgen.simulation.accuracy.step_path import StepPath, StepRows, StepStates
from eomgen.simulation.judgement.finished_run import FinishedRun, UnseenLaw, laws_between_steps
from eomgen.simulation.stepping.run import Run

#: Maximum number of steps with evaluated defects.
_MOST_STEPS = 128
_State = tuple[Array, Array, Array]


class _Nodes(NamedTuple):
    """Rates of velocities and internal states at Gauss nodes within steps, along the interpolant.

    Attributes
    ----------
    blocks : states at the nodes
    rates : (nodes, nv + nz), 0 if the equations give no number
    counts : number of nodes of each step
    """

    blocks: StepStates
    rates: Array
    counts: NDArray[np.intp]


class _HeldComponent(NamedTuple):
    """A velocity or an internal state that the equations hold at a level, although the run passes the level.

    Attributes
    ----------
    step : index among the examined steps
    column : among velocities and internal states
    level, time : the level, and the time at which the run reaches the level, s
    beyond : how far the run goes beyond the level
    duration : s, in which the rates beyond the level lead through the window in which they point back
    jumps : whether the rates jump there, so that no solution leads on
    """

    step: int
    column: int
    level: float
    time: float
    beyond: float
    duration: float
    jumps: bool


class _Defects(NamedTuple):
    """Defects of m steps: impulse along the interpolant minus the change of velocities and internal states.

    Attributes
    ----------
    steps : (m,) indices of the steps
    net : (m, nv + nz) defects at the ends of the steps
    within : (m, nv + nz) largest absolute defects inside the steps
    times : (m,) s, time of the largest increment of the defect in each step
    """

    steps: NDArray[np.intp]
    net: Array
    within: Array
    times: Array


def unseen_law(finished: FinishedRun) -> UnseenLaw | None:
    """Return a law (a force or rate) that acts between the steps of a run, with effect and a remedy; None if the steps
    resolve all laws, and if states between steps cannot be evaluated. Long runs of adaptive methods are examined in
    part only (``SampledRun.examined_share``)."""
    run, rows, sampled = finished.run, finished.trajectory.rows, finished.once(SampledRun)
    laws = laws_between_steps(run)
    if not laws or len(rows) < 2:
        return None
    result = None
    try:
        examination = partial(_Examination, finished=finished, laws=laws)
        recorded = examination(sampled.recorded_path)
        if not recorded.looked_at:
            return None
        # some steps of methods that choose them are shorter than the average
        for finer in (1.0, 8.0) if run.method.chooses_steps else (1.0,):
            taken = sampled.steps(finer)
            if taken is None:
                return None
            if taken.rows is rows:
                result = recorded.finding()
            else:
                again = examination(sampled.path(taken), breaks=taken.breaks).finding()
                if again is None and result is not None and _another_way(run, rows, taken.rows):
                    return result  # closer rows met the law
                result = again
            if result is None:
                return None
            if finer > 1.0:
                result = _unresolved_law(sampled, taken, result, examination)
        return result
    except (EomgenError, np.linalg.LinAlgError):  # states at which the equations give no numbers
        return None


def _unresolved_law(
    sampled: SampledRun, taken: StepRows, first: UnseenLaw, examination: Callable[..., _Examination]
) -> UnseenLaw | None:
    """Return the first law that an adaptive method leaves unresolved even in rows as close as the remedy for the law
    asks; None if closer rows resolve all.

    The shortest steps of such a method may lie between two rows that are closer than its average step.

    Parameters
    ----------
    taken : rows of the run
    first : law that these rows do not resolve
    examination : makes the examination of a path whose steps ``breaks`` are left out
    """
    run, path, left_out, result = sampled.run, sampled.path(taken), taken.breaks, first
    for _ in range(16):  # intervals between rows
        step = int(np.searchsorted(taken.rows[:, 0], result.finding.time)) - 1
        closer = None if result.holds else _rows_within(sampled, taken, step, result.step)
        if closer is None or _another_way(run, taken.rows[step : step + 2], closer.rows):
            return result
        if examination(StepPath(run, closer.rows, closer.parameters)).finding() is not None:
            return result
        left_out = np.union1d(left_out, [step])
        again = examination(path, breaks=left_out).finding()
        if again is None:
            return None
        result = again
    return result


def _another_way(run: Run, rows: Array, others: Array) -> bool:
    """Return whether rows (n, width) and rows (m, width) of two runs differ, at common times, by more than the
    threshold for defects in parts of the motion. Velocities are compared at the end alone: right runs may meet a jump
    of a velocity on either side of a row."""
    places = np.clip(np.searchsorted(others[:, 0], rows[:, 0]), 1, len(others) - 1)
    places -= rows[:, 0] - others[places - 1, 0] < others[places, 0] - rows[:, 0]
    common = np.abs(others[places, 0] - rows[:, 0]) <= SAME_TIME * run.settings["step"]
    if not np.any(common):
        return False
    first, second = rows[common], others[places[common]]
    size = motion_size(run.model, np.concatenate([first, second]), {})
    differs = differences(run.model, first, second, ({}, {}))
    end = {kind: values[-1:] for kind, values in differs.items()}
    beyond = np.concatenate([shares(differs, size).ravel(), shares(end, size, ("v",)).ravel()])
    return bool(np.any(beyond > DEFECT))


def _known_times(path: StepPath, laws: Sequence[Formula]) -> Array:
    """Return the times within the run, (n,), at which comparisons and curves of the formulas ``laws`` have breakpoints
    in time. Breakpoints of short periods, of which the run has many, are left out."""
    p = path.parameters if path.parameters.ndim == 1 else path.parameters[0]
    values = path.run.model.description.values(dict(zip(path.run.model.parameters, p.tolist(), strict=True)))
    start, end = float(path.states.t[0]), float(path.states.t[-1])
    arrays: list[Array] = [np.zeros(0)]
    for law in laws:
        for point in breakpoints(law, lambda symbol: values.get(symbol.name)):
            if not point.period:
                arrays.append(np.array([point.time]))
            elif (end - start) / point.period < MOST_SAMPLED:
                first = np.ceil((start - point.time) / point.period)
                arrays.append(point.time + point.period * (first + np.arange((end - start) / point.period + 1.0)))
    times = np.unique(np.concatenate(arrays))
    inside: Array = times[(times > start) & (times < end)]
    return inside


class _Examination:
    """Search for steps of a run with nonlinear laws, and evaluation of the defects of these steps. ``path`` is the
    interpolant of the steps, ``laws`` are formulas of forces and rates, ``breaks`` steps that are left out."""

    def __init__(
        self, path: StepPath, finished: FinishedRun, laws: Sequence[Formula], breaks: NDArray[np.intp] = NONE
    ) -> None:
        """Collect the laws, known times and sizes by which steps are examined."""
        self._path, self._model, self._finished = path, path.run.model, finished
        ends, changes = finished.parts.ends, finished.changes
        #: Part of the motion from which the sum of defects is a finding.
        self._least: float = DEFECT
        self._known = [law for law in laws if path.knows(law)]
        self._opaque = len(self._known) < len(laws)
        self._features = [feature for law in self._known for feature in features(law) if path.knows(feature.argument)]
        self._t = path.states.t
        self._ends = np.unique(np.concatenate([ends, _known_times(path, laws)]))
        near = 1e-9 * (self._t[-1] - self._t[0])
        split = np.searchsorted(ends, self._t[:-1] + near) < np.searchsorted(ends, self._t[1:] - near)
        self._split: NDArray[np.bool_] = np.asarray(split)
        _, self._whole = whole_steps(self._t, changes, breaks)
        size = motion_size(self._model, path.rows, {}, work=at_work(path.run, path.rows, path.parameters))
        self._still = size.still
        sampled = np.array([state.sampling is not None for state in self._model.description.states], dtype=bool)
        self._sizes = np.concatenate([size.sizes["v"], np.where(sampled, np.inf, size.sizes["z"])])
        self._left_out = np.concatenate([np.zeros(self._model.nv, dtype=bool), sampled])

    # -- steps with nonlinear laws ---------------------------------------------------------------------------------

    @cached_property
    def _met_steps(self) -> NDArray[np.bool_]:
        """Steps between whose ends an argument passes a feature, or in which a known time lies, (steps,)."""
        before, after = np.searchsorted(self._ends, self._t[:-1]), np.searchsorted(self._ends, self._t[1:])
        result: NDArray[np.bool_] = after > before
        for feature in self._features:
            sides = feature.sides(self._path.values(feature.argument, self._path.at_rows))
            result |= np.abs(sides[1:] - sides[:-1]) >= feature.least
        return result

    @cached_property
    def _steps(self) -> NDArray[np.intp]:
        """Steps whose laws are sampled."""
        steps = self._whole
        if len(steps) <= MOST_SAMPLED:
            return steps
        return np.union1d(steps[evenly(len(steps), MOST_SAMPLED)], steps[self._met_steps[steps]][:MOST_SAMPLED])

    @cached_property
    def _grid(self) -> Array:
        """Samples of each step, from 0 to 1, both ends included; fewer if laws can be evaluated only through the
        equations of motion."""
        most = 8192 if self._opaque else 32768
        return grid_of_step(int(np.clip(most // max(len(self._steps), 1), 8, 64)))

    @cached_property
    def _samples(self) -> StepStates:
        return sample(self._path, self._steps, self._grid[1:-1])

    @cached_property
    def _arguments(self) -> list[Array]:
        """Arguments of features, (steps, samples) each."""
        blocks = self._samples, self._path.at_rows
        pairs = [[self._path.values(feature.argument, there) for there in blocks] for feature in self._features]
        return [self._with_ends(inside, at_ends, self._steps) for inside, at_ends in pairs]

    @cached_property
    def looked_at(self) -> list[int]:
        """Indices of sampled steps to examine: steps that meet features, then steps by decreasing nonlinearity."""
        steps = self._steps
        if not len(steps):
            return []
        bent, met = np.zeros(len(steps)), self._met_steps[steps]
        self._aliased = False
        for inside, at_ends in self._laws(self._samples, self._path.at_rows):
            values = np.nan_to_num(self._with_ends(inside, at_ends, steps), posinf=0.0, neginf=0.0)
            values /= float(np.abs(values).max()) or 1.0  # squares of numbers that are nearly infinite would overflow
            span = float(np.ptp(values))
            if span > WRITTEN:
                line = values[:, :1] + self._grid * (values[:, -1:] - values[:, :1])
                off = np.abs(values - line).max(axis=1) / span
                bent = np.maximum(bent, off)
                hidden = np.std((values - line)[:, 1:-1]) > ALIASED * np.std(values)
                self._aliased |= bool(hidden and np.mean(off > 0.1) > ALIASED_PART)
        for feature, table in zip(self._features, self._arguments, strict=True):
            met = met | (np.ptp(feature.sides(table), axis=1) >= feature.least)
        looked = np.flatnonzero((bent > 0.1) | met)  # in parts of the range over the run
        return [int(index) for index in looked[np.lexsort((-bent[looked], ~met[looked]))]]

    def finding(self) -> UnseenLaw | None:
        """Return an unresolved law, with the remedy; None if the steps resolve all laws."""
        if not self.looked_at:
            return None
        chosen = np.sort(np.array(self.looked_at[:_MOST_STEPS], dtype=np.intp))
        share = len(self.looked_at) / len(chosen) * len(self._whole) / len(self._steps)
        if self._path.run.method.chooses_steps:  # whose rows lie within steps, so forces at rows need not act there
            chosen = _without_gaps(chosen)
        law = self._judge(chosen, share)
        if law is None and self._aliased and not (self._still or self._path.run.method.chooses_steps):
            # comparison runs are aliased as well, so that the stated error leaves these forces out; sums of successive
            # steps only: phases change from step to step
            error = self._finished.error
            self._least = min(DEFECT, max(UNDERSTATED * error.relative if error.available else DEFECT, WRITTEN))
            law = self._judge(np.arange(min(len(self._steps), 256)), 1.0)
        return law

    def _laws(self, blocks: StepStates, ends: StepStates) -> Iterator[tuple[Array, Array]]:
        """Yield, at samples and at rows, the values of each law that the path can evaluate; if not all, also the rates
        of each velocity and internal state."""
        for law in self._known:
            yield self._path.values(law, blocks), self._path.values(law, ends)
        if self._opaque:
            yield from zip(self._path.rates(blocks).T, self._path.rates(ends).T, strict=True)

    @staticmethod
    def _with_ends(inside: Array, at_ends: Array, steps: NDArray[np.intp]) -> Array:
        """Return values within steps with the values at the ends, (steps, samples + 2)."""
        return np.column_stack([at_ends[steps], inside.reshape(len(steps), -1), at_ends[steps + 1]])

    def _meshes(self, steps: NDArray[np.intp], grid: Array, arguments: Sequence[Array]) -> list[Array]:
        """Return a mesh in [0, 1] for each of the steps (m,), refined towards features, which ``arguments``, values at
        the places ``grid`` (m, samples + 2) of each feature, pass."""
        even = np.linspace(0.0, 1.0, 25)
        result = [[even, self._inside(int(step))] for step in steps]
        closer = np.ldexp(1.0 / len(grid), -np.arange(24))  # for narrow features
        for feature, table in zip(self._features, arguments, strict=True):
            places, numbers = self._crossings(feature, table, grid, steps)
            for crossing, number in zip(places, numbers, strict=True):
                at = np.array([crossing])
                result[number] += [at] if feature.curve else [at, crossing - closer, crossing + closer]
        return [_in_order(np.concatenate(parts)) for parts in result]

    def _inside(self, step: int) -> Array:
        """Return the positions of known times within a step, in [0, 1]."""
        begin, end = self._t[step], self._t[step + 1]
        first, last = np.searchsorted(self._ends, begin, side="right"), np.searchsorted(self._ends, end)
        inside: Array = (self._ends[first : min(last, first + MOST_SAMPLED)] - begin) / (end - begin)
        return inside

    def _crossings(
        self, feature: Feature, table: Array, grid: Array, steps: NDArray[np.intp]
    ) -> tuple[Array, NDArray[np.intp]]:
        """Return the crossings of a feature by its argument within steps, in [0, 1], and the indices of these steps.

        Parameters
        ----------
        table : (steps, samples + 2), the argument at the positions ``grid`` of each step
        """
        sides = feature.sides(table)
        numbers, samples = np.nonzero(sides[:, 1:] != sides[:, :-1])
        crossings = []
        for row, position in zip(numbers.tolist(), samples.tolist(), strict=True):
            ends = sorted((float(table[row, position]), float(table[row, position + 1])))
            crossings += [(row, position, float(level)) for level in feature.between(ends[0], ends[1], 8)]
        crossings = crossings[: 8 * len(steps)]
        if not crossings:
            return np.zeros(0), np.zeros(0, dtype=np.intp)
        number, k = (np.array([crossing[column] for crossing in crossings], dtype=np.intp) for column in (0, 1))
        level = np.array([crossing[2] for crossing in crossings])
        first, last, low, high = grid[k], grid[k + 1], table[number, k], table[number, k + 1]
        begin, h = self._t[steps[number]], np.diff(self._t)[steps[number]]
        fraction = first
        for _ in range(3):  # secants within the bracket
            with np.errstate(all="ignore"):
                share = np.nan_to_num((level - low) / (high - low), nan=0.5)
            fraction = first + np.clip(share, 0.0, 1.0) * (last - first)
            value = self._path.values(feature.argument, self._path.at(begin + fraction * h, steps[number]))
            before = (value < level) == (low < level)
            first, low = np.where(before, fraction, first), np.where(before, value, low)
            last, high = np.where(before, last, fraction), np.where(before, high, value)
        return fraction, number

    # -- defects ---------------------------------------------------------------------------------------------------

    def _judge(self, chosen: NDArray[np.intp], share: float) -> UnseenLaw | None:
        """Return an unresolved law in the selected steps, given by their indices among the sampled ones; None without
        one. ``share`` is the number of steps of the run for each selected step."""
        steps = self._steps[chosen]
        meshes = self._meshes(steps, self._grid, [table[chosen] for table in self._arguments])
        nodes = self._nodes(steps, meshes)
        levels = self._levels(steps, nodes)
        largest_level = max(levels, key=lambda level: level.beyond / self._sizes[level.column], default=None)
        if largest_level is not None and largest_level.beyond > DEFECT * self._sizes[largest_level.column]:
            return self._level_law(largest_level, steps, meshes)
        defects = self._defects(steps, meshes, nodes.rates)
        for column, chatters in self._chattering(steps, nodes):  # restoring forces
            defects.net[chatters, column] = defects.within[chatters, column] = 0.0
        if self._excess(defects, share) <= 1.0:
            return None
        lasting = self._forgotten(defects)
        return self._defect_law(lasting, meshes, share) if self._excess(lasting, share) > 1.0 else None

    def _nodes(self, steps: NDArray[np.intp], meshes: Sequence[Array]) -> _Nodes:
        h = np.diff(self._t)[steps]
        nodes = (0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0))
        places = [(mesh[:-1, np.newaxis] + np.diff(mesh)[:, np.newaxis] * nodes).ravel() for mesh in meshes]
        times = np.concatenate([self._t[s] + h[k] * x for k, (s, x) in enumerate(zip(steps, places, strict=True))])
        counts = np.array([len(x) for x in places], dtype=np.intp)
        blocks = self._path.at(times, np.repeat(steps, counts))
        rates = self._path.rates(blocks)
        return _Nodes(blocks, np.where(np.isfinite(rates), rates, 0.0), counts)

    def _defects(self, steps: NDArray[np.intp], meshes: Sequence[Array], rates: Array) -> _Defects:
        """Return the defects of steps, at their ends and within, from the rates at two nodes of each interval of their
        meshes."""
        h = np.diff(self._t)[steps]
        edges = np.concatenate([self._t[s] + h[k] * m[1:] for k, (s, m) in enumerate(zip(steps, meshes, strict=True))])
        numbers = np.repeat(steps, [len(mesh) - 1 for mesh in meshes])
        _, *inside = self._path.at(np.minimum(edges, self._t[numbers + 1]), numbers).states
        shown = np.hstack(inside)
        rows = np.hstack([self._path.states.v, self._path.states.z])
        net, within, when = [], [], []
        first = last = 0
        for k, (step, mesh) in enumerate(zip(steps, meshes, strict=True)):
            last = first + len(mesh) - 1
            pieces = 0.5 * (rates[2 * first : 2 * last : 2] + rates[2 * first + 1 : 2 * last : 2])
            impulse = np.cumsum(h[k] * np.diff(mesh)[:, np.newaxis] * pieces, axis=0)
            shown[last - 1] = rows[step + 1]
            lacks = impulse - (shown[first:last] - rows[step])
            lacks[:, self._left_out] = 0.0
            net.append(lacks[-1])
            # a step split at a known time does not follow the interpolant through its ends
            within.append(np.zeros(lacks.shape[1]) if self._split[step] else np.abs(lacks).max(axis=0))
            steepest = np.abs(np.diff(lacks, axis=0, prepend=0.0))
            scale = np.where(np.isfinite(self._sizes), self._sizes, steepest.max(axis=0))
            interval = np.argmax(np.divide(steepest, scale, out=np.zeros_like(steepest), where=scale > 0.0).max(axis=1))
            when.append(self._t[step] + h[k] * mesh[interval + 1])
            first = last
        return _Defects(steps, np.array(net), np.array(within), np.array(when))

    # -- levels that the motion cannot pass ------------------------------------------------------------------------

    def _levels(self, steps: NDArray[np.intp], nodes: _Nodes) -> list[_HeldComponent]:
        """Return the levels that the run passes, though the equations hold the motion there.

        At a jump of a force in a velocity the rates on both sides may point to the jump: no motion passes it
        (Filippov, Differential Equations with Discontinuous Righthand Sides, 1988, 4). A step that passes both sides
        of a narrow window evaluates no force there, and the impulse within the window is small.
        """
        columns = self._jumping
        if not columns:
            return []
        begins = self._rates_at(steps)
        values, inside = self._columns(self._path.at_rows), self._columns(nodes.blocks)
        levels: list[_HeldComponent] = []
        last = np.cumsum(nodes.counts)
        for index, step in enumerate(steps.tolist()):
            part = slice(last[index] - nodes.counts[index], last[index])
            for column in columns:
                low, high = values[step : step + 2, column]
                way = np.sign(high - low)
                there, rates = way * inside[part, column], way * nodes.rates[part, column]
                back = np.flatnonzero((rates < 0.0) & (there > way * low) & (there < way * high))
                if not len(back) or way * begins[index, column] <= 0.0:
                    continue
                level = float(inside[part, column][back[0]])
                beyond = self._beyond(step, column, float(low), level)
                if not beyond:
                    continue
                time = float(nodes.blocks.t[part][back[0]])
                duration = float(np.ptp(there[back]) / np.abs(rates[back]).max())
                before = float(inside[part, column][back[0] - 1]) if back[0] else float(low)
                jumps = abs(level - before) < 1e-4 * abs(float(high - low))  # nodes lie so close at comparisons
                levels.append(_HeldComponent(index, column, level, time, beyond, duration, jumps))
        return levels

    def _chattering(self, steps: NDArray[np.intp], nodes: _Nodes) -> Iterator[tuple[int, NDArray[np.bool_]]]:
        """Yield the columns of velocities and internal states, each with whether in each step (m,) rates lead from both
        sides to a level within reach, so that the motion chatters there."""
        columns = self._jumping
        if not columns:
            return
        begins = np.cumsum(nodes.counts) - nodes.counts
        h = np.diff(self._t)[steps]
        values, inside = self._columns(self._path.at_rows), self._columns(nodes.blocks)
        reach = h[:, np.newaxis] * np.abs(self._rates_at(steps))
        for column in columns:
            ends = values[steps, column], values[steps + 1, column]
            low = np.minimum.reduce([*ends, np.minimum.reduceat(inside[:, column], begins)]) - reach[:, column]
            high = np.maximum.reduce([*ends, np.maximum.reduceat(inside[:, column], begins)]) + reach[:, column]
            below, above = (self._rates_at(steps, column, value)[:, column] for value in (low, high))
            led = (below > 0.0) & (above < 0.0) & ((below - above) * h > 0.5 * (high - low))
            yield column, led & (high - low <= DEFECT_WITHIN * self._sizes[column])  # else the chatter is the error

    @cached_property
    def _jumping(self) -> list[int]:
        """Columns of velocities and internal states of which a law with jumps or centres is a function."""
        passed = {symbol for feature in self._features for symbol in symbols(feature.argument)}
        places = {column for symbol in passed for column in _columns_of(self._path, symbol)}
        return sorted(column for column in places if not self._left_out[column])

    @staticmethod
    def _columns(blocks: StepStates) -> Array:
        """Return velocities and internal states, (n, nv + nz)."""
        return np.hstack(blocks.states[1:])

    def _beyond(self, step: int, column: int, low: float, level: float) -> float:
        """Return the distance by which a column exceeds a level to which the rates lead from both sides; 0 if the
        column returns, or rates soon lead on.

        Parameters
        ----------
        low : value at the beginning of the step, from which the rates lead to the level
        """
        way = 1.0 if level > low else -1.0
        rows = np.arange(step, min(step + MOST_SAMPLED, len(self._t) - 1) + 1)
        values = way * self._columns(self._path.at_rows)[rows, column]
        ahead = np.flatnonzero(way * self._rates_at(rows[1:])[:, column] > 0.0)
        if not len(ahead):
            return 0.0
        free = int(ahead[0]) + 2  # rows up to the first row from which the rates lead on, and the next row
        if len(values) <= free or np.any(np.diff(values[: free + 1]) <= 0.0):
            return 0.0  # forces at the level act on the run, which chatters about it
        toward, away = (way * self._rates_at(rows, column, value)[:, column] for value in (low, level))
        holds = (toward > 0.0) & (away < 0.0) & ((np.arange(len(rows)) < 2) | (values > way * level))
        count = len(rows) if holds.all() else int(np.argmin(holds))
        return float(np.max(values[1:count] - way * level)) if count > 1 else 0.0

    def _rates_at(self, rows: NDArray[np.intp], column: int = -1, value: Array | float = 0.0) -> Array:
        """Return rates at rows (m,), (m, nv + nz); with a column of velocities and internal states replaced by
        ``value``, if one is given."""
        q, v, z = (part[rows].copy() for part in self._path.at_rows.states)
        if column >= 0:
            part, part_column = (v, column) if column < self._model.nv else (z, column - self._model.nv)
            part[:, part_column] = value
        return np.nan_to_num(self._path.rates(self._path.at(self._t[rows], rows), (q, v, z)))

    @cached_property
    def _sizes_after(self) -> Array:
        """Scales of velocities, from each row to the end of the run, and of internal states, (n, nv + nz). For a joint
        that moves on slowly after a barrier, the scale is the velocity after the barrier."""
        speeds = np.abs(self._path.states.v)
        covered = 0.5 * (speeds[1:] + speeds[:-1]) * np.diff(self._t)[:, np.newaxis]
        left = np.vstack([np.cumsum(covered[::-1], axis=0)[::-1], np.zeros(self._model.nv)])
        after = np.maximum.accumulate(speeds[::-1], axis=0)[::-1]
        sizes = np.tile(self._sizes, (len(speeds), 1))
        slower = np.clip(after, 0.1 * self._sizes[: self._model.nv], self._sizes[: self._model.nv])
        # a tenth of the path is still ahead
        sizes[:, : self._model.nv] = np.where(left > 0.1 * left[:1], slower, sizes[:, : self._model.nv])
        return sizes

    def _shares(self, lacking: Array, sizes: Array | None = None) -> Array:
        """Return defects (..., nv + nz) relative to the size of the motion; 1 for components that do not move."""
        with np.errstate(all="ignore"):
            measured = np.abs(lacking) / (self._sizes if sizes is None else sizes)
        resting = ~np.isfinite(self._sizes) & ~self._left_out
        return np.where(resting & (np.abs(lacking) > 0.0), 1.0, measured)

    def _excess(self, defects: _Defects, share: float) -> float:
        """Return the largest ratio of the defects to the thresholds; a finding needs a ratio above 1."""
        after = self._sizes_after[defects.steps + 1]
        summed = share * float(self._shares(np.cumsum(defects.net, axis=0), after).max())
        return max(summed / self._least, float(self._shares(defects.within).max()) / DEFECT_WITHIN)

    def _forgotten(self, defects: _Defects) -> _Defects:
        """Return defects whose accumulated sum is damped by stiff motion, as by an L-stable step.

        Jacobians are medians over the states within a step and its two neighbours, so that narrow laws, or laws within
        one step, do not count as stiffness. Each takes a factorization at every state: in all no more than the run has
        steps, but for the first Jacobian.
        """
        nv, nz = self._model.nv, self._model.nz
        count = int(np.clip((len(self._t) - 1) // 24, 1, 32))  # of 8 states in each of three steps
        chosen = evenly(len(defects.steps), count)
        partials = self._partials(defects.steps[chosen])
        size = 2 * nv + nz
        error, sums, within = np.zeros(size), [], []
        for k, step in enumerate(defects.steps):
            J = partials[int(np.argmin(np.abs(chosen - k)))]
            h = float(self._t[step + 1] - self._t[step])
            half = np.linalg.solve(np.eye(size) - 0.5 * h * J, np.eye(size))
            whole = np.linalg.solve(np.eye(size) - h * J + 0.5 * h * h * J @ J, np.eye(size))
            kicked = half @ np.concatenate([np.zeros(nv), defects.net[k]])
            error = whole @ error + kicked
            sums.append(error[nv:])
            within.append(np.minimum(np.abs(half[nv:, nv:]) @ defects.within[k], defects.within[k]))
        total = np.array(sums)
        return defects._replace(net=np.diff(total, axis=0, prepend=0.0), within=np.array(within))

    def _partials(self, steps: NDArray[np.intp]) -> Array:
        """Return the Jacobians of the rates with respect to (increments of q, v, z), (steps, size, size). Rates are
        medians over states in each step and its two neighbours."""
        nv, nz = self._model.nv, self._model.nz
        places = (np.arange(8) + 0.5) / 8
        around = np.clip(steps[:, np.newaxis] + np.arange(-1, 2), 0, len(self._t) - 2).ravel()
        blocks = sample(self._path, around, places)
        moves = []
        for part, width in enumerate((nv, nv, nz)):
            for k, size in enumerate(1e-6 * self._scales[part]):
                way = np.zeros((len(blocks.t), width))
                way[:, k] = size
                moves.append((self._shift(blocks, part, way), self._shift(blocks, part, -way), 2.0 * size))
        # an infinite rate is stiff, with squares that stay finite
        rates = np.minimum(np.maximum(np.nan_to_num(rate_partials(self._path, blocks, moves)), -1e100), 1e100)
        middle = np.median(rates.reshape(len(steps), -1, nv + nz, 2 * nv + nz), axis=1)
        result = np.zeros((len(steps), 2 * nv + nz, 2 * nv + nz))
        result[:, :nv, nv : 2 * nv] = np.eye(nv)
        result[:, nv:] = middle
        return result

    @cached_property
    def _scales(self) -> tuple[Array, Array, Array]:
        """Scales of increments and velocities, (nv,) each, the largest values of the same unit, and of internal states.

        Scales are over all rows. Angles count at least 1 rad, velocities at least the coordinates per duration of the
        run. Internal states (nz,) have a scale each by itself. Scales of zero become 1.
        """
        model, states = self._model, self._path.states
        reach = reach_of(model, states.q)
        fastest = np.maximum(np.abs(states.v).max(axis=0, initial=0.0), reach / float(np.ptp(self._t)))
        scales = reach, fastest, np.abs(states.z).max(axis=0, initial=0.0)
        increments, velocities, inner = (np.where(scale > 0.0, scale, 1.0) for scale in scales)
        return increments, velocities, inner

    def _shift(self, blocks: StepStates, part: int, shift: Array) -> tuple[Array, Array, Array]:
        """Return the states (q, v, z) of ``blocks`` with the part 0 (q), 1 (v) or 2 (z) shifted by ``shift`` (n,
        width); q along the group."""
        q, v, z = blocks.states
        if part == 0:
            return product.update(self._model.factors, q, shift), v, z
        return (q, v + shift, z) if part == 1 else (q, v, z + shift)

    # -- message ---------------------------------------------------------------------------------------------------

    def _defect_law(self, defects: _Defects, meshes: Sequence[Array], share: float) -> UnseenLaw:
        """Return the law that acts between the steps, with its time and effect in words."""
        summed = share * np.cumsum(defects.net, axis=0)
        after = self._sizes_after[defects.steps + 1]
        parts, inside = self._shares(summed, after), self._shares(defects.within)
        within = float(inside.max()) / DEFECT_WITHIN > float(parts.max()) / self._least
        table = inside if within else parts
        row, column = (int(index) for index in np.unravel_index(int(np.argmax(table)), table.shape))
        lacking = float(np.abs((defects.within if within else summed)[row, column]))
        size = float(self._sizes[column] if within else after[row, column])
        motion = "its motion" if within or size == self._sizes[column] else "its velocity from there on"
        if not within:
            row = int(np.argmax(self._shares(defects.net)[: row + 1, column]))
        name, unit = self._component(column)
        law, width = self._culprit(int(defects.steps[row]), meshes[row], name)
        time = float(defects.times[row])
        part = f", {100.0 * lacking / size:.3g} % of {motion}" if np.isfinite(size) else ", which does not move"
        amount = f"{name} by {lacking:.2g}{unit}{part}"
        change = f"within the step it changes {amount}" if within else f"it would change {amount}"
        text = f"{law} acts between the steps at t = {time:.6g} s and is not seen by them: {change}"
        if not within and parts.max() <= DEFECT:
            text += ", which the estimated error leaves out"
        value = float(table[row, column] if within else parts[:, column].max())
        step = f"{width / 8.0:.2g}"  # 8 steps over the unresolved part
        return UnseenLaw(Finding(value=value, time=time, text=text, hint=self._remedy(step)), law, float(step))

    def _component(self, column: int) -> tuple[str, str]:
        """Return the name of a velocity or an internal state, and the unit with a space before."""
        unit = (*self._model.v_units, *self._model.z_units)[column]
        return (*self._model.v_names, *self._model.z_names)[column], "" if unit in ("", "1") else f" {unit}"

    def _level_law(self, held: _HeldComponent, steps: NDArray[np.intp], meshes: Sequence[Array]) -> UnseenLaw:
        name, unit = self._component(held.column)
        law, width = self._culprit(int(steps[held.step]), meshes[held.step], name)
        share = held.beyond / float(self._sizes[held.column])
        beyond = f"beyond which the run goes by {held.beyond:.2g}{unit}, {100.0 * share:.3g} % of its motion"
        opening = f"{law} acts between the steps at t = {held.time:.6g} s and is not seen by them"
        text = f"{opening}: it holds {name} at {held.level:.6g}{unit}, {beyond}"
        step = f"{min(width, held.duration) / 8.0:.2g}"
        unsolved = held.jumps and self._path.run.method.chooses_steps
        hint = f"a method of fixed steps, of {step} s" if unsolved else self._remedy(step)
        finding = Finding(value=share, time=held.time, text=text, hint=hint)
        return UnseenLaw(finding, law, 0.0 if unsolved else float(step), holds=True)

    def _remedy(self, step: str) -> str:
        run = self._path.run
        if run.method.chooses_steps:
            resumed = float(self._t[0]) > run.grid.start
            return f"largest_step = {step} in the settings{' of a run from the start' if resumed else ''}"
        return f"a step of {step} s"

    def _culprit(self, step: int, mesh: Array, name: str) -> tuple[str, float]:
        """Return, in words, the law with the largest nonlinearity within a step, and the width of the unresolved part,
        s; the rate of the component ``name`` if no formula is known."""
        begin, h = self._t[step], float(self._t[step + 1] - self._t[step])
        middles = 0.5 * (mesh[1:] + mesh[:-1])
        blocks = self._path.at(begin + h * middles, np.full(len(middles), step))
        ends = self._path.at_rows
        laws = []
        for law in self._known:
            values = self._path.values(law, blocks)
            low, high = (float(self._path.values(law, ends)[k]) for k in (step, step + 1))
            laws.append((f"the formula {_shorten(infix(law))}", values, low + middles * (high - low)))
        if self._opaque or not laws:
            inside, at_ends = self._path.rates(blocks), self._path.rates(ends)[[step, step + 1]]
            for column, component in enumerate((*self._model.v_names, *self._model.z_names)):
                if component == name:
                    line = at_ends[0, column] + middles * (at_ends[1, column] - at_ends[0, column])
                    laws.append((f"the rate of {name}", inside[:, column], line))
        best = (0.0, f"the rate of {name}", h)
        for words, values, line in laws:
            off = np.nan_to_num(np.abs(values - line))
            top, span = float(off.max()), float(np.abs(np.nan_to_num(values)).max()) or 1.0
            if top / span > best[0]:
                area = float(np.sum(off * np.diff(mesh))) / top
                varied = float(np.sum(np.abs(np.diff(np.nan_to_num(values - line))))) / (2.0 * top)
                best = (top / span, words, h * min(1.0, area) / max(1.0, varied))
        return best[1], best[2]


def _columns_of(path: StepPath, symbol: Symbol) -> Iterable[int]:
    """Return the indices of the velocities, followed by the internal states, that a known symbol depends on; empty for
    positions, times, and points of a model with many velocities."""
    nv = path.run.model.nv
    if symbol in path.points:
        kind = symbol.name if symbol.kind == "local" else symbol.kind
        return range(nv) if "velocity" in kind and nv <= 12 else ()
    letters = {"v": 0, "state": nv}
    return (letters[symbol.kind] + path.place(symbol),) if symbol.kind in letters else ()


@np.errstate(all="ignore")  # of infinite rates, as at a wall between the steps
def rate_partials(path: StepPath, blocks: StepStates, moves: Sequence[tuple[_State, _State, float]]) -> Array:
    """Return differences of the rates over moves of the state, (n, nv + nz, moves). A move has two states (q, v, z),
    the second to be subtracted, and the distance between them."""
    model = path.run.model
    if not model.evaluator.multipliers:
        pairs = ((path.rates(blocks, ahead) - path.rates(blocks, behind)) / width for ahead, behind, width in moves)
        return np.stack(list(pairs), axis=-1)
    q, v, z = blocks.states
    arguments: dict[str, Any] = {"t": blocks.t, "u": blocks.u if model.nu else None, "parameters": blocks.p}
    named = (
        (dict(zip("qvz", ahead, strict=True)), dict(zip("qvz", behind, strict=True)), width)
        for ahead, behind, width in moves
    )
    result = model.evaluator.acceleration_partials(named, q=q, v=v, z=z, base=None, **arguments)
    if not model.nz:
        return result
    inner = [
        [model.internal_rates(q, v, z=z, **arguments) for q, v, z in (ahead, behind)] for ahead, behind, _ in moves
    ]
    widths = np.array([width for *_, width in moves])
    return np.concatenate([result, np.stack([after - before for after, before in inner], axis=-1) / widths], axis=-2)


def _rows_within(sampled: SampledRun, taken: StepRows, row: int, spacing: float) -> StepRows | None:
    """Return rows from the row ``row`` of an adaptive method to the next one; None if that part cannot be repeated.

    Parameters
    ----------
    spacing : s, between the rows; larger if there were too many rows
    """
    if not 0 <= row < len(taken.rows) - 1 or row in taken.breaks or not spacing:
        return None
    run, ends, p = sampled.run, taken.rows[row : row + 2], taken.parameters
    length = float(ends[1, 0] - ends[0, 0])
    parts = math.ceil(min(length / spacing, 20_000))
    step = min(run.settings["step"], length)
    span = Span(ends, p if p.ndim == 1 else p[row : row + 2], 1, max(1, round(length / run.settings["step"])))
    piece = comparison_run(run, sampled.finished.stepper.library, span, multiple=length / parts / step, every=1)
    if piece.interrupted or piece.stopped or len(piece.rows) < 2:
        return None
    present = piece.parameters[0] if p.ndim == 1 and piece.parameters.ndim > 1 else piece.parameters
    return StepRows(piece.rows, present, NONE)


def _without_gaps(chosen: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return sorted indices with the shortest gaps between them filled in, as far as their number stays within the
    number of steps that are evaluated."""
    gaps = np.diff(chosen) - 1
    shortest = np.argsort(gaps, kind="stable")
    filled = shortest[np.cumsum(gaps[shortest]) + len(chosen) <= _MOST_STEPS]
    result = [chosen, *(np.arange(chosen[k] + 1, chosen[k + 1]) for k in filled)]
    return np.sort(np.concatenate(result))


def _shorten(text: str) -> str:
    return text if len(text) <= 70 else f"{text[:70]}..."


def _in_order(edges: Array) -> Array:
    """Return edges within 0 to 1 in order, each once."""
    edges_in_order = np.unique(edges)
    edges_in_order = edges_in_order[(edges_in_order >= 0.0) & (edges_in_order <= 1.0)]
    kept: Array = edges_in_order[np.append(True, np.diff(edges_in_order) > 1e-13)]
    return kept
