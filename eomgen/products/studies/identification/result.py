"""Result of an identification: estimates with intervals, undetermined combinations, residuals; files and plots."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.arrays import Array
from eomgen.base.calls import NamedResults
from eomgen.base.csv_tables import write_rows, write_table
from eomgen.base.data import dataclass
from eomgen.base.figures import axis_label, new_figure, save_figure
from eomgen.base.files import make_folder, write_text
from eomgen.base.json_text import json_text
from eomgen.products.studies.identification.estimation import Combination


@dataclass(frozen=True)
class Estimate:
    """Estimate of one unknown parameter or component of an initial state.

    Attributes
    ----------
    name, unit : names; a component of an initial state is ``q.hinge``, of several runs ``q.hinge of run1``
    value, deviation : estimate and standard deviation, infinite if the data do not determine the unknown
    low, high : confidence interval, infinite likewise
    bias : change by the steps of the runs, estimated by runs at half of these steps; nan if such runs fail
    start : start of the search
    state : ``determined``, ``undetermined``, or ``on its bound``, with an interval due to the bound alone
    """

    name: str
    unit: str
    value: float
    deviation: float
    low: float
    high: float
    bias: float
    start: float
    state: str


@dataclass(frozen=True)
class Column:
    """Statistics of a measured column over all runs.

    Attributes
    ----------
    name, unit : of an output's component
    samples : over all runs
    deviation : of the noise, given or estimated
    rms : of the residuals
    autocorrelation : of successive residuals, 0 for white noise
    """

    name: str
    unit: str
    samples: int
    deviation: float
    rms: float
    autocorrelation: float


@dataclass(frozen=True)
class Record:
    """Data of one run, and the model's outputs at the estimates.

    Attributes
    ----------
    name : of the file, or ``run1``
    t : (n,) s
    data, model : by column, (n,) each; missing data are nan
    initial : state that the run begins with, as of ``simulate``
    """

    name: str
    t: Array
    data: Mapping[str, Array]
    model: Mapping[str, Array]
    initial: Mapping[str, Array]

    @property
    def residuals(self) -> dict[str, Array]:
        """Data minus model by column, (n,)."""
        return {name: values - self.model[name] for name, values in self.data.items()}


@dataclass(frozen=True)
class Identification:
    """Parameters and initial states that fit measured data best, with files and plots.

    Attributes
    ----------
    scene : name of the scene
    estimates : parameters first, then initial states of each run
    correlation : (n, n) of the estimates, nan for undetermined estimates and estimates on a bound
    combinations : determined combinations of undetermined unknowns
    columns : measured quantities
    records : data and model of each run
    confidence : of the intervals
    noise : ``given`` or ``estimated``
    degrees_of_freedom : samples less unknowns that the data determine
    runs, failed : runs with derivatives, and number of failed runs among these; 0 for an identification from torques
    notes : doubts
    """

    scene: str
    estimates: tuple[Estimate, ...]
    correlation: Array
    combinations: tuple[Combination, ...]
    columns: tuple[Column, ...]
    records: tuple[Record, ...]
    confidence: float
    noise: str
    degrees_of_freedom: int
    runs: int
    failed: int
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<Identification of {self.scene}: {self.message}>"

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of a name. Raises UnknownName."""
        return NamedResults("unknown", {estimate.name: estimate for estimate in self.estimates})[name]

    @property
    def parameters(self) -> dict[str, float]:
        """Estimated parameters, in the form of ``simulate(parameters=...)``."""
        states = ("q.", "v.", "z.")
        return {estimate.name: estimate.value for estimate in self.estimates if not estimate.name.startswith(states)}

    @property
    def message(self) -> str:
        """One line: how many unknowns are determined, numbers of samples and of runs, and ``notes``."""
        decided = sum(estimate.state == "determined" for estimate in self.estimates)
        samples = sum(column.samples for column in self.columns)
        text = f"{decided} of {len(self.estimates)} unknowns determined by {samples} samples, {self.runs} runs"
        return "; ".join([text, *self.notes])

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data, without the times, data, model outputs and residuals of ``records``.

        Returns
        -------
        dict
            The other attributes as JSON types, numbers may be nan or infinite; ``message``; and ``initial``, the states
            with which runs begin, by name of the record.
        """
        plain = ("scene", "confidence", "noise", "degrees_of_freedom", "runs", "failed", "notes", "message")
        of_parts = {name: getattr(self, name) for name in ("estimates", "combinations", "columns")}
        return {
            **{name: getattr(self, name) for name in plain},
            **{name: [dict(vars(part)) for part in parts] for name, parts in of_parts.items()},
            "correlation": self.correlation.tolist(),
            "initial": {
                record.name: {key: value.tolist() for key, value in record.initial.items()} for record in self.records
            },
        }

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write identification.json (``to_dict``, null for nan and infinite), estimates.csv (estimates, then
        combinations) and, of each run, residuals_NAME.csv with times, data, model outputs and residuals.

        Existing files are replaced. Raises FileError.

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
        files = [target / "identification.json", target / "estimates.csv"]
        write_text(files[0], json_text(self.to_dict()) + "\n")
        head = ("name", "unit", "value", "deviation", "low", "high", "bias", "start", "state")
        unknowns = (tuple(vars(estimate).values()) for estimate in self.estimates)
        combined = ((c.text, "", c.value, c.deviation, c.low, c.high, "", "", c.form) for c in self.combinations)
        write_rows(files[1], [head, *unknowns, *combined])
        for record in self.records:
            table = {"t": record.t}
            for name in record.data:
                table |= {name: record.data[name], f"{name}.model": record.model[name]}
                table |= {f"{name}.residual": record.residuals[name]}
            files.append(target / f"residuals_{record.name}.csv")
            write_table(files[-1], list(table), np.column_stack(list(table.values())))
        return files

    def plot(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Draw data against the model with residuals for each run, and return the files. Raises FileError.

        Parameters
        ----------
        folder : path
            Made if absent.

        Returns
        -------
        list of Path
            One picture for each run.
        """
        return draw(self, make_folder(Path(folder)))


_DATA, _MODEL = "#707070", "#0B62C4"


def draw(result: Identification, folder: Path) -> list[Path]:
    """Draw all runs and return the files."""
    return [save_figure(_run(result, record), folder / f"fit_{record.name}.png") for record in result.records]


def _run(result: Identification, record: Record) -> Any:
    """Return a figure of a record, with at most eight columns: data with the model, and residuals in standard
    deviations."""
    names = list(record.data)[:8]
    figure = new_figure((10.0, 1.0 + 1.9 * len(names)))
    rows = figure.subplots(len(names), 2, squeeze=False, sharex=True, width_ratios=(3, 2))
    columns = {column.name: column for column in result.columns}
    for name, (compared, left) in zip(names, rows, strict=True):
        column = columns[name]
        compared.plot(record.t, record.data[name], ".", color=_DATA, markersize=3, label="data")
        compared.plot(record.t, record.model[name], color=_MODEL, linewidth=1.2, label="model")
        compared.set_ylabel(axis_label(name, column.unit), fontsize="small")
        residuals = record.residuals[name] / column.deviation
        left.axhspan(-2.0, 2.0, color=_MODEL, alpha=0.1, linewidth=0.0)
        left.plot(record.t, residuals, ".", color=_MODEL, markersize=2)
        left.set_ylim(-1.1 * max(3.0, _largest(residuals)), 1.1 * max(3.0, _largest(residuals)))
        left.set_ylabel(f"data - model, by {column.deviation:.3g} {column.unit}".rstrip(), fontsize="small")
        for axes in (compared, left):
            axes.grid(alpha=0.3, linewidth=0.5)
            axes.margins(x=0.01)
    rows[0][0].legend(frameon=False, fontsize="small", loc="upper right")
    rows[0][0].set_title(f"{result.scene}: {record.name}", fontsize="medium")
    rows[0][1].set_title("residuals in standard deviations, +-2 shaded", fontsize="medium")
    for axes in rows[-1]:
        axes.set_xlabel("time, s")
    return figure


def _largest(values: Any) -> float:
    present = values[np.isfinite(values)]
    return float(np.max(np.abs(present))) if len(present) else 0.0
