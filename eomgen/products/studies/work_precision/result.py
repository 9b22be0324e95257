"""``Tradeoff``: points of a study, the front, slopes and messages of wrong points, with picture and files."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.csv_tables import write_rows
from eomgen.base.data import dataclass, field
from eomgen.base.figures import draw_grid, new_figure, save_figure
from eomgen.base.files import make_folder, write_text
from eomgen.base.json_text import json_text
from eomgen.products.studies.work_precision.axes import Configuration
from eomgen.products.studies.work_precision.observation import ErrorSize, check_measure, error_in
from eomgen.products.studies.work_precision.running import REACHED

#: Errors above this are wrong, at any cost.
WRONG = 0.1
#: Beginning of the reason for omissions for want of time.
NOT_BUILT = "not built"
#: Demands of the table.
DEMANDS = (1e-2, 1e-4, 1e-6, 1e-8)
#: Deviation of a measured order from the declared order above which both are printed.
OFF = 0.15
#: Attributes of points in files, before and after errors and times.
_SAID, _COUNTED = ("kind", "value", "ended", "said"), ("repeats", "stats", "order", "took")


@dataclass(frozen=True)
class Point:
    """A run of a study.

    Attributes
    ----------
    configuration : of the run
    kind, value : ``step`` in s, or ``tolerance``
    ended : ``reached``, ``stopped``, ``refused`` or ``too long``
    said : warnings of the run, or the reason for an earlier end
    error : sizes of the errors by quantity, none below the uncertainty of the reference; empty if the run did not
        reach the end
    seconds : median of the processor's time for all steps, s, without outputs, energies and the error estimate; None
        for
        points without timing
    least : the least of these times
    repeats : how many were taken
    stats : counts of the stepper
    order : declared, of the method
    took : the processor's seconds that the study spent on the point, all repeats included, without builds
    """

    configuration: Configuration
    kind: str
    value: float
    ended: str
    said: str
    error: Mapping[str, ErrorSize] = field(default_factory=dict)
    seconds: float | None = None
    least: float | None = None
    repeats: int = 0
    stats: Mapping[str, float] = field(default_factory=dict)
    order: int = 0
    took: float = 0.0

    @property
    def label(self) -> str:
        return f"{self.configuration.label}, {self.kind} {self.value:.4g}"

    def error_of(self, quantity: str, measure: str = "largest") -> float:
        """Return the relative error of the run in a quantity; infinite if it is not known or not finite.

        Parameters
        ----------
        quantity : str
            Quantity of the study, as of ``tradeoff``: ``q``, ``v``, the name of an output ...
        measure : str, optional
            ``largest``, ``rms`` or ``final``, as of ``tradeoff``.

        Returns
        -------
        float
            Relative to the size of the quantity in the reference, and at least the uncertainty of the reference.

        Raises
        ------
        UsageError
            An unknown measure.
        """
        check_measure(measure)
        return error_in(self.error, quantity, measure)

    def to_dict(self) -> dict[str, Any]:
        return {
            **self.configuration.to_dict(),
            **{name: getattr(self, name) for name in _SAID},
            "errors": {name: dict(vars(size)) for name, size in self.error.items()},
            "seconds": self.seconds,
            "least_seconds": self.least,
            **{name: getattr(self, name) for name in _COUNTED},
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Point:
        """Return the point that ``to_dict`` gave.

        Parameters
        ----------
        data : mapping
            JSON data of ``to_dict``; errors of None become infinite, further keys are ignored.

        Raises
        ------
        ValueError, TypeError, KeyError, AttributeError
            These are not the data of a point.
        """
        names = ("formulation", "method", "parameters", "policy", "settings", "real", "profile")
        errors = {
            name: {key: math.inf if x is None else x for key, x in size.items()}
            for name, size in data["errors"].items()
        }
        times = (data["seconds"], data["least_seconds"])
        known = [data[name] for name in ("value", "took", "repeats", "order")] + [x for x in times if x is not None]
        if not all(isinstance(x, int | float) for x in chain(known, *(size.values() for size in errors.values()))):
            raise TypeError("times, counts and errors are numbers")
        return cls(
            Configuration(**{name: data[name] for name in names}),
            error={name: ErrorSize(**size) for name, size in errors.items()},
            least=data["least_seconds"],
            **{name: data[name] for name in (*_SAID, "seconds", *_COUNTED)},
        )


@dataclass(frozen=True)
class Slope:
    """The order of convergence of a configuration: fitted over points in the asymptotic part."""

    configuration: Configuration
    slope: float
    declared: int
    points: int

    @property
    def is_off(self) -> bool:
        """Whether it is another order than the declared one."""
        return abs(self.slope - self.declared) > OFF


@dataclass(frozen=True)
class Tradeoff:
    """Speed against accuracy of one scene: measurements and conclusions, with picture and files.

    Attributes
    ----------
    scene : name of the scene
    quantity, measure : the error that the front is of
    span : (start, end, number of times at which the reference is known)
    points : all runs
    reference : run of the reference, with uncertainty
    machine : processor, compiler, versions
    compiled : seconds of building by model and method, short for cached builds
    left_out : omitted runs, and the reasons
    seconds : of the whole study
    """

    scene: str
    quantity: str
    measure: str
    span: tuple[float, float, int]
    points: tuple[Point, ...]
    reference: Mapping[str, Any]
    machine: Mapping[str, str]
    compiled: Mapping[str, float] = field(default_factory=dict)
    left_out: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0

    def error(self, point: Point) -> float:
        """Return the error of a point, in the study's quantity and measure.

        Parameters
        ----------
        point : Point
            One of ``points``.

        Returns
        -------
        float
            Relative error; infinite if unknown.
        """
        return point.error_of(self.quantity, self.measure)

    @property
    def uncertainty(self) -> float:
        """By how much the reference may be wrong, in the study's quantity and measure."""
        return float(self.reference["uncertainty"].get(self.quantity, {}).get(self.measure) or 0.0)

    @property
    def usable(self) -> tuple[Point, ...]:
        """Points that reached the end and were timed."""
        return tuple(p for p in self.points if p.ended == REACHED and p.seconds is not None)

    @property
    def failures(self) -> tuple[Point, ...]:
        return tuple(p for p in self.points if p.ended != REACHED)

    @property
    def wrong(self) -> tuple[Point, ...]:
        """Points that reached the end with an error above a tenth."""
        return tuple(p for p in self.points if p.ended == REACHED and not self.error(p) <= WRONG)

    @property
    def not_built(self) -> tuple[str, ...]:
        """Configurations left out for lack of time for a build."""
        return tuple(label for label, why in self.left_out.items() if why.startswith(NOT_BUILT))

    @property
    def silent(self) -> tuple[Point, ...]:
        """Wrong points without a warning."""
        return tuple(p for p in self.wrong if not p.said)

    @property
    def front(self) -> tuple[Point, ...]:
        """Timed points with no other point at least as fast and as accurate, fastest first (of equal points the first).
        Errors are of the study's quantity and measure; errors from 0.1 on are left out.

        Errors below the uncertainty of the reference count as this uncertainty.
        """
        result: list[Point] = []
        least = WRONG
        for point in sorted(self.usable, key=lambda p: (p.seconds, self.error(p))):
            error = max(self.error(point), self.uncertainty)
            if error < least:
                result.append(point)
                least = error
        return tuple(result)

    def best(self, demand: float) -> Point | None:
        """Return the cheapest point that meets a demand, None if none does.

        Parameters
        ----------
        demand : float
            Largest error, in the quantity and measure of the study.

        Returns
        -------
        Point or None
            The point with the shortest median time. Runs that failed or were not timed do not count, and no point
            meets a demand below the uncertainty of the reference.
        """
        able = [p for p in self.usable if self.error(p) <= demand]
        return min(able, key=lambda p: p.seconds or math.inf, default=None)

    def verdict(self, point: Point) -> str:
        """Return the value of a point: ``front``, ``dominated`` (also without a time), ``wrong, said`` and ``wrong,
        silent`` for unknown errors and errors above 0.1 with and without a warning, or the kind of failure:
        ``stopped``, ``refused``, ``too long``.

        Parameters
        ----------
        point : Point
            One of ``points``.

        Returns
        -------
        str
            One of the words above.
        """
        if point.ended != REACHED:
            return point.ended
        if point in self.wrong:
            return "wrong, said" if point.said else "wrong, silent"
        return "front" if point in self.front else "dominated"

    @property
    def slopes(self) -> tuple[Slope, ...]:
        """The measured order, ``slope``, of each configuration at given steps (without tolerance), over the three or
        four smallest steps with errors below 2e-3 and above 30 times the reference's uncertainty (and 1e-12).
        Configurations with fewer such points are left out."""
        groups: dict[str, list[Point]] = {}
        for point in self.points:
            if point.kind == "step" and point.ended == REACHED:
                groups.setdefault(point.configuration.key, []).append(point)
        floor = max(30.0 * self.uncertainty, 1e-12)
        result = []
        for members in groups.values():
            kept = [p for p in sorted(members, key=lambda p: p.value) if floor < self.error(p) < 2e-3][:4]
            if len(kept) >= 3:
                steps, errors = np.log([p.value for p in kept]), np.log([self.error(p) for p in kept])
                slope = float(np.polyfit(steps, errors, 1)[0])
                result.append(Slope(members[0].configuration, slope, members[0].order, len(kept)))
        return tuple(result)

    def to_dict(self) -> dict[str, Any]:
        """Return all attributes as JSON data.

        Returns
        -------
        dict
            By the names of the attributes, and ``front`` (labels of points) and ``slopes``; ``span`` is by ``start``,
            ``end`` and ``rows``. Each of the ``points`` has the attributes of its configuration, ``errors``,
            ``least_seconds`` and a ``verdict``. Errors may be infinite.
        """
        return {
            **{name: getattr(self, name) for name in ("scene", "quantity", "measure", "seconds")},
            **{name: dict(getattr(self, name)) for name in ("reference", "machine", "compiled", "left_out")},
            "span": dict(zip(("start", "end", "rows"), self.span, strict=True)),
            "points": [{**p.to_dict(), "verdict": self.verdict(p)} for p in self.points],
            "front": [p.label for p in self.front],
            "slopes": [
                {**s.configuration.to_dict(), "slope": s.slope, "declared": s.declared, "points": s.points}
                for s in self.slopes
            ],
        }

    def plot(self, path: str | Path) -> Path:
        """Draw errors over time and the front. Raises FileError.

        Parameters
        ----------
        path : path
            Picture, of the kind of its ending.

        Returns
        -------
        Path
            The picture.
        """
        return draw(self, Path(path))

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``tradeoff.json`` (``to_dict``, null for infinite), ``tradeoff.csv`` (a row for each point) and
        ``tradeoff.png`` to a folder. Existing files are replaced. Raises FileError.

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
        data, table = target / "tradeoff.json", target / "tradeoff.csv"
        write_text(data, json_text(self.to_dict()) + "\n")
        write_rows(table, self._table())
        return [data, table, self.plot(target / "tradeoff.png")]

    def _table(self) -> Iterator[list[Any]]:
        """Yield the rows of tradeoff.csv as lists: the headings, then one row for each point with errors and counts."""
        rows = []
        for point in self.points:
            row = point.to_dict() | {"verdict": self.verdict(point)}
            row["parameters"] = " ".join(f"{name}={value:g}" for name, value in row["parameters"].items())
            sizes = {f"{name} {measure}": x for name, size in row["errors"].items() for measure, x in size.items()}
            rows.append((row | sizes | row["stats"], sizes, row["stats"]))
        columns_of_points = ("formulation", "method", "parameters", "policy", "real", "profile", "kind", "value")
        measured = dict.fromkeys(name for of in (1, 2) for row in rows for name in row[of])
        head = [*columns_of_points, "verdict", "seconds", "least_seconds", "repeats", *measured, "said"]
        yield head
        for row, *_ in rows:
            yield [_cell(row.get(name)) for name in head]


def _cell(value: object) -> str:
    return "" if value is None else value if isinstance(value, str) else repr(value)


def short_duration(seconds: float) -> str:
    """Return a duration of computation by three digits: ``1.23 s``, ``4.56 ms``, ``7.89 us``."""
    unit, size = next((u, s) for u, s in (("s", 1.0), ("ms", 1e-3), ("us", 0.0)) if seconds >= s)
    return f"{seconds / (size or 1e-6):.3g} {unit}"


#: Colours and marks of curves with a name.
COLOURS = (
    *("#0B62C4", "#F08C00", "#1A9850", "#C8102E", "#7B3FA0"),
    *("#00A0B0", "#8C564B", "#B8860B", "#E377C2", "#5F7F00"),
)
MARKS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")
_GREY = "#B4B4B4"
#: The largest error drawn to scale.
_LARGEST = 10.0


def legend_beside(axis: Any, *entries: Any) -> None:
    """Draw the legend of an axis to its right."""
    axis.legend(*entries, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, frameon=False, fontsize=8)


def draw(study: Tradeoff, path: Path) -> Path:
    """Draw error over time of all configurations and the front into a file, and return the path. Raises
    FileError if the file cannot be written."""
    figure = new_figure((13.0, 7.2))
    axis = figure.subplots()
    _curves(axis, study)
    _marks(axis, study)
    _describe(axis, study)
    handles, labels = axis.get_legend_handles_labels()
    if handles:
        count = sum(line.get_zorder() == 3 for line in handles)  # curves are drawn worst first
        handles, labels = handles[:count][::-1] + handles[count:], labels[:count][::-1] + labels[count:]
        legend_beside(axis, handles, labels)
    return save_figure(figure, path)


def _groups(study: Tradeoff) -> list[list[Point]]:
    """Return the timed points in a list for each configuration: the best configuration of each method, best first, then
    the remaining configurations."""
    groups: dict[str, list[Point]] = {}
    for point in study.usable:
        groups.setdefault(point.configuration.key, []).append(point)
    ranked = sorted(groups.values(), key=lambda members: _costs(study, members))
    first: dict[str, list[Point]] = {}  # the best of each method has a name before the second best of another
    for members in ranked:
        first.setdefault(members[0].configuration.method, members)
    return [*first.values(), *(members for members in ranked if members not in first.values())]


def _costs(study: Tradeoff, members: list[Point]) -> list[float]:
    """Return the least seconds of a configuration's points for each demand, the smallest demand first; infinite for
    demands that are not met."""
    known = [(study.error(p), p.seconds) for p in members if p.seconds]
    return [min((cost for error, cost in known if error <= demand), default=math.inf) for demand in DEMANDS[::-1]]


def _curves(axis: Any, study: Tradeoff) -> None:
    """Draw the error over time for all configurations; configurations beyond the first few are grey."""
    slopes = {slope.configuration.key: slope for slope in study.slopes}
    groups = _groups(study)
    for number, members in reversed(list(enumerate(groups))):
        members = sorted(members, key=lambda p: p.value, reverse=True)  # noqa: PLW2901  # coarse to fine
        named = number < len(COLOURS)  # further curves are grey
        colour = COLOURS[number] if named else _GREY
        _draw_points(
            axis.loglog,
            study,
            members,
            color=colour,
            marker=MARKS[number] if named else ".",
            markersize=4.5 if named else 3.0,
            linewidth=1.1 if named else 0.6,
            zorder=3 if named else 1,
            label=_name(members[0], slopes) if named else None,
        )
    if others := [slopes.get(members[0].configuration.key) for members in groups[len(COLOURS) :]]:
        off = sum(slope is not None and slope.is_off for slope in others)
        label = f"{len(others)} other configurations" + (f", {off} of another order than declared" if off else "")
        axis.plot([], [], color=_GREY, marker=".", linewidth=0.6, label=label)


def _name(point: Point, slopes: dict[str, Slope]) -> str:
    slope = slopes.get(point.configuration.key)
    order = f" (order {slope.slope:.2f}, declared {slope.declared})" if slope else ""
    return f"{point.configuration.label}{order}"


def _draw_points(drawn: Callable[..., Any], study: Tradeoff, points: Sequence[Point], **style: Any) -> None:
    """Draw errors over milliseconds by a function of an axis, in a style of matplotlib."""
    times = [1e3 * (point.seconds or math.nan) for point in points]
    drawn(times, [min(max(study.error(point), 1e-17), _LARGEST) for point in points], **style)


def _marks(axis: Any, study: Tradeoff) -> None:
    """Mark the front, the scene's own configuration, and wrong points without a warning."""
    ring = {"marker": "o", "linestyle": "none", "fillstyle": "none"}
    scene_points = [point for point in study.points[:1] if point in study.usable]
    silent = [point for point in study.silent if point in study.usable]
    if study.front:
        label = "front: none is both faster and more accurate"
        broad = {"where": "post", "color": "black", "linewidth": 5, "alpha": 0.18}
        _draw_points(axis.step, study, study.front, **broad, zorder=2, label=label)
    if scene_points:
        label = f"the scene's own: {scene_points[0].label}"
        _draw_points(axis.plot, study, scene_points, **ring, color="black", ms=13, mew=1.6, zorder=5, label=label)
    if silent:
        label = f"wrong by more than 10 % and silent ({len(silent)})"
        _draw_points(axis.plot, study, silent, **ring, color="#C8102E", ms=9, mew=1.2, zorder=4, label=label)


def _describe(axis: Any, study: Tradeoff) -> None:
    """Draw the uncertainty of the reference, the limits, labels and the title."""
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
    axis.set_xlabel("processor's time for all steps, ms (without outputs, energies and the error estimate)", fontsize=9)
    axis.set_ylabel(f"{study.measure} error of {study.quantity}, relative", fontsize=9)
    draw_grid(axis)
    axis.set_title(
        f"{study.scene}: {end - start:g} s, {len(study.points)} runs, reference known at {rows + 1} times\n"
        f"reference: {study.reference['by']}; held against {study.reference['held against']}\n"
        f"{study.machine.get('processor', '')}, {study.machine.get('compiler', '')}",
        fontsize=9.5,
        loc="left",
    )
