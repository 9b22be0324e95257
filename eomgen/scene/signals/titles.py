"""Units in titles of tables: ``time [ms]``, ``force / kN``, ``time_ms``."""

from __future__ import annotations

import re

from eomgen.formula.units.parser import Factors, UnitError, read_unit
from eomgen.formula.units.table import names

_IN_BRACKETS = re.compile(r".*[\[(]([^\[\]()]+)[\])]\s*")
_OVER = re.compile(r"[^/]*\S\s*/\s*([^/\s]+)\s*")
_LAST_WORD = re.compile(r"\s*(\w*?)[_\s]([A-Za-z]+)\s*")
#: Last words that are units after any name, and last words that are units after a name of time; others may be names.
_UNITS = frozenset({"ms", "us", "mm", "cm", "km", "deg", "rpm", "kN", "kPa", "MPa"})
_OF_TIMES = frozenset({"ms", "us", "ns", "min", "h", "hours", "minutes", "milliseconds"})
_TIMES = frozenset({"t", "time", "zeit", "temps", "tiempo"})


def unit_of_title(title: str) -> str:
    """Return the unit named in a title; empty if the title names no known unit."""
    if marked := _IN_BRACKETS.fullmatch(title) or _OVER.fullmatch(title):
        unit = marked[1].strip()
    elif last := _LAST_WORD.fullmatch(title):
        unit = last[2] if last[2] in (_OF_TIMES if last[1].lower() in _TIMES else _UNITS) else ""
    else:
        return ""
    return unit if _factors(unit) else ""


def is_in_si(unit: str) -> bool:
    """Return whether numbers of a scene are in a unit."""
    return all(names()[name].is_coherent for name, _ in read_unit(unit))


def _factors(unit: str) -> Factors:
    try:
        return read_unit(unit)
    except UnitError:
        return ()
