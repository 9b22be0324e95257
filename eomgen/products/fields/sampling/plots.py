"""Pictures of samples: slices of the field, power spectra, and the way of the chains."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.figures import new_figure, saved
from eomgen.base.files import make_folder
from eomgen.products.fields.sampling.result import ENOUGH, FieldSamples, Scale

BLUE, VERMILION, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#777777"
_CHAINS = (BLUE, VERMILION, GREEN, "#CC79A7", "#E69F00", "#56B4E9", "#000000")  # Okabe and Ito


def draw(found: FieldSamples, folder: str | Path) -> list[Path]:
    """Draw slices.png, power.png and chains.png into a folder, as far as samples allow, and return their paths.

    Raises
    ------
    FileError
    """
    files, folder = [], make_folder(Path(folder))
    if found.count > 1:
        files.append(saved(_slices(found), folder / "slices.png"))
        files.append(saved(_power(found), folder / "power.png"))
    if found.count or found.warm_up.size:
        files.append(saved(_chains(found), folder / "chains.png"))
    return files


def _slices(found: FieldSamples) -> Any:
    """Truth, mean and deviation of the field, and data that are whole fields, in one plane or along a line."""
    problem, samples = found.problem, found.samples
    mesh, name, unit = problem.mesh, problem.watched, problem.system.unit
    truth = problem.true_field()
    panels: list[tuple[str, Array, str]] = [] if truth is None else [(f"{name}: truth", truth, "field")]
    for title, values in problem.posterior.data.items():
        if float(values.min()) != float(values.max()):
            panels.append((f"data: {title}", values, "data"))
    panels += [(f"{name}: mean of samples", samples.mean, "field"), (f"{name}: deviation", samples.deviation, "spread")]
    lengths = mesh.lengths
    if len(mesh.cells) == 1:
        return _lines(found, panels)
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
    low, high = np.quantile(shown, (0.002, 0.998))
    for axes, (title, values, kind) in zip(every, panels, strict=False):
        limits = {"vmin": low, "vmax": high} if kind == "field" else {}
        if kind == "data":
            limits = {"vmin": float(values.min()), "vmax": float(np.quantile(values, 0.998)) or float(values.max())}
        elif kind == "spread":
            limits = {"vmin": 0.0}
        colours = {"field": "RdBu_r", "data": "viridis", "spread": "magma"}[kind]
        image = axes.imshow(
            values.T, origin="lower", extent=(0.0, lengths[0], 0.0, lengths[1]), cmap=colours,
            interpolation="nearest", aspect="equal", **limits,
        )  # fmt: skip
        figure.colorbar(image, ax=axes, shrink=0.85)
        axes.set_title(title, loc="left", fontsize="medium")
        axes.set_xlabel(_with_unit("x", unit))
        axes.set_ylabel(_with_unit("y", unit))
    for axes in every[len(panels) :]:
        axes.set_visible(False)
    figure.suptitle(f"{found.name}{where}, {_made(found)}")
    return figure


def _lines(found: FieldSamples, panels: list[tuple[str, Array, str]]) -> Any:
    problem, samples = found.problem, found.samples
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
    every[0].set_ylabel(problem.watched)
    every[0].legend(frameon=False, fontsize="small")
    for axes, (title, values) in zip(every[1:], data, strict=True):
        axes.plot(x, values, ".", color=GREY, markersize=3)
        axes.set_ylabel(title)
    for axes in every:
        axes.grid(alpha=0.3, linewidth=0.5)
    every[-1].set_xlabel(_with_unit("x", unit))
    figure.suptitle(f"{found.name}, {_made(found)}")
    return figure


def _power(found: FieldSamples) -> Any:
    """Power by wave number, correlation with the truth, and how well chains agree there."""
    scales, unit = found.scales(), found.problem.system.unit
    k = _column(scales, "k")
    figure = new_figure((11.5, 4.2))
    left, middle, right = figure.subplots(1, 3)
    mean, deviation = _column(scales, "mean"), _column(scales, "deviation")
    left.fill_between(
        k, np.maximum(mean - deviation, 1e-3 * mean), mean + deviation, color=BLUE, alpha=0.25, linewidth=0.0
    )
    left.plot(k, mean, "o-", color=BLUE, markersize=4, linewidth=1.0, label="samples, mean and deviation")
    for name, label, style, colour in (
        ("prior", "prior", "--", GREY),
        ("truth", "truth", "s", VERMILION),
        ("of_mean", "mean of samples", "^-", GREEN),
    ):
        values = _column(scales, name)
        if np.any(np.isfinite(values)):
            left.plot(k, values, style, color=colour, markersize=4, linewidth=1.0, label=label)
    left.set_yscale("log")
    left.set_ylabel("mean |amplitude|² of a mode")
    left.legend(frameon=False, fontsize="small")
    left.set_title("power", loc="left", fontsize="medium")
    correlation = _column(scales, "correlation")
    if np.any(np.isfinite(correlation)):
        middle.plot(k, correlation, "o-", color=BLUE, markersize=4, linewidth=1.0)
        middle.set_title("correlation of the mean with the truth", loc="left", fontsize="medium")
    else:
        middle.plot(k, _column(scales, "of_mean") / mean, "o-", color=BLUE, markersize=4, linewidth=1.0)
        middle.set_title("power of the mean over power of samples", loc="left", fontsize="medium")
    middle.set_ylim(-0.05, 1.05)
    if found.count >= ENOUGH:
        right.plot(k, _column(scales, "autocorrelation"), "o-", color=BLUE, markersize=4, linewidth=1.0)
        right.set_ylabel("autocorrelation time (trajectories)", color=BLUE)
        right.set_ylim(bottom=0.0)
        beside = right.twinx()
        beside.plot(k, _column(scales, "r_hat"), "s--", color=VERMILION, markersize=4, linewidth=1.0)
        beside.set_ylabel("split R-hat", color=VERMILION)
        beside.ticklabel_format(useOffset=False)
    right.set_title("chains", loc="left", fontsize="medium")
    for axes in (left, middle, right):
        axes.set_xlabel(f"k (radians per {unit or 'length'})")
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.suptitle(f"{found.name}: {found.problem.watched}, {_made(found)}")
    return figure


def _chains(found: FieldSamples) -> Any:
    """U over gradients of each chain, energy errors, and R-hat of cells."""
    samples, count = found.samples, found.count
    figure = new_figure((11.5, 4.2))
    left, middle, right = figure.subplots(1, 3, width_ratios=(1.6, 1.0, 1.0))
    for chain, burn_in in enumerate(found.warm_up):
        gradients = np.concatenate([burn_in[:, 2], samples.gradients[chain]])
        potential = np.concatenate([burn_in[:, 3], samples.potential[chain]])
        colour = _CHAINS[chain % len(_CHAINS)]
        along = np.cumsum(gradients)
        # so that the chains below others are seen
        left.plot(along, potential, color=colour, linewidth=0.7, alpha=0.55, label=f"chain {chain}")
        if len(burn_in) and count:
            left.axvline(along[len(burn_in) - 1], color=colour, linestyle=":", linewidth=0.8)
    left.set_xscale("log")
    left.set_xlabel("gradients of a chain (dotted: end of its warm-up)")
    left.set_ylabel("U")
    left.legend(frameon=False, fontsize="small", loc="best")
    left.set_title("burn-in", loc="left", fontsize="medium")
    errors = samples.energy_errors[np.isfinite(samples.energy_errors)]
    if errors.size > 1:
        middle.hist(errors, bins=40, density=True, color=BLUE, alpha=0.6)
        mean = max(float(errors.mean()), 1e-12)
        x = np.linspace(float(errors.min()), float(errors.max()), 200)
        middle.plot(x, np.exp(-((x - mean) ** 2) / (4.0 * mean)) / np.sqrt(4.0 * np.pi * mean), color=VERMILION,
                    linewidth=1.0, label="normal of the same mean,\nvariance 2 mean")  # fmt: skip
        middle.set_xlabel("error of the energy of a trajectory")
        middle.legend(frameon=False, fontsize="x-small", loc="upper right")
    middle.set_yticks([])
    middle.set_visible(bool(count))
    middle.set_title(f"acceptance {samples.acceptance:.3f}" if count else "", loc="left", fontsize="medium")
    r_hats = found.r_hats()
    r_hats = r_hats[np.isfinite(r_hats)]
    if r_hats.size:
        right.hist(r_hats, bins=40, color=BLUE, alpha=0.6)
        right.set_xlabel("split R-hat")
        right.set_ylabel("cells")
        right.set_title(f"R-hat of {r_hats.size} cells, largest {r_hats.max():.3f}", loc="left", fontsize="medium")
    else:
        right.set_visible(False)
    for axes in (left, middle, right):
        axes.grid(alpha=0.3, linewidth=0.5)
    figure.suptitle(f"{found.name}, {_made(found)}")
    return figure


def _column(scales: list[Scale], name: str) -> Array:
    return np.array([getattr(scale, name) for scale in scales])


def _made(found: FieldSamples) -> str:
    chains = len(found.samples.accepted)
    return f"{found.settings.method}, {chains} x {found.count} samples"


def _with_unit(name: str, unit: str) -> str:
    return f"{name} ({unit})" if unit else name
