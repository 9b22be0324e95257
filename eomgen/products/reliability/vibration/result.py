"""Result of a study of random vibration: moments, distributions by each method, autocovariance and costs."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.files import make_folder, write_table, write_text
from eomgen.base.text import json_text
from eomgen.products.reliability.vibration.findings import Findings

#: Moments of the message, and the method of each.
_ORDER = {
    "corrected": "by a form and samples",
    "second_order": "to second order",
    "projected": "to projected second order",
    "monte_carlo": "by samples",
}


class RandomVibration(Findings):
    """The distribution of an output at one time, with its files and plots."""

    @property
    def message(self) -> str:
        """One line: results and doubts."""
        name = next(name for name in _ORDER if name in self.moments)
        mean, deviation, *_ = self.moments[name]
        text = f"{self.output} at t = {self.t:.6g} s has mean {mean:.6g} and standard deviation {deviation:.6g}"
        if self.unit:
            text += f" {self.unit}"
        parts = [f"{text} {_ORDER[name]}", *self.truncation, str(self.error), *self.notes]
        return "; ".join(parts)

    @property
    def truncation(self) -> list[str]:
        """A phrase on the share of the output's variance that is lost with modes left out; empty if it is not known."""
        if math.isnan(self.lost_variance):
            return []
        return [f"{100.0 * self.lost_variance:.2g} % of its variance is lost with the modes left out"]

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain data."""
        keys = ("mean", "standard_deviation", "skewness", "excess_kurtosis")
        return {
            "scene": self.scene,
            "output": self.output,
            "unit": self.unit,
            "t": self.t,
            "processes": [vars(one) | {"eigenvalues": list(one.eigenvalues)} for one in self.processes],
            "moments": {name: dict(zip(keys, values, strict=True)) for name, values in self.moments.items()},
            "thresholds": self.thresholds.tolist(),
            "indices": self.indices.tolist(),
            "distributions": {
                name: {key: getattr(one, key).tolist() for key in ("below", "above", "low", "high")}
                for name, one in self.distributions.items()
            },
            "times": self.times.tolist(),
            "autocovariance": {name: values.tolist() for name, values in self.autocovariance.items()},
            "first_passage": {f"{level:.9g}": dict(result) for level, result in self.first_passage.items()},
            "costs": {name: vars(cost) for name, cost in self.costs.items()},
            "notes": list(self.notes),
            "error": self.error.summary(),
            "lost_variance": self.lost_variance,
            "errors": {name: values.tolist() for name, values in self.errors.items()},
            "message": self.message,
        }

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write random.json, distribution.csv and autocovariance.csv and return them. Raises FileError."""
        place = make_folder(Path(folder))
        columns = {"threshold": self.thresholds, "index": self.indices}
        for name, one in self.distributions.items():
            columns |= {f"{name}.below": one.below, f"{name}.above": one.above}
            columns |= {f"{name}.{key}": getattr(one, key) for key in ("low", "high") if len(getattr(one, key))}
        files = [place / "random.json", place / "distribution.csv"]
        write_text(files[0], json_text(self.to_dict()) + "\n")
        write_table(files[1], list(columns), np.column_stack(list(columns.values())))
        if len(self.times):
            files.append(place / "autocovariance.csv")
            table = {"t": self.times, **self.autocovariance}
            write_table(files[2], list(table), np.column_stack(list(table.values())))
        return files

    def plot(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Draw the distribution, the autocovariance and the spectrum of modes, and return the files."""
        from eomgen.products.reliability.vibration.plots import draw  # noqa: PLC0415  # matplotlib; a study is used without it

        return draw(self, make_folder(Path(folder)))
