"""Plots of an ensemble: fan charts over time, results against varied quantities, and rankings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.figures import new_figure, saved
from eomgen.errors import UsageError
from eomgen.products.ensembles.reductions import Reduction
from eomgen.products.ensembles.samples import EXTREMES, Failed
from eomgen.products.ensembles.sensitivity import Ranking
from eomgen.results.error_estimate import NOTICED

#: Panels of a figure, and points of a scatter plot, at most.
_PANELS, _POINTS = 12, 5000
_COLOUR = "#0B62C4"
#: Bands by their lower and upper probabilities, with their opacity.
_BANDS = ((0.05, 0.95, 0.18), (0.25, 0.75, 0.32))


class Drawn(Protocol):
    """Fields of an ``Ensemble`` in plots."""

    @property
    def scene(self) -> str: ...
    @property
    def design(self) -> str: ...
    @property
    def varied(self) -> tuple[str, ...]: ...
    @property
    def columns(self) -> tuple[str, ...]: ...
    @property
    def units(self) -> Mapping[str, str]: ...
    @property
    def t(self) -> Array: ...
    @property
    def done(self) -> int: ...
    @property
    def reduction(self) -> Reduction: ...

    @property
    def failed(self) -> Sequence[Failed]: ...
    @property
    def values(self) -> Mapping[str, Array]: ...
    @property
    def results(self) -> Mapping[str, Array]: ...
    def mean(self, column: str) -> Array: ...
    def envelope(self, column: str) -> tuple[Array, Array]: ...
    def quantile(self, column: str, probability: ArrayLike) -> Array: ...
    def sensitivity(self, result: str) -> Ranking: ...


def draw(ensemble: Drawn, folder: Path) -> list[Path]:
    """Draw all plots of an ensemble and return their files."""
    if not ensemble.done or ensemble.done == len(ensemble.failed):
        return []
    files = [saved(_fans(ensemble), folder / "fan.png")]
    if ensemble.varied:
        files.append(saved(_scatter(ensemble), folder / "scatter.png"))
        if (figure := _rankings(ensemble)) is not None:
            files.append(saved(figure, folder / "sensitivity.png"))
    return files


def _fans(ensemble: Drawn) -> Any:
    columns = ensemble.columns[:_PANELS]
    figure = new_figure((8.0, 0.6 + 2.6 * len(columns)))
    panels = figure.subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0]
    for axes, column in zip(panels, columns, strict=True):
        low, high = ensemble.envelope(column)
        axes.fill_between(ensemble.t, low, high, color="#888888", alpha=0.18, linewidth=0, label="smallest to largest")
        if ensemble.reduction.has_quantiles:
            for first, last, opacity in _BANDS:
                bounds = ensemble.quantile(column, (first, last))
                label = f"{100 * first:g} to {100 * last:g} %"
                axes.fill_between(ensemble.t, *bounds, color=_COLOUR, alpha=opacity, linewidth=0, label=label)
            axes.plot(ensemble.t, ensemble.quantile(column, 0.5), color=_COLOUR, linewidth=1.6, label="median")
        axes.plot(ensemble.t, ensemble.mean(column), color="#222222", linewidth=1.0, linestyle="--", label="mean")
        axes.set_ylabel(_label(ensemble, column))
        axes.grid(alpha=0.3)
        axes.margins(x=0.0)
    panels[-1].set_xlabel("time in s")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", fontsize="small", ncols=5)
    left = len(ensemble.columns) - len(columns)
    more = f"; {left} more columns in statistics.csv" if left else ""
    count = ensemble.done - len(ensemble.failed)
    figure.suptitle(f"{ensemble.scene}: {count} samples, {ensemble.design}{more}", fontsize="medium")
    return figure


def _scatter(ensemble: Drawn) -> Any:
    results = _drawn_results(ensemble)
    varied = ensemble.varied[:_PANELS]
    figure = new_figure((0.8 + 2.9 * max(len(varied), 2), 0.6 + 2.5 * len(results)))
    grid = figure.subplots(len(results), len(varied), sharex="col", sharey="row", squeeze=False)
    stride = -(-ensemble.done // _POINTS)
    for row, result in zip(grid, results, strict=True):
        found = ensemble.results[result][::stride]
        for axes, name in zip(row, varied, strict=True):
            axes.plot(ensemble.values[name][::stride], found, ".", markersize=3, alpha=0.6, color=_COLOUR)
            axes.grid(alpha=0.3)
        row[0].set_ylabel(_label(ensemble, result))
    for axes, name in zip(grid[-1], varied, strict=True):
        axes.set_xlabel(_label(ensemble, name))
    thinned = f", each {stride}th sample" if stride > 1 else ""
    figure.suptitle(f"{ensemble.scene}: results against varied quantities{thinned}", fontsize="medium")
    return figure


def _rankings(ensemble: Drawn) -> Any | None:
    """Return the figure of rankings; None if there are too few samples for one."""
    found = []
    for result in _drawn_results(ensemble):
        try:
            found.append(ensemble.sensitivity(result))
        except UsageError:
            continue
    if not found:
        return None
    height = 0.35 * len(ensemble.varied) + 0.9
    figure = new_figure((7.5, 0.5 + height * len(found)))
    panels = figure.subplots(len(found), 1, sharex=True, squeeze=False)[:, 0]
    for axes, one in zip(panels, found, strict=True):
        names = list(one.total)[::-1]
        places = np.arange(len(names))
        if one.total is not one.first:
            axes.barh(places, [one.total[name] for name in names], color="#A9C6E8", label="with interactions")
        for shift, bounds in ((0.12, one.total_interval), (-0.12, one.first_interval)):
            if bounds:
                low, high = np.array([bounds[name] for name in names]).T
                axes.hlines(places + shift, low, high, color="black", linewidth=1.0)
        axes.barh(places, [one.first[name] for name in names], color=_COLOUR, height=0.5, label="by itself")
        axes.set_yticks(places, names)
        told = f", errors of steps up to {100 * one.error:.2g} % of its deviation" if one.error > NOTICED else ""
        axes.set_title(f"{one.result}{told}", fontsize="small", loc="left")
        axes.grid(alpha=0.3, axis="x")
    panels[-1].set_xlabel(f"share of the variance ({found[0].kind})")
    panels[-1].set_xlim(left=min(0.0, panels[-1].get_xlim()[0]))
    panels[0].legend(loc="lower right", fontsize="small")
    return figure


def _drawn_results(ensemble: Drawn) -> list[str]:
    """Return the results that are drawn: the largest value of each column."""
    return [f"{column}.{EXTREMES[1]}" for column in ensemble.columns[: _PANELS // 2]]


def _label(ensemble: Drawn, name: str) -> str:
    column, _, part = name.rpartition(".")
    known = name if name in ensemble.units else column if part in EXTREMES else name
    unit = ensemble.units.get(known, "")
    return f"{name.removeprefix('output.')}{f' in {unit}' if unit not in ('', '1') else ''}"
