"""Results of sampling: samples with their diagnostics and files, and pictures of fields, power spectra and chains."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.csv_tables import write_table
from eomgen.base.data import dataclass, field_names
from eomgen.base.figures import axis_label, new_figure, save_figure
from eomgen.base.files import make_folder, write_arrays, write_text
from eomgen.base.json_text import json_text
from eomgen.base.messages import counted
from eomgen.products.fields.documents.tables import Chains
from eomgen.products.fields.posteriors import Samples, autocorrelation_time, split_r_hat
from eomgen.products.fields.posteriors.record import largest
from eomgen.products.fields.sampling.problem import TRAJECTORY, FieldProblem

#: Samples of a chain from which on chains are held against one another.
ENOUGH = 4


@dataclass(frozen=True)
class Scale:
    """A bin of wave numbers.

    Attributes
    ----------
    k : mean wave number, radians per length
    prior, truth : mean |amplitude|^2 by the prior and of the truth; NaN if there is no truth
    mean, deviation : of samples
    of_mean : of the mean of samples
    correlation : of the mean of samples with the truth
    r_hat, autocorrelation : split R-hat, and integrated autocorrelation time in trajectories; NaN of few samples
    """

    k: float
    prior: float
    truth: float
    mean: float
    deviation: float
    of_mean: float
    correlation: float
    r_hat: float
    autocorrelation: float


@dataclass(frozen=True)
class FieldSamples:
    """Samples of a field with reference values.

    Attributes
    ----------
    problem : FieldProblem
    settings : Chains
        Settings of the chains.
    mass : which mass
    samples : Samples
        Samples that all chains have.
    warm_up : (chains, trajectories, 4)
        dH, whether the end was accepted, gradients and U of each trajectory before the samples.
    largest_step, frequency : the step that the guard allows, and the largest angular frequency
    seconds, gradients : of all chains, with the warm-up
    interrupted : whether there should be more
    """

    problem: FieldProblem
    settings: Chains
    mass: str
    samples: Samples
    warm_up: Array
    largest_step: float
    frequency: float
    seconds: float
    gradients: int
    interrupted: bool

    @property
    def name(self) -> str:
        return self.problem.system.name

    @property
    def count(self) -> int:
        """Samples of each chain."""
        return int(self.samples.accepted.shape[1])

    @property
    def message(self) -> str:
        """The end of the run in words: samples and warm-up, then, if any, steps made smaller by the guard (``cut``),
        trajectories rejected for an energy that is not finite (``lost``), chains that did not move (``rest``), chains
        that do not agree (``doubt``), and notes on the file; for an interrupted run in place of these the missing
        part."""
        chains, made = len(self.samples.accepted), f"{counted(self.count, 'sample')}"
        before = counted(self.warm_up.shape[1], "trajectory", "trajectories")
        whole = f"{made} of each of {counted(chains, 'chain')} after {before}"
        if not self.interrupted:
            notes = "".join(f"; {note}" for note in self.problem.notes)
            return f"{whole} of warm-up{self.cut}{self.lost}{self.rest}{self.doubt}{notes}"
        missing = f"of {self.settings.samples}" if self.warm_up.shape[1] >= self.settings.warm_up else "in the warm-up"
        return f"interrupted: {whole} of warm-up, {missing}; with a folder, --resume goes on to the same bits"

    @property
    def cut(self) -> str:
        """A sentence if the guard has made a step smaller than requested, for the end of the message; else empty."""
        step, taken = self.settings.step, float(np.min(self.samples.steps))
        if step <= taken:
            return ""
        return f"; steps are {taken:.4g}, not {step:.4g}: the guard allows no larger ones at the chains' states"

    @property
    def lost(self) -> str:
        """A sentence on trajectories, of the warm-up and of samples, whose ends were rejected because the energy H
        there is not finite; empty if there are none. Begins with a semicolon and a blank."""
        errors = np.concatenate([self.warm_up[..., 0].ravel(), self.samples.energy_errors.ravel()])
        count = int(np.sum(~np.isfinite(errors)))
        if not count:
            return ""
        of = counted(errors.size, "trajectory", "trajectories")
        hint = "smaller steps, or an energy that is finite everywhere and grows on both sides"
        return f"; {count} of {of} ended at states whose energy is not finite, and were rejected; try: {hint}"

    @property
    def rest(self) -> str:
        """A sentence on chains whose watched cells change by rounding alone, which R-hat does not show; else empty, and
        also for fewer than two samples. Begins with a semicolon and a blank."""
        cells = self.samples.cells
        if self.count < 2 or not cells.size:
            return ""
        spans = np.ptp(cells, axis=1).max(axis=-1)
        still = int(np.sum(spans <= 4.0 * np.finfo(cells.dtype).eps * np.abs(cells).max(axis=(1, 2))))
        if not still:
            return ""
        hint = "a longer duration, or larger steps (--duration, --step)"
        chains = counted(len(cells), "chain")
        return f"; {still} of {chains} did not move: watched cells change by rounding alone; try: {hint}"

    @property
    def doubt(self) -> str:
        """A sentence on chains that do not agree, with a split R-hat above 1.3 in a watched cell or a bin; empty for
        chains that agree, or have fewer than 50 samples each, which are too few for a test. Begins with a
        semicolon and a blank."""
        if self.count < 50:
            return ""
        worst = {"a cell": largest(self.r_hats()), "a bin of scales": self.r_hat_of_scales}
        result = [f"{value:.3g} in {where}" for where, value in worst.items() if value > 1.3]
        if not result:
            return ""
        hint = "more samples, a longer duration, or another mass"
        return f"; chains do not agree yet: split R-hat is {' and '.join(result)}; try: {hint}"

    @property
    def calibration(self) -> tuple[float, float] | None:
        """Mean and deviation over cells of (truth - mean)/deviation: 0 and 1 if deviations are right. Cells without
        deviation are left out, NaN if all are. None without a truth, or for fewer than two samples of a chain."""
        truth = self.problem.true_field()
        if truth is None or self.count < 2:
            return None
        seen = self.samples.deviation > 0.0
        z = (truth - self.samples.mean)[seen] / self.samples.deviation[seen]
        return float(z.mean()), float(z.std())

    def r_hats(self) -> Array:
        """Return split R-hat of each watched cell.

        Returns
        -------
        ndarray
            One for each cell; empty for few samples.
        """
        return split_r_hat(self.samples.cells) if self.count >= ENOUGH else np.empty(0)

    @property
    def r_hat_of_scales(self) -> float:
        """The largest split R-hat of the bins that have wave numbers; NaN of few samples."""
        return largest(split_r_hat(self.samples.power)) if self.count >= ENOUGH else math.nan

    def scales(self) -> list[Scale]:
        """Return the bins that have wave numbers; empty without samples.

        Bins are of equal width, from |k| = 0 (left out) to the least Nyquist wave number. Values that need a truth, 4
        samples of each chain (the autocorrelation time 7 or more), or, for the prior, a field without a mask, are NaN
        otherwise.

        Returns
        -------
        list of Scale
            In the order of wave numbers; empty if a chain has no samples.
        """
        samples, problem = self.samples, self.problem
        if not self.count:
            return []
        bins, mesh = samples.power.shape[2], problem.mesh
        operator, truth = problem.operators[problem.watched], problem.true_field()
        nothing = np.full(bins, np.nan)
        enough = self.count >= ENOUGH
        r_hat = split_r_hat(samples.power) if enough else nothing
        times = autocorrelation_time(samples.power) if enough else nothing
        mean = mesh.spectrum(samples.mean)
        of_mean, of_truth, together = mesh.power(mean, bins)[1], nothing, nothing
        if truth is not None:
            seen = mesh.spectrum(truth)
            of_truth = mesh.power(seen, bins)[1]
            together = (mesh.power(seen + mean, bins)[1] - mesh.power(seen - mean, bins)[1]) / 4.0
        symbol = np.ones(mesh.half) if operator.symbol is None else operator.symbol
        # the prior of a field with a mask has no power spectrum
        prior = nothing if operator.mask is not None else mesh.power(np.asarray(symbol, complex), bins)[1]
        with np.errstate(divide="ignore", invalid="ignore"):
            correlation = together / np.sqrt(of_truth * of_mean)
        power = samples.power.reshape(-1, bins)
        columns = (
            samples.wave_numbers, prior, of_truth, power.mean(axis=0), power.std(axis=0), of_mean, correlation, r_hat,
            times,
        )  # fmt: skip  # as Scale has them
        rows = (Scale(*map(float, row)) for row in zip(*columns, strict=True))
        return [scale for scale in rows if not math.isnan(scale.k)]  # boxes with unequal sides leave bins empty

    def summary(self) -> dict[str, Any]:
        """Return the settings and the figures of the run; figures of convergence only from 4 samples of each chain on.

        Returns
        -------
        dict
            Numbers, texts, lists and dicts; the float NaN or infinity for a number without a value: ``name``,
            ``success`` (false if interrupted), ``message``, ``cells``, ``lengths``, ``field``, ``memory`` (bytes),
            ``settings`` (dict), ``chains``, ``samples`` (of each chain), ``steps`` (list over chains),
            ``largest_step``, ``largest_frequency``, ``seconds`` and ``gradients`` (of all chains, with the warm-up). If
            each chain has a sample, ``acceptance``, figures of energy errors and ``gradients_per_trajectory``, of
            samples alone; with ``calibration``, ``truth_over_deviation``.
        """
        samples, problem, settings = self.samples, self.problem, self.settings
        result: dict[str, Any] = {
            "name": self.name,
            "success": not self.interrupted,
            "message": self.message,
            "cells": list(problem.mesh.cells),
            "lengths": list(problem.mesh.lengths),
            "field": problem.watched,
            "memory": problem.memory,
            "settings": {**vars(settings), "mass": self.mass},
            "chains": len(samples.accepted),
            "samples": self.count,
            "steps": samples.steps.tolist(),
            "largest_step": self.largest_step,
            "largest_frequency": self.frequency,
            "seconds": self.seconds,
            "gradients": self.gradients,
        }
        if self.count:
            errors = samples.energy_errors
            names = ("acceptance", "expected_acceptance", "mean_energy_error")
            result |= {name: getattr(samples, name) for name in names}
            result |= {
                "half_variance_of_energy_errors": float(errors.var()) / 2.0 if np.isfinite(errors).all() else math.nan,
                "mean_weight": samples.mean_weight[0] if errors.size > 1 else math.nan,
                "mean_weight_error": samples.mean_weight[1] if errors.size > 1 else math.nan,
                "gradients_per_trajectory": float(np.mean(samples.gradients)),
            }
        if self.count >= ENOUGH:
            cells, worst = samples.autocorrelation
            each = samples.gradients_per_sample
            r_hats = self.r_hats()
            result |= {
                "r_hat_of_cells": largest(r_hats),
                "r_hat_of_cells_at_99_percent": largest(r_hats, 0.99),
                "r_hat_of_scales": self.r_hat_of_scales,
                "autocorrelation_of_cells": cells,
                "autocorrelation_of_worst_scale": worst,
                "autocorrelation_error": samples.autocorrelation_error,
                "gradients_per_independent_sample_of_cells": each[0],
                "gradients_per_independent_sample_of_worst_scale": each[1],
            }
        if self.calibration is not None:
            result["truth_over_deviation"] = {"mean": self.calibration[0], "deviation": self.calibration[1]}
        return result

    def to_dict(self) -> dict[str, Any]:
        """Return the figures of ``summary`` and the scales.

        Returns
        -------
        dict
            JSON data.
        """
        return {**self.summary(), "scales": [vars(scale) for scale in self.scales()]}

    def trajectories(self) -> Array:
        """Return a table with a row for each trajectory that all chains have, of warm-up and samples, one chain after
        another.

        Returns
        -------
        (trajectories, 7) ndarray
            Chain and number from the start, both from 0, whether it is a sample, dH (infinite if not finite), whether
            the end was accepted, gradients, U of the chain after the trajectory.
        """
        names = ("energy_errors", "accepted", "gradients", "potential")
        drawn = np.stack([getattr(self.samples, name).astype(float) for name in names], axis=2)
        both = np.concatenate([self.warm_up, drawn], axis=1)
        chain, number = np.indices(both.shape[:2], dtype=float)
        table = np.concatenate([np.stack([chain, number, number >= self.warm_up.shape[1]], axis=2), both], axis=2)
        return table.reshape(-1, table.shape[2])

    def save(self, folder: str | Path) -> list[Path]:
        """Write samples.npz, trajectories.csv, scales.csv and summary.json into a folder, and return the paths.

        Existing files are replaced. samples.npz has the arrays of ``samples``, ``warm_up`` and, if there is one,
        ``truth``; summary.json has ``to_dict``, with null for numbers that are not finite.

        Parameters
        ----------
        folder : str or Path
            Folder to write to, which is made if missing.

        Returns
        -------
        list of Path
            The written files, in this order.

        Raises
        ------
        FileError
            The folder or a file cannot be written.
        """
        target = make_folder(Path(folder))
        truth = self.problem.true_field()
        arrays = {name: np.asarray(array, float) for name, array in vars(self.samples).items()}
        arrays |= {"warm_up": self.warm_up} | ({} if truth is None else {"truth": truth})
        summary, scales = self.to_dict(), self.scales()
        files = [target / name for name in ("samples.npz", "trajectories.csv", "scales.csv", "summary.json")]
        write_arrays(files[0], arrays, {"name": self.name, "field": self.problem.watched})
        write_table(files[1], ["chain", "trajectory", "sample", *TRAJECTORY], self.trajectories())
        columns = list(field_names(Scale))
        table = np.array([list(vars(scale).values()) for scale in scales]).reshape(-1, len(columns))
        write_table(files[2], columns, table)
        write_text(files[3], json_text(summary) + "\n")
        return files


BLUE, VERMILION, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#777777"
#: Curves with marks.
_MARKED = {"markersize": 4, "linewidth": 1.0}
_CHAINS = (BLUE, VERMILION, GREEN, "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito


def draw(result: FieldSamples, folder: str | Path) -> list[Path]:
    """Draw slices.png, power.png and chains.png into a folder, as far as samples allow.

    slices.png and power.png need two samples of each chain, chains.png a sample or a trajectory of the warm-up of each.
    Existing files are replaced, and files that are not drawn stay.

    Parameters
    ----------
    result : FieldSamples
        Samples of ``sample``.
    folder : str or Path
        Folder to write to, which is made if missing.

    Returns
    -------
    list of Path
        The written files, in this order; may be empty.

    Raises
    ------
    FileError
        The folder or a file cannot be written.
    UsageError
        The variable ``MPLBACKEND`` names no backend of matplotlib.
    """
    files, folder = [], make_folder(Path(folder))
    if result.count > 1:
        files.append(save_figure(_slices(result), folder / "slices.png"))
        files.append(save_figure(_power(result), folder / "power.png"))
    if result.count or result.warm_up.size:
        files.append(save_figure(_chains(result), folder / "chains.png"))
    return files


def _slices(result: FieldSamples) -> Any:
    """Return a figure of the watched field: truth, mean and deviation of samples, and data that are fields. A mesh of
    three dimensions is shown in the middle plane, a mesh of one dimension along a line. Data that are equal in all
    cells are left out."""
    problem, samples = result.problem, result.samples
    mesh, name, unit = problem.mesh, problem.watched, problem.system.unit
    truth = problem.true_field()
    panels: list[tuple[str, Array, str]] = [] if truth is None else [(f"{name}: truth", truth, "field")]
    for title, values in problem.posterior.data.items():
        if float(values.min()) != float(values.max()):
            panels.append((f"data: {title}", values, "data"))
    panels += [(f"{name}: mean of samples", samples.mean, "field"), (f"{name}: deviation", samples.deviation, "spread")]
    lengths = mesh.lengths
    if len(mesh.cells) == 1:
        return _lines(result, panels)
    where = ""
    if len(mesh.cells) == 3:
        middle = mesh.cells[2] // 2
        panels = [(title, values[:, :, middle], kind) for title, values, kind in panels]
        where = f" at z = {(middle + 0.5) * lengths[2] / mesh.cells[2]:.4g}{' ' + unit if unit else ''}"
    columns = min(len(panels), 3 if len(panels) != 4 else 2)
    rows = -(-len(panels) // columns)
    figure = new_figure((4.6 * columns, 4.1 * rows * max(0.5, min(2.0, lengths[1] / lengths[0]))))
    every = figure.subplots(rows, columns, squeeze=False).ravel()
    shown = np.concatenate([values.ravel() for _, values, kind in panels if kind == "field"])
    of_fields = np.quantile(shown, (0.002, 0.998))
    for axes, (title, values, kind) in zip(every, panels, strict=False):
        high = float(np.quantile(values, 0.998)) or float(values.max())
        colours, low, high = {
            "field": ("RdBu_r", *of_fields),
            "data": ("viridis", float(values.min()), high),
            "spread": ("magma", 0.0, None),
        }[kind]
        image = axes.imshow(
            values.T, origin="lower", extent=(0.0, lengths[0], 0.0, lengths[1]), cmap=colours, vmin=low, vmax=high
        )
        figure.colorbar(image, ax=axes, shrink=0.85)
        axes.set(xlabel=axis_label("x", unit), ylabel=axis_label("y", unit))
        axes.set_title(title, loc="left", fontsize="medium")
    for axes in every[len(panels) :]:
        axes.set_visible(False)
    figure.suptitle(f"{result.name}{where}, {_title(result)}")
    return figure


def _lines(result: FieldSamples, panels: list[tuple[str, Array, str]]) -> Any:
    """Return a figure, for a mesh of one dimension, of mean and deviation of samples, the truth, and the data among
    ``panels``."""
    problem, samples = result.problem, result.samples
    mesh, unit = problem.mesh, problem.system.unit
    data = [(title, values) for title, values, kind in panels if kind == "data"]
    figure = new_figure((9.0, 3.4 + 2.0 * len(data)))
    every = np.atleast_1d(figure.subplots(1 + len(data), 1, sharex=True))
    x = (np.arange(mesh.cells[0]) + 0.5) * mesh.lengths[0] / mesh.cells[0]
    low, high = samples.mean - samples.deviation, samples.mean + samples.deviation
    every[0].fill_between(x, low, high, color=BLUE, alpha=0.25, linewidth=0.0, label="mean and deviation of samples")
    every[0].plot(x, samples.mean, color=BLUE, linewidth=1.0)
    truth = problem.true_field()
    if truth is not None:
        every[0].plot(x, truth, color=VERMILION, linewidth=0.8, label="truth")
    _frame(every[0], legend=True, ylabel=problem.watched)
    for axes, (title, values) in zip(every[1:], data, strict=True):
        axes.plot(x, values, ".", color=GREY, markersize=3)
        _frame(axes, ylabel=title)
    every[-1].set_xlabel(axis_label("x", unit))
    figure.suptitle(f"{result.name}, {_title(result)}")
    return figure


def _power(result: FieldSamples) -> Any:
    """Return a figure over wave numbers: power of samples, prior and truth; correlation with the truth; agreement of
    chains."""
    scales, unit = result.scales(), result.problem.system.unit
    k = _column(scales, "k")
    figure = new_figure((11.5, 4.2))
    left, middle, right = figure.subplots(1, 3)
    mean, deviation = _column(scales, "mean"), _column(scales, "deviation")
    least = np.maximum(mean - deviation, 1e-3 * mean)
    left.fill_between(k, least, mean + deviation, color=BLUE, alpha=0.25, linewidth=0.0)
    left.plot(k, mean, "o-", color=BLUE, label="samples, mean and deviation", **_MARKED)
    for name, label, style, colour in (
        ("prior", "prior", "--", GREY),
        ("truth", "truth", "s", VERMILION),
        ("of_mean", "mean of samples", "^-", GREEN),
    ):
        values = _column(scales, name)
        if np.any(np.isfinite(values)):
            left.plot(k, values, style, color=colour, label=label, **_MARKED)
    x = f"k, radians per {unit or 'length'}"
    _frame(left, "power", legend=True, xlabel=x, ylabel="mean |amplitude|² of a mode", yscale="log")
    values, title = _column(scales, "correlation"), "correlation of the mean with the truth"
    if not np.any(np.isfinite(values)):
        values, title = _column(scales, "of_mean") / mean, "power of the mean over power of samples"
    middle.plot(k, values, "o-", color=BLUE, **_MARKED)
    _frame(middle, title, xlabel=x, ylim=(-0.05, 1.05))
    if result.count >= ENOUGH:
        right.plot(k, _column(scales, "autocorrelation"), "o-", color=BLUE, **_MARKED)
        right.set_ylabel("autocorrelation time (trajectories)", color=BLUE)
        right.set_ylim(bottom=0.0)
        beside = right.twinx()
        beside.plot(k, _column(scales, "r_hat"), "s--", color=VERMILION, **_MARKED)
        beside.set_ylabel("split R-hat", color=VERMILION)
        beside.ticklabel_format(useOffset=False)
    _frame(right, "chains", xlabel=x)
    figure.suptitle(f"{result.name}: {result.problem.watched}, {_title(result)}")
    return figure


def _chains(result: FieldSamples) -> Any:
    """Return a figure with three panels: U over gradients for each chain, energy errors, and R-hat of cells."""
    samples, count = result.samples, result.count
    figure = new_figure((11.5, 4.2))
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.6, 1.0, 1.0))
    burn_in = result.warm_up.shape[1]
    rows = result.trajectories().reshape(len(result.warm_up), -1, 3 + len(TRAJECTORY))
    for chain, (*_, gradients, potential) in enumerate(rows.transpose(0, 2, 1)):
        colour, along = _CHAINS[chain % len(_CHAINS)], np.cumsum(gradients)
        # so that lower chains remain visible
        left.plot(along, potential, color=colour, linewidth=0.7, alpha=0.55, label=f"chain {chain}")
        if burn_in and count:
            left.axvline(along[burn_in - 1], color=colour, linestyle=":", linewidth=0.8)
    x = "gradients of a chain (dotted: end of its warm-up)"
    _frame(left, "burn-in", legend=True, xlabel=x, ylabel="U", xscale="log")
    errors = samples.energy_errors[np.isfinite(samples.energy_errors)]
    if errors.size > 1:
        middle.hist(errors, bins=40, density=True, color=BLUE, alpha=0.6)
        mean = max(float(errors.mean()), 1e-12)
        error = np.linspace(float(errors.min()), float(errors.max()), 200)
        middle.plot(error, np.exp(-((error - mean) ** 2) / (4.0 * mean)) / np.sqrt(4.0 * np.pi * mean), color=VERMILION,
                    linewidth=1.0, label="normal of the same mean,\nvariance 2 mean")  # fmt: skip
        middle.set_xlabel("error of the energy of a trajectory")
        middle.legend(frameon=False, fontsize="x-small", loc="upper right")
    title = f"acceptance {samples.acceptance:.3f}" if count else ""
    _frame(middle, title, yticks=[], visible=bool(count))
    r_hats = result.r_hats()
    r_hats = r_hats[np.isfinite(r_hats)]
    right.set_visible(bool(r_hats.size))
    if r_hats.size:
        right.hist(r_hats, bins=40, color=BLUE, alpha=0.6)
        title = f"R-hat of {r_hats.size} cells, largest {r_hats.max():.3f}"
        _frame(right, title, xlabel="split R-hat", ylabel="cells")
    figure.suptitle(f"{result.name}, {_title(result)}")
    return figure


def _frame(axes: Any, title: str = "", *, legend: bool = False, **settings: Any) -> None:
    """Give a panel its grid, title and legend, and further settings of its axes."""
    axes.set(**settings)
    axes.grid(alpha=0.3, linewidth=0.5)
    if title:
        axes.set_title(title, loc="left", fontsize="medium")
    if legend:
        axes.legend(frameon=False, fontsize="small")


def _column(scales: list[Scale], name: str) -> Array:
    return np.array([getattr(scale, name) for scale in scales])


def _title(result: FieldSamples) -> str:
    chains = len(result.samples.accepted)
    return f"{result.settings.method}, {chains} x {result.count} samples"
