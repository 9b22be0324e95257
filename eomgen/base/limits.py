"""Limit: a threshold of a doubt, listed in the documentation with unit, meaning and source; names of doubts that are
not reported."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

from eomgen.base.products import objects_of

#: Group of the functions by which products name doubts that are not reported.
QUIET = "eomgen.quiet"


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


def quiet_names(parts: Mapping[str, Any], *, stored: bool = False) -> set[str]:
    """Return the names of doubts that are not reported.

    Parameters
    ----------
    parts : mapping
        Objects by section of a product, as of a ``Description``.
    stored : bool
        Whether other processes read the report, so that options of this process do not count.
    """
    silences = () if stored and not parts else objects_of(QUIET)
    return {name for names in silences for name in names(parts, stored=stored)}
