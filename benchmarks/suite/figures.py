"""Draw the figures of the page of benchmarks: ratios of the stored results, times over the dates of measurements.

python -m benchmarks.suite.figures [--folder FOLDER] [--history FILE] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import sys
import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from benchmarks.suite.history import HISTORY, Measurement, contestants, read_history, series
from benchmarks.suite.outcomes import RESULTS, Finding, read
from benchmarks.suite.page import PAGE, compared, ratio_of, shown
from benchmarks.suite.register import ROWS, Comparison, Row

#: Texts stay texts, in one font, with names that are the same each time.
SETTINGS = {"svg.hashsalt": "eomgen", "svg.fonttype": "none", "font.sans-serif": ["DejaVu Sans"]}
AHEAD, BEHIND, GOAL = "#1b6ca8", "#c0561f", "#777777"


def draw(found: Mapping[str, Finding], rows: Sequence[Row], folder: Path) -> list[Path]:
    """Draw all figures and return their files."""
    with mpl.rc_context({**SETTINGS, "font.size": 9}):
        return [ratios(found, rows, folder / "benchmarks_ratios.svg")]


def ratios(found: Mapping[str, Finding], rows: Sequence[Row], file: Path) -> Path:
    """Draw how many times as long as eomgen each peer takes, with the goals."""
    groups: dict[str, list[tuple[Comparison, float]]] = {}
    for row, comparison in compared(rows):
        if (ratio := ratio_of(found.get(row.name), comparison)) is not None:
            groups.setdefault(row.work, []).append((comparison, 1.0 / ratio))
    lines = sum(1 + len(group) for group in groups.values())
    figure, axes = plt.subplots(figsize=(9.8, 0.8 + 0.2 * lines), layout="constrained")
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


COLUMNS = 4
PEER = "#888888"


def draw_history(history: Sequence[Measurement], rows: Sequence[Row], file: Path) -> None:
    """Draw the time of each row over the dates of its measurements, eomgen and the first other contestant."""
    rows = [row for row in rows if any(one.row == row.name for one in history)]
    columns = min(COLUMNS, len(rows))
    lines = -(-len(rows) // columns)
    with mpl.rc_context({**SETTINGS, "font.size": 8}):
        figure, panels = plt.subplots(
            lines, columns, figsize=(3.25 * columns, 1.9 * lines), layout="constrained", sharex=True, squeeze=False
        )
        for axes, row in zip(panels.flat, rows, strict=False):
            _draw_row(axes, history, row)
        for axes in list(panels.flat)[len(rows) :]:
            axes.set_visible(False)
        # The lowest panel of each column has the labels of the shared axis.
        for column in range(columns):
            last = [axes for axes in panels[:, column] if axes.get_visible()][-1]
            last.tick_params(axis="x", labelbottom=True, rotation=30)
        handles = [
            mpl.lines.Line2D([], [], color=AHEAD, marker="o", markersize=3, label="eomgen"),
            mpl.lines.Line2D(
                [], [], color=PEER, marker="s", markersize=3, label="the other contestant, named in a panel"
            ),
        ]
        figure.legend(handles=handles, loc="outside upper center", ncols=2, frameon=False)
        figure.savefig(file, metadata={"Date": None})
        plt.close(figure)


def _draw_row(axes: Any, history: Sequence[Measurement], row: Row) -> None:
    own, peer = contestants(row)
    seen: list[float] = []
    for name, color, marker in ((own, AHEAD, "o"), (peer, PEER, "s")):
        # Each machine has a line of its own, since times of different processors are not one series.
        for points in series(history, row.name, name).values() if name else ():
            line = axes.plot(*zip(*points, strict=True), color=color, linewidth=1.0)[0]
            line.set(marker=marker, markersize=3, markevery=[-1])
            seen += (seconds for _, seconds in points)
    # Each panel spans two decades at least, so that 3 % look like 3 % in all of them.
    middle = (min(seen) * max(seen)) ** 0.5
    span = max(max(seen) / middle, 5.0)
    axes.set_yscale("log")
    axes.set_ylim(middle / (2.0 * span), 4.0 * span * middle)
    axes.set_title("\n".join(textwrap.wrap(row.work, 44)[:3]), fontsize=7, loc="left")
    axes.set_ylabel("\n".join(textwrap.wrap(f"time of a {row.per}", 18)), fontsize=6)
    axes.yaxis.set_major_locator(LogLocator(base=10, numticks=5))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: shown(value)))
    axes.minorticks_off()
    axes.xaxis.set_major_locator(AutoDateLocator(minticks=2, maxticks=6))
    axes.xaxis.set_major_formatter(ConciseDateFormatter(axes.xaxis.get_major_locator(), show_offset=False))
    if peer:
        axes.text(0.98, 0.88, peer, color=PEER, transform=axes.transAxes, ha="right", fontsize=6)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def main(words: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.suite.figures", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--folder", type=Path, default=RESULTS, help="of results")
    parser.add_argument("--history", type=Path, default=HISTORY)
    parser.add_argument("--out", type=Path, default=PAGE.parent, help="of the figures")
    chosen = parser.parse_args(words)
    found = read(chosen.folder)
    files = draw(found, ROWS, chosen.out) if found else []
    if history := read_history(chosen.history):
        draw_history(history, ROWS, chosen.out / "benchmarks_history.svg")
        files.append(chosen.out / "benchmarks_history.svg")
    print("\n".join(map(str, files)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
