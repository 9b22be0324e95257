"""PowerSpectrum: the one-sided power spectral density of one quantity, with its unit, rms and plot; frequency
weightings of whole-body vibration, and ride comfort over road classes and speeds.

The weightings are H(s) = band limitation (high pass f1, low pass f2, both Butterworth) times transition (f3, f4, Q4)
times upward step (f5, Q5, f6, Q6). Magnitudes agree with table 3 of ISO 2631-1.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, Complex
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass
from eomgen.base.figures import axes_of_caller, axis_label, draw_grid
from eomgen.base.html import page, table
from eomgen.compiled.arguments import numbers
from eomgen.errors import Problem, UsageError
from eomgen.solvers.phi_functions import phi


@dataclass(frozen=True)
class WeightingFilter:
    """Corner frequencies in Hz and quality factors of a filter of ISO 2631-1; ``step`` is (f5, Q5, f6, Q6) or None."""

    description: str
    f1: float
    f2: float
    f3: float
    f4: float
    Q4: float
    step: tuple[float, float, float, float] | None = None


WEIGHTINGS = {
    "Wk": WeightingFilter("vertical, of a seat or the floor", 0.4, 100.0, 12.5, 12.5, 0.63, (2.37, 0.91, 3.35, 0.91)),
    "Wd": WeightingFilter("horizontal, of a seat or the floor", 0.4, 100.0, 2.0, 2.0, 0.63),
}


def _weighting(name: str) -> WeightingFilter:
    if name not in WEIGHTINGS:
        fault = f"there is no weighting {ascii(name)[:32]} [E0173]"
        known = "; ".join(f"{key}: {item.description}" for key, item in WEIGHTINGS.items())
        raise UsageError(Problem("weighting", fault, known))
    return WEIGHTINGS[name]


def weighting_response(name: str, frequencies: ArrayLike) -> Complex:
    """Return the complex response of a weighting filter of ISO 2631-1.

    Parameters
    ----------
    name : str
        ``Wk`` or ``Wd``.
    frequencies : array_like
        Frequencies (...), Hz.

    Returns
    -------
    (...) complex ndarray
        Weighted over unweighted acceleration.

    Raises
    ------
    UsageError
        There is no weighting of that name.

    Examples
    --------
    >>> from eomgen.spectra import weighting_response
    >>> abs(weighting_response("Wk", [0.5, 5.0, 50.0])).round(2)
    array([0.42, 1.04, 0.25])
    """
    above, below = _polynomials(_weighting(name))
    f = 1j * np.asarray(frequencies, dtype=float)
    response: Complex = np.polyval(above, f) / np.polyval(below, f)
    return response


def check_weighted(name: str, unit: str) -> None:
    """Raise an error unless the unit of a quantity is m/s^2 or not known.

    Parameters
    ----------
    name : str
        Name of the quantity, for the message.
    unit : str
        Unit of the quantity, spelled ``m/s^2``; an empty unit is not known and passes.

    Raises
    ------
    UsageError
        Another unit, also of an acceleration, such as g.
    """
    if unit not in ("", "m/s^2"):
        fault = f"{name} is in {unit}, and weightings apply to accelerations in m/s^2 [E0472]"
        raise UsageError(Problem("weighting", fault, "an output that is an acceleration"))


def weighted_signal(name: str, t: Array, values: Array) -> Array:
    """Return the output of a weighting filter for the signal, exactly for the cubic spline through the values.

    The filter has the partial fractions sum r / (s - p): each fraction is one recursion from row to row, whose input
    is the integral of exp(p (t - tau)) times the cubic. At the first row the filter is at rest under a constant input
    of the first value, so that the result there is 0.

    Parameters
    ----------
    name : str
        ``Wk`` or ``Wd``.
    t : ndarray
        Times (n,), s, increasing, evenly spaced or not.
    values : ndarray
        Accelerations (n,), m/s^2.

    Returns
    -------
    (n,) ndarray
        Weighted accelerations, m/s^2.

    Raises
    ------
    UsageError
        There is no weighting of that name.
    ValueError
        Fewer than two times, times that do not increase, values of another number or not finite.

    Examples
    --------
    >>> from eomgen.spectra import weighted_signal
    >>> t = np.linspace(0.0, 20.0, 4001)
    >>> shaken = weighted_signal("Wk", t, np.sin(2 * np.pi * 5.0 * t))
    >>> round(float(np.max(shaken[2000:])), 2)         # people feel 5 Hz in full
    1.04
    """
    above, below = _polynomials(_weighting(name))
    corners: Complex = np.roots(below).astype(complex)
    poles = 2.0 * np.pi * corners
    residues = 2.0 * np.pi * np.polyval(above, corners) / np.polyval(np.polyder(below), corners)
    from scipy.interpolate import CubicSpline  # noqa: PLC0415  # slow to import

    steps = np.diff(t)
    coefficients = CubicSpline(t, values).c[::-1]  # (4, n - 1), of powers 0 to 3
    z: Any = poles[:, np.newaxis] * steps  # complex, for which phi holds as well
    # the integral of exp(z (1 - x)) x^k over x from 0 to 1 is k! phi_(k+1)(z)
    entering = sum(c * steps ** (k + 1) * math.factorial(k) * phi(z, k + 1) for k, c in enumerate(coefficients))
    decays = np.exp(z).T
    state = -values[0] / poles
    result = np.empty(len(t))
    result[0] = (residues @ state).real
    for k, (decay, added) in enumerate(zip(decays, np.asarray(entering).T, strict=True), 1):
        state = decay * state + added
        result[k] = (residues @ state).real
    return result


def _polynomials(item: WeightingFilter) -> tuple[Array, Array]:
    """Return numerator and denominator of a weighting filter's response over s / 2 pi, highest powers first."""

    def second_order(corner: float, quality: float) -> Array:
        return np.array([corner**-2, 1.0 / (quality * corner), 1.0])

    butterworth = 1.0 / math.sqrt(2.0)
    above = np.polymul([item.f1**-2, 0.0, 0.0], [1.0 / item.f3, 1.0])
    below = np.polymul(second_order(item.f1, butterworth), second_order(item.f2, butterworth))
    below = np.polymul(below, second_order(item.f4, item.Q4))
    if item.step is not None:
        f5, Q5, f6, Q6 = item.step
        above = np.polymul(above, (f5 / f6) ** 2 * second_order(f5, Q5))
        below = np.polymul(below, second_order(f6, Q6))
    return np.asarray(above), np.asarray(below)


@checked_calls()
@dataclass(frozen=True, repr=False)
class RideTable:
    """Root mean squares over road classes and speeds.

    Attributes
    ----------
    outputs, units : names and units of the outputs; empty units are not known
    classes : (nc,) road classes; ``measured`` or the roughness of a road without a class
    speeds : (ns,) m/s
    values : (nc, ns, number of outputs)
    weightings : names of the outputs' frequency weightings; empty for none
    """

    outputs: tuple[str, ...]
    units: tuple[str, ...]
    classes: tuple[str, ...]
    speeds: Array
    values: Array
    weightings: tuple[str, ...]

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of the columns of ``rows``: ``class``, ``speed [m/s]``, and of each output ``rms NAME``, followed by
        the weighting, ``(Wk)`` or ``(Wd)``, if weighted, and by ``[unit]`` if known."""
        named = (
            name + (f" ({weighting})" if weighting else "") + (f" [{unit}]" if unit else "")
            for name, unit, weighting in zip(self.outputs, self.units, self.weightings, strict=True)
        )
        return ("class", "speed [m/s]", *(f"rms {name}" for name in named))

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """A tuple of texts for each class and speed, all speeds of the first class first: class, speed in m/s, root
        mean squares of the outputs."""
        return [
            (name, f"{speed:.6g}", *(f"{value:.6g}" for value in self.values[i, k]))
            for i, name in enumerate(self.classes)
            for k, speed in enumerate(self.speeds)
        ]

    def __repr__(self) -> str:
        columns = list(zip(self.headings, *self.rows, strict=True))
        widths = [max(len(cell) for cell in column) for column in columns]
        lines = [self.headings, *self.rows]
        return "\n".join(
            "  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines
        )

    def _repr_html_(self) -> str:
        return page("Root mean squares on random roads", table(self.headings, self.rows))


@checked_calls()
@dataclass(frozen=True, repr=False)
class PowerSpectrum:
    """A power spectral density.

    Attributes
    ----------
    name : of the quantity
    quantity_unit : unit of the quantity; empty if unknown
    frequencies : (n,) Hz, increasing
    density : (n,) one-sided, quantity_unit^2/Hz
    source : origin, for titles: a road at a speed, a run
    """

    name: str
    quantity_unit: str
    frequencies: Array
    density: Array
    source: str = ""

    def __repr__(self) -> str:
        low, high = self.frequencies[0], self.frequencies[-1]
        size = f"rms {self.rms():.6g} {self.quantity_unit}".rstrip()
        return f"<PowerSpectrum of {self.name}: {len(self.frequencies)} points, {low:.4g} to {high:.4g} Hz; {size}>"

    @property
    def unit(self) -> str:
        """Unit of the density: ``(m/s^2)^2/Hz``; empty if the unit of the quantity is unknown."""
        unit = self.quantity_unit
        if unit in ("", "1"):
            return "1/Hz" if unit else ""
        return f"({unit})^2/Hz" if any(sign in unit for sign in "/^* ") else f"{unit}^2/Hz"

    def rms(self, low: float = 0.0, high: float = np.inf, *, weighting: str | None = None) -> float:
        """Return the root mean square of the part between two frequencies, by the trapezoidal rule.

        The points have to resolve the resonances; ``Linearization.rms`` integrates adaptively.

        Parameters
        ----------
        low, high : float, optional
            Ends of the part, Hz, the lower first, cut to the first and the last of ``frequencies``; all by default.
        weighting : str, optional
            ``Wk`` or ``Wd`` of ISO 2631-1, for an acceleration in m/s^2: the part that people feel.

        Returns
        -------
        float
            In the unit of the quantity; 0 for a part outside ``frequencies``.

        Raises
        ------
        UsageError
            Ends that are not numbers, ``low`` above ``high``; there is no such weighting, or the quantity has another
            unit than m/s^2 (an unknown unit passes).

        Examples
        --------
        >>> from eomgen.spectra import PowerSpectrum
        >>> PowerSpectrum("seat", "m/s^2", np.array([1.0, 5.0]), np.array([0.25, 0.25])).rms()
        1.0
        """
        low, high = numbers("low, high", [low, high])
        if not low <= high:
            raise UsageError(Problem("rms", f"{low:.6g} to {high:.6g} Hz is reversed [E2243]", "low <= high"))
        ends = np.clip([low, high], self.frequencies[0], self.frequencies[-1])
        inside = (self.frequencies > ends[0]) & (self.frequencies < ends[1])
        f = np.concatenate([ends[:1], self.frequencies[inside], ends[1:]])
        density = np.interp(f, self.frequencies, self.density)
        if weighting is not None:
            check_weighted(self.name, self.quantity_unit)
            density = density * np.abs(weighting_response(weighting, f)) ** 2
        return float(np.sqrt(np.trapezoid(density, f)))

    def plot(self, axes: object = None, label: str | None = None) -> list[Any]:
        """Draw the density over frequency in double logarithmic scales; return matplotlib's axes, a list of one.

        Parameters
        ----------
        axes : matplotlib Axes, optional
            A new figure of pyplot if none are given; several spectra may go onto the same axes.
        label : str
            For a legend; no legend by default.

        Returns
        -------
        list of matplotlib Axes
            One.

        Raises
        ------
        UsageError
            An object that is not axes, or more than one.
        """
        drawn = axes_of_caller("plot", axes, [f"spectrum of {self.name}"], (7.4, 4.6))
        axis = drawn[0]
        used = (self.frequencies > 0.0) & (self.density > 0.0)
        axis.loglog(self.frequencies[used], self.density[used], linewidth=1.4, label=label)
        axis.set_xlabel("frequency, Hz")
        axis.set_ylabel(axis_label("power spectral density", self.unit))
        axis.set_title(self.name + (f"; {self.source}" if self.source else ""), fontsize=10, loc="left")
        draw_grid(axis, which="both")
        if label is not None:
            axis.legend(fontsize=9, frameon=False)
        return drawn
