"""Figures of the page of benchmarks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from benchmarks.suite.outcomes import Finding
from benchmarks.suite.page import compared, ratio_of
from benchmarks.suite.register import Comparison, Row

AHEAD, BEHIND, GOAL = "#1b6ca8", "#c0561f", "#777777"


def draw(found: Mapping[str, Finding], rows: Sequence[Row], folder: Path) -> list[Path]:
    """Draw all figures and return their files."""
    with mpl.rc_context({"svg.hashsalt": "eomgen", "font.size": 9, "svg.fonttype": "none"}):
        return [ratios(found, rows, folder / "benchmarks_ratios.svg")]


def ratios(found: Mapping[str, Finding], rows: Sequence[Row], file: Path) -> Path:
    """Draw how many times as long as eomgen each peer takes, with the goals."""
    groups: dict[str, list[tuple[Comparison, float]]] = {}
    for row, comparison in compared(rows):
        if (ratio := ratio_of(found.get(row.name), comparison)) is not None:
            groups.setdefault(row.work, []).append((comparison, 1.0 / ratio))
    lines = sum(1 + len(group) for group in groups.values())
    figure, axes = plt.subplots(figsize=(9.0, 0.8 + 0.2 * lines), layout="constrained")
    numbers = [times for group in groups.values() for _, times in group]
    low, high = min([*numbers, 0.5]) / 4.0, max([*numbers, 2.0]) * 3.0
    place, places, labels = 0, [], []
    for work, group in groups.items():
        axes.text(low, place, work, va="center", fontweight="bold", fontsize=8)
        for comparison, times in group:
            place += 1
            _draw_line(axes, place, times, comparison.target)
            places.append(place)
            labels.append(comparison.peer if comparison.own == "eomgen" else f"{comparison.peer}, {comparison.own}")
        place += 1
    axes.set_yticks(places, labels)
    axes.set_ylim(place - 0.4, -0.6)
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.axvline(1.0, color="black", linewidth=0.8)
    axes.xaxis.set_major_locator(LogLocator(base=10))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(axis="x", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_xlabel("time of the other / time of eomgen; gray marks are goals")
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.tick_params(axis="y", length=0)
    figure.savefig(file, metadata={"Date": None})
    plt.close(figure)
    return file


def _draw_line(axes: Any, place: int, times: float, target: float | None) -> None:
    color, ahead = (AHEAD, True) if times >= 1.0 else (BEHIND, False)
    axes.plot([1.0, times], [place, place], color=color, linewidth=2.0, solid_capstyle="butt")
    axes.plot(times, place, "o", color=color, markersize=4.5)
    beyond = times
    if target:
        axes.plot(1.0 / target, place, "|", color=GOAL, markersize=9, markeredgewidth=1.5)
        near = 1.0 <= 1.0 / target / times < 3.0
        beyond = 1.0 / target if ahead and near else times
    axes.annotate(f"{times:.3g}", (beyond, place), (6 if ahead else -6, 0), textcoords="offset points",
                  va="center", ha="left" if ahead else "right", fontsize=8)  # fmt: skip
