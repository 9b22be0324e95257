"""Conversion of quantities to SI, and names of dimensions.

A number stays an exact fraction until the last step, so ``"35 mm"`` is the same double as 0.035.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from eomgen.base.messages import shown
from eomgen.formula.units.parser import Factors, QuantityWithUnit, UnitError, read_unit
from eomgen.formula.units.table import NAMED, measure, names

if TYPE_CHECKING:
    from fractions import Fraction

Dimension = Mapping[str, int]
_ANGLE = "[angle]"
#: Of the travel of a screw.
_PITCH = {"[length]": 1, _ANGLE: -1}


def to_unit(quantity: QuantityWithUnit, unit: str, *, over_time: bool = False) -> float:
    """Return the number of a quantity in a unit.

    Parameters
    ----------
    unit : str
        If the unit is divided by an angle, as the unit of a torsional stiffness is, the angle need not be written: N m
        is taken for N m/rad.
    over_time : bool
        Whether a formula of time could stand instead, for the remedy.

    Raises
    ------
    UnitError
        If the dimension is another one, or the number too large.
    """
    size, dimension = measure(quantity.factors)
    wanted_size, wanted = measure(read_unit(unit))
    if not _matches(dimension, wanted):
        fault = f"{shown(quantity.text)} is {_words(quantity.factors)}, {_expectation(unit)} [E0303]"
        value = _finite(quantity, quantity.number * size)
        raise UnitError(fault, _hint(quantity, wanted, unit, value, over_time=over_time))
    return _finite(quantity, quantity.number * size / wanted_size)


def unit_fault(text: str, factors: Factors, unit: str) -> tuple[str, str] | None:
    """Return reason and remedy if a unit cannot be converted to another unit; None if the conversion exists.

    Parameters
    ----------
    text, factors : the unit, as written and as read
    unit : target of the conversion, coherent in SI
    """
    wanted = measure(read_unit(unit))[1]
    if _matches(measure(factors)[1], wanted):
        return None
    hint = f'"{unit}", or another unit of the same kind'
    if factors == (("g", 1),) and wanted == {"[length]": 1, "[time]": -2}:
        hint = '"g0", 9.80665 m/s^2: g is the gram'
    return f"the unit {shown(text)} is {_kind_text(factors)}, {_expectation(unit)} [E1882]", hint


def _kind_text(factors: Factors) -> str:
    words = _words(factors)
    return words.replace("a ", "of a ", 1) if words.startswith("a ") else words.replace("an ", "of an ", 1)


def misplaced_kind(label: str, unit: str) -> str:
    """Return in words the kind of a quantity with the unit ``label`` and the expected kind; empty if the quantity could
    be the expected one, angles being no dimension here.

    Parameters
    ----------
    label : unit of the quantity
    unit : that is expected, coherent in SI
    """
    factors = read_unit(label)
    result, wanted = (
        {name: power for name, power in measure(each)[1].items() if name != _ANGLE}
        for each in (factors, read_unit(unit))
    )
    words = _words(factors)
    named = words if words.startswith("in ") else f"{words} ({label.strip()})"
    return "" if result == wanted else f"{named}, {_expectation(unit)}"


def to_si(quantity: QuantityWithUnit) -> tuple[float, str]:
    """Return the number of a quantity (``units.parser``) in SI, and the SI unit. Raises UnitError if the number is not
    finite."""
    size, _ = measure(quantity.factors)
    return _finite(quantity, quantity.number * size), coherent(quantity.factors)


def is_coherent(factors: Factors, quantity: QuantityWithUnit) -> bool:
    """Return whether a unit is the SI unit of a quantity."""
    size, dimension = measure(factors)
    return size == 1 and dimension == measure(quantity.factors)[1]


def coherent(factors: Factors) -> str:
    """Return the unit of SI of the same kind: m for mm, rad/s for rpm, N/m for kN/m."""
    powers: dict[str, int] = {}
    for name, exponent in factors:
        for part, power in read_unit(names()[name].coherent):
            powers[part] = powers.get(part, 0) + exponent * power
    above = _product((name, power) for name, power in powers.items() if power > 0)
    below = [(name, -power) for name, power in powers.items() if power < 0]
    if not below:
        return above or "1"
    divisor = _product(below)
    return f"{above or '1'}/{f'({divisor})' if len(below) > 1 else divisor}"


def _product(powers: Iterable[tuple[str, int]]) -> str:
    return " ".join(name if power == 1 else f"{name}^{power}" for name, power in powers)


def _matches(dimension: Dimension, wanted: Dimension) -> bool:
    if dimension == wanted:
        return True
    if wanted == _PITCH:  # which is given by the turn, or by the radian
        return False
    without_angle = {name: power for name, power in wanted.items() if name != _ANGLE}
    return wanted.get(_ANGLE, 0) < 0 and dimension == without_angle


def _expectation(unit: str) -> str:
    return f"{NAMED.get(unit, 'a quantity')} in {unit} is expected"


def _words(factors: Factors) -> str:
    unit = coherent(factors)
    if unit in NAMED:
        return NAMED[unit]
    dimension = measure(factors)[1]
    if not dimension:
        return "a plain number"
    return next((words for known, words in NAMED.items() if measure(read_unit(known))[1] == dimension), f"in {unit}")


def _hint(quantity: QuantityWithUnit, wanted: Dimension, unit: str, value: float, *, over_time: bool) -> str:
    """Return the remedy for a quantity of another dimension than ``wanted``, the dimension of ``unit``: the unit or
    formula that may be meant. ``value`` is the number in SI; ``over_time``: a formula of time could stand instead."""
    dimension = measure(quantity.factors)[1]
    times = tuple((name, abs(power)) for name, power in quantity.factors)
    if times != quantity.factors and measure(times)[1] == wanted:
        return f'"{float(quantity.number):.6g} {_product(times)}", a product of units'
    if wanted == _PITCH and dimension == {"[length]": 1}:
        return f'"{quantity.text.strip()}/rev", the travel of a turn'
    if over_time and "[time]" not in wanted and dimension == {**wanted, "[time]": -1}:
        return f'"{value:.6g} * t" where it changes at that rate'
    if wanted == {_ANGLE: 1, "[time]": -1} and dimension == {"[time]": -1}:
        return f'"{60 * value:.6g} rpm" where a cycle is a turn, or "{value:.6g} rad/s"'
    if wanted == {"[time]": 1} and dimension == {"[time]": -1}:
        period = f'the period, "{1 / value:.6g} s", or ' if value > 0 else ""
        return f"a time in s: {period}1 / (2 pi f) where f is the corner frequency of a filter"
    if wanted == {"[length]": 1, "[time]": -2} and quantity.factors == (("g", 1),):
        return f'g is the gram: "{float(quantity.number):.6g} g0", g0 being 9.80665 m/s^2'
    return f'"{value:.6g} {unit}"'


def _finite(quantity: QuantityWithUnit, value: Fraction) -> float:
    try:
        return float(value)
    except OverflowError:
        fault = f"{shown(quantity.text)} is out of the range of double precision in SI [E0304]"
        raise UnitError(fault, "a number below 1e300") from None
