"""Result of a study of random vibration: moments, distributions by each method, autocovariance and costs; files and
plots."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import special

from eomgen.base.arrays import Array
from eomgen.base.csv_tables import write_table
from eomgen.base.data import dataclass
from eomgen.base.figures import axis_label, new_figure, save_figure
from eomgen.base.files import make_folder, write_text
from eomgen.base.json_text import json_text
from eomgen.results.error_estimate import SampleErrors


@dataclass(frozen=True)
class Distribution:
    """P(y <= threshold) and P(y > threshold) by one method.

    Attributes
    ----------
    below, above : (thresholds,), not a number if the method has none
    low, high : of P(y <= threshold), (thresholds,): bounds of 95 % confidence if samples were counted, else empty
    """

    below: Array
    above: Array
    low: Array
    high: Array

    @classmethod
    def without_samples(cls, below: Array, above: Array) -> Distribution:
        """Return the distribution by a method without samples.

        Parameters
        ----------
        below, above : (thresholds,) array
            P(y <= threshold) and P(y > threshold).

        Returns
        -------
        Distribution
        """
        return cls(below, above, np.zeros(0), np.zeros(0))

    @classmethod
    def from_tails(cls, upper: Array, tail: Array, low: Array, high: Array) -> Distribution:
        """Return the distribution with given tails and their bounds.

        Parameters
        ----------
        upper : (thresholds,) array of bool
            Whether a tail is P(y > threshold); else P(y <= threshold).
        tail, low, high : (thresholds,) array
            Tails and bounds of their intervals.

        Returns
        -------
        Distribution
        """
        below, above = np.where(upper, 1.0 - tail, tail), np.where(upper, tail, 1.0 - tail)
        return cls(below, above, np.where(upper, 1.0 - high, low), np.where(upper, 1.0 - low, high))


@dataclass(frozen=True)
class Cost:
    """How often the equations of motion were solved, and the linearised equations backwards and forwards in time."""

    runs: int
    adjoints: int
    tangents: int


@dataclass(frozen=True)
class Process:
    """A random process of the scene: kind, number of variables, and the part of the variance that the variables
    capture."""

    name: str
    kind: str
    variables: int
    captured: float
    eigenvalues: tuple[float, ...]


#: Moments of the message, and the method of each.
_ORDER = {
    "corrected": "by a form and samples",
    "second_order": "to second order",
    "projected": "to projected second order",
    "monte_carlo": "by samples",
}


@dataclass(frozen=True)
class RandomVibration:
    """The distribution of an output at one time, with files and plots.

    Attributes
    ----------
    scene, output, unit : names
    t : s
    processes : the scene's
    thresholds : (n,)
    moments : of each method: mean, standard deviation, skewness, excess kurtosis
    distributions : of each method
    indices : reliability index of each threshold, (n,), not a number if none was looked for
    times, autocovariance : (m,) in s, and the covariance with the output at ``t`` by method, (m,)
    first_passage : of each level: probability of a passage within the run by method; ``preferred`` is the recommended
        probability
    costs : by method
    notes : doubts
    error : SampleErrors
        Estimated discretisation errors of a few samples.
    errors : of each method: error relative to the corrected probability at each threshold, on the less probable side,
        (n,); NaN without a corrected probability
    lost_variance : float
        Share of the output's variance, to first order about the mean, that is lost with the modes left out of the
        processes; NaN if no modes are left out, or if unknown.
    """

    scene: str
    output: str
    unit: str
    t: float
    processes: tuple[Process, ...]
    thresholds: Array
    moments: Mapping[str, tuple[float, float, float, float]]
    distributions: Mapping[str, Distribution]
    indices: Array
    times: Array
    autocovariance: Mapping[str, Array]
    first_passage: Mapping[float, Mapping[str, float]]
    costs: Mapping[str, Cost]
    notes: Sequence[str]
    error: SampleErrors
    errors: Mapping[str, Array]
    lost_variance: float = math.nan

    @property
    def message(self) -> str:
        """One line of text: mean and standard deviation of the output, lost variance if known, discretisation errors,
        and all notes.

        Both moments are of the first method in ``moments`` among ``corrected``, ``second_order``, ``projected`` and
        ``monte_carlo``."""
        name = next(name for name in _ORDER if name in self.moments)
        mean, deviation, *_ = self.moments[name]
        text = f"{self.output} at t = {self.t:.6g} s has mean {mean:.6g} and standard deviation {deviation:.6g}"
        if self.unit:
            text += f" {self.unit}"
        parts = [f"{text} {_ORDER[name]}", *self.truncation, str(self.error), *self.notes]
        return "; ".join(parts)

    @property
    def truncation(self) -> list[str]:
        """List of a phrase on the share of the output's variance that is lost with the modes left out of processes.

        Empty if no modes are left out, or if the share is unknown."""
        if math.isnan(self.lost_variance):
            return []
        return [f"{100.0 * self.lost_variance:.2g} % of its variance is lost with the modes left out"]

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data.

        Returns
        -------
        dict
            The attributes by name as JSON types, and ``message``; numbers may be nan. ``error`` is its summary, keys of
            ``first_passage`` are the levels as texts, and each of ``moments`` is a dict by name of the moment.
        """
        keys = ("mean", "standard_deviation", "skewness", "excess_kurtosis")
        return {name: _plain(value) for name, value in vars(self).items()} | {
            "moments": {name: dict(zip(keys, values, strict=True)) for name, values in self.moments.items()},
            "first_passage": {f"{level:.9g}": dict(result) for level, result in self.first_passage.items()},
            "error": self.error.summary(),
            "message": self.message,
        }

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write random.json (``to_dict``, null for nan), distribution.csv (thresholds, indices and probabilities) and,
        with ``times``, autocovariance.csv.

        Existing files are replaced. Raises FileError.

        Parameters
        ----------
        folder : path
            Made if absent.

        Returns
        -------
        list of Path
            The files, in this order.
        """
        target = make_folder(Path(folder))
        columns = {"threshold": self.thresholds, "index": self.indices}
        for name, distribution in self.distributions.items():
            columns |= {f"{name}.below": distribution.below, f"{name}.above": distribution.above}
            columns |= {
                f"{name}.{key}": getattr(distribution, key)
                for key in ("low", "high")
                if len(getattr(distribution, key))
            }
        files = [target / "random.json", target / "distribution.csv"]
        write_text(files[0], json_text(self.to_dict()) + "\n")
        write_table(files[1], list(columns), np.column_stack(list(columns.values())))
        if len(self.times):
            files.append(target / "autocovariance.csv")
            table = {"t": self.times, **self.autocovariance}
            write_table(files[2], list(table), np.column_stack(list(table.values())))
        return files

    def plot(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Draw the distribution, the autocovariance and the spectrum of modes, and return the files.

        Parameters
        ----------
        folder : path
            Made if absent.

        Returns
        -------
        list of Path
            The pictures.
        """
        target = make_folder(Path(folder))
        files = [save_figure(_distribution(self), target / "distribution.png")]
        if len(self.times):
            files.append(save_figure(_covariance(self), target / "autocovariance.png"))
        return [*files, save_figure(_modes(self), target / "modes.png")]


def _plain(value: Any) -> Any:
    """Return arrays, mappings, sequences and dataclasses as JSON data."""
    match value:
        case np.ndarray():
            return value.tolist()
        case Mapping():
            return {name: _plain(item) for name, item in value.items()}
        case list() | tuple():
            return [_plain(item) for item in value]
        case Distribution() | Cost() | Process():
            return _plain(vars(value))
    return value


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


def _normal_quantiles(distribution: Distribution) -> Any:
    """Return P(y <= threshold) as the place of a standard normal variable, by the smaller tail of both."""
    with np.errstate(invalid="ignore"):
        lower, upper = special.ndtri(distribution.below), -special.ndtri(distribution.above)
    return np.where(distribution.below < 0.5, lower, upper)


def _distribution(result: RandomVibration) -> Any:
    """Return a figure of P(y <= threshold) by each method on normal probability scale, with bounds of confidence."""
    axes = new_figure((7.6, 5.2)).subplots()
    order = np.argsort(result.thresholds)
    y = result.thresholds[order]
    for name, (label, colour, line, mark) in _STYLES.items():
        if name not in result.distributions:
            continue
        distribution = result.distributions[name]
        quantiles = _normal_quantiles(distribution)[order]
        finite = np.isfinite(quantiles)
        style = {"color": colour, "linestyle": line, "marker": mark, "markersize": 5, "linewidth": 1.5}
        axes.plot(y[finite], quantiles[finite], label=label, **style)
        if len(distribution.low):
            with np.errstate(invalid="ignore", divide="ignore"):
                low, high = special.ndtri(distribution.low)[order], special.ndtri(distribution.high)[order]
            known = np.isfinite(low) & np.isfinite(high)
            axes.vlines(y[known], low[known], high[known], color=colour, linewidth=1.2)
    named = np.array([1e-9, 1e-7, 1e-5, 1e-3, 0.01, 0.1, 0.5, 0.9, 0.99])
    marks = np.append(named, 1.0 - named[:4])
    places = np.append(special.ndtri(named), -special.ndtri(named[:4]))
    bottom, top = axes.get_ylim()
    shown = (places >= bottom) & (places <= top)
    axes.set_yticks(places[shown], [_percent(share) for share in marks[shown]])
    axes.set_ylim(bottom, top)
    axes.set(xlabel=axis_label(result.output, result.unit), ylabel="probability of not more, normal scale")
    return _frame(axes, f"{result.scene}: {result.output} at t = {result.t:.6g} s", "upper left")


def _percent(share: float) -> str:
    if share > 0.99:
        return f"1 - {1.0 - share:.0e}".replace("e-0", "e-")
    return f"{share:g}" if share >= 1e-3 else f"{share:.0e}".replace("e-0", "e-")


def _covariance(result: RandomVibration) -> Any:
    axes = new_figure((7.6, 3.6)).subplots()
    order = np.argsort(result.times)
    for name, values in result.autocovariance.items():
        label, colour, line, _ = _STYLES[name]
        axes.plot(result.times[order], values[order], color=colour, linestyle=line, linewidth=1.6, label=label)
    axes.axhline(0.0, color="#888888", linewidth=0.8)
    axes.set(xlabel="time, s", ylabel=axis_label("covariance", f"({result.unit})²" if result.unit else ""), xmargin=0.0)
    return _frame(axes, f"covariance of {result.output} with its value at t = {result.t:.6g} s")


def _title_of_modes(processes: Sequence[Process]) -> str:
    of_waves = [process.kind == "waves" for process in processes]
    if all(of_waves):
        return "Energies of the waves, of two variables each"
    modes = "Karhunen-Loève modes of the random processes"
    return f"{modes}, energies of the waves" if any(of_waves) else modes


def _modes(result: RandomVibration) -> Any:
    axes = new_figure((7.6, 3.6)).subplots()
    for process in result.processes:
        values = np.array(process.eigenvalues)
        label = f"{process.name}: {len(values)} modes, {100.0 * process.captured:.6g} % of the variance"
        axes.semilogy(np.arange(1, len(values) + 1), values / values[0], marker="o", markersize=4, label=label)
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set(xlabel="mode", ylabel="eigenvalue by the largest")
    return _frame(axes, _title_of_modes(result.processes))


def _frame(axes: Any, title: str, legend: str = "best") -> Any:
    """Return the figure of axes that get a title, a grid and a legend."""
    axes.set_title(title, fontsize="medium")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small", loc=legend)
    return axes.figure
