"""The report of a check: one entry per closed form, in words, as JSON, as a table of errors by step."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal

from eomgen.studies.verification.differences import LADDER

#: ``agrees``; ``FAILS``; ``undecided``: neither way of differentiating gives digits; ``no state``: none where it is finite.
Verdict = Literal["agrees", "FAILS", "undecided", "no state"]
#: How remarks and notes begin that tell of states where a function or its derivative is not defined.
_NOT_DEFINED = ("not a number", "not smooth", "unbounded derivative", "left out")


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
        What the closed form gives; matrices by the direction's scale.
    expected : float
        What it should be.
    by : str
        What says so: ``finite differences``, ``complex step`` or the second derivation.
    bar : float
        How well that is known.
    explained : str
        The same in words of its own, where it has a cause that is known.
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
        return f"{entry}{self.value:.9g}, but {self.expected:.9g} by {self.by} (known to {self.bar:.2g}), at {self.state}"


@dataclass(frozen=True)
class FormReport:
    """What was found of one closed form. Agreements are norm-wise: largest difference over the largest entry of a state.

    Attributes
    ----------
    name, meaning, family : str
    agreement, step, slope : float or None
        The best agreement with finite differences over the ladder, the step where it occurs (in the units of the directions'
        scale: 1 rad, 1 s, the scene's size), and the slope of the error above it; None where the form is no derivative, the
        slope also where differences are exact up to round-off.
    complex_step : float or None
    second, second_name : agreement with the second derivation, and what that is
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


@dataclass(frozen=True)
class CheckReport:
    """A scene's closed forms, checked.

    Attributes
    ----------
    scene : str
    states : names of the states
    seed : int
    forms : tuple of FormReport
    notes : what was left out, in words
    corners : functions in formulas that bend or jump somewhere, whether or not one of the states is near
    """

    scene: str
    states: tuple[str, ...]
    seed: int
    forms: tuple[FormReport, ...]
    notes: tuple[str, ...] = field(default=())
    corners: tuple[str, ...] = ()

    @property
    def failures(self) -> tuple[FormReport, ...]:
        """Forms that do not agree, or of which nothing can be said."""
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
        """What was remarked of each form, each once, with the forms that it was remarked of."""
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
        from eomgen.studies.verification.report_files import write  # noqa: PLC0415  # matplotlib comes with it

        return write(self, Path(folder))
