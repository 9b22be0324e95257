"""Errors from differences between runs, by Richardson's extrapolation.

If x_h - x = C h^p + higher powers, then x_2h - x_h = (2^p - 1) (x_h - x), and the ratio of x_4h - x_2h to x_2h - x_h
shows whether p is the method's order: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I (1993),
II.4. Which runs are compared, and when there is no estimate, ``error_estimation`` decides.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults
from eomgen.results.error_estimate import NONE, OWN, ErrorEstimate, LargestError
from eomgen.simulation.accuracy.comparison_runs import SAME_TIME, ComparisonRuns, MotionDifference
from eomgen.simulation.accuracy.motion_size import Kinds, shares

#: Differences above this part of the motion are too large to follow powers of the step.
_SATURATED = 0.1
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
    for kind, apart in pair.apart.kinds.items():
        orders[kind] = math.nan
        if pair.near is not None and pair.far is not None:
            with np.errstate(all="ignore"):
                far, near = ((differ.t, differ.kinds[kind] / size.sizes[kind]) for differ in (pair.far, pair.near))
            orders[kind] = observed_order(far, near, runs.rounding, pair.refinement)
        used = declared if math.isnan(orders[kind]) else min(max(orders[kind], 1.0), declared)
        with np.errstate(invalid="ignore"):  # no difference of equal steps is not known, and counts as infinite
            errors[kind] = apart * pair.gain(used)
    share = shares(errors, size)
    row, component = np.unravel_index(int(np.argmax(share)), share.shape) if share.size else (0, 0)
    times = pair.apart.t
    largest = None
    if share.size:
        first = errors["increment"].shape[1]
        column = errors["increment"][:, component] if component < first else errors["z"][:, component - first]
        least = np.concatenate([size.sizes["increment"], size.sizes["z"]])[component]
        if not math.isfinite(least):  # all errors are infinite parts of no motion
            row = int(np.argmax(column))
        error = column[row]
        largest_component = (size.names[component], float(error), size.units[component], float(times[row]))
        unit = size.units[component] if size.units[component] != "1" else ""
        measure = (
            A_TURN
            if size.turns[component]
            else OWN
            if size.own[component]
            else SMALL.format(least=f"{least:.2g} {unit}".strip())
        )
        measure = measure if math.isfinite(least) else NONE
        largest = LargestError(*largest_component, float(share[row, component]), measure)
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


def observed_order(far: tuple[Array, Array], near: tuple[Array, Array], floor: float, ratio: float = 2.0) -> float:
    """Return the observed order of convergence of differences; NaN if they are rounding.

    Compared are the running maxima at the last row at which both differences follow powers of the step.

    Parameters
    ----------
    far, near : times (n,) in s and differences (n, size) as parts of the motion, of x_4h - x_2h and of x_2h - x_h
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


def _so_far(array: Array) -> Array:
    """Return the running maximum over the rows, (n,): the largest number up to each row."""
    with np.errstate(all="ignore"):
        result: Array = np.maximum.accumulate(np.nan_to_num(array.max(axis=1), nan=np.inf))
    return result
