"""Dimensions of units by exponents, for units of formulas; without pint, because every formula is judged."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from typing import NamedTuple

from eomgen.formula.units.parser import Factors, UnitError, read_unit
from eomgen.formula.units.table import NAMED, UNITS, names

_BASE = ("kg", "m", "s", "A", "K")
_ANGLE = "rad"
_DEFINITIONS = {unit.symbol: unit.definition for unit in UNITS}
_TERM = re.compile(r"([*/]?)\s*([a-z_]+)(?:\*\*(\d))?")


class Dimension(NamedTuple):
    """Exponents of a unit.

    Attributes
    ----------
    powers : of kg, m, s, A and K
    angle : of rad; None if unknown, because radians vanish in products: rad times m is a length
    """

    powers: tuple[float, ...]
    angle: float | None = 0.0

    def times(self, other: Dimension, sign: float = 1.0) -> Dimension:
        """Return the dimension of a product, of a quotient with ``sign`` -1."""
        return Dimension(tuple(a + sign * b for a, b in zip(self.powers, other.powers, strict=True)), None)

    def power(self, exponent: float) -> Dimension:
        """Return the dimension of a power."""
        return Dimension(tuple(exponent * each for each in self.powers), None)

    @property
    def is_number(self) -> bool:
        """Whether values are plain numbers or angles."""
        return not any(self.powers)

    def __str__(self) -> str:
        return _text(self)


@cache
def dimension_of(label: str) -> Dimension | None:
    """Return the dimension of a unit; None for a text that is not a unit."""
    try:
        return _of_factors(read_unit(label)) if label.strip() else None
    except UnitError:
        return None


def _of_factors(factors: Factors) -> Dimension:
    powers = dict.fromkeys((*_BASE, _ANGLE), 0.0)
    for name, exponent in factors:
        for base, power in _of_coherent(names()[name].coherent):
            powers[base] += exponent * power
    return Dimension(tuple(powers[base] for base in _BASE), powers[_ANGLE])


@cache
def _of_coherent(unit: str) -> tuple[tuple[str, float], ...]:
    """Return the exponents of the base units of a coherent unit of SI."""
    if unit in _BASE or unit == _ANGLE:
        return ((unit, 1.0),)
    factors: Iterable[tuple[str, int]] = read_unit(unit)
    if unit in _DEFINITIONS:
        terms = _TERM.findall(_DEFINITIONS[unit])
        factors = [(word, int(power or 1) * (-1 if sign == "/" else 1)) for sign, word, power in terms]
    result: dict[str, float] = {}
    for name, exponent in factors:
        for base, power in _of_coherent(names()[name].coherent):
            result[base] = result.get(base, 0.0) + exponent * power
    return tuple(result.items())


@cache
def _named() -> dict[Dimension, str]:
    result: dict[Dimension, str] = {}
    for unit in NAMED:
        result.setdefault(_of_factors(read_unit(unit)), unit)
    return result


@cache
def _text(dimension: Dimension) -> str:
    """Return the unit of SI with a dimension, by a common name if there is one."""
    known = _named().get(dimension if dimension.angle is not None else Dimension(dimension.powers))
    if known and not (known == "Hz" and dimension.angle is None):
        return known
    powers = [*zip(_BASE, dimension.powers, strict=True), (_ANGLE, dimension.angle or 0.0)]
    above = [name if power == 1 else f"{name}^{power:g}" for name, power in powers if power > 0]
    below = [name if power == -1 else f"{name}^{-power:g}" for name, power in powers if power < 0]
    divisor = f"({' '.join(below)})" if len(below) > 1 else "".join(below)
    return f"{' '.join(above) or '1'}/{divisor}" if divisor else " ".join(above) or "1"
