"""Picture of a study: errors over time, the front, dominated points, failures, slopes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from eomgen.base.figures import new_figure, saved
from eomgen.products.studies.work_precision.measured import DEMANDS, WRONG, Measured, Point
from eomgen.products.studies.work_precision.running import REACHED

if TYPE_CHECKING:
    from eomgen.products.studies.work_precision.measured import Slope

_COLOURS = (
    "#0B62C4",
    "#F08C00",
    "#1A9850",
    "#C8102E",
    "#7B3FA0",
    "#00A0B0",
    "#8C564B",
    "#B8860B",
    "#E377C2",
    "#5F7F00",
)
_MARKS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")
_GREY = "#B4B4B4"
#: Curves with a name; the others are grey.
_NAMED = 10
#: A measured order that is off its declared one by more than this is told.
_OFF = 0.15
#: Penalty for missing a demand at all, in decades of time.
_NOT_MET = 4.0
#: The largest error that is drawn at its place.
_LARGEST = 10.0


def draw(study: Measured, path: Path) -> Path:
    """Draw a study. Raises FileError."""
    figure = new_figure((13.0, 7.2))
    axis = figure.subplots()
    _curves(axis, study)
    _front(axis, study)
    _failures(axis, study)
    _describe(axis, study)
    handles, labels = axis.get_legend_handles_labels()
    if handles:
        count = sum(line.get_zorder() == 3 for line in handles)  # curves are drawn worst first
        handles, labels = handles[:count][::-1] + handles[count:], labels[:count][::-1] + labels[count:]
        axis.legend(
            handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=8
        )
    return saved(figure, path)


def _groups(study: Measured) -> list[list[Point]]:
    """Return the points of each configuration: the best one of each method, best first, then the others."""
    found: dict[str, list[Point]] = {}
    for point in study.usable:
        found.setdefault(point.configuration.key, []).append(point)
    ranked = sorted(found.values(), key=lambda members: _rank(study, members))
    first: dict[str, list[Point]] = {}  # the best of each method has a name before the second best of another
    for members in ranked:
        first.setdefault(members[0].configuration.method, members)
    return [*first.values(), *(members for members in ranked if members not in first.values())]


def _rank(study: Measured, members: list[Point]) -> float:
    """Return the ratio of the cost of a configuration to the cheapest, in decades, summed over the demands."""
    total = 0.0
    for demand in DEMANDS:
        best = study.best(demand)
        if best is None or not best.seconds:
            continue
        able = [p.seconds for p in members if p.seconds and study.error(p) <= demand]
        total += min(math.log10(min(able) / best.seconds), _NOT_MET) if able else _NOT_MET
    return total


def _curves(axis: Any, study: Measured) -> None:
    slopes = {slope.configuration.key: slope for slope in study.slopes}
    groups = _groups(study)
    for number, members in reversed(list(enumerate(groups))):
        members = sorted(members, key=lambda p: p.value, reverse=True)  # noqa: PLW2901  # coarse to fine
        named = number < _NAMED
        colour = _COLOURS[number % len(_COLOURS)] if named else _GREY
        errors = [min(max(study.error(p), 1e-17), _LARGEST) for p in members]
        axis.loglog(
            [1e3 * (p.seconds or math.nan) for p in members],
            errors,
            color=colour,
            marker=_MARKS[number % len(_MARKS)] if named else ".",
            markersize=4.5 if named else 3.0,
            linewidth=1.1 if named else 0.6,
            zorder=3 if named else 1,
            label=_name(members[0], slopes) if named else None,
        )
    if others := [slopes.get(members[0].configuration.key) for members in groups[_NAMED:]]:
        off = sum(slope is not None and abs(slope.slope - slope.declared) > _OFF for slope in others)
        label = f"{len(others)} other configurations" + (f", {off} of another order than declared" if off else "")
        axis.plot([], [], color=_GREY, marker=".", linewidth=0.6, label=label)


def _name(point: Point, slopes: dict[str, Slope]) -> str:
    slope = slopes.get(point.configuration.key)
    order = f" (order {slope.slope:.2f}, declared {slope.declared})" if slope else ""
    return f"{point.configuration.label}{order}"


def _front(axis: Any, study: Measured) -> None:
    front = study.front
    if front:
        times = [1e3 * (p.seconds or math.nan) for p in front]
        axis.step(
            times, [study.error(p) for p in front], where="post", color="black", linewidth=5, alpha=0.18, zorder=2,
            label="front: none is both faster and more accurate",
        )  # fmt: skip  # a call of one drawing
    if study.points:
        own = study.points[0]
        if own.ended == REACHED and own.seconds is not None:
            axis.plot(
                [1e3 * own.seconds], [min(study.error(own), _LARGEST)], "o", markersize=13, fillstyle="none",
                color="black", markeredgewidth=1.6, zorder=5, label=f"the scene's own: {own.label}",
            )  # fmt: skip  # a call of one drawing


def _failures(axis: Any, study: Measured) -> None:
    """Mark failed points, which have no error, at the top, on the continuation of their configuration's times."""
    times = []
    for point in study.failures:
        if point.ended == "refused":
            continue
        same = [p for p in study.usable if p.configuration.key == point.configuration.key and p.kind == point.kind]
        if same and point.kind == "step":
            near = min(same, key=lambda p: abs(math.log(p.value / point.value)))
            times.append(1e3 * (near.seconds or 0.0) * near.value / point.value)
    if times:
        label = f"stopped before the end ({len(times)}), at the time that its steps would take"
        axis.plot(times, [_LARGEST] * len(times), "x", color="#C8102E", markersize=7, zorder=4, label=label)
    silent = [p for p in study.silent if p.seconds is not None]
    if silent:
        axis.plot(
            [1e3 * (p.seconds or 0.0) for p in silent], [min(study.error(p), _LARGEST) for p in silent], "o",
            color="#C8102E", markersize=9, fillstyle="none", markeredgewidth=1.2, zorder=4,
            label=f"wrong by more than 10 % and silent ({len(silent)})",
        )  # fmt: skip  # a call of one drawing


def _describe(axis: Any, study: Measured) -> None:
    start, end, rows = study.span
    uncertainty = study.uncertainty
    if uncertainty > 0.0:
        axis.axhspan(1e-18, max(uncertainty, 1e-17), color="#DDDDDD", alpha=0.6, zorder=0)
        axis.annotate(
            f"uncertainty of the reference, {uncertainty:.1g}", (0.01, uncertainty), xycoords=("axes fraction", "data"),
            xytext=(0, 3), textcoords="offset points", fontsize=8, color="#666666",
        )  # fmt: skip  # a call of one drawing
    errors = [study.error(p) for p in study.usable if math.isfinite(study.error(p))]
    lowest = min([e for e in errors if e > 0.0] or [1e-12])
    axis.set_ylim(min(lowest, uncertainty or lowest) / 4.0, 2.5 * _LARGEST)
    axis.axhline(WRONG, color="#C8102E", linewidth=0.7, linestyle=":")
    axis.set_xlabel("processor's time for all steps, ms (outputs, energies and the error estimate apart)", fontsize=9)
    axis.set_ylabel(f"{study.measure} error of {study.quantity}, relative", fontsize=9)
    axis.grid(True, which="major", color="#DDDDDD", linewidth=0.6)
    axis.set_title(
        f"{study.scene}: {end - start:g} s, {len(study.points)} runs, reference known at {rows + 1} times\n"
        f"reference: {study.reference['by']}; held against {study.reference['held against']}\n"
        f"{study.machine.get('processor', '')}, {study.machine.get('compiler', '')}",
        fontsize=9.5,
        loc="left",
    )
