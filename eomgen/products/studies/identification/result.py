"""Result of an identification: estimates with intervals, undetermined combinations, residuals; files and plots."""

from __future__ import annotations

import csv
import io
import os
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.calls import ByName
from eomgen.base.files import make_folder, write_table, write_text
from eomgen.base.text import json_text
from eomgen.products.studies.identification.findings import Estimate, Findings


class Identification(Findings):
    """Parameters and initial states that fit measured data best, with their files and plots."""

    def __repr__(self) -> str:
        return f"<Identification of {self.scene}: {self.message}>"

    def __getitem__(self, name: str) -> Estimate:
        """Return the estimate of a name. Raises UnknownName."""
        return ByName("unknown", {one.name: one for one in self.estimates})[name]

    @property
    def parameters(self) -> dict[str, float]:
        """Estimated parameters, as ``simulate(parameters=...)`` takes them."""
        count = len(self.estimates) - self._states
        return {one.name: one.value for one in self.estimates[:count]}

    @property
    def _states(self) -> int:
        return sum(one.name.startswith(("q.", "v.", "z.")) for one in self.estimates)

    @property
    def message(self) -> str:
        """One line: estimates and doubts."""
        decided = sum(one.state == "determined" for one in self.estimates)
        samples = sum(one.samples for one in self.columns)
        text = f"{decided} of {len(self.estimates)} unknowns determined by {samples} samples, {self.runs} runs"
        return "; ".join([text, *self.notes])

    def to_dict(self) -> dict[str, Any]:
        """Return everything but the residuals as plain data."""
        return {
            "scene": self.scene,
            "estimates": [dict(vars(one)) for one in self.estimates],
            "correlation": self.correlation.tolist(),
            "combinations": [vars(one) | {"members": list(one.members)} for one in self.combinations],
            "columns": [dict(vars(one)) for one in self.columns],
            "initial": {one.name: {key: value.tolist() for key, value in one.initial.items()} for one in self.records},
            "confidence": self.confidence,
            "noise": self.noise,
            "degrees_of_freedom": self.degrees_of_freedom,
            "runs": self.runs,
            "failed": self.failed,
            "notes": list(self.notes),
            "message": self.message,
        }

    def save(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Write identification.json, estimates.csv and residuals of each run, and return them. Raises FileError."""
        place = make_folder(Path(folder))
        files = [place / "identification.json", place / "estimates.csv"]
        write_text(files[0], json_text(self.to_dict()) + "\n")
        stream = io.StringIO()
        writer = csv.writer(stream, lineterminator="\n")
        writer.writerow(("name", "unit", "value", "deviation", "low", "high", "bias", "start", "state"))
        writer.writerows(vars(one).values() for one in self.estimates)
        writer.writerows(
            (one.text, "", one.value, one.deviation, one.low, one.high, "", "", one.form) for one in self.combinations
        )
        write_text(files[1], stream.getvalue())
        for record in self.records:
            table = {"t": record.t}
            for name in record.data:
                table |= {name: record.data[name], f"{name}.model": record.model[name]}
                table |= {f"{name}.residual": record.residuals[name]}
            files.append(place / f"residuals_{record.name}.csv")
            write_table(files[-1], list(table), np.column_stack(list(table.values())))
        return files

    def plot(self, folder: str | os.PathLike[str]) -> list[Path]:
        """Draw data against the model with residuals for each run, and return the files. Raises FileError."""
        from eomgen.products.studies.identification.plots import draw  # noqa: PLC0415  # matplotlib; used without it

        return draw(self, make_folder(Path(folder)))
