"""Result of a study of extremes: a verdict for each cell, as table, CSV, JSON and picture."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from eomgen.base.files import make_folder, write_text
from eomgen.products.studies.ladders.verdicts import FAILS, Cell, counts


@dataclass(frozen=True)
class Extremes:
    """The map of a scene.

    Attributes
    ----------
    scene : its name
    source : as it was given, for commands
    cells : in the order of the ladders
    left_out : ladders that the scene has not, and why; cells that the budget left out
    period : s, the shortest, in which steps are measured
    seconds : of the study
    """

    scene: str
    source: str
    cells: tuple[Cell, ...]
    left_out: Mapping[str, str] = field(default_factory=dict)
    period: float = math.nan
    seconds: float = 0.0

    @property
    def fails(self) -> tuple[Cell, ...]:
        """Cells that fail: there should be none."""
        return tuple(cell for cell in self.cells if cell.verdict == FAILS)

    @property
    def counts(self) -> dict[str, int]:
        """Cells by verdict."""
        return counts(self.cells)

    def command(self, cell: Cell) -> str:
        """Return the command that runs one cell."""
        return f"eomgen extremes {self.source} --cell {cell.name}"

    def of(self, ladder: str) -> tuple[Cell, ...]:
        return tuple(cell for cell in self.cells if cell.ladder == ladder)

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as JSON types."""
        cells = [{**asdict(cell), "command": self.command(cell)} for cell in self.cells]
        return {
            "scene": self.scene,
            "counts": self.counts,
            "fails": len(self.fails),
            "shortest_period": self.period,
            "seconds": self.seconds,
            "left_out": dict(self.left_out),
            "cells": cells,
        }

    def csv(self) -> str:
        """Return the table: a row for each cell, with the command that runs it."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        head = ["ladder", "value", "method", "verdict", "error", "velocity_error", "bound"]
        writer.writerow([*head, "seconds", "reference", "said", "command"])
        for cell in self.cells:
            errors = ["" if x is None else f"{x:.3g}" for x in (cell.error, cell.velocity_error)]
            row = [cell.ladder, f"{cell.value:.9g}", cell.method, cell.verdict, *errors, f"{cell.bound:g}"]
            writer.writerow([*row, f"{cell.seconds:.3g}", cell.reference, cell.said, self.command(cell)])
        return text.getvalue()

    def save(self, folder: str | Path) -> list[Path]:
        """Write extremes.csv, extremes.json and extremes.png. Raises FileError."""
        from eomgen.products.studies.ladders.plots import draw  # noqa: PLC0415  # matplotlib; a map is used without it

        made = make_folder(Path(folder))
        write_text(made / "extremes.csv", self.csv())
        write_text(made / "extremes.json", json.dumps(self.to_dict(), indent=1) + "\n")
        return [made / "extremes.csv", made / "extremes.json", draw(self.scene, self.cells, made / "extremes.png")]
