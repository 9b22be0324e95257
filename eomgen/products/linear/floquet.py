"""Floquet theory of linear models with periodic coefficients: the monodromy matrix by collocation, its multipliers with
bounds of their errors, exponents, stability.

The matrix solves X' = A(t) X, X(0) = 1, up to one period. Collocation at seven even places of each interval, a block
method of order 8 that is A-stable (Watts and Shampine 1972, BIT 12, 252-266), takes A at even times.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass
from eomgen.base.figures import axes_of_caller, draw_grid
from eomgen.base.html import page, paragraph, table
from eomgen.products.linear.eigenvalues import EPSILON, MARGIN, balance, eigenvectors, verdict
from eomgen.products.linear.plots import AROUND, LabelBox, free_box

#: Places of the collocation in an interval, from 0 on.
PLACES = 6
#: Points of a unit of the axes in a new figure.
_UNIT = 140.0


@checked_calls()
@dataclass(frozen=True, repr=False, eq=False)
class Floquet:
    """Growth of small deviations from a periodic motion over one period.

    Attributes
    ----------
    period : s
    monodromy : (ns, ns) the deviations at the end of the period by the deviations at its start
    states : names of the deviations, as of a ``StateSpace``
    multipliers : (ns,) complex eigenvalues of ``monodromy``, the largest first
    uncertainty : (ns,) of the multipliers, by the collocation and by rounding
    error : relative error of ``monodromy`` in balanced units, estimated by differences from fewer intervals
    q, v, z : (nq,), (nv,), (nz,) the periodic motion at its start
    corrections : number of Newton corrections of the start
    name : of the model
    """

    period: float
    monodromy: Array
    states: tuple[str, ...]
    multipliers: Complex
    uncertainty: Array
    error: float
    q: Array
    v: Array
    z: Array
    corrections: int = 0
    name: str = ""

    @property
    def exponents(self) -> Complex:
        """(ns,) complex, log(multipliers) / period, in the order of ``multipliers``.

        Real parts are growth in 1/s, minus infinity for a multiplier of zero. Imaginary parts in rad/s, from -pi /
        period to pi / period, are known but for whole multiples of 2 pi / period.
        """
        with np.errstate(divide="ignore"):
            return np.asarray(np.log(self.multipliers.astype(complex)) / self.period)

    @property
    def frequencies(self) -> Array:
        """(ns,) Hz, damped, 0 to half of 1 / period; a measured one is one of k / period + and - this frequency."""
        return np.abs(self.exponents.imag) / (2.0 * np.pi)

    @property
    def stability(self) -> str:
        """``stable`` if all multipliers are within the unit circle by more than their ``uncertainty``, ``unstable`` if
        a multiplier is outside by more, else ``marginal``, as an orbit of free phase with its multiplier 1 is."""
        return verdict(np.abs(self.multipliers) - 1.0, self.uncertainty)

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of ``rows``."""
        return ("multiplier", "magnitude", "uncertainty", "growth, 1/s", "damped frequency, Hz")

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Tuples of texts: multiplier, magnitude, uncertainty, growth (1/s), damped frequency (Hz); a tuple for each
        real multiplier and for each conjugate pair, in the order of ``multipliers``."""
        columns = (self.multipliers, self.uncertainty, self.exponents, self.frequencies)
        return [
            (
                f"{value.real:.9g}" + (f" ± {value.imag:.9g}j" if value.imag > 0.0 else ""),
                f"{abs(value):.9g}",
                f"{bound:.2g}",
                f"{exponent.real:.6g}",
                f"{frequency:.6g}",
            )
            for value, bound, exponent, frequency in zip(*columns, strict=True)
            if value.imag >= 0.0
        ]

    def __repr__(self) -> str:
        largest = float(np.max(np.abs(self.multipliers), initial=0.0))
        size = f"largest multiplier {largest:.9g}, error {self.error:.2g}"
        return f"<Floquet: {len(self.multipliers)} multipliers over {self.period:.9g} s; {self.stability}; {size}>"

    def _repr_html_(self) -> str:
        known = f"Frequencies are known but for whole multiples of {1.0 / self.period:.6g} Hz."
        heading = f"Floquet multipliers over {self.period:.9g} s: {self.stability}"
        return page(heading, table(self.headings, self.rows), paragraph(known))

    def plot(self, axes: object = None) -> list[Any]:
        """Draw the multipliers with frequencies and the unit circle; return matplotlib's axes, a list of one.

        Growing multipliers are red. Labels without a free place are left out.

        Parameters
        ----------
        axes : matplotlib Axes, optional
            A new figure of pyplot if none are given.

        Returns
        -------
        list of matplotlib Axes
            One.

        Raises
        ------
        UsageError
            An object that is not axes, or more than one.
        """
        drawn = axes_of_caller("plot", axes, ["multipliers"], (5.6, 5.4))
        axis = drawn[0]
        turn = np.exp(1j * np.linspace(0.0, 2.0 * np.pi, 361))
        axis.plot(turn.real, turn.imag, color="#777777", linewidth=1.0, label="unit circle: stable inside")
        growing = np.abs(self.multipliers) - 1.0 > self.uncertainty
        for chosen, colour in ((~growing, "#0B62C4"), (growing, "#C8102E")):
            values = self.multipliers[chosen]
            axis.plot(values.real, values.imag, "o", color=colour, markersize=6.0, markeredgecolor="white")
        taken = [LabelBox.dot(_UNIT * value.real, _UNIT * value.imag) for value in self.multipliers.tolist()]
        for value, frequency in zip(self.multipliers.tolist(), self.frequencies.tolist(), strict=True):
            x, y, text = _UNIT * value.real, _UNIT * value.imag, f"{frequency:.3g} Hz"
            if value.imag > 0.0 and (box := free_box((x, y), text, AROUND, taken)):
                taken.append(box)
                axis.annotate(
                    text, (value.real, value.imag), (box.x - x, box.y - y), textcoords="offset points",
                    ha="center", va="center", fontsize=8, color="#333333",
                )  # fmt: skip  # place, text, looks
        axis.set_aspect("equal", adjustable="datalim")
        axis.set_xlabel("real part")
        axis.set_ylabel("imaginary part")
        title = f"multipliers over {self.period:.6g} s: {self.stability}"
        known = f"frequencies are known but for multiples of {1.0 / self.period:.4g} Hz"
        axis.set_title(f"{self.name}: {title}\n{known}" if self.name else f"{title}\n{known}", fontsize=10, loc="left")
        axis.legend(loc="upper right", fontsize=8, frameon=False)
        draw_grid(axis)
        return drawn


@cache
def _weights() -> tuple[Array, Array]:
    """Return the integrals of interpolating polynomials from place 0 to each other place, in units of the interval. The
    first array, (6,), has the weights of the value at place 0, the second, (6, 6), the weights of the other places."""
    places = np.arange(PLACES + 1) / PLACES
    powers = np.vander(places, increasing=True)
    orders = np.arange(1, PLACES + 2)
    integrals = places[1:, np.newaxis] ** orders / orders
    weights = np.linalg.solve(powers.T, integrals.T).T
    return np.asarray(weights[:, 0], dtype=float), np.asarray(weights[:, 1:], dtype=float)


def monodromy(matrices: Array, period: float) -> Array:
    """Return the monodromy matrix (n, n) of X' = A(t) X over a period, by collocation of order 8.

    Parameters
    ----------
    matrices : (6 m + 1, n, n)
        A at even times from 0 to the period.
    period : float
        s.
    """
    n = matrices.shape[1]
    first, second = _weights()
    count = (len(matrices) - 1) // PLACES
    h = period / count
    result = np.eye(n)
    for k in range(count):
        start, *rest = matrices[PLACES * k : PLACES * (k + 1) + 1]
        # S_i = S_0 + h sum_j w_ij A_j S_j, for a unit matrix S_0
        system = np.eye(PLACES * n) - h * np.block([[w * A for w, A in zip(row, rest, strict=True)] for row in second])
        right = np.vstack([np.eye(n) + h * w * start for w in first])
        result = np.linalg.solve(system, right)[-n:] @ result
    return result


def multipliers(matrix: Array, half: Array, quarter: Array) -> tuple[Complex, Array, float]:
    """Return the multipliers (n,) with their uncertainties (n,), the largest first, and the error of the matrix.

    Parameters
    ----------
    matrix, half, quarter : (n, n)
        Monodromy matrices by some intervals, by half and by a quarter of the intervals: errors fall as the differences
        do, by 2^8 at the most.
    """
    if not len(matrix):
        return np.zeros(0, complex), np.zeros(0), 0.0
    balanced, back = balance(matrix)
    size = max(1.0, float(np.linalg.norm(balanced, 2)))
    with np.errstate(all="ignore"):  # few intervals may overflow
        coarser = [np.linalg.solve(back, matrix @ back) for matrix in (half, quarter)]
        changes = [balanced - coarser[0], coarser[0] - coarser[1]]
    last, before = (float(np.linalg.norm(change, 2)) if np.isfinite(change).all() else np.inf for change in changes)
    ratio = last / before if before > 0.0 else 1.0
    off = last * min(1.0, max(ratio, 2.0**-8)) if np.isfinite(before) else last
    values, _, cosines = eigenvectors(balanced)
    change = off + MARGIN * EPSILON * size
    with np.errstate(divide="ignore"):
        # of a double multiplier that has one vector alone, the root of the change
        bounds = np.minimum(change / cosines, np.sqrt(change * size))
    order = np.lexsort((-values.imag, -values.real, -np.round(np.abs(values), 12)))
    return values[order], bounds[order], off / size
