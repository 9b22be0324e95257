"""Units of an FMU: exponents of SI units of a unit label, and units for display."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from eomgen.base.data import dataclass
from eomgen.formula.units.parser import UnitError, read_unit
from eomgen.formula.units.table import measure

#: Attributes of base units by dimensions.
_BASE = {"[mass]": "kg", "[length]": "m", "[time]": "s", "[current]": "A", "[temperature]": "K", "[angle]": "rad"}
#: Units for display, with the number in a unit.
_DISPLAYED: Mapping[str, tuple[tuple[str, float], ...]] = {
    "rad": (("deg", 57.29577951308232),),
    "rad/s": (("deg/s", 57.29577951308232), ("rpm", 9.549296585513721)),
    "m": (("mm", 1000.0),),
    "N": (("kN", 0.001),),
}


@dataclass(frozen=True)
class FmuUnit:
    """A unit of an FMU, by the label of the scene.

    Attributes
    ----------
    exponents : of base units, by attribute
    factor : a number in this unit times the factor is a number in base units
    displayed : names of further units, with the factor from this unit
    """

    name: str
    exponents: Mapping[str, int]
    factor: float
    displayed: tuple[tuple[str, float], ...]


@cache
def unit_of(label: str) -> FmuUnit | None:
    """Return the unit of a label; None for no unit, and for labels that are not products of FMI's base units."""
    if label.strip() in ("", "1"):
        return None
    try:
        size, dimension = measure(read_unit(label))
    except UnitError:
        return None
    if not dimension.keys() <= _BASE.keys():
        return None
    exponents = {attribute: dimension[name] for name, attribute in _BASE.items() if dimension.get(name)}
    return FmuUnit(label, exponents, float(size), _DISPLAYED.get(label, ()))
