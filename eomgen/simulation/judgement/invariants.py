"""Invariants of a motion over the samples of a run: the energy balance, holonomic constraints, and unit quaternions.

If no force has power the total energy is constant, and two rows are enough. Otherwise the work between rows is the
integral of the power at the rows; its error is estimated by leaving out every second row.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array
from eomgen.base.limits import Limit
from eomgen.results.error_estimate import AIM

if TYPE_CHECKING:
    from eomgen.compiled.model import CompiledModel


REPORTED_ENERGY = Limit(AIM, "1", "imbalance in parts of the energies at work", "the error at which hints aim")
FAILED_ENERGY = Limit(
    0.49,
    "1",
    "energy gained without work, in parts of the energies at work",
    "without power, a total energy that grows fiftyfold gains 49 % at least",
)
#: Reason for an unknown balance if rows do not resolve the power between them.
APART = "the rows are too widely spaced for the work in between"


class EnergyBalance(NamedTuple):
    """How far the energy of a run is out of balance.

    Attributes
    ----------
    error : largest violation of the balance, as a share of the energies that move; None if unknown
    unknown : reason for an unknown balance
    infinite : s, the first time at which the energy is beyond the finite numbers; None if the energy remains finite
    gain : part of the error that is energy gained without work; the rest was lost, as to numerical damping
    """

    error: float | None
    unknown: str = ""
    infinite: float | None = None
    gain: float = 0.0

    def __str__(self) -> str:
        if self.error is None:
            return f"not known: {self.unknown}"
        return f"off by {100.0 * self.error:.2g} % of the energies at work"


def energy_balance(
    t: Array,
    energy: Mapping[str, Array],
    jumps: ArrayLike = (),
    *,
    conservative: bool = False,
    sparse: bool = False,
    epsilon: float = 0.0,
) -> EnergyBalance:
    """Return the largest imbalance between the total energy and the work of forces and of the base, over rows.

    The result has no error but a reason if the energy is not there or not finite, if there are too few rows, or if
    these do not resolve the work in between.

    Parameters
    ----------
    t : (n,) s
    energy : mapping
        ``kinetic``, ``potential``, ``total`` in J and ``power``, ``base_power`` in W, (n,) each.
    jumps : (k,) s
        Times at which forces jump: intervals with a jump are skipped, because rows do not resolve their work.
    conservative : bool
        Whether there is no power in any state.
    sparse : bool
        Whether steps lie between the rows, and so possibly pulses of power that no row shows.
    epsilon : float
        Last place of the numbers that energies are computed in.
    """
    if not all(name in energy for name in ("kinetic", "potential", "total", "power", "base_power")):
        return EnergyBalance(None, "the model was built without the term energy")
    kinetic, potential, total = energy["kinetic"], energy["potential"], energy["total"]
    finite = np.isfinite(total) & np.isfinite(energy["power"]) & np.isfinite(energy["base_power"])
    if not finite.all():
        return EnergyBalance(None, "the energy is beyond the finite numbers", float(t[finite.argmin()]))
    highest, lowest, fastest = potential.max(), potential.min(), kinetic.max()
    moving = float(highest - lowest + fastest)
    if len(t) < (2 if conservative else 5):
        few = f"{len(t)} row{' is' if len(t) == 1 else 's are'} too few for the work in between"
        return _out_of_nothing(t, energy, moving) or EnergyBalance(None, few)
    floor = max(1e-9, 100.0 * epsilon) * (max(abs(highest), abs(lowest)) + fastest)
    if conservative:
        return _shares(total - total[0], moving) if moving > floor else EnergyBalance(0.0)
    rate = energy["power"] + energy["base_power"]
    known = _smooth_intervals(t, jumps)
    spans = t[1:] - t[:-1]
    if spans[known].sum() < 0.5 * (t[-1] - t[0]):
        return EnergyBalance(None, "forces jump, or states are sampled, next to most rows")
    pieces = 0.5 * spans * (rate[1:] + rate[:-1])
    work = _sums(pieces, known)
    swing = moving + np.abs(work).max()
    if swing <= floor:
        return EnergyBalance(0.0)
    off = _sums(total[1:] - total[:-1], known) - work
    error, noticed = np.abs(off).max(), REPORTED_ENERGY * swing
    # an integral is off by a few of its changes when every second row is left out
    uncertain = 4.0 * _off_by_every_second_row(t, rate, pieces, known)
    if (error <= uncertain and uncertain > noticed) or (error > noticed and sparse and _is_pulse(off)):
        return _out_of_nothing(t, energy, moving) or EnergyBalance(None, APART)
    return _shares(off, swing)


def _out_of_nothing(t: Array, energy: Mapping[str, Array], moving: float) -> EnergyBalance | None:
    """Return the balance with the gain of total energy as a part of `moving`, the energy in motion in J, if no recorded
    energy explains that gain, else None. Explanations are the initial kinetic energy, the range of potential energy,
    and work by the largest recorded power."""
    if len(t) < 2:
        return None
    known = energy["kinetic"][0] + np.ptp(energy["potential"])
    known += (t[-1] - t[0]) * np.max(np.maximum(energy["power"] + energy["base_power"], 0.0))
    gain = float(np.max(energy["total"] - energy["total"][0]))
    return EnergyBalance(gain / moving, gain=gain / moving) if gain > 1e3 * known else None


def _shares(off: Array, swing: float) -> EnergyBalance:
    return EnergyBalance(float(np.abs(off).max() / swing), gain=float(off.max() / swing))


def same_time(t: Array) -> float:
    """Return the difference, s, below which two times of a run with rows at t (n,) count as equal."""
    return 1e-9 * float(np.ptp(t)) + 8.0 * float(np.finfo(float).eps * np.abs(t).max())


def _smooth_intervals(t: Array, jumps: ArrayLike) -> NDArray[np.bool_]:
    """Return a mask (n - 1,) of the intervals between times t (n,) that have no jump within, ends included."""
    known = np.asarray(jumps, float)
    if not len(known):
        return np.ones(len(t) - 1, dtype=bool)
    near = same_time(t)
    first, last = np.searchsorted(np.sort(known), [t[:-1] - near, t[1:] + near])
    return np.asarray(first == last)


def _sums(pieces: Array, known: NDArray[np.bool_]) -> Array:
    """Return the sums from the first time on, (n + 1,), of pieces of known intervals, (n,)."""
    sums = np.zeros(len(pieces) + 1)
    np.cumsum(np.where(known, pieces, 0.0), out=sums[1:])
    return sums


def _off_by_every_second_row(t: Array, rate: Array, pieces: Array, known: NDArray[np.bool_]) -> float:
    """Return the largest change of the running integral of `rate` (n,) over t if every second row is left out. `pieces`
    (n - 1,) are the trapezoids between rows; intervals that are not `known` (n - 1,) do not count."""
    end = len(t) - (len(t) + 1) % 2  # an odd number of rows, so that every second one has both neighbours
    both = known[: end - 1 : 2] & known[1 : end - 1 : 2]
    coarse = 0.5 * (t[2:end:2] - t[: end - 2 : 2]) * (rate[2:end:2] + rate[: end - 2 : 2])
    change = np.where(both, coarse - (pieces[: end - 1 : 2] + pieces[1 : end - 1 : 2]), 0.0)
    return float(np.abs(np.cumsum(change)).max())


def _is_pulse(off: Array) -> bool:
    """Return whether an imbalance, given at each row as off (n,), arises in few of the intervals between rows."""
    jumps = np.abs(off[1:] - off[:-1])
    # single events between rows, not every step
    return bool(20 * jumps.sum() ** 2 < len(jumps) * (jumps**2).sum())


REPORTED_VIOLATION = Limit(
    1e-6, "1", "violation of a constraint in parts of the machine, or in rad", "a choice: 1 um in 1 m"
)
FAILED_VIOLATION = Limit(
    1e-3, "1", "violation of a constraint in parts of the machine, or in rad", "a choice: 1 mm in 1 m"
)


class Violation(NamedTuple):
    """A violation of a holonomic row.

    Attributes
    ----------
    share : part of the size of the machine, or rad
    text : message with row, size and time
    time : s; NaN between rows
    """

    share: float
    text: str
    time: float = math.nan


def largest_violation(model: CompiledModel, t: Array, q: Array, p: Array, largest: float = 0.0) -> Violation | None:
    """Return the worst violation of the holonomic constraints in a run; None if all constraints are satisfied, or if
    the model has no functions for their evaluation.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq)
    p : (np,) parameters
    largest : the largest violation at any step, in the units of the rows, if the stepper counts it
    """
    count = model.functions.sizes.get("holonomic", 0)
    if not count or not all(name in model.functions for name in ("constraint", "constraint_size")):
        return None
    chosen = np.unique(np.linspace(0, len(t) - 1, min(len(t), 1000)).round().astype(int))
    t, q = t[chosen], q[chosen]
    violation = np.abs(next(iter(model.evaluate("constraint", q, t=t, parameters=p).values())))[:, :count]
    blocks = list(model.evaluate("constraint_size", q, t=t, parameters=p).values())
    sizes = np.concatenate([np.asarray(part).reshape(len(t), -1) for part in blocks], axis=1)
    rows = sizes.shape[1] // 2
    summands, extents = sizes[:, :count], sizes[:, rows:]
    lengths = np.array([unit != "1" for unit in model.library.layout["row_units"][:count]])
    machine = extents.max(axis=1, initial=0.0)
    if not machine.min() > 0.0:  # travels alone have no extent: their summands along the run are the scale
        machine[~(machine > 0.0)] = float(summands[:, lengths].max(initial=0.0)) or 1.0
    scale = np.where(lengths, machine[:, None], 1.0)
    epsilon = np.finfo(np.float32 if model.library.real == "float" else np.float64).eps
    rounding = 1e3 * epsilon * summands
    shares = np.where(violation > rounding, violation / scale, 0.0)
    row, k = np.unravel_index(int(np.argmax(np.nan_to_num(shares, nan=np.inf))), shares.shape)
    share, by = float(shares[row, k]), float(violation[row, k])
    if share > REPORTED_VIOLATION:
        unit = " m" if lengths[k] else ""
        message = f"the constraint {model.multipliers[k]} is off by {by:.3g}{unit} at t = {t[row]:.6g} s"
        return Violation(share, message, float(t[row]))
    between = largest / float(scale.max())
    if between > REPORTED_VIOLATION and largest > rounding.max():
        return Violation(between, f"constraints are off by up to {largest:.3g} between the rows")
    return None


def largest_stretch(model: CompiledModel, t: Array, q: Array) -> Violation | None:
    """Return the quaternion of a run whose length differs most from 1, as a violation; None if all differ by rounding
    only.

    Parameters
    ----------
    t, q : (rows,) in s, (rows, nq)
    """
    turning = [factor for factor in model.factors if factor.group != "R"]
    if not turning:
        return None
    lengths = np.stack([np.linalg.norm(q[:, f.q_start : f.q_start + 4], axis=1) for f in turning], axis=1)
    off = np.abs(lengths - 1.0)
    if float(off.max()) <= REPORTED_VIOLATION:
        return None
    off = np.nan_to_num(off, nan=np.inf)
    row, k = np.unravel_index(int(np.argmax(off)), off.shape)
    message = f"the quaternion of {turning[k].name} has the length {lengths[row, k]:.6g} at t = {t[row]:.6g} s"
    return Violation(float(off[row, k]), message, float(t[row]))
