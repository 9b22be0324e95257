"""Limit: a threshold of a doubt, listed in the documentation with unit, meaning and source; doubts that are not
reported, or that are errors."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any, NamedTuple, Self

from eomgen.base.products import objects_of
from eomgen.errors import Message, Problem

#: Group of the function by which a product gives settings of doubts.
SETTINGS = "eomgen.doubt_settings"


class Limit(float):
    """A number above or below which results, states or scenes are doubted.

    Parameters
    ----------
    value : float
        The threshold.
    unit : str
        SI unit; "1" for a ratio.
    meaning : str
        The compared quantity, as a noun.
    source : str
        Derivation of the value, or a paper with its equation.

    Examples
    --------
    >>> from eomgen.base.limits import Limit
    >>> large = Limit(0.1, "1", "estimated error in parts of the motion", "a plot shows a tenth")
    >>> 0.2 > large, large.unit
    (True, '1')
    """

    unit: str
    meaning: str
    source: str

    def __new__(cls, value: float, unit: str, meaning: str, source: str) -> Self:
        """Return a number with a description."""
        limit = super().__new__(cls, value)
        limit.unit, limit.meaning, limit.source = unit, meaning, source
        return limit

    def __str__(self) -> str:
        """Return meaning and number with the unit."""
        return f"{self.meaning} {float(self):g}{'' if self.unit == '1' else f' {self.unit}'}"

    def __getnewargs__(self) -> tuple[float, str, str, str]:  # type: ignore[override]  # a float has one argument
        """Return the arguments by which a copy is made."""
        return float(self), self.unit, self.meaning, self.source


class DoubtSettings(NamedTuple):
    """Names of doubts that are not reported, and whether all others are errors."""

    quiet: Collection[str] = ()
    strict: bool = False


def doubt_settings(parts: Mapping[str, Any], *, stored: bool = False) -> DoubtSettings:
    """Return the settings of doubts about a scene and its results.

    Parameters
    ----------
    parts : mapping
        Objects by section of a product, as of a ``Description``.
    stored : bool
        Whether other processes read the report, so that options of this process do not count.
    """
    functions = () if stored and not parts else objects_of(SETTINGS)
    return next((settings(parts, stored=stored) for settings in functions), DoubtSettings())


def doubts_as_problems(notes: Iterable[Message], where: str) -> list[Problem]:
    """Return the doubts among notes as problems."""
    parts = [(note, *note.partition("; try: ")) for note in notes if note.doubt]
    return [Problem(where, f"{text} (doubt: {note.doubt})", hint, note.code) for note, text, _, hint in parts]
