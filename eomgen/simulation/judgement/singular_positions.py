"""Samples of a run near singular positions of the constraints, at which branches of configurations cross.

A flat parallelogram is one: from there it may go on as a parallelogram or crossed over. The constraints lose rank in
one direction, so multipliers grow without bound and corrections lose their digits as the position comes near.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from eomgen.base.arrays import Array
from eomgen.base.data import dataclass
from eomgen.base.limits import Limit
from eomgen.base.rounding import WRITTEN
from eomgen.compiled.equations import nonzeros
from eomgen.errors import ModelError
from eomgen.formula.evaluate import evaluate_batch
from eomgen.integrators.families.register import Method
from eomgen.lie import product
from eomgen.results.finding import Finding
from eomgen.solvers.regular_inertia import regular_inertia
from eomgen.solvers.sparse_rows import SparseRows, largest_singular_value, smallest_singular_value
from eomgen.system.terms import NONZEROS

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel

#: Of the weighed rows. Generalized-alpha stopped falling parallelograms and rhombi with values of 0.04 and less within
#: the examined steps.
NEARLY = Limit(0.05, "1", "smallest singular value in parts of the largest in the run", "parallelograms that fall")
#: Examined steps beyond the last row, along the velocity of this row: the failed step, and the next step.
_AHEAD = np.linspace(0.0, 2.0, 9)
#: Steps beyond the last row at which a position that meets the constraints is looked for.
_BEYOND = (1.0, 3.0, 10.0, 30.0)


@dataclass(frozen=True)
class SingularPosition:
    """A nearly singular position: its time in s, and its smallest singular value as a part of the largest such value in
    the run. If the run has one row, the measure is the largest singular value at this position. The time may lie up to
    two steps after the last row.
    """

    time: float
    part: float

    @property
    def text(self) -> str:
        return f"the constraints are nearly singular at t = {self.time:.6g} s, where branches of configurations cross"


def singular_ahead(
    model: CompiledModel, t: Array, q: Array, v: Array, p: Array, step: float
) -> SingularPosition | None:
    """Return the most nearly singular position along the last velocity, over two steps from the last row.

    None if the smallest singular value there stays above a twentieth of the largest of the smallest singular values in
    the run, for a model without constraints, and for matrices that are not finite. If the start is the only row, the
    start is examined alone, with a far lower threshold.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq); earlier rows are the measure for the last row
    v : (nv,) velocity in the last row
    p : (np,) parameters
    step : s
    """
    if len(t) == 1:
        return nearest(model, t, q, p, 0)
    chosen = examined_rows(model, len(t) - 1)
    with np.errstate(over="ignore", invalid="ignore"):  # of a run that has left the finite numbers
        ahead = np.array([product.update(model.factors, q[-1], part * step * v) for part in _AHEAD])
    times, positions = np.concatenate([t[chosen], t[-1] + step * _AHEAD]), np.concatenate([q[chosen], ahead])
    return nearest(model, times, positions, p, len(chosen))


def beyond_reach(model: CompiledModel, t: float, q: Array, p: Array, step: float) -> Finding | None:
    """Return a finding on drives that leave the range which their loop can reach; None if the next steps have positions
    that meet the constraints, as past a position at which branches cross, and if no drive moves.

    Parameters
    ----------
    t : of the last row, s
    q : (nq,) in the last row
    p : (np,) parameters
    step : s
    """
    term, rest = "constraint_velocity", np.zeros(model.nv)
    if not model.multipliers or term not in model.functions:
        return None
    rates = np.concatenate(list(model.evaluate(term, q, rest, t=t, parameters=p).values()))
    driven = dict.fromkeys(name.partition(":")[0] for name, rate in zip(model.multipliers, rates, strict=True) if rate)
    if not driven:
        return None
    for steps in _BEYOND:
        try:
            model.consistent(q, rest, t + steps * step, parameters=p)
        except ModelError:
            continue
        return None
    values = dict(zip(model.q_names, zip(q, model.q_units, strict=True), strict=True))
    at = [f", at {value:.5g} {unit}" for name in driven for value, unit in [values.get(f"q.{name}", (0.0, ""))] if unit]
    leaves = f"the drive of {' and '.join(driven)} leaves the range that its loop can reach{''.join(at)}"
    text = f"after t = {t:.6g} s no position meets the constraints: {leaves}"
    return Finding(text=text, hint="a drive that turns back before, or lengths with which the loop reaches farther")


def without_length(model: CompiledModel, t: float, p: Array, step: float) -> Finding | None:
    """Return a finding on a length over time that is 0 or less in the next steps; None if there is none.

    A distance has no direction at length 0, so steps near it fail before the length reaches 0.

    Parameters
    ----------
    t : of the last row, s
    p : (np,) parameters
    step : s
    """
    times = t + step * np.array((0.0, *_BEYOND))
    values = model.description.values(dict(zip(model.parameters, p.tolist(), strict=True)))
    for law in model.description.laws:
        if law.quantity != "driven distance":
            continue
        lengths = evaluate_batch(law.formula, lambda symbol: times if symbol.kind == "time" else values[symbol.name])
        if np.any(ended := lengths <= 0.0):
            text = f"the length of {law.where} is {lengths[0]:.3g} m at t = {t:.6g} s and reaches 0 by"
            text += f" t = {times[ended][0]:.6g} s, at which the distance has no direction"
            return Finding(text=text, hint="a law whose length stays above 0, or a run that ends before")
    return None


def way_past(method: Method, step: float, *, at_start: bool) -> str:
    """Return the remedy, in words, if a method stops at a singular position, or cannot start there (`at_start`)."""
    if at_start:
        return "a start elsewhere: the constraints do not say there in which branch the motion goes on"
    if method.passes_singularities:
        alternative = "else lengths or a start with which the motion does not come so near it, or crosses it faster"
        return f"a much smaller step where lengths fit all but exactly, {alternative}"
    nearer = f"steps smaller than {step:.3g} s may come nearer to it"
    return f"rk4_partitioned, which passes such positions along the velocity; {nearer}"


def examined_rows(model: CompiledModel, rows: int) -> NDArray[np.intp]:
    """Return the indices of the rows of a run that are examined for singular positions, increasing, out of `rows` rows.
    Spread over the run as far as the work allows, and all of the last rows."""
    if not rows:
        return np.zeros(0, np.intp)
    affordable = 10**8 // max(1, model.nv * len(model.multipliers) ** 2)
    spread = np.linspace(0, rows - 1, min(1000, max(50, affordable))).astype(np.intp)
    return np.union1d(spread, np.arange(max(0, rows - 40), rows))


def nearest(model: CompiledModel, t: Array, q: Array, p: Array, first: int) -> SingularPosition | None:
    """Return the most nearly singular position among the rows from number `first` on; None if none is nearly singular.

    Smallest singular values of the constraint Jacobian are compared with the largest of them over all rows; a single
    row is measured by its own largest singular value. None also without constraints, or if matrices are not finite.

    Parameters
    ----------
    t, q : (n,) in s, (n, nq)
    p : (np,) parameters
    """
    if not model.multipliers:
        return None
    whole = all(name in model.functions for name in NONZEROS)
    measured = (_by_whole_matrices if whole else _by_nonzeros)(model, t, q, p)
    if measured is None:
        return None
    values, largest = measured
    # singular values of chains fall with the square of their length
    at_start = WRITTEN * min(1.0, (300 / len(model.multipliers)) ** 2)
    measure, least = (largest, at_start) if len(t) == 1 else (values.max(), NEARLY)
    row = first + int(np.argmin(values[first:]))
    part = float(values[row] / measure) if measure > 0.0 else 1.0
    return SingularPosition(float(t[row]), part) if part < least else None


def _by_whole_matrices(model: CompiledModel, t: Array, q: Array, p: Array) -> tuple[Array, float] | None:
    """Return the smallest singular value at each position, (n,), and the largest at the first position, for constraint
    rows weighted by M and divided by their largest length in the run, so that units and kinds drop out.

    None if M gives no weights, as massless bodies, or matrices are not finite.
    """
    with np.errstate(all="ignore"):
        M = model.mass(q, parameters=p)
        (B,) = model.evaluate("constraint_jacobian", q, t=t, parameters=p).values()
    if not (np.all(np.isfinite(M)) and np.all(np.isfinite(B))):
        return None
    try:
        L = np.linalg.cholesky(regular_inertia(M, B, np.ones(model.nv)))
        weighed = np.swapaxes(np.linalg.solve(L, np.swapaxes(B, -1, -2)), -1, -2)
    except np.linalg.LinAlgError:
        return None
    lengths = np.linalg.norm(weighed, axis=-1).max(axis=0)
    singular_values = np.linalg.svd(weighed / np.where(lengths > 0.0, lengths, 1.0)[:, np.newaxis], compute_uv=False)
    return np.asarray(singular_values[:, -1], dtype=float), float(singular_values[0, 0])


def _by_nonzeros(model: CompiledModel, t: Array, q: Array, p: Array) -> tuple[Array, float] | None:
    """Return singular values as ``_by_whole_matrices`` does, from sparse M and B, for large systems. None if M or B are
    not available as nonzeros or not finite, or if a block of M is large. The largest value is infinite if there are
    several positions."""
    from scipy.sparse import csr_matrix, diags  # noqa: PLC0415  # runs of small systems need no SciPy

    with np.errstate(all="ignore"):
        M, B = (nonzeros(model, name, q, t, parameters=p) for name in NONZEROS)
    if M is None or B is None or not (np.all(np.isfinite(M.values)) and np.all(np.isfinite(B.values))):
        return None
    shape, nv = (len(model.multipliers), model.nv), model.nv
    constant = bool(np.all(M.values == M.values[0]))
    inverse, weighed = None, []
    for of_mass, of_rows in zip(M.values, B.values, strict=True):
        if inverse is None or not constant:
            inertia = csr_matrix((of_mass, (M.rows, M.columns)), shape=(nv, nv))
            inertia.eliminate_zeros()
            inverse = SparseRows(csr_matrix(shape), inertia).inverse
        if inverse is None:
            return None
        weighed.append(csr_matrix((of_rows, (B.rows, B.columns)), shape=shape) @ inverse.T)
    lengths = np.max([np.sqrt(rows.multiply(rows).sum(axis=1)) for rows in weighed], axis=0).ravel()
    scales = diags(1.0 / np.where(lengths > 0.0, lengths, 1.0))
    weighed = [scales @ rows for rows in weighed]
    largest = largest_singular_value(weighed[0]) if len(t) == 1 else math.inf
    return np.array([smallest_singular_value(rows) for rows in weighed]), largest
