"""Errors from differences between runs, by Richardson's extrapolation.

If x_h - x = C h^p + higher powers, then x_2h - x_h = (2^p - 1) (x_h - x), and the ratio of x_4h - x_2h to x_2h - x_h
shows whether p is the method's order: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I (1993),
II.4. Rounding errors of the steps add up like independent numbers (Henrici: Discrete Variable Methods in Ordinary
Differential Equations, 1962, 1.5): after n steps to half a unit in the last place times the root of n, which is counted
in single precision. Of two runs, differences have the variances of both: if they are as small as rounding and do not
show the method's order, the error is the difference. Which runs are compared, and when there is no estimate,
``error_estimation`` decides; whether steps resolve the equations, ``fastest_rates``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults
from eomgen.lie.product import Factor
from eomgen.results.error_estimate import NONE, OTHER_ORDER, OWN, ErrorEstimate, LargestError
from eomgen.simulation.accuracy.comparison_runs import SAME_TIME, ComparisonRuns, MotionDifference
from eomgen.simulation.accuracy.motion_size import Kinds, MotionSize, columns_of, shares
from eomgen.simulation.stepping.states import states_of

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
    gain : function from the order to the factors (n, 1) by which differences give errors of the run
    words : which runs these were, for the estimate's description
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
    """Return the function from an order to factors (n, 1) that turn differences of two runs into errors of the first
    run. `ratio` (n,) is the effective ratio of the other run's steps to the run's steps, at each row. Factors are 1 /
    |ratio^order - 1|; of equal steps, whose differences do not bound the error, infinite."""

    def gain(order: float) -> Array:
        with np.errstate(divide="ignore"):
            result: Array = 1.0 / np.abs(np.power(ratio, order) - 1.0)[:, np.newaxis]
        return result

    return gain


def gain_of(order: float) -> float:
    """Return the factor of ``gain_by`` for a run in steps twice as long; of negative orders for half the steps."""
    return 1.0 / abs(math.pow(2.0, order) - 1.0)


def estimate(runs: ComparisonRuns, pair: Pair, declared: float) -> ErrorEstimate:
    """Return the error estimate from the differences of a pair of runs. Each kind of columns uses the observed order,
    at least 1 and at most `declared`, the order of the method; NaN if the method chooses its steps. In single
    precision, errors are at least the accumulated rounding."""
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
    worst = "z" if share.size and np.argmax(share) % share.shape[1] >= errors["increment"].shape[1] else "increment"
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
        order=orders[worst],
        declared_order=declared,
        relative=largest.share if largest is not None else 0.0,
        largest=largest,
        largest_velocity=_largest_velocity(runs, errors["v"], times),
        largest_output=_largest_output(runs, errors, times),
        method=f"{pair.words}{_since(runs)}",
    )


def _largest_state(size: MotionSize, errors: Kinds, share: Array, times: Array) -> LargestError:
    """Return the largest error of coordinates and internal states relative to their motions. `errors` has arrays (n,
    size) by kind, `share` (n, nv + nz) the errors as parts of the motion, `times` (n,) are in s."""
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
    """Return estimated rounding errors in single precision by kind, (n, size), at times (n,). These grow like the root
    of the step count; coordinates have at least the loss of digits of their sums."""
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
    """Return the part of a joint's coordinates, (n, size), that sums of increments have lost to rounding at times (n,).
    Increments that hardly change are rounded alike, so that their errors add up in proportion to the steps. Coordinates
    are compared with the integral of the run's own velocities by the corrected trapezoidal rule, less the difference to
    the rule at twice the distance of rows (Davis, Rabinowitz: Methods of Numerical Integration, 1984, 2.9)."""
    t, q, v, a, *_ = states_of(runs.own.rows.astype(float), runs.run.model)
    q, v, a = q[:, factor.q], v[:, factor.v], np.nan_to_num(a[:, factor.v])

    def loss(every: int) -> Array:
        h = np.diff(t[::every])[:, np.newaxis]
        starts, ends = slice(0, -every, every), slice(every, None, every)
        parts = 0.5 * h * (v[starts] + v[ends]) + h**2 / 12.0 * (a[starts] - a[ends])
        covered = len(parts) * every + 1
        result: Array = q[:covered:every][1:] - q[0] - np.cumsum(parts, axis=0)
        return result

    single, double = loss(1)[1::2], loss(2)
    lost = np.maximum(np.abs(single) - np.abs(single - double), 0.0)
    columns = [np.interp(times, t[2::2], column, left=0.0) for column in lost.T]
    return np.stack(columns, axis=1)


def _since(runs: ComparisonRuns) -> str:
    """Return the first compared time of a resumed run, in words; empty for a run compared from its start."""
    first, start = float(runs.span.rows[0, 0]), runs.run.grid.start
    return f" from t = {first:.6g} s on, where the state is taken for exact" if first > start + 0.5 * runs.step else ""


def _largest_velocity(runs: ComparisonRuns, errors: Array, times: Array) -> LargestError | None:
    """Return the largest error of the velocities (n, nv), relative to the largest velocity with the same unit, or for
    an elastic coordinate relative to its own largest velocity; None if no velocity is above rounding.

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
    row, index = np.unravel_index(int(np.argmax(share)), share.shape)
    column = int(moving[index])
    unit, time, error = str(units[column]), float(times[row]), float(errors[row, column])
    measure = FASTEST.format(unit=unit or "its unit")
    if elastic[column]:
        is_fastest = velocities[column] >= fastest[column]
        measure = OWN_FASTEST if is_fastest else SMALL_RATE.format(least=f"{fastest[column]:.2g} {unit}")
    return LargestError(model.v_names[column], error, unit, time, float(share[row, index]), measure)


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
        row, index = np.unravel_index(int(np.argmax(share)), share.shape)
        label = f"output {name}{f'[{index}]' if array.shape[1] > 1 else ''}"
        result.append(
            LargestError(
                label, float(array[row, index]), units[name], float(times[row]), float(share[row, index]), RANGE
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
    for index, floor in enumerate(floors):
        valid = (ours > floor) & (theirs > floor) & np.isfinite(theirs)
        # larger differences do not follow powers of the step
        calm = valid & (theirs < 0.1)
        rows = np.where(calm.any(axis=0), len(calm) - 1 - np.argmax(calm[::-1], axis=0), np.argmax(valid, axis=0))
        result[index] = np.where(valid.any(axis=0), np.take_along_axis(orders, rows[np.newaxis], axis=0)[0], math.nan)
    return result


def keep_order(runs: ComparisonRuns, near: MotionDifference, far: MotionDifference, order: float, ratio: float) -> bool:
    """Return whether differences between runs are the first term of an expansion in powers of the step, C(t) h^order,
    in each row and component, and not in their largest numbers by chance: ``far`` = ratio^order ``near``, as far as an
    order within ``OTHER_ORDER`` of the given one has it, relative to the component's largest number.

    Parameters
    ----------
    near, far : |x_2h - x_h| and |x_4h - x_2h|
    ratio : of the steps of neighbouring runs
    """
    ours, theirs = (shares(apart.kinds, runs.size) for apart in (near, far))
    places = np.searchsorted(near.t, far.t + SAME_TIME * runs.step, side="right") - 1
    expected = ratio**order * ours[places]
    largest = expected.max(axis=0, initial=0.0)
    rest = np.abs(theirs - expected).max(axis=0, initial=0.0)
    noticed = largest > np.maximum(0.1 * largest.max(initial=0.0), ratio**order * runs.rounding)
    return bool(np.all(rest[noticed] <= (1.0 - ratio**-OTHER_ORDER) * largest[noticed]))
