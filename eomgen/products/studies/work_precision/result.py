"""``Tradeoff``: the result of a study, with its picture and its files."""

from __future__ import annotations

import csv
import io
from dataclasses import asdict
from pathlib import Path
from typing import Any

from eomgen.base.files import make_folder, write_text
from eomgen.base.text import json_text
from eomgen.products.studies.work_precision.measured import Measured


class Tradeoff(Measured):
    """Speed against accuracy of one scene, measured; see ``Measured`` for its attributes."""

    def plot(self, path: str | Path) -> Path:
        """Draw errors over time, the front and the failures. Raises FileError."""
        from eomgen.products.studies.work_precision.plots import draw  # noqa: PLC0415  # matplotlib comes with it

        return draw(self, Path(path))

    def save(self, folder: str | Path) -> list[Path]:
        """Write ``tradeoff.json``, ``tradeoff.csv`` and ``tradeoff.png`` to a folder, and return them. Raises
        FileError."""
        place = make_folder(Path(folder))
        data, table = place / "tradeoff.json", place / "tradeoff.csv"
        write_text(data, json_text(self.to_dict()) + "\n")
        write_text(table, self._table())
        return [data, table, self.plot(place / "tradeoff.png")]

    def _table(self) -> str:
        quantities = list(dict.fromkeys(name for p in self.points for name in p.error))
        counted = list(dict.fromkeys(name for p in self.points for name in p.stats))
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        own = ("formulation", "method", "parameters", "policy", "real", "profile", "kind", "value")
        sizes = [f"{name} {measure}" for name in quantities for measure in ("largest", "rms", "final")]
        writer.writerow([*own, "verdict", "seconds", "least_seconds", "repeats", *sizes, *counted, "said"])
        for p in self.points:
            c = p.configuration
            given = " ".join(f"{name}={value:g}" for name, value in c.parameters.items())
            row: list[Any] = [c.formulation, c.method, given, c.policy, c.real, c.profile, p.kind, repr(p.value)]
            row += [self.verdict(p), _cell(p.seconds), _cell(p.least), p.repeats]
            for name in quantities:
                size = p.error.get(name)
                row += ["", "", ""] if size is None else [_cell(x) for x in asdict(size).values()]
            row += [_cell(p.stats.get(name)) for name in counted]
            writer.writerow([*row, p.said])
        return text.getvalue()


def _cell(value: float | None) -> str:
    return "" if value is None else repr(value)
