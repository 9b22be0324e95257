"""Result of the check of one closed form, and its worst entry if it fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

#: ``agrees``; ``FAILS``; ``undecided``: neither way of differentiating gives digits; ``no state``: none if it is
#: finite.
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
        Its source: ``finite differences``, ``complex step`` or the second derivation.
    bar : float
        How well that is known.
    explained : str
        The same in words of its own, if it has a known cause.
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
        The best agreement with finite differences over the ladder, the step at which it occurs (in the units of the
        directions' scale: 1 rad, 1 s, the scene's size), and the slope of the error above it; None if the form is no
        derivative, the slope also if differences are exact up to round-off.
    complex_step : float or None
    second, second_name : agreement with the second derivation, and its name
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
