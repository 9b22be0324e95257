"""The report of a check: the closed forms with their worst entries, as text, as JSON, as table and figure of errors
by step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from eomgen.base.csv_tables import write_rows
from eomgen.base.data import asdict, dataclass, field
from eomgen.base.figures import draw_grid, new_figure, save_figure
from eomgen.base.files import make_folder, write_text
from eomgen.base.json_text import json_text
from eomgen.errors import Message
from eomgen.products.studies.verification.differences import LADDER
from eomgen.products.studies.work_precision.result import COLOURS, MARKS, legend_beside

#: ``agrees``; ``FAILS``; ``undecided``: neither way of differentiating gives digits; ``no state``: no state at which
#: the closed form is finite.
Verdict = Literal["agrees", "FAILS", "undecided", "no state"]


@dataclass(frozen=True)
class Disagreement:
    """The worst entry of a closed form that fails.

    Attributes
    ----------
    state : str
        Which state, in words.
    entry : str
        Row and direction.
    value : float
        Value of the closed form; matrices by the direction's scale.
    expected : float
        Expected value.
    by : str
        Source of the expected value: ``finite differences``, ``complex step`` or the second derivation.
    bar : float
        How well that is known.
    explained : str
        The same in words, for a known cause.
    """

    state: str
    entry: str
    value: float
    expected: float
    by: str
    bar: float
    explained: str = ""

    def __str__(self) -> str:
        if self.explained:
            return self.explained
        entry = f"{self.entry}: " if self.entry else ""
        return (
            f"{entry}{self.value:.9g}, but {self.expected:.9g} by {self.by} (known to {self.bar:.2g}), at {self.state}"
        )


@dataclass(frozen=True)
class FormReport:
    """Result of the check of one closed form. Agreements are norm-wise: largest difference over the largest entry of a
    state.

    Attributes
    ----------
    name, meaning, family : str
    agreement, step, slope : float or None
        The best agreement with finite differences over the ladder, its step (in the units of the
        directions' scale: 1 rad, 1 s, the scene's size), and the slope of the error at larger steps; None if the form
        is not a derivative, the slope also if differences are exact up to round-off.
    complex_step : float or None
    second, second_name : agreement with the second derivation, and the name of this derivation
    errors : by step of the ladder
    remarks : kinks, unbounded derivatives and states outside of domains, in words
    """

    name: str
    meaning: str
    family: str
    verdict: Verdict
    agreement: float | None = None
    step: float | None = None
    slope: float | None = None
    complex_step: float | None = None
    second: float | None = None
    second_name: str = ""
    errors: tuple[float, ...] = ()
    remarks: tuple[str, ...] = ()
    worst: Disagreement | None = None


#: Lower limit of drawn errors: zero errors have no place on a logarithmic axis.
_LEAST = 1e-17


def draw(forms: Sequence[FormReport], title: str, path: Path) -> Path:
    """Draw errors of closed forms over the step into a file, a panel for each family, and return the path. Raises
    FileError if the file cannot be written."""
    panels = _panels(forms)
    columns = 1 if len(panels) == 1 else 2
    rows = -(-len(panels) // columns)
    figure = new_figure((8.0 * columns, 0.9 + 3.6 * rows))
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis, (family, members) in zip(axes, panels, strict=False):
        _panel(axis, family, members)
    for axis in axes[len(panels) :]:
        axis.set_visible(False)
    figure.suptitle(f"{title}\ndotted: against complex steps", fontsize=11)
    return save_figure(figure, path)


def _panels(forms: Sequence[FormReport]) -> list[tuple[str, list[FormReport]]]:
    """Return (family, closed forms) of each panel; families with more than seven forms have several panels of similar
    size."""
    families: dict[str, list[FormReport]] = {}
    for form in forms:
        families.setdefault(form.family, []).append(form)
    panels = []
    for family, members in families.items():
        count = -(-len(members) // 7)  # more curves of one panel cannot be distinguished
        size = -(-len(members) // count)
        panels += [(family, members[first : first + size]) for first in range(0, len(members), size)]
    return panels


def _panel(axis: Any, family: str, forms: Sequence[FormReport]) -> None:
    """Draw the errors of difference quotients over the step for a family of closed forms."""
    for form, colour, mark in zip(forms, COLOURS, MARKS, strict=False):
        errors = np.clip(np.array(form.errors, dtype=float), _LEAST, None)
        failed = form.verdict != "agrees"
        label = f"{form.name} ({form.verdict})" if failed else form.name
        axis.loglog(
            LADDER, errors, color=colour, marker=mark, markersize=3.5, linewidth=2.4 if failed else 1.2, label=label
        )
        if form.complex_step is not None:
            axis.axhline(max(form.complex_step, _LEAST), color=colour, linewidth=1.0, linestyle=":")
    axis.set_ylim(3e-18, 30.0)
    axis.set_xlim(LADDER[-1] / 2.0, LADDER[0] * 2.0)
    reference = np.array([1e-2, 1.0])
    axis.loglog(reference, 1e-8 * reference**2, color="#999999", linewidth=1.0, linestyle="--")
    axis.annotate("slope 2", (0.05, 2.5e-11), xytext=(3, -9), textcoords="offset points", color="#777777", fontsize=8)
    axis.set_title(family, fontsize=10, loc="left")
    axis.set_xlabel("step / scale of the direction (1 rad, 1 rad/s, 1 s, size of the scene)", fontsize=8)
    axis.set_ylabel("error / largest entry", fontsize=9)
    draw_grid(axis)
    legend_beside(axis)


#: Code of the note on states that are left out because the equations of motion are not finite there.
_LEFT_OUT = "W0087"


@dataclass(frozen=True)
class CheckReport:
    """Result of the check of all closed forms of a scene.

    Attributes
    ----------
    scene : str
    states : names of the states
    seed : int
    forms : tuple of FormReport
    notes : omissions, in words
    corners : functions in formulas with a kink or jump somewhere, whether or not a state is near
    unchecked : closed forms that Ctrl-C has left
    """

    scene: str
    states: tuple[str, ...]
    seed: int
    forms: tuple[FormReport, ...]
    notes: tuple[str, ...] = field(default=())
    corners: tuple[str, ...] = ()
    unchecked: tuple[str, ...] = ()

    @property
    def failures(self) -> tuple[FormReport, ...]:
        """Closed forms that do not agree, or that could not be decided."""
        return tuple(form for form in self.forms if form.verdict != "agrees")

    @property
    def passed(self) -> bool:
        return not self.failures and bool(self.forms) and not self.unchecked

    @property
    def summary(self) -> str:
        """The outcome in a few words: ``all agree`` (with an addition after remarks or if states were left out),
        the number of forms not shown to agree (also 0 of 0), or, without such forms, an interruption."""
        if self.unchecked and not self.failures:
            return f"interrupted: {len(self.forms)} closed forms agree, and {len(self.unchecked)} are not checked"
        if not self.passed:
            forms = f"{len(self.forms)} closed form{'s' * (len(self.forms) != 1)}"
            return f"{len(self.failures)} of {forms} not shown to agree"
        partly = self.remarks or any(Message(note).code == _LEFT_OUT for note in self.notes)
        return "all agree where defined" if partly else "all agree"

    @property
    def remarks(self) -> tuple[str, ...]:
        """Remarks on the closed forms, each once, with the names of the closed forms."""
        by_text: dict[str, list[str]] = {}
        for form in self.forms:
            for remark in form.remarks:
                by_text.setdefault(remark, []).append(form.name)
        return tuple(f"{text}: {', '.join(names)}" for text, names in by_text.items())

    def to_dict(self) -> dict[str, Any]:
        """Return the report as JSON data.

        Returns
        -------
        dict
            JSON data.
        """
        return {**asdict(self), "passed": self.passed, "ladder": LADDER.tolist()}

    def write(self, folder: str | Path) -> list[Path]:
        """Write ``check.json``, ``check.csv`` (errors by step) and ``check.png`` (the same, drawn) to a folder.

        Existing files are replaced, NaN is null in ``check.json``. Without ``check.png`` if all forms lack errors by
        step: forms without derivatives, or without a state; an earlier picture stays then.

        Parameters
        ----------
        folder : str or Path
            Folder to write to, which is made if missing.

        Returns
        -------
        list of Path
            The written files, in this order.

        Raises
        ------
        FileError
            The folder cannot be made, or a file cannot be written.
        UsageError
            The variable ``MPLBACKEND`` names no backend of matplotlib; after the first two files.
        """
        target = make_folder(Path(folder))
        data, table, figure = target / "check.json", target / "check.csv", target / "check.png"
        write_text(data, json_text(self.to_dict()) + "\n")
        forms = [form for form in self.forms if form.errors]
        rows = zip(LADDER.tolist(), *(form.errors for form in forms), strict=True)
        write_rows(table, [["step", *(form.name for form in forms)], *([f"{x:.17g}" for x in row] for row in rows)])
        drawn = [form for form in self.forms if any(math.isfinite(error) for error in form.errors)]
        if not drawn:
            return [data, table]
        verdict = self.summary if self.passed else f"failed: {', '.join(form.name for form in self.failures[:4])}"
        states = f"closed forms against central differences at {len(self.states)} states"
        return [data, table, draw(drawn, f"{self.scene}: {states}; {verdict}", figure)]
