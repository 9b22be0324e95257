"""Plots of an identification: data against the model, and residuals in standard deviations, for each run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.figures import new_figure, saved
from eomgen.products.studies.identification.findings import Findings, Record

_DATA, _MODEL = "#707070", "#0B62C4"
#: Columns that one figure shows.
_SHOWN = 8


def draw(found: Findings, folder: Path) -> list[Path]:
    """Draw all runs and return their files."""
    return [saved(_run(found, record), folder / f"fit_{record.name}.png") for record in found.records]


def _run(found: Findings, record: Record) -> Any:
    names = list(record.data)[:_SHOWN]
    figure = new_figure((10.0, 1.0 + 1.9 * len(names)))
    rows = figure.subplots(len(names), 2, squeeze=False, sharex=True, width_ratios=(3, 2))
    columns = {one.name: one for one in found.columns}
    for name, (compared, left) in zip(names, rows, strict=True):
        column = columns[name]
        compared.plot(record.t, record.data[name], ".", color=_DATA, markersize=3, label="data")
        compared.plot(record.t, record.model[name], color=_MODEL, linewidth=1.2, label="model")
        compared.set_ylabel(f"{name}, {column.unit}" if column.unit else name, fontsize="small")
        residuals = record.residuals[name] / column.deviation
        left.axhspan(-2.0, 2.0, color=_MODEL, alpha=0.1, linewidth=0.0)
        left.plot(record.t, residuals, ".", color=_MODEL, markersize=2)
        left.set_ylim(-1.1 * max(3.0, _largest(residuals)), 1.1 * max(3.0, _largest(residuals)))
        left.set_ylabel(f"data - model, by {column.deviation:.3g} {column.unit}".rstrip(), fontsize="small")
        for axes in (compared, left):
            axes.grid(alpha=0.3, linewidth=0.5)
            axes.margins(x=0.01)
    rows[0][0].legend(frameon=False, fontsize="small", loc="upper right")
    rows[0][0].set_title(f"{found.scene}: {record.name}", fontsize="medium")
    rows[0][1].set_title("residuals in standard deviations, +-2 shaded", fontsize="medium")
    for axes in rows[-1]:
        axes.set_xlabel("time in s")
    return figure


def _largest(values: Any) -> float:
    present = values[np.isfinite(values)]
    return float(np.max(np.abs(present))) if len(present) else 0.0
