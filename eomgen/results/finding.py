"""Finding: the result of one check of a run, for programs and for its message."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal, Self

from eomgen.base.data import asdict, dataclass, replace
from eomgen.errors import Message

Severity = Literal["note", "warning", "failure"]
NOTE: Severity = "note"
WARNING: Severity = "warning"
FAILURE: Severity = "failure"
_HINT = "; try: "


@dataclass(frozen=True)
class Finding:
    """Result of one check of a run.

    Attributes
    ----------
    name : str
        Name of the check, as ``discretisation_error``.
    severity : str
        ``note``: information. ``warning``: results are doubtful. ``failure``: the run is not a success.
    value : float
        Size; ``docs/python.md`` lists meaning and unit of the value for each check. NaN if the check has no size.
    time : float
        Time in the run at which the check sees the fault, s; NaN if the finding concerns the whole run.
    text : str
        One sentence, without the hint.
    hint : str
        Remedy to try; empty if there is none.
    """

    name: str = ""
    severity: Severity = WARNING
    value: float = math.nan
    time: float = math.nan
    text: str = ""
    hint: str = ""

    @classmethod
    def of(cls, sentence: str, value: float = math.nan, time: float = math.nan) -> Self:
        """Return a finding from a sentence that may end with a hint."""
        sentence = str(Message(sentence))
        text, _, hint = sentence.rpartition(_HINT) if _HINT in sentence else (sentence, "", "")
        return cls(value=float(value), time=float(time), text=text, hint=hint)

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Self:
        """Return the finding whose ``described`` is given."""
        numbers = {name: math.nan if data[name] is None else float(data[name]) for name in ("value", "time")}
        return cls(**{**data, **numbers})

    def __str__(self) -> str:
        return f"{self.text}{_HINT}{self.hint}" if self.hint else self.text

    @property
    def code(self) -> str:
        """Code of the check, such as ``W0230``, which ``eomgen explain`` takes; empty without a name, and for a check
        of another distribution."""
        from eomgen.base.message_codes import code_of_finding  # noqa: PLC0415  # for a finding that was read

        return Message(self.name).code or code_of_finding(self.name)

    def rate(self, name: str, severity: Severity) -> Self:
        """Return the same finding with the name of a check and a severity."""
        return replace(self, name=name, severity=severity)

    def as_error(self) -> Self:
        """Return a failure with the same value, and the name of the check in its text.

        Returns
        -------
        Finding
            Of severity ``failure``, as a strict scene has them.

        Examples
        --------
        >>> from eomgen.results.finding import Finding
        >>> Finding("halved_steps", text="the step was halved once").as_error().text
        'the step was halved once (doubt: halved_steps)'
        """
        return replace(self, severity=FAILURE, text=f"{self.text} (doubt: {self.name})")

    def to_dict(self) -> dict[str, Any]:
        """Return the attributes in JSON types; numbers that are not finite are None."""
        finite = {name: getattr(self, name) for name in ("value", "time")}
        return asdict(self) | {name: number if math.isfinite(number) else None for name, number in finite.items()}
