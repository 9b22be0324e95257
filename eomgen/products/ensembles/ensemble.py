"""``Ensemble``: results of many runs, over time and sample by sample, with their tables and plots."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array, count_of
from eomgen.base.csv_tables import write_table
from eomgen.base.data import dataclass, field, replace
from eomgen.base.figures import axis_label, new_figure, save_figure
from eomgen.base.files import make_folder, write_text
from eomgen.base.json_text import json_text
from eomgen.base.messages import nearest, shown
from eomgen.base.rounding import COMPUTED
from eomgen.compiled.arguments import number_of, numbers
from eomgen.errors import Problem, UsageError
from eomgen.products.ensembles.discretisation import EnsembleJudgement
from eomgen.products.ensembles.journal import BlockJournal
from eomgen.products.ensembles.samples import EXTREMES, FailedSample
from eomgen.products.ensembles.statistics import Ranking, Reduction, ranking
from eomgen.results.error_estimate import NOTICED, SampleErrors

_COLOUR = "#0B62C4"
#: Bands by lower and upper probabilities, with opacity.
_BANDS = ((0.05, 0.95, 0.18), (0.25, 0.75, 0.32))
#: A number in a reason; names of elements may end with digits.
_NUMBER = re.compile(r"(?<![\w.])-?\d[\d.]*(?:e[+-]?\d+)?")
#: Quantiles of the table over time and of the fan chart.
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Results of many runs.

    Statistics over time are of the successful samples; a sample that an event has stopped counts until the event.

    Attributes
    ----------
    scene, method, design : names
    seed : of the design
    varied, columns : names of the varied quantities and of the results
    units : of both, by name
    t : (nt,) s
    asked, done : samples
    interrupted : whether Ctrl-C has ended the ensemble early
    seconds : duration of the ensemble
    how : the way samples were run by this call, ``side by side: 4 lanes``, or ``one after the other:`` and the reason;
        empty if all samples were read from the folder
    judgement : estimated errors and notes, on demand
    """

    scene: str
    method: str
    design: str
    seed: int
    varied: tuple[str, ...]
    columns: tuple[str, ...]
    units: dict[str, str]
    t: Array
    asked: int
    done: int
    interrupted: bool
    seconds: float
    reduction: Reduction = field(repr=False)
    journal: BlockJournal = field(repr=False)
    judgement: EnsembleJudgement = field(repr=False)
    how: str = ""

    @property
    def notes(self) -> tuple[str, ...]:
        """Further notes."""
        return self.judgement.notes

    @property
    def error(self) -> SampleErrors:
        """Estimated discretisation errors of the run without variations and of a few samples over the design; the runs
        for them are made when they are read for the first time."""
        return self.judgement.error

    def __repr__(self) -> str:
        return f"<Ensemble of {self.scene}: {self.done} of {self.asked} samples, {len(self.failed)} failed>"

    @property
    def failed(self) -> tuple[FailedSample, ...]:
        """The failed samples, with reasons and values."""
        return tuple(self.journal.failed)

    # -- over time -----------------------------------------------------------------------------------------------------

    def mean(self, column: str) -> Array:
        """Return the mean of a column over the samples, at each time.

        Failed samples are left out, and a sample that an event has stopped counts until the event.

        Parameters
        ----------
        column : str
            Name, as in ``columns``; of an output also without ``output.``.

        Returns
        -------
        (nt,) ndarray
            At the times ``t``, in the column's unit; NaN at a time that no sample reaches.

        Raises
        ------
        UsageError
            An unknown column.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> many = model.simulate_many(0.5, 2e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1)
        >>> many.mean("tyre_load").shape == many.t.shape
        True
        """
        index = self._place(column)
        return np.where(self.reduction.count[index] > 0, self.reduction.mean[index], np.nan)

    def deviation(self, column: str) -> Array:
        """Return the standard deviation of a column over time.

        Parameters
        ----------
        column : str
            Name, as in ``columns``.

        Returns
        -------
        (nt,) ndarray
            Of the times ``t``, in the column's unit.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> many = model.simulate_many(0.5, 2e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1)
        >>> float(many.deviation("tyre_load")[0])          # all samples start from the same state
        0.0
        """
        return np.array(self.reduction.deviation[self._place(column)])

    def envelope(self, column: str) -> tuple[Array, Array]:
        """Return the smallest and the largest value of a column among the samples, at each time.

        Failed samples are left out, and a sample that an event has stopped counts until the event.

        Parameters
        ----------
        column : str
            Name, as in ``columns``; of an output also without ``output.``. UsageError for an unknown column.

        Returns
        -------
        smallest, largest : (nt,) ndarray
            At the times ``t``, in the column's unit; NaN at a time that no sample reaches.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> many = model.simulate_many(0.5, 2e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1)
        >>> smallest, largest = many.envelope("tyre_load")
        >>> bool(np.all(smallest <= many.mean("tyre_load")))
        True
        """
        index = self._place(column)
        there = self.reduction.count[index] > 0
        low, high = self.reduction.minimum[index], self.reduction.maximum[index]
        return np.where(there, low, np.nan), np.where(there, high, np.nan)

    def count(self, column: str) -> Array:
        """Return the number of samples of which a column is known, over time.

        Parameters
        ----------
        column : str
            Name, as in ``columns``.

        Returns
        -------
        (nt,) ndarray
            Of the times ``t``.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> many = model.simulate_many(0.5, 2e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1)
        >>> int(many.count("tyre_load")[-1])
        8
        """
        return np.array(self.reduction.count[self._place(column)])

    @property
    def covariance(self) -> Array:
        """Covariances of the columns, (nt, columns, columns)."""
        return self.reduction.covariance

    def quantile(self, column: str, probability: ArrayLike) -> Array:
        """Return quantiles of a column over the samples, at each time.

        Quantiles are interpolated linearly between the sorted values of the samples, or approximate, by 512 centroids
        at each time, if the ensemble has more than 16 million numbers (samples x columns x times). Failed samples are
        left out, and a sample that an event has stopped counts until the event.

        Parameters
        ----------
        column : str
            Name, as in ``columns``; of an output also without ``output.``.
        probability : array_like
            One probability, or (n,), from 0 to 1.

        Returns
        -------
        (nt,) or (n, nt) ndarray
            At the times ``t``, in the column's unit; NaN at a time that no sample reaches.

        Raises
        ------
        UsageError
            An unknown column, or probabilities outside 0 to 1.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> many = model.simulate_many(0.5, 2e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1)
        >>> many.quantile("tyre_load", [0.05, 0.95]).shape[0]
        2
        """
        wanted = numbers("quantile", probability)
        if wanted.ndim > 1 or not np.all((wanted >= 0.0) & (wanted <= 1.0)):
            fault = f"probabilities lie between 0 and 1, not {probability!r} [E0667]"
            raise UsageError(Problem("quantile", fault, "0.95"))
        result = self.reduction.quantiles(self._place(column), np.atleast_1d(wanted))
        return result[0] if wanted.ndim == 0 else result

    def histogram(self, column: str, t: float, bins: int = 40) -> tuple[Array, Array]:
        """Return the distribution of a column over the samples at one time, as a histogram with classes of equal width.

        Parameters
        ----------
        column : str
            Name, as in ``columns``; of an output also without ``output.``.
        t : float
            Time, s; the nearest of the times ``t`` is taken, the first or the last for a time beyond the run.
        bins : int, optional
            Number of classes.

        Returns
        -------
        probabilities : (bins,) ndarray
            Share in each class of the samples that reach this time, with the sum 1, approximate if ``quantile`` is;
            NaN, as the edges, if no sample reaches this time.
        edges : (bins + 1,) ndarray
            Of the classes, in the column's unit, from just below the smallest to just above the largest value; of equal
            values, half the absolute value, or 0.5 if larger, to each side.

        Raises
        ------
        UsageError
            An unknown column, a time that is not a finite number, or ``bins`` that are not a whole number from 1 on.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> many = model.simulate_many(0.5, 2e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1)
        >>> probabilities, edges = many.histogram("tyre_load", t=0.5, bins=4)
        >>> round(float(probabilities.sum()), 6), len(edges)
        (1.0, 5)
        """
        index, time = self._place(column), int(np.abs(self.t - number_of("t", t)).argmin())
        low, high = (float(bound[time]) for bound in self.envelope(column))
        beyond = 1e-3 * (high - low) or 0.5 * max(abs(low), 1.0)
        edges = np.linspace(low - beyond, high + beyond, count_of("bins", bins) + 1)
        return self.reduction.histogram(index, time, edges), edges

    # -- sample by sample ----------------------------------------------------------------------------------------------

    @cached_property
    def values(self) -> dict[str, Array]:
        """Varied quantities, (done,) each, by name."""
        return {name: self._samples[0][:, k] for k, name in enumerate(self.varied)}

    @cached_property
    def results(self) -> dict[str, Array]:
        """The smallest, the largest and the final value of each column, (done,) each: ``output.tip.max``; NaN if the
        sample failed."""
        names = [f"{column}.{part}" for column in self.columns for part in EXTREMES]
        return dict(zip(names, self._samples[1].reshape(self.done, len(names)).T, strict=True))

    def sensitivity(self, result: str) -> Ranking:
        """Return the shares of the varied quantities in the variance of a result, such as ``output.tip.max``.

        For the design ``saltelli`` these are Sobol' indices, of first order and total; for other designs squared
        coefficients of regression of ranks. The first call makes the runs of ``error``.

        Parameters
        ----------
        result : str
            Name of a result of each sample, as in ``results``: a column with ``.min``, ``.max`` or ``.final``.

        Returns
        -------
        Ranking
            Shares by varied quantity, the largest first; of Sobol' indices the largest total index.

        Raises
        ------
        UsageError
            An unknown result; a design ``saltelli`` with failed samples or not to the end; for other designs fewer than
            8 successful samples for each quantity that varies in them.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> vary = {"damper": "uniform(800, 1200)", "v.body": "uniform(-0.2, 0.2)"}
        >>> many = model.simulate_many(0.5, 2e-3, vary=vary, samples=16, seed=1)
        >>> sorted(many.sensitivity("output.tyre_load.max").first)
        ['damper', 'v.body']
        """
        if result not in self.results:
            fault = f"there is no result {shown(result)} [E0668]"
            raise UsageError(Problem("sensitivity", fault, nearest(result, self.results)))
        values = self.results[result]
        shares = ranking(self.design, self.asked, self.values, result, values)
        spread = float(np.nanstd(values))
        error = self.error.columns.get(result.rpartition(".")[0], math.nan)
        varies = spread > COMPUTED * float(np.nanmax(np.abs(values)))
        return replace(shares, error=error / spread if varies else math.nan)

    @cached_property
    def _samples(self) -> tuple[Array, Array]:
        return self.journal.samples(self.done, len(self.varied), len(self.columns))

    def _place(self, column: str) -> int:
        for name in (column, f"output.{column}"):
            if name in self.columns:
                return self.columns.index(name)
        fault = f"there is no column {shown(str(column))} [E0669]"
        raise UsageError(Problem("column", fault, nearest(column, self.columns)))

    # -- files ---------------------------------------------------------------------------------------------------------

    @property
    def message(self) -> str:
        """Summary of the ensemble as one text: numbers of samples and failures, with the most frequent reason, the way
        of running, estimated error and notes. The first reading makes the runs of ``error``."""
        many = "samples" if self.asked > 1 else "sample"
        done = f"{self.done} {many}" if self.done == self.asked else f"{self.done} of {self.asked} {many}"
        failures = "all" if len(self.failed) == self.done > 1 else str(len(self.failed))
        failed = f", {failures} of which failed ({_most_frequent(self.failed)})" if self.failed else ""
        ended = "; ended by Ctrl-C" if self.interrupted else ""
        return "; ".join(filter(None, (f"{done}{failed}{ended}", self.how, str(self.error), *self.notes)))

    def _statistics(self, column: str, name_of: Callable[[float], str]) -> dict[str, Array]:
        """Return mean, deviation, envelope and quantiles of a column over time, by the names in files; `name_of` names
        a quantile by its probability."""
        low, high = self.envelope(column)
        moments = {"mean": self.mean(column), "deviation": self.deviation(column), "min": low, "max": high}
        return moments | dict(zip(map(name_of, QUANTILES), self.quantile(column, QUANTILES), strict=True))

    def to_dict(self) -> dict[str, Any]:
        """Return the summary of the ensemble as JSON data. The first call makes the runs of ``error``.

        Returns
        -------
        dict
            ``scene``, ``method``, ``design``, ``seed``, ``asked``, ``done``, ``interrupted``, the number ``failed``,
            ``seconds``, ``how``, ``varied``, ``units``, ``t_end``, ``error``, ``notes``, and ``final``: by column
            ``mean``, ``deviation``, ``min``, ``max`` and ``quantile 0.05`` to ``quantile 0.95`` over the samples at the
            last time, which may be NaN.
        """
        of_columns = {column: self._statistics(column, "quantile {:g}".format) for column in self.columns}
        attributes = ("scene", "method", "design", "seed", "asked", "done", "interrupted", "seconds", "how", "units")
        return {
            **{name: getattr(self, name) for name in attributes},
            "failed": len(self.failed),
            "varied": list(self.varied),
            "t_end": float(self.t[-1]),
            "final": {
                column: {name: float(values[-1]) for name, values in statistics.items()}
                for column, statistics in of_columns.items()
            },
            "error": self.error.summary(),
            "notes": list(self.notes),
        }

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``statistics.csv`` over time, ``samples.csv``, ``failed.csv`` if some failed, and ``summary.json``.

        ``statistics.csv`` has ``t`` and by column the count, mean, deviation, smallest and largest value and quantiles
        0.05 to 0.95; ``samples.csv`` has ``values`` and ``results``; ``summary.json`` has ``to_dict``, null for NaN.
        Existing files of these names are replaced, but without failures an earlier ``failed.csv`` stays. The first call
        makes the runs of ``error``.

        Parameters
        ----------
        folder : str or Path
            Folder to write to, which is made if missing.

        Returns
        -------
        list of Path
            The written files, in the order above.

        Raises
        ------
        FileError
            A file cannot be written, or the folder cannot be made.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> many = model.simulate_many(0.5, 2e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1)
        >>> [path.name for path in many.save("cars")]
        ['statistics.csv', 'samples.csv', 'summary.json']
        """
        target = make_folder(Path(folder))
        over_time: dict[str, Array] = {"t": self.t}
        for column in self.columns:
            statistics = {"count": self.count(column), **self._statistics(column, lambda p: f"q{100 * p:g}")}
            over_time |= {f"{column}.{name}": values for name, values in statistics.items()}
        files = []
        for name, columns, numbered in (
            ("statistics.csv", over_time, ""),
            ("samples.csv", {**self.values, **self.results}, "sample"),
        ):
            write_table(target / name, list(columns), np.stack(list(columns.values()), axis=-1), numbered=numbered)
            files.append(target / name)
        if self.failed:
            lines = [",".join(("sample", *self.varied, "reason"))]
            for sample in self.failed:
                reason = sample.reason.replace('"', '""').replace("\n", "; ")
                lines.append(
                    ",".join((str(sample.number), *(f"{x:.17g}" for x in sample.values.values()), f'"{reason}"'))
                )
            write_text(target / "failed.csv", "\n".join(lines) + "\n")
            files.append(target / "failed.csv")
        elif (target / "failed.csv").is_file():
            (target / "failed.csv").unlink()
        write_text(target / "summary.json", json_text(self.to_dict()) + "\n")
        return [*files, target / "summary.json"]

    def plot(self, folder: str | Path) -> list[Path]:
        """Draw the fan chart of the columns, the largest values against varied quantities, and the ranking.

        ``fan.png`` shows up to 12 columns, ``scatter.png`` and ``sensitivity.png`` the largest values of up to 6.
        Without varied quantities there is ``fan.png`` alone, with too few samples for a ranking no ``sensitivity.png``.
        Existing files are replaced.

        Parameters
        ----------
        folder : str or Path
            Folder to write to, which is made if missing.

        Returns
        -------
        list of Path
            The PNG files; none if no sample succeeded.

        Raises
        ------
        FileError
            A file cannot be written, or the folder cannot be made.

        Examples
        --------
        >>> model = eomgen.build("examples/quarter_car/scene.toml")
        >>> many = model.simulate_many(0.5, 2e-3, vary={"damper": "uniform(800, 1200)"}, samples=8, seed=1)
        >>> sorted(path.suffix for path in many.plot("cars"))[0]
        '.png'
        """

        target = make_folder(Path(folder))
        if self.done == len(self.failed):
            return []
        files = [save_figure(_fans(self), target / "fan.png")]
        if self.varied:
            files.append(save_figure(_scatter(self), target / "scatter.png"))
            if (figure := _rankings(self)) is not None:
                files.append(save_figure(figure, target / "sensitivity.png"))
        return files


def _most_frequent(failed: Iterable[FailedSample]) -> str:
    """Return number of samples, first sample and cause of the most frequent reason; reasons may differ in numbers."""
    alike: dict[str, list[tuple[int, str]]] = {}
    for sample in failed:
        cause = sample.reason.partition("; ")[0]
        alike.setdefault(_NUMBER.sub("", cause), []).append((sample.number, cause))
    most = max(alike.values(), key=len)
    return f"{len(most)} as sample {most[0][0]}: {most[0][1]}"


def _fans(ensemble: Ensemble) -> Any:
    """Return a figure with a panel for each column over time: mean, median, bands of quantiles, and envelope."""
    columns = ensemble.columns[:12]
    figure = new_figure((8.0, 0.6 + 2.6 * len(columns)))
    panels = figure.subplots(len(columns), 1, sharex=True, squeeze=False)[:, 0]
    for axes, column in zip(panels, columns, strict=True):
        low, high = ensemble.envelope(column)
        axes.fill_between(ensemble.t, low, high, color="#888888", alpha=0.18, linewidth=0, label="smallest to largest")
        for first, last, opacity in _BANDS:
            bounds = ensemble.quantile(column, (first, last))
            label = f"{100 * first:g} to {100 * last:g} %"
            axes.fill_between(ensemble.t, *bounds, color=_COLOUR, alpha=opacity, linewidth=0, label=label)
        axes.plot(ensemble.t, ensemble.quantile(column, 0.5), color=_COLOUR, linewidth=1.6, label="median")
        axes.plot(ensemble.t, ensemble.mean(column), color="#222222", linewidth=1.0, linestyle="--", label="mean")
        axes.set_ylabel(_label(ensemble, column))
        axes.grid(alpha=0.3)
        axes.margins(x=0.0)
    panels[-1].set_xlabel("time, s")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", fontsize="small", ncols=5)
    left = len(ensemble.columns) - len(columns)
    more = f"; {left} more columns in statistics.csv" if left else ""
    count = ensemble.done - len(ensemble.failed)
    figure.suptitle(f"{ensemble.scene}: {count} samples, {ensemble.design}{more}", fontsize="medium")
    return figure


def _scatter(ensemble: Ensemble) -> Any:
    """Return a figure of the largest values of columns against varied quantities, a panel for each pair."""
    results = _drawn_results(ensemble)
    varied = ensemble.varied[:12]
    figure = new_figure((0.8 + 2.9 * max(len(varied), 2), 0.6 + 2.5 * len(results)))
    grid = figure.subplots(len(results), len(varied), sharex="col", sharey="row", squeeze=False)
    stride = -(-ensemble.done // 5000)
    for row, result in zip(grid, results, strict=True):
        values = ensemble.results[result][::stride]
        for axes, name in zip(row, varied, strict=True):
            axes.plot(ensemble.values[name][::stride], values, ".", markersize=3, alpha=0.6, color=_COLOUR)
            axes.grid(alpha=0.3)
        row[0].set_ylabel(_label(ensemble, result))
    for axes, name in zip(grid[-1], varied, strict=True):
        axes.set_xlabel(_label(ensemble, name))
    thinned = f", one sample of each {stride}" if stride > 1 else ""
    figure.suptitle(f"{ensemble.scene}: results against varied quantities{thinned}", fontsize="medium")
    return figure


def _rankings(ensemble: Ensemble) -> Any | None:
    """Return a figure of the shares of varied quantities in variances of results; None if there are too few samples."""
    rankings = []
    for result in _drawn_results(ensemble):
        try:
            rankings.append(ensemble.sensitivity(result))
        except UsageError:
            continue
    if not rankings:
        return None
    height = 0.35 * len(ensemble.varied) + 0.9
    figure = new_figure((7.5, 0.5 + height * len(rankings)))
    panels = figure.subplots(len(rankings), 1, sharex=True, squeeze=False)[:, 0]
    for axes, shares in zip(panels, rankings, strict=True):
        names = list(shares.total)[::-1]
        places = np.arange(len(names))
        if shares.total is not shares.first:
            axes.barh(places, [shares.total[name] for name in names], color="#A9C6E8", label="with interactions")
        for shift, bounds in ((0.12, shares.total_interval), (-0.12, shares.first_interval)):
            if bounds:
                low, high = np.array([bounds[name] for name in names]).T
                axes.hlines(places + shift, low, high, color="black", linewidth=1.0)
        axes.barh(places, [shares.first[name] for name in names], color=_COLOUR, height=0.5, label="by itself")
        axes.set_yticks(places, names)
        error = f", errors of steps up to {100 * shares.error:.2g} % of its deviation"
        axes.set_title(shares.result + (error if shares.error > NOTICED else ""), fontsize="small", loc="left")
        axes.grid(alpha=0.3, axis="x")
    panels[-1].set_xlabel(f"share of the variance ({rankings[0].kind})")
    panels[-1].set_xlim(left=min(0.0, panels[-1].get_xlim()[0]))
    panels[0].legend(loc="lower right", fontsize="small")
    return figure


def _drawn_results(ensemble: Ensemble) -> list[str]:
    """Return the results that are drawn: the largest values of the first six columns."""
    return [f"{column}.{EXTREMES[1]}" for column in ensemble.columns[:6]]


def _label(ensemble: Ensemble, name: str) -> str:
    column, _, part = name.rpartition(".")
    known = name if name in ensemble.units else column if part in EXTREMES else name
    unit = ensemble.units.get(known, "")
    return axis_label(name.removeprefix("output."), unit)
