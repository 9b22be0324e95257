"""``Ensemble``: results of many runs, over time and sample by sample."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from eomgen.base.arrays import Array
from eomgen.base.files import make_folder, write_table, write_text
from eomgen.base.text import json_text, nearest, shown
from eomgen.compiled.arguments import count_of, numbers
from eomgen.errors import Problem, UsageError
from eomgen.products.ensembles.journal import Journal
from eomgen.products.ensembles.reductions import Reduction
from eomgen.products.ensembles.samples import EXTREMES, Failed
from eomgen.products.ensembles.sensitivity import Ranking, ranking
from eomgen.results.sample_errors import SampleErrors

#: Quantiles of the table over time and of the fan chart.
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
#: Deviations below this fraction of a result count as rounding.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Ensemble:
    """Results of many runs.

    Statistics over time are of the samples that did not fail; a sample that an event has stopped counts as long
    as it ran.

    Attributes
    ----------
    scene, method, design : names
    seed : of the design
    varied, columns : names of the varied quantities and of the results
    units : of both, by name
    t : (nt,) s
    asked, done : samples
    interrupted : whether Ctrl-C has ended it early
    seconds : the time that it took
    how : the way samples were run by this call, ``side by side: 4 lanes``, or ``one after the other:`` and why; empty
        if all were there
    notes : further notes
    error : estimated discretisation errors of the run without variations and of a few samples over the design
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
    journal: Journal = field(repr=False)
    how: str = ""
    notes: tuple[str, ...] = ()
    error: SampleErrors = field(default_factory=SampleErrors)

    def __repr__(self) -> str:
        return f"<Ensemble of {self.scene}: {self.done} of {self.asked} samples, {len(self.failed)} failed>"

    @property
    def failed(self) -> tuple[Failed, ...]:
        """The samples that failed, with their reasons and values."""
        return tuple(self.journal.failed)

    # -- over time -----------------------------------------------------------------------------------------------------

    def mean(self, column: str) -> Array:
        """Return means of a column, (nt,)."""
        place = self._place(column)
        return np.where(self.reduction.count[place] > 0, self.reduction.mean[place], np.nan)

    def deviation(self, column: str) -> Array:
        """Return standard deviations of a column, (nt,)."""
        return np.array(self.reduction.deviation[self._place(column)])

    def envelope(self, column: str) -> tuple[Array, Array]:
        """Return the smallest and the largest values of a column, (nt,) each."""
        place = self._place(column)
        there = self.reduction.count[place] > 0
        low, high = self.reduction.minimum[place], self.reduction.maximum[place]
        return np.where(there, low, np.nan), np.where(there, high, np.nan)

    def count(self, column: str) -> Array:
        """Return of how many samples a column is known, (nt,)."""
        return np.array(self.reduction.count[self._place(column)])

    @property
    def covariance(self) -> Array:
        """Covariances of the columns, (nt, columns, columns)."""
        return self.reduction.covariance

    def quantile(self, column: str, probability: ArrayLike) -> Array:
        """Return quantiles of a column, (nt,), or (n, nt) for n probabilities.

        Raises
        ------
        UsageError
            Probabilities outside 0 to 1; the package that sketches them is not installed.
        """
        wanted = numbers("quantile", probability)
        if wanted.ndim > 1 or not np.all((wanted >= 0.0) & (wanted <= 1.0)):
            raise UsageError(Problem("quantile", f"probabilities lie between 0 and 1, not {probability!r}", "0.95"))
        result = self.reduction.quantiles(self._place(column), np.atleast_1d(wanted))
        return result[0] if wanted.ndim == 0 else result

    def histogram(self, column: str, t: float, bins: int = 40) -> tuple[Array, Array]:
        """Return probabilities (bins,) and edges (bins + 1,) of a column at the recorded time next to t, s.

        Raises
        ------
        UsageError
            ``bins`` below 1; the package that sketches quantiles is not installed.
        """
        place, time = self._place(column), int(np.abs(self.t - t).argmin())
        low, high = (float(bound[time]) for bound in self.envelope(column))
        beyond = 1e-3 * (high - low) or 0.5 * max(abs(low), 1.0)
        edges = np.linspace(low - beyond, high + beyond, count_of("bins", bins) + 1)
        return self.reduction.histogram(place, time, edges), edges

    # -- sample by sample ----------------------------------------------------------------------------------------------

    @cached_property
    def values(self) -> dict[str, Array]:
        """Varied quantities, (done,) each, by name."""
        return {name: self._samples[0][:, k] for k, name in enumerate(self.varied)}

    @cached_property
    def results(self) -> dict[str, Array]:
        """The smallest, the largest and the final value of each column, (done,) each: ``output.tip.max``; NaN if the
        sample failed."""
        every = self._samples[1]
        return {
            f"{column}.{part}": every[:, k, i]
            for k, column in enumerate(self.columns)
            for i, part in enumerate(EXTREMES)
        }

    def sensitivity(self, result: str) -> Ranking:
        """Return the shares of the varied quantities in the variance of a result, such as ``output.tip.max``.

        Of the design ``saltelli`` these are Sobol' indices, of first order and total; of others squared coefficients of
        regression of ranks.

        Raises
        ------
        UsageError
            An unknown result; too few samples; a design ``saltelli`` with failed samples or not to its end.
        """
        if result not in self.results:
            raise UsageError(
                Problem("sensitivity", f"there is no result {shown(result)}", nearest(result, self.results))
            )
        values = self.results[result]
        found = ranking(self.design, self.asked, self.values, result, values)
        spread = float(np.nanstd(values))
        error = self.error.columns.get(result.rpartition(".")[0], math.nan)
        varies = spread > _ROUNDING * float(np.nanmax(np.abs(values)))
        return replace(found, error=error / spread if varies else math.nan)

    @cached_property
    def _samples(self) -> tuple[Array, Array]:
        return self.journal.samples(self.done, len(self.varied), len(self.columns))

    def _place(self, column: str) -> int:
        for name in (column, f"output.{column}"):
            if name in self.columns:
                return self.columns.index(name)
        raise UsageError(Problem("column", f"there is no column {shown(str(column))}", nearest(column, self.columns)))

    # -- files ---------------------------------------------------------------------------------------------------------

    @property
    def message(self) -> str:
        """Summary of the ensemble, in a sentence."""
        many = "samples" if self.asked > 1 else "sample"
        done = f"{self.done} {many}" if self.done == self.asked else f"{self.done} of {self.asked} {many}"
        failures = "all" if len(self.failed) == self.done > 1 else str(len(self.failed))
        failed = f", {failures} of which failed" if self.failed else ""
        ended = "; ended by Ctrl-C" if self.interrupted else ""
        return "; ".join(filter(None, (f"{done}{failed}{ended}", self.how, str(self.error), *self.notes)))

    def to_dict(self) -> dict[str, Any]:
        """Return the final summary of the ensemble, as JSON data."""
        last = {}
        for column in self.columns:
            low, high = self.envelope(column)
            place = {"mean": self.mean(column)[-1], "deviation": self.deviation(column)[-1]}
            place |= {"min": low[-1], "max": high[-1]}
            if self.reduction.has_quantiles:
                found = self.quantile(column, QUANTILES)[:, -1]
                place |= {f"quantile {p:g}": x for p, x in zip(QUANTILES, found.tolist(), strict=True)}
            last[column] = {name: float(value) for name, value in place.items()}
        return {
            "scene": self.scene,
            "method": self.method,
            "design": self.design,
            "seed": self.seed,
            "asked": self.asked,
            "done": self.done,
            "interrupted": self.interrupted,
            "failed": len(self.failed),
            "seconds": self.seconds,
            "how": self.how,
            "varied": list(self.varied),
            "units": self.units,
            "t_end": float(self.t[-1]),
            "final": last,
            "error": self.error.summary(),
            "notes": list(self.notes),
        }

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``statistics.csv`` over time, ``samples.csv``, ``failed.csv`` if some failed, and ``summary.json``.

        Raises
        ------
        FileError
            A file cannot be written.
        """
        target = make_folder(Path(folder))
        over_time: dict[str, Array] = {"t": self.t}
        for column in self.columns:
            low, high = self.envelope(column)
            own = {"count": self.count(column), "mean": self.mean(column), "deviation": self.deviation(column)}
            own |= {"min": low, "max": high}
            if self.reduction.has_quantiles:
                found = self.quantile(column, QUANTILES)
                own |= {f"q{100 * p:g}": row for p, row in zip(QUANTILES, found, strict=True)}
            over_time |= {f"{column}.{name}": values for name, values in own.items()}
        files = []
        for name, columns, numbered in (
            ("statistics.csv", over_time, ""),
            ("samples.csv", {**self.values, **self.results}, "sample"),
        ):
            write_table(target / name, list(columns), np.stack(list(columns.values()), axis=-1), numbered=numbered)
            files.append(target / name)
        if self.failed:
            lines = [",".join(("sample", *self.varied, "reason"))]
            for one in self.failed:
                reason = one.reason.replace('"', '""').replace("\n", "; ")
                lines.append(",".join((str(one.number), *(f"{x:.17g}" for x in one.values.values()), f'"{reason}"')))
            write_text(target / "failed.csv", "\n".join(lines) + "\n")
            files.append(target / "failed.csv")
        write_text(target / "summary.json", json_text(self.to_dict()) + "\n")
        return [*files, target / "summary.json"]

    def plot(self, folder: str | Path) -> list[Path]:
        """Draw the fan chart of all columns, results against varied quantities, and their ranking; PNG files."""
        from eomgen.products.ensembles.plots import draw  # noqa: PLC0415  # matplotlib comes with it

        return draw(self, make_folder(Path(folder)))
