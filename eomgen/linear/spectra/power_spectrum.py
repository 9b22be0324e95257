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
from eomgen.base.figures import axes_of_caller, pyplot_figure
from eomgen.base.html import page, table
from eomgen.errors import Problem, UsageError


@dataclass(frozen=True)
class WeightingFilter:
    """Corner frequencies in Hz and resonance quality factors; ``step`` is (f5, Q5, f6, Q6) or None."""

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


def weighting_response(name: str, frequencies: ArrayLike) -> Complex:
    """Return the complex response (...) of a weighting filter at frequencies (...) in Hz.

    Raises
    ------
    UsageError
        There is no weighting of that name.
    """
    if name not in WEIGHTINGS:
        fault = f"there is no weighting {ascii(name)[:32]}"
        known = "; ".join(f"{key}: {item.description}" for key, item in WEIGHTINGS.items())
        raise UsageError(Problem("weighting", fault, known))
    item = WEIGHTINGS[name]
    f = 1j * np.asarray(frequencies, dtype=float)
    butterworth = 1.0 / math.sqrt(2.0)
    high_pass = (f / item.f1) ** 2 * _second_order(f, item.f1, butterworth)
    low_pass = _second_order(f, item.f2, butterworth)
    response: Complex = high_pass * low_pass * (1.0 + f / item.f3) * _second_order(f, item.f4, item.Q4)
    if item.step is not None:
        f5, Q5, f6, Q6 = item.step
        response = response * (f5 / f6) ** 2 * _second_order(f, f6, Q6) / _second_order(f, f5, Q5)
    return response


def _second_order(f: Complex, corner: float, quality: float) -> Complex:
    """Return 1 / (1 + s / (Q w) + (s / w)^2) at s = 2 pi f."""
    result: Complex = 1.0 / (1.0 + f / (quality * corner) + (f / corner) ** 2)
    return result


@checked_calls()
@dataclass(frozen=True, repr=False)
class RideTable:
    """Root mean squares over road classes and speeds.

    Attributes
    ----------
    outputs, units : names and units of the outputs; empty units are not known
    classes : (nc,) road classes
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
        """Headings of the columns of ``rows``."""
        named = (
            name + (f" ({weighting})" if weighting else "") + (f" [{unit}]" if unit else "")
            for name, unit, weighting in zip(self.outputs, self.units, self.weightings, strict=True)
        )
        return ("class", "speed [m/s]", *(f"rms {name}" for name in named))

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """Class, speed and root mean squares as texts."""
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


_GRID: dict[str, Any] = {"color": "#dddddd", "linewidth": 0.6}


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
        """Unit of the density: ``(m/s^2)^2/Hz``."""
        unit = self.quantity_unit
        if unit in ("", "1"):
            return "1/Hz" if unit else ""
        return f"({unit})^2/Hz" if any(sign in unit for sign in "/^* ") else f"{unit}^2/Hz"

    def rms(self, low: float = 0.0, high: float = np.inf, *, weighting: str | None = None) -> float:
        """Return the root mean square of the part between two frequencies, by the trapezoidal rule.

        The points have to resolve the resonances; ``Linearization.rms`` integrates adaptively.

        Parameters
        ----------
        low, high : float
            Hz.
        weighting : str, optional
            ``Wk`` or ``Wd`` of ISO 2631-1, for an acceleration in m/s^2: the part that people feel.

        Raises
        ------
        UsageError
            There is no such weighting, or the quantity is no acceleration.
        """
        ends = np.clip([low, high], self.frequencies[0], self.frequencies[-1])
        inside = (self.frequencies > ends[0]) & (self.frequencies < ends[1])
        f = np.concatenate([ends[:1], self.frequencies[inside], ends[1:]])
        density = np.interp(f, self.frequencies, self.density)
        if weighting is not None:
            if self.quantity_unit not in ("", "m/s^2"):
                fault = f"{self.name} is in {self.quantity_unit}, and weightings are of accelerations in m/s^2"
                raise UsageError(Problem("weighting", fault, "an output that is an acceleration"))
            density = density * np.abs(weighting_response(weighting, f)) ** 2
        return float(np.sqrt(np.trapezoid(density, f)))

    def plot(self, axes: object = None, label: str | None = None) -> list[Any]:
        """Draw the density over frequency in double logarithmic scales; return matplotlib's axes, a list of one.

        Parameters
        ----------
        axes : matplotlib Axes
            A new figure of pyplot if none are given; several spectra may go onto the same axes.
        label : str
            For a legend.

        Raises
        ------
        UsageError
            Something that is no axes, or more than one.
        """
        given = pyplot_figure((7.4, 4.6)).subplots() if axes is None else axes
        drawn = axes_of_caller("plot", given, [f"spectrum of {self.name}"])
        axis = drawn[0]
        used = (self.frequencies > 0.0) & (self.density > 0.0)
        axis.loglog(self.frequencies[used], self.density[used], linewidth=1.4, label=label)
        axis.set_xlabel("frequency, Hz")
        axis.set_ylabel("power spectral density" + (f", {self.unit}" if self.unit else ""))
        axis.set_title(self.name + (f"; {self.source}" if self.source else ""), fontsize=10, loc="left")
        axis.grid(True, which="both", **_GRID)
        axis.set_axisbelow(True)
        if label is not None:
            axis.legend(fontsize=9, frameon=False)
        return drawn
