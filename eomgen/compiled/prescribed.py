"""Prescribed functions of time of a compiled model: base motion, inputs, and the times of their discontinuities."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.compiled.arguments import numbers
from eomgen.compiled.terms import EvaluatedModel, Parameters
from eomgen.errors import UsageError


def base(model: EvaluatedModel, t: ArrayLike = 0.0, *, parameters: Parameters = None) -> Array:
    """Return the prescribed state of the base.

    An array of this kind can be handed to functions of the model as ``base``, in place of the scene's law, if the base
    of the scene moves; components that the law keeps at zero at all times have to be zero.

    Parameters
    ----------
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    (..., 19) ndarray
        Unit quaternion (4) and position, m, in the world; angular velocity, velocity, and the time derivatives of the
        components of both, in base axes (3 each); (1, 0, ..., 0) for a base at rest.

    Examples
    --------
    >>> model = eomgen.build("examples/double_pendulum_on_shaking_base/scene.toml")
    >>> model.base(t=0.2)[4:7].round(4)
    array([ 0.0337,  0.    , -0.0006])
    """
    p = model.evaluator.parameters(parameters)
    if "base" not in model.evaluator.functions:
        rest = np.zeros(
            (*np.broadcast_shapes(numbers("t", t).shape, p.shape[:-1]), model.evaluator.functions.sizes["base"])
        )
        rest[..., 0] = 1.0
        return rest
    return model.evaluator.functions("base", {"t": numbers("t", t), "p": p})[0]


def input_values(model: EvaluatedModel, t: ArrayLike = 0.0, *, parameters: Parameters = None) -> Array:
    """Return the inputs by the scene's formulas and roads.

    Parameters
    ----------
    t : array_like, optional
        Time (...), s.
    parameters : mapping or array_like, optional
        Tunable parameters (..., np), SI units; defaults of the scene if not given.

    Returns
    -------
    u : (..., nu) ndarray
        In the order of ``model.inputs``; 0 for inputs without a formula.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> model.input_values([0.0, 1.0]).shape
    (2, 1)
    """
    return model.evaluator.formula_inputs({"t": numbers("t", t), "p": model.evaluator.parameters(parameters)})


def discontinuity_times(model: EvaluatedModel, start: float, end: float, *, order: int = 2) -> Array:
    """Return the times of a closed interval at which derivatives of forces up to an order are known to jump.

    The ends are in the result only if jumps are there. Times at which sampled states change belong to each order. Left
    out are jumps at times that depend on tunable parameters or on the state, such as contacts and events. Steppers end
    steps by themselves at the times that matter to the order of the method; solvers of other packages need to be
    stopped at these times.

    Parameters
    ----------
    start, end : float
        Ends of the interval, s.
    order : int, optional
        Largest order of the derivatives: 0 forces, 1 rates of forces, 2 second derivatives.

    Returns
    -------
    (n,) ndarray
        Times in increasing order, s.

    Raises
    ------
    UsageError
        The end lies before the start, or there are more than ten million such times.

    Examples
    --------
    >>> model = eomgen.build("examples/pi_servo/sampled.toml")
    >>> model.discontinuity_times(-0.004, 0.004)                # samples begin at 0
    array([0.   , 0.001, 0.002, 0.003, 0.004])
    """
    if end < start:
        raise UsageError(f"the end {end:.9g} s lies before the start {start:.9g} s [E0274]", "a later end")
    arrays: list[Array] = [np.zeros(0)]
    waves = [(time, period) for time, period, _ in _jumps(model, order) if period > 0.0]
    count = (end - start) * jumps_per_second(waves)
    most = 10_000_000  # in a list
    if count > most:
        shortest = min(period for _, period in waves)
        fault = (
            f"there are {count:.3g} such times from {start:.9g} s to {end:.9g} s, in waves of {shortest:.3g} s [E0275]"
        )
        raise UsageError(fault, f"an earlier end: {most:.3g} times at most")
    for time, period, first in _jumps(model, order):
        if period == 0.0:
            arrays.append(np.array([time] if start <= time <= end else []))
            continue
        ends = max(first, math.ceil((start - time) / period)), math.floor((end - time) / period)
        arrays.append(time + np.arange(ends[0], ends[1] + 1.0) * period)
    return np.unique(np.concatenate(arrays)) + 0.0  # no minus zero


def jumps_between(model: EvaluatedModel, t: Array, near: float, *, order: int = 0) -> Array:
    """Return times at which derivatives of forces up to an order jump: single ones, and of periodic ones one per
    interval.

    Parameters
    ----------
    t : (m,) ndarray
        Times in increasing order, s.
    near : float
        Widening of each interval, s.
    order : int, optional
        Largest order of the derivatives: 0 forces, 1 rates of forces, 2 second derivatives.

    Returns
    -------
    (n,) ndarray
        Times in increasing order, s.
    """
    arrays: list[Array] = []
    for time, period, _ in _jumps(model, order):
        if period == 0.0:
            arrays.append(np.array([time]))
            continue
        first = time + np.ceil((t[:-1] - near - time) / period) * period
        arrays.append(first[first <= t[1:] + near])
    return np.unique(np.concatenate(arrays)) if arrays else np.zeros(0)


def _jumps(model: EvaluatedModel, order: int) -> list[tuple[float, float, float]]:
    """Return times and periods, s, of known jumps up to an order, and of all samples; a single jump has period 0. Third
    is the first multiple of the period: 0 for samples, else minus infinity."""
    layout = model.evaluator.library.layout
    known = [item for item in layout["discontinuities"] if item["order"] <= order]
    sampled = {(float(item["offset"]), float(item["period"]), 0.0) for item in layout["sampled"]}
    return [*((float(item["time"]), float(item["period"]), -math.inf) for item in known), *sorted(sampled)]


def jumps_per_second(waves: Iterable[tuple[float, float]]) -> float:
    """Return the number of jumps in a second, 1/s, of periodic jumps (a time, period) in s; equal ones count once."""
    phases = {(round(time % period / period, 9) % 1.0, period) for time, period in waves}
    return sum(1.0 / period for _, period in phases)
