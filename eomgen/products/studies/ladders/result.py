"""Result of a study of extremes: a verdict for each cell, as table, CSV, JSON and picture."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from eomgen.base.csv_tables import csv_text
from eomgen.base.data import asdict, dataclass, field
from eomgen.base.figures import new_figure, save_figure
from eomgen.base.files import make_folder, write_text
from eomgen.base.json_text import json_text
from eomgen.products.studies.ladders.register import BY_NAME
from eomgen.products.studies.ladders.runs import REACHED, REFUSED, STOPPED, UNFINISHED, RunEnding
from eomgen.products.studies.work_precision.result import WRONG

#: Verdicts: the error is within the bound; the error is above, below 10 %; the run reports doubts; the run ended with a
#: message; the run was refused with a message; the run took too long and was interrupted; there is no reference; the
#: run failed.
HOLDS, COARSE, WARNED, UNKNOWN, FAILS = "holds", "coarse", "warned", "unknown", "fails"
#: Words, colour and sign of each verdict: green to yellow is right or nearly, blue is reported, red is a silent fault.
_SHOWN = {
    HOLDS: ("the error is within its bound", "#3E9B5F", ""),
    COARSE: ("1 to 10 % wrong", "#E3C53A", "~"),
    WARNED: ("more than 10 % wrong, and the run says that it is doubtful", "#F0953F", "!"),
    STOPPED: ("ended with a message", "#7FB0D8", "s"),
    REFUSED: ("refused with a message", "#4E79A7", "r"),
    UNFINISHED: ("too slow, interrupted", "#B7A6CE", "u"),
    UNKNOWN: ("ran; no two references agree", "#C9C9C9", "?"),
    FAILS: ("hang, crash, not finite without a word, or more than 10 % wrong and called success", "#C8102E", "F"),
}
VERDICTS: Mapping[str, str] = {name: words for name, (words, _, _) in _SHOWN.items()}


@dataclass(frozen=True)
class Cell:
    """Result of the run of a scene at one value of a ladder with one method.

    Attributes
    ----------
    ladder, value, method : which
    verdict : one of ``VERDICTS``
    error, velocity_error : relative to the motion and to the largest velocity; None if none is known
    bound : largest error of a cell that holds
    said : warnings of the run, reason for its end
    reference : description of the reference
    seconds : of the run
    """

    ladder: str
    value: float
    method: str
    verdict: str
    error: float | None
    velocity_error: float | None
    bound: float
    said: str
    reference: str
    seconds: float

    @property
    def name(self) -> str:
        """Argument of ``--cell`` for this cell."""
        return f"{self.ladder}:{self.value:.9g}:{self.method}"


def verdict(ended: RunEnding, error: float | None, bound: float) -> str:
    """Return the verdict of a cell, one of ``VERDICTS``, by the end of its run and the error (None if unknown). Errors
    up to `bound` hold, up to 0.1 are coarse; above, or without a reference, a run has to warn."""
    if ended.how in (REFUSED, UNFINISHED) or (ended.how == STOPPED and ended.said):
        return ended.how
    if ended.how != REACHED or not ended.finite:
        return FAILS
    if error is not None and error <= WRONG:
        return HOLDS if error <= bound else COARSE
    return WARNED if ended.said else UNKNOWN if error is None else FAILS


def counts(cells: Sequence[Cell]) -> dict[str, int]:
    """Return cells by verdict."""
    result = Counter(cell.verdict for cell in cells)
    return {name: result[name] for name in VERDICTS if result[name]}


@dataclass(frozen=True)
class Extremes:
    """Results of a scene under extreme conditions: a cell for each value of each ladder with each method.

    Attributes
    ----------
    scene : name of the scene
    source : of the scene as given, for commands
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
        """Return the command that runs one cell.

        Parameters
        ----------
        cell : Cell
            One of ``cells``.

        Returns
        -------
        str
            A line for a shell.
        """
        return f"eomgen extremes {self.source} --cell {cell.name}"

    def of(self, ladder: str) -> tuple[Cell, ...]:
        return tuple(cell for cell in self.cells if cell.ladder == ladder)

    def to_dict(self) -> dict[str, Any]:
        """Return the results as JSON types.

        Returns
        -------
        dict
            ``scene``, ``counts`` (cells by verdict), ``fails`` (a number), ``shortest_period`` (s), ``seconds``,
            ``left_out``, and ``cells``: attributes of each cell, and its ``command``. Numbers may be nan or infinite.
        """
        return {
            **{name: getattr(self, name) for name in ("scene", "counts", "seconds")},
            "fails": len(self.fails),
            "shortest_period": self.period,
            "left_out": dict(self.left_out),
            "cells": [{**asdict(cell), "command": self.command(cell)} for cell in self.cells],
        }

    def csv(self) -> str:
        """Return the table: a row for each cell, with the command that repeats the cell.

        Returns
        -------
        str
            Comma-separated values with a head; numbers are rounded, errors that are not known are empty.
        """
        head = ["ladder", "value", "method", "verdict", "error", "velocity_error", "bound"]
        rows = [[*head, "seconds", "reference", "said", "command"]]
        for cell in self.cells:
            errors = ["" if x is None else f"{x:.3g}" for x in (cell.error, cell.velocity_error)]
            row = [cell.ladder, f"{cell.value:.9g}", cell.method, cell.verdict, *errors, f"{cell.bound:g}"]
            rows.append([*row, f"{cell.seconds:.3g}", cell.reference, cell.said, self.command(cell)])
        return csv_text(rows)

    def save(self, folder: str | Path) -> list[Path]:
        """Write extremes.csv (``csv``), extremes.json (``to_dict``, null for NaN and infinity) and extremes.png.

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

        made = make_folder(Path(folder))
        write_text(made / "extremes.csv", self.csv())
        write_text(made / "extremes.json", json_text(self.to_dict()) + "\n")
        return [made / "extremes.csv", made / "extremes.json", draw(self.scene, self.cells, made / "extremes.png")]


def draw(scene: str, cells: Sequence[Cell], path: Path) -> Path:
    """Draw a table of all cells, coloured by verdict, with errors, into a file; return the path. Raises FileError."""
    from matplotlib.patches import Patch, Rectangle  # noqa: PLC0415  # slow to import, for drawing only

    ladders = dict.fromkeys(cell.ladder for cell in cells)
    values = {name: sorted({cell.value for cell in cells if cell.ladder == name}) for name in ladders}
    methods = {name: list(dict.fromkeys(cell.method for cell in cells if cell.ladder == name)) for name in ladders}
    widest, rows = max(map(len, values.values()), default=1), [len(names) for names in methods.values()]
    figure = new_figure((4.6 + 0.62 * widest, 1.5 + 0.27 * max(sum(rows) + 1.45 * (len(rows) - 1), 4.0)))
    axes = figure.subplots(max(len(rows), 1), 1, squeeze=False, height_ratios=rows or None)
    for axis, name in zip(axes[:, 0], ladders, strict=False):
        axis.set(xlim=(0.0, widest), ylim=(len(methods[name]), 0.0))
        axis.set_title(BY_NAME[name].scales, loc="left", fontsize=7.5, weight="bold")
        axis.set_xticks(np.arange(len(values[name])) + 0.5, [f"{value:.6g}" for value in values[name]], fontsize=6.5)
        axis.set_yticks(np.arange(len(methods[name])) + 0.5, methods[name], fontsize=7.5)
        axis.tick_params(length=0.0, labeltop=True, labelbottom=False)
        axis.spines[:].set_visible(False)
    for cell in cells:
        axis = axes[list(ladders).index(cell.ladder), 0]
        _, colour, sign = _SHOWN[cell.verdict]
        x, y = values[cell.ladder].index(cell.value), methods[cell.ladder].index(cell.method)
        axis.add_patch(Rectangle((x, y), 0.95, 0.92, color=colour, linewidth=0.0))
        text = sign if cell.error is None else f"{cell.error:.0e}"
        axis.text(x + 0.475, y + 0.47, text, ha="center", va="center", fontsize=6.0, color="white")
    count = counts(cells)
    handles = [Patch(color=_SHOWN[name][1], label=f"{name} {count[name]}") for name in count]
    figure.legend(handles=handles, loc="outside lower left", ncols=4, frameon=False, fontsize=8)
    unknown = f"\nunknown: {VERDICTS[UNKNOWN]}" if UNKNOWN in count else ""
    figure.suptitle(f"{scene}: extremes; numbers are errors by the motion{unknown}", fontsize=9, x=0.02, ha="left")
    return save_figure(figure, path)
