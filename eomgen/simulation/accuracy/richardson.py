"""Errors from differences between runs, by Richardson's extrapolation.

If x_h - x = C h^p + higher powers, then x_2h - x_h = (2^p - 1) (x_h - x), and the ratio of x_4h - x_2h to x_2h - x_h
shows whether p is the method's order: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I (1993),
II.4. Rounding errors of the steps add up like independent numbers (Henrici: Discrete Variable Methods in Ordinary
Differential Equations, 1962, 1.5): after n steps to half a unit in the last place times the root of n, which is counted
in single precision. Of two runs, differences have the variances of both: if they are as small as rounding and do not
show the method's order, the error is the difference. Which runs are compared, and when there is no estimate,
``error_estimation`` decides.

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
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults
from eomgen.base.limits import Limit
from eomgen.compiled.constraints import NEEDED
from eomgen.compiled.equations import accelerations, has_residual_partials, residual_partials
from eomgen.errors import EomgenError
from eomgen.lie.product import Factor
from eomgen.results.error_estimate import NONE, OWN, ErrorEstimate, LargestError
from eomgen.simulation.accuracy.comparison_runs import SAME_TIME, ComparisonRuns, MotionDifference
from eomgen.simulation.accuracy.motion_size import Kinds, MotionSize, columns_of, reach_of, shares
from eomgen.simulation.stepping.run import Run
from eomgen.simulation.stepping.states import States, states_of

#: Differences above this part of the motion are too large to follow powers of the step.
_SATURATED = 0.1
#: How far the observed order may be from the method's.
OTHER_ORDER = 0.75
#: Scales of relative errors: of components that hardly move, and of outputs.
A_TURN = "a turn"
SMALL, RANGE = "{least}, the least that counts as its motion", "its range"
FASTEST = "the largest velocity in {unit}"
OWN_FASTEST, SMALL_RATE = "its largest", "{least}, the least that counts as its rate"


class Pair(NamedTuple):
    """Differences between neighbouring runs, and the factors from these to the error of the run.

    Attributes
    ----------
    apart : of the run from another one
    gain : from the order to the error of the run as a part of that, (n, 1)
    words : which runs these were
    near, far : differences that determine the order, as |x_2h - x_h| and |x_4h - x_2h|; of tolerances there are none
    refinement : ratio of the steps of neighbouring runs
    """

    apart: MotionDifference
    gain: Callable[[float], Array]
    words: str
    near: MotionDifference | None = None
    far: MotionDifference | None = None
    refinement: float = 2.0


def gain_by(ratio: Array) -> Callable[[float], Array]:
    """Return the gain if the steps of the other run are longer by an effective ratio, (n,); a ratio below 1 means
    shorter steps, and 1 means equal steps, whose differences do not bound the error: the gain is infinite."""

    def gain(order: float) -> Array:
        with np.errstate(divide="ignore"):
            result: Array = 1.0 / np.abs(np.power(ratio, order) - 1.0)[:, np.newaxis]
        return result

    return gain


def gain_of_shorter(order: float) -> float:
    return 1.0 / (1.0 - math.pow(2.0, -order))


def gain_of_longer(order: float) -> float:
    return 1.0 / (math.pow(2.0, order) - 1.0)


def estimate(runs: ComparisonRuns, pair: Pair, declared: float) -> ErrorEstimate:
    """Return the estimate from differences; ``declared`` is the order of the method, NaN if the method chooses its
    steps."""
    size = runs.size
    errors, orders = {}, {}
    rounding = _accumulated_rounding(runs, pair.apart.t) if runs.single else {}
    observed = np.full((2, len(pair.apart.kinds)), math.nan)
    if pair.near is not None and pair.far is not None:
        far, near = ((differ.t, _largest_parts(differ, size, pair.apart.kinds)) for differ in (pair.far, pair.near))
        observed = observed_orders(far, near, (runs.rounding, 0.0), pair.refinement)
    for (kind, apart), (orders[kind], lowest) in zip(pair.apart.kinds.items(), observed.T.tolist(), strict=True):
        used = declared if math.isnan(orders[kind]) else min(max(orders[kind], 1.0), declared)
        with np.errstate(invalid="ignore"):  # no difference of equal steps is not known, and counts as infinite
            gain = pair.gain(used)
            if math.isnan(orders[kind]) and lowest < declared - OTHER_ORDER:
                gain = np.maximum(gain, 1.0)
            errors[kind] = np.maximum(apart * gain, rounding.get(kind, 0.0))
    share = shares(errors, size)
    times = pair.apart.t
    largest = _largest_state(size, errors, share, times) if share.size else None
    outputs = {kind.partition(".")[2]: array for kind, array in errors.items() if kind.startswith("output.")}
    return ErrorEstimate(
        available=True,
        t=times,
        q_at=errors["q"],
        increment_at=errors["increment"],
        v_at=errors["v"],
        z_at=errors["z"],
        multipliers_at=errors["multipliers"],
        outputs_at=NamedResults(
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


def _largest_state(size: MotionSize, errors: Kinds, share: Array, times: Array) -> LargestError:
    """Return the largest error of coordinates and internal states relative to their motions, ``share`` (n, nv + nz)."""
    row, component = np.unravel_index(int(np.argmax(share)), share.shape)
    first = errors["increment"].shape[1]
    column = errors["increment"][:, component] if component < first else errors["z"][:, component - first]
    least = np.concatenate([size.sizes["increment"], size.sizes["z"]])[component]
    moves = math.isfinite(least)
    if not moves:  # all errors are infinite parts of no motion
        row = np.argmax(column)
    unit = size.units[component] if size.units[component] != "1" else ""
    measure = OWN if size.own[component] else SMALL.format(least=f"{least:.2g} {unit}".strip())
    return LargestError(
        size.names[component],
        float(column[row]),
        size.units[component],
        float(times[row]),
        float(share[row, component]),
        (A_TURN if size.turns[component] else measure) if moves else NONE,
    )


def _accumulated_rounding(runs: ComparisonRuns, times: Array) -> Kinds:
    """Return rounding errors of coordinates, velocities and internal states by kind, (n, size), at times (n,)."""
    model, rows = runs.run.model, runs.own.rows
    part = (times - rows[0, 0]) / max(float(np.ptp(rows[:, 0])), math.ulp(0.0))
    steps = runs.own.statistics.get("own_steps", runs.span.steps)
    grown = (0.5 * runs.last_place * np.sqrt(steps * np.clip(part, 0.0, 1.0)))[:, np.newaxis]
    sizes = {kind: np.abs(values).max(axis=0, initial=0.0) for kind, values in columns_of(model, rows).items()}
    increment = np.ones(model.nv)  # of rotations
    for factor in model.factors:
        if factor.group == "R":
            increment[factor.v] = sizes["q"][factor.q]
        else:
            increment[factor.v_start + 3 : factor.v_start + factor.v_size] = sizes["q"][factor.q][4:]
    result = {kind: grown * size for kind, size in {**sizes, "increment": increment}.items() if kind != "multipliers"}
    for factor in model.factors if len(rows) > 2 and not len(runs.own.changes) else ():
        if factor.group == "R":
            lost = np.maximum(grown * sizes["q"][factor.q], _lost_increments(runs, factor, times))
            result["q"][:, factor.q] = result["increment"][:, factor.v] = lost
    return result


def _lost_increments(runs: ComparisonRuns, factor: Factor, times: Array) -> Array:
    """Return the part of coordinates, (n, size), that sums of increments have lost at times (n,).

    Increments that hardly change are rounded alike, so that their errors add up in proportion to the steps.

    Coordinates are compared with the integral of the run's own velocities by the corrected trapezoidal rule, less the
    difference to the rule at twice the distance of rows (Davis, Rabinowitz: Methods of Numerical Integration, 1984,
    2.9).
    """
    t, q, v, a, *_ = states_of(runs.own.rows.astype(float), runs.run.model)
    q, v, a = q[:, factor.q], v[:, factor.v], np.nan_to_num(a[:, factor.v])

    def lost(every: int) -> Array:
        h = np.diff(t[::every])[:, np.newaxis]
        one, two = slice(0, -every, every), slice(every, None, every)
        parts = 0.5 * h * (v[one] + v[two]) + h**2 / 12.0 * (a[one] - a[two])
        covered = len(parts) * every + 1
        result: Array = q[:covered:every][1:] - q[0] - np.cumsum(parts, axis=0)
        return result

    single, double = lost(1)[1::2], lost(2)
    known = np.maximum(np.abs(single) - np.abs(single - double), 0.0)
    columns = [np.interp(times, t[2::2], column, left=0.0) for column in known.T]
    return np.stack(columns, axis=1)


def _since(runs: ComparisonRuns) -> str:
    """Return the first compared time of a resumed run, in words; empty for a run compared from its start."""
    first, start = float(runs.span.rows[0, 0]), runs.run.grid.start
    return f" from t = {first:.6g} s on, where the state is taken for exact" if first > start + 0.5 * runs.step else ""


def _largest_velocity(runs: ComparisonRuns, errors: Array, times: Array) -> LargestError | None:
    """Return the largest error of the velocities, (n, nv), relative to the largest velocity of the same unit, for an
    elastic coordinate of a beam relative to the largest velocity of the coordinate; None if no velocity is above
    rounding.

    A beam is measured separately, because vibrations of beams are a thousandth of the joints' velocities.
    """
    model = runs.run.model
    velocities = np.abs(runs.span.rows[:, 1 + model.nq : 1 + model.nq + model.nv]).max(axis=0)
    units = np.array(model.v_units)
    span = float(runs.span.rows[-1, 0] - runs.span.rows[0, 0])
    least = runs.size.sizes["increment"] / span  # smaller velocities are rounding
    measures = np.maximum(velocities, np.where(np.isfinite(least), least, 0.0))
    fastest = np.zeros(model.nv)
    for unit in set(model.v_units):
        fastest[units == unit] = measures[units == unit].max()
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
    return LargestError(model.v_names[column], error, unit, time, float(share[row, place]), measure)


def _largest_output(runs: ComparisonRuns, errors: Kinds, times: Array) -> LargestError | None:
    """Return the largest error of the outputs relative to their ranges; None without outputs, or if all coordinates
    rest, so that ranges are rounding."""
    if runs.size.still:
        return None
    units = {item["name"]: item["unit"] for item in runs.run.model.library.layout["outputs"]}
    result = []
    for kind, array in errors.items():
        name = kind.partition(".")[2]
        if not name or not array.size:
            continue
        share = shares(errors, runs.size, (kind,))
        row, place = np.unravel_index(int(np.argmax(share)), share.shape)
        label = f"output {name}{f'[{place}]' if array.shape[1] > 1 else ''}"
        result.append(
            LargestError(
                label, float(array[row, place]), units[name], float(times[row]), float(share[row, place]), RANGE
            )
        )
    return max(result, key=lambda item: item.share, default=None)


def _largest_parts(differ: MotionDifference, size: MotionSize, kinds: Iterable[str]) -> Array:
    """Return the largest component of the differences of given kinds as a part of the motion, (n, kinds)."""
    with np.errstate(all="ignore"):
        parts = [(differ.kinds[kind] / size.sizes[kind]).max(axis=1, initial=0.0) for kind in kinds]
    return np.stack(parts, axis=1)


def observed_orders(
    far: tuple[Array, Array], near: tuple[Array, Array], floors: Sequence[float], ratio: float = 2.0
) -> Array:
    """Return observed orders of convergence, (floors, kinds); NaN if the differences of a kind are rounding.

    Compared are the running maxima at the last row at which both differences follow powers of the step.

    Parameters
    ----------
    far, near : times (n,) in s and differences (n, kinds) as parts of the motion, of x_4h - x_2h and of x_2h - x_h
    floors : differences that are rounding
    ratio : of the steps of neighbouring runs
    """
    result = np.full((len(floors), far[1].shape[1]), math.nan)
    if not len(far[0]) or not len(near[0]):
        return result
    (t, theirs), (near_t, ours) = (
        (times, np.maximum.accumulate(np.nan_to_num(parts, nan=np.inf))) for times, parts in (far, near)
    )
    places = np.searchsorted(near_t, t + SAME_TIME * (near_t[-1] - near_t[0]) / len(near_t), side="right") - 1
    seen = (places >= 0) & (t <= near_t[-1])
    ours, theirs = ours[places[seen]], theirs[seen]
    if not len(ours):
        return result
    with np.errstate(all="ignore"):
        orders = np.log2(theirs / ours) / math.log2(ratio)
    for place, floor in enumerate(floors):
        known = (ours > floor) & (theirs > floor) & np.isfinite(theirs)
        calm = known & (theirs < _SATURATED)
        rows = np.where(calm.any(axis=0), len(calm) - 1 - np.argmax(calm[::-1], axis=0), np.argmax(known, axis=0))
        result[place] = np.where(known.any(axis=0), np.take_along_axis(orders, rows[np.newaxis], axis=0)[0], math.nan)
    return result


#: Places along a run, of each kind, at which rates are looked for at most.
_PLACES = 8
#: Part of the evaluations of a run, one for each step, that its judgement may take.
_BUDGET = 0.5
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
    """A rate of the equations, 1/s, at a time, s, with the velocity or the kind of states in words; by default of a run
    without decay and growth."""

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
    """Return the fastest rates along a run.

    Parameters
    ----------
    rows : (n, width) of the record
    parameters : (np,), or (n, np), at the rows
    """
    try:
        return _Rates(run, rows, parameters).fastest() if len(rows) > 1 else FastestRates()
    except (EomgenError, np.linalg.LinAlgError, KeyError):  # states at which the equations give no numbers
        return FastestRates()


class _Rates:
    def __init__(self, run: Run, rows: Array, parameters: Array) -> None:
        self._run, self._model = run, run.model
        self._states: States = states_of(rows, run.model, views=True)
        self._p = parameters
        self._left = max(int(_BUDGET * (rows[-1, 0] - rows[0, 0]) / run.settings["step"]), 2 * (_HALVINGS + 2))

    def fastest(self) -> FastestRates:
        model, count = self._model, len(self._states.t)
        needed = NEEDED if model.multipliers else ("forward_dynamics",)
        resisted = model.functions.library.layout["facts"]["velocity_forces"]  # else no velocity decays or grows
        moves = bool(model.nv) and resisted and all(map(model.functions.of_runs, needed))  # compiles no other function
        decay = growth = passed = Rate()
        for step, column in self._steepest() if moves else ():
            held, grows, passes = self._within(step, column)
            decay, growth, passed = max(decay, held), max(growth, grows), max(passed, passes)
        spread = sorted(set(np.linspace(0, count - 1, min(count, _PLACES)).astype(int).tolist()))
        if moves:
            decay = max([decay, *filter(None, map(self._lasting, spread))], key=lambda one: one.rate)
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
        """Return accelerations at velocities (m, nv), all else as at a row."""
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
        """Return the steps, and the velocities, whose accelerations change most, relative to the velocities."""
        t, _, v, a, *_ = self._states
        size = np.abs(v).max(axis=0)
        kicks = np.abs(np.diff(np.where(np.isfinite(a), a, 0.0), axis=0)) * np.diff(t)[:, np.newaxis]
        with np.errstate(all="ignore"):
            kicks = np.nan_to_num(kicks / size, nan=0.0, posinf=0.0)
        # laws are steep at rest, which stages of a step may pass although its end does not
        sign = np.sign(v[:-1])
        turned = (np.sign(v[1:]) * sign <= 0.0) | (np.sign(self._next_velocities()[:-1]) * sign <= 0.0)
        order = np.argsort(-np.where(turned, 1.0 + kicks, kicks), axis=0)[:_PLACES]
        places = [(float(kicks[row, j]), int(row), j) for j in range(v.shape[1]) for row in order[:, j]]
        places.sort(reverse=True)
        chosen = [one for one in places if turned[one[1], one[2]]][:_PLACES]
        chosen += [one for one in places if not turned[one[1], one[2]]][:_PLACES]
        return [(row, j) for kick, row, j in chosen if kick > 0.0]

    def _next_velocities(self) -> Array:
        """Return the velocities one step after each row at the accelerations of the row, (n, nv)."""
        reached: Array = self._states.v + self._run.settings["step"] * np.nan_to_num(self._states.a)
        return reached

    def _within(self, step: int, column: int) -> tuple[Rate, Rate, Rate]:
        """Return the decay to a level that holds the velocity, the growth, and the steepest slope within a step."""
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
        noticed = np.abs(change) > 1e-9 * np.abs(a).max()
        slopes = np.where(noticed, change / np.diff(levels), 0.0)
        h = self._run.settings["step"]
        if not np.all(np.isfinite(slopes)) or np.abs(slopes[[0, -1]]).min() * h > 1.0:
            return none, none, none  # as steep outside: no law ends within the step
        time, name = float(self._states.t[step + 1]), self._model.v_names[column]
        span = float(np.sum(np.abs(change)))
        steep = {sign: sign * slopes * h > 1.0 for sign in (1.0, -1.0)}
        parts = {sign: float(np.sum(np.abs(change[where]))) for sign, where in steep.items()}
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
        """Return the change of velocities, (nv,), along with one of them, on the tangent; None if it is held."""
        basis = self._tangent(row)
        way: Array = basis @ basis[column]
        return way / way[column] if way[column] > _HALF_OF_DIGITS else None

    # -- eigenvalues at rows ---------------------------------------------------------------------------------------

    def _lasting(self, row: int) -> Rate | None:
        """Return the decay at a row; if it is too fast for the method there, the slower decay of this row and the next:
        a method is not stable if its steps stay in a steep law, and one step passes through a law at rest."""
        here = self._at_row(row)
        if here is None or here.rate * self._run.settings["step"] <= self._run.method.real_stability:
            return here
        last = len(self._states.t) - 1
        other = self._at_row(row + 1 if row < last else max(row - 1, 0))
        return here if other is None else min(here, other, key=lambda one: one.rate)

    def _at_row(self, row: int) -> Rate | None:
        """Return the fastest decay of velocities at a row on the tangent of the constraints, by eigenvalues of the
        slopes of accelerations: by partials, or by central differences if the model has none."""
        model = self._model
        if self._left < 2 * model.nv and row:
            return None
        basis = self._tangent(row)
        slopes = self._partials(row, basis) if has_residual_partials(model) else self._differences(row, basis)
        if slopes is None or not slopes.size or not np.all(np.isfinite(slopes)):
            return None
        values, vectors = np.linalg.eig(slopes)
        place = int(np.argmin(values.real))
        name = model.v_names[int(np.argmax(np.abs(basis @ vectors[:, place])))]
        return Rate(max(0.0, float(-values[place].real)), float(self._states.t[row]), name)

    def _tangent(self, row: int) -> Array:
        """Return a basis of the velocities that the constraints leave, (nv, m)."""
        model, states = self._model, self._states
        if not model.multipliers or "constraint_jacobian" not in model.functions:
            return np.eye(model.nv)
        given: dict[str, Any] = {"t": float(states.t[row]), "parameters": self._parameters(row)}
        blocks = model.evaluate("constraint_jacobian", states.q[row], **given)
        jacobian = np.atleast_2d(next(iter(blocks.values())))
        _, sizes, directions = np.linalg.svd(jacobian)
        free: Array = directions[int(np.sum(sizes > _HALF_OF_DIGITS * sizes.max(initial=0.0))) :].T
        return free

    def _partials(self, row: int, basis: Array) -> Array | None:
        model, states = self._model, self._states
        held = {"multipliers": states.multipliers[row]} if model.multipliers else {}
        given: dict[str, Any] = {"z": states.z[row], "parameters": self._parameters(row), **held}
        q, v, t = states.q[row], states.v[row], float(states.t[row])
        self._left -= model.nv
        with np.errstate(all="ignore"):
            _, C, M = residual_partials(model, q, v, np.zeros_like(v), t, self._inputs(row), **given)
            mass = basis.T @ M @ basis
            if not (np.all(np.isfinite(C)) and np.all(np.isfinite(mass)) and np.linalg.matrix_rank(mass) == len(mass)):
                return None
            result: Array = np.asarray(-np.linalg.solve(mass, basis.T @ C @ basis), dtype=float)
        return result

    def _differences(self, row: int, basis: Array) -> Array:
        v = self._states.v[row]
        fastest = np.abs(self._states.v).max(axis=0)
        reach = reach_of(self._model, self._states.q) / float(np.ptp(self._states.t))
        sizes = _HALF_OF_DIGITS * (np.where(fastest > 0.0, fastest, np.where(reach > 0.0, reach, 1.0)) @ np.abs(basis))
        ways = sizes[:, np.newaxis] * basis.T
        both = self._accelerations(row, np.concatenate([v + ways, v - ways]))
        slopes = (both[: len(ways)] - both[len(ways) :]) / (2.0 * sizes[:, np.newaxis])
        result: Array = np.asarray(basis.T @ slopes.T, dtype=float)
        return result

    def _state_decay(self, row: int) -> Rate:
        """Return the fastest decay of internal states at a row, by the eigenvalues of -Fz: 0 if no state decays."""
        model, states = self._model, self._states
        if not model.functions.of_runs("internal_partials"):
            return Rate()
        t = float(states.t[row])
        given = states.q[row], states.v[row], states.z[row], t, self._inputs(row)
        by_state = model.internal_partials(*given, parameters=self._parameters(row)).rate_z
        if not np.all(np.isfinite(by_state)):
            return Rate()
        return Rate(float((-np.linalg.eigvals(by_state).real).max(initial=0.0)), t, "internal states")
