"""The report of a check: the closed forms, as text, as JSON, and as a table of errors by step."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from eomgen.base.files import write_text
from eomgen.base.text import json_text
from eomgen.errors import FileError, Problem
from eomgen.products.studies.verification.differences import LADDER
from eomgen.products.studies.verification.form_report import FormReport
from eomgen.products.studies.verification.plots import draw

#: Beginnings of remarks and notes on states at which a function or its derivative is not defined.
_NOT_DEFINED = ("not a number", "not smooth", "unbounded derivative", "left out")


@dataclass(frozen=True)
class CheckReport:
    """A scene's closed forms, checked.

    Attributes
    ----------
    scene : str
    states : names of the states
    seed : int
    forms : tuple of FormReport
    notes : omissions, in words
    corners : functions in formulas with a kink or jump somewhere, whether or not a state is near
    """

    scene: str
    states: tuple[str, ...]
    seed: int
    forms: tuple[FormReport, ...]
    notes: tuple[str, ...] = field(default=())
    corners: tuple[str, ...] = ()

    @property
    def failures(self) -> tuple[FormReport, ...]:
        """Closed forms that do not agree, or that could not be decided."""
        return tuple(form for form in self.forms if form.verdict != "agrees")

    @property
    def passed(self) -> bool:
        return not self.failures and bool(self.forms)

    @property
    def summary(self) -> str:
        """The outcome in a few words."""
        if not self.passed:
            forms = f"{len(self.forms)} closed form{'s' * (len(self.forms) != 1)}"
            return f"{len(self.failures)} of {forms} not shown to agree"
        partly = any(text.startswith(_NOT_DEFINED) for text in (*self.remarks, *self.notes))
        return "all agree where defined" if partly else "all agree"

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on the closed forms, each once, with the names of its closed forms."""
        by_text: dict[str, list[str]] = {}
        for form in self.forms:
            for remark in form.remarks:
                by_text.setdefault(remark, []).append(form.name)
        return tuple(f"{text}: {', '.join(names)}" for text, names in by_text.items())

    def to_dict(self) -> dict[str, Any]:
        """Return the report as JSON data."""
        return {**asdict(self), "passed": self.passed, "ladder": LADDER.tolist()}

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``check.json``, ``check.csv`` (errors by step) and ``check.png`` (the same, drawn) to a folder.

        Raises
        ------
        FileError
        """
        return write(self, Path(folder))


def write(report: CheckReport, folder: Path) -> list[Path]:
    """Write ``check.json``, ``check.csv`` and ``check.png`` to a folder, which is made if it is missing, and return
    them.

    Raises
    ------
    FileError
    """
    make(folder)
    data, table, figure = folder / "check.json", folder / "check.csv", folder / "check.png"
    write_text(data, json_text(report.to_dict()) + "\n")
    write_text(table, _table(report))
    drawn = [form for form in report.forms if any(math.isfinite(error) for error in form.errors)]
    if drawn:
        verdict = report.summary if report.passed else f"failed: {', '.join(form.name for form in report.failures[:4])}"
        states = f"closed forms against central differences at {len(report.states)} states"
        draw(drawn, f"{report.scene}: {states}; {verdict}", figure)
    return [data, table, figure] if drawn else [data, table]


def make(folder: Path) -> None:
    """Make a folder if it is missing. Raises FileError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(Problem(str(folder), f"cannot be made ({error.strerror or error})", "another folder")) from None


def _table(report: CheckReport) -> str:
    """Return the errors of finite differences as CSV, one row per step."""
    forms = [form for form in report.forms if form.errors]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["step", *(form.name for form in forms)])
    for number, step in enumerate(LADDER.tolist()):
        writer.writerow([f"{step:.17g}", *(f"{form.errors[number]:.17g}" for form in forms)])
    return text.getvalue()
