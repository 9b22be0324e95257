"""The energy balance over the samples of a run: d(kinetic + potential)/dt = power + base power.

If no force has power the total energy is constant, and two rows are enough. Otherwise the work between rows is the
integral of the power at the rows; its error is estimated by leaving out every second row.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eomgen.base.arrays import Array

#: Share of the energies at work beyond which a run says that its balance is off, and share beyond which a run has
#: failed that gained them without work. Without power, a total energy that grows fiftyfold gains 49 % at least.
REPORTED, FAILED = 0.01, 0.49
#: Why the balance is not known if rows do not resolve the power between them.
APART = "the rows are too far apart to tell the work in between"
#: Rows that the integral of a power needs.
_ROWS = 5
#: Error of an integral over rows, in multiples of its change when every second row is left out.
_MARGIN = 4.0
#: An imbalance in fewer than one of this many intervals is due to single events between rows, not to every step.
_FEW = 20
#: Implausible ratio of gained energy to the initial energy plus the work of the largest recorded power.
_EXPLODED = 1e3
#: Part of the time in which the work has to be known.
_KNOWN = 0.5


class Balance(NamedTuple):
    """How far the energy of a run is out of balance.

    Attributes
    ----------
    error : largest violation of the balance, as a share of the energies that move; None if it is not known
    unknown : why it is not known
    infinite : s, the first time at which the energy is beyond the finite numbers; None if it never is
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
) -> Balance:
    """Return the balance of energy over rows.

    Parameters
    ----------
    t : (n,) s
    energy : mapping
        ``kinetic``, ``potential``, ``total`` in J and ``power``, ``base_power`` in W, (n,) each.
    jumps : (k,) s
        Times at which forces jump: intervals that contain one are skipped, because rows do not resolve their work.
    conservative : bool
        Whether there is no power in any state.
    sparse : bool
        Whether steps lie between the rows, and with them pulses of power that no row shows.
    epsilon : float
        Last place of the numbers that energies are computed in.
    """
    if not all(name in energy for name in ("kinetic", "potential", "total", "power", "base_power")):
        return Balance(None, "the model was built without the term energy")
    kinetic, potential, total = energy["kinetic"], energy["potential"], energy["total"]
    finite = np.isfinite(total) & np.isfinite(energy["power"]) & np.isfinite(energy["base_power"])
    if not finite.all():
        return Balance(None, "the energy is beyond the finite numbers", float(t[finite.argmin()]))
    highest, lowest, fastest = potential.max(), potential.min(), kinetic.max()
    moving = float(highest - lowest + fastest)
    if len(t) < (2 if conservative else _ROWS):
        if len(t) > 1 and (gained := _out_of_nothing(t, energy, moving)):
            return Balance(gained, gain=gained)
        return Balance(None, f"{len(t)} row{'s' * (len(t) != 1)} tell too little of the work in between")
    floor = max(1e-9, 100.0 * epsilon) * (max(abs(highest), abs(lowest)) + fastest)
    if conservative:
        return _shares(total - total[0], moving) if moving > floor else Balance(0.0)
    rate = energy["power"] + energy["base_power"]
    known = _smooth_intervals(t, jumps)
    spans = t[1:] - t[:-1]
    if spans[known].sum() < _KNOWN * (t[-1] - t[0]):
        return Balance(None, "forces jump, or states are sampled, next to most rows")
    pieces = 0.5 * spans * (rate[1:] + rate[:-1])
    work = _sums(pieces, known)
    swing = moving + np.abs(work).max()
    if swing <= floor:
        return Balance(0.0)
    off = _sums(total[1:] - total[:-1], known) - work
    error, noticed = np.abs(off).max(), REPORTED * swing
    uncertain = _MARGIN * _off_by_every_second_row(t, rate, pieces, known)
    if (error <= uncertain and uncertain > noticed) or (error > noticed and sparse and _is_pulse(off)):
        return Balance(None, APART)
    return _shares(off, swing)


def _out_of_nothing(t: Array, energy: Mapping[str, Array], moving: float) -> float:
    """Return the gain of energy relative to the moving energy; 0 if the initial kinetic energy, the range of the
    potential and the largest recorded power may explain the gain."""
    known = energy["kinetic"][0] + np.ptp(energy["potential"])
    known += (t[-1] - t[0]) * np.max(np.maximum(energy["power"] + energy["base_power"], 0.0))
    gain = float(np.max(energy["total"] - energy["total"][0]))
    return float(gain / moving) if gain > _EXPLODED * known else 0.0


def _shares(off: Array, swing: float) -> Balance:
    return Balance(float(np.abs(off).max() / swing), gain=float(off.max() / swing))


def same_time(t: Array) -> float:
    """Return the difference, s, below which two times of a run with rows at t (n,) count as equal."""
    return 1e-9 * float(np.ptp(t)) + 8.0 * float(np.finfo(float).eps * np.abs(t).max())


def _smooth_intervals(t: Array, jumps: ArrayLike) -> NDArray[np.bool_]:
    """Return for each interval between rows whether no jump lies in it, ends included."""
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
    """Return the largest change of an integral by the trapezoidal rule, of pieces (n - 1,), if every second row is left
    out."""
    end = len(t) - (len(t) + 1) % 2  # an odd number of rows, so that every second one has both neighbours
    both = known[: end - 1 : 2] & known[1 : end - 1 : 2]
    coarse = 0.5 * (t[2:end:2] - t[: end - 2 : 2]) * (rate[2:end:2] + rate[: end - 2 : 2])
    change = np.where(both, coarse - (pieces[: end - 1 : 2] + pieces[1 : end - 1 : 2]), 0.0)
    return float(np.abs(np.cumsum(change)).max())


def _is_pulse(off: Array) -> bool:
    """Return whether few intervals make an imbalance (n,)."""
    jumps = np.abs(off[1:] - off[:-1])
    return bool(_FEW * jumps.sum() ** 2 < len(jumps) * (jumps**2).sum())
