"""The fastest rates of the equations along a run, which its steps have to resolve.

Differences of runs at other steps show the error if the step resolves the fastest rate of the equations: only then do
errors follow powers of the step (Hairer, Norsett, Wanner: Solving Ordinary Differential Equations I, 1993, II.4). If it
does not, runs at h, 2h and h/2 may be wrong alike. For x' = lambda x,

- an explicit method grows if -h lambda is above the end of its interval of stability (IV.2 of Hairer, Wanner: Solving
  Ordinary Differential Equations II, 1996). Friction bounds the growth: the run chatters about a level that the
  equations hold from both sides (Filippov: Differential Equations with Discontinuous Righthand Sides, 1988, 4), and
  the force there is an average that the law does not give;
- an implicit method reproduces a growth h lambda below 1 alone: at 2 it has a pole, beyond it growth turns into decay
  (IV.3), so that a falling characteristic is passed over, and the run stays on the wrong branch. There are branches
  if the acceleration has both signs within the step. If it has one, every motion goes through the law with the same
  v(t) but for a shift of time, and differences of v grow by the ratio of the accelerations after and before, in all
  runs alike;
- a law that is passed in one step, h |lambda| above 1 within the step and below 1 at an end of it, is a jump for the
  steps: errors are of first order with a factor that depends on its place in the step.

Rates of laws in velocities are slopes of accelerations, a_j over v_j with all else held but for the constraints,
between the values of v_j at both ends of a step, on a mesh that halves towards v_j = 0: no width of a law is assumed.
The steps are the steps with the largest changes of accelerations. At some rows, eigenvalues of the slopes in all
directions of the tangent are added.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.compiled.constraints import NEEDED
from eomgen.compiled.equations import accelerations, free_directions, has_residual_partials, residual_partials
from eomgen.errors import EomgenError
from eomgen.simulation.accuracy.motion_size import REST, ROWS, reach_of
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import States, states_of

STEEP_PART = Limit(
    0.1,
    "1",
    "change of an acceleration by a steep law, in parts of the change in a step",
    "a choice: the part from which a force is seen in a plot",
)
#: Halvings of a velocity down to half of the digits of doubles, and the last part: differences of accelerations over
#: smaller ones are rounding; singular values of B that are smaller belong to redundant rows.
_HALVINGS = np.finfo(np.float64).nmant // 2
_HALF_OF_DIGITS = math.ldexp(1.0, -_HALVINGS)


class Rate(NamedTuple):
    """A rate of the equations, 1/s, at a time in s, with the name of its velocity or kind of states. The default stands
    for a motion without decay and growth."""

    rate: float = 0.0
    time: float = math.nan
    name: str = ""


class FastestRates(NamedTuple):
    """The fastest rates along a run.

    Attributes
    ----------
    decay : of velocities at the rows, and about levels that hold a velocity
    growth : of velocities in a law that a step passes, with accelerations of both signs
    passed : the steepest law that a step passes, of either sign
    states : decay of internal states at the rows
    """

    decay: Rate = Rate()
    growth: Rate = Rate()
    passed: Rate = Rate()
    states: Rate = Rate()


def fastest_rates(run: Run, rows: Array, parameters: Array) -> FastestRates:
    """Return the fastest rates of decay and growth in the equations along a run.

    Rates are 0 if the run has one row, or if the equations give no numbers at some state.

    Parameters
    ----------
    rows : (n, width) of the record
    parameters : (np,), or (n, np), at the rows
    """
    try:
        return _RateSearch(run, rows, parameters).fastest() if len(rows) > 1 else FastestRates()
    except (EomgenError, np.linalg.LinAlgError, KeyError):  # states at which the equations give no numbers
        return FastestRates()


class _RateSearch:
    def __init__(self, run: Run, rows: Array, parameters: Array) -> None:
        self._run, self._model = run, run.model
        self._states: States = states_of(rows, run.model, views=True)
        self._p = parameters
        #: Velocities that go as far as the coordinates in the run.
        self._slow = reach_of(self._model, self._states.q) / float(np.ptp(self._states.t))
        # half as many evaluations as the run has steps
        self._left = max(int(0.5 * (rows[-1, 0] - rows[0, 0]) / run.settings["step"]), 2 * (_HALVINGS + 2))

    def fastest(self) -> FastestRates:
        model, count = self._model, len(self._states.t)
        needed = NEEDED if model.multipliers else ("forward_dynamics",)
        resisted = model.functions.library.layout["facts"]["velocity_forces"]  # else no velocity decays or grows
        moves = bool(model.nv) and resisted and all(map(model.functions.for_runs, needed))  # compiles no other function
        decay = growth = passed = Rate()
        for step, column in self._steepest() if moves else ():
            decays, grows, passes = self._within(step, column)
            decay, growth, passed = max(decay, decays), max(growth, grows), max(passed, passes)
        spread = sorted(set(np.linspace(0, count - 1, min(count, ROWS)).astype(int).tolist()))
        if moves:
            decay = max([decay, *filter(None, map(self._lasting, spread))], key=lambda item: item.rate)
        states = max([Rate(), *map(self._state_decay, spread)]) if model.nz else Rate()
        return FastestRates(decay, growth, passed, states)

    def _inputs(self, row: int) -> Array | None:
        if not self._model.nu:
            return None
        t = self._states.t[row : row + 1]
        return self._run.signals.rows(t)[0] if self._run.takes_rows else None

    def _parameters(self, row: int) -> Array:
        return self._p if self._p.ndim == 1 else self._p[row]

    def _accelerations(self, row: int, v: Array) -> Array:
        """Return accelerations (m, nv) at velocities (m, nv), with time, q, z, inputs and parameters of one row. The
        remaining budget of evaluations falls by m."""
        states = self._states
        self._left -= len(v)
        with np.errstate(all="ignore"):
            return accelerations(
                self._model,
                np.broadcast_to(states.q[row], (len(v), self._model.nq)),
                v,
                float(states.t[row]),
                self._inputs(row),
                z=states.z[row],
                parameters=self._parameters(row),
            )

    # -- laws within steps -----------------------------------------------------------------------------------------

    def _steepest(self) -> list[tuple[int, int]]:
        """Return pairs of a step's first row and a velocity's column with the largest changes of acceleration in a
        step. Changes are relative to the largest velocity of the column; steps at which the velocity passes zero come
        first."""
        t, _, v, a, *_ = self._states
        size = np.abs(v).max(axis=0)
        kicks = np.abs(np.diff(np.where(np.isfinite(a), a, 0.0), axis=0)) * np.diff(t)[:, np.newaxis]
        with np.errstate(all="ignore"):
            kicks = np.nan_to_num(kicks / size, nan=0.0, posinf=0.0)
        # laws are steep at rest, which stages of a step may pass although its end does not
        sign = np.sign(v[:-1])
        turned = (np.sign(v[1:]) * sign <= 0.0) | (np.sign(self._next_velocities()[:-1]) * sign <= 0.0)
        order = np.argsort(-np.where(turned, 1.0 + kicks, kicks), axis=0)[:ROWS]
        places = [(float(kicks[row, j]), int(row), j) for j in range(v.shape[1]) for row in order[:, j]]
        places.sort(reverse=True)
        chosen = [kick_place for kick_place in places if turned[kick_place[1], kick_place[2]]][:ROWS]
        chosen += [kick_place for kick_place in places if not turned[kick_place[1], kick_place[2]]][:ROWS]
        return [(row, j) for kick, row, j in chosen if kick > 0.0]

    def _next_velocities(self) -> Array:
        """Return the velocities one step after each row at the accelerations of the row, (n, nv)."""
        reached: Array = self._states.v + self._run.settings["step"] * np.nan_to_num(self._states.a)
        return reached

    def _within(self, step: int, column: int) -> tuple[Rate, Rate, Rate]:
        """Return three rates of the slope of one acceleration over its velocity, within the step after row `step`.
        These are the decay to a level that holds the velocity, the growth if the acceleration has both signs, and the
        steepest slope of either sign. All are 0 if the budget is spent, if the velocity is held by constraints,
        if changes are rounding, or if the slope is as steep at both ends."""
        none, v = Rate(), self._states.v
        if self._left < _HALVINGS:
            return none, none, none
        ends = float(v[step, column]), float(v[step + 1, column]), float(self._next_velocities()[step, column])
        levels = max(map(abs, ends)) * np.ldexp(1.0, -np.arange(_HALVINGS))
        levels = np.array(sorted({*ends, 0.0, *levels.tolist(), *(-levels).tolist()}))
        levels = levels[(levels >= min(ends)) & (levels <= max(ends))]
        way = self._way(step, column)
        if len(levels) < 2 or way is None:
            return none, none, none
        there = v[step] + (levels - ends[0])[:, np.newaxis] * way
        a = self._accelerations(step, there)[:, column]
        change = np.diff(a)
        h = self._run.settings["step"]
        least = max(np.abs(a).max(), max(*map(abs, ends), self._slow[column]) / h)
        slopes = np.where(np.abs(change) > REST * least, change / np.diff(levels), 0.0)
        if not np.all(np.isfinite(slopes)) or np.abs(slopes[[0, -1]]).min() * h > 1.0:
            return none, none, none  # as steep outside: no law ends within the step
        time, name = float(self._states.t[step + 1]), self._model.v_names[column]
        span = float(np.sum(np.abs(change)))
        parts = {sign: float(np.sum(np.abs(change[sign * slopes * h > 1.0]))) for sign in (1.0, -1.0)}
        rise = float(slopes.max()) if parts[1.0] > STEEP_PART * span else 0.0
        decay = float(-slopes.min()) if parts[-1.0] > STEEP_PART * span else 0.0
        holds = a[0] > 0.0 > a[-1]
        if decay and holds:
            low, high = self._accelerations(step + 1, there[[0, -1]])[:, column]
            holds = bool(low > 0.0 > high)
        return (
            Rate(decay if holds else 0.0, time, name),
            Rate(rise if a.min() < 0.0 < a.max() else 0.0, time, name),
            Rate(max(decay, rise), time, name),
        )

    def _way(self, row: int, column: int) -> Array | None:
        """Return the change of all velocities, (nv,), on the tangent of the constraints if one of them changes by 1.
        None if constraints hold this velocity."""
        basis = self._free_directions(row)
        way: Array = basis @ basis[column]
        return way / way[column] if way[column] > _HALF_OF_DIGITS else None

    # -- eigenvalues at rows ---------------------------------------------------------------------------------------

    def _lasting(self, row: int) -> Rate | None:
        """Return the decay of velocities at a row; None if not known. If too fast for the method there,
        return the slower decay of this row and a neighbour: a method is unstable only if its steps stay in a steep law,
        and one step passes through a law at rest."""
        here = self._at_row(row)
        if here is None or here.rate * self._run.settings["step"] <= self._run.method.real_stability:
            return here
        last = len(self._states.t) - 1
        neighbour = self._at_row(row + 1 if row < last else max(row - 1, 0))
        return here if neighbour is None else min(here, neighbour, key=lambda item: item.rate)

    def _at_row(self, row: int) -> Rate | None:
        """Return the fastest decay of velocities at a row: the largest -Re of eigenvalues of da/dv on the tangent, or
        0. Derivatives come from partials, or from central differences without partials. None if the budget of
        evaluations is spent, or if the derivatives are not finite or missing."""
        model = self._model
        if self._left < 2 * model.nv and row:
            return None
        basis = self._free_directions(row)
        slopes = self._partials(row, basis) if has_residual_partials(model) else self._differences(row, basis)
        if slopes is None or not slopes.size or not np.all(np.isfinite(slopes)):
            return None
        values, vectors = np.linalg.eig(slopes)
        index = int(np.argmin(values.real))
        name = model.v_names[int(np.argmax(np.abs(basis @ vectors[:, index])))]
        return Rate(max(0.0, float(-values[index].real)), float(self._states.t[row]), name)

    def _free_directions(self, row: int) -> Array:
        states = self._states
        return free_directions(self._model, states.q[row], float(states.t[row]), self._parameters(row))

    def _partials(self, row: int, basis: Array) -> Array | None:
        model, states = self._model, self._states
        multipliers = {"multipliers": states.multipliers[row]} if model.multipliers else {}
        arguments: dict[str, Any] = {"z": states.z[row], "parameters": self._parameters(row), **multipliers}
        q, v, t = states.q[row], states.v[row], float(states.t[row])
        self._left -= model.nv
        with np.errstate(all="ignore"):
            _, C, M = residual_partials(model, q, v, np.zeros_like(v), t, self._inputs(row), **arguments)
            mass = basis.T @ M @ basis
            if not (np.all(np.isfinite(C)) and np.all(np.isfinite(mass)) and np.linalg.matrix_rank(mass) == len(mass)):
                return None
            result: Array = np.asarray(-np.linalg.solve(mass, basis.T @ C @ basis), dtype=float)
        return result

    def _differences(self, row: int, basis: Array) -> Array:
        v = self._states.v[row]
        fastest = np.abs(self._states.v).max(axis=0)
        slow = np.where(self._slow > 0.0, self._slow, 1.0)
        sizes = _HALF_OF_DIGITS * (np.where(fastest > 0.0, fastest, slow) @ np.abs(basis))
        ways = sizes[:, np.newaxis] * basis.T
        both = self._accelerations(row, np.concatenate([v + ways, v - ways]))
        slopes = (both[: len(ways)] - both[len(ways) :]) / (2.0 * sizes[:, np.newaxis])
        result: Array = np.asarray(basis.T @ slopes.T, dtype=float)
        return result

    def _state_decay(self, row: int) -> Rate:
        """Return the fastest decay of internal states at a row, by the eigenvalues of -Fz: 0 if no state decays."""
        model, states = self._model, self._states
        if not model.functions.for_runs("internal_partials"):
            return Rate()
        t = float(states.t[row])
        arguments = states.q[row], states.v[row], states.z[row], t, self._inputs(row)
        by_state = model.internal_partials(*arguments, parameters=self._parameters(row)).rate_z
        if not np.all(np.isfinite(by_state)):
            return Rate()
        return Rate(float((-np.linalg.eigvals(by_state).real).max(initial=0.0)), t, "internal states")
