"""Plots of a study of random vibration: the distribution on a probability scale, covariance over time, modes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import special

from eomgen.base.figures import new_figure, saved
from eomgen.products.reliability.vibration.findings import Distribution, Findings, Process

#: Label, colour, line and mark of each method.
_STYLES = {
    "first_order": ("normal, first order at the mean", "#9A9A9A", "--", ""),
    "second_order": ("second order at the mean", "#B8860B", "-.", ""),
    "projected": ("projected second order at the mean", "#7A4FA3", (0, (6, 2)), ""),
    "hermite": ("Hermite projection", "#3A8F3A", "-", ""),
    "form": ("FORM", "#C43A0B", ":", "x"),
    "quadratic": ("quadratic at most probable points", "#0B62C4", "-", "o"),
    "importance_sampling": ("importance sampling", "#111111", "", "s"),
    "monte_carlo": ("Monte Carlo, 95 % confidence", "#111111", "", "."),
}
#: Probabilities that the scale names.
_NAMED = (1e-9, 1e-7, 1e-5, 1e-3, 0.01, 0.1, 0.5, 0.9, 0.99)


def draw(found: Findings, folder: Path) -> list[Path]:
    """Draw all plots and return their files."""
    files = [saved(_distribution(found), folder / "distribution.png")]
    if len(found.times):
        files.append(saved(_covariance(found), folder / "autocovariance.png"))
    files.append(saved(_modes(found), folder / "modes.png"))
    return files


def _scaled(one: Distribution) -> Any:
    """Return P(y <= threshold) as the place of a standard normal variable, by the smaller tail of both."""
    with np.errstate(invalid="ignore"):
        lower, upper = special.ndtri(one.below), -special.ndtri(one.above)
    return np.where(one.below < 0.5, lower, upper)


def _distribution(found: Findings) -> Any:
    figure = new_figure((7.6, 5.2))
    axes = figure.subplots()
    order = np.argsort(found.thresholds)
    y = found.thresholds[order]
    for name, (label, colour, line, mark) in _STYLES.items():
        if name not in found.distributions:
            continue
        one = found.distributions[name]
        place = _scaled(one)[order]
        finite = np.isfinite(place)
        axes.plot(
            y[finite],
            place[finite],
            color=colour,
            linestyle=line,
            marker=mark,
            markersize=5,
            linewidth=1.5,
            label=label,
        )
        if len(one.low):
            with np.errstate(invalid="ignore", divide="ignore"):
                low, high = special.ndtri(one.low)[order], special.ndtri(one.high)[order]
            known = np.isfinite(low) & np.isfinite(high)
            axes.vlines(y[known], low[known], high[known], color=colour, linewidth=1.2)
    marks = np.array([*_NAMED, *(1.0 - np.array(_NAMED[:4]))])
    places = np.append(special.ndtri(np.array(_NAMED)), -special.ndtri(np.array(_NAMED[:4])))
    bottom, top = axes.get_ylim()
    shown = (places >= bottom) & (places <= top)
    axes.set_yticks(places[shown], [_percent(share) for share in marks[shown]])
    axes.set_ylim(bottom, top)
    axes.set_xlabel(f"{found.output} in {found.unit}" if found.unit else found.output)
    axes.set_ylabel("probability of not more, normal scale")
    axes.set_title(f"{found.scene}: {found.output} at t = {found.t:.6g} s", fontsize="medium")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", loc="upper left")
    return figure


def _percent(share: float) -> str:
    if share > 0.99:
        return f"1 - {1.0 - share:.0e}".replace("e-0", "e-")
    return f"{share:g}" if share >= 1e-3 else f"{share:.0e}".replace("e-0", "e-")


def _covariance(found: Findings) -> Any:
    figure = new_figure((7.6, 3.6))
    axes = figure.subplots()
    order = np.argsort(found.times)
    for name, values in found.autocovariance.items():
        label, colour, line, _ = _STYLES[name]
        axes.plot(found.times[order], values[order], color=colour, linestyle=line, linewidth=1.6, label=label)
    axes.axhline(0.0, color="#888888", linewidth=0.8)
    axes.set_xlabel("time in s")
    unit = f" in ({found.unit})²" if found.unit else ""
    axes.set_ylabel(f"covariance{unit}")
    axes.set_title(f"covariance of {found.output} with its value at t = {found.t:.6g} s", fontsize="medium")
    axes.grid(alpha=0.3)
    axes.margins(x=0.0)
    axes.legend(fontsize="small")
    return figure


def _title_of_modes(processes: Sequence[Process]) -> str:
    of_waves = [process.kind == "waves" for process in processes]
    if all(of_waves):
        return "Energies of the waves, of two variables each"
    modes = "Karhunen-Loève modes of the random processes"
    return f"{modes}, energies of the waves" if any(of_waves) else modes


def _modes(found: Findings) -> Any:
    figure = new_figure((7.6, 3.6))
    axes = figure.subplots()
    for process in found.processes:
        values = np.array(process.eigenvalues)
        label = f"{process.name}: {len(values)} modes, {100.0 * process.captured:.6g} % of the variance"
        axes.semilogy(np.arange(1, len(values) + 1), values / values[0], marker="o", markersize=4, label=label)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_xlabel("mode")
    axes.set_ylabel("eigenvalue by the largest")
    axes.set_title(_title_of_modes(found.processes), fontsize="medium")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return figure
