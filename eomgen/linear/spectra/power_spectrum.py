"""PowerSpectrum: the one-sided power spectral density of one quantity, with its unit, rms and plot."""

from __future__ import annotations

from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import checked_calls
from eomgen.base.data import dataclass
from eomgen.base.display import axes_of_caller, pyplot_figure
from eomgen.errors import Problem, UsageError
from eomgen.linear.spectra.ride_comfort import weighting_response

_GRID: dict[str, Any] = {"color": "#dddddd", "linewidth": 0.6}


@checked_calls()
@dataclass(frozen=True, repr=False)
class PowerSpectrum:
    """A power spectral density.

    Attributes
    ----------
    name : of the quantity
    quantity_unit : its unit; empty if it is not known
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
            ``Wk`` or ``Wd`` of ISO 2631-1, of an acceleration in m/s^2, as people feel it.

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
