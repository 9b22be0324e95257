"""Dense output: states between the samples of a solution, on the manifold and to the order of the method.

The family of the method says which (``dense_output`` of ``integrators.families.family``). ``steps``, with the model at
hand:
states of the method itself, a step from the row before. Otherwise a quintic in the algebra gives q, and with
``hermite_5`` v. Each derivative of a curve between values that agree to order p only loses an order, so accelerations
are not its second derivative: they go through the recorded ones, by the cubic through four rows, and with ``hermite_3``
as the derivative of v, a cubic through v and a.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.compiled.arguments import check_finite, numbers
from eomgen.compiled.coordinates import StateArrays
from eomgen.errors import Problem, UsageError
from eomgen.lie import product
from eomgen.lie.product import Factor, cubic, group_curve

Index = NDArray[np.integer[Any]]
#: Rows that are evaluated at once.
BATCH = 8192


class Rows(NamedTuple):
    """Recorded rows: t (nt,), q, v, a, z."""

    t: Array
    q: Array
    v: Array
    a: Array
    z: Array


#: From rows, times (n,) and, for each time, the row before the time to q, v, a and z.
Between = Callable[[Rows, Array, Index], tuple[Array, Array, Array, Array]]


def factors_of(metadata: Mapping[str, Any]) -> list[Factor]:
    """Return the Lie groups of a configuration's coordinates from a solution's metadata. Raises UsageError if not
    there."""
    if "factors" not in metadata:
        origin = "it was made by hand or by an older eomgen"
        fault = f"this solution does not say which groups its coordinates are of: {origin} [E1262]"
        raise UsageError(Problem("at", fault, "a solution of simulate"))
    return [Factor(group, "", *spans) for group, *spans in metadata["factors"]]


def state_at(rows: Rows, metadata: Mapping[str, Any], t: ArrayLike, between: Between | None = None) -> StateArrays:
    """Return the state at times within the recorded rows, by the function ``between`` if there is one.

    Parameters
    ----------
    rows : Rows
        Recorded t, q, v, a and z.
    metadata : mapping
        Metadata of the solution, with the factors of the configuration.
    t : array_like
        Times, s.
    between : callable, optional
        States between rows; interpolated by default.

    Raises
    ------
    UsageError
        Times outside, values that are not finite, a single row, or rows so widely spaced that a body may turn by half a
        turn between.
    """
    times = numbers("t", t)
    check_finite("t", times)
    factors = factors_of(metadata)
    flat = times.ravel()
    if len(rows.t) == 1 and np.all(flat == rows.t[0]):
        return StateArrays(
            times, *(np.broadcast_to(array[0], (*times.shape, array.shape[1])).copy() for array in rows[1:])
        )
    if len(rows.t) < 2:
        fault = f"the solution has {len(rows.t)} row, two are needed [E1263]"
        raise UsageError(Problem("at", fault, "a run that made a step"))
    first, last = rows.t[0], rows.t[-1]
    slack = 1e-9 * (rows.t[1] - first)
    outside = (flat < first - slack) | (flat > last + slack)
    if np.any(outside):
        fault = f"t = {flat[np.argmax(outside)]:.9g} s is outside the solution, {first:.9g} s to {last:.9g} s [E1264]"
        raise UsageError(Problem("at", fault, "times within it, or a longer run"))
    index = np.clip(np.searchsorted(rows.t, flat, side="right") - 1, 0, len(rows.t) - 2)
    parts = [slice(k, k + BATCH) for k in range(0, max(len(flat), 1), BATCH)]
    if between is None:
        _check_turns(rows, factors, np.unique(index))
        kind = metadata.get("dense_output", "hermite_3")
        if kind == "none":
            fault = f"{metadata.get('method')} defines no states between its rows [E1265]"
            raise UsageError(Problem("at", fault, "record_every = 1, or another method"))
        by_velocity = kind == "hermite_3"
        pieces = [_between(rows, factors, flat[part], index[part], by_velocity) for part in parts]
    else:
        pieces = [between(rows, flat[part], index[part]) for part in parts]
    q, v, a, z = (np.concatenate(part).reshape(*times.shape, part[0].shape[1]) for part in zip(*pieces, strict=True))
    return StateArrays(times, q, v, a, z)


def _between(
    rows: Rows, factors: Sequence[Factor], t: Array, index: Index, by_velocity: bool
) -> tuple[Array, Array, Array, Array]:
    """Return q, v, a and z at times t (n,) s, between the rows ``index`` (n,) and ``index + 1``. q follows the curve in
    the algebra; v and a by a cubic through v and a if ``by_velocity``, else v is the rate of q, and a a cubic through
    rows."""
    after = index + 1
    duration = rows.t[after] - rows.t[index]
    s = np.clip((t - rows.t[index]) / duration, 0.0, 1.0)
    ends = [(rows.q[k], rows.v[k], rows.a[k]) for k in (index, after)]
    q, v, a = group_curve(factors, ends[0], ends[1], duration, s)
    if by_velocity:
        v, a = cubic(ends[0][1:], ends[1][1:], duration, s)
    else:
        a = _through_neighbours(rows.t, rows.a, t, index)
    poses = sum(factor.q_size for factor in factors)
    # references of angles, near enough to count turns
    q[:, poses:] = _through_neighbours(rows.t, rows.q[:, poses:], t, index)
    return q, v, a, _through_neighbours(rows.t, rows.z, t, index)


def _through_neighbours(t: Array, values: Array, at: Array, index: Index) -> Array:
    """Return values (n, size) at times `at` (n,) by the cubic through the four rows about row ``index`` (n,); of fewer
    rows, through all. `t` (nt,) and `values` (nt, size) are the rows."""
    count = min(4, len(t))
    start = np.clip(index - 1, 0, len(t) - count)
    nodes = [t[start + k] for k in range(count)]
    result = np.zeros((len(at), values.shape[1]))
    for k in range(count):
        weight = np.ones(len(at))
        for column in range(count):
            if column != k:
                weight *= (at - nodes[column]) / (nodes[k] - nodes[column])
        result += weight[:, np.newaxis] * values[start + k]
    return result


def _check_turns(rows: Rows, factors: Sequence[Factor], index: Index) -> None:
    """Raise UsageError if a body may turn by half a turn between one of the rows `index` and the next row, by its
    angular velocities: the way round would be a guess."""
    duration = rows.t[index + 1] - rows.t[index]
    for factor in factors:
        if factor.group == "R":
            continue
        part = slice(factor.v_start, factor.v_start + 3)
        speed = np.maximum(
            np.linalg.norm(rows.v[index][:, part], axis=1), np.linalg.norm(rows.v[index + 1][:, part], axis=1)
        )
        if np.any(turns := speed * duration > np.pi):
            k = int(np.argmax(turns))
            turn = f"{speed[k] * duration[k]:.3g} rad"
            fault = f"a body turns by {turn} between two rows at t = {rows.t[index[k]]:.9g} s [E1266]"
            raise UsageError(Problem("at", fault, "a smaller record_every: less than half a turn between rows"))


def largest_errors(rows: Rows, metadata: Mapping[str, Any]) -> dict[str, float]:
    """Return the largest errors of ``state_at`` at left-out rows, by name: q (in the algebra), v, a, and z if there are
    any. Every third row is used; halfway between two rows the velocities of a quintic are better than elsewhere, so
    every second row would not do. Raises UsageError for fewer than seven rows."""
    if len(rows.t) < 7:
        fault = f"seven rows are needed, not {len(rows.t)} [E1267]"
        raise UsageError(Problem("interpolation_error", fault, "a longer run"))
    kept = Rows(*(array[::3] for array in rows))
    left_out = [k for k in range(3 * len(kept.t) - 3) if k % 3]
    interpolated = state_at(kept, metadata, rows.t[left_out])
    q = product.difference(factors_of(metadata), rows.q[left_out], interpolated.q)
    errors = {"q": q, "v": interpolated.v - rows.v[left_out], "a": interpolated.a - rows.a[left_out]}
    if rows.z.shape[1]:
        errors["z"] = interpolated.z - rows.z[left_out]
    return {name: float(np.max(np.abs(error), initial=0.0)) for name, error in errors.items()}
