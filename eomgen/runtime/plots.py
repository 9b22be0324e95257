"""Plots of a solution: coordinates, velocities, outputs and energies over time, as PNG."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from eomgen.errors import FileError, Problem

if TYPE_CHECKING:
    from eomgen.runtime.solution import Solution

Array = NDArray[np.float64]

#: Curves in one panel, panels in one figure, points of one curve: more of them cannot be told apart.
_CURVES, _PANELS, _POINTS = 6, 24, 4000
#: Smaller changes are shown as none: they are rounding errors.
_FLAT = 1e-12
_QUANTITIES = {
    "rad": "angle", "m": "position", "1": "quaternion", "rad/s": "angular velocity", "m/s": "velocity",
    "J": "energy", "W": "power",
}  # fmt: skip
#: Colours that stay apart for colour-blind eyes (Okabe and Ito, without yellow).
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#000000")


@dataclass(frozen=True)
class Curve:
    """One component over time."""

    name: str
    unit: str
    values: Array


def draw(solution: Solution, folder: Path) -> list[Path]:
    """Draw ``coordinates.png``, ``velocities.png``, and ``states.png``, ``outputs.png`` and ``energy.png`` where there are any.

    Raises
    ------
    FileError
        A figure cannot be written.
    """
    names, units = solution.metadata.get("names", {}), solution.metadata.get("units", {})
    figures = {
        "coordinates": _curves(solution.q, names.get("q", []), units.get("q", [])),
        "velocities": _curves(solution.v, names.get("v", []), units.get("v", [])),
        "states": _curves(solution.z, names.get("z", []), units.get("z", [])),
        "outputs": _outputs(solution, units.get("outputs", {})),
        "energy": [
            Curve(name, "W" if "power" in name else "J", values)
            for name, values in solution.energy.items()
            if "power" not in name or np.any(values)
        ],
    }
    title = str(solution.metadata.get("scene", ""))
    return [_figure(solution.t, curves, f"{title}: {name}", folder / f"{name}.png") for name, curves in figures.items() if curves]


def _curves(table: Array, names: Sequence[str], units: Sequence[str]) -> list[Curve]:
    return [Curve(name, unit, table[:, index]) for index, (name, unit) in enumerate(zip(names, units, strict=True))]


def _outputs(solution: Solution, units: dict[str, str]) -> list[Curve]:
    curves = []
    for name, array in solution.outputs.items():
        table = array[:, np.newaxis] if array.ndim == 1 else array
        several = table.shape[1] > 1
        curves += [
            Curve(f"{name}[{index}]" if several else name, units.get(name, ""), table[:, index])
            for index in range(table.shape[1])
        ]
    return curves


def _panels(curves: Sequence[Curve]) -> list[list[Curve]]:
    """Group curves of one unit, in order, as evenly as a panel's limit allows."""
    by_unit: dict[str, list[Curve]] = {}
    for curve in curves:
        by_unit.setdefault(curve.unit, []).append(curve)
    panels = []
    for group in by_unit.values():
        count = -(-len(group) // _CURVES)
        size = -(-len(group) // count)
        panels += [group[start : start + size] for start in range(0, len(group), size)]
    return panels


def _figure(t: Array, curves: Sequence[Curve], title: str, path: Path) -> Path:
    from matplotlib.backends.backend_agg import FigureCanvasAgg  # noqa: PLC0415  # slow to import, and only drawing needs it
    from matplotlib.figure import Figure  # noqa: PLC0415

    panels = _panels(curves)
    shown = panels[:_PANELS]
    columns = 1 if len(shown) <= 3 else 2
    rows = -(-len(shown) // columns)
    figure = Figure(figsize=(9.0 if columns == 1 else 15.0, 0.6 + 2.9 * rows), layout="constrained", dpi=110)
    FigureCanvasAgg(figure)
    axes = np.atleast_1d(figure.subplots(rows, columns, sharex=True, squeeze=False)).ravel()
    for axis, panel in zip(axes, shown, strict=False):
        _panel(axis, t, panel)
    for axis in axes[len(shown) :]:
        axis.set_visible(False)
    for axis in axes[max(0, len(shown) - columns) : len(shown)]:
        axis.set_xlabel("time / s")
        axis.tick_params(labelbottom=True)
    figure.align_ylabels(list(axes[: len(shown)]))
    hidden = sum(len(panel) for panel in panels[_PANELS:])
    figure.suptitle(title + (f" (the first {len(curves) - hidden} of {len(curves)})" if hidden else ""), fontsize=11)
    try:
        figure.savefig(path)
    except OSError as error:
        raise FileError(
            Problem(str(path), f"cannot be written ({error.strerror or error})", "another folder, or --no-plots")
        ) from None
    return path


def _panel(axis: Any, t: Array, panel: Sequence[Curve]) -> None:
    for curve, colour in zip(panel, _COLOURS, strict=False):
        axis.plot(*_thinned(t, curve.values), label=curve.name, color=colour, linewidth=1.2)
    unit = panel[0].unit
    quantity = _QUANTITIES.get(unit, "")
    axis.set_ylabel(quantity if unit == "1" else f"{quantity} / {unit}" if quantity else f"/ {unit}" if unit else "")
    axis.grid(True, color="#dddddd", linewidth=0.6)
    axis.margins(x=0.0)
    low, high = axis.get_ylim()
    if high - low < _FLAT:
        axis.set_ylim(0.5 * (low + high) - _FLAT, 0.5 * (low + high) + _FLAT)
    axis.ticklabel_format(axis="y", style="sci", scilimits=(-4, 5), useOffset=False)
    axis.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=9)


def _thinned(t: Array, values: Array) -> tuple[Array, Array]:
    """Return the smallest and the largest value of every bin where there are more points than can be seen."""
    if len(t) <= 2 * _POINTS:
        return t, values
    size = -(-len(t) // _POINTS)
    whole = len(t) // size * size
    bins = values[:whole].reshape(-1, size)
    ends = np.stack([bins.argmin(axis=1), bins.argmax(axis=1)], axis=1)
    chosen = (np.sort(ends, axis=1) + np.arange(len(bins))[:, np.newaxis] * size).ravel()
    chosen = np.unique(np.concatenate([[0], chosen, [len(t) - 1]]))
    return t[chosen], values[chosen]
