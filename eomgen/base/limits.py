"""Limit: a threshold of a doubt, listed in the documentation with unit, meaning and source; doubts that are not
reported, or that are errors."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from contextvars import ContextVar
from typing import Any, NamedTuple, Self

from eomgen.base.products import objects_of
from eomgen.errors import Problem


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
    """Names of doubts that are not reported, whether all others are errors, and the function that makes problems."""

    quiet: Collection[str] = ()
    strict: bool = False
    problems: Callable[..., list[Problem]] = list


NO_SETTINGS = DoubtSettings()
#: Settings of options of the command line.
CALLED: ContextVar[DoubtSettings] = ContextVar("doubts", default=NO_SETTINGS)


def doubt_settings(parts: Mapping[str, Any], *, stored: bool = False) -> DoubtSettings:
    """Return the settings of doubts about a scene and results: which doubts are silenced, and whether the rest are
    errors.

    Parameters
    ----------
    parts : mapping
        Objects by section of a product, as of a ``Description``.
    stored : bool
        Whether other processes read the report, so that options of this process do not count.
    """
    has_settings = parts or (not stored and CALLED.get() is not NO_SETTINGS)
    functions = objects_of("eomgen.doubt_settings") if has_settings else ()
    return functions[0](parts, stored=stored) if functions else NO_SETTINGS
