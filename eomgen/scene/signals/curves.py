"""Reading of curves: points, tables, waves, bumps and roads, converted to one form."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.messages import shown
from eomgen.base.random_inputs import FARTHEST, FASTEST, Harmonic, road_harmonics
from eomgen.errors import FileError, Problem
from eomgen.formula.curves import AnyCurve, Bump, Curve, Interpolation, Outside, Waves
from eomgen.formula.discontinuities import rough_curves
from eomgen.formula.nodes import Application, Formula, Symbol
from eomgen.formula.units.conversion import unit_fault
from eomgen.formula.units.parser import UnitError, read_unit
from eomgen.formula.units.table import measure
from eomgen.scene.formula.scope import PARAMETERS
from eomgen.scene.reading.report import Report
from eomgen.scene.reading.values import Values
from eomgen.scene.signals.tables import (
    MOST_ROWS,
    is_in_si,
    is_time,
    read_columns,
    unit_of_title,
    without_unit,
)
from eomgen.system.signals import RoadUnderWheel

if TYPE_CHECKING:
    from eomgen.scene.signals import curve_schema as written

LARGEST = 1e100


def fault(x: Array, y: Array, interpolation: Interpolation, outside: Outside) -> tuple[int, str, str] | None:
    """Return the index of the first faulty point of a curve (x, y), the fault, and a hint; None for a valid curve.
    Arguments ``x`` have to increase, or may jump for linear interpolation, and be evenly spread enough for a spline; a
    periodic spline needs equal values at both ends."""
    if len(x) < 2:
        return 0, f"a curve needs two points or more, not {len(x)} [E0910]", "more points"
    huge = np.flatnonzero(np.maximum(np.abs(x), np.abs(y)) > LARGEST)
    if len(huge):
        return int(huge[0]), f"a number is beyond {LARGEST:.0e} [E0911]", "other units"
    steps = np.diff(x)
    if np.any(steps < 0.0):
        index = int(np.argmax(steps < 0.0)) + 1
        message = f"the points are not in order: {x[index]:.9g} comes after {x[index - 1]:.9g} [E0912]"
        return index, message, "rows sorted by the first of the two columns"
    equal = steps == 0.0
    hint = 'one value for each, or interpolation = "linear", which jumps there'
    if interpolation == "linear":
        single = np.zeros(len(steps), bool)
        single[[0, -1]] = True
        equal = equal & (single | np.append(False, equal[:-1]))
        hint = "at most two points at one place, and one at the ends"
    if np.any(equal):
        index = int(np.argmax(equal)) + 1
        return index, f"{x[index]:.9g} occurs again [E0915]", hint
    if interpolation == "quintic" and np.min(steps) < 1e-5 * np.max(steps):  # its equations lose all digits
        index = int(np.argmin(steps)) + 1
        here, elsewhere = np.min(steps), np.max(steps)
        message = f"distances of points: {here:.3g} here, {elsewhere:.3g} elsewhere, too uneven for a spline [E0913]"
        return index, message, 'points more evenly spread, or interpolation = "linear"'
    if outside == "periodic" and interpolation == "quintic":
        gap, scale = abs(float(y[-1] - y[0])), float(np.max(np.abs(y)))
        if gap > 1e-9 * scale:
            message = f"the last value {y[-1]:.9g} is not the first one {y[0]:.9g}, as of a periodic curve [E0914]"
            return len(x) - 1, message, "a last point that repeats the first value, one period later"
    return None


def check_twice_differentiable(
    key: str, formulas: Iterable[Formula], report: Report, hint: str = 'interpolation = "quintic"'
) -> None:
    """Report each curve in formulas of a prescribed motion that jumps or bends, since such a motion requires an
    infinite force, at the dotted key, with the remedy ``hint``."""
    for formula in formulas:
        for name, does in rough_curves(formula, 2).items():
            report.add(key, f"a motion cannot follow {name}, which {does} [E1856]", hint)


KINDS = ("table", "points", "wave", "bump", "road")
_ROADS = ("table", "points", "bump")


def unit_factor(key: str, unit: str, report: Report) -> float:
    """Return the factor from a unit of a column to SI; 1 without a unit, and for an unknown one, which is reported at
    the key."""
    if not unit.strip():
        return 1.0

    try:
        return float(measure(read_unit(unit))[0])
    except UnitError as error:
        report.add_error(key, error)
        return 1.0


class Curves:
    """Reader of curves, which reports faults.

    Parameters
    ----------
    values : Values
        Reads values of fixed parameters, and takes the problems.
    folder : Path
        Of the scene file; paths of tables start there.
    """

    def __init__(self, values: Values, folder: Path) -> None:
        self.values = values
        self.report = values.report
        self.folder = folder

    def curve(self, key: str, name: str, entry: written.CurveEntry) -> AnyCurve:
        """Return the curve of an entry of [curves], with the name ``name``; after a fault, which is reported at the
        dotted key, a curve that is zero."""
        kinds = [kind for kind in KINDS if getattr(entry, kind) is not None]
        if len(kinds) != 1:
            got = " and ".join(kinds) or "none"
            message = f"a curve needs one of {', '.join(KINDS)}, not {got} [E1857]"
            self.report.add(key, message, "points = [[0, 0], [1, 0.5]]")
            return _empty(name)
        if kinds[0] not in ("table", "points"):
            self.refuse_options(key, entry, f"a {kinds[0]}")
        if entry.wave is not None:
            return self.wave(f"{key}.wave", name, entry.wave)
        if entry.bump is not None:
            return self.bump(f"{key}.bump", name, entry.bump)
        if entry.road is not None:
            harmonics = road_harmonics(entry.road.road_class, 1.0, seed=entry.road.seed, harmonics=entry.road.harmonics)
            return Waves(name, harmonics)
        return self.through_points(key, name, entry, (entry.argument_unit or "", entry.unit))

    def through_points(
        self, key: str, name: str, entry: written.ShapeEntry, units: tuple[str, str] = ("", "")
    ) -> Curve:
        """Return a curve through the points of a list or a table; after a fault, which is reported, a curve that is
        zero. ``units`` are known units of argument and value, as labels, for notes on titles of the table."""
        interpolation = entry.interpolation or Curve.interpolation
        if entry.points is not None:
            key = f"{key}.points"
            if len(entry.points) > MOST_ROWS:
                message = f"there are {len(entry.points)} points, more than {MOST_ROWS} [E1858]"
                self.report.add(key, message, "every tenth point, or the part that is needed")
                return _empty(name)
            points = [self.values.constants(f"{key}[{k}]", pair) for k, pair in enumerate(entry.points)]
            x, y = np.array([*zip(*points, strict=True)]) if points else np.zeros((2, 0))
            places = [self.report.where(f"{key}[{k}]") for k in range(len(points))] or [self.report.where(key)]
            outside = entry.outside or ("error" if interpolation == "quintic" else "hold")
        else:
            key = f"{key}.table"
            columns = self.columns(key, entry.table, units)
            if columns is None:
                return _empty(name)
            (x, y), places = columns
            outside = entry.outside or Curve.outside
        if not np.all(np.isfinite([x, y])):  # refused and reported before
            return _empty(name)
        wrong = fault(x, y, interpolation, outside)
        if wrong is not None:
            index, message, hint = wrong
            self.report.add_problem(key, Problem(places[min(index, len(places) - 1)], message, hint))
            return _empty(name)
        return Curve(name, x, y, interpolation, outside)

    def columns(
        self, key: str, table: written.TableFile | None, units: tuple[str, str]
    ) -> tuple[tuple[Array, Array], list[str]] | None:
        """Return the two columns of a table, arrays (n,) in SI by scales and units, and ``file:line`` of each row; None
        without a table, and for unreadable columns, which are reported. ``units`` as of ``through_points``."""
        if table is None:
            return None
        for column in ("argument_scale", "value_scale"):
            if getattr(table, column) == 0.0:
                message = "a factor of zero makes all values of the column zero [E1859]"
                self.report.add(f"{key}.{column}", message, "1, or no factor")
                return None
        path, chosen = self.folder / table.file, {"argument", "value"} & table.model_fields_set
        try:
            result = read_columns(
                path,
                table.argument,
                table.value,
                delimiter=table.delimiter,
                decimal=table.decimal,
                quotes=_is_within(path, self.folder),
                chosen=bool(chosen),
            )
        except FileError as error:
            self.report.add_file_error(key, error)
            return None
        x, y = result.argument * self.scale(key, table, "argument"), result.value * self.scale(key, table, "value")
        self.note_titles(key, table, result.titles, units)
        if result.width > 2 and "value" not in chosen:
            title = f", {shown(result.titles[1])}," if result.titles[1] else ""
            note = f"the table has {result.width} columns, and column {table.value}{title} is taken"
            self.values.note([f"{key}.value: {note}; value = {table.value} says that it is meant"])
        file = Path(table.file).name
        shown_file = file if file.isascii() and file.isprintable() else ascii(file)
        return (x, y), [f"{shown_file}:{line} ({key})" for line in result.lines]

    def note_titles(self, key: str, table: written.TableFile, titles: tuple[str, str], units: tuple[str, str]) -> None:
        """Add notes on columns whose titles name units that are not converted, or units of another dimension than
        ``units``, and on a column without a unit next to a column with one."""
        for column, title, unit in zip(("argument", "value"), titles, units, strict=True):
            as_it_is = not getattr(table, f"{column}_unit").strip() and getattr(table, f"{column}_scale") == 1.0
            in_title = unit_of_title(title) if as_it_is else ""
            if not in_title:
                wrong = "value" if column == "argument" else "argument"
                if as_it_is and not unit and not is_time(title) and getattr(table, f"{wrong}_unit").strip():
                    self.values.note([f"{key}.{column}: {without_unit(column, [wrong])}"])
                continue
            if misfit := _misfit(in_title, unit):
                self.values.note([f"{key}.{column}: the title of the column {shown(title)} says {in_title}, {misfit}"])
            elif not is_in_si(in_title):
                note = f"the numbers of the column {shown(title)} are taken in SI, as they are"
                self.values.note([f'{key}.{column}: {note}; try: {column}_unit = "{in_title}"'])

    def scale(self, key: str, table: written.TableFile, column: str) -> float:
        """Return the factor on the column ``argument`` or ``value`` of a table: the factor of the unit times the scale
        of the entry. A scale that repeats the unit's factor is noted."""
        factor, unit = float(getattr(table, f"{column}_scale")), str(getattr(table, f"{column}_unit"))
        if not unit.strip():
            return factor
        size = unit_factor(f"{key}.{column}_unit", unit, self.report)
        if size == factor != 1.0:
            note = f"the column is multiplied by {size * factor:.6g}: by {factor:.6g} for its unit and once more"
            self.values.note([f"{key}.{column}_scale: {note}; the unit alone brings it to SI"])
        return factor * size

    def wave(self, key: str, name: str, wave: written.Wave) -> Curve:
        """Return a square, triangle or sawtooth as a periodic curve between two values; a period or duty out of range
        is reported, and gives a curve that is zero."""
        numbers = self.values.keys(key, wave, "period", "start", "duty", "low", "high")
        period, start, duty, low, high = numbers.values()
        if period <= 0.0:
            self.report.add(f"{key}.period", f"the period {period:.6g} is not positive [E1860]", "a period such as 0.5")
        if not (0.0 < duty < 1.0 or math.isnan(duty)):
            self.report.add(f"{key}.duty", f"the duty {duty:.6g} is not between 0 and 1 [E1861]", "0.5")
        if not (period > 0.0 and 0.0 < duty < 1.0):
            return _empty(name)
        end = start + period
        if wave.shape == "square":
            x, y = [start, start + duty * period, end], [high, low, high]
            return Curve(name, np.array(x), np.array(y), "steps", "periodic")
        if wave.shape == "triangle":
            x, y = [start, start + duty * period, end], [low, high, low]
        else:
            x, y = [start, end], [low, high]
        return Curve(name, np.array(x), np.array(y), "linear", "periodic")

    def bump(self, key: str, name: str, bump: written.BumpEntry) -> Bump:
        """Return a single bump."""
        numbers = self.values.keys(key, bump, "position", "length", "height")
        if (length := numbers["length"]) <= 0.0:  # NaN is reported on reading
            self.report.add(f"{key}.length", f"the length {length:.6g} is not positive [E1862]", "a length such as 0.5")
        return Bump(name, **numbers)

    def signal(self, key: str, entry: written.InputEntry) -> list[Formula]:
        """Return the table, points or wave of an input as a list of one formula, a curve at the time t; empty if the
        input has none of these. More than one is reported."""
        kinds = [kind for kind in ("table", "points", "wave") if getattr(entry, kind) is not None]
        if len(kinds) > 1:
            message = f"an input takes one of table, points, wave, not {' and '.join(kinds)} [E1863]"
            self.report.add(key, message, "a curve for each, and a formula")
        if not ({"table", "points"} & set(kinds)):
            self.refuse_options(key, entry, "an input without points or a table")
        if not kinds:
            return []
        if entry.wave is not None:
            return [Application(self.wave(f"{key}.wave", key, entry.wave), Symbol("time"))]
        return [Application(self.through_points(key, key, entry, ("s", entry.unit)), Symbol("time"))]

    def refuse_options(self, key: str, entry: written.ShapeEntry, kind: str) -> None:
        """Report the keys ``interpolation`` and ``outside`` in an entry without points; ``kind`` is the noun for the
        entry."""
        for option in ("interpolation", "outside"):
            if getattr(entry, option) is not None:
                message = f"{option} is for points and tables, not for {kind} [E1864]"
                self.report.add(f"{key}.{option}", message, "without it")

    def road(self, key: str, road: written.RoadEntry) -> tuple[Harmonic, ...] | Formula:
        """Return the height of a road under a wheel over time, m: harmonics for a road of a class at a fixed speed,
        else a formula; no harmonics after a fault, which is reported."""
        shapes = {"class": road.road_class, **{kind: getattr(road, kind) for kind in _ROADS}}
        kinds = [kind for kind, shape in shapes.items() if shape]
        if len(kinds) != 1:
            got = " and ".join(kinds) or "none"
            self.report.add(key, f"a road needs one of class, {', '.join(_ROADS)}, not {got} [E1865]", 'class = "C"')
        travelled = self.travel(key, road)
        if len(kinds) != 1 or travelled is None:
            return ()
        speed, offset = travelled
        if road.road_class is not None:
            self.refuse_options(key, road, "a class")
            at = {"seed": road.seed, "harmonics": road.harmonics}
            if isinstance(speed, float):
                return road_harmonics(road.road_class, speed, offset=offset, **at)
            curve: AnyCurve = Waves(key, road_harmonics(road.road_class, 1.0, **at))
        elif road.bump is not None:
            self.refuse_options(key, road, "a bump")
            curve = self.bump(f"{key}.bump", key, road.bump)
        else:
            curve = self.through_points(key, key, road, ("m", "m"))
        return Application(curve, speed * Symbol("time") - offset)

    def under_wheel(self, key: str, road: written.RoadEntry) -> RoadUnderWheel | None:
        """Return the data of a road of a class under a wheel at a fixed speed; None for another road."""
        travelled = None if road.road_class is None else self.travel(key, road)
        if road.road_class is None or travelled is None or not isinstance(travelled[0], float):
            return None
        return RoadUnderWheel(road.road_class, travelled[0], travelled[1], road.seed)

    def travel(self, key: str, road: written.RoadEntry) -> tuple[float | Formula, float] | None:
        """Return speed, m/s, a formula if tunable, and offset, m, of a wheel; None if one is unknown or out of range,
        which is reported."""
        formula = self.values.formula(f"{key}.speed", road.speed, PARAMETERS)
        speed, offset = self.values.value(formula), self.values.constant(f"{key}.offset", road.offset)
        if abs(offset) > FARTHEST:
            message = f"the offset {offset:.6g} m is beyond {FARTHEST:.0f} m, where phases lose their digits [E1866]"
            self.report.add(f"{key}.offset", message, "the distance in m by which this wheel follows the first")
        if not (0.0 < speed <= FASTEST and abs(offset) <= FARTHEST):
            return None
        return formula if self.values.is_tunable(formula) else speed, offset


def _is_within(path: Path, folder: Path) -> bool:
    """Return whether a file lies in a folder or below, with links resolved."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        return False


def _misfit(in_title: str, unit: str) -> str:
    """Return the end of a note if the unit in a title has another dimension than the expected ``unit``; empty for a
    unit that fits, without an expected unit, and for labels that are not units."""
    if not unit.strip() or in_title == unit.strip():
        return ""

    try:
        wanted = read_unit(unit)
        fault = unit_fault(in_title, read_unit(in_title), unit) if wanted else None
    except UnitError:  # a label that is not a unit
        return ""
    return "" if fault is None else f"and its numbers are taken in {unit}"


def _empty(name: str) -> Curve:
    return Curve(name, np.array([0.0, 1.0]), np.zeros(2), "linear", "hold")
