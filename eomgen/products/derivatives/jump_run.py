"""Runs of generalized-alpha with jumps made linear: samples of sampled states, and events with saltation.

A step that starts anew is linear in q, v, z, parameters, start time and size. Of a step that an event ends, the
size changes such that the function of the event stays zero: with the change dx of the end at equal size, x_h the
derivative in the size, and g the function,

    dh = -(g_x dx + g_p dp + g_t dt) / (g_x x_h + g_t),

and the next step is shorter by as much. These are derivatives of the discrete steps, to rounding; for short steps
x_h becomes the flow, and the map across an event the saltation matrix (Leine and Nijmeijer 2004, chapter 7).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass, replace
from eomgen.base.rounding import COMPUTED
from eomgen.errors import NumericalError, Problem, UsageError
from eomgen.lie import product
from eomgen.products.derivatives.alpha_run import StartedRun, step_matrices
from eomgen.products.derivatives.equations import EquationPartials, rows_of
from eomgen.products.derivatives.jump_motion import JumpMotion, JumpSegment, StepPart
from eomgen.products.derivatives.jump_partials import EventPartials, JumpPartials
from eomgen.products.derivatives.linear_run import DerivativeVariables, LinearPart, Start
from eomgen.products.derivatives.linear_steps import LinearSteps, StepMatrices
from eomgen.products.derivatives.motion import ReplayedRun, RunSegment
from eomgen.products.derivatives.start import (
    StateDirections,
    changes_of_weights,
    nearest_changes,
    position_weights,
)
from eomgen.products.derivatives.steps import STAGES, WEIGHTS
from eomgen.simulation.stepping.states import States, states_of


@dataclass(frozen=True)
class Restarts:
    """Starts of n steps that begin with newly evaluated accelerations, made linear.

    Columns of the changes are q, v, z, parameters, time and size of the step.

    Attributes
    ----------
    vdot, multipliers, a : (n, ...) accelerations, multipliers and algorithmic accelerations at the start
    state : (n, size, columns) of ``LinearSteps``
    record : (n, size, columns) of the recorded row: q, v, vdot, z, multipliers
    inertia : (n, nv) W = 1/M_ii, and ``of_inertia`` (n, nv, columns) the changes
    """

    vdot: Array
    multipliers: Array
    a: Array
    state: Array
    record: Array
    inertia: Array
    of_inertia: Array


@dataclass(frozen=True)
class LinearStretch:
    """A stretch made linear.

    Attributes
    ----------
    map : (record, columns), from q, v, z, parameters, time and size
    end : input blocks at the end, (1, ...) each
    inertia, of_inertia : as of ``Restarts``, (nv,) and (nv, columns)
    """

    map: Array
    end: dict[str, Array]
    inertia: Array
    of_inertia: Array


@dataclass(frozen=True)
class Sweep:
    """Steps of the grid without a jump, ``first`` to ``last`` of a part."""

    first: int
    last: int
    matrices: StepMatrices
    times: Array


@dataclass(frozen=True)
class Cut:
    """A linear map from the record of a row and the parameters.

    Attributes
    ----------
    step : of the part, if the map leads to the end of a cut step; -1: to the start of a step
    map : to the record at the end, or to the state of ``LinearSteps``
    inertia : changes of W; None if W is kept
    """

    step: int
    map: Array
    inertia: Array | None


@dataclass(frozen=True)
class JumpPart(LinearPart):
    """A part of a run with jumps made linear: sweeps and cuts in order."""

    moves: Sequence[Sweep | Cut]


class JumpRun(StartedRun[JumpPart]):
    """A run of generalized-alpha with samples or events, with linearised steps and jumps. A state has dq, dv, dvdot,
    da, dz, dzdot and dr, then the changes of W = 1/M_ii, then the record of the last row."""

    motion: JumpMotion

    def __init__(self, motion: ReplayedRun, start: Start, by: DerivativeVariables, rows: Sequence[int]) -> None:
        super().__init__(motion, start, by, rows)
        assert isinstance(motion, JumpMotion)  # for mypy
        count = self.equations.parameters
        self.jumps = JumpPartials(self.equations, self.run.signals, motion.stepper.layout["method"])
        self.state = np.concatenate([self.state, self.along.dp[count:], self.record])
        self.along = StateDirections(self.along.dq, self.along.dv, self.along.dz, self.along.dp[:count])
        e = self.equations
        self._split = np.cumsum([self.linear.state_size, len(self.inverse_inertia)])
        sizes = [e.nv, e.nv, e.nz, count, 1, 1]
        self._columns = [slice(end - size, end) for end, size in zip(np.cumsum(sizes), sizes, strict=True)]
        self._width = sum(sizes)
        record = np.arange(self.linear.record_size)
        self._kept_by_jumps = np.concatenate([record[: 2 * e.nv], record[3 * e.nv : 3 * e.nv + e.nz]])

    # -- sweeps ----------------------------------------------------------------------------------------------------

    def tangents(self, part: JumpPart, dp: Array, state: Array) -> Array:
        """Propagate tangents through a part of the run, samples and events included; see ``LinearRun``. ``state``
        (size, directions) becomes the tangent at the end of the part; the tangents at its rows, (steps, record,
        directions), are returned. `dp` (parameters, directions) are the changes of parameters."""
        record = np.empty((len(part.times), self.linear.record_size, state.shape[1]))
        of_steps, inertia, last = (block.copy() for block in np.split(state, self._split))
        time = np.zeros((1, state.shape[1]))
        for move in part.moves:
            if isinstance(move, Sweep):
                every = np.concatenate([dp, time, inertia])
                record[move.first : move.last], _ = self.linear.tangents(move.matrices, every, of_steps, move.times)
                last = record[move.last - 1]
                continue
            directions = np.concatenate([last, dp])
            if move.inertia is not None:
                inertia = move.inertia @ directions
            if move.step < 0:
                of_steps = np.ascontiguousarray(move.map @ directions)
            else:
                last = record[move.step] = move.map @ directions
        state[:] = np.concatenate([of_steps, inertia, last])
        return record

    def take_back(self, part: JumpPart, direct: Array, state: Array, gradient: Array) -> tuple[Array, Array]:
        """Take adjoints back through the steps, samples and events of a part, in place; see ``LinearRun``. `direct`
        (steps, record, functionals) are derivatives by the rows, ``state`` becomes the adjoint at the start, and
        derivatives by parameters are added to `gradient`."""
        of_steps, inertia, last = (np.ascontiguousarray(block) for block in np.split(state, self._split))
        size, count = self.linear.record_size, len(gradient)
        for move in reversed(part.moves):
            if isinstance(move, Sweep):
                own_direct = direct[move.first : move.last].copy()
                every = np.zeros((count + 1 + len(inertia), state.shape[1]))
                own_direct[-1] += last
                self.linear.adjoints(move.matrices, own_direct, of_steps, every, move.times)
                gradient += every[:count]
                inertia += every[count + 1 :]
                last = np.zeros_like(last)
                continue
            if move.step < 0:
                back = move.map.T @ of_steps
                of_steps = np.zeros_like(of_steps)
            else:
                back = move.map.T @ (last + direct[move.step])
                last = np.zeros_like(last)
            if move.inertia is not None:
                back += move.inertia.T @ inertia
                inertia = np.zeros_like(inertia)
            last = last + back[:size]
            gradient += back[size:]
        state[:] = np.concatenate([of_steps, inertia, last])
        return np.empty(0), np.empty(0)

    # -- linear parts ------------------------------------------------------------------------------------------------

    def values(self, part: RunSegment) -> tuple[Array, dict[str, Array]]:
        assert isinstance(part, JumpSegment)  # for mypy
        states = states_of(part.rows, self.run.model)
        return states.t, self._blocks(states, part.p, states.t)

    def without_jumps(self, part: RunSegment) -> tuple[NDArray[np.intp], dict[str, Array], dict[str, Array]]:
        assert isinstance(part, JumpSegment)  # for mypy
        plain, firsts = self._plain(part)
        pairs = [(k, stretch) for k, stretches in part.cut.items() for stretch in stretches]
        numbers = np.concatenate([plain, np.array([k for k, _ in pairs], dtype=np.intp)])
        p = np.concatenate([part.p[plain], *(stretch.p[np.newaxis] for _, stretch in pairs)])
        first = np.concatenate([firsts[plain], *(stretch.first[np.newaxis] for _, stretch in pairs)])
        last = np.concatenate([part.rows[plain + 1], *(stretch.last[np.newaxis] for _, stretch in pairs)])
        order = np.argsort(numbers, kind="stable")
        middle = self.run.grid.start + self.run.grid.step * (part.first + numbers[order] + 0.5)
        ends = (self._blocks(states_of(rows[order], self.run.model), p[order], middle) for rows in (first, last))
        return numbers[order], next(ends), next(ends)

    def linearise_part(self, part: RunSegment) -> JumpPart:
        """Return a part of the run made linear: sweeps over steps without a jump, and maps over jumps, in order."""
        assert isinstance(part, JumpSegment)  # for mypy
        states, blocks = states_of(part.rows, self.run.model), self.values(part)[1]
        plain, firsts = self._plain(part)
        anew = plain[part.anew[plain]]
        sizes = np.full(len(anew), self.run.grid.step)
        starts = self._restarts(firsts[anew], part.rows[anew + 1], part.p[anew], sizes, moving=False)
        inside = [stretch for k in sorted(part.cut) for stretch in part.cut[k]]
        stepped = self._linearise_stepped([stretch for stretch in inside if not stretch.short])
        stretches = (self._linearise_short_stretch(item) if item.short else next(stepped) for item in inside)
        cuts = {k: self._through(part, blocks, k, stretches) for k in sorted(part.cut)}
        kept = {k: inertia for k, (_, inertia) in cuts.items()}
        matrices = self._matrices(part, starts, kept)
        # by the step before which a map comes, or with which a sweep begins
        moves: dict[tuple[int, bool], Sweep | Cut] = {(k, False): cut for k, (cut, _) in cuts.items()}
        moves |= {(step, False): cut for step, cut in self._into_starts(part, blocks, anew, starts).items()}
        breaks = np.flatnonzero((np.diff(plain) > 1) | part.anew[plain[1:]]) + 1
        for first, last in pairwise([0, *breaks.tolist(), len(plain)] if len(plain) else ()):
            steps = plain[first:last]
            step, times = int(steps[0]), states.t[steps + 1]
            moves[step, True] = Sweep(step, int(steps[-1]) + 1, rows_of(matrices, slice(first, last)), times)
        return JumpPart(part.first, states, blocks, [moves[key] for key in sorted(moves)])

    def _plain(self, part: JumpSegment) -> tuple[NDArray[np.intp], Array]:
        """Return the steps that are not cut, and the rows at the starts of all steps with the values held over them."""
        firsts, held = part.rows[:-1].copy(), self.motion.sampled_places
        firsts[:, held] = part.rows[1:, held]
        return np.array([k for k in range(len(part.samples)) if k not in part.cut], dtype=np.intp), firsts

    def _matrices(self, part: JumpSegment, starts: Restarts, kept: Mapping[int, Array]) -> StepMatrices:
        """Return the matrices of the steps without a jump inside, with a column for time after the parameters. `starts`
        are the starts of steps that start anew, in order, ``kept`` W = 1/M_ii after cut steps."""
        plain, firsts = self._plain(part)
        before, after = (states_of(rows, self.run.model) for rows in (firsts[plain], part.rows[plain + 1]))
        into = {step: number for number, step in enumerate(plain[part.anew[plain]].tolist())}
        of_ends = self.equations.blocks(self._blocks(after, part.p[plain + 1], after.t))
        known, a = part.memory, np.zeros((len(plain), self.equations.nv))
        inertia, every = part.inertia, np.zeros((len(plain), len(part.inertia)))
        for position, step in enumerate(plain.tolist() if len(inertia) else ()):
            if step in into:
                known, before.a[position] = starts.a[into[step]], starts.vdot[into[step]]
                inertia = starts.inertia[into[step]] if part.begun[step] else kept.get(step - 1, inertia)
            a[position], every[position] = known, inertia
            known = self._next(known, before.a[position], after.a[position])
        time = np.zeros((len(plain), self.equations.rows, 1))
        return self._step_matrices(of_ends, time, before, after, part.p[plain], a, every, self.run.grid.step)

    def _next(self, a: Array, vdot: Array, vdot_next: Array) -> Array:
        """Return the algorithmic acceleration at the end of a step."""
        _, alpha_m, alpha_f, *_ = self.coefficients
        reached: Array = ((1.0 - alpha_f) * vdot_next + alpha_f * vdot - alpha_m * a) / (1.0 - alpha_m)
        return reached

    def _step_matrices(
        self,
        blocks: Mapping[str, Array],
        more: Array,
        before: States,
        after: States,
        p: Array,
        a: Array,
        inertia: Array,
        size: Any,
    ) -> StepMatrices:
        """Return the matrices of steps from partials of the equations at the ends, with ``more`` (n, rows, columns),
        changes of e with time and size, after the parameters."""
        e, blocks = self.equations, dict(blocks)
        parts = np.split(more, np.cumsum([e.nv, e.nz, e.holonomic]), axis=1)
        parts[1] = -parts[1]  # e has minus the rates
        for name, part in zip(("Rp", "Fp", "Hp", "Zp"), parts, strict=True):
            blocks[name] = np.concatenate([blocks[name], part], axis=2)
        coefficients, values = (size, *self.coefficients[1:]), self._blocks(before, p, before.t)
        return step_matrices(e, blocks, before, after, values, a, coefficients, inertia)[0]

    # -- starts ----------------------------------------------------------------------------------------------------

    def _into_starts(
        self, part: JumpSegment, blocks: dict[str, Array], anew: NDArray[np.intp], starts: Restarts
    ) -> dict[int, Cut]:
        """Return for each step in `anew` the linear map from the row before the step to the state of its new start. The
        maps include the samples due there; `starts` are the starts made linear, in the same order."""
        values = rows_of(blocks, anew)
        jumped = self.jumps.sample_partials(values, part.samples[anew], self._rates(values["t"]))
        e, count, record = self.equations, self.equations.parameters, self.linear.record_size
        result = {}
        for number, step in enumerate(anew.tolist()):
            moved = np.zeros((self._width, record + count))
            moved[: 2 * e.nv + e.nz] = jumped[number][:, :-1]
            moved[self._columns[3], record:] = np.eye(count)
            inertia = starts.of_inertia[number] @ moved if part.begun[step] and len(self.inverse_inertia) else None
            result[step] = Cut(-1, starts.state[number] @ moved, inertia)
        return result

    def _restarts(
        self, rows: Array, ends: Array, p: Array, sizes: Array, *, moving: bool, whole: bool = True
    ) -> Restarts:
        """Return the starts of steps from rows (n, width) made linear; ``sizes`` (n,) are in s, ``ends`` the rows at
        their ends.

        Raises NumericalError for a damped first step.

        Parameters
        ----------
        p : (n, np) parameters
        moving : whether times and sizes change
        whole : whether accelerations at the ends are known
        """
        e, factors, count = self.equations, self.equations.model.factors, len(rows)
        nv, nl, nh = e.nv, e.nl, e.holonomic
        states = states_of(rows, self.run.model)
        of_q, of_v, of_z, of_p, of_t, of_h = self._columns
        unit = np.broadcast_to(np.eye(self._width), (count, self._width, self._width))
        dq, dv, dz, dp, dt = (unit[:, columns] for columns in (of_q, of_v, of_z, of_p, of_t))
        values, partials, forced = self._accelerate(states, p, states.t, moving=moving)
        if nl:
            dq, dv = nearest_changes(e, partials, dq, dv, np.concatenate([dp, dt], axis=1))
        vdot, changes = values["a"], forced @ np.concatenate([dq, dv, dz, dp, dt], axis=1)
        dvdot, dlam, dzdot = np.split(changes, [nv, nv + nl], axis=1)
        _, alpha_m, alpha_f, *_ = self.coefficients
        share, slope, dslope = alpha_m - alpha_f, WEIGHTS[0] * vdot, WEIGHTS[0] * dvdot
        for weight, stage in zip(WEIGHTS[1:], STAGES[1:], strict=True) if share else ():
            s = (stage * sizes)[:, np.newaxis]
            theta = s * (states.v + 0.5 * s * vdot)
            in_size = stage * (states.v + s * vdot)[..., np.newaxis] * unit[:, of_h]
            dtheta = s[..., np.newaxis] * (dv + 0.5 * s[..., np.newaxis] * dvdot) + in_size
            there_q = product.transport(factors, theta) @ dq + product.tangent(factors, theta) @ dtheta
            there_v = dv + s[..., np.newaxis] * dvdot + stage * vdot[..., np.newaxis] * unit[:, of_h]
            q, v = product.update(factors, states.q, theta), states.v + s * vdot
            there = states._replace(t=states.t + s[:, 0], q=q, v=v)
            along = np.concatenate([there_q, there_v, dz, dp, dt + stage * unit[:, of_h]], axis=1)
            ahead, _, forced = self._accelerate(there, p, states.t, moving=moving)
            slope, dslope = slope + weight * ahead["a"], dslope + weight * forced[:, :nv] @ along
        a = vdot + share * slope
        inertia, of_inertia = np.zeros((count, 0)), np.zeros((count, 0, self._width))
        if len(self.inverse_inertia):
            angular = np.array([unit == "rad/s" for unit in e.model.v_units])
            inertia = position_weights(partials.Ja[:, :nv], angular)
            of_inertia = changes_of_weights(e, self._blocks(states, p, states.t), inertia, dq, dp)
        kept = np.ones(count, dtype=bool)
        forces = partials.Jlam[:, :nv, :nh] * inertia[..., np.newaxis] if inertia.size else None
        after = states_of(ends, self.run.model)
        off = partial(self._off, states, after, vdot, sizes=sizes, forces=forces, whole=whole)
        if share:
            taken, left = off(a), off(vdot)
            kept = taken <= left
            a = np.where(kept[:, np.newaxis], a, vdot)
        if ends is not rows:  # a step follows
            at_ends = np.concatenate([vdot, a, after.a], axis=1)
            self._check_first_steps(states, after, at_ends, off(a), sizes, whole=whole)
        da = dvdot + share * kept[:, np.newaxis, np.newaxis] * dslope
        state = np.concatenate([dq, dv, dvdot, da, dz, dzdot, dzdot], axis=1)
        record = np.concatenate([dq, dv, dvdot, dz, dlam], axis=1)
        return Restarts(vdot, values["lam"], a, state, record, inertia, of_inertia)

    def _off(
        self, states: States, after: States, vdot: Array, a: Array, *, sizes: Array, forces: Array | None, whole: bool
    ) -> Array:
        """Return the largest deviation of each step from the method's formulas with algorithmic accelerations ``a``,
        (n,). Of velocities, or of positions across the directions W B^T, ``forces``, if accelerations at the ends are
        not known (not `whole`)."""
        h, _, _, beta, gamma = (*sizes[np.newaxis, :, np.newaxis], *self.coefficients[1:5])
        if whole:
            off = after.v - states.v - h * ((1.0 - gamma) * a + gamma * self._next(a, vdot, after.a))
        else:
            reached = ((after.v - states.v) / np.maximum(h, np.finfo(float).tiny) - (1.0 - gamma) * a) / gamma
            theta = product.difference(self.equations.model.factors, states.q, after.q)
            off = theta - h * (states.v + h * ((0.5 - beta) * a + beta * reached))
            if forces is not None:
                pairs = zip(forces, off, strict=True)
                off = np.array([vector - G @ np.linalg.lstsq(G, vector, rcond=None)[0] for G, vector in pairs])
        deviations: Array = np.max(np.abs(off), axis=1, initial=0.0)
        return deviations

    def _check_first_steps(
        self, states: States, after: States, a: Array, off: Array, sizes: Array, *, whole: bool
    ) -> None:
        """Raise NumericalError if a first step after a jump was damped: it deviates from the method by too much. ``a``
        are accelerations at both ends, ``off`` (n,) the deviations of ``_off``."""
        change = sizes * np.max(np.abs(a), axis=1, initial=0.0)
        change = change + COMPUTED * np.max(np.abs(np.concatenate([after.v, states.v], axis=1)), axis=1, initial=0.0)
        rounded = 1e-13 * np.max(np.abs(states.q), axis=1, initial=1.0)
        wrong = off > (1e-3 * change if whole else 1e-3 * change * sizes + rounded)  # of another method
        if wrong.any():
            t = float(states.t[int(np.argmax(wrong))])
            fault = f"the jump at t = {t:.6g} s excites motions too fast for the step: no derivatives [E0581]"
            hint = f"a step of {0.1 * self.run.grid.step:.3g} s"
            raise NumericalError(Problem("sensitivities", fault, hint))

    def _accelerate(
        self, states: States, p: Array, at: Array, *, moving: bool
    ) -> tuple[dict[str, Array], EquationPartials, Array]:
        """Return input blocks with accelerations and multipliers at n states, the partials of e, and changes of
        accelerations, multipliers and rates (``forced_changes``). `at` are times within the steps, `moving`: whether
        partials in time are needed."""
        values = self.equations.with_accelerations(self._blocks(states, p, at))
        partials, of_accelerations = self.equations.partials(values), None
        column = np.zeros(partials.P.shape[:2])
        if moving:
            column, of_accelerations = self.jumps.by_time(values, self._rates(at))
        partials = replace(partials, P=np.concatenate([partials.P, column[..., np.newaxis]], axis=2))
        return values, partials, self.equations.forced_changes(values, partials, of_accelerations)

    # -- cut steps ---------------------------------------------------------------------------------------------------

    def _through(
        self, part: JumpSegment, blocks: dict[str, Array], step: int, stretches: Iterator[LinearStretch]
    ) -> tuple[Cut, Array]:
        """Return the map of a cut step from the record before it and the parameters to the record at its end, and W
        there. A cut step has samples or events inside; `stretches` yields its parts made linear. `blocks` are input
        blocks at the rows of the part."""
        count, size = self.equations.parameters, self.linear.record_size
        start = rows_of(blocks, slice(step, step + 1))
        record, dp = np.eye(size + count)[:size], np.eye(size + count)[size:]
        time = np.zeros((1, size + count))
        event: EventPartials | None = None
        for stretch in part.cut[step]:
            rates = self._rates(np.array([0.5 * (stretch.first[0] + stretch.last[0])]))
            directions = np.concatenate([record, dp, time])
            jumped = directions[self._kept_by_jumps]
            if event is not None:
                jumped = event.state @ directions
            elif stretch.samples.any():
                jumped = self.jumps.sample_partials(start, stretch.samples[np.newaxis], rates)[0] @ directions
            made = next(stretches)
            start, through = made.end, made.map
            before, by_size = through[:, :-1] @ np.concatenate([jumped, dp, time]), through[:, -1]
            entering = np.concatenate([jumped, dp, time])
            change, event = -time, None
            if stretch.event >= 0:
                event = self.jumps.event_partials(start, stretch.event, rates)
                along = np.concatenate([by_size, np.zeros(count), [1.0]])
                rate = event.guard @ along
                self._check_event(event, stretch, start, float(rate), directions)
                change = -(event.guard @ np.concatenate([before, dp, time]))[np.newaxis] / rate
            record, time = before + by_size[:, np.newaxis] * change, time + change
        inertia = made.of_inertia @ np.concatenate([entering, change])
        if part.cut[step][-1].renews:
            row, p = part.rows[step + 1 : step + 2], part.p[step + 1 : step + 2]
            renewed = self._restarts(row, row, p, np.array([self.run.grid.step]), moving=False, whole=False)
            record = renewed.record[0] @ np.concatenate([record[self._kept_by_jumps], dp, np.zeros((2, size + count))])
        return Cut(step, record, inertia if len(inertia) else None), made.inertia

    def _linearise_short_stretch(self, stretch: StepPart) -> LinearStretch:
        """Return a very short part of a cut step, which the stepper takes by two terms of a Taylor series, made
        linear."""
        e, h = self.equations, np.array([stretch.last[0] - stretch.first[0]])
        nv, nz = e.nv, e.nz
        first, last, p = stretch.first[np.newaxis], stretch.last[np.newaxis], stretch.p[np.newaxis]
        middle = np.array([0.5 * (stretch.first[0] + stretch.last[0])])
        starts = self._restarts(first, last, p, h, moving=True, whole=False)
        before, after = states_of(first, self.run.model), states_of(last, self.run.model)
        by_size = np.zeros((1, self._width))
        by_size[0, -1] = 1.0
        dq, dv, dvdot, _, dz, dzdot, _ = np.split(starts.state[0], np.cumsum([nv, nv, nv, nv, nz, nz]))
        values = self._blocks(before, p, middle)
        zdot = e.of("internal_rate", values)["zdot"] if nz else np.zeros((1, 0))
        moved = [
            dq + h * dv + before.v.T * by_size,
            dv + h * dvdot + starts.vdot.T * by_size,
            dvdot,
            dz + h * dzdot + zdot.T * by_size,
            starts.record[0][3 * nv + nz :],
        ]
        ended = self._blocks(after._replace(a=starts.vdot, multipliers=starts.multipliers), p, middle)
        return LinearStretch(np.concatenate(moved), ended, starts.inertia[0], starts.of_inertia[0])

    def _linearise_stepped(self, stretches: Sequence[StepPart]) -> Iterator[LinearStretch]:
        """Yield the parts of cut steps that are taken as whole steps of their own size, made linear, in order."""
        if not stretches:
            return
        e, factors = self.equations, self.equations.model.factors
        nv, nz, nl, count = e.nv, e.nz, e.nl, e.parameters
        first, last, p = (np.array([getattr(item, name) for item in stretches]) for name in ("first", "last", "p"))
        sizes, middle = last[:, 0] - first[:, 0], 0.5 * (first[:, 0] + last[:, 0])
        moving, h = any(stretch.event >= 0 for stretch in stretches), sizes[:, np.newaxis]
        starts = self._restarts(first, last, p, sizes, moving=moving, whole=False)
        before, after = states_of(first, self.run.model), states_of(last, self.run.model)
        _, alpha_m, alpha_f, beta, gamma, _, _ = self.coefficients
        a = starts.a
        reached = ((after.v - before.v) / h - (1.0 - gamma) * a) / gamma
        vdot = ((1.0 - alpha_m) * reached + alpha_m * a - alpha_f * starts.vdot) / (1.0 - alpha_f)
        after = after._replace(a=vdot, multipliers=np.zeros((len(h), nl)))
        values = self._blocks(after, p, middle)
        if nl:
            (residual,) = e.of("residual", values).values()
            pairs = zip(e.of("constraint_jacobian", values)["B"], residual, strict=True)
            lam = np.array([-np.linalg.lstsq(B.T, r, rcond=None)[0] for B, r in pairs])
            after = after._replace(multipliers=lam)
            values = self._blocks(after, p, middle)
        by_time = self.jumps.by_time(values, self._rates(middle))[0] if moving else np.zeros((len(h), e.rows))
        of_ends = e.blocks(values)
        partials = e.join(of_ends)
        theta = product.difference(factors, before.q, after.q)
        exponents = theta / h + h * ((0.5 - beta) * a + beta * reached)
        in_q = (product.tangent(factors, theta) @ exponents[..., np.newaxis])[..., 0]
        in_v, in_z = (after.v - before.v) / h, (after.z - before.z) / h
        parts = (partials.Jq, in_q), (partials.Jv, in_v), (partials.Jz, in_z)
        in_size = sum((J @ change[..., np.newaxis] for J, change in parts), np.zeros(()))
        more = np.concatenate([by_time[..., np.newaxis], in_size], axis=2)
        made = self._step_matrices(of_ends, more, before._replace(a=starts.vdot), after, p, a, starts.inertia, h)
        dp = np.zeros((count + 2 + starts.inertia.shape[1], self._width))
        dp[:count, self._columns[3]] = np.eye(count)
        dp[count, -2:] = dp[count + 1, -1] = 1.0
        for k, size in enumerate(sizes.tolist()):
            dp[count + 2 :] = starts.of_inertia[k]
            matrices = rows_of(made, slice(k, k + 1))
            steps = LinearSteps(e.model.functions.sizes, factors, (size, *self.coefficients[1:]), e.holonomic)
            record, _ = steps.tangents(matrices, dp, starts.state[k].copy(), after.t[k : k + 1])
            through = record[0]
            through[:nv, -1] += in_q[k]
            through[nv : 2 * nv, -1] += in_v[k]
            through[3 * nv : 3 * nv + nz, -1] += in_z[k]
            ended = rows_of(values, slice(k, k + 1))
            yield LinearStretch(through, ended, starts.inertia[k], starts.of_inertia[k])

    def _check_event(
        self, event: EventPartials, stretch: StepPart, values: dict[str, Array], rate: float, directions: Array
    ) -> None:
        """Raise NumericalError for an event at which the motion grazes, and UsageError for a mode whose new value
        depends on directions. `rate` is the rate of the event's function, `values` are input blocks at the event."""
        e, row = self.equations, self.motion.stepper.layout["method"]["events"]["rows"][stretch.event]
        q, v = np.abs(event.guard[: e.nv]), np.abs(event.guard[e.nv : 2 * e.nv])
        speed, acceleration = np.abs(values["v"][0]), np.abs(values["a"][0])
        largest = q @ (speed + self.run.grid.step * acceleration) + v @ acceleration + abs(event.guard[-1])
        if not abs(rate) > 1e-5 * largest:  # the terms of the rate cancel
            at = f"{row['name']}, t = {stretch.last[0]:.9g} s"
            fault = f"the motion grazes at the event {at}, and the time of the event has no derivative [E0582]"
            raise NumericalError(Problem("sensitivities", fault, "other parameters, or a later or an earlier event"))
        if row["action"] != "switch":
            return
        switched = self.motion.stepper.layout["method"]["events"]["modes"][row["mode"]]
        if np.any(event.mode @ directions) or switched["parameter"] in e.chosen:
            mode = switched["name"]
            fault = f"the event {row['name']} sets the mode {mode}, whose value depends on the directions [E0583]"
            raise UsageError(Problem("sensitivities", fault, "a number as value of the mode, and by=... without it"))

    # -- inputs ----------------------------------------------------------------------------------------------------

    def _blocks(self, states: States, p: Array, at: Array) -> dict[str, Array]:
        """Return input blocks at n states with parameters `p`, (np,) or (n, np); ``at`` are times (n,) within the
        steps, which decide between which rows inputs are interpolated."""
        modes = self.motion.stepper.layout["method"].get("events", {}).get("modes")
        rows = np.broadcast_to(p, (len(states.t), p.shape[-1])) if modes else self.equations.p
        return {**self.blocks(states, self.prescribe(states.t, at, rows)), "p": rows}

    def _rates(self, at: Array) -> Array:
        """Return the rates (n, nu) of inputs given by rows, at times (n,); zeros for other inputs."""
        if not self.run.takes_rows:
            return np.zeros((len(at), self.run.model.nu))
        signals, (_, (first, last)) = self.run.signals, self.ends_of_steps(at)
        by_rows = [name in signals.given or not signals.left_to_stepper for name in signals.names]
        result: Array = np.where(by_rows, last - first, 0.0) / self.run.grid.step
        return result
