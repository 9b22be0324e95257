"""Rainflow counts of columns of a solution (ASTM E1049-85, 5.4.4), with damage by a Woehler curve and Miner's rule; the
package rainflow counts."""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array, count_of
from eomgen.base.calls import checked_calls
from eomgen.base.csv_tables import write_table
from eomgen.base.data import dataclass
from eomgen.base.figures import axes_of_caller, axis_label, draw_grid
from eomgen.base.html import page, table
from eomgen.base.messages import shown
from eomgen.base.products import optional_package
from eomgen.errors import Problem, UsageError
from eomgen.results.plots import only_curve, rows_from
from eomgen.results.recorded import RecordedSolution


@checked_calls()
@dataclass(frozen=True, repr=False, eq=False)
class Rainflow:
    """Cycles of one quantity, the largest range first.

    Attributes
    ----------
    name, unit : of the quantity; an empty unit is not known
    duration : s, of the counted part of the run
    ranges : (n,) in ``unit``; twice the amplitude
    means : (n,) in ``unit``
    counts : (n,) 1 for a closed cycle, 0.5 for half a cycle of the remaining history
    starts, ends : (n,) s, times of the two reversals
    """

    name: str
    unit: str
    duration: float
    ranges: Array
    means: Array
    counts: Array
    starts: Array
    ends: Array

    @property
    def headings(self) -> tuple[str, ...]:
        """Headings of ``rows`` and names of the columns of ``save``."""
        unit = f" [{self.unit}]" if self.unit not in ("", "1") else ""
        return (f"range{unit}", f"mean{unit}", "count", "start [s]", "end [s]")

    @property
    def rows(self) -> list[tuple[str, ...]]:
        """The cycles as texts."""
        return [tuple(f"{value:.6g}" for value in row) for row in self._table]

    @property
    def _table(self) -> Array:
        return np.column_stack([self.ranges, self.means, self.counts, self.starts, self.ends])

    def __repr__(self) -> str:
        largest = f"largest range {self.ranges[0]:.6g} {self.unit}".rstrip() if len(self.ranges) else "no cycle"
        return f"<Rainflow of {self.name}: {np.sum(self.counts):g} cycles in {self.duration:.6g} s; {largest}>"

    def _repr_html_(self) -> str:
        return page(f"Rainflow count of {self.name}, {self.duration:.6g} s", table(self.headings, self.rows))

    def damage(
        self, slope: float, reference_range: float, reference_cycles: float = 2e6, slope_below: float | None = None
    ) -> float:
        """Return the damage of the counted time by Miner's rule, 1 at failure.

        The Woehler curve is N = reference_cycles (range / reference_range)^-slope. Means have no influence; ranges
        between rows of the run are not resolved.

        Parameters
        ----------
        slope : float
            Exponent of the Woehler curve: 3 to 5 for welded steel, about 10 for composites.
        reference_range : float
            Range of a point of the curve, in ``unit``; the curve may have its knee there.
        reference_cycles : float
            Cycles to failure at this range.
        slope_below : float, optional
            Exponent below the reference range: ``slope`` by default, ``2 * slope - 1`` by Haibach, ``math.inf`` for an
            endurance limit.

        Returns
        -------
        float
            Sum of counts over cycles to failure.

        Raises
        ------
        UsageError
            A number that is not positive, a slope below 1, a second slope below the first.

        Examples
        --------
        >>> run = eomgen.build("examples/quarter_car/scene.toml").simulate(5.0, 2e-3, error_estimate=False)
        >>> bool(run.rainflow("suspension_travel").damage(slope=5, reference_range=0.1) < 1.0)
        True
        """
        below = slope if slope_below is None else slope_below
        _check_positive(slope=slope, reference_range=reference_range, reference_cycles=reference_cycles)
        _check_slope(slope)
        if below != math.inf:
            _check_positive(slope_below=below)
        if below < slope:
            fault = f"{below:.6g} is smaller than slope {slope:.6g}"
            fault = f"{fault}, and small ranges would damage more than large ones [E1275]"
            raise UsageError(Problem("slope_below", fault, f"slope={below:.6g}, slope_below={slope:.6g}"))
        relative = self.ranges / reference_range
        exponents = np.where(relative < 1.0, below, slope)
        return float(self.counts @ relative**exponents) / reference_cycles

    def equivalent_range(self, slope: float, frequency: float = 1.0) -> float:
        """Return the damage-equivalent load: the constant range in ``unit`` with the same damage.

        Parameters
        ----------
        slope : float
            Exponent of the Woehler curve.
        frequency : float
            Hz, of the cycles of constant range over the counted time; 1 Hz is common for wind turbines.

        Returns
        -------
        float
            (sum of count range^slope / (frequency duration))^(1 / slope); 0 without a cycle.

        Raises
        ------
        UsageError
            A number that is not positive, a slope below 1.

        Examples
        --------
        >>> run = eomgen.build("examples/quarter_car/scene.toml").simulate(5.0, 2e-3, error_estimate=False)
        >>> bool(run.rainflow("suspension_travel").equivalent_range(slope=5) > 0.0)
        True
        """
        _check_positive(slope=slope, frequency=frequency)
        _check_slope(slope)
        if not len(self.ranges):
            return 0.0
        largest = float(self.ranges[0])  # in front of the powers, which overflow otherwise
        total = float(self.counts @ (self.ranges / largest) ** slope)
        return float(largest * (total / (frequency * self.duration)) ** (1.0 / slope))

    def histogram(self, bins: int = 20) -> tuple[Array, Array]:
        """Return the cycles by classes of equal width from zero to the largest range.

        Parameters
        ----------
        bins : int
            Number of classes.

        Returns
        -------
        edges : (bins + 1,) ndarray
            Of the classes, in ``unit``.
        counts : (bins,) ndarray
            Cycles in each class; half a cycle counts 0.5. Without a cycle the classes end at 1, and all counts are 0.

        Raises
        ------
        UsageError
            A number of classes below 1, or no whole number.

        Examples
        --------
        >>> run = eomgen.build("examples/quarter_car/scene.toml").simulate(5.0, 2e-3, error_estimate=False)
        >>> edges, counts = run.rainflow("suspension_travel").histogram(bins=10)
        >>> len(edges), len(counts)
        (11, 10)
        """
        bins = count_of("bins", bins)
        largest = float(self.ranges[0]) if len(self.ranges) else 1.0
        counts, edges = np.histogram(self.ranges, bins, (0.0, largest), weights=self.counts)
        return edges, np.asarray(counts, dtype=float)

    def save(self, path: str | Path) -> Path:
        """Write the cycles as a ``.csv`` table: range, mean, count, start, end.

        Parameters
        ----------
        path : str or Path
            File to write, ``.csv``; an existing file is replaced.

        Returns
        -------
        Path
            The written file.

        Raises
        ------
        UsageError
            Another ending.
        FileError
            The path cannot be written.
        """
        path = Path(path)
        if path.suffix != ".csv":
            kind = path.suffix or "a file without a suffix"
            raise UsageError(Problem(str(path), f"a rainflow count cannot be saved as {kind} [E1278]", ".csv"))
        write_table(path, self.headings, self._table)
        return path

    def plot(self, axes: object = None, label: str | None = None) -> list[Any]:
        """Draw the ranges over the number of cycles that reach them, a logarithmic axis; return matplotlib's axes.

        Parameters
        ----------
        axes : matplotlib Axes
            A new figure of pyplot if none are given; several counts may go onto the same axes.
        label : str
            For a legend, which is drawn only with a label.

        Returns
        -------
        list of matplotlib Axes
            One element, the axes drawn on.

        Raises
        ------
        UsageError
            An object that is not axes, or more than one.
        """
        drawn = axes_of_caller("plot", axes, [f"rainflow count of {self.name}"], (7.4, 4.6))
        axis = drawn[0]
        reached = np.cumsum(self.counts)
        first = reached[:1] / 2.0
        axis.step(np.concatenate([first, reached]), np.concatenate([self.ranges[:1], self.ranges]), lw=1.5, label=label)
        axis.set_xscale("log")
        axis.set_ylim(bottom=0.0)
        axis.set_xlabel("cycles of this range and above")
        axis.set_ylabel(axis_label("range", self.unit))
        axis.set_title(f"{self.name}; rainflow count of {self.duration:.6g} s", fontsize=10, loc="left")
        draw_grid(axis, which="both")
        if label is not None:
            axis.legend(fontsize=9, frameon=False)
        return drawn


def _check_positive(**values: float) -> None:
    for name, value in values.items():
        if not (isinstance(value, int | float) and 0.0 < value < math.inf):
            raise UsageError(Problem(name, f"{shown(value)} is not a positive number [E1279]", f"{name}=5"))


def _check_slope(slope: float) -> None:
    if slope < 1.0:
        fault = f"{shown(slope)} is below 1, and exponents of Woehler curves are 3 to 15 [E1280]"
        raise UsageError(Problem("slope", fault, f"slope={1.0 / slope:.3g}, the inverse, or 3 to 5 for welded steel"))


def _warn_of_coarse_rows(name: str, t: Array, x: Array) -> None:
    """Warn (RuntimeWarning) if the column x (rows,) of the name reverses every two rows or sooner: extreme values lie
    between rows."""
    changed = np.flatnonzero(np.diff(x))
    up = np.diff(x)[changed] > 0.0
    reversals = changed[1:][up[1:] != up[:-1]]
    rows = np.diff(reversals)[np.abs(np.diff(x[reversals])) >= 0.2 * np.ptp(x)]
    if len(rows) < 8 or np.mean(rows) > 2.0:
        return
    text = f"rainflow of {name}: rows every {np.median(np.diff(t)):.4g} s, {np.mean(rows):.2g} between two reversals:"
    text += " extreme values lie between the rows, so that ranges are too small and cycles may be missing"
    warnings.warn(f"{text}; try: record_every=1, or a smaller step [W0095]", RuntimeWarning, stacklevel=4)


def rainflow(solution: RecordedSolution, name: str, *, start: float | None = None) -> Rainflow:
    """Count the cycles of a column by the rainflow method of ASTM E1049-85, for damage and damage-equivalent loads.

    Reversals are rows: at 20 rows for each period of an oscillation its range is at most 1.3 % too small. The count
    is made by the package ``rainflow``, the extra ``fatigue``.

    Parameters
    ----------
    name : str
        Column by name: ``"root_moment"``, ``"tip[2]"``.
    start : float
        Rows before this time in s are left out, for a motion that has to settle first.

    Returns
    -------
    Rainflow
        Ranges, means and counts of the cycles, with ``damage``, ``equivalent_range``, ``histogram``, ``plot`` and
        ``save``.

    Raises
    ------
    UsageError
        ``rainflow`` is not installed; no column or more than one of that name; too few rows.

    Examples
    --------
    >>> model = eomgen.build("examples/quarter_car/scene.toml")
    >>> count = model.simulate(4.0, 1e-2).rainflow("body_acceleration")
    >>> 0.0 < count.equivalent_range(slope=5) < 10.0
    True
    """
    curve = only_curve(solution, name, "rainflow")
    used = rows_from(solution.t, start, "rainflow")
    t, x = solution.t[used], curve.values[used]
    if len(t) < 3:
        since = f" from {start:.6g} s on" if start is not None else ""
        fault = f"the run has {len(t)} rows{since}, and a cycle needs 3 [E1281]"
        raise UsageError(Problem("rainflow", fault, "a longer run, or one with more rows"))
    if not np.all(np.isfinite(x)):
        fault = f"{curve.name} is not finite at t = {t[np.argmin(np.isfinite(x))]:.6g} s [E1282]"
        raise UsageError(Problem("rainflow", fault, "the part of the run before it"))
    _warn_of_coarse_rows(curve.name, t, x)
    fault = "cycles are counted by the package rainflow, which is not installed [E1283]"
    package: Any = optional_package("rainflow", Problem("rainflow", fault, "pip install 'eomgen[fatigue]'"))
    cycles = [cycle for cycle in package.extract_cycles(x.tolist()) if cycle[0] > 0.0]
    numbers = np.array(sorted(cycles, key=lambda cycle: -cycle[0]), dtype=float).reshape(-1, 5)
    ranges, means, counts, first, last = numbers.T
    starts, ends = t[first.astype(int)], t[last.astype(int)]
    return Rainflow(curve.name, curve.unit, float(t[-1] - t[0]), ranges, means, counts, starts, ends)
